"""Options that the commands of several models share."""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..core.checks import counted, shown
from ..core.errors import InputError

SHAKING = ("motion", "vertical", "units", "scale", "pga", "resample")
STEP = ("solver", "scheme", "dt", "steps", "cross_check")
MOST_SPACED = 100_000  # periods or frequencies of a spectrum
OUTPUT = ("fields_every", "restart", "changed")
PICTURES = (".png", ".pdf", ".svg")


def add_shaking(parser: argparse.ArgumentParser, *, harmonic: str) -> Any:
    """The group of options for the ground motion; ``harmonic``: amplitude of the motion without a record."""
    parser.set_defaults(spelling={"units": "--units"})
    shake = parser.add_argument_group("ground motion")
    shake.add_argument("--motion", metavar="FILE", help="horizontal record: PEER AT2, USGS SMC or two columns")
    shake.add_argument("--vertical", metavar="FILE", help="vertical record, beside --motion")
    shake.add_argument("--units", help="units of two-column files: m/s2, cm/s2, gal, g, ...")
    shake.add_argument(
        "--scale", type=float, help=f"factor on the record, or on the harmonic's {harmonic}; not beside --pga"
    )
    shake.add_argument("--pga", type=float, metavar="A", help="scale both to this peak [m/s2] of the first")
    shake.add_argument("--resample", type=float, metavar="DT", help="resample to this step [s], band-limited")
    return shake


def add_step(parser: argparse.ArgumentParser, *, dt: str) -> Any:
    """The group of options for the step; ``dt``: what it is by default."""
    step = parser.add_argument_group("step")
    step.add_argument(
        "--solver", default="condensed",
        help="condensed (default), hildreth, projected-cg, volume, volume-reference, semismooth, tron"
    )
    step.add_argument(
        "--scheme", default="zwt",
        help="zwt: the source's (default); trapezoidal: does not ring; newmark, hht, generalised-alpha, houbolt, "
        "contact-stabilised, kane, moreau-jean, midpoint, ss22, newmark-consistent",
    )
    step.add_argument(
        "--impact", help="inelastic, elastic, none or a restitution in [0, 1]; default inelastic with zwt and ss22, "
        "none with schemes that need no impact law",
    )
    step.add_argument("--dt", type=float, help=f"time step [s] (default {dt})")
    step.add_argument("--steps", type=int, help="number of steps (default 400, or the whole record)")
    step.add_argument("--cross-check", action="store_true", help="solve every step by the other route too and compare")
    return step


def add_output(parser: argparse.ArgumentParser, *, out: str) -> Any:
    """The group of options for the run folder, by default ``out``."""
    output = parser.add_argument_group("output")
    output.add_argument("--out", default=out, metavar="DIR", help=f"output folder (default {out})")
    output.add_argument("--fields-every", type=int, default=10, metavar="K", help="steps between frames, 0: none")
    add_restart(output, "--out")
    output.add_argument("--quiet", action="store_true", help="no progress line")
    return output


def add_restart(options: Any, where: str) -> None:
    """The options that continue a run."""
    options.add_argument("--restart", action="store_true", help=f"continue the run in {where} from its checkpoint")
    options.add_argument("--restart-changed", action="store_true", dest="changed",
                         help="the same, also when the problem is another one than that of the checkpoint")


def chosen(options: argparse.Namespace) -> dict[str, Any]:
    """The shared options by the names of the runs' own arguments, but for the impact law."""
    if options.scale is not None and options.pga is not None:
        raise InputError("--scale and --pga both scale the motion: give one of them")
    if options.steps is not None and options.steps < 1:
        raise InputError(f"--steps {options.steps}: give at least one step")
    found = {name: getattr(options, name) for name in (*SHAKING, *STEP, *OUTPUT)}
    scale = 1.0 if options.scale is None else options.scale
    return found | {"scale": scale, "restart": options.restart or options.changed}


def spaced(option: str, values: Sequence[float]) -> Any:
    """FROM, TO, N of an option as N logarithmically spaced numbers; InputError for others, before memory is taken."""
    import numpy as np

    first, last, count = values
    if not (0.0 < first < last < math.inf and 2 <= count < math.inf and count == int(count)):
        raise InputError(f"{option} {first:g} {last:g} {count:g}: give FROM below TO and a whole number N from 2 on")
    return np.geomspace(first, last, counted(option, f"N = {count:g}", count, "numbers", most=MOST_SPACED))


def output_file(
    path: str | Path, *, reads: Iterable[str | Path] = (), picture: bool = False, made: bool = False
) -> Path:
    """The file that a command is about to write, checked before any work is done.

    reads: files of its input, which it must not overwrite; picture: whether its name says the format of a picture;
    made: whether the command makes a folder that does not exist.
    InputError for a folder, a file in no folder, one of ``reads``, or a name without the ending of a picture.
    """
    out = Path(path)
    try:
        with suppress(FileNotFoundError):
            out.stat()  # is_dir alone hides from Python 3.14 on what OSError says
        fits = (out.parent.is_dir() or (made and not out.parent.exists())) and not out.is_dir()
    except (OSError, ValueError):  # a name that is too long or holds NUL, a folder that may not be looked into
        fits = False
    if not fits:
        raise InputError(f"{shown(str(path))}: cannot be written; give the name of a file in a folder that exists")
    if picture and out.suffix.lower() not in PICTURES:
        raise InputError(f"{out}: a picture ends in {', '.join(PICTURES[:-1])} or {PICTURES[-1]}; give it such a name")
    if out.exists() and any(Path(one).exists() and out.samefile(one) for one in reads):
        raise InputError(f"{out} is read by this command, which would overwrite it: give another name for the output")
    return out


def table_beside_picture(path: str | Path, *, reads: Iterable[str | Path] = ()) -> Path:
    """The table that a command is about to write, with a picture of the same name beside it. InputError as above."""
    out = output_file(path, reads=reads)
    if out.suffix.lower() in PICTURES:
        raise InputError(f"{out}: the table would be overwritten by its picture; give a name such as {out.stem}.csv")
    output_file(out.with_suffix(PICTURES[0]))
    return out


def impact_law(name: str | None, projection: bool) -> Any:
    """The impact law of --impact, read as an M-orthogonal impulse or as a reset; None for the run's own choice."""
    from ..laws.impact import ComponentReset, Elastic, Inelastic, MassProjection, Newton, NoImpact

    if name is None and not projection:
        return None
    reading: Any = MassProjection() if projection else ComponentReset()
    if name is None:
        return Inelastic(reading)
    if name == "none":
        return NoImpact()
    if name in ("inelastic", "elastic"):
        return Inelastic(reading) if name == "inelastic" else Elastic(reading)
    try:
        return Newton(float(name), reading)
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        known = "inelastic, elastic, none or a restitution in [0, 1]"
        raise InputError(f"unknown impact law '{name}': give {known}") from None
