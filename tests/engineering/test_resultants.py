"""Resultants, racking, peaks, loops and spectra without finite elements, against hand
calculations."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from chain import chain_problem

import vi_contact as vc
from vi_contact import engineering
from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.practice.engineering.floor_spectra import konno_ohmachi
from vi_contact.practice.engineering.peak_values import HEADER
from vi_contact.practice.plots.maps import arc_position, thin_rows
from vi_contact.run.recorders.contact_parts import Part
from vi_contact.run.recorders.racking import racking

pytestmark = pytest.mark.serial


@dataclass(frozen=True)
class Points:
    """Contact points as a surface has them."""

    points: Array
    normals: Array
    weights: Array
    uncovered: Any = None


HALVES = np.array([0.5, 1.0, 0.5])
FOOTING = Points(
    np.column_stack([[0.0, 1.0, 2.0], np.zeros(3)]), np.tile([0.0, -1.0], (3, 1)), HALVES
)
WALL = Points(
    np.column_stack([np.full(3, 4.0), [1.0, 2.0, 3.0]]), np.tile([1.0, 0.0], (3, 1)), np.ones(3)
)


def history(geometry: Points, r_n: Any, gap: Any, r_t: Any = None) -> dict[str, Array]:
    """Rows of reactions [N] as Contact() would have recorded them."""
    r_n, gap = (
        np.atleast_2d(np.asarray(r_n, dtype=float)),
        np.atleast_2d(np.asarray(gap, dtype=float)),
    )
    t = np.arange(len(r_n), dtype=float)
    found = {"t": t, "pressure": r_n / geometry.weights, "gap": gap, "active": gap == 0.0}
    if r_t is not None:
        shape = (*r_n.shape, 1)
        found["traction_t"] = np.reshape(np.asarray(r_t, dtype=float) / geometry.weights, shape)
        found["slip"] = np.reshape(np.tile([0.1, -0.3, 0.2], (len(r_n), 1)), shape)
    return found


def test_footing() -> None:
    """N up, T to the right, M anticlockwise about the middle; e is where N acts; the left end has
    lifted off."""
    rows = history(FOOTING, [[0.0, 30.0, 10.0]], [[2e-3, 0.0, 0.0]], [[0.0, 6.0, 2.0]])
    found = engineering.contact_summary(rows, FOOTING, centre=(1.0, 0.0))
    expected = {
        "uplift": 0.25,
        "opening": 2e-3,
        "slip": 0.3,
        "N": 40.0,
        "T": -8.0,
        "M": 10.0,
        "e": 0.25,
        "height": 0.0,
        "force_x": -8.0,
        "force_y": 40.0,  # the tangent of n = (0, -1) is (1, 0): friction on the body points left
    }
    assert {name: float(values[0]) for name, values in found.items()} == pytest.approx(
        expected, rel=1e-14
    )


def test_wall_thrust_and_its_height() -> None:
    """The thrust pushes a wall on the left of its soil to the left; its height counts from the
    centre's level."""
    rows = history(WALL, [[5.0, 3.0, 2.0], [0.0, 0.0, 0.0]], [[0.0] * 3, [1.0] * 3])
    found = engineering.contact_summary(rows, WALL, centre=(4.0, 0.5))
    assert found["N"].tolist() == [10.0, 0.0]
    assert found["force_x"].tolist() == [-10.0, 0.0]
    assert found["height"][0] == pytest.approx(
        (5.0 * 0.5 + 3.0 * 1.5 + 2.0 * 2.5) / 10.0, rel=1e-14
    )
    assert found["e"][0] == pytest.approx(found["height"][0], rel=1e-14)  # t = (0, 1)
    assert found["M"][0] == pytest.approx(12.0, rel=1e-14)
    assert np.isnan(found["height"][1]) and np.isnan(found["e"][1])
    assert found["uplift"].tolist() == [0.0, 1.0]


