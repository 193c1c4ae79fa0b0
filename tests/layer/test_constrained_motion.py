"""The boundary layer as ordinary differential equations: particle (V5.1), rigid body (V5.2),
equality constraints."""

from __future__ import annotations

import numpy as np
import pytest
from layer_numbers import DEEPEST, DURATION, RESTITUTION, C, K
from scipy.special import ellipk

from vi_contact.core.errors import InputError, StepFailure
from vi_contact.layer import motion as layer_motions
from vi_contact.layer.bilateral import bilateral_motion
from vi_contact.layer.layer import Layer
from vi_contact.layer.metric import Metric
from vi_contact.layer.motion import ConstrainedSystem
from vi_contact.layer.particle import ParticleImpact, damping_ratio, layer_for, restitution
from vi_contact.layer.rigid_body import Ellipsoid, RigidBody, rotation
from vi_contact.layer.trajectory import LayerContact, Trajectory, layer_motion

pytestmark = pytest.mark.serial
# a unit mass before x = 0
PLANE = ConstrainedSystem(np.eye(2), lambda q: q[0], lambda q: np.array([1.0, 0.0]))


def normal_mass(M: np.ndarray, A: np.ndarray) -> float:
    """g_11 = 1/(A M⁻¹ Aᵀ)."""
    return float(1.0 / (A @ np.linalg.solve(M, A)))


def b_metric(M: np.ndarray, A: np.ndarray, rho: float, width: float) -> np.ndarray:
    """g_IJ + ĝ_IJ of (15), (n, n)."""
    return np.asarray(M + normal_mass(M, A) * (width / rho) ** 2 * np.outer(A, A))


def collide(layer: Layer, **more) -> LayerContact:
    """A unit mass that enters with (-1, 0.3)."""
    settings = {"q0": [layer.width, 0.0], "v0": [-1.0, 0.3], "t_end": 20.0, "contacts": 1} | more
    return layer_motion(PLANE, layer, **settings).contacts[0]


@pytest.mark.long
@pytest.mark.promise(
    "theory/boundary_layer.md", "differs from the closed form by 3e-10", bound="1e-9"
)
def test_particle():
    """V5.1, all pairs in closed form: table to its digits; every fourth one by integration: closed
    form to 1e-9, times of the events too."""
    for i, k in enumerate(K):
        for j, c in enumerate(C):
            layer = Layer(1.0, k=k, c=c)
            impact = ParticleImpact(layer, 1.0, 1.0)
            for found in (impact, collide(layer)) if (i + j) % 4 == 0 else (impact,):
                assert found.restitution == pytest.approx(RESTITUTION[i][j], abs=1e-6)
                assert found.duration == pytest.approx(DURATION[i][j], abs=1e-6)
                assert found.deepest == pytest.approx(DEEPEST.get((k, c), impact.deepest), abs=1e-6)
            if found is impact:
                continue
            assert found.restitution == pytest.approx(impact.restitution, abs=1e-9)
            assert found.turned == pytest.approx(impact.compression_time, abs=1e-9)


@pytest.mark.long
def test_cut_off_changes_duration_not_restitution():
    """V5.1: x(0) = b, k = c = b = 1; a/b from 0.8 to 1."""
    expected = {
        0.8: (1.88108, 0.66174),
        0.9: (1.73233, 0.69887),
        0.95: (1.66183, 0.71734),
        0.99: (1.60709, 0.73208),
        1.0: (1.59362, 0.73576),
    }
    for start, (duration, deepest) in expected.items():
        found = collide(Layer(1.0, k=1.0, c=1.0, start=start))
        assert found.restitution == pytest.approx(0.593624260040, abs=1e-8)
        assert (found.duration, found.deepest) == pytest.approx((duration, deepest), abs=5.1e-6)


