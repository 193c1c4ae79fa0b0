"""Let a mesh script run by itself: an option for every argument of what it makes."""

from __future__ import annotations

import argparse
import inspect
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from vi_contact.core.errors import InputError
from vi_contact.meshes.gmsh_session import MeshScript, write


def run_script(make: Callable[..., MeshScript], **meanings: str) -> None:
    """Write the mesh that ``make`` returns for the options of the shell to a file, or end with a sentence.

    meanings: help text of every option, which is named and typed like an argument of ``make``, a float, bool, or tuple
    of float or int (annotations are texts). An argument without default must be given.
    """
    parser = argparse.ArgumentParser(description=(sys.modules["__main__"].__doc__ or "").split("\n")[0])
    for name, meaning in meanings.items():
        one = inspect.signature(make).parameters[name]
        option, needed = f"--{name.replace('_', '-')}", one.default is one.empty
        if one.annotation == "bool":
            parser.add_argument(option, action="store_true", help=meaning)
            continue
        shown = "" if needed or one.default is None else f" (default: {one.default})"
        several: dict[str, Any] = {"nargs": "+"} if one.annotation.startswith("tuple") else {}
        parser.add_argument(
            option, type=int if "int" in one.annotation else float, help=meaning + shown, required=needed,
            default=None if needed else one.default, **several,
        )
    parser.add_argument("-o", "--output", default=f"{Path(sys.argv[0]).stem}.msh")
    given = vars(parser.parse_args())
    output: str = given.pop("output")
    try:
        write(make(**{name: tuple(x) if isinstance(x, list) else x for name, x in given.items()}), output)
    except InputError as error:
        sys.exit(str(error))
