"""Files of every other format written here, and one sentence for every way they can be wrong; writing."""

import hashlib

import numpy as np
import pytest

from vi_contact.errors import InputError
from vi_contact.ground_motion import Record, read_record, write_at2, write_columns, write_path_series

pytestmark = pytest.mark.serial

G = 9.80665
VALUES = np.array([0.125, -12.5, 3.25, -0.5, 101.0, -250.75, 8.0, 1e-3, -1e-3, 42.0, -7.5])  # cm/s2; 11: a short row


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


def rows(values, per_line, width, decimals):
    cells = [f"{value:{width}.{decimals}f}" for value in values]
    assert all(len(cell) == width for cell in cells)
    return "\n".join("".join(cells[k:k + per_line]) for k in range(0, len(cells), per_line)) + "\n"


# --- CSMIP volume 2 -------------------------------------------------------------------------------------------------

def csmip(channel=1, name="90 Deg", values=VALUES, unit="in cm/sec2. (8f10.3)", per_line=8, width=10, decimals=3):
    """One channel: 25 text lines (shortened), 100 integers, 100 reals, then acceleration, velocity, displacement."""
    text = f"""Corrected accelerogram   58000-L1000-14000.10       Chan  {channel}:  {name}         from
Uncorrected Accelerogram Data             Processed: 08/24/14, CGS
Rcrd of Sun Aug 24, 2014 03:20:33.0 PDT
Station No. 58000   37.973N, 122.038W    Etna    s/n 2866  (3 Chns of  3 at Sta)
Somewhere - Clayton & Ellis               CGS   Data: Acceleration
Chan  {channel}:  {name}
{len(values):6d} points of instrument- and baseline-corrected accel, veloc and displ data
At equally-spaced intervals of    .010  sec.
Peak acceleration =    27.114    cm/sec/sec  at   32.570   sec.
"""
    text += "\n".join("".join(f"{k:5d}" for k in range(16)) for _ in range(6)) + "\n" + "    1    0    0    0\n"
    text += rows([0.5] * 97 + [-122.038, -999.0, -999.0], 8, 10, 5)
    for quantity, unit_text in (("accel", unit), ("veloc", "in cm/sec.  (8f10.3)"), ("displ", "in cm.  (8f10.3)")):
        shape = (per_line, width, decimals) if quantity == "accel" else (8, 10, 3)
        scale = {"accel": 1.0, "veloc": 0.1, "displ": 0.01}[quantity]
        text += f"{len(values):6d} points of {quantity} data equally spaced at  .010 sec, {unit_text}\n"
        text += rows(scale * np.asarray(values), *shape)
    return text + f"/&  ----------  End of data for channel  {channel}  ----------\n"


def test_csmip_one_channel(tmp_path):
    path = write(tmp_path, csmip(), "CE58000.V2")
    record = read_record(path)
    assert np.allclose(record.acceleration, 0.01 * VALUES, rtol=1e-14, atol=0.0) and record.dt == 0.01
    assert (record.format, record.units, record.station, record.component) == ("CSMIP", "cm/s2", "58000", "90 Deg")
    assert record.title == "Rcrd of Sun Aug 24, 2014 03:20:33.0 PDT"
    assert record.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert "Somewhere - Clayton & Ellis CGS Data: Acceleration" in record.notes


def test_csmip_touching_values_are_cut_by_column(tmp_path):
    text = csmip(unit="in cm/sec2. (10f8.3)", per_line=10, width=8)
    assert "101.000-250.750" in text
    assert np.allclose(read_record(write(tmp_path, text)).acceleration, 0.01 * VALUES, rtol=1e-14, atol=0.0)


def test_csmip_in_tenths_of_g_and_without_a_format(tmp_path):
    record = read_record(write(tmp_path, csmip(unit="in g/10.  (8f10.3)")), largest=1e3)
    assert np.allclose(record.acceleration, 0.1 * G * VALUES, rtol=1e-14, atol=0.0) and record.units == "g/10"
    record = read_record(write(tmp_path, csmip(unit="in cm/sec/sec")))
    assert np.allclose(record.acceleration, 0.01 * VALUES, rtol=1e-14, atol=0.0)


