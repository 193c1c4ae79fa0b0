"""Volume and condensed route step by step with friction on finite elements, any number of ranks
(V4.0)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from fem_problems import BOX_DT, block, thrown_box
from tipped import ROUGH_ON_ONE_SIDE, RUBBER, tipped

from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.core.protocols import FrictionLaw
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import BodyForce, Prescribed
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.laws.friction import Coulomb, Tresca
from vi_contact.laws.mass import ConsistentMass, Redistributed
from vi_contact.run.cross_check import CrossChecked
from vi_contact.run.march import march
from vi_contact.schemes.trapezoidal import Trapezoidal
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.volume.route import ReducedNewton, Volume


def compared(
    problem: ContactProblem, scheme: Any, steps: int
) -> tuple[CrossChecked, list[tuple[int, int, int]]]:
    """The cross-check of a run, and how many points are open, stick and slip in every step."""
    checked = CrossChecked(Condensed(), [Volume(method=ReducedNewton())])
    states = []
    for _, report in march(problem, scheme=scheme, solver=checked, dt=BOX_DT, steps=steps):
        result = report.result
        slip = np.linalg.norm(
            problem.surface.tangential_values(result.x) - report.step.slip0, axis=1
        )
        slips = result.active & (slip > 0.0)
        found = (~result.active).sum(), (result.active & ~slips).sum(), slips.sum()
        states.append(tuple(int(count) for count in problem.surface.comm.sum(np.array(found))))
    return checked, states


@pytest.mark.long
@pytest.mark.parametrize("angle", [0.0, pytest.param(0.3, marks=pytest.mark.slow)])
@pytest.mark.parametrize("simplices", [False, True], ids=["quadrilaterals", "triangles"])
@pytest.mark.parametrize("friction", ROUGH_ON_ONE_SIDE, ids=["coulomb", "tresca"])
def test_routes_agree_in_the_plane(
    comm: Any, friction: FrictionLaw, simplices: bool, angle: float
) -> None:
    """u, r_n and r_t of every step to 1e-9; open, sticking and slipping points in the same step."""
    problem = tipped(comm, friction, simplices=simplices, angle=angle)
    checked, states = compared(problem, ZienkiewiczWoodTaylor(), 20)
    found = checked.found[0]
    assert found.size["r_t"] > 0.0 and found.steps == 20
    assert max(found.relative.values()) <= 1e-9
    assert max(min(counts) for counts in states) >= 2
    assert checked.report()["Volume(ReducedNewton)"]["r_t"] == found.relative["r_t"]


@pytest.mark.serial
@pytest.mark.slow
@pytest.mark.parametrize("friction", [Coulomb(0.3), Tresca(2e3)], ids=repr)
def test_routes_agree_in_space(comm: Any, friction: FrictionLaw) -> None:
    """The circular cone on an inclined plane, another scheme: to 1e-9."""
    box = thrown_box(comm, angle=0.3, simplices=True, divisions=(4, 3, 3))
    problem = replace(box, friction=friction, mass=Redistributed())
    checked, states = compared(problem, Trapezoidal(), 10)
    assert 0.0 < checked.worst <= 1e-9
    assert max(slips for _, _, slips in states) >= 10


def test_nodes_with_one_and_with_two_free_tangents(comm: Any) -> None:
    """On rollers along z some points have one free tangent, and rub in an interval, the others in a
    disk."""
    mesh, tags = block(comm, lengths=(1.5, 1.0, 1.2), divisions=(3, 2, 2))
    system = assemble(
        mesh,
        RUBBER,
        prescribed=[Prescribed(tags["front"], components=(2,))],
        loads=BodyForce((0.0, -9.81e3, 0.0)),
        initial_velocity=lambda x: np.outer(x[:, 1] + 1.0, [0.5, -1.0, 0.0]),
    )
    plane = HalfSpace(point=(0.0, -1e-3, 0.0), normal=(0.0, 1.0, 0.0))
    surface = contact_surface(system, tags["bottom"], obstacle=plane)
    problem = ContactProblem(system, surface, friction=Coulomb(0.3), mass=ConsistentMass())
    checked, _ = compared(problem, ZienkiewiczWoodTaylor(), 15)
    assert 0.0 < checked.worst <= 1e-9 and checked.found[0].size["r_t"] > 0.0
