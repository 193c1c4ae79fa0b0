"""Damaged checkpoints and run folders: refused in one sentence, or read with the numbers that are
on file; never else.

Bits flipped, ends cut off, archives and HDF5 files rewritten with missing, renamed, reshaped and
retyped arrays, texts with other numbers: by dice with a seed. A mutation that survives must give
what the folder gave before it.
"""

from __future__ import annotations

import io
import json
import shutil
import time
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fuzz
import h5py
import numpy as np
import pytest
from marched_chain import chain, difference, run

from vi_contact.core.errors import InputError
from vi_contact.core.step import State
from vi_contact.run.files.checkpoint import compute_checksum, read_checkpoint
from vi_contact.run.files.reading import read_run
from vi_contact.run.files.writer import Writer
from vi_contact.run.simulate import Solution
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor

pytestmark = pytest.mark.serial
CHECKPOINTS, FOLDERS, SECONDS = 80, 25, 10.0  # how many, and the processor time of one at most
SEED = 1000 * fuzz.SEED  # of the first one
Dice = np.random.Generator
Arrays = dict[str, Any]
PROBLEM = chain()


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run as a kill leaves it: the journal holds the arrays of the last rows."""
    folder = tmp_path_factory.mktemp("sound")

    class Killed(BaseException):
        """Nothing is saved any more."""

    def kill(writer: Writer, *_: Any) -> None:
        # what the end of the process would do: other tests listen to the same logger
        writer._log.close()
        raise Killed

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("vi_contact.run.session.Session._rescue", lambda *_: None)
        for seconds in ("PUSH", "SAVE"):  # history.h5 has the first rows, as in a long run
            patch.setattr(f"vi_contact.run.files.history.{seconds}", 0.0)
        patch.setattr("vi_contact.run.files.writer.Writer.close", kill)
        with pytest.raises(Killed):
            run(folder, 52, problem=PROBLEM)
    assert (folder / "history.journal").stat().st_size > 0
    (folder / "summary.json").write_text('{"status": "interrupted", "steps": 52}')
    return folder


# Mutations
# --------------------------------------------------------------------------------------------------


def flipped(data: bytes, dice: Dice) -> bytes:
    """One to eight bits are others."""
    changed = bytearray(data)
    for place in dice.integers(len(data), size=dice.integers(1, 9)):
        changed[place] ^= 1 << int(dice.integers(8))
    return bytes(changed)


def cut(data: bytes, dice: Dice) -> bytes:
    """The end is missing."""
    return data[: dice.integers(len(data))]


def overwritten(data: bytes, dice: Dice) -> bytes:
    """A stretch of something else."""
    place, length = int(dice.integers(len(data))), int(dice.integers(1, 200))
    return data[:place] + dice.bytes(length) + data[place + length :]


def spliced(data: bytes, dice: Dice) -> bytes:
    """A stretch is missing, or there twice."""
    one, two = sorted(int(place) for place in dice.integers(len(data), size=2))
    return data[:one] + data[two:] if dice.random() < 0.5 else data[:two] + data[one:]


def headers(data: bytes, dice: Dice) -> bytes:
    """A byte in one of the headers of the archive: method, sizes, names, flags."""
    changed = bytearray(data)
    marks = [
        place
        for mark in (b"PK\x01\x02", b"PK\x03\x04", b"PK\x05\x06")
        for place in _all(data, mark)
    ]
    changed[int(dice.choice(marks)) + int(dice.integers(4, 46))] = int(dice.integers(256))
    return bytes(changed)


def _all(data: bytes, mark: bytes) -> list[int]:
    return [i for i in range(len(data) - 46) if data.startswith(mark, i)]


BYTES = (flipped, cut, overwritten, spliced)
TYPES = ("f4", ">f8", "i8", "c16", "U8", "?", "O", "M8[s]", "S3")


def rearranged(arrays: Arrays, dice: Dice) -> Arrays:
    """Arrays that are missing, renamed, reshaped, of other types, with other numbers, or too
    many."""
    found, name = (
        dict(arrays),
        str(dice.choice([one for one in arrays if one not in ("about", "checksum")])),
    )
    values = found[name]
    match int(dice.integers(8)):
        case 0:
            del found[name]
        case 1:
            found[name + "_"] = found.pop(name)
        case 2:
            found[name] = values[: max(len(values) - int(dice.integers(1, 3)), 0)]
        case 3:
            found[name] = np.append(values, values[:1])
        case 4:
            found[name] = values[:, None]
        case 5:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                found[name] = values.astype(str(dice.choice(TYPES)))
        case 6:
            found[name] = values.astype(float)
            found[name][int(dice.integers(len(values)))] = dice.choice(
                [np.nan, np.inf, -1e308, 7.0]
            )
        case 7:
            found["extra"] = dice.random(3)
    return found


def described(arrays: Arrays, dice: Dice) -> Arrays:
    """Another description: a fact is missing or another."""
    about = json.loads(str(arrays["about"]))
    place = about if dice.random() < 0.6 else about["run"]
    name = str(dice.choice(list(place)))
    if dice.random() < 0.3:
        del place[name]
    else:
        place[name] = [None, -1, 1e300, "x", [], {}, True, 12345][int(dice.integers(8))]
    return arrays | {"about": np.array(json.dumps(about))}


def archive(arrays: Arrays, dice: Dice) -> bytes:
    """The arrays as a file; some with a checksum that fits, some compressed."""
    buffer = io.BytesIO()
    if dice.random() < 0.5:
        arrays = {name: values for name, values in arrays.items() if name != "checksum"}
        arrays["checksum"] = np.array(compute_checksum(arrays))
    save: Callable[..., None] = np.savez_compressed if dice.random() < 0.2 else np.savez
    save(buffer, **arrays)
    return buffer.getvalue()


def mutated(data: bytes, dice: Dice) -> tuple[bytes, bool]:
    """(another checkpoint, whether its checksum was made to fit)."""
    kind = dice.random()
    if kind < 0.4:
        return BYTES[int(dice.integers(4))](data, dice), False
    if kind < 0.55:
        return headers(data, dice), False
    with np.load(io.BytesIO(data)) as stored:
        arrays = {name: stored[name] for name in stored.files}
    return archive((rearranged if kind < 0.85 else described)(arrays, dice), dice), True


# Checkpoints
# --------------------------------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.fuzz
def test_checkpoints(sound: Path, tmp_path: Path) -> None:
    """160 of them. Where a checksum was forged, numbers may be others, but are finite and of the
    right shape."""
    good = (sound / "checkpoint.npz").read_bytes()
    wanted = read(sound)
    refused = 0
    for seed in range(CHECKPOINTS):
        data, forged = mutated(good, np.random.default_rng(SEED + seed))
        (tmp_path / "checkpoint.npz").write_bytes(data)
        begin = time.process_time()
        try:
            found = read(tmp_path)
        except InputError as error:
            assert "\n" not in str(error) and len(str(error)) < 1500, seed
            refused += 1
        else:
            assert forged or difference(found, wanted) == 0.0, seed
            assert all(np.all(np.isfinite(values)) for values in (found.u, found.v, found.r_n)), (
                seed
            )
            assert (found.u.shape, found.active.dtype) == (wanted.u.shape, wanted.active.dtype), (
                seed
            )
        assert time.process_time() - begin < SECONDS, seed
    assert refused > 0.75 * CHECKPOINTS


def read(folder: Path) -> State:
    """The state of a checkpoint."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of numpy and zipfile, about what they are given
        return read_checkpoint(folder, PROBLEM, scheme=ZienkiewiczWoodTaylor(), dt=5e-3)[0].state