@pytest.mark.long
def test_full_metric():
    """V5.1: g_11 + ĝ_11 in the place of the dominant term; the blended reading is its limit a ->
    b."""
    full = collide(Layer(1.0, k=1.0, c=1.0), metric=Metric.FULL)
    assert (full.duration, full.restitution, full.deepest) == pytest.approx(
        (2.70353, 0.56918, 0.55461), abs=5.1e-6
    )
    assert collide(Layer(1.0, k=1.0, c=1.0), metric=Metric.BLENDED).restitution == pytest.approx(
        full.restitution
    )
    near = collide(Layer(1.0, k=1.0, c=1.0, start=0.99), metric=Metric.BLENDED)
    assert near.restitution == pytest.approx(full.restitution, abs=2e-3)
    assert near.restitution < full.restitution - 5e-4
    for metric in (Metric.FULL, Metric.BLENDED):  # nothing is lost without c
        assert collide(Layer(1.0, k=1.0, start=0.8), metric=metric).restitution == pytest.approx(
            1.0, abs=1e-9
        )


def test_any_coordinates_any_mass_matrix():
    """(27), (28): the same particle in polar coordinates, M(q) = diag(1, r²), affinities by
    differences."""
    polar = ConstrainedSystem(
        lambda q: np.diag([1.0, q[0] ** 2]),
        lambda q: q[0] * np.cos(q[1]),
        lambda q: np.array([np.cos(q[1]), -q[0] * np.sin(q[1])]),
    )

    def jacobian(q):
        return np.array([[np.cos(q[1]), -q[0] * np.sin(q[1])], [np.sin(q[1]), q[0] * np.cos(q[1])]])

    q0 = np.array([np.sqrt(2.0), 0.25 * np.pi])  # x = y = 1
    v0 = np.linalg.solve(jacobian(q0), [-1.0, 0.3])
    motion = layer_motion(polar, Layer(1.0, k=1.0, c=1.0), q0=q0, v0=v0, t_end=5.0, contacts=1)
    assert motion.contacts[0].duration == pytest.approx(1.593624260040, abs=1e-8)
    assert jacobian(motion.q[-1]) @ motion.v[-1] == pytest.approx([0.593624260040, 0.3], abs=1e-8)


@pytest.mark.long
def test_events_flight_and_several_contacts():
    """A ball falls from 1 m on a thin layer of e = ½ and bounces: times and speeds of the point
    mass, less O(b)."""
    g, b = 9.81, 1e-6
    ball = ConstrainedSystem(
        np.array([[2.0]]),
        lambda q: q[0],
        lambda q: np.ones(1),
        force=lambda t, q, v: np.array([-2.0 * g]),
    )
    speed = np.sqrt(2.0 * g)
    layer = layer_for(0.5, mass=2.0, speed=speed, width=b)  # V known: the damper is linear
    motion = layer_motion(ball, layer, q0=[1.0 + b], v0=[0.0], t_end=1.2, metric=Metric.DOMINANT)
    first = motion.contacts[0]
    assert (first.start, -first.rate_in) == pytest.approx((speed / g, speed), abs=1e-8)
    assert first.restitution == pytest.approx(0.5, abs=1e-5)
    assert motion.contacts[1].start - first.end == pytest.approx(2.0 * first.rate_out / g, abs=1e-8)
    again = layer_motion(ball, Layer(b, k=layer.k, c=layer.c), q0=[1.0 + b], v0=[0.0], t_end=1.2)
    second = [one.contacts[1].restitution for one in (motion, again)]
    # c/V fixed: half the speed halves s; V of each impact: s stays
    slower = restitution(0.5 * damping_ratio(0.5))
    assert second == pytest.approx([slower, 0.5], abs=1e-5)
    assert (
        np.all(motion.rho > 0.0)
        and np.all(np.diff(motion.t) >= 0.0)
        and motion.t[-1] == pytest.approx(1.2)
    )
    fine = layer_motion(ball, layer, q0=[1.0 + b], v0=[0.0], t_end=0.4, refine=5)
    assert (
        fine.rho == pytest.approx(1.0 + b - 0.5 * g * fine.t**2, abs=1e-12) and len(fine.t) % 5 == 1
    )


