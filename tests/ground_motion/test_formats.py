"""Files of every other format written here, and one sentence for every way they can be wrong;
writing."""

import hashlib

import numpy as np
import pytest
from record_files import AFAD, AFAD_ROW, COUNTS, VALUES, cosmos, csmip, esm, knet, rows

from vi_contact.core.errors import InputError
from vi_contact.practice.ground_motion import (
    Record,
    read_record,
    write_at2,
    write_columns,
    write_path_series,
)

pytestmark = pytest.mark.serial

G = 9.80665


def write(tmp_path, text, name="record.txt"):
    path = tmp_path / name
    path.write_bytes(text.encode("ascii"))
    return path


def refused(path, *words, units=None, **options):
    """The message of the InputError, one sentence that starts with the file."""
    with pytest.raises(InputError) as caught:
        read_record(path, units, **options)
    message = str(caught.value)
    assert message.startswith(str(path)) and "\n" not in message, message
    for word in words:
        assert word in message, message
    return message


# --- CSMIP volume 2
# -------------------------------------------------------------------------------------------------


def test_csmip_one_channel(tmp_path):
    path = write(tmp_path, csmip(), "CE58000.V2")
    record = read_record(path)
    assert (
        np.allclose(record.acceleration, 0.01 * VALUES, rtol=1e-14, atol=0.0) and record.dt == 0.01
    )
    assert (record.format, record.units, record.station, record.component) == (
        "CSMIP",
        "cm/s2",
        "58000",
        "90 Deg",
    )
    assert record.title == "Rcrd of Sun Aug 24, 2014 03:20:33.0 PDT"
    assert record.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert "Somewhere - Clayton & Ellis CGS Data: Acceleration" in record.notes


def test_csmip_touching_values_are_cut_by_column(tmp_path):
    text = csmip(unit="in cm/sec2. (10f8.3)", per_line=10, width=8)
    assert "101.000-250.750" in text
    assert np.allclose(
        read_record(write(tmp_path, text)).acceleration, 0.01 * VALUES, rtol=1e-14, atol=0.0
    )


def test_csmip_in_tenths_of_g_and_without_a_format(tmp_path):
    record = read_record(write(tmp_path, csmip(unit="in g/10.  (8f10.3)")), largest=1e3)
    assert (
        np.allclose(record.acceleration, 0.1 * G * VALUES, rtol=1e-14, atol=0.0)
        and record.units == "g/10"
    )
    record = read_record(write(tmp_path, csmip(unit="in cm/sec/sec")))
    assert np.allclose(record.acceleration, 0.01 * VALUES, rtol=1e-14, atol=0.0)


def test_csmip_of_1983_and_its_first_volume(tmp_path):
    """Capitals, units in brackets, no format; and samples at a rate, touching, in g, not yet
    corrected."""
    record = read_record(write(tmp_path, csmip(unit="(units: cm/sec/sec)").upper()))
    assert (
        np.allclose(record.acceleration, 0.01 * VALUES, rtol=1e-14, atol=0.0)
        and record.component == "90 DEG"
    )
    data = "    11 Accelerogram points at 200 pts/sec in units of g .      Format: (8f9.6)\n"
    text = csmip().replace("Station No.", "Station Id.").split("    11 points of accel data")[0]
    text = "Un" + text.replace("Corrected", "corrected") + data + rows(VALUES / 1000.0, 8, 9, 6)
    record = read_record(write(tmp_path, text))
    assert np.allclose(record.acceleration, G / 1000.0 * VALUES, rtol=1e-12) and record.dt == 0.005
    assert record.station == "58000" and record.notes[0].startswith("Uncorrected accelerogram")


def test_csmip_units_of_the_peak_where_the_samples_have_it(tmp_path):
    """Older files state units with the peak only; a peak of other samples says nothing about
    these."""
    bare = csmip(unit="(8f10.3)")
    path = write(
        tmp_path, bare.replace("=    27.114    cm/sec/sec  at", "=  -250.750  CMS/SEC/SEC AT")
    )
    record = read_record(path)
    assert np.allclose(record.acceleration, 0.01 * VALUES, rtol=1e-14, atol=0.0)
    assert record.units == "cm/s2" and record.units_from == "header, line 9"
    refused(path, "line 9", "states its units as cm/s2", units="g")
    refused(write(tmp_path, bare), "does not state its units; pass units=")


