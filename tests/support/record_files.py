"""Record files of the formats of networks and tools, written here for the tests of their
readers."""

import numpy as np

# cm/s2; 11: a short row
VALUES = np.array([0.125, -12.5, 3.25, -0.5, 101.0, -250.75, 8.0, 1e-3, -1e-3, 42.0, -7.5])


def rows(values, per_line, width, decimals):
    cells = [f"{value:{width}.{decimals}f}" for value in values]
    assert all(len(cell) == width for cell in cells)
    return (
        "\n".join("".join(cells[k : k + per_line]) for k in range(0, len(cells), per_line)) + "\n"
    )


def csmip(
    channel=1,
    name="90 Deg",
    values=VALUES,
    unit="in cm/sec2. (8f10.3)",
    per_line=8,
    width=10,
    decimals=3,
):
    """One channel: 25 text lines (shortened), 100 integers, 100 reals, then acceleration, velocity,
    displacement."""
    text = f"""Corrected accelerogram   58000-L1000-14000.10       Chan  {channel}:  {name}\
         from
Uncorrected Accelerogram Data             Processed: 08/24/14, CGS
Rcrd of Sun Aug 24, 2014 03:20:33.0 PDT
Station No. 58000   37.973N, 122.038W    Etna    s/n 2866  (3 Chns of  3 at Sta)
Somewhere - Clayton & Ellis               CGS   Data: Acceleration
Chan  {channel}:  {name}
{len(values):6d} points of instrument- and baseline-corrected accel, veloc and displ data
At equally-spaced intervals of    .010  sec.
Peak acceleration =    27.114    cm/sec/sec  at   32.570   sec.
"""
    text += (
        "\n".join("".join(f"{k:5d}" for k in range(16)) for _ in range(6))
        + "\n"
        + "    1    0    0    0\n"
    )
    text += rows([0.5] * 97 + [-122.038, -999.0, -999.0], 8, 10, 5)
    for quantity, unit_text in (
        ("accel", unit),
        ("veloc", "in cm/sec.  (8f10.3)"),
        ("displ", "in cm.  (8f10.3)"),
    ):
        shape = (per_line, width, decimals) if quantity == "accel" else (8, 10, 3)
        scale = {"accel": 1.0, "veloc": 0.1, "displ": 0.01}[quantity]
        text += (
            f"{len(values):6d} points of {quantity} data equally spaced at  .010 sec, {unit_text}\n"
        )
        text += rows(scale * np.asarray(values), *shape)
    return text + f"/&  ----------  End of data for channel  {channel}  ----------\n"


def cosmos(
    values=VALUES,
    *,
    units="cm/sec2(04)",
    per_line=8,
    form="8F10.5",
    cells=None,
    step="0.005000",
    first="Corrected acceleration",
    end="End-of-data for Chan  1 acceleration\n",
    quantity="acceleration",
):
    """Thirteen text lines (shortened), 100 integers, 100 reals of which number 34 is the step,
    comments, samples."""
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
    text += (
        "\n".join("".join(f"{real:>15}" for real in reals[k : k + 5]) for k in range(0, 100, 5))
        + "\n"
    )
    text += "   2 Comment line(s) follow, each starting with a |\n"
    text += "| Sensor: RT-131A-02\n|<PROCESS> AUTO\n"
    text += f"   {len(values)} {quantity} pts, approx  0 secs, units={units},Format=({form})\n"
    cells = cells or [f"{value:10.5f}" for value in values]
    return (
        text
        + "\n".join("".join(cells[k : k + per_line]) for k in range(0, len(values), per_line))
        + "\n"
        + end
    )


COUNTS = np.array(
    [-10699, -10704, -10710, -10706, -9500, -13400, -10698, -10704, -10710, -10690, -10712, -10701]
    * 17
)


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
    return header + "\n".join("".join(cells[k : k + 8]) for k in range(0, len(cells), 8)) + "\n"


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
AFAD_ROW = "    0.520000     -1.000000    -0.260000\n"


def smc(
    kind="2 CORRECTED ACCELEROGRAM",
    *,
    rate="  0.2000000E+03",
    n=11,
    comments=2,
    vertical=90,
    samples=VALUES,
):
    text = [
        kind,
        "*",
        "STA01",
        "     1989  10  18    0004 Loma Prieta, CA",
        "Moment Mag=      7.1",
        "station = Somewhere     component=    360",
        "x",
        "y",
        "*",
        "*",
        "*",
    ]
    integers = [-32768] * 48
    integers[12], integers[13], integers[15], integers[16] = vertical, 360, comments, n
    text += ["".join(f"{i:10d}" for i in integers[k : k + 8]) for k in range(0, 48, 8)]
    reals = ["  0.1700000E+39"] * 50
    reals[1] = rate
    text += ["".join(reals[k : k + 5]) for k in range(0, 50, 5)]
    text += ["|"] + ["|reference of the record"] * (comments - 1)
    fields = [f"{v:10.4E}".replace("E-0", "E-").replace("E+0", "E+").rjust(10) for v in samples]
    text += ["".join(fields[k : k + 8]) for k in range(0, len(fields), 8)]
    return "\n".join(line.ljust(80) for line in text)