# Rigid body
# --------------------------------------------------------------------------------------------------
BODY = RigidBody(2.0, (0.2, 0.3, 0.4), (0.3, -0.2, -0.5))
BEFORE = np.array([0.3, 0.0, -1.0, 0.5, -0.4, 0.2])
AFTER = np.array([0.3, 0.0, -0.21912411, -1.06175177, -1.96175177, 0.2])


def thrown(width: float, e: float = 0.593624260040, **more) -> Trajectory:
    """V5.2: the body enters the layer unturned."""
    layer = layer_for(e, mass=1.0, speed=0.98, width=width, deepest=0.73575888)
    q0 = np.array([0.0, 0.0, 0.5 + width, 1.0, 0.0, 0.0, 0.0])
    return layer_motion(BODY.system(), layer, q0=q0, v0=BEFORE, t_end=1.0, contacts=1, **more)


def test_rigid_body_impact_map():
    """V5.2: A, g_11, the velocities after the impact, the loss."""
    q = np.array([0.0, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0])
    assert BODY.gradient(q) == pytest.approx([0.0, 0.0, 1.0, -0.2, -0.3, 0.0], abs=1e-15)
    assert (
        BODY.normal_mass(q)
        == pytest.approx(1.0, abs=1e-15)
        == normal_mass(BODY.matrix, BODY.gradient(q))
    )
    assert BODY.gradient(q) @ BEFORE == pytest.approx(-0.98, abs=1e-15)
    after = BODY.after_impact(q, BEFORE, 0.593624260040)
    assert after == pytest.approx(AFTER, abs=5.1e-9)
    assert BODY.kinetic_energy(BEFORE) == pytest.approx(1.147, abs=1e-12)
    assert BODY.kinetic_energy(after) == pytest.approx(0.836017564, abs=5.1e-10)


@pytest.mark.long
def test_rigid_body_through_the_layer():
    """V5.2: the motion tends to the impact map like b; momenta along the boundary do not change."""
    errors = [float(np.max(np.abs(thrown(width).v[-1] - AFTER))) for width in (1e-4, 1e-6)]
    assert errors[0] < 3e-4 and errors[1] == pytest.approx(0.01 * errors[0], rel=0.05)
    motion = thrown(1e-6)
    assert BODY.gradient(motion.q[-1]) @ motion.v[-1] == pytest.approx(0.581752, abs=2e-6)
    change = BODY.matrix @ (motion.v[-1] - BEFORE)
    A = BODY.gradient(motion.q[0])
    assert change[2] == pytest.approx(0.98 * 1.593624, abs=4e-6)  # the impulse, g_11 (1 + e) |ρ̇|
    assert change - A * change[2] == pytest.approx(np.zeros(6), abs=3e-6)


@pytest.mark.long
def test_an_ellipsoid_turns_and_bounces():
    """Support point, gradient and its rate of an ellipsoid: A is d rho along the motion; energy in
    flight."""
    body = RigidBody(2.0, (0.2, 0.3, 0.4), Ellipsoid((0.5, 0.4, 0.3)), gravity=(0.0, 0.0, -9.81))
    q0, v0 = (
        np.array([0.0, 0.0, 1.5, 1.0, 0.2, -0.1, 0.3]),
        np.array([0.3, 0.0, 0.0, 0.5, -0.4, 3.0]),
    )
    q0[3:] /= np.linalg.norm(q0[3:])
    system, h = body.system(), 1e-5
    rate = system.velocity(q0, v0)
    ahead, behind = body.rho(q0 + h * rate), body.rho(q0 - h * rate)
    assert (ahead - behind) / (2.0 * h) == pytest.approx(body.gradient(q0) @ v0, abs=1e-9)
    # p moves along a straight line: the same turn to O(h³)
    curvature = (ahead + behind - 2.0 * body.rho(q0)) / h**2
    assert curvature == pytest.approx(system.turning(q0, v0), abs=1e-4 * abs(curvature))
    layer = layer_for(0.6, mass=1.0, speed=5.0, width=1e-4)
    motion = layer_motion(system, Layer(1e-4, k=layer.k, c=layer.c), q0=q0, v0=v0, t_end=0.9)
    assert len(motion.contacts) >= 1 and np.all(motion.rho > 0.0)
    energy = np.array([body.energy(q, v) for q, v in zip(motion.q, motion.v, strict=True)])
    start = motion.t <= motion.contacts[0].start
    assert energy[start] == pytest.approx(energy[0], rel=1e-9)
    assert np.linalg.norm(motion.q[-1, 3:]) == pytest.approx(1.0, abs=1e-9)


