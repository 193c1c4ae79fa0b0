#!/usr/bin/env python3
"""Count the files that a mesh visits while ``fem.assemble`` makes a system of it.

    python3 benchmarks/walk.py [--tree PATH] [--json]

The body is the wall of the first example of README.md. Every call of a function of the package is
traced by ``sys.setprofile``, in the order of the calls. The *walk of the mesh* is the sequence of
files of those calls that are handed the mesh: itself, or something that holds it, such as a group,
a function space, or the forms of the body, also as ``self``. A *visit* is a stay in one file, and
the next call in another file ends it. A *return* is a visit to a file that has been left before,
so that visits = files + returns. Comprehensions count as parts of the functions that they stand
in. The same numbers of all calls, whatever they are handed, are printed beside them.

Data that flow forward visit few files and return to few: each stage is made once, from what is
handed to it. The second call is traced, when all modules are imported and all forms compiled.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from types import FrameType
from typing import Any

COMPREHENSIONS = {"<listcomp>", "<setcomp>", "<dictcomp>", "<genexpr>"}
DEPTH = 6  # how deep the mesh is looked for inside of what a function is handed
FEW = 32  # members of a list that are looked at

Call = tuple[str, str]  # file below the package, and function


def holds(value: Any, mesh: Any, depth: int = DEPTH) -> bool:
    """Say whether a value is the mesh, or has it inside.

    Args:
        value: what a function is handed.
        mesh: the DOLFINx mesh that is looked for.
        depth: how many attributes may lie between both.

    Returns:
        True for the mesh, objects of this package and of DOLFINx that hold it, and lists of these.
    """
    if value is mesh:
        return True
    if depth == 0 or isinstance(value, type):
        return False
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list | tuple):
        return any(holds(member, mesh, depth) for member in value[:FEW])
    home = type(value).__module__.partition(".")[0]
    if home == "dolfinx":
        # spaces and functions of C++ know the part of the mesh that is of C++
        own = getattr(value, "mesh", None) or getattr(value, "function_space", None)
        cpp = getattr(mesh, "_cpp_object", getattr(mesh, "_mesh", mesh))
        return own is not None and (own is cpp or holds(own, mesh, depth - 1))
    if home != "vi_contact":
        return False
    # the attributes that it has, not those that it would have to compute
    attributes = list(getattr(value, "__dict__", {}).values())
    return any(holds(member, mesh, depth - 1) for member in attributes)


def traced(mesh: Any, package: Path, assemble: Any) -> list[tuple[Call, bool]]:
    """Return the calls inside of the package, and whether each is handed the mesh.

    Args:
        mesh: the DOLFINx mesh whose walk it is.
        package: the folder of the package.
        assemble: a function without arguments that makes the system.

    Returns:
        pairs of a call and a truth value, in the order in which the calls begin.
    """
    calls: list[tuple[Call, bool]] = []
    root = f"{package}/"

    def note(frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        inside = code.co_filename.startswith(root)
        if event != "call" or not inside or code.co_name in COMPREHENSIONS:
            return
        names = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
        handed = [frame.f_locals.get(name) for name in names]
        call = code.co_filename.removeprefix(root), code.co_name
        calls.append((call, any(holds(value, mesh) for value in handed)))

    sys.setprofile(note)
    try:
        assemble()
    finally:
        sys.setprofile(None)
    return calls


def stays(calls: list[Call]) -> list[tuple[str, list[str]]]:
    """Return the stays in files: (file, functions that are called there in a row)."""
    found: list[tuple[str, list[str]]] = []
    for file, function in calls:
        if not found or found[-1][0] != file:
            found.append((file, []))
        found[-1][1].append(function)
    return found


def counts(calls: list[Call]) -> dict[str, int]:
    """Return visits, files and returns of a sequence of calls."""
    visits = stays(calls)
    files = {file for file, _ in visits}
    return {"visits": len(visits), "files": len(files), "returns": len(visits) - len(files)}


def calls_of_example(tree: Path) -> list[tuple[Call, bool]]:
    """Return the calls of ``fem.assemble`` of the wall, and whether each is handed the mesh.

    ``tree``: the folder that has the package.
    """
    sys.path.insert(0, str(tree))
    from mpi4py import MPI

    import vi_contact as vc
    from vi_contact import fem
    from vi_contact.meshes.wall import WallMesh

    wall = WallMesh(height=9.0, width=6.0, divisions=(8, 12))
    mesh, tags = fem.build_mesh(wall, MPI.COMM_SELF)
    concrete = vc.LinearElastic(E=2.0e10, nu=0.0, rho=2400.0)
    section = vc.PlaneStress(thickness=0.20)
    make = fem.assemble

    def assemble() -> None:
        make(mesh, concrete, section=section, clamped=tags["base"])

    assemble()
    return traced(mesh, tree / "vi_contact", assemble)


def main(tree: Path, as_json: bool) -> None:
    """Print what the mesh visits while ``fem.assemble`` of the package in a tree runs."""
    calls = calls_of_example(tree)
    walk = [call for call, handed in calls if handed]
    every = [call for call, _ in calls]
    if as_json:
        print(json.dumps({**counts(walk), "all_calls": counts(every)}))
        return
    for number, (file, functions) in enumerate(stays(walk), 1):
        print(f"{number:3d}  {file:30s} {' '.join(dict.fromkeys(functions))}")
    print(f"the mesh: {counts(walk)}")
    print(f"all calls: {counts(every)}")


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument(
        "--tree",
        type=Path,
        default=Path(__file__).resolve().parents[1],
        help="folder with the package, such as that of another commit",
    )
    options.add_argument("--json", action="store_true", help="print visits, files and returns")
    given = options.parse_args()
    main(given.tree.resolve(), given.json)
