"""S4.8: What checks take from a run, what they tell of it, and moments, by hand."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vi_contact.core.errors import InputError
from vi_contact.practice.engineering.checks import (
    AtRest,
    CoulombWedge,
    MononobeOkabe,
    NewmarkBlock,
    Rankine,
    VeletsosYounan,
    Wood,
)
from vi_contact.practice.engineering.checks.comparison import find_duration
from vi_contact.practice.engineering.checks.earth_pressure_static import wedge
from vi_contact.practice.engineering.checks.model_facts import ModelFacts

pytestmark = pytest.mark.serial
WALL = {"height": 6.0, "rho": 2000.0, "gravity": 10.0}  # rho g H²/2 = 360 kN/m, H/3 = 2 m
THIRTY = math.pi / 6.0
FACTS = ModelFacts(
    friction={"stem": 0.2, "base_bottom on ground_base": 0.5},
    masses={"wall": 1000.0, "fill": 5000.0},
    densities={"wall": 2500.0, "fill": 2000.0},
)


def run(**columns: Any) -> dict[str, Any]:
    """Five rows: 100 kN/m at rest 1 m above the foot, with a peak of 150 kN/m at 2 m in one row."""
    return {
        "t": np.array([0.0, 0.1, 0.2, 0.3, 0.4]),
        "N_stem": np.array([100e3, 120e3, 150e3, 120e3, 100e3]),
        "height_stem": np.array([1.0, 1.5, 2.0, 1.5, 1.0]),
        "uplift_stem": np.zeros(5),
        "a_g_x": np.array([0.0, 1.0, 2.0, -2.5, 0.0]),
        "a_g_y": np.zeros(5),
    } | columns


def test_moments_about_the_foot() -> None:
    """At rest 360 kN/m x 3/7 at 2 m, Rankine's third of it, and 360 + 60 kN/m with a surcharge of
    10 kPa, which acts at 3 m; the run has 100 kNm/m at rest, 300 kNm/m at its peak."""
    rest = AtRest(**WALL, nu=0.3, part="stem")
    thrust, moment = rest.compare_all(run())
    assert (thrust.name, moment.name) == ("AtRest", "AtRest, moment")
    assert (thrust.unit, moment.unit) == ("N/m", "N m/m")
    assert moment.expected == pytest.approx(360e3 * 3.0 / 7.0 * 2.0, rel=1e-14)
    assert moment.found == 100e3
    loaded = Rankine(**WALL, phi=THIRTY, part="stem", surcharge=1e4, of="moment").compare(run())
    assert loaded.expected == pytest.approx((360e3 * 2.0 + 60e3 * 3.0) / 3.0, rel=1e-14)
    shaken = MononobeOkabe(**WALL, phi=THIRTY, kh=0.25, part="stem", of="moment")
    K = wedge(THIRTY, 0.0, 0.0, 0.0, psi=math.atan(0.25))
    assert shaken.compare(run()).expected == pytest.approx(K * 720e3, rel=1e-14)
    assert shaken.compare(run()).found == 300e3
    assert shaken.compare_all(run())[0].name == "MononobeOkabe, moment"
    wide = AtRest(**WALL, nu=0.3, part="stem", width=2.0, of="moment")
    assert wide.compare(run()).found == 50e3


def test_the_moment_of_what_an_earthquake_adds() -> None:
    """Thrust 50 kN/m and moment 300 - 100 kNm/m in the row of the largest thrust; expected the
    thrust of the theory times its height."""
    history = run(a_g_x=1e-3 * np.array([0.0, 1.0, 2.0, 1.0, 0.0]))
    for check in (Wood, VeletsosYounan):
        given = {**WALL, "nu": 0.3, "c_s": 300.0, "part": "stem"}
        thrust, moment = check(**given).compare_all(history)
        height = check(**given, of="height").compare(history)
        assert (thrust.found, moment.found) == (50e3, 200e3)
        assert moment.expected == pytest.approx(
            check(**given).find_added_thrust(history["t"], history["a_g_x"])[0]
            * check(**given).find_added_thrust(history["t"], history["a_g_x"])[1],
            rel=1e-14,
        )
        assert height.found == 4.0


def test_less_than_the_active_moment_at_rest_is_unsafe() -> None:
    """100 of 120 kN/m, and 100 of 240 kNm/m; not for passive pressure, which is far above."""
    thrust, moment = Rankine(**WALL, phi=THIRTY, part="stem").compare_all(run())
    assert "at rest the thrust of the run is 0.83 of the active one" in thrust.notes[0]
    assert "at rest the moment of the run is 0.42 of the active one" in moment.notes[0]
    assert "unsafe" in moment.notes[0] and "below 1" in moment.reading
    pressed = run(N_stem=np.full(5, 120e3), height_stem=np.full(5, 2.0))
    for check in (
        Rankine(**WALL, phi=THIRTY, part="stem", passive=True),
        CoulombWedge(**WALL, phi=THIRTY, part="stem", passive=True),
    ):
        results = check.compare_all(run())
        assert not any(result.notes for result in results)
        assert all("above 1 the run presses more than soil bears" in one.reading for one in results)
    assert not any(
        result.notes for result in Rankine(**WALL, phi=THIRTY, part="stem").compare_all(pressed)
    )


def test_how_long_a_peak_lasts() -> None:
    """1 at t = 2 s between 0 at 1 s and 3 s: above 0.9 from 1.9 to 2.1 s; the ends of a run cut it
    off; a column that falls and rises again has one peak."""
    t = np.arange(5.0)
    assert find_duration(t, np.array([0.0, 0.0, 1.0, 0.0, 0.0])) == (pytest.approx(0.2), 1)
    assert find_duration(t, np.array([0.0, 0.8, 1.0, 0.95, 0.9])) == (pytest.approx(2.5), 3)
    assert find_duration(t, np.array([1.0, 0.0, 0.95, 0.0, 0.0])) == (pytest.approx(0.1), 1)
    # 150 between 120s: 15 of 30 above, half of each step of 0.1 s
    (told, _) = MononobeOkabe(**WALL, phi=THIRTY, kh=0.25, part="stem").compare_all(run())
    assert told.lasted == pytest.approx(0.1, rel=1e-12)
    assert any("lasts one step (0.1 s above 90 %)" in note for note in told.notes)
    long = run(N_stem=np.array([100e3, 150e3, 150e3, 150e3, 100e3]))
    told = MononobeOkabe(**WALL, phi=THIRTY, kh=0.25, part="stem").compare(long)
    assert not any("one step" in note for note in told.notes)


@pytest.mark.promise("guide/checks.md", "differs from that of the run by more than 3 % is told")
def test_kh_is_the_peak_of_the_run() -> None:
    """2.5 m/s² of 10 m/s², to either side, or that of the surface; typed otherwise it is told."""
    given = {**WALL, "phi": THIRTY, "part": "stem"}
    taken = MononobeOkabe(**given).compare(run())
    assert taken.inputs["kh"] == (0.25, "-")
    assert taken.expected == MononobeOkabe(**given, kh=0.25).compare(run()).expected
    assert any("kh is that of the run: the peak of a_g_x" in note for note in taken.notes)
    field = run(a_x_field=np.array([0.0, 3.0, -3.19, 0.0, 0.0]))
    surface = MononobeOkabe(**given, acceleration="a_x_field").compare(field)
    assert surface.inputs["kh"] == (pytest.approx(0.319), "-")
    wrong = MononobeOkabe(**given, acceleration="a_x_field", kh=0.25).compare(field)
    assert any("you gave kh = 0.25, the run had 0.319" in note for note in wrong.notes)
    right = MononobeOkabe(**given, acceleration="a_x_field", kh=0.32).compare(field)
    assert not any("kh" in note for note in right.notes)
    still = MononobeOkabe(**given).compare(run(a_g_x=np.zeros(5)))
    assert "give kh" in still.applies and math.isnan(still.expected)


def test_delta_is_the_friction_of_the_wall() -> None:
    """atan 0.2 on the stem; no more than phi; a delta of another friction is told."""
    given = {**WALL, "phi": THIRTY, "part": "stem"}
    taken = CoulombWedge(**given).compare(run(), FACTS)
    assert taken.inputs["delta"] == (math.atan(0.2), "rad")
    rough = ModelFacts(friction={"stem": 0.8})
    assert CoulombWedge(**given).compare(run(), rough).inputs["delta"] == (THIRTY, "rad")
    told = CoulombWedge(**given, delta=0.3).compare(run(), FACTS)
    assert told.notes[0].startswith("you gave delta = 0.3 rad, the run had 0.1974 rad")
    assert CoulombWedge(**given).compare(run()).inputs["delta"] == (0.0, "rad")


def test_a_density_that_no_body_has_is_told() -> None:
    given = {"height": 6.0, "gravity": 10.0, "nu": 0.3, "part": "stem"}
    wrong = AtRest(**given, rho=1800.0).compare(run(), FACTS)
    assert wrong.notes == (
        "you gave rho = 1800 kg/m³, the bodies of the run have wall 2500, fill 2000",
    )
    assert AtRest(**given, rho=2010.0).compare(run(), FACTS).notes == ()


def slid(**columns: Any) -> dict[str, Any]:
    """A block of 10 kN on its base, pushed by 2 kN, and a pulse of 0.4 g."""
    t = np.array([0.0, 0.5, 0.5, 2.0])
    return {
        "t": t,
        "a_g_x": np.array([-4.0, -4.0, 0.0, 0.0]),
        "a_g_y": 0.0 * t,
        "sliding_base_bottom": t,
        "N_base_bottom": np.full(4, 10e3),
        "T_base_bottom": np.full(4, -2e3),
    } | columns


def test_newmark_takes_friction_or_yield_coefficient_from_the_run() -> None:
    """mu = 0.5 of the base; to one side (0.5 x 10 - 2)/10 = 0.3, and with a weight of 12 kN 0.25.

    0.4 g for 0.5 s with k = 0.3: 1/2 (0.4 - 0.3) g T² 0.4/0.3."""
    given = {"slip": "sliding_base_bottom", "gravity": 10.0}
    free = NewmarkBlock(**given).compare(slid(), FACTS)
    assert free.inputs["mu"] == (0.5, "-") and free.expected == 0.0
    wall = NewmarkBlock(**given, one_sided=True).compare(slid(), FACTS)
    assert wall.inputs["mu"] == (pytest.approx(0.3, rel=1e-14), "-")
    assert wall.expected == pytest.approx(0.5 * 0.25 * (4.0 - 3.0) * 4.0 / 3.0, rel=1e-9)
    heavy = NewmarkBlock(**given, one_sided=True, weight=12e3).compare(slid(), FACTS)
    assert heavy.inputs["mu"] == (pytest.approx(0.25, rel=1e-14), "-")
    assert heavy.notes[0].startswith("you gave weight = 1.2e+04 N, the run had 1e+04 N")
    own = NewmarkBlock(**given, one_sided=True, body="wall").compare(slid(), FACTS)
    assert own.notes and "W = 10 kN" in own.notes[0]
    typed = NewmarkBlock(**given, one_sided=True, mu=0.2).compare(slid(), FACTS)
    assert typed.notes[0].startswith("you gave mu (the yield coefficient) = 0.2, the run had 0.3")
    unknown = NewmarkBlock(**given).compare(slid())
    assert "give mu" in unknown.applies
    lost = NewmarkBlock(**given, body="dam").compare(slid(), FACTS)
    assert "no body 'dam', it has wall, fill" in lost.notes[0]


def test_a_motion_without_range_divides_by_nothing() -> None:
    """Every row turns the motion round, so that its velocity stays zero by the trapezoidal rule."""
    push = np.array([1.0, -1.0, 1.0, -1.0, 1.0])
    _, _, why = Wood(**WALL, nu=0.3, c_s=200.0).find_added_thrust(0.1 * np.arange(5), push)
    assert why.startswith("the motion turns round in every row")


def test_facts_are_those_of_the_model(tmp_path: Path) -> None:
    """Friction of each contact, masses and densities; a file that lacks them is refused."""
    assert ModelFacts.read(tmp_path) == ModelFacts()
    model: dict[str, Any] = {
        "contact": [{"name": "stem", "mu": 0.2}, {"name": "base", "mu": None}],
        "bodies": [
            {"name": "wall", "mass": 1000.0, "material": {"type": "LinearElastic", "rho": 2500.0}},
            {"name": "layers", "mass": 5.0, "material": {"type": "Heterogeneous"}},
        ],
    }
    (tmp_path / "model.json").write_text(json.dumps(model), encoding="utf-8")
    facts = ModelFacts.read(tmp_path)
    assert facts.friction == {"stem": 0.2, "base": None}
    assert facts.masses == {"wall": 1000.0, "layers": 5.0} and facts.densities == {"wall": 2500.0}
    assert facts.find_mu("stem") == 0.2 and facts.find_mu("base") is None
    assert facts.find_mu("other") is None and FACTS.find_mu("ground_base") == 0.5
    assert ModelFacts(friction={"a": 0.3, "b": 0.3}).find_mu("all") == 0.3
    assert ModelFacts(friction={"base on rock": 0.5, "base on fill": 0.3}).find_mu("base") is None
    (tmp_path / "model.json").write_text('{"contact": [{"name": 1}]}', encoding="utf-8")
    with pytest.raises(InputError, match="is damaged"):
        ModelFacts.read(tmp_path)
