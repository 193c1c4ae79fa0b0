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

from vi_contact.core.checks import shown
from vi_contact.core.errors import InputError

MAGIC = b"$MeshFormat"
_SECTION = re.compile(rb"\n\$(End)?(PhysicalNames|Entities|Nodes|Elements)\b")
SHORT = 80  # bytes in which what comes first is found


def safe_copy(file: Path, folder: Path) -> Path:
    """Copy a mesh file into this folder, safe for Gmsh to read.

    InputError for a file that is missing, empty, no MSH file (a script), cut short, or announces
    more than it holds.
    """
    copy = folder / "mesh.msh"
    try:
        there = file.is_file()
        if there:
            shutil.copyfile(file, copy)
    except OSError as error:  # a name that is too long, what may not be looked into
        why = f"{error.strerror}): check the path and its permissions"
        raise InputError(f"mesh file {shown(str(file))} cannot be read ({why}") from None
    if not there:
        what = str(file) if "\0" not in str(file) else shown(str(file))
        raise InputError(
            f"mesh file {what} does not exist: check the path, or write one (python3 meshes --help)"
        )
    if copy.stat().st_size == 0:
        raise InputError(f"mesh file {file} is empty: write it again")
    with open(copy, "rb") as opened, mmap.mmap(opened.fileno(), 0, access=mmap.ACCESS_READ) as data:
        _check_magic(data, file)
        _check_sections(data, file)
    return copy


def _check_magic(data: mmap.mmap, file: Path) -> None:
    if data[: len(MAGIC)] != MAGIC:
        raise InputError(
            f"mesh file {file} does not begin with $MeshFormat, so it is not in Gmsh's mesh format "
            "and may be a script, which runs commands: write it from Gmsh as .msh, or give a .geo "
            "of geometry alone as meshes.GeoFile"
        )


def _check_sections(data: mmap.mmap, file: Path) -> None:
    """Refuse sections not closed, or that announce more than the file holds.

    Gmsh makes room before it reads.
    """
    version, binary = (data[:SHORT].split() + [b"", b""])[1:3]
    opened, name = b"", b""
    for section in _SECTION.finditer(data):
        closes, name = section[1] is not None, section[2]
        if closes != (opened != b"") or (closes and name != opened):
            break
        if not closes:
            ahead = data[section.end() : section.end() + SHORT]
            counts = (
                _packed(ahead) if binary == b"1" and name != b"PhysicalNames" else _written(ahead)
            )
            if max(counts[:1] if version.startswith(b"2") else counts) > len(data):
                what = name.decode().lower()
                raise InputError(
                    f"mesh file {file} announces more {what} than it can hold: write it again from "
                    "Gmsh"
                )
        opened = b"" if closes else name
    else:
        if not opened:
            return
    raise InputError(
        f"mesh file {file} is cut short or damaged near {name.decode()}: write it again from Gmsh"
    )


def _written(ahead: bytes) -> tuple[int, ...]:
    """Return the first two numbers after a section's name.

    They are blocks and items in format 4, items and more in 2.
    """
    return tuple(int(word) if word.isdigit() else 0 for word in ahead.split()[:2]) or (0,)


def _packed(ahead: bytes) -> tuple[int, ...]:
    """Return these numbers of a binary file.

    They have 8 bytes each, in the order of bytes that makes them smaller.
    """
    head = ahead[1:17]
    both = [struct.unpack(order, head) for order in ("<2Q", ">2Q")] if len(head) == 16 else []
    return min([*both, _written(ahead)] if ahead[1:2].isdigit() else both, key=max, default=(0,))
