"""Write and read checkpoints.

They hold the state of a run in numbers that do not depend on the ranks that go on with it.

``checkpoint.npz`` holds these arrays:

- ``u``, ``v`` and vectors of the scheme's memory (``memory_…``), (n of all ranks,), in the order of
  ``space.ids`` (the rotated basis has the same numbers as the system's own);
- ``r_n``, ``active`` and with friction ``r_t``, a row for each condition of all ranks, in the order
  of ``surface.slots``;
- arrays of a joint in the memory (``memory_joint_…``), likewise;
- arrays of cells, which materials that yield remember, (cells of all ranks, …), in the order of the
  numbers of the cells in the mesh file; with the middle of each cell (``cells_…``), which must be
  that of the mesh that goes on;
- other arrays of the memory, which are the same on every rank;
- ``about``, a text in JSON: t, k, the base steps done, what problem it is of (``identify``), the
  checksum of the histories, and the number of the format;
- ``compute_checksum``, of all the others.

It is of the end of a base step, never inside a halved one, so that a restart takes the steps of the
straight run, and always replaced as a whole. Only rank 0 touches the file (``on_root``).
"""

import hashlib
import io
import json
import logging
import math
import os
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy

from ...core.algebra import largest, max_abs
from ...core.checks import array, number, quote, refuse, whole
from ...core.errors import InputError, is_of_machine
from ...core.files import on_root, write_atomically
from ...core.internal import MATERIAL, remembers, select_memory
from ...core.joints import MEMORY as JOINT
from ...core.own_files import is_own, open_to_read
from ...core.problem import ContactProblem
from ...core.state_checks import ON_TRACES, check_sizes
from ...core.step import Scheme, State
from ..time_steps import TimeSteps
from .folder import CHECKPOINT, check_format
from .identity import FIXED, FRAMES, find_differences, identify

log = logging.getLogger(__name__)
Arrays = dict[str, Any]
STATES = 2  # the number of the format of checkpoints, and that of version 0.2
OLD_STATES = 1
MEMORY = "memory_"  # how names of arrays of the scheme's memory begin
MIDDLES = "cells_"  # how names of the middles of cells begin
SAME_PLACE = 1e-9  # of the largest coordinate: how far cells may be from where they were
CONTACT = ("r_n", "active", "r_t")  # arrays of the conditions
LONGEST = 200  # characters of a foreign reason
# what a damaged archive makes the readers of zip, numpy and json raise
DAMAGE = (
    OSError,
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    RuntimeError,
    EOFError,
    ArithmeticError,
    SyntaxError,
    tokenize.TokenError,
    struct.error,
    zlib.error,
    zipfile.BadZipFile,
)


@dataclass(frozen=True)
class RestartPoint:
    """Hold the end of a base step, where a run can be left and continued.

    Attributes:
        state: at this end.
        t_start: the time [s] of the state the whole run began with; ``steps`` and ``t_end`` of a
            restart count from there.
        k_start: the number of this state.
        base: base steps done since then.
        halved: attempts thrown away since then.
    """

    state: State
    t_start: float
    k_start: int
    base: int = 0
    halved: int = 0

    @property
    def number(self) -> int:
        """Return the number of the base step, counted on from the k of the first state."""
        return self.k_start + self.base


def write_checkpoint(
    folder: Path,
    problem: ContactProblem,
    place: RestartPoint,
    *,
    run_of: Mapping[str, Any],
    rows: str = "",
    safe: bool = True,
) -> None:
    """Replace the checkpoint in the folder. Collective.

    Args:
        folder: of the run.
        problem: what is marched.
        place: where it is left.
        run_of: the "run", as ``identify`` sees it over a "span" of times [s].
        rows: checksum of the histories up to here.
        safe: whether these are on the medium, and the checkpoint shall be.

    Raises:
        ViContactError: on all ranks, when the disk refuses it.
    """
    # Rank 0 gets the vectors of all ranks, with the numbers of their unknowns, and whole arrays.
    state = place.state
    vectors, cells, arrays_of_root = _split(problem, state)
    comm = problem.system.algebra.comm
    gathered = comm.gather((problem.system.space.ids, vectors))
    gathered_cells = {name: comm.gather(rows) for name, rows in cells.items()}
    # json keeps floats to the last bit
    about = json.dumps(
        {
            "format": STATES,
            **run_of,
            "rows": rows,
            "vectors": sorted(vectors),
            **({"cells": sorted(cells)} if cells else {}),
            "t": state.t,
            "k": state.k,
            "t_start": place.t_start,
            "k_start": place.k_start,
            "base": place.base,
            "halved": place.halved,
        }
    )

    def write() -> None:
        """Write the file, on rank 0."""
        # Vectors of all ranks, in the order of the numbers of their unknowns: another number of
        # ranks finds its own there.
        parts = gathered or []
        order = np.argsort(np.concatenate([ids for ids, _ in parts]))
        arrays = dict(arrays_of_root)
        for name in vectors:
            arrays[name] = np.concatenate([own[name] for _, own in parts])[order]
        for name, of_ranks in gathered_cells.items():
            columns = zip(*(of_ranks or []), strict=True)
            numbers, rows = (np.concatenate(column) for column in columns)
            arrays[name] = rows[np.argsort(numbers)]
        arrays["about"] = np.array(about)
        buffer = io.BytesIO()
        np.savez(buffer, checksum=np.array(compute_checksum(arrays)), **arrays)
        write_atomically(folder / CHECKPOINT, buffer.getvalue(), safe=safe)

    on_root(problem.system.algebra.comm, write)