def test_rotations():
    """R of a quaternion: a quarter turn about z; orthogonal."""
    turned = rotation(np.array([1.0, 0.0, 0.0, 1.0])) @ np.array([1.0, 0.0, 0.0])
    assert turned == pytest.approx([0.0, 1.0, 0.0], abs=1e-15)
    R = rotation(np.array([0.3, -0.5, 0.8, 0.1]))
    assert np.max(np.abs(R @ R.T - np.eye(3))) < 1e-14 and np.linalg.det(R) == pytest.approx(1.0)


def test_metric_and_affinities():
    """(14), (15), (20), (21): ĝ_11 A_I A_J is added; the covariant derivative of the normal
    momentum is ĝ_11 (ρ̈ - ρ̇²/rho) in any coordinates."""
    rng = np.random.default_rng(5)
    root, A, v = rng.normal(size=(4, 4)), rng.normal(size=4), rng.normal(size=4)
    M, rho, b = root @ root.T + np.eye(4), 0.3, 0.7
    g = normal_mass(M, A)
    hat = b_metric(M, A, rho, b) - M
    assert hat == pytest.approx(g * (b / rho) ** 2 * np.outer(A, A), abs=1e-12)
    turned = -np.einsum("k,i,j->kij", g * np.linalg.solve(M, A), A, A) / rho  # the affinities (21)
    assert np.einsum("k,kij,i,j->", A, turned, v, v) == pytest.approx(
        -((A @ v) ** 2) / rho, rel=1e-12
    )
    # momenta of directions with A v = 0 get nothing
    orthogonal = M @ np.linalg.svd(A[None, :])[2][1:].T
    assert np.einsum("ks,kij->sij", orthogonal, turned) == pytest.approx(0.0, abs=1e-10)


# Equality constraints
# ------------------------------------------------------------------------------------------------
@pytest.mark.promise("theory/boundary_layer.md", "Its period agrees with the elliptic integral")
@pytest.mark.promise("theory/boundary_layer.md", "The constraint holds to 1e-9 over a period")
def test_pendulum():
    """(29) to (34): a rod of length 1 m from 1 rad: period, tension below, and the constraint
    without drift."""
    m, g, angle = 2.0, 9.81, 1.0
    rod = ConstrainedSystem(
        m * np.eye(2),
        lambda q: np.hypot(*q) - 1.0,
        lambda q: q / np.hypot(*q),
        force=lambda t, q, v: np.array([0.0, -m * g]),
    )
    period = 4.0 / np.sqrt(g) * ellipk(np.sin(0.5 * angle) ** 2)
    q0 = np.array([np.sin(angle), -np.cos(angle)])
    motion = bilateral_motion([rod], q0=q0, v0=np.zeros(2), times=np.linspace(0.0, period, 5))
    assert motion.q[-1] == pytest.approx(q0, abs=1e-8) and motion.q[1] == pytest.approx(
        [0.0, -1.0], abs=1e-8
    )
    assert -motion.reaction[1, 0] == pytest.approx(m * g * (3.0 - 2.0 * np.cos(angle)), rel=1e-8)
    assert np.max(np.abs(motion.phi)) < 1e-9


