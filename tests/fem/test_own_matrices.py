"""Systems of scipy matrices, and contact at listed nodes: against closed forms, and against what is
made by hand.

Chains and bars have displacements only; Euler–Bernoulli beams and frames
(demos/parts/problems/frame_elements.py) rotations too, and their cubic elements give static forms
exactly. V2 of a user who brings matrices of his own.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse as sp
from bar import bar_matrices
from chain import chain_problem

import vi_contact as vc
from demos.parts.problems.frame_elements import frame, line
from vi_contact import fem, plots
from vi_contact.core.algebra import SerialMatrix
from vi_contact.core.errors import InputError
from vi_contact.core.system import Load
from vi_contact.laws.free_motions import free_motions
from vi_contact.solvers import NSGS, Lemke

pytestmark = pytest.mark.serial  # numpy and scipy alone: ranks would all do the same
EI, EA, RHO_A, L = 2.0e3, 5.0e5, 3.0, 2.0
SECTION = {"EA": EA, "EI": EI, "rho_A": RHO_A}


def beam(count: int = 6, **given):
    """A horizontal beam, clamped at x = 0 unless told otherwise, under q = 100 N/m downwards."""
    parts = frame(line([0.0, 0.0], [L, 0.0], count), [(i, i + 1) for i in range(count)], **SECTION)
    h = L / count
    force = np.zeros(3 * (count + 1))
    for i in range(count):
        force[3 * i + 1 : 3 * i + 6] += -100.0 * np.array(
            [h / 2, h**2 / 12, 0.0, h / 2, -(h**2) / 12]
        )
    return vc.system_from_arrays(**(parts | {"clamped": [0, 1, 2], "load": force} | given))


def marched(problem, steps=60, **options):
    """States and the worst certificate of a run."""
    states, worst = [], 0.0
    for state, report in vc.march(problem, steps=steps, **options):
        states.append(state)
        worst = max(worst, report.certificate.worst)
    assert worst <= 1e-9
    return states


# Displacements
# --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scheme", [vc.MoreauJean(), vc.ContactStabilisedNewmark()])
def test_chain_between_walls_is_that_made_by_hand(scheme):
    by_hand = chain_problem(
        8, gap=0.01, left_gap=0.02, damping=1e-4, v0=np.linspace(-1.0, 2.0, 8), floating=True
    )
    M, C, K = by_hand.system.M.csr, by_hand.system.C.csr, by_hand.system.K.csr
    system = vc.system_from_arrays(
        M, C.toarray(), K, coordinates=np.arange(1.0, 9.0)[:, None], v0=by_hand.system.v0
    )
    surface = vc.contact_points(system, [7, 0], [[2.0], [-1.0]], weights=0.5, gap0=[0.01, 0.02])
    problem = vc.ContactProblem(system, surface, mass=vc.ConsistentMass())
    ours, theirs = (marched(one, steps=300, scheme=scheme, dt=2e-3) for one in (problem, by_hand))
    assert all(
        np.array_equal(a.u, b.u) and np.array_equal(a.r_n, b.r_n)
        for a, b in zip(ours, theirs, strict=True)
    )
    assert any(a.active[0] for a in ours) and any(a.active[1] for a in ours)
    assert system.floating and system.space.bodies.max() == 0


def test_thrown_bar():
    """Force rho c v while the wave goes forth and back, 2L/c, then the speed it came with (E = 900
    Pa, L = 10 m)."""
    n, v, c, gap = 200, 2.0, 30.0, 0.1
    M, K = bar_matrices(n, length=10.0, E=900.0, rho=1.0)
    system = vc.system_from_arrays(
        M, None, K, coordinates=line([0.0], [10.0], n), v0=np.full(n + 1, -v)
    )
    surface = vc.contact_points(system, [0], [-1.0], gap0=gap)
    start, end, dt = gap / v, gap / v + 20.0 / c, 1e-3
    states = marched(vc.ContactProblem(system, surface), steps=round((end + 0.1) / dt), dt=dt)
    force = np.array([state.r_n[0] for state in states])
    t = np.array([state.t for state in states])
    held = (t > start + 0.05) & (t < end - 0.05)
    assert force[held].mean() == pytest.approx(30.0 * v, rel=1e-3)
    assert not force[(t < start) | (t > end + 0.03)].any()
    assert np.mean(states[-1].v[1:]) == pytest.approx(v, rel=2e-2)


def test_two_bars_exchange_their_speeds():
    """Node against node: the bar that comes stops when its wave has gone forth and back, and the
    other leaves."""
    n, v, c = 60, 1.0, 30.0
    M, K = bar_matrices(n, length=10.0, E=900.0, rho=1.0)
    points = np.concatenate([line([0.0], [10.0], n), line([10.02], [20.02], n)])
    speeds = np.repeat([v, 0.0], n + 1)
    system = vc.system_from_arrays(
        *(sp.block_diag([M, M]), None, sp.block_diag([K, K])), coordinates=points, v0=speeds
    )
    assert system.space.bodies.tolist() == [0] * (n + 1) + [1] * (n + 1)
    surface = vc.contact_points(system, [n], [1.0], opposite=[n + 1])
    assert surface.gap0 == pytest.approx(0.02, rel=1e-12)
    problem = vc.ContactProblem(system, surface)
    dt = 1e-3
    states = marched(problem, steps=round((0.02 / v + 20.0 / c + 0.1) / dt), dt=dt)
    assert problem.cartesian(states[-1].v).reshape(2, -1).mean(axis=1) == pytest.approx(
        [0.0, v], abs=0.02 * v
    )


def test_corner_of_two_oblique_walls():
    """A mass on springs is pressed into a corner of 60°: it stays, and the two reactions are the
    force's components; with friction the least forces of both walls that add up to it."""
    way = np.array([[1.0, 0.0], [0.5, np.sqrt(0.75)]])
    force = np.array([3.0, 2.0])
    system = vc.system_from_arrays(
        [1.0, 1.0], None, 10.0 * np.eye(2), coordinates=[[0.0, 0.0]], load=force
    )
    surface = vc.contact_points(system, [0, 0], way)
    state = vc.static_equilibrium(vc.ContactProblem(system, surface))
    assert state.r_n == pytest.approx(np.linalg.solve(way.T, force), rel=1e-12)
    mu = 0.3
    problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(mu))
    state = vc.static_equilibrium(problem)
    across = np.column_stack([-way[:, 1], way[:, 0]])
    assert state.r_n @ way + state.r_t[:, 0] @ across == pytest.approx(force, rel=1e-12)
    assert np.abs(state.u).max() < 1e-15
    assert np.all(np.abs(state.r_t[:, 0]) <= mu * state.r_n * (1.0 + 1e-12))
    # the least split, by a search over what balances: r = (n1, t1, n2, t2) with two ways free
    B = np.stack([way, across], axis=1).reshape(4, 2)
    found = np.column_stack([state.r_n, state.r_t]).ravel()
    free = np.linalg.svd(B.T)[2][2:]
    steps = np.linspace(-1.0, 1.0, 401)
    tried = found + 1e-2 * (steps[:, None, None] * free[0] + steps[None, :, None] * free[1])
    allowed = np.all(np.abs(tried[..., 1::2]) <= mu * tried[..., ::2], axis=-1)
    sizes = np.linalg.norm(tried, axis=-1)
    assert allowed.any() and sizes[allowed].min() >= np.linalg.norm(found) * (1.0 - 1e-12)


