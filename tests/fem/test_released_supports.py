"""Supports of the gravity stage that the dynamic stage does without: their reactions go on as
forces."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fem_problems import linear
from mpi4py import MPI
from soil import SOIL, strip

import vi_contact as vc
from vi_contact import fem, laws, soil
from vi_contact.core.errors import InputError
from vi_contact.core.surfaces import empty_surface
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.two_blocks import TwoBlocks

DT = 4e-3
FLOOR = vc.HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
WEIGHT = fem.BodyForce((0.0, -2000.0 * 9.81))


def stages(
    comm: Any, *, motion: Any = None, friction: Any = None, **other: Any
) -> tuple[Any, Any, Any, Any]:
    """(static problem, its state, dynamic problem, points): soil beside a rigid wall, on clamps;
    then on dashpots."""
    mesh, tags = strip(comm, 6.0, 4.0, (6, 4))
    rollers = fem.Prescribed(tags["left"], components=(0,))
    before = fem.assemble(mesh, SOIL, clamped=tags["bottom"], prescribed=rollers, loads=WEIGHT)
    base = fem.CompliantBase(tags["bottom"], motion=motion or (lambda t: np.zeros(2)))
    sides = soil.FreeField(tags["left"], base=base)
    after = fem.assemble(mesh, SOIL, dashpots=[base, sides], **({"loads": WEIGHT} | other))
    settings = {} if friction is None else {"friction": friction}
    wall = [(6.0, y) for y in (1.0, 2.0, 3.0, 4.0)]
    static, dynamic = (
        vc.ContactProblem(s, fem.contact_surface(s, tags["right"], points=wall), **settings)
        for s in (before, after)
    )
    state = vc.static_equilibrium(static, solver=vc.Condensed())
    return static, state, dynamic, [(0.0, 4.0), (3.0, 4.0), (6.0, 2.0)]


@pytest.mark.long
@pytest.mark.parametrize("friction", [None, pytest.param(vc.Coulomb(0.3), marks=pytest.mark.slow)])
def test_nothing_moves_after_the_release(comm, friction):
    """One second without motion: still to 1e-12 of the static displacement, contact forces too."""
    static, state, dynamic, points = stages(comm, friction=friction)
    r_n = static.surface.everywhere(state.r_n)
    assert r_n.min() > 0.0
    problem, start = fem.release(static, state, dynamic)
    nodes = static.system.space.find_nodes(np.array(points))
    before = static.system.space.sample(static.cartesian(state.u), nodes, 0.0)
    ((new, _),) = deque(vc.march(problem, dt=DT, steps=250, state=start), maxlen=1)
    after = problem.system.space.sample(problem.cartesian(new.u), nodes, new.t)
    assert np.abs(after - before).max() < 1e-12 * np.abs(before).max()
    assert np.abs(static.surface.everywhere(new.r_n) - r_n).max() < 1e-10 * r_n.max()


@pytest.mark.serial
def test_without_the_reactions_it_falls(comm):
    """The same start without the forces: the dashpots let the soil sink, at 0.1 s by more than it
    had settled."""
    static, state, dynamic, points = stages(comm)
    _, start = fem.release(static, state, dynamic)
    space = dynamic.system.space
    nodes = space.find_nodes(np.array(points))
    before = space.sample(dynamic.cartesian(start.u), nodes, 0.0)[1, 1]
    ((new, _),) = deque(vc.march(dynamic, dt=DT, steps=25, state=start), maxlen=1)
    after = space.sample(dynamic.cartesian(new.u), nodes, new.t)[1, 1]
    assert before < 0.0 and after < 2.0 * before


@pytest.mark.serial
def test_motion_on_top_of_gravity(comm):
    """While all points stay closed, the response is the one without gravity on bilateral points."""
    up = soil.upgoing(vc.Ricker(0.05, 8.0), dt=1e-3)
    static, state, dynamic, points = stages(comm, motion=up)
    problem, start = fem.release(static, state, dynamic)
    rows = [(s.u - start.u, s.active) for s, _ in vc.march(problem, dt=DT, steps=60, state=start)]
    assert np.all([active for _, active in rows])
    _, _, light, _ = stages(comm, motion=up, loads=())
    held = vc.ContactProblem(light.system, light.surface.bilateral_everywhere())
    alone = np.array([s.u for s, _ in vc.march(held, dt=DT, steps=60)])
    moved = np.array([u for u, _ in rows])
    assert np.abs(moved - alone).max() < 1e-9 * np.abs(alone).max()


@pytest.mark.serial
def test_what_does_not_fit_is_refused(comm):
    """Other loads, other contact points, another mesh, a support elsewhere."""
    static, state, dynamic, _ = stages(comm, loads=fem.BodyForce((0.0, -1e4)))
    with pytest.raises(InputError, match="are missing where no support was released"):
        fem.release(static, state, dynamic)
    static, state, dynamic, _ = stages(comm)
    fewer = vc.ContactProblem(dynamic.system, empty_surface(dynamic.system.algebra.comm, 2))
    with pytest.raises(InputError, match="different contact points"):
        fem.release(static, state, fewer)
    _, _, elsewhere, _ = stages(comm)
    with pytest.raises(InputError, match="on one mesh"):
        fem.release(static, state, elsewhere)
    mesh, tags = strip(comm, 6.0, 4.0, (6, 4))
    bulging = fem.assemble(
        mesh,
        SOIL,
        clamped=tags["bottom"],
        loads=WEIGHT,
        prescribed=fem.Prescribed(tags["left"], components=(0,)),
    )
    tied = fem.assemble(
        mesh, SOIL, clamped=tags["bottom"], loads=WEIGHT, tied=fem.Tied(tags["left"], tags["right"])
    )
    static, problem = (linear(system) for system in (bulging, tied))
    state = vc.static_equilibrium(static, solver=vc.Condensed())
    with pytest.raises(
        InputError, match="a support or tie of the problem is .* m away from where the static stage"
    ):
        fem.release(static, state, problem)


@pytest.mark.serial
def test_the_prestress_of_a_joint_is_no_missing_force(comm):
    """Soil that was prestressed before anything moves goes on so, at rest, and its joint too."""
    static, _, dynamic, _ = stages(comm)
    before = laws.Prestress(normal=1e6, shear=3e5)
    fault = laws.SlipWeakening(static=0.6, kinetic=0.5, distance=1e-3, prestress=before)
    static, dynamic = (replace(problem, joint=fault) for problem in (static, dynamic))
    state = vc.static_equilibrium(static, solver=vc.Condensed())
    problem, start = fem.release(static, state, dynamic)
    r_n = static.surface.weights * 1e6
    assert np.all(start.r_n > 0.9 * r_n)
    ((new, _),) = deque(vc.march(problem, dt=DT, steps=50, state=start), maxlen=1)
    assert np.abs(new.u - start.u).max() < 1e-11 * np.abs(start.u).max()
    assert np.abs(new.r_n - start.r_n).max() < 1e-10 * start.r_n.max()
    assert np.abs(new.r_t - start.r_t).max() < 1e-10 * start.r_n.max()

    # A body that nothing else loads: all forces but the reactions are rounding.
    mesh, tags = strip(comm, 6.0, 4.0, (6, 4))
    bodies = [fem.assemble(mesh, SOIL, clamped=tags["left"]) for _ in range(2)]
    surfaces = [fem.contact_surface(body, tags["bottom"], obstacle=FLOOR) for body in bodies]
    first, second = (
        vc.ContactProblem(body, surface, joint=fault)
        for body, surface in zip(bodies, surfaces, strict=True)
    )
    _, start = fem.release(first, vc.static_equilibrium(first), second)
    assert np.abs(start.r_n - second.surface.weights * 1e6).max() < 1e-9 * start.r_n.max()


HOUSE = vc.LinearElastic(E=2e8, nu=0.2, rho=1500.0)
SHAKEN = [
    vc.Ricker(a, f, direction=tuple(e))
    for a, f, e in zip((12.0, 8.0, 10.0), (6.0, 9.0, 7.0), np.eye(3), strict=True)
]


def block_on_soil(
    comm: Any,
    held: str,
    solver: Any,
    *,
    motion: Any = None,
    friction: Any = None,
    simplices: bool = False,
) -> tuple[Any, Any, Any]:
    """(static problem, its state, dynamic problem): a block on a box of soil, meshes that do not
    match, a clamped base and sides that are ``held`` by ties or rollers; then a compliant base, and
    the same ties or dashpots."""
    lower = BlockMesh(lengths=(6.0, 4.0, 6.0), divisions=(4, 4, 4), simplices=simplices)
    upper = BlockMesh(lengths=(3.0, 3.0, 3.0), divisions=(2, 3, 2), simplices=simplices)
    mesh, tags = fem.build_mesh(TwoBlocks(lower=lower, upper=upper, offset=(1.2, 1.5)), comm)
    cells = [(tags["lower"], SOIL), (tags["upper"], HOUSE)]
    pairs = [
        [tags[f"lower_{name}"] for name in pair] for pair in (("left", "right"), ("back", "front"))
    ]
    ties = [fem.Tied(one, two) for one, two in pairs]
    rollers = [
        fem.Prescribed(side, components=(c,))
        for pair, c in zip(pairs, (0, 2), strict=True)
        for side in pair
    ]
    firm = {"prescribed": rollers} if held == "rollers" else {"tied": ties}
    base = fem.CompliantBase(tags["lower_bottom"], motion=motion or (lambda t: np.zeros(3)))
    sides = (
        {"dashpots": [base], "tied": ties}
        if held == "ties"
        else {"dashpots": [base, *(fem.Dashpots(side) for pair in pairs for side in pair)]}
    )
    before = fem.assemble(mesh, cells, clamped=tags["lower_bottom"], **firm)
    settings = {} if friction is None else {"friction": friction}
    heavy = (
        vc.with_weight(one, direction=(0.0, -1.0, 0.0))
        for one in (before, fem.assemble(mesh, cells, **sides))
    )
    foot, ground = tags["upper_bottom"], tags["lower_top"]
    static, dynamic = (
        vc.ContactProblem(
            s, fem.contact_pair(s, foot, ground, matching=fem.DualMortar()), **settings
        )
        for s in heavy
    )
    return static, vc.static_equilibrium(static, solver=solver), dynamic


@pytest.mark.long
@pytest.mark.parametrize(
    "held, solver, friction, simplices",
    [
        ("ties", vc.Condensed(), vc.Coulomb(0.5), False),
        pytest.param("rollers", vc.Iterative(tolerance=1e-12), None, True, marks=pytest.mark.slow),
        pytest.param("ties that go", vc.Condensed(), None, True, marks=pytest.mark.slow),
    ],
)
def test_a_block_on_a_box_of_soil_stays(comm, held, solver, friction, simplices):
    """Without motion nothing moves, whatever held the sides during gravity and whatever does
    afterwards."""
    static, state, dynamic = block_on_soil(
        comm, held, solver, friction=friction, simplices=simplices
    )
    problem, start = fem.release(static, state, dynamic)
    weight = 27.0 * HOUSE.rho * 9.80665
    assert np.isclose(static.surface.everywhere(state.r_n).sum(), weight, rtol=1e-9)
    ((new, report),) = deque(
        vc.march(problem, dt=DT, steps=40, state=start, solver=solver), maxlen=1
    )
    moved = problem.system.space.expand(new.u - start.u, new.t)
    size, moves, changes = problem.system.algebra.comm.max(
        np.array(
            [
                np.abs(start.u).max(initial=0.0),
                np.abs(moved).max(initial=0.0),
                np.abs(new.r_n - start.r_n).max(initial=0.0),
            ]
        )
    )
    assert moves < 1e-11 * size and changes < 1e-11 * weight and report.certificate.worst < 1e-11


@pytest.mark.serial
@pytest.mark.slow
def test_a_block_on_a_box_of_soil_is_shaken(comm):
    """Three components at once lift the block's edges and move it: every step certified, the ledger
    closed, and the other route finds the same on one rank alone."""
    found = []
    for ranks, solver in ((comm, vc.Condensed()), (MPI.COMM_SELF, vc.Iterative(tolerance=1e-12))):
        up = soil.upgoing(SHAKEN, dt=1e-3)
        stages = block_on_soil(ranks, "ties", solver, motion=up, friction=vc.Coulomb(0.3))
        problem, start = fem.release(*stages)
        recorders = [
            vc.Energy(),
            vc.Contact(),
            vc.Probe({"side": (0.0, 4.0, 0.0), "roof": (1.2, 7.0, 1.5)}),
        ]
        run = vc.simulate(
            problem, dt=DT, steps=60, state=start, solver=solver, record=recorders, progress=False
        )
        h = run.history
        assert run.facts["worst_certificate"] < 1e-12
        assert np.abs(h["energy_defect"]).max() < 1e-12 * h["work_input"].max()
        assert h["contact_uplift"].max() > 0.05 and np.nanmax(h["contact_max_slip"]) > 1e-3
        found.append(np.array([h[f"u_{c}_{place}"] for c in "xyz" for place in ("side", "roof")]))
    assert np.abs(found[1] - found[0]).max() < 1e-9 * np.abs(found[0]).max()
