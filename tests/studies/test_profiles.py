"""S4.8: ``vi-contact post profile`` on a layer at rest, whose pressures are known exactly."""

from __future__ import annotations

import csv
import re
import shutil
from pathlib import Path

import pytest

pytest.importorskip("dolfinx")

from kept_figures import keep_figures
from mpi4py import MPI

from vi_contact.practice.cli.entry import main
from vi_contact.practice.plots import pressure_profile
from vi_contact.practice.studies import read_case

pytestmark = pytest.mark.serial
# Water-like numbers: rho g = 20 kN/m³, K0 = 1/3, H = 3 m on a floor that does not rub.
LAYER = """
[mesh]
type = "BlockMesh"
lengths = [2.0, 3.0]
divisions = [4, 6]

[material.soil]
E = 1e8
nu = 0.25
rho = 2000

[system]
prescribed = [{facets = "bottom", components = [1]}, {facets = "right", components = [0]}]

[gravity]
acceleration = 10.0

[[contact]]
name = "stem"
facets = "left"
obstacle = {type = "HalfSpace", point = [0.0, 0.0], normal = [1.0, 0.0]}

[[record]]
type = "Contact"

[[record]]
type = "Resultants"
name = "stem"
part = "stem"
centre = [0.0, 0.0]

[[record]]
type = "Resultants"
name = "upper"
part = [[0.0, 1.4], [0.0, 3.0]]

[run]
dt = 0.01
steps = 2

[[check]]
type = "AtRest"
part = "stem"
height = 3.0
rho = 2000
gravity = 10.0
nu = 0.25

[[check]]
type = "MononobeOkabe"
part = "stem"
height = 3.0
rho = 2000
gravity = 10.0
phi = "30 deg"
kh = 0.2

[[check]]
type = "CoulombWedge"
part = "stem"
height = 3.0
rho = 2000
gravity = 10.0
phi = 0.5
slope = 0.6
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("profile")
    (place / "layer.toml").write_text(LAYER, encoding="utf-8")
    read_case(place / "layer.toml").run(MPI.COMM_SELF, out=place / "out", progress=False)
    return place / "out"


def read_table(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_the_pressure_at_rest(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """K0 rho g z at nodes inside, that of the cell's middle at the ends. The thrust is 30 kN/m,
    at H/3 + h²/(6 H) = 1.0139 m; Mononobe and Okabe's 90 kN/m times K(30°, kh 0.2) = 0.4732."""
    figures = keep_figures(monkeypatch, pressure_profile)
    assert main(["post", "profile", str(folder), "stem"]) == 0
    said = capsys.readouterr().out.splitlines()
    rows = [row for row in read_table(folder / "profile.csv") if row["t_s"] == "0"]
    assert [float(row["height_m"]) for row in rows] == [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]
    depths = [2.75, 2.5, 2.0, 1.5, 1.0, 0.5, 0.25]
    expected = [20e3 * depth / 3.0 for depth in depths]
    assert [float(row["pressure_Pa"]) for row in rows] == pytest.approx(expected, rel=1e-7)
    assert {row["state"] for row in rows} == {"closed"}
    assert {float(row["shear_Pa"]) for row in rows} == {0.0}
    assert said[0].lstrip().startswith("thrust [kN/m]") and said[0].endswith("moment [kN m/m]")
    assert said[1].split()[-3:] == ["30", "1.014", "30.42"] and "t = 0 s" in said[1]
    rest = next(line for line in said if line.startswith("at rest"))
    shaken = next(line for line in said if line.startswith("Mononobe–Okabe, kh = 0.2"))
    assert rest.split()[-3:] == ["30", "1", "30"]
    assert shaken.split()[-3:] == ["42.59", "1", "42.59"]
    assert "Coulomb: does not apply: phi - slope - psi is below zero" in "\n".join(said)

    # The picture has the run and the two formulas that apply, in kPa, on axes with names.
    (axis,) = figures[0].axes
    lines = {line.get_label(): line for line in axis.lines}
    assert {"at rest", "Mononobe–Okabe, kh = 0.2"} <= set(lines)
    # at rest round-off chooses the step of the largest thrust, which a label tells too
    first = next(label for label in lines if label.startswith("run, t = 0 s"))
    assert "Coulomb" not in lines
    assert lines["at rest"].get_xdata()[0] == pytest.approx(20.0, rel=1e-9)
    assert lines[first].get_xdata()[1] == pytest.approx(20.0 * 2.5 / 3.0, rel=1e-7)
    assert axis.get_xlabel() == "normal pressure [kPa]"
    assert axis.get_ylabel() == "height above the foot [m]"
    assert lines["at rest"].get_linestyle() != lines["Mononobe–Okabe, kh = 0.2"].get_linestyle()
    assert (folder / "profile.png").is_file()


def test_units_of_the_sheet(
    folder: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What the report of a run is written in, its profile is too; the table stays in SI units."""
    figures = keep_figures(monkeypatch, pressure_profile)
    other = shutil.copytree(folder, tmp_path / "run")
    case = other / "case.toml"
    sheet = '\n[sheet]\nunits = {force = "MN", size = "cm", stress = "MPa"}\n'
    case.write_text(case.read_text(encoding="utf-8") + sheet, encoding="utf-8")
    assert main(["post", "profile", str(other), "stem"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert re.findall(r"\[(.*?)\]", said[0]) == ["MN/m", "cm", "MN m/m"]
    assert [float(word) for word in said[1].split()[-3:]] == [0.03, 101.4, 0.03042]
    assert read_table(other / "profile.csv")[0]["height_m"] == "0"
    (axis,) = figures[0].axes
    assert axis.get_xlabel() == "normal pressure [MPa]"
    assert axis.get_ylabel() == "height above the foot [cm]"
    lines = {line.get_label(): line for line in axis.lines}
    assert lines["at rest"].get_xdata()[0] == pytest.approx(0.02, rel=1e-9)
    assert axis.get_ylim()[1] == pytest.approx(300.0)


def test_a_box_of_resultants(folder: Path, tmp_path: Path) -> None:
    """The upper four points, whose formulas are none; the file of the table is named."""
    out = tmp_path / "upper.csv"
    assert (
        main(["post", "profile", str(folder), "upper", "--times", "0.01", "--out", str(out)]) == 0
    )
    assert [float(row["height_m"]) for row in read_table(out)] == [0.0, 0.5, 1.0, 1.5]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["heel"], "has no part 'heel' of the contact"),
        (["stem", "--times", "soon"], "--times 'soon' is no time"),
        (["stem", "--times", "9"], "lasts from 0 to 0.02 s"),
    ],
)
def test_what_is_not_there(
    folder: Path, arguments: list[str], says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["post", "profile", str(folder), *arguments]) == 1
    assert says in capsys.readouterr().err