def test_ends_of_a_part_are_covered() -> None:
    """Before the last point there is nothing, so that its 80 N over 0.5 m are no pressure: the end
    is the point next to it, with 30 N over 1 m. Where no point is covered all of them count."""
    r_n = np.array([20.0, 30.0, 80.0])
    for covered, high in (((True, True, False), 30.0), ((False, False, False), 160.0)):
        geometry = Points(FOOTING.points, FOOTING.normals, FOOTING.weights, ~np.array(covered))
        part = Part("base", geometry, None, None, None)
        assert (r_n @ part.ends).tolist() == pytest.approx([40.0, high], rel=1e-14)


def test_part_by_position_and_by_direction() -> None:
    """A corner of floor and wall: each part for itself; both together need a direction of N when
    they cancel."""
    corner = Points(
        np.vstack([FOOTING.points, WALL.points]),
        np.vstack([FOOTING.normals, WALL.normals]),
        np.concatenate([FOOTING.weights, WALL.weights]),
    )
    rows = history(corner, [[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]], [[0.0] * 6])
    floor = engineering.contact_summary(
        rows, corner, centre=(1.0, 0.0), where=lambda x, n: n[:, 1] < -0.5
    )
    high = engineering.contact_summary(
        rows, corner, centre=(4.0, 2.0), where=lambda x, n: x[:, 1] >= 2.0
    )
    assert (floor["N"][0], high["N"][0]) == (6.0, 11.0)
    assert high["height"][0] == pytest.approx(6.0 / 11.0)
    ring = Points(
        corner.points, np.vstack([FOOTING.normals, -FOOTING.normals]), np.tile(FOOTING.weights, 2)
    )
    with pytest.raises(InputError, match="cancel"):
        engineering.contact_summary(rows, ring, centre=(0.0, 0.0))
    rows = history(ring, [[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]], [[0.0] * 6])
    both = engineering.contact_summary(rows, ring, centre=(0.0, 0.0), normal=(0.0, -3.0))
    assert both["N"][0] == pytest.approx(6.0 - 15.0)


def test_three_dimensions() -> None:
    """M is a vector, T and e are sizes: N = 3 at (1, 2) with a drag along x."""
    surface = Points(np.array([[1.0, 2.0, 0.0]]), np.array([[0.0, 0.0, -1.0]]), np.ones(1))
    rows = {
        "t": np.zeros(1),
        "pressure": np.full((1, 1), 3.0),
        "gap": np.zeros((1, 1)),
        "active": np.ones((1, 1)),
    }
    found = engineering.contact_summary(rows, surface, centre=(0.0, 0.0, 0.0))
    assert (found["M_x"][0], found["M_y"][0], found["M_z"][0]) == (6.0, -3.0, 0.0)
    assert found["e"][0] == pytest.approx(np.sqrt(5.0))
    assert (found["N"][0], found["T"][0]) == (3.0, 0.0)


def test_bad_parts_are_refused() -> None:
    rows = history(FOOTING, [[0.0, 1.0, 0.0]], [[0.0] * 3])
    for data, text in (
        ({"centre": (0.0,)}, "the centre has shape"),
        ({"centre": (0.0, 0.0), "where": lambda x, n: x[:, 0] > 9.0}, "no contact points"),
        ({"centre": (0.0, 0.0), "where": lambda x, n: np.arange(2)}, "boolean mask"),
    ):
        with pytest.raises(InputError, match=text):
            engineering.contact_summary(rows, FOOTING, **data)
    with pytest.raises(InputError, match="no column gap"):
        engineering.contact_summary(
            {"t": rows["t"], "pressure": rows["pressure"]}, FOOTING, centre=(0.0, 0.0)
        )
    with pytest.raises(InputError, match="letters"):
        vc.Resultants("left toe", (0.0, 0.0))


