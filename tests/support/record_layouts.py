"""Write records of every format from a grid of cells, so that a test can change the grid and know
the right answer.

A layout knows its header, the width of its cells, how many stand on a row, and what a reader can
check: a count that the header states, times beside the samples, cells that are cut by column. All
numbers are made here."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from record_files import cosmos, csmip, esm, knet, smc

STEP = 0.02  # s, of every record
Grid = list[list[str]]


@dataclass(frozen=True)
class Layout:
    """Describe a format: head(count) and tail() are its text before and behind the rows."""

    name: str
    head: Callable[[int], str]
    cell: Callable[[float], str]
    per_row: int
    unit: float  # of a sample, in m/s²
    decimals: int = 3
    tail: str = ""
    counted: bool = True  # the header states the number of samples
    timed: bool = False  # the first cell of a row is the time
    fixed: bool = False  # cells are cut by column
    components: int = 0  # columns of samples in a row, 0: the rows follow one another
    options: dict[str, Any] = field(default_factory=dict)
    time: Callable[[float], str] = lambda seconds: f"{seconds:.2f}"
    column: int = 0  # of the component that the options choose
    end: str = "\n"

    def grid(self, values: Sequence[float]) -> Grid:
        """Return the cells of a record; further components are other numbers."""
        if self.components:
            return [
                [
                    *([self.time(STEP * k)] if self.timed else []),
                    *(
                        self.cell(value if j == self.column else 0.5 * (j + 1))
                        for j in range(self.components)
                    ),
                ]
                for k, value in enumerate(values)
            ]
        cells = []
        for k, value in enumerate(values):
            cells += [self.time(STEP * k)] if self.timed else []
            cells.append(self.cell(value))
        return [cells[k : k + self.per_row] for k in range(0, len(cells), self.per_row)]

    def text(self, grid: Grid, count: int) -> str:
        """Return the file."""
        return self.head(count) + "".join("".join(row) + self.end for row in grid) + self.tail

    def samples(self, grid: Grid) -> np.ndarray:
        """Return the right answer for a grid [m/s²]; ValueError where a cell is no number."""
        if self.components:
            cells = [row[self.column + self.timed] for row in grid]
        else:
            cells = [cell for row in grid for cell in row][int(self.timed) :: 1 + self.timed]
        values = np.array([float(cell.strip(" ,;\t")) for cell in cells])
        if self.name == "knet":
            return self.unit * (values - np.mean(values))
        return self.unit * values


def fixed(width: int, decimals: int) -> Callable[[float], str]:
    return lambda value: f"{value:{width}.{decimals}f}"


def until(text: str, mark: str) -> str:
    """The text up to the end of the line with this mark."""
    at = text.index(mark)
    return text[: text.index("\n", at) + 1]


def csmip_head(count: int) -> str:
    return until(csmip(values=np.zeros(count)).replace(".010", ".020"), "points of accel data")


def csmip_tail() -> str:
    return "/&  ----------  End of data for channel  1  ----------\n"


def cosmos_head(count: int) -> str:
    return until(cosmos(values=np.zeros(count), step="0.020000"), "acceleration pts")


def smc_head(count: int) -> str:
    text = smc(n=count, rate="  0.5000000E+02", samples=[0.0])
    return "\n".join(text.split("\n")[:-1]) + "\n"


def knet_head(count: int) -> str:
    text = (
        knet(np.zeros(2))
        .replace("100Hz", "50Hz")
        .replace("Duration Time(s)  2", f"Duration Time(s)  {count / 50:.2f}")
    )
    return until(text, "Memo.")


def esm_head(count: int) -> str:
    return until(esm(np.zeros(count), step="0.020000"), "USER5")


def at2_head(count: int) -> str:
    return (
        f"PEER NGA\nMADE, 5/19/40\nACCELERATION TIME SERIES IN UNITS OF G\nNPTS= {count:6d}, "
        "DT= .0200 SEC\n"
    )


def begin_head(count: int) -> str:
    return (
        "Made motion, north south\n"
        f"{count} points at equal spacing of 0.02 sec\n"
        "Points are listed in the format of 8F10.3, i.e., 8 points across in\n"
        "a row with 3 decimal places\n"
        "The units are (g)\n"
        "*** Begin data ***\n"
        f"NPTS= {count:6d}, DT= .02000 SEC\n"
    )


def afad_head(count: int) -> str:
    return f"""STRONG GROUND MOTION RECORDS OF TURKIYE
STATION ID              : 5405
NUMBER OF DATA          : {count}
SAMPLING INTERVAL (sec) : 0.02
       N-S          E-W          U-D
"""


def geonet(
    values: Sequence[float],
    *,
    name: str = "S16W",
    first: str = "Corrected accelerogram",
    after: bool = True,
    count: int | None = None,
) -> str:
    """One component: 16 lines of text, 4 of integers, 6 of reals; then accelerations, velocities
    and displacements."""
    n = len(values) if count is None else count
    text = geonet_head(n, name=name, first=first, after=after)
    text += "".join(
        "".join(f"{v:8.1f}" for v in values[k : k + 10]) + "\n" for k in range(0, len(values), 10)
    )
    return text + (geonet_tail(n) if after else "")


def geonet_head(
    n: int, *, name: str = "S16W", first: str = "Corrected accelerogram", after: bool = True
) -> str:
    text = f"""{first} 20000101_000000_TEST_20 made file