def test_csmip_of_1983_and_its_first_volume(tmp_path):
    """Capitals, units in brackets, no format; and samples at a rate, touching, in g, not yet corrected."""
    record = read_record(write(tmp_path, csmip(unit="(units: cm/sec/sec)").upper()))
    assert np.allclose(record.acceleration, 0.01 * VALUES, rtol=1e-14, atol=0.0) and record.component == "90 DEG"
    data = "    11 Accelerogram points at 200 pts/sec in units of g .      Format: (8f9.6)\n"
    text = csmip().replace("Station No.", "Station Id.").split("    11 points of accel data")[0]
    text = "Un" + text.replace("Corrected", "corrected") + data + rows(VALUES / 1000.0, 8, 9, 6)
    record = read_record(write(tmp_path, text))
    assert np.allclose(record.acceleration, G / 1000.0 * VALUES, rtol=1e-12) and record.dt == 0.005
    assert record.station == "58000" and record.notes[0].startswith("Uncorrected accelerogram")


def test_csmip_several_channels_are_chosen_by_number(tmp_path):
    path = write(tmp_path, csmip(1, "90 Deg") + csmip(2, "UP", -VALUES) + csmip(3, "360 Deg", 2.0 * VALUES))
    refused(path, "3 channels (1: 90 Deg, 2: UP, 3: 360 Deg)", "pass channel=")
    for channel, name, factor in ((1, "90 Deg", 1.0), (2, "UP", -1.0), (3, "360 Deg", 2.0)):
        record = read_record(path, channel=channel)
        assert np.allclose(record.acceleration, 0.01 * factor * VALUES) and record.component == name
    refused(path, "there is no channel 4", "2: UP", channel=4)


# --- COSMOS volume 2 ------------------------------------------------------------------------------------------------

def cosmos(values=VALUES, *, units="cm/sec2(04)", per_line=8, form="8F10.5", cells=None, step="0.005000",
           first="Corrected acceleration", end="End-of-data for Chan  1 acceleration\n", quantity="acceleration"):
    """Thirteen text lines (shortened), 100 integers, 100 reals of which number 34 is the step, comments, samples."""
    text = f"""{first}   (Format v01.20 with 7 text lines)
Record of  Fort Example, CA Earthquake of Sun May 05, 2019 06:47 UTC
Statn No: 02-001795 Code:NP-1795   USGS  SF FS 25 Bayview
Coords: 37.7466 -122.3868  Site Geology:
Sta Chan   1: 90 Deg (Rcrdr Chan  1) Location:Ground
Raw record length =  100.000 sec, Uncor max =     98.6 cm/s^2, at  45.290 sec.
Values used when parameter of data value is unknown/unspecified:  -999, -999.000
 100 Integer-header values follow on  10 lines, Format = (10I8)
"""
    text += "\n".join("".join(f"{k:8d}" for k in range(10)) for _ in range(10)) + "\n"
    text += " 100 Real-header values follow on  20 lines, Format =(5F15.6)\n"
    reals = ["-999.000000"] * 100
    reals[33] = step
    text += "\n".join("".join(f"{real:>15}" for real in reals[k:k + 5]) for k in range(0, 100, 5)) + "\n"
    text += "   2 Comment line(s) follow, each starting with a |\n| Sensor: RT-131A-02\n|<PROCESS> AUTO\n"
    text += f"   {len(values)} {quantity} pts, approx  0 secs, units={units},Format=({form})\n"
    cells = cells or [f"{value:10.5f}" for value in values]
    return text + "\n".join("".join(cells[k:k + per_line]) for k in range(0, len(values), per_line)) + "\n" + end


E_CELLS = [f"{value:15.6E}" for value in VALUES]
COSMOS = {
    "eight a line": cosmos(),
    "one a line": cosmos(per_line=1, form="1E15.6", cells=E_CELLS),
    "format as gmprocess writes it": cosmos(per_line=1, form="1F15.6E", cells=E_CELLS, units="cm/s^2 (4)"),
    "six with an exponent, blank before the format": cosmos(per_line=6, form="6E12.5", units="cm/sec2(04)",
                                                            cells=[f"{value:12.5E}" for value in VALUES]),
    "quotes round the bar, no end line": cosmos(end="").replace("with a |", 'with a "|":'),
    "windows line ends": cosmos().replace("\n", "\r\n"),
    "uncorrected but equally spaced": cosmos(first="Uncorrected acceleration"),
    "abbreviated quantity": cosmos(quantity="uncor. accel."),
}


@pytest.mark.parametrize("name", COSMOS)
def test_cosmos_variants(name, tmp_path):
    record = read_record(write(tmp_path, COSMOS[name]))
    assert np.allclose(record.acceleration, 0.01 * VALUES, rtol=1e-6, atol=1e-12) and record.dt == 0.005
    assert (record.format, record.units, record.station, record.component) == ("COSMOS", "cm/s2", "NP-1795", "90 Deg")
    assert record.title.startswith("Record of Fort Example") and "Sensor: RT-131A-02" in record.notes


