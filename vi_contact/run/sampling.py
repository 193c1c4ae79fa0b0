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
    """Return a sentence when the time step [s] is too long for what acts.

    This is an excitation, a load or a motion of the problem whose frequency, period or samples are
    known. It is None when it is not, or nothing is known.
    """
    for source in _sources(problem):
        for sentence in _sentences(source, dt):
            return sentence
    return None


def _sources(problem: ContactProblem) -> Iterator[Any]:
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


def _sentences(source: Any, dt: float, depth: int = DEEP) -> Iterator[str]:
    """Yield sentences about a source, or about the motions that it holds.

    Args:
        source: an excitation, a load, a motion, or what has one in it.
        dt: the time step [s].
        depth: how far is looked into it.
    """
    if source is None or depth == 0:
        return
    name = type(source).__name__
    spacing = _spacing(source)
    if spacing is not None:
        yield from _judge_samples(spacing, dt)
    elif isinstance(source, Tabulated):
        spacing = float(np.median(np.diff(source.times)))
        if dt > spacing * (1.0 + ROUNDED):
            yield (
                f"the time step of {dt:g} s is longer than the {spacing:g} s between the times of "
                f"{name}, whose peaks fall between the steps: take a dt of at most {spacing:g} s"
            )
    elif isinstance(source, HalfSine | FullSine | Rectangular):
        period = source.duration * {HalfSine: 2.0, FullSine: 1.0}.get(type(source), FEWEST)
        yield from _judge_period(f"{name} of {source.duration:g} s", period, dt)
    elif (frequency := _frequency(source)) is not None:
        yield from _judge_period(f"{name} of {frequency:g} Hz", 1.0 / frequency, dt)
    else:
        for held in _held(source):
            yield from _sentences(held, dt, depth - 1)


def _spacing(source: Any) -> float | None:
    """Return the distance [s] of the samples of a record, which holds them as ``acceleration``."""
    is_record = isinstance(getattr(source, "acceleration", None), np.ndarray)
    return getattr(source, "dt", None) if is_record else None


def _frequency(source: Any) -> float | None:
    """Return the frequency [Hz] that a motion, of the user's too, says that it has."""
    value: Any = getattr(source, "frequency", None)
    known = isinstance(value, int | float | np.number) and not isinstance(value, bool)
    return float(value) if known and 0.0 < float(value) < np.inf else None


def _held(source: Any) -> Iterator[Any]:
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


def _judge_period(what: str, period: float, dt: float) -> Iterator[str]:
    """Yield a sentence about a sine, or a part of one, with too few steps in its period.

    Args:
        what: it is, in words.
        period: of the sine [s].
        dt: the time step [s].
    """
    if dt <= period / FEWEST * (1.0 + ROUNDED):
        return
    halves = 2.0 * dt / period
    blind = round(halves) >= 1 and abs(halves - round(halves)) <= ROUNDED * halves
    why = (
        f"is {round(halves)} times half the period of {what}, {0.5 * period:g} s, so that every "
        "step sees the same value, or zero"
        if blind
        else f"has only {period / dt:.3g} steps in the period of {period:g} s of {what}"
    )
    yield (
        f"the time step of {dt:g} s {why}: take a dt of at most {period / 20.0:g} s, "
        "a twentieth of the period"
    )