# Rotations
# --------------------------------------------------------------------------------------------------


def test_cantilever_on_a_stop():
    """Tip reaction 3qL/8 - 3 EI g/L³ of an Euler–Bernoulli cantilever over a stop at the depth
    g."""
    system, gap = beam(), 0.01
    surface = vc.contact_points(system, [6], [0.0, -1.0], gap0=gap)
    state = vc.static_equilibrium(vc.ContactProblem(system, surface))
    assert not system.floating
    assert state.r_n[0] == pytest.approx(3 * 100.0 * L / 8 - 3 * EI * gap / L**3, rel=1e-10)
    assert state.u @ system.K.csr @ state.u > 0.0
    high = vc.contact_points(system, [6], [0.0, -1.0], gap0=1.01 * 100.0 * L**4 / (8 * EI))
    assert vc.static_equilibrium(vc.ContactProblem(system, high)).r_n == 0.0


def test_load_steps_of_a_cantilever():
    """A tip load that grows with t, above a stop: P t - 3 EI g/L³, nothing before it touches."""
    tip = np.zeros(21)
    tip[-2] = -1000.0
    system = beam(load=Load(np.zeros(21), ((tip, float),)))
    problem = vc.ContactProblem(system, vc.contact_points(system, [6], [0.0, -1.0], gap0=0.1))
    times, touch = np.linspace(0.0, 1.0, 11), 3 * EI * 0.1 / L**3
    found = [state.r_n[0] for state in vc.quasi_static(problem, times)]
    assert found == pytest.approx(
        np.maximum(1000.0 * times - touch, 0.0), rel=1e-9, abs=1e-9 * touch
    )


