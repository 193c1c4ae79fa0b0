"""Bodies of fewer cells and nodes than there are ranks: a rank that owns nothing takes part in
everything."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from fem_problems import CONCRETE, block

from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.core.protocols import Frictionless
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.fem.output.fields import XDMF
from vi_contact.laws.excitation import Harmonic
from vi_contact.laws.friction import Coulomb
from vi_contact.laws.mass import ConsistentMass
from vi_contact.run.recorders import Contact, Energy, Probe
from vi_contact.run.simulate import Solution, simulate
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.volume.route import Volume

FEW = {
    "bar": {"lengths": (2.0,), "divisions": (1,)},
    "triangles": {"lengths": (2.0, 1.0), "divisions": (1, 1), "simplices": True},
    "turned": {"lengths": (2.0, 1.0), "divisions": (2, 1), "angle": 0.3},
    "hexahedra": {"lengths": (2.0, 1.0, 1.0), "divisions": (2, 1, 1)},
}


def problem(comm: Any, spec: dict[str, Any], solver: Any) -> ContactProblem:
    """The body, clamped on its left, beside a rough half-space on its right."""
    mesh, tags = block(comm, **spec)
    d, across = len(spec["lengths"]), direction(spec)
    system = assemble(mesh, CONCRETE, clamped=tags["left"])
    wall = HalfSpace(point=tuple(2.000001 * across), normal=tuple(-across))
    surface = contact_surface(system, tags["right"], obstacle=wall)
    friction = Coulomb(0.3) if d > 1 and not isinstance(solver, Volume) else Frictionless()
    shake = Harmonic(30.0, 40.0, direction=tuple(across + 0.3 * np.eye(d)[-1]))
    return ContactProblem(
        system, surface, friction=friction, excitation=shake, mass=ConsistentMass()
    )


def direction(spec: dict[str, Any]) -> Any:
    """Along the body."""
    angle = spec.get("angle", 0.0)
    return np.array([np.cos(angle), np.sin(angle), 0.0][: len(spec["lengths"])])


def shaken(
    body: ContactProblem, spec: dict[str, Any], out: Path | None, steps: int, **more: Any
) -> Solution:
    """A run with all recorders."""
    record = [Energy(), Contact(), Probe({"end": tuple(2.0 * direction(spec))}, acceleration=True)]
    return simulate(
        body,
        scheme=ZienkiewiczWoodTaylor(),
        dt=5e-4,
        steps=steps,
        record=record,
        out=out,
        progress=False,
        fields=None if out is None else XDMF(every=10),
        **more,
    )


CASES = [
    ("bar", Condensed()),
    ("triangles", Condensed()),
    ("turned", Volume()),
    ("hexahedra", Condensed()),
]


@pytest.mark.parametrize(
    ("name", "solver"), CASES, ids=[f"{name} {type(solver).__name__}" for name, solver in CASES]
)
def test_a_rank_without_nodes(comm: Any, shared_tmp: Path, name: str, solver: Any) -> None:
    """Assembly, contact, recorders, fields, checkpoint and restart, as on one rank."""
    from mpi4py import MPI

    if comm.size == 1:
        pytest.skip("one rank owns everything")
    spec = FEW[name]
    body = problem(comm, spec, solver)
    shaken(body, spec, shared_tmp, 20, solver=solver)
    spread = shaken(body, spec, shared_tmp, 40, solver=solver, restart=True).history
    alone = shaken(problem(MPI.COMM_SELF, spec, solver), spec, None, 40, solver=solver).history
    assert alone["contact_active"].max() > 0
    for column in ("u_x_end", "contact_resultant", "energy_kinetic", "a_x_end"):
        size = np.abs(alone[column]).max()
        assert np.abs(spread[column] - alone[column]).max() < 1e-9 * size, column
