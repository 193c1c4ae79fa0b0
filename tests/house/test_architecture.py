"""What runs without finite elements does, and the main package gives what its list says.

The floors of the rooms are a contract in pyproject.toml, which tests/lint.sh checks.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import vi_contact

pytestmark = pytest.mark.serial
PACKAGE = Path(vi_contact.__file__).parent

SMALL_RUN = """
import sys
import vi_contact.fem
import vi_contact as vc
sys.path.insert(0, SUPPORT)
from shaken import shaken
for scheme in (vc.ZienkiewiczWoodTaylor(), vc.SS22(), vc.LinearMultistep.newmark()):
    for method in (ActiveSet(), Hildreth()):
        problem = shaken(vc.Inelastic())
        solver = vc.Condensed(method)
        for state, report in vc.march(problem, scheme=scheme, solver=solver, dt=5e-3, steps=9):
            pass
        assert report.new.active.all() and report.certificate.worst < 1e-12
K, points = [[2.0, -1.0], [-1.0, 1.0]], [[0.0], [1.0]]
system = vc.system_from_arrays([1.0, 2.0], None, K, coordinates=points, load=[0.0, 1.0])
problem = vc.ContactProblem(system, vc.contact_points(system, [1], [1.0]), mass=vc.ConsistentMass())
*_, (state, _) = vc.march(problem, scheme=vc.MoreauJean(), dt=1e-2, steps=9)
assert state.r_n[0] > 0.0 and vi_contact.fem.XDMF(every=2).every == 2
heavy = {"petsc4py", "dolfinx", "ufl", "basix", "mpi4py", "gmsh", "matplotlib", "h5py"}
print(sorted(heavy & set(sys.modules)))
"""
METHODS = """from vi_contact.solvers.normal.active_set import ActiveSet
from vi_contact.solvers.normal.hildreth import Hildreth
"""


def _python(script: str) -> str:
    done = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        cwd=PACKAGE.parent,
        check=False,
        env=dict(os.environ),
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_core_runs_without_finite_elements():
    """``import vi_contact``, schemes, condensed solver and impact laws import none of the heavy
    packages."""
    support = Path(__file__).parents[1] / "support"
    assert _python(METHODS + SMALL_RUN.replace("SUPPORT", repr(str(support)))) == "[]"


def test_table_of_contents_is_complete_and_true():
    """Every public name can be imported (``vi_contact.core.lazy``), and nothing else pretends to be
    there."""
    assert len(vi_contact.__all__) == len(set(vi_contact.__all__)) > 40
    assert set(dir(vi_contact)) == set(vi_contact.__all__)
    for public in vi_contact.__all__:
        assert getattr(vi_contact, public) is not None, public
    with pytest.raises(AttributeError, match="no attribute 'Nonsense'"):
        _ = vi_contact.Nonsense
