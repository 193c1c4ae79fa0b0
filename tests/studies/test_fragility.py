"""Fragility curves against closed forms and a search over a grid, sets of records, Sa(T1), and a
study that goes on."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import norm

pytest.importorskip("dolfinx")

from vi_contact.core.errors import InputError
from vi_contact.fem.mesh.tagged_mesh import alone
from vi_contact.practice.engineering import lowest_frequency
from vi_contact.practice.ground_motion import Record, write_at2
from vi_contact.practice.plots.studies import plot_fragility
from vi_contact.practice.studies import IDA, fragility_curve, read_case, record_set, run_ida
from vi_contact.practice.studies.ida.fragility import bracket_capacities, read_limit
from vi_contact.practice.studies.ida.measures import read_intensity
from vi_contact.practice.studies.ida.runs import OneRun, Row

pytestmark = pytest.mark.serial
WALL = Path(__file__).resolve().parents[2] / "demos" / "cases" / "wall_record.toml"
INF = math.inf


@pytest.mark.parametrize(("count", "width"), [(5, 1e-4), (20, 1e-4), (100, 1e-5)])
def test_narrow_brackets_are_known_capacities(count: int, width: float) -> None:
    """Of known capacities theta is the geometric mean, beta the deviation of the logarithms over n,
    and the standard errors of ln theta and ln beta are beta/sqrt(n) and 1/sqrt(2n), without
    correlation; in any unit."""
    capacity = np.exp(np.random.default_rng(count).normal(0.3, 0.4, count))
    mean, beta = np.log(capacity).mean(), np.log(capacity).std()
    for unit in (1.0, 1e-6, 1e9):
        found = fragility_curve(
            unit * np.stack([capacity * (1.0 - width / 2), capacity * (1.0 + width / 2)], axis=1)
        )
        assert (found.theta, found.beta) == pytest.approx((unit * np.exp(mean), beta), rel=1e-6)
        expected = np.diag([beta**2 / count, 1.0 / (2 * count)])
        assert found.covariance == pytest.approx(expected, rel=1e-6, abs=1e-6 * expected.max())
        assert found.intervals[0] == pytest.approx(
            found.theta * np.exp(1.959964 * beta / np.sqrt(count) * np.array([-1.0, 1.0])), rel=1e-6
        )


def likelihood(brackets: np.ndarray, theta: np.ndarray, beta: np.ndarray) -> np.ndarray:
    """ln L as it is defined."""
    total = np.zeros(np.broadcast(theta, beta).shape)
    with np.errstate(divide="ignore"):
        for low, high in brackets:
            below = norm.cdf(np.log(low / theta) / beta) if low > 0.0 else 0.0
            total += np.log((norm.cdf(np.log(high / theta) / beta) if high < INF else 1.0) - below)
    return total


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_coarse_levels_against_a_search(seed: int) -> None:
    """Capacities known between four levels only, some below the lowest and some above the highest:
    no place of a grid is better, and the best one is a cell away. The curvature there is that of
    differences of the definition."""
    levels = np.array([0.0, 0.8, 1.2, 1.8, 2.7, INF])
    capacity = np.exp(np.random.default_rng(seed).normal(0.4, 0.6, 30))
    place = np.searchsorted(levels, capacity)
    brackets = np.stack([levels[place - 1], levels[place]], axis=1)
    assert {0.0, INF} <= set(brackets.ravel())
    found = fragility_curve(brackets)
    logs, step = np.log([found.theta, found.beta]), 0.01
    near = step * np.arange(-100, 101)
    for shift in (0.0, 0.37 * step):
        grid = likelihood(
            brackets, np.exp(logs[0] + shift + near)[:, None], np.exp(logs[1] + shift + near)
        )
        assert likelihood(brackets, found.theta, found.beta) >= grid.max() - 1e-12
        best = np.unravel_index(np.argmax(grid), grid.shape)
        assert np.abs(near[list(best)] + shift).max() < step
    h = 1e-3

    def at(i: float, j: float) -> float:
        return float(likelihood(brackets, np.exp(logs[0] + i * h), np.exp(logs[1] + j * h)))

    bend = (
        np.array(
            [
                [
                    at(1, 0) - 2 * at(0, 0) + at(-1, 0),
                    (at(1, 1) - at(1, -1) - at(-1, 1) + at(-1, -1)) / 4,
                ],
                [0.0, at(0, 1) - 2 * at(0, 0) + at(0, -1)],
            ]
        )
        / h**2
    )
    bend[1, 0] = bend[0, 1]
    assert found.covariance == pytest.approx(np.linalg.inv(-bend), rel=1e-4)
    low, value, high = found.probability(np.array([found.theta, found.theta * np.exp(found.beta)]))
    assert value == pytest.approx(norm.cdf([0.0, 1.0]), abs=1e-12)
    assert low[0] == pytest.approx(
        norm.cdf(-1.959964 * np.sqrt(found.covariance[0, 0]) / found.beta), abs=1e-6
    )
    assert np.all(low < value) and np.all(value < high)


@pytest.mark.parametrize(
    ("brackets", "said"),
    [
        (np.zeros((0, 2)), "0 of 0 records pass the limit"),
        (
            [(9.0, INF)] * 3,
            "0 of 3 records pass the limit, maybe all at one intensity from 9 to inf: give oth",
        ),
        ([(0.0, 1.0)] * 3, "3 of 3 records .* from 0 to 1"),
        ([(1.0, 2.0), (1.0, 3.0), (0.0, 2.0)], "from 1 to 2"),
        ([(1.0, 2.0), (2.0, 3.0)], "from 2 to 2"),
        ([(1.0, 2.0 - 4e-16), (2.0 + 4e-16, 3.0)], "from 2 to 2"),
        (
            [(0.0, 1.0), (2.0, INF)],
            "the capacities of 2 records have a spread that cannot be fitted: give more",
        ),
    ],
)
def test_brackets_without_a_curve(brackets: list[tuple[float, float]], said: str) -> None:
    """What no curve, or a step, fits best is refused."""
    with pytest.raises(InputError, match=said):
        fragility_curve(np.array(brackets))


def row(record: str, level: float | None, demand: float | None, status: str = "finished") -> Row:
    return {"record": record, "pga": level, "u_min": demand, "u_max": demand, "status": status}


def test_where_records_pass() -> None:
    """The first crossing counts, in any order of rows; beyond a failed run nothing is known, nor of
    a run whose demand is no number; a record without a known run is left out."""
    rows = [
        row("a", 3.0, 1.0),
        row("a", 1.0, 0.1),
        row("a", 2.0, 0.5),
        row("b", 2.0, 0.7),
        row("c", 1.0, 0.2),
        row("c", 2.0, None, "failed"),
        row("c", 3.0, 9.0),
        row("d", None, None, "failed"),
        row("e", 1.0, math.nan),
        row("f", 1.0, 0.1),
        row("f", 2.0, 0.6),
        row("f", 3.0, 0.2),
        row("g", 1.0, 0.0),
        row("g", 2.0, 0.0),
    ]
    assert bracket_capacities(rows, "u:max=0.5", "pga").tolist() == [
        [1, 2],
        [1, INF],
        [1, 2],
        [2, INF],
        [0, 2],
    ]
    assert bracket_capacities(rows, "u:min=0.1", "pga").tolist() == [
        [0, 1],
        [1, INF],
        [0, 1],
        [0, 1],
        [2, INF],
    ]
    for wrong in ("u:max", "u:max=", "u:max=one", "u:max=nan"):
        with pytest.raises(
            InputError, match=f"limit '{wrong}': give COLUMN:WAY=VALUE with a number"
        ):
            read_limit(wrong)
    with pytest.raises(InputError, match="demand 'u:most'"):
        read_limit("u:most=1")


def test_sets_of_records(tmp_path: Path) -> None:
    """A folder without what is no record, a list with places relative to it, and files as they
    are."""
    records = tmp_path / "records"
    (records / "more").mkdir(parents=True)
    for name in ("b.at2", "A.AT2", "read.me", ".hidden.at2"):
        (records / name).touch()
    assert record_set(str(records)) == [[str(records / "A.AT2")], [str(records / "b.at2")]]
    (records / "more" / "x.txt").touch()
    assert record_set(str(records / "more")) == [[str(records / "more" / "x.txt")]]
    (tmp_path / "list").write_text(
        "# the set\nrecords/b.at2 , v.at2  # both\n\n/far/h.at2\n", encoding="utf-8"
    )
    assert record_set(f"@{tmp_path / 'list'}") == [
        [str(tmp_path / "records" / "b.at2"), str(tmp_path / "v.at2")],
        ["/far/h.at2"],
    ]
    assert record_set("h.at2,v.at2") == [["h.at2", "v.at2"]]
    (tmp_path / "none").mkdir()
    (tmp_path / "binary").write_bytes(b"\xff\xfe\xff")
    (tmp_path / "half").write_text("h.at2,\n", encoding="utf-8")
    for wrong in (str(tmp_path / "none"), "h.at2,", f"@{tmp_path / 'half'}"):
        with pytest.raises(
            InputError, match=r"--motions .*: give FILE or FILE,FILE, a folder, or @LIST"
        ):
            record_set(wrong)
    for wrong in ("missing", "binary", "none"):
        with pytest.raises(
            InputError, match=r"--motions @.* cannot be read .*: give a text file, one record"
        ):
            record_set(f"@{tmp_path / wrong}")


@pytest.fixture
def motions(tmp_path: Path) -> list[str]:
    """Six motions in files."""
    for k in range(6):
        write_at2(
            Record((1.0 + k) * np.sin(0.3 * np.arange(100) * (1.0 + 0.1 * k)), 0.01),
            tmp_path / f"m{k}.at2",
            "g",
        )
    return [str(tmp_path / f"m{k}.at2") for k in range(6)]


def test_the_first_period_of_the_model(motions: list[str]) -> None:
    """sa:T1 is sa:T with the body's own first period where nothing touches; a case whose motion is
    made of a seed, and has no file, gives its place to a record."""
    case = read_case(
        WALL,
        [
            "mesh.divisions=[2, 2]",
            "contact.1.obstacle.point=[6.5, 0.0]",
            'excitation.1.record={type="synthetic", seed=1, '
            "duration=1.0, dt=0.01, spectrum={s0=0.01}, envelope={rise=0.2, end=0.6, decay=5.0}}",
        ],
    )
    study = IDA(case, motions, ["u_x_top"], scales=(1.0,), intensity="sa:T1")
    period = 1.0 / lowest_frequency(case.parts(alone()).system)
    expected, record = read_intensity(f"sa:{period}"), study.shakings[0].record(case)
    assert study.measure.name == expected.name and study.measure.meaning == expected.meaning
    assert study.measure.compute(record) == pytest.approx(expected.compute(record), rel=1e-6)
    with pytest.raises(InputError, match="intensity 'sa:T2': give the period after the colon"):
        read_intensity("sa:T2", lambda: 1.0)


@pytest.mark.long
def test_a_study_ends_in_curves_and_goes_on(
    tmp_path: Path, motions: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Runs are replaced by u = c PGA with a c of each record, so that capacities are known: the
    table has the curve of their brackets. Levels between those that are there run alone, and limits
    that tell nothing are said."""
    made: list[str] = []

    def executed(runs: Sequence[OneRun], *_: object) -> Iterator[Row]:
        for run in runs:
            made.append(run.folder.name)
            run.folder.mkdir(parents=True, exist_ok=True)
            (run.folder / "summary.json").write_text('{"status": "finished"}', encoding="utf-8")
            yield run.keep("", 0)

    case = read_case(WALL, ["mesh.divisions=[1, 1]"])
    factors = dict(zip((f"m{k}" for k in range(6)), (0.9, 1.3, 2.3, 3.1, 4.4, 6.5), strict=True))

    def history(
        folder: Path, wanted: tuple[str, ...]
    ) -> tuple[dict[str, np.ndarray], dict[str, tuple[str, str]]]:
        name, _, level = folder.name.partition("_pga")
        return {
            one: np.array([0.0, factors[name] * float(level)]) for one in wanted
        }, dict.fromkeys(wanted, ("m", "u"))

    monkeypatch.setattr("vi_contact.practice.studies.ida.ida.execute_runs", executed)
    monkeypatch.setattr("vi_contact.practice.studies.ida.ida._read_history", history)
    said: list[str] = []
    for levels in ((1.0, 2.0, 4.0), (1.0, 1.5, 2.0, 3.0, 4.0)):
        made.clear()
        study = IDA(
            case,
            motions,
            ["u_x_top:max"],
            levels=levels,
            limits=("u_x_top:max=4", "u_y_top:max=5", "u_x_top:max=99"),
        )
        rows = run_ida(study, tmp_path / "study", say=said.append)
        assert len(made) == 6 * (3 if len(levels) == 3 else 2) and len(rows) == 6 * len(levels)
        assert [one["pga"] for one in rows] == pytest.approx([*levels] * 6)
        with open(tmp_path / "study" / "fragility.csv", encoding="utf-8", newline="") as file:
            table = list(csv.DictReader(file))
        assert [one["limit"] for one in table] == ["u_x_top:max=4", "u_y_top:max=5"]
        for one, value in zip(table, (4.0, 5.0), strict=True):
            every = np.array([0.0, *levels, INF])
            place = np.searchsorted(every, value / np.array(list(factors.values())))
            expected = fragility_curve(np.stack([every[place - 1], every[place]], axis=1))
            assert [float(one[name]) for name in ("theta", "beta", "records")] == pytest.approx(
                [expected.theta, expected.beta, 6], rel=1e-6
            )
            assert [
                float(one[f"{name}_{side}"])
                for name in ("theta", "beta")
                for side in ("low", "high")
            ] == pytest.approx(expected.intervals.ravel(), rel=1e-6)
        assert said[-1].startswith("fragility of u_x_top:max=99: 0 of 6 records pass the limit")
        assert said[-3].startswith(
            f"fragility of u_x_top:max=4: median {float(table[0]['theta']):.4g} ("
        )
        for name in ("fragility.png", "ida.png"):
            assert (tmp_path / "study" / name).read_bytes().startswith(b"\x89PNG")