def test_csmip_several_channels_are_chosen_by_number(tmp_path):
    path = write(
        tmp_path, csmip(1, "90 Deg") + csmip(2, "UP", -VALUES) + csmip(3, "360 Deg", 2.0 * VALUES)
    )
    refused(path, "3 channels (1: 90 Deg, 2: UP, 3: 360 Deg)", "pass channel=")
    for channel, name, factor in ((1, "90 Deg", 1.0), (2, "UP", -1.0), (3, "360 Deg", 2.0)):
        record = read_record(path, channel=channel)
        assert np.allclose(record.acceleration, 0.01 * factor * VALUES) and record.component == name
    refused(path, "there is no channel 4", "2: UP", channel=4)


# --- COSMOS volume 2
# ------------------------------------------------------------------------------------------------


E_CELLS = [f"{value:15.6E}" for value in VALUES]
COSMOS = {
    "eight a line": cosmos(),
    "one a line": cosmos(per_line=1, form="1E15.6", cells=E_CELLS),
    "format as gmprocess writes it": cosmos(
        per_line=1, form="1F15.6E", cells=E_CELLS, units="cm/s^2 (4)"
    ),
    "six with an exponent, blank before the format": cosmos(
        per_line=6, form="6E12.5", units="cm/sec2(04)", cells=[f"{value:12.5E}" for value in VALUES]
    ),
    "quotes round the bar, no end line": cosmos(end="").replace("with a |", 'with a "|":'),
    "windows line ends": cosmos().replace("\n", "\r\n"),
    "uncorrected but equally spaced": cosmos(first="Uncorrected acceleration"),
    "abbreviated quantity": cosmos(quantity="uncor. accel."),
}


@pytest.mark.parametrize("name", COSMOS)
def test_cosmos_variants(name, tmp_path):
    record = read_record(write(tmp_path, COSMOS[name]))
    assert (
        np.allclose(record.acceleration, 0.01 * VALUES, rtol=1e-6, atol=1e-12)
        and record.dt == 0.005
    )
    assert (record.format, record.units, record.station, record.component) == (
        "COSMOS",
        "cm/s2",
        "NP-1795",
        "90 Deg",
    )
    assert (
        record.title.startswith("Record of Fort Example") and "Sensor: RT-131A-02" in record.notes
    )


def test_cosmos_velocity_between_two_channels_is_skipped(tmp_path):
    velocity = cosmos(quantity="velocity", units="cm/sec", end="End-of-data for Chan  1 velocity\n")
    path = write(tmp_path, cosmos() + velocity + cosmos(-VALUES).replace("90 Deg", "Up"))
    refused(path, "2 channels (1: 90 Deg, 2: Up)")
    assert np.allclose(read_record(path, channel=2).acceleration, -0.01 * VALUES)


def test_cosmos_unknown_step_comes_from_the_caller(tmp_path):
    path = write(tmp_path, cosmos(step="-999.000000"))
    refused(path, "does not state its time step")
    assert read_record(path, dt=0.02).dt == 0.02


@pytest.mark.parametrize(
    "text, words",
    [
        (cosmos(quantity="velocity", units="cm/sec"), ["line 1", "no block of accelerations"]),
        (cosmos(units="counts (50)"), ["line 43", "'counts' is not a unit of acceleration"]),
        (
            cosmos().replace("   11 acc", "   19 acc"),
            ["line 43", "19 samples are announced", "line 45", "3 of them"],
        ),
        (
            cosmos().replace("   11 acc", "   10 acc"),
            ["line 43", "10 samples", "line 45", "3 of them instead of 2"],
        ),
        ("\n".join(cosmos().split("\n")[:44]), ["line 43", "line 45", "0 of them instead of 3"]),
        (
            cosmos().replace(" 101.00000", " 1o1.00000"),
            ["line 44", "'1o1.00000'", "columns 41 to 50"],
        ),
        (cosmos().replace(" 101.00000", "-999.00000"), ["line 44", "marked as unknown"]),
        (cosmos().replace(" 101.00000", "**********"), ["line 44", "is not a number"]),
        (
            csmip().replace("accel data equally", "accel data unequally", 1),
            ["unequally spaced", "line "],
        ),
        (
            csmip(values=VALUES).split("veloc data equally")[0][:-90],
            ["complete file", "11 samples"],
        ),
        (csmip(values=[], unit="(8f10.3)"), ["does not state its units; pass units="]),
    ],
    ids=lambda value: value[-1] if isinstance(value, list) else "",
)
def test_bad_cosmos_and_csmip_are_refused_in_one_sentence(text, words, tmp_path):
    refused(write(tmp_path, text), *words)


