"""vi-contact motion info, convert, plot, spectrum: numbers, files, pictures, and one sentence for
bad input."""

import csv
import math

import numpy as np
import pytest

from vi_contact.practice.cli.entry import main
from vi_contact.practice.cli.motion import read_acceleration
from vi_contact.practice.ground_motion import (
    EC8Spectrum,
    Record,
    arias,
    integrated,
    pga,
    psa,
    read_record,
    response_spectrum,
    write_at2,
)
from vi_contact.practice.plots.records import plot_motion, plot_spectra

pytestmark = pytest.mark.serial

G = 9.80665
TIMES = 0.01 * np.arange(1501)
RECORD = Record(
    acceleration=2.0 * np.sin(2.0 * np.pi * 1.5 * TIMES) * np.exp(-0.5 * (TIMES - 5.0) ** 2),
    dt=0.01,
    title="A packet",
)


@pytest.fixture
def packet(tmp_path, monkeypatch):
    """RECORD in a file of g, in the folder the command runs in."""
    monkeypatch.chdir(tmp_path)
    write_at2(RECORD, "packet.at2")
    return tmp_path


def said(capsys, *arguments):
    assert main(["motion", *arguments]) == 0
    return capsys.readouterr().out


@pytest.mark.long
def test_info_after_processing(packet, capsys):
    rows = said(capsys, "info", "packet.at2", "--scale", "2", "--resample", "0.005").splitlines()
    values = {row[:20].strip(): row[20:] for row in rows}
    assert (
        values["dt"] == "0.005 s"
        and values["title"] == "A packet"
        and values["format"] == "PEER AT2"
    )
    assert float(values["PGA"].split()[0]) == pytest.approx(2.0 * pga(RECORD), rel=1e-2)
    assert [row[20:] for row in rows[-2:]] == ["resampled from 0.01 s to 0.005 s", "scaled by 2"]
    assert said(capsys, "info", "packet.at2", "packet.at2").count("format ") == 2


@pytest.mark.parametrize(
    "out, options, units, form",
    [
        ("out.at2", [], "g", "PEER AT2"),
        ("out.txt", [], "m/s2", "columns"),
        ("out.th", [], "m/s2", "columns"),
        ("out.txt", ["--to", "at2", "--out-units", "gal"], "gal", "PEER AT2"),
        ("out.dat", ["--out-units", "cm/s2"], "cm/s2", "columns"),
    ],
)
def test_convert_is_read_back(packet, capsys, out, options, units, form):
    text = said(capsys, "convert", "packet.at2", out, *options)
    record = read_record(out, units, dt=0.01)
    assert (
        np.allclose(record.acceleration, RECORD.acceleration, rtol=1e-8, atol=1e-12)
        and record.format == form
    )
    assert text.startswith(f"{out}: ") and f"1501 samples, dt = 0.01 s, in {units}" in text
    assert ("timeSeries Path 1 -dt 0.01 -filePath out.th" in text) == out.endswith(".th")


def test_convert_with_every_step(packet, capsys):
    options = (
        "--trim 1 12 --pad 2 3 --remove-mean --taper --low 0.1 --high 20 --order 2 --causal "
        "--resample 0.005 "
    )
    said(
        capsys, "convert", "packet.at2", "out.txt", *options.split(), "--baseline", "--pga", "0.3g"
    )
    record = read_record("out.txt", "m/s2")
    velocity, displacement = integrated(record)
    assert pga(record) == pytest.approx(0.3 * G, rel=1e-8) and record.dt == pytest.approx(0.005)
    assert (
        record.acceleration.size == 3201
        and abs(displacement[-1]) < 1e-6
        and abs(velocity[-1]) < 1e-7
    )
    assert (
        sum(
            word in note
            for note in record.notes
            for word in (
                "trimmed",
                "zeros",
                "mean",
                "taper over 5 %",
                "order 2, causal",
                "resampled",
                "degree 2",
                "scaled",
            )
        )
        == 8
    )


@pytest.mark.parametrize(
    "options, measure, value",
    [
        (["--arias", "0.5"], arias, 0.5),
        (["--psa", "0.5g", "0.7"], lambda record: psa(record, 0.7), 0.5 * G),
        (["--pga", "150 gal"], pga, 1.5),
        (["--pga", "2.5"], pga, 2.5),
    ],
)
def test_scaling_options(packet, capsys, options, measure, value):
    said(capsys, "convert", "packet.at2", "out.txt", *options)
    assert measure(read_record("out.txt", "m/s2")) == pytest.approx(value, rel=1e-7)


def test_uneven_columns_are_evened_on_request(packet, capsys):
    (packet / "uneven.txt").write_text("0.0 0.0\n0.02 1.0\n0.04 2.0\n0.05 2.5\n0.08 4.0\n")
    assert main(["motion", "info", "uneven.txt", "--units", "gal"]) == 1
    assert "line 4" in capsys.readouterr().err
    assert "samples             9\n" in said(
        capsys, "info", "uneven.txt", "--units", "gal", "--even", "0.01"
    )


