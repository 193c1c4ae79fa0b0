"""Record files of every known variant, written here, and one sentence for every way a file can be
wrong."""

import hashlib

import numpy as np
import pytest
import record_files

from vi_contact.core.errors import InputError, ViContactError
from vi_contact.practice.ground_motion import UNITS, read_record

pytestmark = pytest.mark.serial

G = 9.80665
# 11: the last row is short
VALUES = np.array([0.0, 0.0063, -0.00123, 0.5, -0.25, 0.125, 1e-5, 0.3, -0.3, 0.01, 0.02])


def write(tmp_path, text, name="record.txt"):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode("ascii"))
    return path


def by_words(value):
    """Test name from the words expected in the message."""
    return ", ".join(value) if isinstance(value, list) else ""


def rows(values, per_row, form="{:10.5f}"):
    return "\n".join(
        "".join(form.format(v) for v in values[k : k + per_row])
        for k in range(0, len(values), per_row)
    )


def peer(line, per_row=5, form="{:15.7E}", end="\n", values=VALUES):
    return (
        "PEER NGA STRONG MOTION DATABASE RECORD\nIMPERIAL VALLEY, 5/19/40, STATION 117, 180\n"
        f"ACCELERATION TIME SERIES IN UNITS OF G\n{line}\n" + rows(values, per_row, form) + end
    )


PROSE = (
    "El Centro 1940, north-south component\n{}\nThe units are (g)\nthree\nmore\nlines of "
    "text\n*** Begin data ***\n"
)

AT2 = {
    "el centro": peer("NPTS=    11, DT= .02000 SEC", 8, "{:10.5f}", end=""),
    "filter data": peer("NPTS=     11, DT=   .0200 SEC,   0 POLE @    30.00000 HZ"),
    "no unit of dt": peer("NPTS=  11, DT= .0200"),
    "values before names": peer("11 0.02000 NPTS, DT"),
    "values before names, blanks": peer("   11    0.0200    NPTS, DT", 8),
    "two lines": peer("NPTS= 11\nDT= 2.0E-2"),
    "colon and lower case": peer("npts: 11, dt: 0.02 sec"),
    "one a row": peer("NPTS=    11, DT= .02000 SEC", 1),
    "windows line ends": peer("NPTS=    11, DT= .02000 SEC").replace("\n", "\r\n"),
    "old mac line ends": peer("NPTS=    11, DT= .02000 SEC").replace("\n", "\r"),
    "latin-1 title": peer("NPTS=    11, DT= .02000 SEC")
    .replace("IMPERIAL", "M\xc9XICO")
    .encode("latin-1"),
    "utf-8 with mark": (
        "\ufeff" + peer("NPTS=    11, DT= .02000 SEC").replace("IMPERIAL", "M\xc9XICO")
    ).encode(),
    "blank lines at the end": peer("NPTS=    11, DT= .02000 SEC", end="\n\n  \n"),
    "no leading zero": peer("NPTS=    11, DT= .02000 SEC")
    .replace(" 0.", "  .")
    .replace("-0.", "-."),
    "exponent letter D": peer("NPTS=    11, DT= .02000 SEC")
    .replace("E+", "D+")
    .replace("E-", "D-"),
    "data after a mark, dt in prose": PROSE.format("11 points at equal spacing of 0.02 sec")
    + rows(VALUES, 8),
    "data after a mark, dt first": PROSE.format("acceleration at 0.02 second intervals")
    + rows(VALUES, 5),
    "data after a mark, one a row": PROSE.format("sampled at 0.02 s") + rows(VALUES, 1),
}


@pytest.mark.parametrize("name", AT2)
def test_at2_variants(name, tmp_path):
    """seismic.md 1.2: every header met in the wild, and the usual accidents of copying."""
    path = write(tmp_path, AT2[name])
    record = read_record(path)
    assert np.allclose(record.acceleration, G * VALUES, rtol=1e-6, atol=1e-12)
    assert record.dt == 0.02 and record.units == "g" and record.format == "PEER AT2"
    assert (
        record.source == str(path)
        and record.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    )