@pytest.mark.parametrize("normal", [(0.0, -1.0), (0.6, -0.8)])
def test_plane_frame_on_a_stop(normal):
    """A column of height H with an arm B, loaded at its end: r = (n·F p - g)/(n·F n), F the end's
    flexibility."""
    H, B, p, gap = 3.0, 1.5, np.array([40.0, -200.0]), 0.02
    nodes = np.concatenate([line([0.0, 0.0], [0.0, H], 4), line([0.0, H], [B, H], 3)[1:]])
    load = np.zeros(3 * len(nodes))
    load[-3:-1] = p
    members = [(i, i + 1) for i in range(len(nodes) - 1)]
    system = vc.system_from_arrays(**frame(nodes, members, **SECTION), clamped=[0, 1, 2], load=load)
    surface = vc.contact_points(system, [len(nodes) - 1], normal, gap0=gap)
    state = vc.static_equilibrium(vc.ContactProblem(system, surface))
    xx, xy, yy = H**3 / 3 / EI + B / EA, -(H**2) * B / 2 / EI, (B**3 / 3 + B**2 * H) / EI + H / EA
    F, n = np.array([[xx, xy], [xy, yy]]), np.array(normal)
    assert state.r_n[0] == pytest.approx((n @ F @ p - gap) / (n @ F @ n), rel=1e-10)


def test_beam_without_a_clamp_rests_on_two_points():
    """Its rigid rotation is found although rotations are unknowns: half of q L on each support, at
    unequal heights."""
    system = beam(clamped=())
    assert system.floating
    surface = vc.contact_points(system, [0, 6], [0.0, -1.0], gap0=[0.0, 0.003])
    problem = vc.ContactProblem(system, surface)
    state = vc.static_equilibrium(problem)
    assert state.r_n == pytest.approx([100.0, 100.0], rel=1e-9)
    alone = vc.ContactProblem(system, vc.contact_points(system, [0], [0.0, -1.0]))
    with pytest.raises(InputError, match="no static equilibrium"):
        vc.static_equilibrium(alone)


@pytest.mark.parametrize("scheme", [vc.MoreauJean(), vc.ContactStabilisedNewmark(), vc.Midpoint()])
def test_beam_strikes_a_stop_and_rubs(scheme):
    """Ledger and certificates of an oblique stop with friction."""
    system = beam(v0=np.tile([0.1, -1.0, 0.0], 7))
    surface = vc.contact_points(system, [6, 3], [0.3, -1.0], gap0=0.002, weights=0.01)
    problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(0.4), mass=vc.ConsistentMass())
    probe = vc.Probe({"tip": (L, 0.0), "foot": (0.0, 0.0)})
    found = vc.simulate(
        problem, scheme=scheme, dt=2e-4, steps=150, record=[vc.Energy(), vc.Contact(), probe]
    )
    assert found.facts["energy_defect"] <= 1e-10 and found.history["certificate"].max() <= 1e-9
    assert found.history["contact_active"].max() >= 1 and found.history["loss_friction"][-1] > 0.0
    assert not found.history["u_y_foot"].any() and found.history["u_y_tip"].min() < -0.001