Site TEST       40 00 00S  176 00 00E     made
Made council
Instrument made
Resolution: 24-bit   Instr Period: 0.0050 s   Damping: 0.700
Accelerogram 20000101_000000_TEST_20                 Processed 2000 January 02
6 km south of somewhere
2000 January 01         00:00:00 UT
Epicentre  40 00 00S 176 00 00E  Bearing S00W  Dist   10km  Depth   10km M  4.00
Number of points {n:5d}    Duration {(n - 1) * STEP:6.2f} sec
Instrument corrected data at 0.020 sec intervals
Band-pass filter transition bands are .10-.25 Hz and 24.50-25.50 Hz
Component {name}  Longitudinal Accelerometer Axis
Acceleration:  peak      0.0 mm/s/s at   0.16 sec     rms     12.0 mm/s/s
Velocity:      peak     0.00 mm/s   at   0.00 sec     rms     0.00 mm/s
Displacement:  peak    0.000 mm     at   0.00 sec     rms    0.000 mm
"""
    integers = [0] * 40
    integers[33:36] = [n, n if after else 0, n if after else 0]
    reals = [0.0] * 60
    reals[24:26] = [0.01, 0.02]
    text += "".join(
        "".join(f"{i:8d}" for i in integers[k : k + 10]) + "\n" for k in range(0, 40, 10)
    )
    return text + "".join(
        "".join(f"{r:8.2f}" for r in reals[k : k + 10]) + "\n" for k in range(0, 60, 10)
    )


def geonet_tail(n: int) -> str:
    rows = [0.0] * n
    block = "".join("".join(f"{v:8.4f}" for v in rows[k : k + 10]) + "\n" for k in range(0, n, 10))
    return 2 * block


def volume1_head(
    count: int,
    *,
    first: str = "UNCORRECTED ACCELEROGRAM DATA              PROCESSED: 06/30/2011",
    component: str = "CHAN  1: EW       (STA CHN:  1)",
    source: str = "UNIVERSIDAD DE CHILE - RENADIC",
    length: str = "RECORD LENGTH",
    units: str = "UNITS OF UNCOR ACCEL ARE SEC AND G/10.     MAX  =  0.1 G",
    per_line: int = 16,
    exponent: bool = False,
) -> str:
    """Thirteen lines of text, 100 integers, 50 reals."""
    text = f"""{first}
MADE EVENT 2000
01/01/2000 00:00:00 (GMT)
                                   TRIGGER TIME: MADE
STATION NO.          0.000N    0.000E  MADE      S/N  673
MADE S/N 673
{component}
{source}
HYPOCENTER:   0.000N    0.000E  H=   0.0KM   ML= 0.00
INSTR PERIOD = 0.0391 SEC,  DAMPING =0.7000,  SENSITIVITY =1.250 VDC/G
NO. OF POINTS = {count:6d}  {length} = {count * STEP:.3f} SEC
{units}
RMS ACCEL OF COMPLETE RECORD = 0.010 G
"""
    text += "".join(
        "".join(f"{i:5d}" for i in range(k, min(k + per_line, 100))) + "\n"
        for k in range(0, 100, per_line)
    )
    if exponent:  # seven reals a line, the last cut off as BHRC's are
        reals = "".join(f"{f'{0.5:.6E}':>14}" for _ in range(5)) + "  .00\n"
        return text.rstrip("\n") + "\n" + 6 * reals + f"{0.5:14.6E}\n"
    return text + "".join(
        "".join(f"{0.5:10.3f}" for _ in range(k, min(k + 8, 50))) + "\n" for k in range(0, 50, 8)
    )


def bhrc_head(count: int) -> str:
    text = volume1_head(
        count,
        first="* VOL1DS FILE:  5520/01",
        component="COMP L1",
        source="Somewhere  Station (BHRC )",
        length="DURATION",
        units="UNITS ARE SECONDS AND G/10",
        per_line=16,
        exponent=True,
    )
    return text.replace(" SEC\nUNITS", "\nUNITS")


def unam_head(count: int) -> str:
    return f"""**************************************************************
                       INSTITUTO DE INGENIERIA, UNAM
ARCHIVO ESTANDAR DE ACELERACION:
VERSION DEL FORMATO                    : 2.0
CLAVE DE LA ESTACION                   : MADE
NUMERO DE CANALES                      : 3
ORIENTACION C1-C6 (rumbo;orientacion)  : /V/N00E/N90E
ORIENTACION C7-C12 (rumbo;orientacion) :
VEL. DE MUESTREO, C1-C6 (muestras/s)   : /50/50/50
INTERVALO DE MUESTREO, C1-C6 (s)       : /0.02/0.02/0.02
INTERVALO DE MUESTREO, C7-C12 (s)      :
FECHA DEL SISMO [GMT]                  : 2000/01/01
DURACION DEL REGISTRO (s), C1-C6       : /{count * STEP:.2f}/{count * STEP:.2f}/{count * STEP:.2f}
NUM. TOTAL DE MUESTRAS, C1-C6          : /{count}/{count}/{count}
ACEL. MAX.(Gal), C1-C6                 : /25.6114/58.7394/-42.3377
UNIDADES DE LOS DATOS                  : Gal (cm/s/s)
FACTOR DE DECIMACION                   : 1
FORMATO DATOS (FORTRAN,10 campos/dato) : 3F10.3

