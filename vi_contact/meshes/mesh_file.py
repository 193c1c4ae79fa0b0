"""Check a mesh file on its way to Gmsh.

Only what is certainly a mesh goes there, under a name and in a folder of our own.

Gmsh runs as a script whatever it does not recognise as a mesh, and a script may run any command of
the shell. It decides by the name of a file, else by the first word in it, and it runs FILE.opt
beside a mesh too. So a mesh file is read only if its first bytes are those of Gmsh's own format,
and from a copy called mesh.msh, alone in a new folder.
"""

import mmap
import re
import shutil
import struct
from pathlib import Path

from vi_contact.core.checks import quote
from vi_contact.core.errors import InputError

MAGIC = b"$MeshFormat"
_SECTION = re.compile(rb"\n\$(End)?(PhysicalNames|Entities|Nodes|Elements)\b")
SHORT = 80  # bytes in which what comes first is found


def safe_copy(file: Path, folder: Path) -> Path:
    """Copy a mesh file into this folder, safe for Gmsh to read.

    Raises:
        InputError: a file that is missing or empty, that is no MSH file (a script, for example),
            that is cut short, or that announces more than it holds.
    """
    copy = folder / "mesh.msh"
    try:
        exists = file.is_file()
        if exists:
            shutil.copyfile(file, copy)
    except OSError as error:  # a name that is too long, what may not be looked into
        why = f"{error.strerror}): check the path and its permissions"
        raise InputError(f"mesh file {quote(str(file))} cannot be read ({why}") from None
    if not exists:
        name = str(file) if "\0" not in str(file) else quote(str(file))
        raise InputError(
            f"mesh file {name} does not exist: check the path, or write one (python3 meshes --help)"
        )
    if copy.stat().st_size == 0:
        raise InputError(f"mesh file {file} is empty: write it again")
    with open(copy, "rb") as opened, mmap.mmap(opened.fileno(), 0, access=mmap.ACCESS_READ) as data:
        _check_magic(data, file)
        _check_sections(data, file)
    return copy


def _check_magic(data: mmap.mmap, file: Path) -> None:
    """Raise InputError unless the file begins as Gmsh's own format does."""
    if data[: len(MAGIC)] != MAGIC:
        raise InputError(
            f"mesh file {file} does not begin with $MeshFormat, so it is not in Gmsh's mesh format "
            "and may be a script, which runs commands: write it from Gmsh as .msh, or give a .geo "
            "of geometry alone as meshes.GeoFile"
        )


def _check_sections(data: mmap.mmap, file: Path) -> None:
    """Refuse sections that are not closed, or that announce more than the file holds.

    Gmsh makes room before it reads, so that a wrong number would take all memory.
    """
    _, version, binary, *_ = [*data[:SHORT].split(), b"", b"", b""]
    is_open = b""  # name of the section that is open
    name = b""
    for section in _SECTION.finditer(data):
        closes = section[1] is not None
        name = section[2]
        if closes:
            if name != is_open:
                raise _describe_damage(file, name)
            is_open = b""
            continue
        if is_open:
            raise _describe_damage(file, name)
        is_open = name
        ahead = data[section.end() : section.end() + SHORT]
        packed = binary == b"1" and name != b"PhysicalNames"
        counts = _unpack_counts(ahead) if packed else _read_counts(ahead)
        if version.startswith(b"2"):
            counts = counts[:1]
        if max(counts) > len(data):
            items = name.decode().lower()
            raise InputError(
                f"mesh file {file} announces more {items} than it can hold: write it again "
                "from Gmsh"
            )
    if is_open:
        raise _describe_damage(file, name)


def _describe_damage(file: Path, name: bytes) -> InputError:
    """Return the error of a file whose sections do not follow one another."""
    return InputError(
        f"mesh file {file} is cut short or damaged near {name.decode()}: write it again from Gmsh"
    )


def _read_counts(ahead: bytes) -> tuple[int, ...]:
    """Return the first two numbers after a section's name, 0 for what is none.

    They are blocks and items in format 4, items and more in format 2.
    """
    words = ahead.split()[:2]
    return tuple(int(word) if word.isdigit() else 0 for word in words) or (0,)


def _unpack_counts(ahead: bytes) -> tuple[int, ...]:
    """Return these numbers of a binary file.

    They have 8 bytes each. Of both orders of bytes, and of written numbers where there is a digit,
    the answer is the one that makes the larger number least.
    """
    readings: list[tuple[int, ...]] = []
    head = ahead[1:17]
    if len(head) == 16:
        readings = [struct.unpack("<2Q", head), struct.unpack(">2Q", head)]
    if ahead[1:2].isdigit():
        readings.append(_read_counts(ahead))
    return min(readings, key=max, default=(0,))