def test_the_picture_has_its_intensities_in_g(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is drawn up to 1.2 times the highest level: curve, band, and brackets that end there."""
    from matplotlib.figure import Figure

    drawn: list[Figure] = []
    monkeypatch.setattr(Figure, "savefig", lambda figure, *_, **__: drawn.append(figure))
    levels = np.array([(0.0, 9.80665), (9.80665, 19.6133), (19.6133, INF)])
    found = fragility_curve(levels)
    plot_fragility(
        {"u $max": (found.probability, levels)}, tmp_path / "f.png", intensity="PGA", unit="m/s²"
    )
    (axis,) = drawn[0].axes
    line, (lines, band) = (
        axis.lines[0],
        sorted(axis.collections, key=lambda one: len(one.get_paths()))[::-1],
    )
    assert axis.get_xlabel() == "PGA [g]" and axis.get_xlim() == pytest.approx((0.0, 2.4))
    assert np.interp(found.theta / 9.80665, *line.get_data()) == pytest.approx(0.5, abs=1e-4)
    assert [path.vertices[:, 0].tolist() for path in lines.get_paths()] == [
        pytest.approx(ends) for ends in ([0.0, 1.0], [1.0, 2.0], [2.0, 2.4])
    ]
    assert len(band.get_paths()) == 1 and axis.get_legend().get_texts()[0].get_text() == r"u \$max"