# --- K-NET
# --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("direction", ["E-W", "N-S", "U-D", "6"])
def test_knet_counts_become_accelerations_without_offset(direction, tmp_path):
    record = read_record(write(tmp_path, knet(direction=direction), "AOM0041801241951.EW"))
    counts = COUNTS[:200] - np.mean(COUNTS[:200])
    assert np.allclose(
        record.acceleration, 0.01 * 3920.0 / 6182761.0 * counts, rtol=1e-12, atol=1e-15
    )
    assert abs(np.mean(record.acceleration)) < 1e-15 and record.dt == 0.01 and record.units == "gal"
    assert (record.format, record.station, record.component) == ("K-NET", "AOM004", direction)
    assert record.notes[0] == "Origin Time 2018/01/24 19:51:00" and record.notes[-1].startswith(
        "mean of -6.8"
    )


@pytest.mark.parametrize(
    "text, words",
    [
        (knet(COUNTS[:199]), ["line 12", "2 s at 100 Hz", "199 samples"]),
        (knet(seconds=4), ["line 12", "4 s at 100 Hz", "200 samples"]),
        (knet().replace("Scale Factor", "Scale Farce "), ["no line 'Scale Factor'"]),
        (knet().replace("Dir. ", "Dor. "), ["no line 'Dir.'"]),
        (knet(scale="3920/6182761"), ["line 14", "scale factor"]),
        (knet(scale="3920(counts)/6182761"), ["line 14", "'counts' is not a unit"]),
        (knet().replace("100Hz", "many"), ["line 11", "has no positive number"]),
        (knet([], seconds=0.004), ["line 12", "0.004 s at 100 Hz", "0 samples", "complete file"]),
        (knet().replace("  -9500", "  -95x0", 1), ["line 18", "'-95x0' is not a number"]),
    ],
    ids=lambda value: value[-1] if isinstance(value, list) else "",
)
def test_bad_knet_is_refused_in_one_sentence(text, words, tmp_path):
    refused(write(tmp_path, text), *words, units="gal")


# --- ESM and AFAD
# --------------------------------------------------------------------------------------------------


def test_esm_record_and_its_licence(tmp_path):
    record = read_record(write(tmp_path, esm(), "HI.ARS1..HNE.D.20190728.160908.C.ACC.ASC"))
    assert (
        np.allclose(record.acceleration, 0.01 * VALUES, rtol=1e-12, atol=0.0) and record.dt == 0.005
    )
    assert (record.format, record.station, record.component) == ("ESM", "HI.ARS1", "HNE")
    assert record.title == "GREECE 20190728 160908 HI.ARS1 HNE"
    assert "DATA_LICENSE: U (unknown license)" in record.notes and not any(
        "USER" in note for note in record.notes
    )


def test_esm_in_g_windows_line_ends_and_first_key_unlike_event_name(tmp_path):
    text = esm(units="g").replace("EVENT_NAME", "EARTHQUAKE_NAME").replace("\n", "\r\n")
    record = read_record(write(tmp_path, text), largest=1e4)
    assert record.format == "ESM" and np.allclose(record.acceleration, G * VALUES, rtol=1e-12)


@pytest.mark.parametrize(
    "text, words",
    [
        (esm(count=12), ["line 10", "12 samples are announced but 11 follow"]),
        (esm(count="many"), ["line 10", "'many' of NDATA is not a number"]),
        (esm(step=""), ["does not give SAMPLING_INTERVAL_S"]),
        (esm(step="0,005 s"), ["line 9", "'0,005 s' of SAMPLING_INTERVAL_S is not a number"]),
        (esm(kind="VELOCITY", units="cm/s"), ["line 14", "holds velocity", ".ACC.ASC"]),
        (esm(units="cm/s"), ["line 12", "'cm/s' is not a unit"]),
        (esm().replace("101.000000", "1O1.000000"), ["line 23", "'1O1.000000' is not a number"]),
    ],
    ids=lambda value: value[-1] if isinstance(value, list) else "",
)
def test_bad_esm_is_refused_in_one_sentence(text, words, tmp_path):
    refused(write(tmp_path, text), *words)


@pytest.mark.parametrize(
    "channel, name, samples",
    [
        (1, "N-S", [-0.5, -1.5, 0.52]),
        (2, "E-W", [1.1, 0.78, -1.0]),
        (3, "U-D", [-0.26, 0.4, -0.26]),
    ],
)
def test_afad_columns_are_channels(channel, name, samples, tmp_path):
    record = read_record(write(tmp_path, AFAD.replace("\n", "\r\n")), channel=channel)
    assert (
        np.allclose(record.acceleration, 0.01 * np.array(samples), rtol=1e-14) and record.dt == 0.01
    )
    assert (record.format, record.station, record.component, record.units) == (
        "AFAD",
        "5405",
        name,
        "gal",
    )