def compute_checksum(arrays: Mapping[str, Any]) -> str:
    """Return the checksum of names, types, shapes and values."""
    digest = hashlib.sha256()
    for name, values in sorted(arrays.items()):
        array = np.asarray(values)
        digest.update(f"{name} {array.dtype.str} {array.shape}".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def read_state_checksum(folder: Path) -> str:
    """Return the checksum of the state that the checkpoint in a folder holds."""
    return compute_checksum(_unpack(folder / CHECKPOINT)[1])


def _split(problem: ContactProblem, state: State) -> tuple[Arrays, Arrays, Arrays]:
    """Return the arrays of a state in three kinds. Collective.

    Returns:
        Those with an entry for each unknown of this rank: u, v, vectors of the memory; those with a
        row for each cell of this rank, beside the numbers of these; and those that are whole on
        rank 0: of the contact conditions, and the rest of the memory.
    """
    comm = problem.system.algebra.comm
    vectors: Arrays = {"u": state.u, "v": state.v}
    contact: Arrays = {"r_n": state.r_n, "active": state.active}
    if state.r_t is not None:
        contact["r_t"] = state.r_t
    whole = {name: problem.surface.on_first(values) for name, values in contact.items()}
    cells: Arrays = {}
    internal: Any = problem.system.internal
    for name in select_memory(state.memory):
        numbers = internal.find_cells(name)
        cells[f"{MEMORY}{name}"] = (numbers, np.asarray(state.memory[name]))
        cells[f"{MIDDLES}{_find_group(name)}"] = (numbers, internal.find_middles(name))
    for name in sorted(state.memory):
        if name.startswith(MATERIAL):
            continue
        values = np.asarray(state.memory[name])
        # On one rank alone an array may have as many entries as there are unknowns by chance.
        if name.startswith(JOINT):
            whole[f"{MEMORY}{name}"] = problem.surface.on_first(values)
            continue
        is_whole = largest(comm, values.shape != state.u.shape)
        kind = whole if is_whole else vectors
        kind[f"{MEMORY}{name}"] = values
    return vectors, cells, whole


def _find_group(name: str) -> str:
    """Return how the names of the arrays of the same cells begin: "material_0_sigma" -> "0"."""
    return name.removeprefix(MATERIAL).split("_", 1)[0]


def read_checkpoint(
    folder: Path, problem: ContactProblem, *, scheme: Scheme, dt: TimeSteps, changed: bool = False
) -> tuple[RestartPoint, str]:
    """Return (where a run was left, checksum of its histories). Collective.

    The state is that on the ranks of this run.

    Args:
        folder: of the run that is continued.
        problem: of this run.
        scheme: of this run.
        dt: time steps of this run [s].
        changed: whether problem, dt and scheme may be others: another dt counts steps anew, and
            schemes begin without memory.

    Raises:
        InputError: the checkpoint is missing, damaged, of an unknown format, or of another problem,
            dt (or plan of them) or scheme; or its state is of another law of a joint.
    """
    # Rank 0 reads the file, and all ranks hear what it is of.
    file = folder / CHECKPOINT
    comm = problem.system.algebra.comm
    content = on_root(comm, lambda: _read(file, problem))  # None on the other ranks
    about, whole = (None, None) if content is None else content
    about = comm.bcast(about)
    changes = _compare(file, problem, scheme, dt, about, changed)
    arrays: Arrays = {"r_t": None} | _send_rows(
        problem, about["vectors"], about.get("cells", []), whole
    )

    # What a scheme keeps in mind was made of the matrices and loads of its own problem. What
    # materials remember is a part of the body, as its displacement is.
    memory = {}
    for name, values in arrays.items():
        own = name.removeprefix(MEMORY)
        of_body = own.startswith((JOINT, MATERIAL))
        if name.startswith(MEMORY) and (of_body or not changes):
            memory[own] = values
    _check_cells(file, problem, arrays, memory)
    state = State(
        about["t"],
        about["k"],
        memory=memory,
        turned=problem.surface.turned,
        **{name: arrays[name] for name in ("u", "v", *CONTACT)},
    )
    check_sizes("simulate", problem, state)
    place = RestartPoint(state, about["t_start"], about["k_start"], about["base"], about["halved"])
    if "dt" in changes:  # steps of another length are counted from here
        place = replace(place, t_start=state.t, k_start=place.number, base=0)
    return place, about["rows"]


def _check_cells(
    file: Path, problem: ContactProblem, arrays: Arrays, memory: Mapping[str, Any]
) -> None:
    """Raise InputError, on all ranks, for what materials of this problem cannot go on from.

    Args:
        file: the checkpoint.
        problem: of this run.
        arrays: of the checkpoint, on this rank.
        memory: of the state.
    """
    internal: Any = problem.system.internal
    found = select_memory(memory)
    if not found and not remembers(internal):
        return
    fits = remembers(internal) and internal.fits(found)
    for name in found if fits else ():
        middles = internal.find_middles(name)
        size = max_abs(middles)
        apart = arrays[f"{MIDDLES}{_find_group(name)}"] - middles
        fits = fits and max_abs(apart) <= SAME_PLACE * size
    comm = problem.system.algebra.comm
    defect = (
        f"the checkpoint '{file}' remembers other materials, or cells at other places: restart it "
        "with the same mesh and the same materials that yield"
    )
    refuse([] if fits else [defect], comm)


def _send_rows(
    problem: ContactProblem, vectors: list[str], cells: list[str], whole: Arrays | None
) -> Arrays:
    """Return this rank's rows of arrays that rank 0 has as a whole. Collective.

    They are sent in one message for each rank, so that rank 0 alone holds the whole.

    Args:
        problem: whose unknowns and conditions the ranks have.
        vectors: names of arrays with a row for each unknown.
        cells: names of arrays with a row for each cell of a material.
        whole: all arrays, on rank 0 only; those of CONTACT and of joints have a row for each
            condition, and each rank gets the others as they are.
    """
    comm = problem.system.algebra.comm
    parts = comm.gather((problem.system.space.ids, problem.surface.slots)) or [((), ())] * comm.size
    all_ids = np.sort(np.concatenate([ids for ids, _ in parts]))
    numbers = {name: comm.gather(_find_numbers(problem, name)) for name in cells}
    own: Arrays = {}
    for rank, (ids, slots) in enumerate(parts):
        # Which rows this rank has of each array; ... takes all of those that ranks have alike.
        rows = dict.fromkeys(vectors, np.searchsorted(all_ids, ids))
        rows |= dict.fromkeys(CONTACT, slots)
        of_joints = [name for name in whole or {} if name.startswith(MEMORY + JOINT)]
        rows |= dict.fromkeys(of_joints, slots)
        for name, of_ranks in numbers.items():
            if of_ranks is not None:
                known = np.sort(np.concatenate(of_ranks))
                rows[name] = np.searchsorted(known, of_ranks[rank])
        message = {name: values[rows.get(name, ...)] for name, values in (whole or {}).items()}
        message = comm.bcast(message)
        if rank == comm.rank:
            own = message
    return own


def _find_numbers(problem: ContactProblem, name: str) -> Any:
    """Return the numbers of this rank's cells of an array; none where no material has it."""
    internal: Any = problem.system.internal
    own = name.removeprefix(MEMORY).removeprefix(MIDDLES)
    own = own if own.startswith(MATERIAL) else f"{MATERIAL}{own}_"
    none = np.zeros(0, dtype=np.int64)
    return internal.find_cells(own) if remembers(internal) else none


def _compare(
    file: Path,
    problem: ContactProblem,
    scheme: Scheme,
    dt: TimeSteps,
    about: Mapping[str, Any],
    changed: bool,
) -> list[str]:
    """Return the names of what differs between the checkpoint's run and this one. Collective.

    Args:
        file: the checkpoint.
        problem: of this run.
        scheme: of this run.
        dt: time steps of this run [s].
        about: the description in the checkpoint.
        changed: whether differences are allowed.

    Raises:
        InputError: there are differences that are not allowed, or that cannot be.
    """
    start, end = about["span"]
    changes = find_differences(identify(problem, scheme, dt, start=start, end=end), about["run"])
    for name, how in changes.items():
        if name in FIXED or not changed:
            remedy = "or start a new one"
            if name == FRAMES:
                remedy = f"or {ON_TRACES}"
            elif name not in FIXED:
                remedy = f"{remedy}, or allow it by name (changed=True)"
            raise InputError(
                f"the checkpoint '{file}' is of a run with {how}: restart the same run, {remedy}"
            )
    if changes and problem.system.algebra.comm.rank == 0:
        log.warning(
            "the checkpoint '%s' is continued as another problem: %s", file, ", ".join(changes)
        )
    return list(changes)


def _describe_damage(file: Path, why: Any) -> InputError:
    """Return the error about a checkpoint that cannot be read, with a reason on one line."""
    reason = " ".join(str(why).split())[:LONGEST]  # zipfile puts half the file into its words
    return InputError(f"the checkpoint '{file}' is damaged ({reason}): start a new run")


def _read(file: Path, problem: ContactProblem) -> tuple[dict[str, Any], Arrays]:
    """Return description and whole arrays of a checkpoint that fits the problem in its sizes."""
    if not is_own(file):
        raise InputError(
            f"there is no checkpoint '{file}' to restart from: give the folder of a run"
        )
    try:
        about, arrays = _unpack(file)
    except DAMAGE as error:
        if is_of_machine(error):
            raise
        raise _describe_damage(file, str(error) or type(error).__name__) from error
    _check_states(file, about.get("format"))
    try:
        _check_sizes(problem, about, arrays)
    except KeyError as error:
        raise _describe_damage(file, f"{error} is missing") from error
    except (InputError, TypeError) as error:
        raise _describe_damage(file, error) from error
    return about, arrays


def _check_states(file: Path, number: Any) -> None:
    """Raise InputError for a checkpoint whose states this version cannot go on from.

    Args:
        file: the checkpoint.
        number: of its format.
    """
    if number == OLD_STATES:
        raise InputError(
            f"the checkpoint '{file}' is of version 0.2, whose schemes kept other things in mind: "
            "start a new run; report and plot still read the old one"
        )
    check_format(file, number, STATES)


def _unpack(file: Path) -> tuple[dict[str, Any], Arrays]:
    """Return description and arrays of a checkpoint; ValueError and others when it is damaged."""
    with open_to_read(file) as data:
        # Sizes first: what is damaged must not take all memory.
        size = os.fstat(data.fileno()).st_size
        with zipfile.ZipFile(data) as archive:
            for member in archive.infolist():
                if member.compress_type != zipfile.ZIP_STORED or member.file_size > size:
                    raise ValueError(f"{member.filename} is compressed, or larger than the file")
                _check_header(archive, member)
        data.seek(0)
        with np.load(data, allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files}
    announced = arrays.pop("checksum", None)
    about = json.loads(str(arrays["about"]))
    if not isinstance(about, dict) or not isinstance(about.get("run"), dict):
        raise ValueError("the description of the run is missing")
    if str(announced) != compute_checksum(arrays):
        raise ValueError("its checksum is wrong")
    del arrays["about"]
    return about, arrays


def _check_header(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> None:
    """Raise ValueError for an array that announces more numbers than the archive holds of it.

    This is done before memory is taken.
    """
    readers = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
    with archive.open(member) as file:
        read = readers.get(npy.read_magic(file))
        if read is None:
            raise ValueError(f"{member.filename} has a header of an unknown version")
        shape, _, kind = read(file)
    if math.prod(shape) * kind.itemsize > member.file_size:
        raise ValueError(f"{member.filename} announces more numbers than it holds")


def _check_sizes(problem: ContactProblem, about: dict[str, Any], arrays: Arrays) -> None:
    """Raise InputError or KeyError for missing, misshapen or senseless values.

    Of another problem nothing need fit.

    Args:
        problem: of this run.
        about: the description in the checkpoint, whose numbers become floats and ints.
        arrays: of the checkpoint.
    """
    for name in ("t", "t_start"):
        about[name] = number("it", name, about[name])
    for name in ("k", "k_start", "base", "halved"):
        about[name] = whole("it", name, about[name], most=2**53)
    array("it", "span", about["span"], (2,))
    if not isinstance(about["rows"], str) or not {"u", "v"} <= set(about["vectors"]):
        raise InputError("the description of the run is empty")
    n = problem.system.space.unknowns
    m = problem.surface.total
    run = about["run"]
    if run.get("unknowns") != n or run.get("contact points") != m:
        return  # _compare refuses it as another problem's
    shapes = dict.fromkeys(about["vectors"], (n,)) | {"r_n": (m,), "active": (m,)}
    for name, values in arrays.items():
        shape = shapes.pop(name, values.shape)
        if name.startswith(MEMORY + JOINT):
            shape = (m, *values.shape[1:])
        if name == "r_t":
            shape = (m, problem.surface.tangents.shape[1])
        kind = np.dtype(bool if name == "active" else float)
        if values.dtype != kind or values.shape != shape or not np.all(np.isfinite(values)):
            raise InputError(f"{quote(name)} is no {shape} array of finite {kind} numbers")
    if shapes:
        raise KeyError(next(iter(shapes)))