def test_at2_title_is_the_line_after_the_peer_banner(tmp_path):
    record = read_record(write(tmp_path, AT2["latin-1 title"]))
    assert record.title == "M\xc9XICO VALLEY, 5/19/40, STATION 117, 180"
    assert record.notes[0].startswith("PEER NGA") and len(record.notes) == 4
    assert read_record(write(tmp_path, AT2["utf-8 with mark"])).title == record.title


def test_at2_touching_values_are_cut_at_their_signs(tmp_path):
    header = "title\nACCELERATION IN UNITS OF G\nNPTS= 5, DT= .01\n"
    record = read_record(write(tmp_path, header + "-.123E-02-.456E-03 .5\n-0.12345-1.50000"))
    assert np.allclose(
        record.acceleration / G, [-0.00123, -0.000456, 0.5, -0.12345, -1.5], rtol=1e-15, atol=0.0
    )


def test_at2_in_other_units_of_acceleration(tmp_path):
    text = peer("NPTS= 11, DT= .02").replace("UNITS OF G", "UNITS OF CM/SEC/SEC")
    assert np.allclose(
        read_record(write(tmp_path, text)).acceleration, 0.01 * VALUES, rtol=1e-6, atol=1e-12
    )


def test_at2_missing_step_and_units_come_from_the_caller(tmp_path):
    path = write(tmp_path, "a\nb\n*** Begin data ***\n" + rows(VALUES, 5))
    with pytest.raises(InputError, match="does not state its units; pass units="):
        read_record(path, dt=0.02)
    with pytest.raises(InputError, match="does not state its time step; pass dt="):
        read_record(path, "g")
    assert read_record(path, "g", dt=0.02).dt == 0.02


def test_two_time_steps_in_prose_are_no_statement(tmp_path):
    path = write(
        tmp_path, PROSE.format("sampled at 0.01 sec, printed every 0.02 sec") + rows(VALUES, 5)
    )
    with pytest.raises(InputError, match="pass dt="):
        read_record(path)


def test_columns_after_a_mark_are_not_taken_for_rows(tmp_path):
    text = PROSE.format("x") + "\n".join(f"{0.02 * k:.2f} {v:.5f}" for k, v in enumerate(VALUES))
    record = read_record(write(tmp_path, text), "g")
    assert record.format == "columns" and np.allclose(record.acceleration, G * VALUES, atol=1e-12)


@pytest.mark.parametrize(
    "text, options, words",
    [
        (peer("NPTS= 12, DT= .02"), {}, ["line 4", "12 samples", "11 follow"]),
        (peer("NPTS= 10, DT= .02"), {}, ["line 4", "10 samples", "11 follow"]),
        (peer("NPTS= 11, DT= .02").replace("0.0", "0.x", 1), {}, ["line 5", "is not a number"]),
        (
            peer("NPTS= 11, DT= .02", 8, "{:10.5f}").replace("0.50000", "*******"),
            {},
            ["line 5", "'*******' is not a number"],
        ),
        (
            peer("NPTS= 11, DT= .02", 8, "{:10.5f}").replace("0.50000", "NaN"),
            {},
            ["line 5", "'NaN' is not a number"],
        ),
        (
            peer("NPTS= 11, DT= .02", 8, "{:10.5f}").replace("0.12500   0.0", "0.125000.0"),
            {},
            ["line 5", "'0.125000.00001' is not a number"],
        ),
        (
            peer("NPTS= 11, DT= .02").replace(
                "ACCELERATION TIME SERIES IN UNITS OF G", "VELOCITY IN UNITS OF CM/S"
            ),
            {},
            ["'CM/S' is not a unit of acceleration"],
        ),
        (
            peer("NPTS= 11, DT= .02"),
            {"units": "m/s2"},
            ["states its units as g", "'m/s2' was passed"],
        ),
        (
            peer("NPTS= 11, DT= .02"),
            {"units": "furlong"},
            ["'furlong' is not a unit of acceleration", "cm/s2"],
        ),
        (peer("NPTS= 11, DT= .02"), {"dt": 0.01}, ["0.02 s", "dt=0.01 was passed"]),
        (peer("NPTS= 11"), {}, ["does not state its time step"]),
        (peer("NPTS= 11, DT= 0.0"), {}, ["the time step is 0.0"]),
        (peer("NPTS= 11"), {"dt": -0.01}, ["the time step is -0.01"]),
    ],
    ids=by_words,
)
def test_bad_at2_is_refused_in_one_sentence(text, options, words, tmp_path):
    path = write(tmp_path, text)
    with pytest.raises(InputError) as caught:
        read_record(path, **options)
    message = str(caught.value)
    assert message.startswith(str(path)) and "\n" not in message
    for word in words:
        assert word in message


