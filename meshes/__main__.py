"""Write a mesh to a file.

An example is ``python3 meshes wall --height 9 --size 0.5 -o wall.msh``.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import MISSING, Field, fields
from pathlib import Path
from typing import Any, get_args, get_origin

if not __package__:  # run as a folder of the source tree, maybe not installed
    sys.path[0] = str(Path(__file__).resolve().parents[1])

from meshes.disk import DiskMesh
from meshes.raft import RaftMesh
from vi_contact import meshes as room
from vi_contact.core.arguments import members_of
from vi_contact.core.errors import InputError
from vi_contact.core.quantities import Quantity, read_quantities
from vi_contact.meshes.gmsh_session import write

NAMED = {name: getattr(room, name) for name in room.__all__ if name.endswith("Mesh")}
OWN = {"disk": DiskMesh, "raft": RaftMesh}
SHAPES = OWN | {name.removesuffix("Mesh").lower(): one for name, one in NAMED.items()}


def parser() -> argparse.ArgumentParser:
    """Build the parser.

    It has a command for every shape and an option for each of its numbers, which the shape's
    docstring explains.
    """
    top = argparse.ArgumentParser(prog="meshes", description=__doc__)
    commands = top.add_subparsers(dest="shape", required=True, metavar=f"{{{','.join(SHAPES)}}}")
    for shape, mesh in SHAPES.items():
        first = (mesh.__doc__ or "").splitlines()[0].rstrip(".")
        one = commands.add_parser(
            shape, help=first, description=mesh.__doc__, argument_default=argparse.SUPPRESS
        )
        numbers = read_quantities(mesh)
        for field in fields(mesh):
            if field.name in numbers:
                add_option(one, field, numbers[field.name])
        one.add_argument(
            "-o", "--output", default=f"{shape}.msh", help=f"file to write (default: {shape}.msh)"
        )
    return top


def add_option(command: argparse.ArgumentParser, field: Field[Any], asked: Quantity) -> None:
    """Add the option of one field of a shape: a switch, a number, or several numbers."""
    option = f"--{field.name.replace('_', '-')}"
    kind = members_of(asked.kind)[0]  # an option that may be left out is a number or None
    several = get_origin(kind) is tuple
    number = get_args(kind)[0] if several else kind
    if number is bool:
        command.add_argument(option, action="store_true")
    elif number in (float, int):
        command.add_argument(
            option,
            type=number,
            required=field.default is MISSING,
            nargs="+" if several else None,
            help=f"[{asked.symbol}]" if asked.symbol else None,
        )


def main(words: Sequence[str]) -> None:
    """Write the mesh that the words of a command ask for, or end with a sentence."""
    given = vars(parser().parse_args(words))
    mesh, output = SHAPES[given.pop("shape")], given.pop("output")
    try:
        write(
            mesh(**{name: tuple(x) if isinstance(x, list) else x for name, x in given.items()}),
            output,
        )
    except InputError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main(sys.argv[1:])