# Run folders
# --------------------------------------------------------------------------------------------------


def other_numbers(path: Path, dice: Dice) -> None:
    """A digit, a line or a column of a text is another."""
    lines = path.read_text().split("\n")
    i = int(dice.integers(len(lines)))
    match int(dice.integers(5)):
        case 0:
            lines[i] = lines[i].replace(str(dice.integers(10)), str(dice.integers(10)))
        case 1:
            del lines[i]
        case 2:
            lines.insert(i, lines[int(dice.integers(len(lines)))])
        case 3:
            lines[i] = lines[i].replace(
                ",", str(dice.choice([";", ",,", ", ", ",nan,", ",1e999,"])), 1
            )
        case 4:
            lines[i] = "{" + lines[i] + "\u0660"
    path.write_text("\n".join(lines))


def other_datasets(path: Path, dice: Dice) -> None:
    """A dataset that is missing, renamed, shorter, of another type, a group, with other numbers."""
    with h5py.File(path, "r+") as file:
        names = [
            *(f"contact/{name}" for name in file["contact"]),
            *(name for name in file if name != "contact"),
        ]
        name = str(dice.choice(names))
        values = file[name][()]
        del file[name]
        match int(dice.integers(6)):
            case 0:
                file.create_group(name)
            case 1:
                file[name + "_"] = values
            case 2:
                file[name] = values[:-1]
            case 3:
                file[name] = values.astype("S8")
            case 4:
                changed = values.astype(float)
                changed.flat[int(dice.integers(changed.size))] = 7.5
                file[name] = changed
            case 5:
                pass