def test_cosmos_velocity_between_two_channels_is_skipped(tmp_path):
    velocity = cosmos(quantity="velocity", units="cm/sec", end="End-of-data for Chan  1 velocity\n")
    path = write(tmp_path, cosmos() + velocity + cosmos(-VALUES).replace("90 Deg", "Up"))
    refused(path, "2 channels (1: 90 Deg, 2: Up)")
    assert np.allclose(read_record(path, channel=2).acceleration, -0.01 * VALUES)


def test_cosmos_unknown_step_comes_from_the_caller(tmp_path):
    path = write(tmp_path, cosmos(step="-999.000000"))
    refused(path, "does not state its time step")
    assert read_record(path, dt=0.02).dt == 0.02


@pytest.mark.parametrize("text, words", [
    (cosmos(quantity="velocity", units="cm/sec"), ["line 1", "no block of accelerations"]),
    (cosmos(units="counts (50)"), ["line 43", "'counts' is not a unit of acceleration"]),
    (cosmos().replace("   11 acc", "   19 acc"), ["line 43", "19 samples are announced", "line 45", "3 of them"]),
    (cosmos().replace("   11 acc", "   10 acc"), ["line 43", "10 samples", "line 45", "3 of them instead of 2"]),
    ("\n".join(cosmos().split("\n")[:44]), ["line 43", "line 45", "0 of them instead of 3"]),
    (cosmos().replace(" 101.00000", " 1o1.00000"), ["line 44", "'1o1.00000'", "columns 41 to 50"]),
    (cosmos().replace(" 101.00000", "-999.00000"), ["line 44", "marked as unknown"]),
    (cosmos().replace(" 101.00000", "**********"), ["line 44", "is not a number"]),
    (csmip().replace("accel data equally", "accel data unequally", 1), ["unequally spaced", "line "]),
    (csmip(values=VALUES).split("veloc data equally")[0][:-90], ["complete file", "11 samples"]),
], ids=lambda value: value[-1] if isinstance(value, list) else "")
def test_bad_cosmos_and_csmip_are_refused_in_one_sentence(text, words, tmp_path):
    refused(write(tmp_path, text), *words)


# --- K-NET ----------------------------------------------------------------------------------------------------------

COUNTS = np.array([-10699, -10704, -10710, -10706, -9500, -13400, -10698, -10704, -10710, -10690, -10712, -10701] * 17)


def knet(counts=COUNTS[:200], seconds=2, code="AOM004", direction="E-W", scale="3920(gal)/6182761"):
    header = f"""Origin Time       2018/01/24 19:51:00
Lat.              41.0
Long.             142.5
Depth. (km)       30
Mag.              6.2
Station Code      {code}
Station Lat.      41.4087
Station Long.     141.4486
Station Height(m) 30
Record Time       2018/01/24 19:51:37
Sampling Freq(Hz) 100Hz
Duration Time(s)  {seconds}
Dir.              {direction}
Scale Factor      {scale}
Max. Acc. (gal)   1.709
Last Correction   2018/01/24 19:51:37
Memo.
"""
    cells = [f"{int(count):8d} " for count in counts]
    return header + "\n".join("".join(cells[k:k + 8]) for k in range(0, len(cells), 8)) + "\n"


@pytest.mark.parametrize("direction", ["E-W", "N-S", "U-D", "6"])
def test_knet_counts_become_accelerations_without_offset(direction, tmp_path):
    record = read_record(write(tmp_path, knet(direction=direction), "AOM0041801241951.EW"))
    counts = COUNTS[:200] - np.mean(COUNTS[:200])
    assert np.allclose(record.acceleration, 0.01 * 3920.0 / 6182761.0 * counts, rtol=1e-12, atol=1e-15)
    assert abs(np.mean(record.acceleration)) < 1e-15 and record.dt == 0.01 and record.units == "gal"
    assert (record.format, record.station, record.component) == ("K-NET", "AOM004", direction)
    assert record.notes[0] == "Origin Time 2018/01/24 19:51:00" and record.notes[-1].startswith("mean of -6.8")