def test_recorder_agrees_with_the_summary() -> None:
    """Recorded while the chain bounces between its walls, and computed from its history
    afterwards."""
    problem = chain_problem(
        4,
        gap=1e-3,
        left_gap=2e-3,
        excitation=vc.Harmonic(3.0, 2.0, direction=(1.0,)),
        consistent=True,
    )
    right = {"where": lambda x, n: n[:, 0] > 0.0}
    recorder = vc.Resultants("right", (0.0,), **right)
    scheme = vc.ZienkiewiczWoodTaylor()
    solution = vc.simulate(
        problem, scheme=scheme, dt=5e-3, steps=200, record=[vc.Contact(), recorder], progress=False
    )
    after = engineering.contact_summary(solution.history, problem.surface, centre=(0.0,), **right)
    assert {"uplift", "opening", "N", "force_x", "height"} <= set(after)
    assert 0.0 < after["uplift"].mean() < 1.0
    for name, values in after.items():
        assert np.array_equal(solution.history[f"{name}_right"], values, equal_nan=True), name
    assert solution.columns["uplift_right"][0] == "-"


def test_racking_ignores_rigid_motion() -> None:
    """gamma = du_x/dy + du_y/dx = .003 of a sheared, turned and carried rectangle; a trapezium
    too."""
    box = np.array([[0.0, 0.0], [6.0, 0.0], [6.0, 4.0], [0.0, 4.0]])
    for corners in (box, box + [[0, 0], [1, 0], [-1, 0.5], [0.5, 0]]):
        gradient = np.array([[1e-3, 2e-3 - 0.01], [1e-3 + 0.01, -2e-3]])
        shear, turn = racking(corners, corners @ gradient.T + [0.3, -0.2])
        assert shear == pytest.approx(3e-3, rel=1e-10)
        assert turn == pytest.approx(0.0095, rel=1e-10)
    bent = np.zeros((4, 2))
    bent[2:, 0] = [0.004, 0.008]  # the mean of both walls: 1.5e-3
    assert racking(box, bent)[0] == pytest.approx(1.5e-3, rel=1e-12)
    with pytest.raises(InputError, match="four corners"):
        vc.Racking({"a": box[:3]})
    with pytest.raises(InputError, match="one line"):
        vc.Racking({"a": [[0, 0], [1, 1], [2, 2], [3, 3]]})


COLUMNS = {"t": ("s", "time"), "a": ("m", "a length"), "b": ("N", "a force"), "c": ("m", "nothing")}


def test_peaks_table(tmp_path: Path) -> None:
    """First instants of the extremes; nan left out; what is nan throughout says so."""
    t = np.arange(5.0)
    rows = {
        "t": t,
        "a": np.array([0.0, 3.0, -1.0, 3.0, -1.0]),
        "b": np.array([np.nan, 2.0, 5.0, 1.0, 1.0]),
        "c": np.full(5, np.nan),
    }
    path = engineering.write_peaks(tmp_path / "peaks.csv", engineering.peaks(rows, COLUMNS))
    with path.open(newline="") as file:
        read = list(csv.reader(file))
    assert tuple(read[0]) == HEADER
    assert read[1:] == [
        ["a", "a length", "m", "3.0", "1.0", "-1.0", "2.0"],
        ["b", "a force", "N", "5.0", "2.0", "1.0", "3.0"],
        ["c", "nothing", "m", "nan", "nan", "nan", "nan"],
    ]
    with pytest.raises(InputError, match="no column 'd': it has t, a, b, c"):
        engineering.peaks(rows, COLUMNS, ["d"])


def test_loop_work_is_its_area() -> None:
    """x = sin, F = k x + c cos: secant stiffness k, work pi c a cycle, for a damper of the
    amplitude 1."""
    t = np.linspace(0.0, 2.0 * np.pi, 2001)
    history = {"t": t, "x": np.sin(t), "f": -(7.0 * np.sin(t) + 0.5 * np.cos(t))}
    loop = engineering.hysteresis(history, "x", "f", sign=-1.0)
    assert loop.work[-1] == pytest.approx(0.5 * np.pi, rel=1e-5)
    assert loop.stiffness == pytest.approx(7.0, rel=1e-5)