def damage(folder: Path, dice: Dice) -> str:
    """Does something to a file of the folder; its name."""
    names = (
        ["history.csv"] * 3
        + ["history.h5"] * 3
        + ["history.journal"] * 2
        + ["columns.json", "summary.json"]
    )
    path = folder / str(dice.choice([*names, "format.json"]))
    kind = dice.random()
    if kind < 0.1:
        path.unlink()
    elif kind < 0.55 and path.suffix == ".h5":
        other_datasets(path, dice)
    elif kind < 0.55 and path.suffix != ".journal":
        other_numbers(path, dice)
    else:
        path.write_bytes(BYTES[int(dice.integers(4))](path.read_bytes(), dice))
    return path.name


@pytest.mark.long
@pytest.mark.fuzz
def test_folders(sound: Path, tmp_path: Path) -> None:
    """100 of them: a restart gives the straight run, or one sentence, and no file is changed; so
    does reading."""
    wanted, whole = restarted(sound), read_run(sound).history["u_x_12"]
    with h5py.File(sound / "history.h5") as file:
        rows = len(file["k"])
    kept = 0
    for seed in range(FOLDERS):
        folder = tmp_path / str(seed)
        shutil.copytree(sound, folder)
        name = damage(folder, np.random.default_rng(SEED + seed))
        before = {path.name: path.read_bytes() for path in folder.iterdir()}
        begin = time.process_time()
        try:
            found = restarted(folder)
        except InputError as error:
            assert "\n" not in str(error), (seed, name)
        else:
            kept += 1
            for column, values in wanted.history.items():
                assert np.array_equal(found.history[column], values, equal_nan=True), (
                    seed,
                    name,
                    column,
                )
        assert {path.name: path.read_bytes() for path in folder.iterdir()} == before, (seed, name)
        try:
            again = read_run(folder).history["u_x_12"]
        except InputError as error:
            assert "\n" not in str(error), (seed, name)
        else:
            # later ones of a killed run have no second copy
            held = len(again) if name != "history.csv" else rows
            assert np.array_equal(again[:held], whole[:held]), (seed, name)
        assert time.process_time() - begin < SECONDS, (seed, name)
        shutil.rmtree(folder)
    # 5 to 14 with other seeds: the files of other machines differ, and the dice fall elsewhere
    assert 1 < kept < 23


def restarted(folder: Path) -> Solution:
    """Three steps more, in memory: the folder stays as it is."""
    return run(None, 55, problem=PROBLEM, restart=folder)


def test_the_dice_reach_the_archive(sound: Path) -> None:
    """Mutations of headers still leave something that begins like an archive."""
    data = headers((sound / "checkpoint.npz").read_bytes(), np.random.default_rng(1))
    assert zipfile.is_zipfile(io.BytesIO(data)) and data != (sound / "checkpoint.npz").read_bytes()
