"""Save boundary element blocks (HDF5): they depend on geometry, wave speeds and time step, on no load or density."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..core import checks
from ..core.errors import InputError
from ..core.files import hdf5_atomically
from ..laws.materials import LinearElastic
from .boundary_mesh import BoundaryMesh
from .boundary_operators import check_body
from .energetic import EnergeticBlocks, energetic_blocks
from .quadrature import Orders

FORMAT = "vi_contact boundary element blocks, 2"
EQUAL = 1e-12  # relative difference up to which geometry, speeds and time step count as equal


def save_blocks(path: str | Path, blocks: EnergeticBlocks) -> None:
    """Write the blocks; an existing file is replaced once the new one is complete."""
    checks.instance("save_blocks", "blocks", blocks, EnergeticBlocks, "give those of energetic_blocks")
    target, mesh = _target("save_blocks", path), blocks.mesh

    def fill(file: Any) -> None:
        file.attrs.update(format=FORMAT, c_p=blocks.c_p, c_s=blocks.c_s, dt=blocks.dt, exterior=mesh.exterior)
        file["points"], file["loop_sizes"] = mesh.points, np.array(mesh.loop_sizes)
        file["single"], file["double"], file["hyper"] = blocks.single, blocks.double, blocks.hyper

    try:
        hdf5_atomically(target, fill)
    except OSError as error:
        raise InputError(f"save_blocks: {target.name} cannot be written ({checks.shown(str(error))}); give a file in a "
                         "folder with room that may be written to") from error


def load_blocks(
    path: str | Path, mesh: BoundaryMesh, material: LinearElastic, *, dt: float, steps: int
) -> EnergeticBlocks:
    """Load the first `steps` blocks of a file written by save_blocks.

    Raises InputError, naming what differs, when the file belongs to another mesh, material or time step, holds fewer
    steps, or is no such file.
    """
    import h5py

    checks.path("load_blocks", "path", path)
    check_body(mesh, material, Orders())
    steps = checks.whole("load_blocks", "steps", steps, least=1)
    dt = checks.number("load_blocks", "dt", dt, positive=True, unit="s")
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise InputError(f"{Path(path).name}: no readable HDF5 file; assemble the operator and save it") from error
    with file:
        try:
            return _read(Path(path).name, file, mesh, material, dt, steps)
        except InputError:
            raise
        except (KeyError, ValueError, TypeError, OSError, AttributeError) as error:
            raise InputError(f"{Path(path).name}: a damaged file of boundary element blocks "
                             f"({checks.shown(str(error))}); assemble the operator and save it again") from error


def _read(
    name: str, file: Any, mesh: BoundaryMesh, material: LinearElastic, dt: float, steps: int
) -> EnergeticBlocks:
    if file.attrs.get("format") != FORMAT:
        raise InputError(f"{name}: no boundary element blocks of this version; give a file written by save_blocks")
    different = _differences(file, mesh, material, dt, steps)
    if different:
        raise InputError(f"{name} holds the operator of another problem ({'; '.join(different)}); "
                         "assemble the operator of this one")
    n = len(mesh)
    shapes = {"single": (steps, 4 * n, 4 * n), "double": (steps, 4 * n, 2 * n), "hyper": (steps, 2 * n, 2 * n)}
    found = {key: checks.array(name, key, file[key][:steps], shape) for key, shape in shapes.items()}
    return EnergeticBlocks(mesh, material.c_p, material.c_s, dt, **found)


def stored_blocks(
    path: str | Path, mesh: BoundaryMesh, material: LinearElastic, *, dt: float, steps: int
) -> EnergeticBlocks:
    """Load the blocks if the file exists, else compute and save them."""
    if _target("stored_blocks", path).exists():
        return load_blocks(path, mesh, material, dt=dt, steps=steps)
    blocks = energetic_blocks(mesh, material, dt=dt, steps=steps)
    save_blocks(path, blocks)
    return blocks


def _target(owner: str, path: str | Path) -> Path:
    target = checks.path(owner, "path", path)
    if not target.parent.is_dir():
        raise InputError(f"{owner}: there is no folder {checks.shown(str(target.parent))}; make it first")
    return target


def _differences(file: Any, mesh: BoundaryMesh, material: LinearElastic, dt: float, steps: int) -> list[str]:
    points = file["points"][:]
    if points.shape != mesh.points.shape:
        return [f"{len(points)} elements, here {len(mesh)}"]
    different = []
    for name, here in (("c_p", material.c_p), ("c_s", material.c_s), ("dt", dt)):
        there = float(file.attrs[name])
        if not abs(there - here) <= EQUAL * abs(here):
            different.append(f"{name} = {there:.6g}, here {here:.6g}")
    if not np.abs(points - mesh.points).max() <= EQUAL * mesh.size or tuple(file["loop_sizes"][:]) != mesh.loop_sizes:
        different.append("other points of the boundary")
    if bool(file.attrs["exterior"]) != mesh.exterior:
        different.append("the other side of the boundary")
    if len(file["single"]) < steps:
        different.append(f"{len(file['single'])} time steps, here {steps}")
    return different