def smc(*given, **options):
    return record_files.smc(*given, samples=VALUES, **options)


def test_smc_is_cut_by_column_and_its_header_understood(tmp_path):
    text = smc()
    # the second and third values of this piece touch
    assert "-1.2300E-3 5.0000E-1-2.5000E-1" in text
    record = read_record(write(tmp_path, text))
    assert np.allclose(record.acceleration, 0.01 * VALUES, rtol=1e-12, atol=0.0)
    assert record.dt == 0.005 and record.format == "USGS SMC" and record.units == "cm/s2"
    assert record.title == "1989 10 18 0004 Loma Prieta, CA; station = Somewhere component= 360"
    assert record.notes == (
        "component: azimuth 360 degrees clockwise from north",
        "reference of the record",
    )


def test_smc_up_and_many_comments_and_windows_line_ends(tmp_path):
    record = read_record(
        write(tmp_path, smc(vertical=0, comments=9).replace("\n", "\r\n")), "gal", dt=0.005
    )
    assert record.notes[0] == "component: vertical, up" and record.acceleration.size == 11


def test_smc_without_sampling_rate_needs_dt(tmp_path):
    path = write(tmp_path, smc(rate="  0.1700000E+39"))
    with pytest.raises(InputError, match="pass dt="):
        read_record(path)
    assert read_record(path, dt=0.005).dt == 0.005


@pytest.mark.parametrize(
    "text, words",
    [
        (
            smc("1 UNCORRECTED ACCELEROGRAM"),
            ["line 1", "'1 UNCORRECTED ACCELEROGRAM'", "unequally spaced", "2 CORRECTED"],
        ),
        (smc("3 VELOCITY"), ["line 1", "'3 VELOCITY' is not an acceleration"]),
        (smc("5 RESPONSE SPECTRA"), ["line 1", "is not an acceleration"]),
        (smc(n=12), ["line 14", "12 samples", "11 follow"]),
        (smc(n=10), ["line 14", "10 samples", "11 follow"]),
        (smc(comments=2).replace("|reference", " reference"), ["2 comment lines"]),
        (smc().replace("5.0000E-1", "5.0000X-1"), ["line 30", "'5.0000X-1'", "columns 31 to 40"]),
        (smc().replace(" 5.0000E-1", "1.7000E+38"), ["line 30", "undefined"]),
        (smc().replace(" 5.0000E-1", "       NaN"), ["line 30", "'NaN'"]),
        ("\n".join(smc().split("\n")[:15]), ["line 16", "0 header values instead of 8"]),
    ],
    ids=by_words,
)
def test_bad_smc_is_refused_in_one_sentence(text, words, tmp_path):
    path = write(tmp_path, text)
    with pytest.raises(InputError) as caught:
        read_record(path)
    message = str(caught.value)
    assert message.startswith(str(path)) and "\n" not in message
    for word in words:
        assert word in message


def columns(times, values, comment="", separator=" "):
    return (
        comment
        + "\n".join(f"{t!r}{separator}{float(v)!r}" for t, v in zip(times, values, strict=True))
        + "\n"
    )


TIMES = [0.02 * k for k in range(11)]


