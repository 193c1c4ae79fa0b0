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
from ...core.collective import together
from ...core.joints import pose_joint
from ...core.matrix_checks import probe
from ...core.problem import ContactProblem, replace_tuples
from ...core.state_checks import describe_frames
from ...core.step import Scheme, State
from ...core.surfaces import ContactSurface
from ...core.system import SemiDiscreteSystem, evaluate_history
from ..time_steps import TimeSteps, describe_plan, list_pieces

ROUND_OFF = 1e-6  # of coordinates: SAME of it is a hundred times the last digit of a gap
# relative difference of numbers that count as equal: above round-off, below what anybody means to
# change
SAME = 1e-8
PROBES = 2  # vectors w
SAMPLES = 256  # times of functions of time alone, all over the run
EARLY = 5  # times of other loads, which may have to be marched to: in the first steps
STEPS = 32  # how many steps are the first ones
FRAMES = "frames"
FIXED = ("unknowns", "contact points", FRAMES)  # what a restart can by no means change
STRETCH = 0.02  # by which the internal force of a body that is not linear is looked at
SHOWN = 300  # characters of a law in a sentence
SPEEDS = (0.0, 1e-3, 1e-1, 10.0)  # slip rates [m/s] at which friction is looked at
_NUMBER = re.compile(r"(\d[\d.]*(?:[eE][-+]?\d+)?)")
_ADDRESS = re.compile(r" at 0x[0-9a-f]+")
_NUMPY = re.compile(r"\bnp\.\w+\(([^()]*)\)")  # as numpy 2 writes its numbers

Numbers = list[tuple[float, float]]  # values and their sizes
Identity = dict[str, Any]


def identify(
    problem: ContactProblem, scheme: Scheme, dt: TimeSteps, *, start: float, end: float
) -> Identity:
    """Return name -> number, text or numbers with sizes, of all ranks. Collective.

    Args:
        problem: what is marched.
        scheme: by which.
        dt: its time steps [s].
        start: the time [s] from which histories count.
        end: the time [s] up to which they count.
    """
    system = problem.system
    surface = problem.surface

    # Vectors w made of the numbers of the unknowns, through which matrices and loads are seen.
    probes = [probe(np.asarray(system.space.ids), number) for number in range(PROBES)]
    pairs = [(w, w) for w in probes]
    if not system.algebra.symmetric:  # wᵀCw does not see the skew part of C
        pairs.append((probes[0], probes[1]))

    # Times: of loads that may have to be marched to in the first steps only, of histories all over
    # the run, one in each SAMPLES-th of it, at unequal distances.
    first = min(end - start, STEPS * min(list_pieces(dt))[0])
    early = [start + first * i / EARLY for i in range(EARLY + 1)]
    places = np.arange(SAMPLES)
    times = start + (end - start) * (places + probe(places, 0) + 0.5) / SAMPLES
    friction = replace_tuples(problem.friction, surface, partial(_gather_values, surface))
    return {
        "unknowns": system.space.unknowns,
        "contact points": surface.total,
        FRAMES: describe_frames(turned=surface.turned),
        "dt": describe_plan(dt),
        "scheme": write_as_text(scheme),
        "mass": write_as_text(problem.mass),
        "impact law": write_as_text(problem.impact),
        "friction law": write_as_text(friction),
        **_describe_joint(problem),
        "stiffness": [_multiply(system, w, system.K @ x) for w, x in pairs],
        "internal force": _describe_internal(system, probes[0]),
        "mass matrix": [_multiply(system, w, system.M @ x) for w, x in pairs],
        "damping": []
        if system.C is None
        else [_multiply(system, w, system.C @ x) for w, x in pairs],
        "geometry": [_multiply(system, probes[0], x) for x in system.space.coordinates.T],
        "load": _describe_loads(system, probes, early, times),
        "excitation": _describe_excitation(problem, times),
        "contact surface or obstacle": _describe_contact(surface, early),
        "friction": _describe_friction(problem),
    }


def write_as_text(value: Any) -> str:
    """Return the repr of a law without addresses.

    What releases of numpy write differently is left out too.
    """
    return _NUMPY.sub(r"\1", _ADDRESS.sub("", repr(value)))


