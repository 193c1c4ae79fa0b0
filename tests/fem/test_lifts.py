"""Bodies that stages add and remove: columns in lifts, by hand, and fill on what has moved."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.core.surfaces import empty_surface
from vi_contact.laws import LinearElastic, MohrCoulomb
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.two_blocks import TwoBlocks

RISE = 1.5  # m, of a lift
LIFTS = 4
WEIGHT = 2000.0 * 9.80665  # N/m³
ELASTIC = LinearElastic(50e6, 0.3, 2000.0)
SOIL = MohrCoulomb(50e6, 0.3, 2000.0, cohesion=5e3, phi=30.0, psi=30.0)
MODULUS = 50e6 * 0.7 / (1.3 * 0.4)  # Pa, of a column between smooth walls


class Column:
    """A column between smooth walls, of which some lifts are there."""

    def __init__(self, comm: Any, law: Any) -> None:
        mesh = BlockMesh(lengths=(1.0, LIFTS * RISE), divisions=(1, 2 * LIFTS))
        self.mesh, self.tags = fem.build_mesh(mesh, comm)
        self.law = law
        self.lifts = [
            fem.Cells.where(f"lift_{k}", self.mesh, lambda x, k=k: self._is_in(x[1], k))
            for k in range(LIFTS)
        ]

    @staticmethod
    def _is_in(y: Any, k: int) -> Any:
        return (y > (k - 0.01) * RISE) & (y < (k + 1.01) * RISE)

    def stand(self, *there: int) -> vc.ContactProblem:
        """The problem of these lifts."""
        walls = [fem.Prescribed(self.tags[side], components=(0,)) for side in ("left", "right")]
        system = fem.assemble(
            self.mesh,
            self.law,
            clamped=self.tags["bottom"],
            prescribed=walls,
            absent=[lift for k, lift in enumerate(self.lifts) if k not in there],
            integration="bbar" if isinstance(self.law, MohrCoulomb) else "full",
        )
        surface = empty_surface(system.space.comm, 2)  # type: ignore[attr-defined]
        return vc.ContactProblem(vc.with_weight(system), surface)

    def settle(self, problem: Any, state: Any, *there: int) -> tuple[Any, Any]:
        """The equilibrium of these lifts after that of others."""
        begun, first = fem.place(problem, state, self.stand(*there))
        return begun, vc.static_equilibrium(begun, state=first)

    def pile_up(self) -> tuple[Any, Any]:
        """All lifts, one after the other."""
        problem = self.stand(0)
        state = vc.static_equilibrium(problem)
        for k in range(1, LIFTS):
            problem, state = self.settle(problem, state, *range(k + 1))
        return problem, state


def find_nodal(problem: Any, state: Any) -> Any:
    """Displacements of the owned nodes, held ones too [m]."""
    return problem.system.space.expand(problem.cartesian(state.u), 0.0)


@pytest.mark.parametrize("law", [ELASTIC, SOIL], ids=["elastic", "yielding"])
def test_a_column_in_lifts_settles_as_by_hand(comm: Any, law: Any) -> None:
    """The top of lift k, from 1: under its own weight (k - ½) w h²/M, and k w h²/M for each lift
    that comes later, as so many below it bear one lift more. Fill is placed up to its line."""
    column = Column(comm, law)
    problem, state = column.pile_up()
    assert state.certificate is not None and state.certificate <= 1e-9
    heights = problem.system.space.points[:, 1] / RISE
    tops = np.abs(heights - np.rint(heights)) < 1e-9
    k = heights[tops]
    expected = -(np.maximum(k - 0.5, 0.0) + (LIFTS - k) * k) * WEIGHT * RISE**2 / MODULUS
    settled = find_nodal(problem, state)[tops, 1]
    scale = LIFTS**2 * WEIGHT * RISE**2 / MODULUS
    assert np.abs(settled - expected).max(initial=0.0) <= 1e-10 * scale
    # the stress is that of all that lies above
    sigma = state.memory["material_0_sigma"][..., 1].mean(axis=1)
    middles = problem.system.internal.find_middles("material_0_sigma")[:, 1]
    bottom = LIFTS * RISE * WEIGHT
    assert np.abs(sigma + bottom - WEIGHT * middles).max(initial=0.0) <= 1e-10 * bottom


def test_a_removed_lift_unloads_the_others_exactly(comm: Any) -> None:
    """Elastic ground goes back to where it was before the last lift, with its stress; what is gone
    remembers nothing."""
    column = Column(comm, ELASTIC)
    problem = column.stand(0, 1)
    below = vc.static_equilibrium(problem)
    loaded, heavy = column.settle(problem, below, 0, 1, 2)
    again, state = column.settle(loaded, heavy, 0, 1)
    size = np.abs(below.u).max(initial=np.finfo(float).tiny)
    assert np.abs(state.u - below.u).max(initial=0.0) <= 1e-11 * size
    for name, values in below.memory.items():
        assert state.memory[name].shape == values.shape
        scale = WEIGHT * RISE * LIFTS
        assert np.abs(state.memory[name] - values).max(initial=0.0) <= 1e-11 * scale
    assert again.system.space.unknowns == problem.system.space.unknowns  # type: ignore[attr-defined]


@pytest.mark.serial
def test_what_is_placed_touches_what_has_moved(comm: Any) -> None:
    """A block is placed on ground that has settled: it stands on it with its weight, and its
    settlement counts from then on."""
    lower = BlockMesh(lengths=(3.0, 2.0), divisions=(6, 4))
    upper = BlockMesh(lengths=(1.0, 1.0), divisions=(2, 2))
    mesh = TwoBlocks(lower=lower, upper=upper, offset=(1.0,))
    built, tags = fem.build_mesh(mesh, comm)

    def stand(absent: Any) -> vc.ContactProblem:
        materials = [(tags["lower"], SOIL), (tags["upper"], ELASTIC)]
        system = vc.with_weight(
            fem.assemble(
                built,
                materials,
                clamped=tags["lower_bottom"],
                absent=absent,
                integration="bbar",
            )
        )
        surface = fem.contact_pair(
            system, tags["upper_bottom"], tags["lower_top"], matching=fem.DualMortar()
        )
        return vc.ContactProblem(system, surface, friction=vc.Coulomb(0.5))

    ground = stand([tags["upper"]])
    assert ground.surface.total == 0
    before = vc.static_equilibrium(ground)
    begun, first = fem.place(ground, before, stand([]))
    assert first.active.all()
    state = vc.static_equilibrium(begun, state=first)
    assert state.r_n.sum() == pytest.approx(WEIGHT, rel=1e-8)
    assert np.abs(state.u).max() > 0.0 and state.active.any()


@pytest.mark.serial
def test_a_run_goes_on_after_the_lifts(comm: Any) -> None:
    """The column stands still when it is marched, and its ledger is closed."""
    column = Column(comm, SOIL)
    problem, state = column.pile_up()
    found = vc.simulate(
        problem, state=state, dt=1e-3, steps=10, record=[vc.Energy()], progress=False
    )
    assert np.abs(found.state.u - state.u).max() <= 1e-9 * np.abs(state.u).max()
    assert found.facts["energy_defect"] <= 1e-9


@pytest.mark.serial
def test_what_cannot_be_placed_is_refused(comm: Any) -> None:
    column = Column(comm, ELASTIC)
    problem = column.stand(0)
    state = vc.static_equilibrium(problem)
    plain = fem.assemble(column.mesh, ELASTIC, clamped=column.tags["bottom"])
    forgetful = vc.ContactProblem(plain, empty_surface(plain.space.comm, 2))  # type: ignore[attr-defined]
    with pytest.raises(InputError, match=r"assemble both systems with absent="):
        fem.place(problem, state, forgetful)
    with pytest.raises(InputError, match="all cells of the mesh are absent"):
        column.stand()
    other = Column(comm, ELASTIC).stand(0, 1)
    with pytest.raises(InputError, match="on one mesh"):
        fem.place(problem, state, other)