@pytest.mark.parametrize("text, words", [
    (knet(COUNTS[:199]), ["line 12", "2 s at 100 Hz", "199 samples"]),
    (knet(seconds=4), ["line 12", "4 s at 100 Hz", "200 samples"]),
    (knet().replace("Scale Factor", "Scale Farce "), ["line 1", "'Origin' is not a number"]),
    (knet().replace("Dir. ", "Dor. "), ["no line 'Dir.'"]),
    (knet(scale="3920/6182761"), ["line 14", "scale factor"]),
    (knet(scale="3920(counts)/6182761"), ["line 14", "'counts' is not a unit"]),
    (knet().replace("100Hz", "many"), ["line 11", "no positive number"]),
    (knet().replace("  -9500", "  -95x0", 1), ["line 18", "'-95x0' is not a number"]),
], ids=lambda value: value[-1] if isinstance(value, list) else "")
def test_bad_knet_is_refused_in_one_sentence(text, words, tmp_path):
    refused(write(tmp_path, text), *words, units="gal")


# --- ESM and AFAD ---------------------------------------------------------------------------------------------------

def esm(values=VALUES, *, count=None, units="cm/s^2", kind="ACCELERATION", step="0.005000"):
    header = f"""EVENT_NAME: GREECE
EVENT_DATE_YYYYMMDD: 20190728
EVENT_TIME_HHMMSS: 160908
MAGNITUDE_W_REFERENCE:
NETWORK: HI
STATION_CODE: ARS1
VS30_M/S:
DATE_TIME_FIRST_SAMPLE_YYYYMMDD_HHMMSS: 20190728_160919.870
SAMPLING_INTERVAL_S: {step}
NDATA: {len(values) if count is None else count}
STREAM: HNE
UNITS: {units}
PGA_CM/S^2: 250.75
DATA_TYPE: {kind}
DATA_LICENSE: U (unknown license)
DATA_CITATION: Nobody (2019)
USER1: somebody's folder
USER5:
"""
    return header + "".join(f"{value:.6f}\n" for value in values)


def test_esm_record_and_its_licence(tmp_path):
    record = read_record(write(tmp_path, esm(), "HI.ARS1..HNE.D.20190728.160908.C.ACC.ASC"))
    assert np.allclose(record.acceleration, 0.01 * VALUES, rtol=1e-12, atol=0.0) and record.dt == 0.005
    assert (record.format, record.station, record.component) == ("ESM", "HI.ARS1", "HNE")
    assert record.title == "GREECE 20190728 160908 HI.ARS1 HNE"
    assert "DATA_LICENSE: U (unknown license)" in record.notes and not any("USER" in note for note in record.notes)


def test_esm_in_g_windows_line_ends_and_first_key_unlike_event_name(tmp_path):
    text = esm(units="g").replace("EVENT_NAME", "EARTHQUAKE_NAME").replace("\n", "\r\n")
    record = read_record(write(tmp_path, text), largest=1e4)
    assert record.format == "ESM" and np.allclose(record.acceleration, G * VALUES, rtol=1e-12)


@pytest.mark.parametrize("text, words", [
    (esm(count=12), ["line 10", "NDATA is 12 but 11 values"]),
    (esm(count="many"), ["line 10", "NDATA is 'many'"]),
    (esm(step=""), ["does not give SAMPLING_INTERVAL_S"]),
    (esm(step="0,005 s"), ["line 9", "SAMPLING_INTERVAL_S is '0,005 s'"]),
    (esm(kind="VELOCITY", units="cm/s"), ["line 14", "holds velocity", ".ACC.ASC"]),
    (esm(units="cm/s"), ["line 12", "'cm/s' is not a unit"]),
    (esm().replace("101.000000", "1O1.000000"), ["line 23", "'1O1.000000' is not a number"]),
], ids=lambda value: value[-1] if isinstance(value, list) else "")
def test_bad_esm_is_refused_in_one_sentence(text, words, tmp_path):
    refused(write(tmp_path, text), *words)


AFAD = """STRONG GROUND MOTION RECORDS OF TURKIYE
PLACE                   : SOMEWHERE
EARTHQUAKE DATE         : 2017/07/20 22:31:09 (GMT)
STATION ID              : 5405
NUMBER OF DATA          : 3
SAMPLING INTERVAL (sec) : 0.01
RAW PGA VALUES (gal)    : (N-S) 1.5 (E-W) 1.1 (U-D) 0.4
DISASTER AND EMERGENCY MANAGEMENT PRESIDENCY
       N-S          E-W          U-D
   -0.500000      1.100000    -0.260000
   -1.500000      0.780000     0.400000
    0.520000     -1.000000    -0.260000
"""