@pytest.mark.parametrize("name", ["K", "C"])
def test_matrices_that_are_not_symmetric(name):
    """A follower force, or gyroscopic damping, in one step of MoreauJean (theta = 1) against its 2
    x 2 problem, by Volume() and condensed; methods that need symmetry say which do not."""
    pytest.importorskip("petsc4py")
    skew = {"K": np.diag([30.0, 20.0]), "C": np.diag([3.0, 2.0])}
    skew[name] += np.array([[0.0, 5.0], [-3.0, 0.0]])
    v0, dt = np.array([1.0, 0.5]), 0.01
    system = vc.system_from_arrays([1.0, 2.0], **skew, coordinates=[[0.0, 0.0]], v0=v0)
    assert f"{name} not symmetric: for Volume() and Condensed(Lemke())" in system.notes[0]
    problem = vc.ContactProblem(
        system, vc.contact_points(system, [0], [1.0, 0.0]), mass=vc.ConsistentMass()
    )
    rubbing = replace(problem, friction=vc.Coulomb(0.1))
    for one, solver in ((problem, vc.Condensed()), (rubbing, vc.Condensed(Lemke(), NSGS()))):
        with pytest.raises(
            InputError, match=r"Condensed needs symmetric .*Condensed\(Lemke\(\)\), or Volume"
        ):
            marched(one, steps=1, scheme=vc.MoreauJean(theta=1.0), dt=dt, solver=solver)
    A = np.diag([1.0, 2.0]) + dt * skew["C"] + dt**2 * skew["K"]
    for solver in (vc.Volume(), vc.Condensed(Lemke())):
        (state,) = marched(problem, steps=1, scheme=vc.MoreauJean(theta=1.0), dt=dt, solver=solver)
        free = A[1, 1] * state.v[1] - 2.0 * v0[1]
        assert state.v[0] == pytest.approx(0.0, abs=1e-15) and free == pytest.approx(0.0, abs=1e-13)
        assert dt * state.r_n[0] == pytest.approx(1.0 - A[0, 1] * state.v[1], rel=1e-12)
        (state,) = marched(rubbing, steps=1, scheme=vc.MoreauJean(theta=1.0), dt=dt, solver=solver)
        slides = A[1, 1] * state.v[1] - 2.0 * v0[1] + 0.1 * dt * state.r_n[0]
        assert state.v[1] > 0.1 and slides == pytest.approx(0.0, abs=1e-13)
        assert dt * state.r_n[0] == pytest.approx(1.0 - A[0, 1] * state.v[1], rel=1e-12)


# Mass laws, weight, bodies
# --------------------------------------------------------------------------------------------


def hung(stiff, load, *, soft=1.0):
    """A chain of five masses on stiff springs, hung at its first node on a soft one, with a stop
    0.3 m from its end."""
    K = stiff * (2.0 * np.eye(5) - np.eye(5, k=1) - np.eye(5, k=-1))
    K[0, 0], K[4, 4] = stiff + soft, stiff
    system = vc.system_from_arrays(
        np.ones(5), None, K, coordinates=np.arange(5.0)[:, None], load=[0, 0, 0, 0, load]
    )
    return vc.ContactProblem(system, vc.contact_points(system, [4], [1.0], gap0=0.3))


@pytest.mark.parametrize("stiff", [1.0e9, 1.0e11, 1.0e13])
def test_a_soft_spring_holds_a_stiff_body(stiff):
    """Also where it is 1e-13 of the body's stiffness: u = f / k, or 0.3 m and r = f - 0.3 k.
    Rounding is that of u, magnified by the stiffness; what is 1e-17 of it is lost."""
    off, on, lost = hung(stiff, -0.5), hung(stiff, 0.5), hung(stiff, 0.5, soft=1e-17 * stiff)
    state = vc.static_equilibrium(off)
    assert not off.system.floating and lost.system.floating
    assert state.u == pytest.approx(np.full(5, -0.5), rel=1e-3) and state.r_n[0] == 0.0
    state = vc.static_equilibrium(on)
    assert state.u == pytest.approx(np.full(5, 0.3), rel=1e-8) and state.r_n == pytest.approx(
        [0.2], rel=1e-3
    )


