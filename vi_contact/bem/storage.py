"""Saved boundary element blocks (HDF5): they depend on geometry, wave speeds and time step, on no load or density."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..materials import LinearElastic
from .boundary_mesh import BoundaryMesh
from .energetic import EnergeticBlocks, energetic_blocks

FORMAT = "vi_contact boundary element blocks, 1"
SAME = 1e-12  # relative difference up to which geometry, speeds and time step count as equal


def save_blocks(path: str | Path, blocks: EnergeticBlocks) -> None:
    """Write the blocks; an existing file is replaced once the new one is complete."""
    import h5py

    target = Path(path)
    unfinished = target.with_name(target.name + ".part")
    with h5py.File(unfinished, "w") as file:
        file.attrs.update(format=FORMAT, c_p=blocks.c_p, c_s=blocks.c_s, dt=blocks.dt, exterior=blocks.mesh.exterior)
        file["points"], file["loop_sizes"] = blocks.mesh.points, np.array(blocks.mesh.loop_sizes)
        file["single"], file["double"] = blocks.single, blocks.double
        if blocks.hyper is not None:
            file["hyper"] = blocks.hyper
    unfinished.replace(target)


def load_blocks(
    path: str | Path, mesh: BoundaryMesh, material: LinearElastic, *, dt: float, steps: int, hyper: bool = True
) -> EnergeticBlocks:
    """The first `steps` blocks of a file written by save_blocks.

    Raises InputError, naming what differs, when the file belongs to another mesh, material or time step, holds fewer
    steps or lacks the hypersingular operator, or is no such file.
    """
    import h5py

    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise InputError(f"{Path(path).name}: no readable HDF5 file; assemble the operator and save it") from error
    with file:
        if file.attrs.get("format") != FORMAT:
            raise InputError(f"{Path(path).name}: no boundary element blocks; give a file written by save_blocks")
        different = [*_differences(file, mesh, material, dt), *_missing(file, steps, hyper)]
        if different:
            raise InputError(f"{Path(path).name} holds the operator of another problem ({'; '.join(different)}); "
                             "assemble the operator of this one")
        return EnergeticBlocks(
            mesh, material.c_p, material.c_s, dt, file["single"][:steps], file["double"][:steps],
            file["hyper"][:steps] if hyper else None,
        )


def stored_blocks(
    path: str | Path, mesh: BoundaryMesh, material: LinearElastic, *, dt: float, steps: int, hyper: bool = True
) -> EnergeticBlocks:
    """load_blocks if the file exists, else energetic_blocks and save_blocks."""
    if Path(path).exists():
        return load_blocks(path, mesh, material, dt=dt, steps=steps, hyper=hyper)
    blocks = energetic_blocks(mesh, material, dt=dt, steps=steps, hyper=hyper)
    save_blocks(path, blocks)
    return blocks


def _differences(file: Any, mesh: BoundaryMesh, material: LinearElastic, dt: float) -> list[str]:
    points = file["points"][:]
    if points.shape != mesh.points.shape:
        return [f"{len(points)} elements, here {len(mesh)}"]
    different = []
    for name, here in (("c_p", material.c_p), ("c_s", material.c_s), ("dt", dt)):
        there = float(file.attrs[name])
        if abs(there - here) > SAME * abs(here):
            different.append(f"{name} = {there:.6g}, here {here:.6g}")
    if np.abs(points - mesh.points).max() > SAME * mesh.size or tuple(file["loop_sizes"][:]) != mesh.loop_sizes:
        different.append("other points of the boundary")
    if bool(file.attrs["exterior"]) != mesh.exterior:
        different.append("the other side of the boundary")
    return different


def _missing(file: Any, steps: int, hyper: bool) -> list[str]:
    there = len(file["single"])
    missing = [f"{there} time steps, here {steps}"] if there < steps else []
    return missing + (["no hypersingular operator"] if hyper and "hyper" not in file else [])