@pytest.mark.promise("theory/boundary_layer.md", "says, to 1e-11")
def test_slider_returns_to_its_line():
    """(34): with spring and damper an error in phi fades as m̄ φ̈ + c̄ φ̇ + k̄ φ = 0; two
    constraints fix the point."""
    K, C, M = 50.0, 1.5, np.array([[2.0, 0.3], [0.3, 1.0]])
    a = np.array([1.0, 2.0])
    line = ConstrainedSystem(M, lambda q: q @ a, lambda q: a, force=lambda t, q, v: -K * q - C * v)
    t = np.linspace(0.0, 2.0, 21)
    motion = bilateral_motion([line], q0=np.array([0.01, 0.0]), v0=np.zeros(2), times=t)
    c = np.linalg.solve(M, a)
    c /= a @ c
    mass, decay = c @ M @ c, 0.5 * C * (c @ c) / (c @ M @ c)
    w = np.sqrt(K * (c @ c) / mass - decay**2)
    exact = 0.01 * np.exp(-decay * t) * (np.cos(w * t) + decay / w * np.sin(w * t))
    assert motion.phi[:, 0] == pytest.approx(exact, abs=1e-11)
    other = ConstrainedSystem(M, lambda q: q[0], lambda q: np.array([1.0, 0.0]), force=line.force)
    held = bilateral_motion([line, other], q0=np.zeros(2), v0=np.zeros(2), times=t)
    assert np.max(np.abs(held.q)) < 1e-14


@pytest.mark.long
@pytest.mark.promise(
    "theory/boundary_layer.md", "from that of the rod by 2.2e-4", bound="3e-4, falling with b"
)
def test_a_string_in_the_layer_tends_to_the_rod():
    """The same pendulum on a string, rho = L - |q| >= 0: its tension differs from the rod's by
    O(b)."""
    m, g, angle = 2.0, 9.81, 1.0
    string = ConstrainedSystem(
        m * np.eye(2),
        lambda q: 1.0 - np.hypot(*q),
        lambda q: -q / np.hypot(*q),
        force=lambda t, q, v: np.array([0.0, -m * g]),
    )
    quarter = 1.0 / np.sqrt(g) * ellipk(np.sin(0.5 * angle) ** 2)
    errors = []
    for b in (1e-2, 1e-3):
        layer = Layer(b, k=4.0 * m * g / b, c=4.0 * m * g, speed=np.sqrt(g * b), start=0.5 * b)
        # in equilibrium along it
        q0 = (1.0 - 0.8548632868746187 * b) * np.array([np.sin(angle), -np.cos(angle)])
        motion = layer_motion(
            string, layer, q0=q0, v0=np.zeros(2), t_end=quarter, metric=Metric.FULL, rtol=1e-9
        )
        errors.append(motion.reaction[-1] / (m * g) - (3.0 - 2.0 * np.cos(angle)))
        assert motion.rho.min() > 0.0 and motion.rho.max() < b
    assert 0.0 < errors[1] == pytest.approx(0.127 * errors[0], rel=0.01) and errors[0] < 3e-4


# Errors
# --------------------------------------------------------------------------------------------------
def test_starts_and_systems_that_cannot_be():
    layer = Layer(1.0, k=1.0)
    with pytest.raises(InputError, match="rho = -0.1, outside the admissible set"):
        layer_motion(PLANE, layer, q0=[-0.1, 0.0], v0=[-1.0, 0.0], t_end=1.0)
    with pytest.raises(InputError, match="t_end is 0.0"):
        layer_motion(PLANE, layer, q0=[1.0, 0.0], v0=[-1.0, 0.0], t_end=0.0)
    # in the layer, at rest, V unknown
    with pytest.raises(InputError, match="layer speed V is 0.0"):
        layer_motion(PLANE, layer, q0=[0.5, 0.0], v0=[0.0, 0.0], t_end=1.0)
    with pytest.raises(InputError, match="mass matrix is not symmetric positive definite"):
        ConstrainedSystem(np.diag([1.0, -1.0]), PLANE.rho, PLANE.gradient)
    with pytest.raises(InputError, match="body's mass is 0.0"):
        RigidBody(0.0, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0))
    with pytest.raises(InputError, match="inertia is not symmetric"):
        RigidBody(1.0, (1.0, 1.0, -1.0), (0.0, 0.0, 0.0))
    with pytest.raises(InputError, match="normal has length zero"):
        RigidBody(1.0, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), normal=(0.0, 0.0, 0.0))
    with pytest.raises(InputError, match="semi-axis of the ellipsoid is 0.0"):
        Ellipsoid((1.0, 0.0, 1.0))
    with pytest.raises(InputError, match="at least one system"):
        bilateral_motion([], q0=np.zeros(2), v0=np.zeros(2), times=np.array([0.0, 1.0]))