@pytest.mark.parametrize("stiffness", [1.0e3, 0.0])
def test_a_mass_without_stiffness_floats(stiffness):
    """It comes to rest on its stop, beside a mass on a spring or another of its kind."""
    K = np.diag([stiffness, 0.0])
    system = vc.system_from_arrays(
        [1.0, 2.0], None, K, coordinates=[[0.0], [1.0]], load=[-1.0, -2.0]
    )
    surface = vc.contact_points(system, [0, 1], [-1.0], gap0=0.01)
    problem = vc.ContactProblem(system, surface, mass=vc.ConsistentMass())
    state = vc.static_equilibrium(problem)
    u = problem.cartesian(state.u)
    assert system.floating and u == pytest.approx(
        [-1.0e-3 if stiffness else -0.01, -0.01], rel=1e-9
    )
    assert state.r_n == pytest.approx([0.0 if stiffness else 1.0, 2.0], rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("size", [1.0e-6, 1.0, 1.0e9])
@pytest.mark.parametrize("digits", [3, 16])
def test_free_motions_in_any_units(size, digits):
    """A frame of bars at an angle, free, pinned, on rollers, held and on springs of a millionth;
    rounded places too."""
    X, K = (
        np.round([[0.1, 0.2], [1 / 3, 1 / 7], [0.4, 0.9], [0.05, 2 / 3]], digits) * size,
        np.zeros((8, 8)),
    )
    for i in range(4):
        for j in range(i):
            way = (X[i] - X[j]) / np.linalg.norm(X[i] - X[j])
            row = np.kron(np.eye(4)[i] - np.eye(4)[j], way)
            K += 1.0e9 / np.linalg.norm(X[i] - X[j]) * np.outer(row, row)
    springs = K + 1.0e-6 * np.diag(K.diagonal() * np.array([1, 1, 0, 1, 0, 0, 0, 0]))
    cases = [(K, [], 3), (K, [0, 1], 1), (K, [1, 3], 1), (K, [0, 1, 3], 0), (springs, [], 0)]
    for matrix, clamped, free in cases:
        system = vc.system_from_arrays(np.ones(8), None, matrix, coordinates=X, clamped=clamped)
        found = sum(body.motions.shape[1] for body in free_motions(system))
        assert found == free and system.floating == (free > 0)


def test_products_do_not_grow_with_bodies(monkeypatch):
    """Bodies of one mass on a spring: K is multiplied as often for a thousand as for ten."""
    counts, product = [], SerialMatrix.__matmul__
    monkeypatch.setattr(SerialMatrix, "__matmul__", lambda A, x: counts.append(A) or product(A, x))
    for n in (10, 1000):
        system = vc.system_from_arrays(
            np.ones(n), None, np.eye(n), coordinates=np.arange(float(n))[:, None]
        )
        counts.append(n)
        assert not system.floating
    assert counts.index(10) == len(counts) - counts.index(10) - 2


def test_mass_of_rotations():
    """Redistributed mass has no place for rotations; rotations without mass only beside contact
    nodes without any."""
    system = beam()
    problem = vc.ContactProblem(system, vc.contact_points(system, [6], [0.0, -1.0]))
    with pytest.raises(InputError, match=r"has the inertia of rotations.*mass=ConsistentMass\(\)"):
        marched(problem, dt=1e-3)
    lumped = beam(M=np.tile([1.0, 1.0, 0.0], 7))
    assert lumped.massless.sum() == 6
    for scheme in (vc.MoreauJean(), vc.Trapezoidal()):
        problem = vc.ContactProblem(
            lumped, vc.contact_points(lumped, [6], [0.0, -1.0]), mass=vc.ConsistentMass()
        )
        with pytest.raises(
            InputError, match="rows of M are zero while contact nodes have mass: condense"
        ):
            marched(problem, scheme=scheme, dt=1e-3)


def test_rotations_and_tip_without_mass():
    """The default scheme takes mass that its user has redistributed: all contact unknowns are
    without any."""
    masses = np.tile([1.0, 1.0, 0.0], 7)
    masses[-3:] = 0.0
    system = beam(M=masses, v0=np.tile([0.0, -1.0, 0.0], 7))
    surface = vc.contact_points(system, [6], [0.0, -1.0], gap0=0.002)
    problem = vc.ContactProblem(system, surface, mass=vc.ConsistentMass())
    found = vc.simulate(problem, scheme=vc.Trapezoidal(), dt=5e-4, steps=200)
    assert found.facts["energy_defect"] <= 1e-10 and found.history["contact_active"].max() == 1
    total = (
        found.history["energy_kinetic"]
        + found.history["energy_strain"]
        - found.history["work_input"]
    )
    assert total == pytest.approx(total[0], rel=1e-2)  # 0.3 % at the impacts, of the time step


def test_weight_counts_the_mass_shared_with_the_clamp():
    """with_weight gives the consistent load of rho A g, as if no row were left out; so does the
    ground's motion."""
    system = beam(load=None)
    heavy = vc.with_weight(system, acceleration=100.0 / RHO_A)
    assert heavy.load.constant == pytest.approx(beam().load.constant, rel=1e-12)
    assert system.inertia(np.array([0.0, -100.0 / RHO_A])) == pytest.approx(
        beam().load.constant, rel=1e-12
    )


def test_loads_with_histories_lose_the_clamped_rows():
    vector = np.arange(21.0)
    load = Load(vector, ((2.0 * vector, np.sin),), (lambda t: t * vector,))
    assert beam(load=load).load(0.5) == pytest.approx(
        (1.0 + 2.0 * np.sin(0.5) + 0.5) * vector[3:], rel=1e-15
    )


@pytest.mark.long
def test_restart_is_the_straight_run(tmp_path):
    system = beam(v0=np.tile([0.1, -1.0, 0.0], 7))
    surface = vc.contact_points(system, [6, 3], [0.3, -1.0], gap0=0.002)
    problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(0.4), mass=vc.ConsistentMass())
    run = partial(vc.simulate, problem, scheme=vc.MoreauJean(), dt=2e-4, progress=False)
    straight = run(steps=80)
    run(steps=40, out=tmp_path)
    again = run(steps=80, out=tmp_path, restart=True)
    assert np.array_equal(again.state.u, straight.state.u) and np.array_equal(
        again.state.r_n, straight.state.r_n
    )
    for name, values in straight.history.items():
        np.testing.assert_array_equal(again.history[name], values)


