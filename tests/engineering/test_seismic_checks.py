"""S4.2 to S4.6: checks under earthquakes: published coefficients, exact series, an independent
program."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from newmark_block import SlidingBlock
from rigid_wall import RigidWall
from scipy.integrate import solve_ivp

from vi_contact.core.errors import InputError
from vi_contact.exact.housner import HousnerBlock
from vi_contact.practice.engineering.checks import (
    CoulombWedge,
    Housner,
    MononobeOkabe,
    NewmarkBlock,
    RackingRatio,
    VeletsosYounan,
    Wood,
)
from vi_contact.practice.engineering.checks.earth_pressure_seismic import smooth_wall
from vi_contact.practice.engineering.checks.earth_pressure_static import wedge

pytestmark = pytest.mark.serial
DEGREE, G = math.pi / 180.0, 9.80665
WALL = {"height": 10.0, "rho": 1900.0}
LAYER = WALL | {"nu": 0.3, "c_s": 150.0}  # lowest frequency 3.75 Hz
T = np.arange(2001) * 0.005


def run(acceleration: Any, **columns: Any) -> dict[str, Any]:
    """A wall that is pressed by 1e5 N at 4 m and 2e4 N at 6 m for each m/s²; ``columns`` come in
    their place."""
    a = np.asarray(acceleration, dtype=float)
    thrust = 1e5 + 2e4 * a
    return {
        "t": T,
        "a_g_x": a,
        "a_g_y": 0.0 * T,
        "N_wall": thrust,
        "height_wall": (4e5 + 12e4 * a) / thrust,
        "uplift_wall": 0.0 * T,
    } | columns


def test_mononobe_okabe_of_tables() -> None:
    """K_AE of (30°, 15°) and (35°, 17.5°) for kh = 0 … 0.3 as tabulated to four digits; K of EN
    1998-5, annex E, by a calculator of its own (phi 30°, tan psi = 0.24/1.12: 0.4856177)."""
    table = {
        (30.0, 15.0): (0.3014, 0.3679, 0.4520, 0.5626),
        (35.0, 17.5): (0.2461, 0.3056, 0.3797, 0.4743),
    }
    for (phi, delta), values in table.items():
        found = [
            wedge(phi * DEGREE, delta * DEGREE, 0.0, 0.0, psi=math.atan(kh))
            for kh in (0.0, 0.1, 0.2, 0.3)
        ]
        assert found == pytest.approx(values, abs=5e-5)
    annex = wedge(30.0 * DEGREE, 0.0, 0.0, 0.0, psi=math.atan(0.24 / 1.12))
    assert annex == pytest.approx(0.4856177257638489, rel=1e-12)


def test_mononobe_okabe_in_a_run() -> None:
    """The largest thrust of the run is compared; without earthquake it is Coulomb's; kv lightens
    and turns."""
    history = run(0.2 * G * np.sin(T))
    given = MononobeOkabe(**WALL, phi=30.0 * DEGREE, delta=15.0 * DEGREE, kh=0.3).compare(history)
    assert given.expected == pytest.approx(
        0.5626 * math.cos(15.0 * DEGREE) * 0.5 * 1900.0 * G * 100.0, rel=1e-4
    )
    assert given.found == history["N_wall"].max()
    lifted = MononobeOkabe(**WALL, phi=0.6, delta=0.3, kh=0.2, kv=0.1).compare(history)
    still = MononobeOkabe(**WALL, phi=0.6, delta=0.3, kh=0.0).compare(history)
    assert still.expected == CoulombWedge(**WALL, phi=0.6, delta=0.3).compare(history).expected
    factor = 0.9 * wedge(0.6, 0.3, 0.0, 0.0, psi=math.atan(0.2 / 0.9)) / wedge(0.6, 0.3, 0.0, 0.0)
    assert lifted.expected == pytest.approx(factor * still.expected, rel=1e-14)
    beyond = MononobeOkabe(**WALL, phi=0.5, kh=0.6).compare(history)
    assert math.isnan(beyond.expected) and "psi = 0.5404: no wedge" in beyond.applies


def mode(nu: float, k: float) -> tuple[float, float]:
    """(shear, vertical stress) on the rock, G = H = 1, of u = U sin k x, v = V cos k x under a unit
    force -sin k x: shares of exp(±k y), y exp(±k y) that satisfy equilibrium, from u = v = 0 below
    and no stresses above."""
    lam = 2.0 * nu / (1.0 - 2.0 * nu)
    stiff, d = lam + 2.0, (3.0 - 4.0 * nu) / k
    s, linear = np.array([-1.0, -1.0, 1.0, 1.0]), np.array([0.0, 1.0, 0.0, 1.0])

    def fields(y: float) -> tuple[Any, ...]:
        decay = np.exp(k * (s * y - (s > 0.0)))
        u = np.where(linear > 0.0, y, 1.0) * decay
        du = linear * decay + s * k * u
        return u, du, linear * d * decay - s * u, linear * d * s * k * decay - s * du

    (u0, du0, v0, dv0), (u1, du1, v1, dv1) = fields(0.0), fields(1.0)
    far = -1.0 / (stiff * k**2)
    rows = np.array([u0, v0, du1 - k * v1, lam * k * u1 + stiff * dv1])
    shares = np.linalg.solve(rows, [-far, 0.0, 0.0, -lam * k * far])
    return float(shares @ du0), stiff * float(shares @ dv0)


def test_smooth_wall_in_equilibrium() -> None:
    """The closed sums are those of modes whose shares are solved for: to round-off, for any nu and
    distance."""
    for nu, length in ((0.0, 20.0), (0.3, 2.0), (0.45, 5.0)):
        n = 2.0 * np.arange(1, 201) - 1.0
        k = n * np.pi / length
        shear, vertical = (
            np.array(one) * 4.0 / (n * np.pi)
            for one in zip(*(mode(nu, one) for one in k), strict=True)
        )
        thrust = 0.5 * length + np.sum(shear / k)
        height = (0.25 * length + np.sum(vertical / k**2)) / thrust
        assert smooth_wall(nu, length, 200) == pytest.approx((thrust, height), rel=1e-11)
    assert smooth_wall(0.5, 20.0)[0] == pytest.approx(smooth_wall(0.49999, 20.0)[0], rel=2e-5)


def test_smooth_wall_is_the_published_one() -> None:
    """Thrust and height of finite elements that were published to 0.2 % and three digits; few terms
    are enough."""
    for nu, thrust, height in ((0.3, 0.960, 0.576), (1 / 3, 0.987, 0.572), (0.4, 1.049, 0.564)):
        assert smooth_wall(nu, 20.0) == pytest.approx((thrust, height), rel=4e-3)
    exact = smooth_wall(0.3, 20.0, 32000)
    assert smooth_wall(0.3, 20.0) == pytest.approx(exact, rel=2e-6)
    # far is far
    assert smooth_wall(0.3, 40.0, 8000) == pytest.approx(smooth_wall(0.3, 20.0, 4000), rel=1e-5)
    narrow = smooth_wall(0.3, 0.02)[0]  # a column between two walls that hold all of it
    assert narrow == pytest.approx(0.01, rel=0.02)


def test_wood_of_slow_motions_only() -> None:
    slow, fast = (run(2.0 * np.sin(2.0 * np.pi * f * T)) for f in (0.4, 2.0))
    found = Wood(**LAYER).compare(slow)
    assert found.expected == pytest.approx(0.96128 * 1900.0 * 2.0 * 100.0, rel=1e-4)
    assert found.found == pytest.approx(4e4, rel=1e-4) and found.inputs["a"] == (
        float(slow["a_g_x"].max()),
        "m/s²",
    )
    height = Wood(**LAYER, of="height").compare(slow)
    assert (height.expected, height.found) == (
        pytest.approx(5.748, rel=1e-4),
        pytest.approx(6.0, rel=1e-12),
    )
    assert Wood(**LAYER, length=20.0).compare(slow).expected == pytest.approx(
        0.70344 * 38e4, rel=1e-4
    )
    refused = Wood(**LAYER).compare(fast)
    assert (
        refused.applies == "the motion has 2 Hz, above 0.3 of the layer's 3.75 Hz"
        and math.isnan(refused.expected)
    )
    opened = Wood(**LAYER).compare(slow | {"uplift_wall": 0.1 * (slow["a_g_x"] > 1.9)})
    assert opened.applies == "up to 10% of the wall leaves the soil"
    for check in (Wood, VeletsosYounan):  # open at rest already: no smooth wall that holds the soil
        agape = check(**LAYER).compare(slow | {"uplift_wall": 0.43 + 0.0 * T})
        assert agape.applies == "up to 43% of the wall leaves the soil" and math.isnan(
            agape.expected
        )
    for history in (run(0.0 * T), run(-np.abs(slow["a_g_x"]))):
        assert "never presses the soil on the wall" in Wood(**LAYER).compare(history).applies
    mirrored = slow | {"a_g_x": -slow["a_g_x"]}
    told = Wood(**LAYER, on_left=True).compare(mirrored)
    assert told.name == "Wood, on left" and told.inputs == found.inputs | {"on_left": (1.0, "-")}
    assert replace(told, name="Wood", inputs=found.inputs) == found


def test_veletsos_and_younan() -> None:
    """Slow: their static thrust and height; steady harmonics: the sum of moduli in closed form, at
    half of the lowest frequency and at one and a half of it."""
    slow = run(2.0 * np.sin(0.1 * np.pi * T) ** 2)
    static = RigidWall(10.0, 1900.0, 0.3)
    found = VeletsosYounan(**LAYER).compare(slow)
    assert found.expected == pytest.approx(static.thrust(float(slow["a_g_x"].max())), rel=3e-4)
    assert VeletsosYounan(**LAYER, of="height").compare(slow).expected == pytest.approx(
        5.986, rel=3e-4
    )
    n = 2.0 * np.arange(1, 41) - 1.0
    for ratio in (0.5, 1.5):
        history = run(2.0 * np.sin(2.0 * np.pi * ratio * 3.75 * T) * np.minimum(T / 4.0, 1.0))
        sums = np.sum(16.0 / (n * np.pi) ** 3 / np.sqrt(1.0 - (ratio / n) ** 2 / (1.0 + 0.2j)))
        expected = static.kappa * 1900.0 * 2.0 * 100.0 * abs(sums)
        assert VeletsosYounan(**LAYER, damping=0.1).compare(history).expected == pytest.approx(
            expected, rel=1e-2
        )
    start = {name: values[:2] for name, values in run(T).items()}
    assert "never presses" in VeletsosYounan(**LAYER).compare(start).applies


def block(acceleration: Any, **fields: Any) -> float:
    history = {
        "t": T,
        "a_g_x": np.asarray(acceleration, float),
        "a_g_y": 0.0 * T,
        "sliding_base": 0.0 * T,
    }
    return NewmarkBlock(**fields).compare(history).expected


def test_newmark_of_a_pulse_and_of_a_record() -> None:
    """The printed 0.4905 m of 0.4 g for 0.5 s, mu = 0.2 (g = 9.81); a noise as solved exactly in
    pieces."""
    t = np.array([0.0, 0.5, 0.5, 2.0])
    a = 0.4 * 9.81 * (t < 0.6) * np.array([1, 1, 0, 0])
    history = {"t": t, "a_g_x": a, "a_g_y": 0 * t, "sliding_base": 3.0 + t}
    pulse = NewmarkBlock(mu=0.2, gravity=9.81).compare(history)
    # parts of 16 and 47 ms
    assert pulse.expected == pytest.approx(0.4905, rel=1e-3) and pulse.found == 2.0
    noise = 8.0 * np.convolve(
        np.random.default_rng(1).standard_normal(2001), np.ones(20) / 20.0, "same"
    )
    exact = SlidingBlock(0.15, G).history(T, noise)[0]
    assert block(noise, mu=0.15) == pytest.approx(abs(exact[-1]), abs=4e-4 * np.abs(exact).max())
    assert block(0.14 * G * np.sin(T), mu=0.15) == 0.0


def test_newmark_to_one_side_is_that_of_an_independent_program() -> None:
    """pySLAMMER 0.2.2 (RigidAnalysis, ky = 0.1, both senses), on a motion in steps of 0.2 ms."""
    motion = 0.4 * np.sin(2 * np.pi * T) * np.sin(np.pi * T / 10) ** 2
    motion = G * (motion + 0.1 * np.sin(4.6 * np.pi * T) * np.sin(np.pi * T / 10))
    for sign, slid in ((-1.0, 1.1838483), (1.0, 1.1390758)):
        # the step of 5 ms: 2e-4
        assert block(sign * motion, mu=0.1, one_sided=True) == pytest.approx(slid, rel=6e-4)


def test_newmark_on_a_slope() -> None:
    """A block on a slope under a pulse to the left: constant accelerations, before and after it."""
    mu, slope, a = 0.5, 0.3, 4.0
    pulse = np.where(T <= 1.0, -a, 0.0)  # falls to zero within one step of 5 ms
    c, s = math.cos(slope), math.sin(slope)
    first, then = G * s + a * c - mu * (G * c - a * s), mu * G * c - G * s
    slid = 0.5 * first * (1.0 + first / then)
    assert block(pulse, mu=mu, slope=slope) == pytest.approx(slid, rel=0.02)
    assert block(1e-3 * pulse, mu=mu, slope=slope) == 0.0
    falling = {"t": T, "a_g_x": 0.0 * T, "a_g_y": -12.0 * np.sin(T), "sliding_base": 0.0 * T}
    assert "falls away" in NewmarkBlock(mu=0.5).compare(falling).applies
    assert "slides under its weight" in NewmarkBlock(mu=0.2, slope=0.3).compare(falling).applies


def test_newmark_slides_to_the_side_that_is_named() -> None:
    """Mirrored motions, planes and sides slide alike; the pulse of 0.4 g to +x takes a wall whose
    fill is on its right 0.4905 m to -x, and one on a plane that falls by nothing to +x, not at all;
    a plane that falls to either side."""
    noise = 8.0 * np.convolve(
        np.random.default_rng(1).standard_normal(2001), np.ones(20) / 20.0, "same"
    )
    for slope, towards in ((0.0, -1.0), (0.02, -1.0), (0.02, 1.0), (-0.02, 0.0)):
        fields = {"mu": 0.15, "one_sided": True}
        slid = block(noise, slope=slope, towards=towards, **fields)
        assert (
            slid
            == pytest.approx(block(-noise, slope=-slope, towards=-towards, **fields), rel=1e-12)
            and slid > 0.01
        )
    pulse = np.where(T < 0.5, 0.4 * 9.81, 0.0)
    away = {"mu": 0.2, "gravity": 9.81, "one_sided": True, "towards": -1.0}
    # the pulse ends within a step of 5 ms
    assert block(pulse, **away) == pytest.approx(0.4905, rel=0.02)
    assert (
        block(pulse, **(away | {"towards": 1.0}))
        == block(pulse, **(away | {"towards": 0.0}))
        == 0.0
    )
    downhill = block(-pulse, mu=0.4, slope=0.2, one_sided=True)
    assert (
        downhill == pytest.approx(block(pulse, mu=0.4, slope=-0.2, one_sided=True), rel=1e-12)
        and downhill > 0.1
    )
    history = run(pulse, sliding_base=-0.002 + 1e-3 * T)
    assert "slides under its weight" in NewmarkBlock(mu=0.2, slope=-0.5).compare(history).applies
    assert NewmarkBlock(**away).compare(history).name == "NewmarkBlock, one sided"
    # through zero
    assert NewmarkBlock(**away).compare(history).found == pytest.approx(0.01, rel=1e-12)
    silent = NewmarkBlock(mu=0.2).compare(run(0.0 * T, sliding_base=0.0 * T))
    assert silent.applies.startswith("the column a_g_x is zero: name acceleration=") and math.isnan(
        silent.expected
    )


def rocking(
    check: Housner, a: Any, theta: float, end: float, up: float = 0.0
) -> tuple[float, float]:
    """(the largest angle, the time of the first impact) by an integrator that finds the landings
    itself."""
    alpha, p2 = (
        math.atan(check.width / check.height),
        1.5 * G / math.hypot(check.width, check.height),
    )
    side = math.copysign(1.0, theta)

    def rate(t: float, y: Any) -> tuple[float, float]:
        left = alpha - side * y[0]
        return y[1], p2 * (a(t) / G * math.cos(left) - side * (1.0 + up / G) * math.sin(left))

    def landed(t: float, y: Any) -> float:
        return side * y[0]

    landed.terminal, landed.direction = True, -1.0  # type: ignore[attr-defined]
    t, y, most, first = 0.0, np.array([theta, 0.0]), abs(theta), math.nan
    while t < end:
        done = solve_ivp(rate, (t, end), y, events=landed, rtol=1e-10, atol=1e-13, max_step=0.01)
        t, y, most = done.t[-1], done.y[:, -1], max(most, np.abs(done.y[0]).max())
        if done.status == 1:
            first = t if math.isnan(first) else first
            side, y = -side, np.array([-side * 1e-12, (1.0 - 1.5 * math.sin(alpha) ** 2) * y[1]])
    return most, first


@pytest.mark.long
def test_housner_free_and_shaken() -> None:
    """Against an integrator with events: free rocking and a block released under a harmonic; 0.1 %
    of angle and time. A slender block has the closed form of the first landing to 0.2 %."""
    check = {"width": 1.0, "height": 5.0}
    for amplitude, theta in ((0.0, 0.1), (1.2, 0.05)):
        motion = amplitude * np.sin(3.0 * T)
        largest, first = rocking(
            Housner(**check), lambda t, A=amplitude: A * math.sin(3.0 * t), theta, 6.0
        )
        kept = T <= 6.0
        history = {
            "t": T,
            "a_g_x": motion,
            "a_g_y": 0.0 * T,
            "theta_base": np.where(T < 1.0, theta, -0.02),
        }
        history = {name: column[kept] for name, column in history.items()}
        angle = Housner(**check).compare(history)
        assert (
            angle.expected == pytest.approx(largest, rel=3e-3)
            and angle.found == theta
            and angle.unit == "rad"
        )
        landing = Housner(**check, of="impact").compare(history)
        assert landing.expected == pytest.approx(
            first, rel=1e-3
        ) and landing.found == pytest.approx(1.0, rel=0.01)
    slender = HousnerBlock(1.0, 5.0, G)
    first = rocking(Housner(**check), lambda t: 0.0, 0.1, 2.0)[1]
    assert first == pytest.approx(slender.impact_times(0.1, 1)[0], rel=3e-3)


@pytest.mark.long
def test_housner_on_ground_that_rises_or_falls() -> None:
    """A released block under a steady vertical acceleration, as an integrator with events has
    it."""
    check = {"width": 1.0, "height": 5.0}
    history = {"t": T, "a_g_x": 0.8 * np.sin(3.0 * T), "theta_base": np.where(T < 1.0, 0.05, -0.02)}
    for up in (-2.0, 2.0):
        largest, first = rocking(Housner(**check), lambda t: 0.8 * math.sin(3.0 * t), 0.05, 6.0, up)
        kept = {
            name: column[T <= 6.0] for name, column in (history | {"a_g_y": 0.0 * T + up}).items()
        }
        assert Housner(**check).compare(kept).expected == pytest.approx(largest, rel=3e-3)
        assert Housner(**check, of="impact").compare(kept).expected == pytest.approx(
            first, rel=1e-3
        )
    assert (
        "falls away below"
        in Housner(**check).compare(history | {"a_g_y": -12.0 * np.sin(T)}).applies
    )
    still = {"t": T, "a_g_x": 0.0 * T, "a_g_y": 0.0 * T, "theta_base": 8e-17 + 0.0 * T}
    assert "does not rock" in Housner(width=3.0, height=4.0).compare(still).applies


@pytest.mark.long
def test_housner_where_it_does_not_apply() -> None:
    """Onset at g b/h; a pulse a little longer than the closed form overturns the block, a shorter
    one does not."""
    check = {"width": 0.4, "height": 4.0}
    slender = HousnerBlock(0.4, 4.0, G)

    def shaken(pulse: Any, **fields: Any) -> str:
        history = {
            "t": T,
            "a_g_x": np.asarray(pulse, float),
            "a_g_y": 0.0 * T,
            "theta_base": 0.0 * T,
        }
        return Housner(**(check | fields)).compare(history).applies

    onset = slender.onset_acceleration
    assert "does not rock" in shaken(0.99 * onset * np.sin(T)) and not shaken(
        1.05 * onset * np.sin(20.0 * T)
    )
    time = slender.overturning_time(3.0 * onset)
    longer, shorter = (
        3.0 * onset * np.where(factor * time > T, 1.0, 0.0) for factor in (1.03, 0.97)
    )
    assert shaken(longer) == "the rigid block overturns" and not shaken(shorter)
    assert "stops a block as wide" in shaken(20.0 * np.sin(T), width=6.0)


BOX = {
    "width": 6.0,
    "height": 4.0,
    "wall": 1e8,
    "roof": 1e8,
    "invert": 1e8,
    "nu": 0.3,
    "depth": 10.0,
}


def test_racking_of_a_run() -> None:
    """The example of F = 2.565 (G = 42.75 MPa, members of 0.4 m); the largest changes of racking
    since the start."""
    stiff = 30e9 / (1.0 - 0.2**2) * 0.4**3 / 12.0
    box = BOX | dict.fromkeys(("wall", "roof", "invert"), stiff)
    history = {"racking_box": 0.1 + 1.6e-3 * np.sin(T), "racking_free_field": 1e-3 * np.sin(T)}
    found = RackingRatio(**box, shear_modulus=1900.0 * 150.0**2).compare(history)
    assert found.inputs["F"][0] == pytest.approx(2.565, abs=5e-4)
    assert found.expected == pytest.approx(4 * 0.7 * 2.5654 / (1.8 + 2.5654), rel=1e-4)
    assert found.found == pytest.approx(1.6, rel=1e-12)
    soft = RackingRatio(**box, shear_modulus=2e8).compare(history)
    assert "beyond 10, where the curves end" in soft.applies and math.isnan(soft.expected)
    assert (
        "less than 1.5"
        in RackingRatio(**(box | {"depth": 5.0}), shear_modulus=1e7).compare(history).applies
    )
    still = RackingRatio(**box, shear_modulus=1e7).compare(
        history | {"racking_free_field": 0.0 * T}
    )
    assert still.applies == "the free field does not shear" and math.isnan(still.found)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda: Wood(**(LAYER | {"nu": 0.6})), "nu is 0.6; give one from 0 to 0.5$"),
        (lambda: Housner(width=1.0, height=5.0, of="slip"), "unknown Housner: of 'slip'"),
    ],
)
def test_wrong_fields(wrong: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        wrong()