@pytest.mark.long
def test_spectrum_table_and_picture(packet, capsys):
    text = said(
        capsys,
        "spectrum",
        "packet.at2",
        "--damping",
        "0.02",
        "0.05",
        "--periods",
        "0.1",
        "4",
        "30",
        "--ec8",
        "b",
        "--ag",
        "0.2g",
    )
    with open("packet_spectrum.csv", encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 60 and {row["damping"] for row in rows} == {"0.02", "0.05"}
    periods = np.geomspace(0.1, 4.0, 30)
    exact = response_spectrum(RECORD, periods, damping=0.05)
    column = {
        name: np.array([float(row[name]) for row in rows[30:]])
        for name in rows[0]
        if name != "record"
    }
    for name, values in (
        ("period_s", periods),
        ("sd_m", exact.displacement),
        ("sv_m/s", exact.velocity),
        ("sa_m/s2", exact.acceleration),
        ("psv_m/s", exact.psv),
        ("psa_m/s2", exact.psa),
        ("ec8_m/s2", EC8Spectrum.on_ground("B", ag=0.2 * G, damping=0.02).acceleration(periods)),
    ):
        assert np.allclose(column[name], values, rtol=1e-6, atol=0.0), name
    shown = next(line for line in text.splitlines() if line.startswith("packet, 5 %")).split()
    assert float(shown[-2]) == pytest.approx(psa(RECORD, 1.0) / G, rel=1e-3)
    assert (packet / "packet_spectrum.png").read_bytes().startswith(b"\x89PNG")


def test_plot_has_a_default_name(packet, capsys):
    assert said(capsys, "plot", "packet.at2", "--out-units", "g") == "picture: packet.png\n"
    assert (packet / "packet.png").stat().st_size > 4_000


@pytest.mark.long
def test_pictures_of_unusual_records(tmp_path):
    """Silence, and a record of two samples, are drawn without a warning."""
    records = {
        "zero": Record(acceleration=np.zeros(50), dt=0.1),
        "two": Record(acceleration=[1.0, -1.0], dt=1),
    }
    for name, record in records.items():
        assert plot_motion(record, tmp_path / f"{name}.png").stat().st_size > 2_000
    spectra = {"zero": response_spectrum(records["zero"], np.array([0.5, 1.0]))}
    assert (
        plot_spectra(spectra, tmp_path / "s.png", units="m/s2", steps={"zero": 0.1}).stat().st_size
        > 2_000
    )


@pytest.mark.parametrize(
    "arguments, word",
    [
        (["info", "packet.at2", "--units", "m/s2"], "states its units as g"),
        (["info", "packet.at2", "--channel", "2"], "leave channel out"),
        (["info", "packet.at2", "--high", "80"], "Nyquist"),
        (["convert", "packet.at2", "out.txt", "--out-units", "m"], "'m' is not a unit"),
        (["convert", "packet.at2", "nowhere/out.txt"], "cannot be written"),
        (["convert", "packet.at2", "out.txt", "--psa", "fast", "1"], "--psa fast 1"),
        (["plot", "packet.at2", "--out", "nowhere/x.png"], "folder that exists"),
        (["plot", "packet.at2", "--out-units", "m"], "'m' is not a unit"),
        (["spectrum", "packet.at2", "--ec8", "B"], "--ec8 and --ag need each other"),
        (["spectrum", "packet.at2", "--ec8", "F", "--ag", "1"], "ground 'F'"),
        (["spectrum", "packet.at2", "--damping", "5"], "0.05 for 5 %"),
        (["spectrum", "packet.at2", "packet.at2"], "give each file and damping once"),
        (["spectrum", "packet.at2", "--periods", "1", "0.1", "10"], "FROM below TO"),
        (["spectrum", "packet.at2", "--csv", "nowhere/x.csv"], "folder that exists"),
    ],
)
def test_bad_input_is_answered_in_one_sentence(packet, capsys, arguments, word):
    assert main(["motion", *arguments]) == 1
    captured = capsys.readouterr()
    assert not captured.out and captured.err.count("\n") == 1 and word in captured.err
    assert [path.name for path in packet.iterdir()] == ["packet.at2"]


def test_accelerations_with_units():
    assert (
        read_acceleration("3.0") == 3.0
        and read_acceleration("-1e-1 m/s2") == -0.1
        and read_acceleration(".3g") == 0.3 * G
    )
    assert math.isclose(read_acceleration("300 gal"), 3.0) and math.isclose(
        read_acceleration("300cm/s^2"), 3.0
    )


@pytest.mark.parametrize(
    "arguments, word",
    [
        (["--pga", "0.3 furlong"], "'0.3 furlong' is not an acc"),
        (["--pga", "much"], "'much' is not an acceleration"),
        (["--pga", "1", "--scale", "2"], "not allowed with"),
        (["--trim", "1"], "expected 2 arguments"),
    ],
)
def test_bad_options_show_the_usage(packet, capsys, arguments, word):
    with pytest.raises(SystemExit) as stopped:
        main(["motion", "info", "packet.at2", *arguments])
    assert stopped.value.code == 2 and word in capsys.readouterr().err