def test_frames_for_paraview(tmp_path):
    """A vertex for each node, clamped ones too; u, v, a, pressure and status; a restart goes on
    with them."""
    h5py = pytest.importorskip("h5py")
    system = beam(v0=np.tile([0.1, -1.0, 0.0], 7))
    surface = vc.contact_points(system, [6], [0.3, -1.0], gap0=0.002, weights=0.01)
    problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(0.4), mass=vc.ConsistentMass())
    run = partial(
        vc.simulate,
        problem,
        scheme=vc.MoreauJean(),
        dt=2e-4,
        out=tmp_path,
        fields=fem.XDMF(every=5),
    )
    run(steps=10)
    found = run(steps=20, restart=True)
    assert sorted(path.name for path in (tmp_path / "fields").iterdir())[-2:] == [
        "frame_000020.h5",
        "mesh.h5",
    ]
    assert (tmp_path / "fields.xdmf").read_text().count(
        'TopologyType="Polyvertex" NumberOfElements="7"'
    ) == 5
    with (
        h5py.File(tmp_path / "fields/mesh.h5") as mesh,
        h5py.File(tmp_path / "fields/frame_000020.h5") as frame,
    ):
        assert np.array_equal(mesh["points"][:, :2], system.space.points)
        assert mesh["cells"][:, 0].tolist() == [*range(7)]
        u = np.zeros((7, 3))
        u[1:, :2] = problem.cartesian(found.state.u).reshape(-1, 3)[:, :2]
        assert np.array_equal(frame["u"][:], u) and frame["v"].shape == frame["a"].shape == (7, 3)
        assert (
            frame["contact_pressure"][6] == found.state.r_n[0] / 0.01
            and not frame["contact_pressure"][:6].any()
        )
        assert frame["contact_status"][:6].tolist() == [0] * 6 and frame["contact_status"][6] in (
            1,
            2,
            3,
        )
    with pytest.raises(InputError, match="has bars or points only"):
        plots.plot_deformed(vc.read_run(tmp_path), tmp_path / "deformed.png")