def test_a_motion_that_cannot_be_integrated_names_its_time():
    wild = ConstrainedSystem(
        np.eye(2),
        PLANE.rho,
        PLANE.gradient,
        force=lambda t, q, v: np.array([-1.0, np.nan if t > 0.25 else 0.0]),
    )
    with pytest.raises(StepFailure, match=r"beyond t = 0\.2"):
        layer_motion(wild, Layer(0.1, k=1.0), q0=[1.0, 0.0], v0=[0.0, 0.0], t_end=1.0)


NAN, INF = np.nan, np.inf
ENDLESS = {
    "speed": (lambda: pushed(v0=[NAN, 0.0]), InputError, "v0 is nan"),
    "place": (lambda: pushed(q0=[INF, 0.0]), InputError, "q0 is inf"),
    "time": (lambda: pushed(t_end=INF), InputError, "t_end is inf"),
    "force": (lambda: pushed(lambda t: NAN), InputError, "force.* at the start is nan"),
    "force on the way": (
        lambda: pushed(lambda t: INF if t > 0.25 else 0.0),
        StepFailure,
        r"beyond t = 0\.25",
    ),
    "force in the layer": (
        lambda: pushed(lambda t: -INF if t > 0.95 else 0.0),
        StepFailure,
        r"beyond t = 0\.9",
    ),
    "distance": (lambda: pushed(rho=lambda q: NAN), InputError, r"rho\(q\) at the start is nan"),
    "distance on the way": (
        lambda: pushed(rho=lambda q: q[0] if q[0] > 0.5 else NAN),
        StepFailure,
        "rho.* nan",
    ),
    "great numbers": (lambda: pushed(v0=[-1e300, 0.0]), StepFailure, "beyond t = 0 s"),
    "held": (
        lambda: bilateral_motion([system()], q0=[0.0, 0.0], v0=[0.0, NAN], times=[0.0, 1.0]),
        InputError,
        "v0",
    ),
    "held, force": (
        lambda: bilateral_motion(
            [system(lambda t: INF if t > 0.5 else 1.0)],
            q0=[0.0, 0.0],
            v0=[0.0, 1.0],
            times=[0.0, 1.0],
        ),
        StepFailure,
        r"t = 0\.5",
    ),
    "held twice": (
        lambda: bilateral_motion(
            [system(), system()], q0=[0.0, 0.0], v0=[0.0, 1.0], times=[0.0, 1.0]
        ),
        StepFailure,
        "Singular matrix",
    ),
}


def system(force=lambda t: 0.0, rho=lambda q: float(q[0])):
    return ConstrainedSystem(
        np.eye(2),
        rho,
        lambda q: np.array([1.0, 0.0]),
        force=lambda t, q, v: np.array([force(t), 0.0]),
    )


def pushed(
    force=lambda t: 0.0, *, rho=lambda q: float(q[0]), q0=(1.0, 0.0), v0=(-1.0, 0.0), t_end=3.0
):
    return layer_motion(system(force, rho), Layer(0.1, k=1.0), q0=q0, v0=v0, t_end=t_end)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("name", ENDLESS)
def test_no_motion_goes_on_for_ever(name):
    """NaN and infinity given at the start or returned on the way end in one sentence."""
    act, kind, words = ENDLESS[name]
    with pytest.raises(kind, match=words):
        act()


def test_evaluations_are_counted(monkeypatch):
    """A force that varies without end stops at the bound, with the time it has come to."""
    monkeypatch.setattr(layer_motions, "EVALUATIONS", 2000)
    with pytest.raises(StepFailure, match="did not get beyond t = .* in 2000 evaluations"):
        pushed(lambda t: 1e9 * np.sin(1e9 * t))
