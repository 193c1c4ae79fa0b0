"""Run a quiet, reproducible Gmsh for the length of a with-block, and write meshes to files."""

import ctypes
import inspect
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol

from vi_contact.core.errors import InputError

M_PERTURB = -6  # of malloc.h: the option that says with which byte new memory is filled
ALMOST_ZERO = 0xFF  # glibc fills with the complement of the byte: with zeros
STDERR = 2  # the descriptor that C++ prints errors to
# Options of Gmsh while it meshes for this package: quiet and reproducible, whatever the user's own
# session has.
_OPTIONS: Mapping[str, float] = {
    "General.Terminal": 0,
    "General.NumThreads": 1,  # one thread and a fixed seed give the same mesh every time
    "Mesh.RandomSeed": 1,
    "Mesh.ElementOrder": 1,  # this and the following options undo choices of a user's own session
    "Mesh.RecombineAll": 0,
    "Mesh.RecombinationAlgorithm": 3,  # where a script recombines, no triangle is left behind
    "Mesh.SubdivisionAlgorithm": 0,
    "Mesh.MeshSizeFactor": 1,
    "Mesh.MshFileVersion": 4.1,
    "Mesh.Binary": 0,
    "Mesh.SaveAll": 0,
}


class MeshScript(Protocol):
    """Describe anything that can put a mesh into Gmsh's current model."""

    def build(self, gmsh: Any) -> None:
        """Add geometry, named physical groups and cells to the current (empty) model.

        They are of first order unless it says ``gmsh.model.mesh.setOrder(2)`` at its end, which
        puts mid-points on the curves of the geometry.
        """


@contextmanager
def session(name: str = "vi_contact") -> Iterator[Any]:
    """Give the gmsh module with an empty current model, and remove all traces afterwards.

    A Gmsh that the caller has already initialised is borrowed: its models, current model and
    options are left as they were.

    Raises:
        InputError: Gmsh is not installed.
    """
    try:
        import gmsh
    except (ImportError, OSError) as error:  # OSError: the module is there, its library is not
        raise InputError(
            f"Gmsh's Python module is missing ({error}): install python3-gmsh"
        ) from error
    borrowed = _is_initialised(gmsh)
    if not borrowed:
        settings = {"readConfigFiles": False}
        if "interruptible" in inspect.signature(gmsh.initialize).parameters:
            settings["interruptible"] = False  # or newer Gmsh takes over SIGINT
        gmsh.initialize([], **settings)
    current = gmsh.model.getCurrent()
    try:
        with options(gmsh, _OPTIONS):
            gmsh.model.add(name)
            yield gmsh
    finally:
        if borrowed:
            gmsh.model.remove()
            gmsh.model.setCurrent(current)
        else:
            gmsh.finalize()


@contextmanager
def options(gmsh: Any, values: Mapping[str, float]) -> Iterator[None]:
    """Set Gmsh's options to these values for the length of a with-block."""
    before = {option: gmsh.option.getNumber(option) for option in values}
    try:
        for option, value in values.items():
            gmsh.option.setNumber(option, value)
        yield
    finally:
        for option, value in before.items():
            gmsh.option.setNumber(option, value)


def write(mesh: MeshScript, path: str | Path) -> None:
    """Build the mesh and write it to a file.

    The format is the one that Gmsh gives to the suffix; .msh is format 4.1, text.
    """
    target = Path(path)
    if not target.parent.is_dir():
        raise InputError(
            f"cannot write {target}: the folder {target.parent} does not exist: create it first"
        )
    with session(target.stem) as gmsh:
        mesh.build(gmsh)
        gmsh.write(str(target))


def _is_initialised(gmsh: Any) -> bool:
    """Tell whether Gmsh runs.

    Gmsh 4.8 (Debian 12) has no function for that, but it lists no model before initialize(). After
    finalize() it complains, from C++ and past sys.stderr. How it complains depends on an option
    that it has not set yet, and if that is 4 it ends the process: new memory is zeroed so that it
    is not.
    """
    if hasattr(gmsh, "isInitialized"):
        return bool(gmsh.isInitialized())
    fill_new_memory = getattr(ctypes.CDLL(None), "mallopt", lambda option, value: 0)
    stderr = os.dup(STDERR)
    sink = os.open(os.devnull, os.O_WRONLY)
    os.dup2(sink, STDERR)
    fill_new_memory(M_PERTURB, ALMOST_ZERO)
    try:
        return bool(gmsh.model.list())
    except Exception:  # the only class Gmsh raises
        return False
    finally:
        fill_new_memory(M_PERTURB, 0)
        os.dup2(stderr, STDERR)
        os.close(stderr)
        os.close(sink)
