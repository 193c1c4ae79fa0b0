"""Keep boundary element blocks in a file (HDF5).

They depend on geometry, wave speeds and time step only.
"""

from pathlib import Path
from typing import Any

import numpy as np

from vi_contact.bem.boundary_mesh import BoundaryMesh
from vi_contact.bem.boundary_operators import check_body
from vi_contact.bem.energetic import EnergeticBlocks, energetic_blocks
from vi_contact.bem.quadrature import Orders
from vi_contact.core import checks
from vi_contact.core.errors import InputError
from vi_contact.core.files import hdf5_atomically
from vi_contact.laws.materials import LinearElastic

FORMAT = "vi_contact boundary element blocks, 2"
EQUAL = 1e-12  # relative difference up to which geometry, speeds and time step count as equal


def stored_blocks(
    path: str | Path, mesh: BoundaryMesh, material: LinearElastic, *, dt: float, steps: int
) -> EnergeticBlocks:
    """Return the first `steps` blocks of the file if it exists; else compute and write them.

    InputError, naming what differs, for a file of another mesh, material or dt, too few steps, or
    not to be written.
    """
    owner = "stored_blocks"
    target = checks.path(owner, "path", path)
    if not target.parent.is_dir():
        raise InputError(
            f"{owner}: there is no folder {checks.quote(str(target.parent))}; make it first"
        )
    if target.exists():
        check_body(mesh, material, Orders())
        steps = checks.whole(owner, "steps", steps, least=1)
        return _read(
            target, mesh, material, checks.number(owner, "dt", dt, positive=True, unit="s"), steps
        )
    blocks = energetic_blocks(mesh, material, dt=dt, steps=steps, compressed=False)
    assert isinstance(blocks, EnergeticBlocks)

    def fill(file: Any) -> None:
        file.attrs.update(
            format=FORMAT, c_p=blocks.c_p, c_s=blocks.c_s, dt=dt, exterior=mesh.exterior
        )
        file["points"] = mesh.points
        file["loop_sizes"] = np.array(mesh.loop_sizes)
        file["single"] = blocks.single
        file["double"] = blocks.double
        file["hyper"] = blocks.hyper

    try:
        hdf5_atomically(target, fill)
    except OSError as error:
        raise InputError(
            f"{owner}: {target.name} cannot be written ({checks.quote(str(error))}); give a file "
            "in a folder with room that may be written to"
        ) from error
    return blocks


def _read(
    path: Path, mesh: BoundaryMesh, material: LinearElastic, dt: float, steps: int
) -> EnergeticBlocks:
    import h5py

    try:
        with h5py.File(path, "r") as file:
            different = _differences(file, mesh, material, dt, steps)
            if different:
                raise InputError(
                    f"{path.name} holds the operator of another problem ({'; '.join(different)}); "
                    "assemble the operator of this one"
                )
            n = len(mesh)
            shapes = {"single": (4 * n, 4 * n), "double": (4 * n, 2 * n), "hyper": (2 * n, 2 * n)}
            found = {
                key: checks.array(path.name, key, file[key][:steps], (steps, *shapes[key]))
                for key in shapes
            }
    except InputError:
        raise
    except (KeyError, ValueError, TypeError, OSError, AttributeError) as error:
        raise InputError(
            f"{path.name}: no HDF5 file of boundary element blocks, or a damaged one "
            f"({checks.quote(str(error))}); remove it, and it is made again"
        ) from error
    return EnergeticBlocks(mesh, material.c_p, material.c_s, dt, **found)


def _differences(
    file: Any, mesh: BoundaryMesh, material: LinearElastic, dt: float, steps: int
) -> list[str]:
    if file.attrs["format"] != FORMAT:
        return [f"in the format {checks.quote(file.attrs['format'])}, here '{FORMAT}'"]
    points = file["points"][:]
    if points.shape != mesh.points.shape:
        return [f"{len(points)} elements, here {len(mesh)}"]
    different = []
    for name, here in (("c_p", material.c_p), ("c_s", material.c_s), ("dt", dt)):
        there = float(file.attrs[name])
        if not abs(there - here) <= EQUAL * abs(here):
            different.append(f"{name} = {there:.6g}, here {here:.6g}")
    if (
        not np.abs(points - mesh.points).max() <= EQUAL * mesh.size
        or tuple(file["loop_sizes"][:]) != mesh.loop_sizes
    ):
        different.append("other points of the boundary")
    if bool(file.attrs["exterior"]) != mesh.exterior:
        different.append("the other side of the boundary")
    if len(file["single"]) < steps:
        different.append(f"{len(file['single'])} time steps, here {steps}")
    return different