@pytest.mark.parametrize("units", sorted(UNITS))
def test_columns_in_every_unit(units, tmp_path):
    factor = {
        "m/s2": 1.0,
        "cm/s2": 0.01,
        "gal": 0.01,
        "g": G,
        "g/10": 0.1 * G,
        "mm/s2": 1e-3,
        "in/s2": 0.0254,
        "ft/s2": 0.3048,
    }[units]
    record = read_record(write(tmp_path, columns(TIMES, VALUES)), units)
    assert np.allclose(record.acceleration, factor * VALUES, rtol=1e-15, atol=0.0)
    assert record.dt == pytest.approx(0.02, rel=1e-14) and record.units == units


@pytest.mark.parametrize("spelling", ["CM/SEC/SEC", "cm/s^2", "(cm/s**2)", "cm/s\u00b2", " Gal "])
def test_spellings_of_a_unit(spelling, tmp_path):
    assert read_record(write(tmp_path, columns(TIMES, VALUES)), spelling).acceleration[3] == 0.005


@pytest.mark.parametrize(
    "text",
    [
        columns(TIMES, VALUES, "# t [s], a\n#\n\n"),
        columns(TIMES, VALUES, "# NPTS= 11, DT= .02\n"),
        columns(TIMES, VALUES, separator=","),
        columns(TIMES, VALUES, separator=";\t"),
        columns(TIMES, VALUES).rstrip("\n"),
    ],
    ids=["comments", "npts in a comment", "commas", "semicolons", "no final line end"],
)
def test_columns_with_comments_and_separators(text, tmp_path):
    assert np.array_equal(read_record(write(tmp_path, text), "m/s2").acceleration, VALUES)


def test_units_of_columns_are_never_guessed(tmp_path):
    with pytest.raises(
        InputError, match="does not state its units; pass units= as one of m/s2, cm/s2, gal, g"
    ):
        read_record(write(tmp_path, columns(TIMES, VALUES)))


def test_a_header_of_words_is_read_and_believed(tmp_path):
    path = write(tmp_path, "RECORD of X\nUNITS cm/s^2\n1.0\n2.0\n")
    with pytest.raises(
        InputError, match="line 2: the file states its units as cm/s2 but units='g' was passed"
    ):
        read_record(path, "g", dt=0.01)
    record = read_record(path, dt=0.01)
    assert record.acceleration.tolist() == [0.01, 0.02] and record.title == "RECORD of X"


def test_one_column_needs_the_time_step(tmp_path):
    path = write(tmp_path, "\n".join(map(str, VALUES)))
    with pytest.raises(InputError, match="pass dt="):
        read_record(path, "g")
    record = read_record(path, "g", dt=0.02)
    assert record.dt == 0.02 and np.allclose(record.acceleration, G * VALUES, rtol=1e-15)


def test_rounding_of_the_times_is_tolerated_up_to_a_millionth(tmp_path):
    jittered = [t + 0.02 * 4e-7 * (-1) ** k for k, t in enumerate(TIMES)]
    assert read_record(write(tmp_path, columns(jittered, VALUES)), "g").dt == pytest.approx(
        0.02, rel=1e-6
    )
    jittered[4] += 0.02 * 3e-6
    with pytest.raises(
        InputError, match="line 5: the step to time 0.080000068 s is 0.020000076 s, others 0.02"
    ):
        read_record(write(tmp_path, columns(jittered, VALUES)), "g")


def test_uneven_times_are_refused_unless_resampled(tmp_path):
    """The wanted record is a straight line, which linear interpolation and a finer grid reproduce
    exactly."""
    times = [0.0, 0.02, 0.04, 0.05, 0.08, 0.10, 0.12]
    path = write(tmp_path, columns(times, [10.0 * t for t in times], "# uneven\n"))
    with pytest.raises(
        InputError, match=r"line 5: the step to time 0\.05 s is 0\.01 s, others 0\.02 s; pass"
    ):
        read_record(path, "m/s2")
    record = read_record(path, "m/s2", resample_dt=0.01)
    assert record.dt == 0.01 and record.acceleration.size == 13
    assert np.allclose(record.acceleration, 10.0 * record.times, rtol=1e-12, atol=1e-15)
    assert record.notes == ("uneven", "uneven times interpolated linearly to a step of 0.01 s")