@pytest.mark.parametrize("channel, name, samples", [
    (1, "N-S", [-0.5, -1.5, 0.52]), (2, "E-W", [1.1, 0.78, -1.0]), (3, "U-D", [-0.26, 0.4, -0.26])])
def test_afad_columns_are_channels(channel, name, samples, tmp_path):
    record = read_record(write(tmp_path, AFAD.replace("\n", "\r\n")), channel=channel)
    assert np.allclose(record.acceleration, 0.01 * np.array(samples), rtol=1e-14) and record.dt == 0.01
    assert (record.format, record.station, record.component, record.units) == ("AFAD", "5405", name, "gal")


@pytest.mark.parametrize("text, words, options", [
    (AFAD, ["1: N-S, 2: E-W, 3: U-D", "pass channel="], {}), (AFAD, ["pass channel="], {"channel": 4}),
    (AFAD.replace(": 3\n", ": 4\n"), ["line 5", "4 samples", "3 follow"], {"channel": 1}),
    (AFAD.replace("0.780000 ", " "), ["line 11", "2 values"], {"channel": 1}),
    (AFAD.replace("0.780000", "0.78O000"), ["line 11", "'0.78O000' is not a number"], {"channel": 1}),
    (AFAD.replace("N-S  ", "N  "), ["no line 'N-S E-W U-D'"], {"channel": 1}),
    (AFAD.replace(": 0.01", ": often"), ["line 6", "SAMPLING INTERVAL (SEC) is 'often'"], {"channel": 1}),
    (AFAD.replace("NUMBER", "Numbers"), ["does not give NUMBER OF DATA"], {"channel": 1}),
], ids=lambda value: value[-1] if isinstance(value, list) else "")
def test_bad_afad_is_refused_in_one_sentence(text, words, options, tmp_path):
    refused(write(tmp_path, text), *words, **options)


# --- SimCenter JSON -------------------------------------------------------------------------------------------------

EVENT = """{"Events": [
    {"name": "two components", "type": "Seismic", "dT": 0.01, "numSteps": 3,
     "timeSeries": [
        {"name": "accel_X", "type": "Value", "dT": 0.01, "data": [0.0, 0.1, -0.2]},
        {"name": "accel_Y", "type": "Value", "dT": 0.01, "data": [0.3, 1e-1, 0]}],
     "pattern": [
        {"type": "UniformAcceleration", "timeSeries": "accel_X", "dof": 1},
        {"type": "UniformAcceleration", "timeSeries": "accel_Y", "dof": 2}]
    }]}
"""
ONE = '{"timeSeries": [{"name": "x", "dT": 0.02, "data": [0.0, 0.1, -0.2]}]}'


@pytest.mark.parametrize("channel, name, samples", [(1, "accel_X", [0.0, 0.1, -0.2]), (2, "accel_Y", [0.3, 0.1, 0.0])])
def test_simcenter_series_are_channels(channel, name, samples, tmp_path):
    record = read_record(write(tmp_path, EVENT), "g", channel=channel)
    assert np.allclose(record.acceleration, G * np.array(samples), rtol=1e-14) and record.dt == 0.01
    assert (record.format, record.title, record.component) == ("SimCenter", "two components", name)


def test_simcenter_one_series_without_events(tmp_path):
    assert read_record(write(tmp_path, ONE), "m/s2").dt == 0.02


@pytest.mark.parametrize("text, words, options", [
    (EVENT, ["1: accel_X, 2: accel_Y", "pass channel="], {}), (EVENT, ["there is no channel 3"], {"channel": 3}),
    (ONE, ["pass units="], {"units": None}), (ONE.replace('"dT": 0.02, ', ""), ["pass dt="], {}),
    (EVENT.replace("UniformAcceleration", "UniformVelocity", 1), ["'accel_X'", "'UniformVelocity'"], {"channel": 1}),
    (ONE.replace('"dT"', '"factor": 9.81, "dT"'), ["factor 9.81"], {}), (ONE.replace("0.02", '"?"'), ["is '?'"], {}),
    (ONE.replace("0.1", "NaN"), ["no list of two or more numbers"], {}),
    (ONE.replace("[0.0, 0.1, -0.2]", "3"), ["no list"], {}),
    (EVENT.replace("0.3, 1e-1", "0.3 1e-1"), ["line 5", "not JSON"], {}), (EVENT[:200], ["line 5", "not JSON"], {}),
    ('{"Events": [], "timeSeries": 1}', ["no event holds"], {}),
], ids=lambda value: value[-1] if isinstance(value, list) else "")
def test_bad_simcenter_is_refused_in_one_sentence(text, words, options, tmp_path):
    refused(write(tmp_path, text), *words, **({"units": "g"} | options))