COMENTARIOS:

DATOS DE ACELERACION:
---------+---------+---------+---------+
   CANAL-1   CANAL-2   CANAL-3
         V      N00E      N90E
---------+---------+---------+---------+
"""


def cwa_head(count: int) -> str:
    return f"""#Earthquake Information
#Origin Time(GMT+08): 2000/01/01-00:00:00
#Magnitude(Ml): 6.0

#StationCode: MADE
#RecordLength(sec): {count * STEP:g}
#SampleRate(Hz): 50
#AmplitudeUnit:  gal. DCoffset(corr)
#AmplitudeMAX. U:    0.658~   -0.837
#DataSequence: Time U(+); N(+); E(+)
#Data: 4F10.3
"""


G = 9.80665


def short_exponent(value: float) -> str:
    """1.2345E-3, in ten columns, as SMC writes."""
    return f"{value:10.4E}".replace("E-0", "E-").replace("E+0", "E+").rjust(10)


LAYOUTS = {
    one.name: one
    for one in (
        Layout("at2", at2_head, fixed(10, 3), 8, G),
        Layout("at2, touching", at2_head, lambda value: f"{value:.4E}".rjust(11), 5, G, decimals=4),
        Layout("at2, begin data", begin_head, fixed(10, 3), 8, G),
        Layout("csmip", csmip_head, fixed(10, 3), 8, 0.01, tail=csmip_tail(), fixed=True),
        Layout(
            "cosmos",
            cosmos_head,
            fixed(10, 5),
            8,
            0.01,
            tail="End-of-data for Chan  1 acceleration\n",
            fixed=True,
        ),
        Layout("smc", smc_head, short_exponent, 8, 0.01, fixed=True),
        Layout(
            "knet",
            knet_head,
            lambda value: f"{round(1000.0 * value):8d} ",
            8,
            0.01 * 3920.0 / 6182761.0,
            decimals=0,
        ),
        Layout("esm", esm_head, lambda value: f"{value:.6f}", 1, 0.01),
        Layout(
            "afad", afad_head, fixed(13, 6), 3, 0.01, components=3, column=1, options={"channel": 2}
        ),
        Layout(
            "geonet",
            lambda n: geonet_head(n, after=False),
            fixed(8, 1),
            10,
            0.001,
            decimals=1,
            fixed=True,
        ),
        Layout(
            "renadic",
            volume1_head,
            fixed(7, 3),
            10,
            0.1 * G,
            timed=True,
            fixed=True,
            tail="/&  --- END OF DATA ---\n",
            time=fixed(7, 3),
        ),
        Layout(
            "bhrc",
            bhrc_head,
            lambda value: f"{value:13.6E}",
            10,
            0.1 * G,
            decimals=6,
            tail="/&\n",
            fixed=True,
        ),
        Layout(
            "unam",
            unam_head,
            fixed(10, 3),
            3,
            0.01,
            components=3,
            column=1,
            options={"channel": "N00E"},
            fixed=True,
        ),
        Layout(
            "cwa",
            cwa_head,
            fixed(10, 3),
            4,
            0.01,
            components=3,
            column=2,
            timed=True,
            time=fixed(10, 3),
            options={"channel": "E"},
            fixed=True,
        ),
        Layout(
            "columns",
            lambda n: "# a title\n",
            lambda value: f" {value:.4f}",
            2,
            0.01,
            timed=True,
            counted=False,
            components=1,
            options={"units": "gal"},
        ),
        Layout(
            "three columns",
            lambda n: "Time [s],North [g],East [g]\n",
            lambda value: f",{value:.4f}",
            3,
            G,
            timed=True,
            counted=False,
            components=2,
            column=1,
            options={"channel": "east"},
        ),
        Layout(
            "eqsig",
            lambda n: f"label\n{n} 0.0200\n",
            lambda value: f"{value:.6f}",
            1,
            G,
            options={"units": "g"},
        ),
        Layout(
            "heading",
            lambda n: (
                f"Time Increment (s) : 0.02\nNumber of Data : {n}\nAccelaration time series in "
                "m/s/s\n"
            ),
            lambda value: f" {value:.5f}",
            5,
            1.0,
        ),
        Layout(
            "path",
            lambda n: "",
            lambda value: f"{value:.5f}",
            1,
            0.01,
            counted=False,
            options={"units": "gal", "dt": STEP},
        ),
        Layout(
            "path in rows",
            lambda n: "",
            fixed(12, 5),
            4,
            0.01,
            counted=False,
            options={"units": "gal", "dt": STEP},
        ),
    )
}