def test_uneven_times_read_at_a_long_step_do_not_alias(tmp_path):
    """A 40 Hz packet sampled about every 0.005 s, wanted every 0.02 s, whose Nyquist frequency is
    25 Hz."""
    times = 0.005 * np.arange(4001) + np.where(np.arange(4001) % 7 == 3, 1e-4, 0.0)
    values = np.sin(2 * np.pi * 40.0 * times) * np.exp(-(((times - 10.0) / 2.0) ** 2))
    record = read_record(write(tmp_path, columns(times.tolist(), values)), "m/s2", resample_dt=0.02)
    assert record.dt == 0.02 and np.max(np.abs(record.acceleration)) < 0.02


def test_a_late_first_time_is_noted(tmp_path):
    record = read_record(write(tmp_path, columns([t + 1.5 for t in TIMES], VALUES)), "g")
    assert record.times[0] == 0.0 and record.notes == (
        "the first time in the file is 1.5 s and is t = 0 here",
    )


def test_even_records_are_resampled_on_request(tmp_path):
    record = read_record(write(tmp_path, AT2["el centro"]), resample_dt=0.01)
    assert record.dt == 0.01 and record.acceleration.size == 21
    assert record.notes[-1] == "resampled from 0.02 s to 0.01 s"


@pytest.mark.parametrize(
    "text, options, words",
    [
        ("0.0 1.0\n0.1 2.0\n0.2 x\n", {}, ["line 3", "'x' is not a number"]),
        (
            "time vel\n0.0 1.0\n0.1 2.0\n",
            {},
            ["line 1", "names no acceleration (time: time, vel: velocity)"],
        ),
        (
            '"t [s]";"a [cm/s/s]"\n0.0;1.0\n0.1;2.0\n',
            {},
            ["line 1", "states its units as cm/s2", "'m/s2' was passed"],
        ),
        ("nan 0.0\n0.1 2.0\n", {}, ["line 1", "'nan' is not a number"]),
        ("0.0 1.0\n0.1 2.0\n0.2\n", {}, ["line 3", "1 columns instead of 2"]),
        ("0.0 1.0 5.0\n0.1 2.0 5.0\n", {}, ["line 1", "3 columns instead of 2"]),
        ("0.0 1.0\n0.1 2.0\n0.1 2.0\n", {}, ["line 3", "does not come after"]),
        ("0.0 1.0\n0.2 2.0\n0.1 2.0\n", {"resample_dt": 0.1}, ["line 3", "does not come after"]),
        ("0.0 1.0\n", {}, ["1 samples", "two or more"]),
        ("# only a comment\n", {}, ["0 samples"]),
        ("0.0 1.0\n0.1 2.0\n", {"dt": 0.2}, ["0.1 s", "dt=0.2"]),
        ("0.0 1.0\n0.1 2.0\n0.25 1.0\n", {"resample_dt": -1.0}, ["resample_dt is -1.0"]),
        ("", {}, ["empty"]),
        (" \n\n", {}, ["empty"]),
        (b"\x89PNG\0\0", {}, ["not a text file"]),
    ],
    ids=by_words,
)
def test_bad_columns_are_refused_in_one_sentence(text, options, words, tmp_path):
    path = write(tmp_path, text)
    with pytest.raises(InputError) as caught:
        read_record(path, "m/s2", **options)
    message = str(caught.value)
    assert "\n" not in message and (message.startswith(str(path)) or "resample_dt" in message)
    for word in words:
        assert word in message


def test_missing_file_and_folder_are_refused(tmp_path):
    with pytest.raises(InputError, match="nowhere.at2: there is no such file"):
        read_record(tmp_path / "nowhere.at2")
    with pytest.raises(ViContactError, match="cannot be read"):
        read_record(tmp_path)
