"""Tell what makes two runs runs of the same problem.

It is told in few numbers that any ranks, machine or release give alike.

Matrices and loads are seen through vectors w made of the numbers of the unknowns: wᵀMw, wᵀKw, wᵀCw,
w·f(t), and vᵀCw of two where a matrix may be skew. Such numbers depend neither on the ranks nor on
their order, and round-off changes them in the last digits only; they are kept with their sizes and
compared relative to these. Laws and schemes are texts, with numbers compared likewise.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from functools import partial
from math import isclose
from typing import Any

import numpy as np

from ...core.algebra import Array, Indices, from_each
from ...core.matrix_checks import probe
from ...core.problem import ContactProblem, with_values
from ...core.step import Scheme
from ...core.surfaces import ContactSurface
from ...core.system import SemiDiscreteSystem, history_value
from ..time_steps import TimeSteps, number_or_words, pieces_of

ROUND_OFF = 1e-6  # of coordinates: SAME of it is a hundred times the last digit of a gap
# relative difference of numbers that count as equal: above round-off, below what anybody means to
# change
SAME = 1e-8
PROBES = 2  # vectors w
SAMPLES = 256  # times of functions of time alone, all over the run
EARLY = 5  # times of other loads, which may have to be marched to: in the first steps
STEPS = 32  # how many steps are the first ones
FIXED = ("unknowns", "contact points")  # what a restart can by no means change
SHOWN = 300  # characters of a law in a sentence
SPEEDS = (0.0, 1e-3, 1e-1, 10.0)  # slip rates [m/s] at which friction is looked at
_NUMBER = re.compile(r"(\d[\d.]*(?:[eE][-+]?\d+)?)")
_ADDRESS = re.compile(r" at 0x[0-9a-f]+")
_NUMPY = re.compile(r"\bnp\.\w+\(([^()]*)\)")  # as numpy 2 writes its numbers

Numbers = list[tuple[float, float]]  # values and their sizes
Identity = dict[str, Any]


def identity(
    problem: ContactProblem, scheme: Scheme, dt: TimeSteps, *, start: float, end: float
) -> Identity:
    """Return name -> number, text or numbers with sizes, of all ranks. Collective.

    Histories are those from ``start`` to ``end`` [s].
    """
    system, surface = problem.system, problem.surface
    probes = [probe(np.asarray(system.space.ids), j) for j in range(PROBES)]
    pairs = [(w, w) for w in probes] + (
        [] if system.algebra.symmetric else [(probes[0], probes[1])]
    )
    first = min(end - start, STEPS * min(pieces_of(dt))[0])
    early = [start + first * i / EARLY for i in range(EARLY + 1)]
    times = (
        start + (end - start) * (np.arange(SAMPLES) + probe(np.arange(SAMPLES), 0) + 0.5) / SAMPLES
    )
    return {
        "unknowns": system.space.unknowns,
        "contact points": surface.total,
        "dt": number_or_words(dt),
        "scheme": text_of(scheme),
        "mass": text_of(problem.mass),
        "impact law": text_of(problem.impact),
        "friction law": text_of(
            with_values(problem.friction, surface, partial(_of_all_points, surface))
        ),
        "stiffness": [_dot(system, w, system.K @ x) for w, x in pairs],
        "mass matrix": [_dot(system, w, system.M @ x) for w, x in pairs],
        "damping": [] if system.C is None else [_dot(system, w, system.C @ x) for w, x in pairs],
        "geometry": [_dot(system, probes[0], x) for x in system.space.coordinates.T],
        "load": _loads(system, probes, early, times),
        "excitation": _excitation(problem, times),
        "contact surface or obstacle": _contact(surface, early),
        "friction": _friction(problem),
    }


def text_of(value: Any) -> str:
    """Return the repr of a law without addresses.

    What releases of numpy write differently is left out too.
    """
    return _NUMPY.sub(r"\1", _ADDRESS.sub("", repr(value)))


def differences(ours: Identity, theirs: Mapping[str, Any]) -> dict[str, str]:
    """Return name -> how, of the facts of theirs that are others in ours."""
    found: dict[str, str] = {}
    for name, own in ours.items():
        other = theirs.get(name)
        if isinstance(own, list):
            found |= {} if _same_numbers(own, other) else {name: f"another {name}"}
        elif not _same_text(str(own), str(other)):
            found[name] = f"{name} = {str(other)[:SHOWN]} but this one has {str(own)[:SHOWN]}"
    return found


def _same_numbers(own: Numbers, other: Any) -> bool:
    try:
        one, two = (
            np.array(own, dtype=float).reshape(-1, 2),
            np.array(other, dtype=float).reshape(-1, 2),
        )
    except (TypeError, ValueError):
        return False
    if one.shape != two.shape:
        return False
    return bool(
        np.all(np.abs(one - two) <= SAME * np.maximum(np.abs(one[:, 1:]), np.abs(two[:, 1:])))
    )


def _same_text(own: str, other: str) -> bool:
    """Say whether words are the same, and numbers between them to SAME."""
    one, two = _NUMBER.split(own), _NUMBER.split(other)
    if len(one) != len(two) or one[::2] != two[::2]:
        return False
    numbers = zip(one[1::2], two[1::2], strict=True)
    try:
        return all(a == b or isclose(float(a), float(b), rel_tol=SAME) for a, b in numbers)
    except ValueError:
        return False


def _dot(system: SemiDiscreteSystem, w: Array, x: Array) -> tuple[float, float]:
    """w·x and the size of it."""
    dot = system.algebra.dot
    return dot(w, x), float(np.sqrt(dot(w, w) * dot(x, x)))


def _loads(
    system: SemiDiscreteSystem, probes: Sequence[Array], early: Sequence[float], times: Array
) -> Numbers:
    """Return the load in the first steps and the histories of its separable parts.

    The histories are those through the run.
    """
    forces = [system.load(t) for t in early]
    size = max(float(np.sqrt(system.algebra.dot(f, f))) for f in forces)
    length = float(np.sqrt(system.algebra.dot(probes[0], probes[0])))
    found = [(system.algebra.dot(w, f), size * length) for f in forces for w in probes]
    for vector, history in system.load.separable:
        values = np.array([float(history_value(history, t)) for t in times])
        found += [_dot(system, probes[0], vector), *_sampled(values)]
    return found


def _sampled(values: Array) -> Numbers:
    """Return sums of a row of numbers, with weights that see each of them."""
    *sums, size = _sums(values, np.arange(len(values)))
    return [(value, size) for value in sums]


def _sums(values: Array, places: Indices) -> list[float]:
    """Three sums of numbers with weights of their places, and that of their sizes."""
    values = np.ascontiguousarray(values, dtype=float)
    weights = np.ones(len(values)), probe(places, 1), probe(places, 2)
    return [*(float(w @ values) for w in weights), float(np.abs(values).sum())]


def _excitation(problem: ContactProblem, times: Array) -> Numbers:
    if not problem.excitations:
        return []
    ground = np.array([problem.ground_acceleration(float(t)) for t in times])
    columns = [*ground.T, *(np.array(list(_numbers_in(one))) for one in problem.excitations)]
    return [pair for column in columns for pair in _sampled(column)]


def _numbers_in(value: Any) -> Iterator[float]:
    """Return all numbers of a value object.

    These are every sample of a record, also those between the times that are looked at.
    """
    if is_dataclass(value):
        for one in fields(value):
            yield from _numbers_in(getattr(value, one.name))
    elif isinstance(value, np.ndarray | tuple | list):
        found = np.asarray(value)
        yield from found[np.isfinite(found)].tolist() if found.dtype.kind in "if" else ()
    elif isinstance(value, int | float) and np.isfinite(value):
        yield float(value)


def _contact(surface: ContactSurface, early: Sequence[float]) -> Numbers:
    """Where the contact points are, and what they may touch, at rest and as it moves."""
    arrays = [
        *surface.points.T,
        *surface.normals.T,
        surface.weights,
        surface.gap0,
        surface.compliance,
        surface.bilateral.astype(float),
    ]
    arrays += [] if surface.motion is None else [surface.gap(t) for t in early]
    arrays += (
        [] if surface.slide is None else [column for t in early for column in surface.slide(t).T]
    )
    found, d = _columns(surface, arrays), surface.points.shape[1]
    # of points, which gaps are differences of
    round_off = ROUND_OFF * max(size for _, size in found[: 3 * d])
    gaps = {2 * d + 1, *range(2 * d + 4, len(arrays))}
    return [
        (value, max(size, round_off) if i // 3 in gaps else size)
        for i, (value, size) in enumerate(found)
    ]


def _columns(surface: ContactSurface, arrays: Sequence[Array]) -> Numbers:
    """Return sums of values (m,) of the contact conditions of all ranks. Collective."""
    sums = surface.comm.sum(np.array([_sums(values, surface.slots) for values in arrays]))
    return [(value, size) for *values, size in sums.tolist() for value in values]


def _of_all_points(surface: ContactSurface, values: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return the values of all contact points in place of this rank's."""
    parts = from_each(surface.comm, (surface.slots.tolist(), values))
    if any(len(slots) != len(values) for slots, values in parts):
        return values
    numbered = [pair for slots, values in parts for pair in zip(slots, values, strict=True)]
    return tuple(value for _, value in sorted(numbered, key=lambda pair: pair[0]))


def _friction(problem: ContactProblem) -> Numbers:
    """Return the largest tangential reactions under a pressure, and their slopes.

    They are those at several slip rates.
    """
    law, weights = problem.friction, problem.surface.weights
    rates = [law.at(np.full(len(weights), speed)).slope(weights) for speed in SPEEDS]
    return _columns(problem.surface, [law.limit(weights, weights, 1.0), *rates])
