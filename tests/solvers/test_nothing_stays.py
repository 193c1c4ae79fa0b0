"""What a problem took in PETSc is given back once Python has dropped it, its mesh too."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("dolfinx")
pytestmark = pytest.mark.serial

RUN = """
from dataclasses import replace
from mpi4py import MPI
from fem_problems import thrown_box
import vi_contact as vc
from vi_contact.fem.matrices import half
from vi_contact.fem.mesh.communicators import give_back, keep_communicator

half.COMPACT = 0
for mu in (0.0, 0.3):
    friction = vc.Coulomb(mu) if mu else vc.Frictionless()
    for solver in (vc.Condensed(), vc.Iterative(), vc.Volume()):
        problem = replace(thrown_box(MPI.COMM_WORLD), friction=friction)
        for _ in vc.march(problem, solver=solver, dt=1e-3, steps=2):
            pass
del problem, solver, _
give_back(keep_communicator(MPI.COMM_WORLD))
"""


KEPT = """
import numpy as np
import vi_contact as vc

chain = vc.system_from_arrays(
    np.ones(3),
    None,
    1e6 * np.array([[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]]),
    coordinates=[[0.0], [1.0], [2.0]],
    v0=np.full(3, -1.0),
)
wall = vc.contact_points(chain, [0], [-1.0], gap0=1e-3)
problem = vc.ContactProblem(chain, wall, impact=vc.Inelastic())
steppers = [vc.Stepper(problem, solver=solver) for solver in (vc.Iterative(), vc.Volume())]
for stepper in steppers:
    stepper.accept(stepper.attempt(1e-4))
"""


@pytest.mark.long
def test_every_matrix_solver_and_vector_is_freed(tmp_path: Path) -> None:
    """As many destructions as creations in PETSc's own account."""
    account, support = tmp_path / "log", str(Path(__file__).parents[1] / "support")
    paths = os.pathsep.join(
        [support, str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")]
    )
    environment = {**os.environ, "PYTHONPATH": paths, "PETSC_OPTIONS": f"-log_view :{account}"}
    done = subprocess.run(
        [sys.executable, "-c", RUN], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    table = re.findall(
        r"^ *([A-Z][A-Za-z ]+?) +(\d+) +(\d+)$", account.read_text(), flags=re.MULTILINE
    )
    kinds = {name: (int(made), int(freed)) for name, made, freed in table}
    assert kinds["Matrix"][0] > 50
    for name in ("Matrix", "Vector", "Krylov Solver", "Preconditioner", "Index Set"):
        made, freed = kinds[name]
        assert made == freed, f"{made - freed} of {made}: {name}"


def test_programs_end_while_they_hold_a_solver() -> None:
    """Solvers of matrices without a mesh, which a program keeps to its end, do not crash there."""
    paths = os.pathsep.join([str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")])
    environment = {**os.environ, "PYTHONPATH": paths}
    done = subprocess.run(
        [sys.executable, "-c", KEPT], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