OMEGA, ZETA = 2.0 * np.pi * 5.0, 0.05


def oscillator(steps: int = 2000, dt: float = 2e-3) -> dict[str, Array]:
    """A damped oscillator of 5 Hz and 5 % under a Ricker wave, until it rests: absolute and ground
    accelerations."""
    stiffness = 2.0 * OMEGA**2  # mass 2 kg
    problem = chain_problem(
        1,
        gap=1.0,
        damping=2.0 * ZETA / OMEGA,
        excitation=vc.Ricker(3.0, 6.0, direction=(1.0,)),
        stiffness=stiffness,
    )
    probe = vc.Probe({"top": (1.0,)}, acceleration=True)
    run = vc.simulate(
        problem, scheme=vc.Trapezoidal(), dt=dt, steps=steps, record=[probe], progress=False
    )
    return dict(run.history)


@pytest.fixture(scope="module")
def resting() -> dict[str, Array]:
    return oscillator()


@pytest.mark.long
def test_transfer_function_of_an_oscillator(resting: dict[str, Array]) -> None:
    """|absolute/ground| = sqrt(1 + (2 z r)²)/sqrt((1 - r²)² + (2 z r)²): 1 % up to twice its
    frequency, 10.05 at it."""
    frequencies = np.array([1.0, 2.5, 4.0, 5.0, 6.0, 8.0, 10.0])
    raw = engineering.transfer_function(resting, "a_x_top", frequencies=frequencies, bandwidth=None)
    r = 2.0 * np.pi * frequencies / OMEGA
    exact = np.sqrt(1.0 + (2.0 * ZETA * r) ** 2) / np.sqrt(
        (1.0 - r**2) ** 2 + (2.0 * ZETA * r) ** 2
    )
    assert np.abs(raw.amplitude / exact - 1.0).max() < 0.01
    smooth = engineering.transfer_function(
        resting, "a_x_top", frequencies=np.linspace(3.0, 7.0, 81)
    )
    assert smooth.peak[0] == pytest.approx(5.0, abs=0.15)
    assert 0.8 * exact.max() < smooth.peak[1] < exact.max()
    same = engineering.transfer_function(resting, "a_g_x", "a_g_x")
    assert np.nanmax(np.abs(same.amplitude - 1.0)) < 1e-12
    with pytest.raises(InputError, match="half the sampling"):
        engineering.transfer_function(resting, "a_x_top", frequencies=np.array([1e6]))
    with pytest.raises(InputError, match="zero throughout"):
        engineering.transfer_function(resting | {"a_g_x": np.zeros(len(resting["t"]))}, "a_x_top")


def test_floor_spectrum_and_its_frame(resting: dict[str, Array]) -> None:
    """A stiff oscillator on the mass feels its peak absolute acceleration; relative motion is
    absolute less ground."""
    periods = np.array([0.02, 1.0])
    spectrum = engineering.floor_spectrum(resting, "a_x_top", periods)
    assert spectrum.psa[0] == pytest.approx(np.abs(resting["a_x_top"]).max(), rel=0.03)
    motions = [
        engineering.recorded_motion(resting, "a_x_top", relative=one).acceleration
        for one in (False, True)
    ]
    ground = engineering.recorded_motion(resting, "a_g_x").acceleration
    assert np.abs(motions[0] - motions[1] - ground).max() < 1e-14
    assert (
        np.abs(engineering.recorded_motion(resting, "a_g_x", relative=True).acceleration).max()
        == 0.0
    )
    with pytest.raises(InputError, match="not an acceleration"):
        engineering.recorded_motion(resting, "u_x_top")


