"""Say when time steps are too long for what acts.

A motion or a load that changes between the steps is not seen.

A sine of frequency f is zero at every step if dt is a multiple of half its period 1/(2 f), whatever
its amplitude; with fewer than ``FEWEST`` steps in a period the steps miss its peaks. The same holds
for pulses, by the sine that they are cut from, and for records and tables, by the distance of their
samples.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ..core.problem import ContactProblem
from ..laws.excitation import FullSine, HalfSine, Rectangular, Tabulated

# CHOSEN: steps in a period; a sine at its zeros and peaks still has its largest value at a step
FEWEST = 4.0
ROUNDED = 1e-6  # of a time step: round-off of its quotient with a period
# attributes by which objects hold motions: of laws and loads here, of records, of bound methods
# (__self__), functools.wraps (__wrapped__) and functools.partial (func)
PARTS = (
    "excitation",
    "excitations",
    "motion",
    "given",
    "path",
    "record",
    "__self__",
    "__wrapped__",
    "func",
    "base",
)
DEEP = 5  # how far a motion is looked for in what holds it


def sampling_warning(problem: ContactProblem, dt: float) -> str | None:
    """Return a sentence about the first motion or load for which the time step is too long.

    Judged are excitations, loads and motions whose frequency, period or samples are known.

    Args:
        problem: on which they act.
        dt: the longest time step [s].

    Returns:
        The sentence; None where the step is short enough, or nothing is known.
    """
    for source in _list_sources(problem):
        for sentence in _judge(source, dt):
            return sentence
    return None


def _list_sources(problem: ContactProblem) -> Iterator[Any]:
    """Yield everything that acts as a function of the time.

    First come excitations, then loads, prescribed and moving parts.
    """
    yield from problem.excitations
    system = problem.system
    surface = problem.surface
    for _, history in system.load.separable:
        yield history
    yield from (*system.load.general, *system.load.viscous, *system.load.inertial)
    for condition in getattr(system.space, "prescribed", ()):
        yield from getattr(condition, "motions", ())
    yield from getattr(getattr(system.space, "forms", None), "boundaries", ())
    yield from (surface.motion, surface.slide)


def _judge(source: Any, dt: float, depth: int = DEEP) -> Iterator[str]:
    """Yield sentences about a source, or about the motions that it holds.

    Args:
        source: an excitation, a load, a motion, or what has one in it.
        dt: the time step [s].
        depth: how far is looked into it.
    """
    if source is None or depth == 0:
        return
    name = type(source).__name__
    spacing = _read_spacing(source)
    frequency = _read_frequency(source)
    if spacing is not None:
        yield from _judge_samples(spacing, dt)
    elif isinstance(source, Tabulated):
        yield from _judge_table(source, dt)
    elif isinstance(source, HalfSine | FullSine | Rectangular):
        # The period of the sine that the pulse is cut from; a rectangle, which is cut from none,
        # may not be shorter than a step.
        period = source.duration * {HalfSine: 2.0, FullSine: 1.0}.get(type(source), FEWEST)
        yield from _judge_period(f"{name} of {source.duration:g} s", period, dt)
    elif frequency is not None:
        yield from _judge_period(f"{name} of {frequency:g} Hz", 1.0 / frequency, dt)
    else:
        for part in _look_inside(source):
            yield from _judge(part, dt, depth - 1)


def _read_spacing(source: Any) -> float | None:
    """Return the distance [s] of the samples of a record, which holds them as ``acceleration``."""
    is_record = isinstance(getattr(source, "acceleration", None), np.ndarray)
    return getattr(source, "dt", None) if is_record else None


def _read_frequency(source: Any) -> float | None:
    """Return the frequency [Hz] that a motion, of the user's too, says that it has."""
    value: Any = getattr(source, "frequency", None)
    known = isinstance(value, int | float | np.number) and not isinstance(value, bool)
    return float(value) if known and 0.0 < float(value) < np.inf else None


def _look_inside(source: Any) -> Iterator[Any]:
    """Yield what a function or an object may have its motion from.

    It is its owner, a part of it, or what it closes over.
    """
    for name in PARTS:
        yield from _members(getattr(source, name, None))
    for cell in getattr(source, "__closure__", None) or ():
        try:
            content = cell.cell_contents
        except ValueError:  # not yet filled
            continue
        for member in _members(content):
            if callable(getattr(member, "value", None)):  # of a load
                yield member.value
            elif callable(member) or hasattr(member, "acceleration"):
                yield member


def _members(value: Any) -> Sequence[Any]:
    """Return the members of a list or tuple; anything else is its only one."""
    return value if isinstance(value, list | tuple) else (value,)


def _judge_samples(spacing: float, dt: float) -> Iterator[str]:
    """Yield a sentence about a record whose samples [s] are nearer to each other than dt [s]."""
    if dt > spacing * (1.0 + ROUNDED):
        yield (
            f"the time step of {dt:g} s is longer than the {spacing:g} s of the record, whose "
            "peaks fall between the steps: take a shorter dt, or give resampled(record, dt), which "
            "filters out frequencies that dt cannot represent"
        )


def _judge_table(table: Tabulated, dt: float) -> Iterator[str]:
    """Yield a sentence about a table whose times are, as a rule, nearer to each other than dt [s].

    Their distance is the median: a table may begin and end with long pauses.
    """
    spacing = float(np.median(np.diff(table.times)))
    if dt > spacing * (1.0 + ROUNDED):
        yield (
            f"the time step of {dt:g} s is longer than the {spacing:g} s between the times of "
            f"{type(table).__name__}, whose peaks fall between the steps: take a dt of at most "
            f"{spacing:g} s"
        )


def _judge_period(source: str, period: float, dt: float) -> Iterator[str]:
    """Yield a sentence about a sine, or a part of one, with too few steps in its period.

    Args:
        source: it, in words.
        period: of the sine [s].
        dt: the time step [s].
    """
    if dt <= period / FEWEST * (1.0 + ROUNDED):
        return
    why = f"has only {period / dt:.3g} steps in the period of {period:g} s of {source}"
    halves = 2.0 * dt / period
    whole = round(halves)
    if whole >= 1 and abs(halves - whole) <= ROUNDED * halves:
        why = (
            f"is {whole} times half the period of {source}, {0.5 * period:g} s, so that every step "
            "sees the same value, or zero"
        )
    yield (
        f"the time step of {dt:g} s {why}: take a dt of at most {period / 20.0:g} s, "
        "a twentieth of the period"
    )
