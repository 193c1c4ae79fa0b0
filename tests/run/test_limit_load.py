"""Limit loads by load steps: stacks by hand, below the bound of rigid blocks, bodies that yield."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from all_ranks import seen
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem, meshes, plots
from vi_contact.core.errors import InputError, NoEquilibrium, StepFailure
from vi_contact.core.surfaces import empty_surface
from vi_contact.laws import J2
from vi_contact.run.limit_search import seek_limit
from vi_contact.run.static import Equilibria

COMM = MPI.COMM_WORLD
STONE = vc.LinearElastic(E=1e9, nu=0.2, rho=2000.0)
GRAVITY = 9.80665
RTOL = 2e-2


def on_the_ground(mesh: Any, mu: float, *, weight: bool = True) -> tuple[vc.ContactProblem, Any]:
    """Stones under their weight on ground that is clamped, and their joints."""
    built, tags = fem.build_mesh(mesh, COMM)
    system = fem.assemble(built, STONE, clamped=tags["ground_bottom"])
    if weight:
        system = vc.with_weight(system)
    surface = fem.contact_pairs(system, tags=tags)
    joints = fem.find_joints(built, tags=tags)
    return vc.ContactProblem(system, surface, friction=vc.Coulomb(mu)), joints


def stack(k: int = 4) -> meshes.BricksMesh:
    return meshes.BricksMesh(
        counts=(1, k),
        lengths=(1.0, 0.5),
        gaps=(0.0, 0.0),
        divisions=(2, 1),
        table=0.5,
        overhang=1.0,
    )


@pytest.mark.long
@pytest.mark.two_ranks
@pytest.mark.parametrize(("mu", "limit"), [(0.7, 0.5), (0.3, 0.3)], ids=["topples", "slides"])
def test_a_stack_tilts_until_it_first_moves(mu: float, limit: float) -> None:
    """V2.23: four stones of 1 x 0.5 m: tan = min(mu, b/h), within the bracket, and the mechanism
    is the rotation about the right foot, or the slip of all stones alike."""
    problem, _ = on_the_ground(stack(), mu)
    found = vc.tilt(problem, rtol=RTOL)
    assert found.multiplier <= limit * (1.0 + 1e-9)
    assert limit * (1.0 - 1e-9) < found.lost_at <= found.multiplier + RTOL * found.lost_at
    assert found.proven and "no static equilibrium" in found.reason
    # the fastest are all that slide, or the top one alone
    where = "4 of 5 bodies move, such as that at (0.5, 1.75)"
    if mu < limit + 1e-9:
        where = "4 of 5 bodies move, such as that at (0.5, 0.25)"
    assert where in found.reason
    assert max(state.certificate for state in found.states) <= 1e-9
    assert [state.t for state in found.states] == list(found.multipliers)
    # the weight keeps its size as it turns: N = W cos, T = W sin on the lowest joint
    surface = seen(found.problem.surface)
    foot = np.abs(surface.points[:, 1]) < 1e-9
    angle = np.arctan(found.multiplier)
    weight = 4 * 0.5 * 2000.0 * GRAVITY
    last = found.states[-1]
    assert surface.all(last.r_n)[foot].sum() == pytest.approx(weight * np.cos(angle), rel=1e-8)
    shear = np.abs(surface.all(last.r_t)[foot].sum())
    assert shear == pytest.approx(weight * np.sin(angle), rel=1e-7)
    # the mechanism
    space: Any = found.problem.system.space
    moved = space.expand(found.problem.cartesian(found.mechanism.u), 0.0)
    x = space.points - (1.0, 0.0)
    rotation = np.column_stack([x[:, 1], -x[:, 0]]) / 2.0
    expected = rotation if mu > limit else np.tile([1.0, 0.0], (len(x), 1))
    stones = space.points[:, 1] > 1e-9
    assert np.abs(moved - expected)[stones].max(initial=0.0) < 1e-3


@pytest.mark.long
@pytest.mark.serial
def test_a_push_is_no_more_than_the_bound(tmp_path: Any) -> None:
    """Half stones below a whole one, T joint and all: at most the bound of associated flow, from
    the same dead weight; the picture of the mechanism is drawn."""
    pytest.importorskip("matplotlib")
    from pictures import is_drawn

    problem, joints = on_the_ground(
        meshes.MasonryMesh(stones=1, courses=2, half_first=True, ground=0.2, divisions=(2, 1)), 0.65
    )
    bound = vc.rigid_limit_load(vc.rigid_blocks(joints, fixed=["ground"]), mu=0.65)
    found = vc.limit_load(problem, force=(GRAVITY, 0.0), rtol=0.1, bound=bound)
    assert found.bound is bound
    assert found.multiplier <= bound.multiplier * (1.0 + 1e-9)
    assert found.multiplier > 0.5 * bound.multiplier
    assert is_drawn(plots.plot_mechanism(found, tmp_path / "mechanism.png"))
    lower = vc.rigid_limit_load(vc.rigid_blocks(joints, fixed=["ground"]), mu=0.2)
    with pytest.raises(StepFailure, match="above the bound 0.2: give the bound of the same loads"):
        vc.limit_load(problem, force=(GRAVITY, 0.0), first=0.25, rtol=0.9, bound=lower)


@pytest.mark.long
@pytest.mark.serial
def test_forces_on_unknowns_push_one_stone() -> None:
    """The lower of two stones, pushed alone, slides below the other at mu times the weights above
    both of its joints; mirrored alike, and in other units of the force."""
    problem, _ = on_the_ground(stack(2), 0.3)
    space: Any = problem.system.space
    lower = (space.points[:, 1] > -1e-9) & (space.points[:, 1] < 0.5 + 1e-9)
    lower &= space.body_of_block[: len(lower)] == np.min(space.body_of_block[: len(lower)][lower])
    for way in (1.0, -100.0):
        push = np.zeros_like(space.points)
        push[lower, 0] = way / lower.sum()
        found = vc.limit_load(problem, force=space.restrict(push), first=2000.0 / abs(way))
        # the upper one goes with it, as its own friction is larger than what it needs
        limit = 0.3 * 2 * 0.5 * 2000.0 * GRAVITY / abs(way)
        assert found.multiplier <= limit * (1.0 + 1e-9)
        assert found.lost_at >= limit * (1.0 - 1e-9)


@pytest.mark.serial
def test_a_body_that_yields_has_a_limit_too() -> None:
    """A plate without hardening between smooth sides, drawn in plane strain: 2 sy/sqrt(3)."""
    mesh, tags = fem.build_mesh(meshes.BlockMesh(divisions=(2, 2)), COMM)
    strength = 100e6
    metal = J2(E=70e9, nu=0.33, rho=2700.0, yield_stress=strength)
    smooth = [
        fem.Prescribed(tags["left"], components=(0,)),
        fem.Prescribed(tags["bottom"], components=(1,)),
    ]
    made = {"integration": "bbar", "prescribed": smooth}
    one = fem.assemble(mesh, metal, loads=fem.Traction(tags["top"], (0.0, 1e6)), **made)
    system = fem.assemble(mesh, metal, **made)
    problem = vc.ContactProblem(system, empty_surface(system.algebra.comm, 2))
    found = vc.limit_load(problem, force=one.load.at_rest(0.0), first=50.0, rtol=RTOL)
    exact = 2.0 / np.sqrt(3.0) * strength / 1e6
    assert found.multiplier <= exact * (1.0 + 1e-6)
    assert found.lost_at >= exact * (1.0 - 1e-6)
    assert not found.proven


@pytest.mark.serial
def test_one_function_says_whether_a_load_has_equilibrium() -> None:
    """What searches are made of: a state or none, and the halving of steps."""
    problem, _ = on_the_ground(stack(1), 0.3)
    system = problem.system.with_load((problem.system.inertia(np.array([GRAVITY, 0.0])), abs))
    pushed = vc.ContactProblem(system, problem.surface, friction=problem.friction)
    equilibria = Equilibria(pushed)
    start = vc.static_equilibrium(problem)
    below = equilibria.solve(start, 0.25)
    assert below.certificate is not None and below.certificate <= 1e-9
    with pytest.raises(NoEquilibrium, match="carry it off along"):
        equilibria.solve(start, 0.35)
    # a search by itself: what is lost at 1.3 from where it is
    tried: list[float] = []

    def reach(old: Any, value: float) -> Any:
        tried.append(value)
        if value > 1.3:
            raise StepFailure("lost")
        return old

    path = seek_limit(reach, start, value=0.0, first=1.0, rtol=0.1, most=5)
    assert tried == [1.0, 2.0, 1.5, 1.25, 1.5, 1.375]
    assert (path.values, path.lost, path.proven) == ((0.0, 1.0, 1.25), 1.375, False)


@pytest.mark.serial
def test_wrong_input_is_refused() -> None:
    problem, _ = on_the_ground(stack(1), 0.3)
    bare, _ = on_the_ground(stack(1), 0.3, weight=False)
    wrong: Any
    for wrong, sentence in (
        ({"force": (0.0, 0.0)}, "force is zero everywhere; give the load that grows"),
        ({"force": (1.0, 0.0, 0.0)}, "force has shape .3,."),
        ({"force": (1.0, 0.0), "rtol": 2.0}, "rtol is 2.0; give a share below one"),
        ({"force": (1.0, 0.0), "first": -1.0}, "first is -1.0; give a finite number above zero"),
        ({"force": (1.0, 0.0), "bound": 0.3}, "give the answer of rigid_limit_load"),
    ):
        with pytest.raises(InputError, match=sentence):
            vc.limit_load(problem, **wrong)
    with pytest.raises(InputError, match="none tells the size of a step: give first="):
        vc.limit_load(bare, force=(1.0, 0.0))
    with pytest.raises(StepFailure, match="2 load steps up to 2 have equilibrium: give a larger"):
        vc.limit_load(problem, force=(0.0, -1.0), first=1.0, most=2)
    with pytest.raises(InputError, match="hold no weight along gravity"):
        vc.tilt(bare)
    with pytest.raises(InputError, match="give two vectors at right angles"):
        vc.tilt(problem, towards=(1.0, -1.0))
    moving = problem.surface.moving(along=lambda t: t)
    slid = vc.ContactProblem(problem.system, moving, friction=problem.friction)
    with pytest.raises(InputError, match="the obstacle moves with the time"):
        vc.limit_load(slid, force=(1.0, 0.0))