def find_differences(ours: Identity, theirs: Mapping[str, Any]) -> dict[str, str]:
    """Return name -> how, of the facts of theirs that are others in ours."""
    changes: dict[str, str] = {}
    for name, our in ours.items():
        if name == FRAMES and name not in theirs:
            continue  # a checkpoint written before this was told
        their = theirs.get(name)
        if isinstance(our, list):
            if not _agree_in_numbers(our, their):
                changes[name] = f"another {name}"
        elif not _agree_in_text(str(our), str(their)):
            changes[name] = f"{name} = {str(their)[:SHOWN]} but this one has {str(our)[:SHOWN]}"
    return changes


def _agree_in_numbers(ours: Numbers, theirs: Any) -> bool:
    """Say whether values differ by at most SAME of their sizes."""
    try:
        our = np.array(ours, dtype=float).reshape(-1, 2)
        their = np.array(theirs, dtype=float).reshape(-1, 2)
    except (TypeError, ValueError):
        return False
    if our.shape != their.shape:
        return False
    size = np.maximum(np.abs(our[:, 1:]), np.abs(their[:, 1:]))
    return bool(np.all(np.abs(our - their) <= SAME * size))


def _agree_in_text(ours: str, theirs: str) -> bool:
    """Say whether words are the same, and numbers between them to SAME."""
    # words and numbers in turn
    our = _NUMBER.split(ours)
    their = _NUMBER.split(theirs)
    if len(our) != len(their) or our[::2] != their[::2]:
        return False
    numbers = zip(our[1::2], their[1::2], strict=True)
    try:
        return all(a == b or isclose(float(a), float(b), rel_tol=SAME) for a, b in numbers)
    except ValueError:
        return False


def _multiply(system: SemiDiscreteSystem, w: Array, x: Array) -> tuple[float, float]:
    """Return w·x of vectors (n,) and |w| |x|, the size of it. Collective."""
    dot = system.algebra.dot
    return dot(w, x), float(np.sqrt(dot(w, w) * dot(x, x)))


def _describe_internal(system: SemiDiscreteSystem, w: Array) -> Numbers:
    """Return w·p(u) and W(u) of a uniform stretch u; nothing of a linear body. Collective.

    Args:
        system: whose internal force it is.
        w: a probe (n,).
    """
    if system.internal is None:
        return []
    u = STRETCH * np.sum(system.influence * system.space.coordinates, axis=1)
    energy = system.internal.energy(u)
    return [_multiply(system, w, system.internal.force(u)), (energy, abs(energy))]


def _describe_loads(
    system: SemiDiscreteSystem, probes: Sequence[Array], early: Sequence[float], times: Array
) -> Numbers:
    """Return the load in the first steps, and the histories of its separable parts. Collective.

    Args:
        system: whose load it is.
        probes: vectors w (n,).
        early: times [s] in the first steps.
        times: [s] all over the run (SAMPLES,).
    """
    forces = [system.load(t) for t in early]
    size = max(float(np.sqrt(system.algebra.dot(f, f))) for f in forces)
    length = float(np.sqrt(system.algebra.dot(probes[0], probes[0])))
    numbers = [(system.algebra.dot(w, f), size * length) for f in forces for w in probes]
    for vector, history in system.load.separable:
        values = np.array([float(evaluate_history(history, t)) for t in times])
        numbers += [_multiply(system, probes[0], vector), *_sum_row(values)]
    return numbers


def _sum_row(values: Array) -> Numbers:
    """Return sums of a row of numbers, with weights that see each of them."""
    *sums, size = _sum_weighted(values, np.arange(len(values)))
    return [(value, size) for value in sums]


def _sum_weighted(values: Array, places: Indices) -> list[float]:
    """Return three sums of numbers with weights of their places, and that of their sizes."""
    values = np.ascontiguousarray(values, dtype=float)
    weights = (np.ones(len(values)), probe(places, 1), probe(places, 2))
    return [*(float(w @ values) for w in weights), float(np.abs(values).sum())]


def _describe_excitation(problem: ContactProblem, times: Array) -> Numbers:
    """Return the ground's accelerations at the times, and all numbers of the excitations."""
    if not problem.excitations:
        return []
    ground = np.array([problem.ground_acceleration(float(t)) for t in times])
    columns = list(ground.T)
    for excitation in problem.excitations:
        columns.append(np.array(list(_list_numbers(excitation))))
    return [pair for column in columns for pair in _sum_row(column)]