@pytest.mark.parametrize(
    "text, words, options",
    [
        (AFAD, ["1: N-S, 2: E-W, 3: U-D", "pass channel="], {}),
        (AFAD, ["pass channel="], {"channel": 4}),
        (AFAD.replace(": 3\n", ": 4\n"), ["line 5", "4 samples", "3 follow"], {"channel": 1}),
        (AFAD.replace("0.780000 ", " "), ["line 11", "2 values"], {"channel": 1}),
        (
            AFAD.replace("0.780000", "0.78O000"),
            ["line 11", "'0.78O000' is not a number"],
            {"channel": 1},
        ),
        (AFAD.replace("N-S  ", "N  "), ["no line 'N-S E-W U-D'"], {"channel": 1}),
        (
            AFAD.replace(": 0.01", ": often"),
            ["line 6", "'often' of SAMPLING INTERVAL (SEC) is"],
            {"channel": 1},
        ),
        (AFAD.replace("NUMBER", "Numbers"), ["does not give NUMBER OF DATA"], {"channel": 1}),
        (
            AFAD + 20 * AFAD_ROW + AFAD_ROW.replace("\n", "      0.260000\n") + AFAD_ROW,
            ["line 33", "4 values instead of N-S, E-W and U-D; get the file again"],
            {"channel": 1},
        ),
    ],
    ids=lambda value: value[-1] if isinstance(value, list) else "",
)
def test_bad_afad_is_refused_in_one_sentence(text, words, options, tmp_path):
    refused(write(tmp_path, text), *words, **options)


def test_a_row_of_more_numbers_is_not_taken_for_a_short_one(tmp_path):
    """A decimal comma ends one more number than a whole one does."""
    path = write(tmp_path, 15 * "0;0\n" + "0;1,5\n" + 4 * "0;0\n")
    record = read_record(path, "m/s2", dt=0.01, channel=2)
    assert record.acceleration[15] == 1.5 and np.count_nonzero(record.acceleration) == 1


# --- OpenSees path series
# -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text",
    [
        "".join(f"{value:.6e}\n" for value in VALUES),
        "\n".join(f"  {value:.6e}" for value in VALUES),
        rows(VALUES, 5, 12, 5),
        rows(VALUES, 3, 12, 5),
        " ".join(map(str, VALUES)),
    ],
    ids=["one a line", "no final line end", "five a line", "three a line", "all on one line"],
)
def test_opensees_path_series(text, tmp_path):
    path = write(tmp_path, text, "A10000.th")
    record = read_record(path, "cm/s2", dt=0.02)
    assert (
        np.allclose(record.acceleration, 0.01 * VALUES, rtol=1e-12, atol=0.0) and record.dt == 0.02
    )
    refused(path, "dt=", units="cm/s2")
    refused(path, "pass units=", dt=0.02)


def test_channel_is_refused_where_there_are_none(tmp_path):
    refused(write(tmp_path, esm()), "channel=1", "leave channel out", channel=1)


# --- writing
# --------------------------------------------------------------------------------------------------

RECORD = Record(
    acceleration=np.sin(np.arange(37.0)) * 10.0 ** np.linspace(-6.0, 2.0, 37),
    dt=0.005,
    title="Some  motion\nof mine",
    notes=("scaled by 2",),
)


@pytest.mark.parametrize("units", ["g", "m/s2", "cm/s2", "gal"])
def test_what_is_written_is_read_back(units, tmp_path):
    """To half a unit of the ninth digit of each sample."""
    write_columns(RECORD, tmp_path / "a.txt", units)
    write_at2(RECORD, tmp_path / "a.at2", units)
    write_path_series(RECORD, tmp_path / "a.th", units)
    for record in (
        read_record(tmp_path / "a.txt", units, largest=200.0),
        read_record(tmp_path / "a.at2", largest=200.0),
        read_record(tmp_path / "a.th", units, dt=0.005, largest=200.0),
    ):
        assert np.allclose(record.acceleration, RECORD.acceleration, rtol=6e-9, atol=0.0)
        assert np.isclose(record.dt, 0.005, rtol=1e-12) and record.units == units
    assert read_record(tmp_path / "a.txt", units, largest=200.0).notes[0] == "Some motion of mine"
    assert read_record(tmp_path / "a.at2", largest=200.0).title == "Some motion of mine"


def test_writing_where_nothing_can_be_written(tmp_path):
    with pytest.raises(InputError, match="cannot be written"):
        write_at2(RECORD, tmp_path)
    with pytest.raises(InputError, match="'m' is not a unit of acceleration"):
        write_columns(RECORD, tmp_path / "a.txt", "m")
