"""Gravity stages by conjugate gradients, of bodies that contact alone holds: as with a factor, to
1e-9, without one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fem_problems import CONCRETE, max_over_ranks
from mpi4py import MPI
from standing import standing

import vi_contact as vc
from demos.parts.problems.channel import Channel, build
from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.core.obstacles import HalfSpace
from vi_contact.fem.mesh import build_mesh
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.channel import ChannelMesh
from vi_contact.meshes.two_blocks import Blocks
from vi_contact.solvers.iterative.route import Iterative, PreparedIterative

COMM = MPI.COMM_WORLD
SPACE: dict[str, Any] = {"lengths": (1.0, 3.0, 1.0), "divisions": (3, 6, 3), "simplices": True}


def stack(d: int) -> vc.ContactProblem:
    """A block on a block on the ground; nothing holds either."""
    grid = {"divisions": (4, 3, 3)[:d]}
    bodies = {
        "upper": BlockMesh(lengths=(1.0, 1.0, 1.0)[:d], corner=(0.5, 1.0, 0.0)[:d], **grid),
        "lower": BlockMesh(lengths=(2.0, 1.0, 1.0)[:d], divisions=(8, 3, 3)[:d]),
    }
    mesh, tags = build_mesh(Blocks(bodies), COMM)
    system = fem.assemble(mesh, CONCRETE, loads=fem.BodyForce((0.0, -CONCRETE.rho * 9.81, 0.0)[:d]))
    ground = HalfSpace(point=(0.0, -1e-4, 0.0)[:d], normal=(0.0, 1.0, 0.0)[:d])
    pair = fem.contact_pair(system, tags["upper_bottom"], tags["lower_top"])
    foot = fem.contact_surface(system, tags["lower_bottom"], obstacle=ground)
    return vc.ContactProblem(system, fem.joined_surfaces(pair, foot))


def channel() -> vc.ContactProblem:
    """Concrete in soil two hundred times as soft."""
    return build(Channel(ChannelMesh(size=0.5, far=1.0)), COMM).problem(excitation=())


# name -> problem, linear iterations in all
PROBLEMS: dict[str, tuple[Callable[[], vc.ContactProblem], int]] = {
    "inclined": (lambda: standing(angle=0.3), 200),
    "with a gap": (lambda: standing(gap=0.01), 230),
    "in space": (lambda: standing(**SPACE), 310),
    "stack": (lambda: stack(2), 500),
    "stack in space": (lambda: stack(3), 770),
    "channel": (channel, 3800),
    "pushed and rubbing": (
        lambda: replace(standing(push=1e3, **SPACE), friction=vc.Coulomb(0.5)),
        900,
    ),
    "channel that rubs": (lambda: replace(channel(), friction=vc.Coulomb(0.5)), 8000),
}


class Watched(Iterative):
    """Keeps what it prepared."""

    prepared: list[PreparedIterative] = []

    def prepare(self, *given: Any) -> PreparedIterative:
        self.prepared.append(super().prepare(*given))
        return self.prepared[-1]


@pytest.mark.slow
@pytest.mark.parametrize("name", PROBLEMS)
def test_as_with_a_factor(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where the body stands along the ground, which nothing but its start says."""
    problem, most = PROBLEMS[name][0](), PROBLEMS[name][1]
    exact = vc.static_equilibrium(problem, solver=vc.Condensed())
    # nothing is factorised
    for factor in ("petsc_algebra.PetscFactor", "copied_factor.ContactLast"):
        monkeypatch.setattr(f"vi_contact.fem.{factor}", None)
    Watched.prepared.clear()
    found = vc.static_equilibrium(problem, solver=Watched())
    assert max_over_ranks(COMM, found.u - exact.u) <= 1e-9 * max_over_ranks(COMM, exact.u)
    assert max_over_ranks(COMM, found.r_n - exact.r_n) <= 1e-9 * max_over_ranks(COMM, exact.r_n)
    assert np.array_equal(found.active, exact.active)
    if found.r_t is not None and exact.r_t is not None:
        assert max_over_ranks(COMM, found.r_t - exact.r_t) <= 1e-9 * max_over_ranks(COMM, exact.r_n)
    (prepared,) = Watched.prepared
    assert prepared.kind == "gamg" and prepared.work.linear_iterations <= most


@pytest.mark.parametrize("kind", ["jacobi", "icc"])
def test_the_preconditioner_does_not_move_the_body(kind: str) -> None:
    """Those that do not see rigid motions leave resultants over, which the next steps carry."""
    problem = standing(**SPACE)
    exact = vc.static_equilibrium(problem, solver=vc.Condensed())
    found = vc.static_equilibrium(problem, solver=Iterative(kind))
    assert max_over_ranks(COMM, found.u - exact.u) <= 1e-9 * max_over_ranks(COMM, exact.u)


def test_loads_that_carry_a_body_off_are_named() -> None:
    with pytest.raises(
        InputError, match=r"its loads carry it off along \(1, 0\) and neither contact"
    ):
        vc.static_equilibrium(standing(push=1.0), solver=Iterative())