def _list_numbers(value: Any) -> Iterator[float]:
    """Return all numbers of a value object.

    These are every sample of a record, also those between the times that are looked at.
    """
    if is_dataclass(value):
        for field in fields(value):
            yield from _list_numbers(getattr(value, field.name))
    elif isinstance(value, np.ndarray | tuple | list):
        array = np.asarray(value)
        if array.dtype.kind in "if":
            yield from array[np.isfinite(array)].tolist()
    elif isinstance(value, int | float) and np.isfinite(value):
        yield float(value)


def _describe_contact(surface: ContactSurface, early: Sequence[float]) -> Numbers:
    """Return where contact points are, and what they may touch, at rest and as it moves."""
    arrays = [
        *surface.points.T,
        *surface.normals.T,
        surface.weights,
        surface.gap0,
        surface.compliance,
        surface.bilateral.astype(float),
    ]
    if surface.motion is not None:
        arrays += [surface.gap(t) for t in early]
    if surface.slide is not None:
        arrays += [column for t in early for column in surface.slide(t).T]
    numbers = _sum_columns(surface, arrays)

    # Gaps are differences of points, whose round-off they have: their size is at least that. They
    # are the gap at rest, and all that moves; each array gives three numbers.
    d = surface.points.shape[1]
    round_off = ROUND_OFF * max(size for _, size in numbers[: 3 * d])
    gaps = {2 * d + 1, *range(2 * d + 4, len(arrays))}
    sized = []
    for i, (value, size) in enumerate(numbers):
        sized.append((value, max(size, round_off) if i // 3 in gaps else size))
    return sized


def _sum_columns(surface: ContactSurface, arrays: Sequence[Array]) -> Numbers:
    """Return sums of values (m,) of the contact conditions of all ranks. Collective."""
    sums = surface.comm.sum(np.array([_sum_weighted(values, surface.slots) for values in arrays]))
    return [(value, size) for *values, size in sums.tolist() for value in values]


def _gather_values(surface: ContactSurface, values: tuple[Any, ...]) -> tuple[Any, ...]:
    """Return the values of all contact points in place of this rank's."""
    parts = from_each(surface.comm, (surface.slots.tolist(), values))
    if any(len(slots) != len(values) for slots, values in parts):
        return values
    numbered = [pair for slots, values in parts for pair in zip(slots, values, strict=True)]
    return tuple(value for _, value in sorted(numbered, key=lambda pair: pair[0]))


def _describe_joint(problem: ContactProblem) -> Identity:
    """Return the law of a joint as text, and its values by point; nothing without one. Collective.

    The text does not tell the values of functions and of long arrays.
    """
    surface = problem.surface
    law: Any = problem.joint
    if law is None:
        return {}
    text = write_as_text(replace_tuples(law, surface, partial(_gather_values, surface)))
    columns: list[Array] = []
    with together(surface.comm):  # the law may be the user's
        # Forces of closed points that nothing has happened to. A law of slip rates has none at
        # rest; the values of its functions are in its text.
        if not hasattr(law, "at_speed"):
            none = np.zeros(problem.system.rows)
            closed = np.ones(surface.count, dtype=bool)
            start = State(0.0, 0, none, none, np.zeros(surface.count), closed)
            joint = pose_joint(problem, start, 0.0)
            columns += joint.ask(np.zeros(surface.count), np.zeros(joint.s0.shape))
        # They do not tell what else a part loses its strength over.
        if hasattr(law, "list_values"):
            columns += law.list_values(surface)
    return {"joint": text, "strength of the joint": _sum_columns(surface, columns)}


def _describe_friction(problem: ContactProblem) -> Numbers:
    """Return the largest tangential reactions under a pressure, and their slopes.

    They are those at several slip rates.
    """
    law = problem.friction
    weights = problem.surface.weights
    rates = [law.at(np.full(len(weights), speed)).slope(weights) for speed in SPEEDS]
    return _sum_columns(problem.surface, [law.limit(weights, weights, 1.0), *rates])