# Bad input
# --------------------------------------------------------------------------------------------------

ONE, POINTS = np.eye(2), [[0.0, 0.0]]


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"K": np.ones((2, 3))}, r"M has shape \(2, 2\) and K has 2 rows|K has shape \(2, 3\)"),
        (
            {"M": np.eye(3)},
            r"M has shape \(3, 3\) and K has 2 rows; give square matrices of one size",
        ),
        ({"K": 1j * ONE}, "K is .*give real numbers"),
        ({"K": sp.csr_matrix(1j * ONE)}, "K has entries of type complex128; give real numbers"),
        ({"K": [[1.0, np.nan], [np.nan, 1.0]]}, "K is nan at"),
        ({"K": sp.csr_matrix([[1.0, np.inf], [np.inf, 1.0]])}, "K has NaN or infinite entries"),
        ({"M": [[1.0, 0.1], [0.0, 1.0]]}, "M is not symmetric"),
        ({"M": [1.0, -1.0]}, "M has a diagonal entry below zero"),
        ({"M": [[0.0, 1.0], [1.0, 0.0]]}, "M has a zero on its diagonal beside other entries"),
        ({"M": None}, "M is None"),
        ({"coordinates": np.zeros((1, 4))}, "give 1, 2 or 3 coordinates of every node"),
        (
            {"coordinates": np.zeros((3, 1))},
            "K has 2 rows, and 3 nodes have 3 components; give unknowns=",
        ),
        ({"unknowns": [[0, 0], [1, 1]]}, r"row 1 of unknowns is \[1, 1\]; give a node from 0 to 0"),
        ({"unknowns": [[0, 0], [0, 2]]}, "component from -1 to 1"),
        ({"unknowns": [[0, 0], [0, 0]]}, "component 0 of node 0 has several rows"),
        ({"clamped": [2]}, "clamped goes from 2 to 2; give numbers of rows below 2"),
        ({"load": [1.0]}, r"load has shape \(1,\)"),
        ({"load": Load(np.zeros(3))}, r"a vector of load has shape \(3,\)"),
        ({"u0": [0.0, np.inf]}, "u0 is inf at"),
    ],
)
def test_bad_matrices(given, said):
    with pytest.raises(InputError, match=said):
        vc.system_from_arrays(**({"M": ONE, "C": None, "K": ONE, "coordinates": POINTS} | given))


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"nodes": []}, "nodes is empty"),
        ({"nodes": [7]}, "nodes has node 7, which the system does not have"),
        ({"nodes": [0.5]}, "give whole numbers"),
        ({"normals": [0.0, 0.0]}, "the normal of node 6 is zero"),
        ({"normals": [1.0, 0.0, 0.0]}, r"normals has shape \(3,\)"),
        ({"gap0": -1e-3}, "penetrates its obstacle by 0.001 m"),
        ({"obstacle": vc.Touching(), "gap0": 0.1}, "the obstacle gives the gaps"),
        ({"obstacle": vc.HalfSpace((0.0, -1.0), (0.0, -1.0))}, "points into the body"),
        ({"opposite": [6]}, "contact node .* faces itself: give each pair once"),
        ({"nodes": [0]}, "is also prescribed along its contact direction"),
        ({"nodes": [6, 6]}, "several contact surfaces with one contact direction"),
    ],
)
def test_bad_contact(given, said):
    with pytest.raises(InputError, match=said):
        vc.contact_points(**({"system": beam(), "nodes": [6], "normals": [0.0, -1.0]} | given))


def test_contact_needs_nodes():
    system = beam().changed(space=SimpleNamespace(dimension=2, ids=np.arange(18)))
    with pytest.raises(InputError, match="contact_points is for systems of own matrices"):
        vc.contact_points(system, [2], [1.0])