def test_velocities_know_the_jumps_of_impacts() -> None:
    """A chain between walls: the integral of the motion from velocities ends where the velocity
    does, jumps included; without an impact law both columns are the same motion."""
    for impact, same in ((vc.Inelastic(), False), (None, True)):
        problem = chain_problem(
            3,
            gap=1e-3,
            left_gap=2e-3,
            excitation=vc.Ricker(3.0, 6.0, direction=(1.0,)),
            impact=impact,
            consistent=True,
        )
        probe = vc.Probe({"end": (3.0,)}, velocity=True, acceleration=True)
        scheme = vc.ZienkiewiczWoodTaylor()
        rows = vc.simulate(
            problem, scheme=scheme, dt=5e-3, steps=200, record=[probe], progress=False
        ).history
        a, v = (
            engineering.recorded_motion(rows, f"{kind}_x_end", relative=True).acceleration
            for kind in "av"
        )
        assert 5e-3 * v.sum() == pytest.approx(
            rows["v_x_end"][-1], abs=1e-12 * np.abs(rows["v_x_end"]).max()
        )
        difference = np.abs(a - v)[1:].max() / np.abs(v).max()
        assert difference < 1e-10 if same else difference > 1e-2


def test_uneven_steps_are_brought_to_even_ones() -> None:
    """A line stays a line."""
    t = np.array([0.0, 0.1, 0.2, 0.25, 0.3, 0.4, 0.5])
    record = engineering.recorded_motion({"t": t, "a_x_top": 3.0 * t}, "a_x_top")
    assert record.dt == pytest.approx(0.1)
    assert (
        np.abs(record.acceleration - 3.0 * record.times).max() < 1e-14
        and len(record.acceleration) == 6
    )


def test_konno_ohmachi_keeps_constants_and_powers_centre() -> None:
    f = np.linspace(0.01, 20.0, 2000)
    assert np.abs(konno_ohmachi(f, np.full(2000, 2.5), np.array([0.5, 3.0])) - 2.5).max() < 1e-14
    peak = np.where(np.abs(f - 5.0) < 0.011, 1.0, 0.0)
    smooth = konno_ohmachi(f, peak, np.array([4.0, 5.0, 6.0]))
    assert smooth[1] > 10.0 * smooth[0] and smooth[1] > 10.0 * smooth[2]


def test_arc_position_of_lines_and_channels() -> None:
    """Straight: the coordinate; inclined: length; U-shaped, in any order: arc length from the top
    left."""
    place, name = arc_position(WALL.points)
    assert place.tolist() == [1.0, 2.0, 3.0] and name == "y [m]"
    place, name = arc_position(np.array([[0.0, 0.0], [3.0, 4.0], [1.5, 2.0]]))
    assert place == pytest.approx([0.0, 5.0, 2.5]) and "length" in name
    channel = np.array(
        [[0.0, 2.0], [2.0, 2.0], [0.0, 1.0], [0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0]]
    )
    place, name = arc_position(channel)
    assert place == pytest.approx([0.0, 6.0, 1.0, 2.0, 3.0, 4.0, 5.0]) and name == "arc length [m]"
    sides = np.array(
        [[-1.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, -1.0], [0.0, -1.0], [1.0, 0.0], [1.0, 0.0]]
    )
    corners, other = (
        np.vstack([channel, channel[[3, 5]]]),
        np.vstack([sides, [[-1.0, 0.0], [0.0, -1.0]]]),
    )
    place, _ = arc_position(corners, other)  # each corner's condition on the side that comes first
    assert place == pytest.approx([0.0, 6.0, 1.0, 2.0, 3.0, 4.0, 5.0, 2.0, 4.0], abs=1e-4)
    assert place[7] < place[3] < place[4] < place[8] < place[5]


def test_thinned_maps_keep_peaks() -> None:
    values = np.zeros((10007, 2))
    values[7003, 1] = 5.0
    values[7004, 0] = -4.0
    t, shown = thin_rows(np.arange(10007.0), values)
    assert len(t) == len(shown) == 1200 and shown[:, 1].max() == 5.0 and shown[:, 0].min() == -4.0


def test_racking_of_nothing_is_refused():
    with pytest.raises(
        InputError, match="Racking: frames is empty; give labels and four corners each"
    ):
        vc.Racking({})