# --- mutilated files ------------------------------------------------------------------------------------------------

def mutilated(text, random):
    """Lines lost, doubled or cut, characters changed: one to three accidents."""
    lines = text.split("\n")
    for _ in range(random.integers(1, 4)):
        index = int(random.integers(len(lines)))
        line = lines[index]
        place = int(random.integers(len(line) + 1))
        accident = int(random.integers(5))
        if accident == 0:
            del lines[index + (index == 0):index + 1 + (index == 0)]
        elif accident == 1:
            lines = lines[:index + 1]
        elif accident == 2:
            lines[index] = line[:place]
        elif accident == 3:
            lines.insert(index, line)
        else:
            lines[index] = line[:place] + random.choice(list("0123456789.-+eE:(*,; x\t")) + line[place + 1:]
    return "\n".join(lines)


@pytest.mark.parametrize("text", [csmip(), csmip() + csmip(2), *COSMOS.values(), knet(), esm(), AFAD, EVENT, ONE],
                         ids=lambda text: text.strip()[:20])
def test_mutilated_files_are_read_or_refused_but_never_crash(text, tmp_path):
    random = np.random.default_rng(11)
    outcomes = set()
    for _ in range(150):
        path = write(tmp_path, mutilated(text, random))
        for options in ({}, {"units": "gal", "dt": 0.01}, {"channel": 1}, {"units": "g", "channel": 1}):
            try:
                outcomes.add(type(read_record(path, **options)).__name__)
            except InputError as error:
                assert str(path) in str(error) and "\n" not in str(error)
                outcomes.add("refused")
    assert outcomes == {"Record", "refused"}


# --- OpenSees path series -------------------------------------------------------------------------------------------

@pytest.mark.parametrize("text", [
    "".join(f"{value:.6e}\n" for value in VALUES), "\n".join(f"  {value:.6e}" for value in VALUES),
    rows(VALUES, 5, 12, 5), rows(VALUES, 3, 12, 5), " ".join(map(str, VALUES)),
], ids=["one a line", "no final line end", "five a line", "three a line", "all on one line"])
def test_opensees_path_series(text, tmp_path):
    path = write(tmp_path, text, "A10000.th")
    record = read_record(path, "cm/s2", dt=0.02)
    assert np.allclose(record.acceleration, 0.01 * VALUES, rtol=1e-12, atol=0.0) and record.dt == 0.02
    refused(path, "dt=", units="cm/s2")
    refused(path, "pass units=", dt=0.02)


def test_channel_is_refused_where_there_are_none(tmp_path):
    refused(write(tmp_path, esm()), "channel=1", "leave channel out", channel=1)


# --- writing --------------------------------------------------------------------------------------------------------

RECORD = Record(acceleration=np.sin(np.arange(37.0)) * 10.0 ** np.linspace(-6.0, 2.0, 37), dt=0.005,
                 title="Some  motion\nof mine", notes=("scaled by 2",))


@pytest.mark.parametrize("units", ["g", "m/s2", "cm/s2", "gal"])
def test_what_is_written_is_read_back(units, tmp_path):
    """To half a unit of the ninth digit of each sample."""
    write_columns(RECORD, tmp_path / "a.txt", units)
    write_at2(RECORD, tmp_path / "a.at2", units)
    write_path_series(RECORD, tmp_path / "a.th", units)
    for record in (read_record(tmp_path / "a.txt", units, largest=200.0),
                   read_record(tmp_path / "a.at2", largest=200.0),
                   read_record(tmp_path / "a.th", units, dt=0.005, largest=200.0)):
        assert np.allclose(record.acceleration, RECORD.acceleration, rtol=6e-9, atol=0.0)
        assert np.isclose(record.dt, 0.005, rtol=1e-12) and record.units == units
    assert read_record(tmp_path / "a.txt", units, largest=200.0).notes[0] == "Some motion of mine"
    assert read_record(tmp_path / "a.at2", largest=200.0).title == "Some motion of mine"


def test_writing_where_nothing_can_be_written(tmp_path):
    with pytest.raises(InputError, match="cannot be written"):
        write_at2(RECORD, tmp_path)
    with pytest.raises(InputError, match="'m' is not a unit of acceleration"):
        write_columns(RECORD, tmp_path / "a.txt", "m")
