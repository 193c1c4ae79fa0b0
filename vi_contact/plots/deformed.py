"""Read deformed bodies in the plane and their contact tractions from the folder of a run, to draw them.

A run that writes fields (``fields=fem.XDMF(every=...)``) and records ``Contact()`` leaves all that is needed there.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core.algebra import Array, Indices
from ..core.errors import InputError
from ..core.files import FIELDS
from ..run.files.folder import HISTORY_H5


@dataclass(frozen=True)
class Tractions:
    """Hold contact tractions on the body: ``points`` (m, 2) [m]; ``normals``, ``tangents`` (m, 2), the normals towards
    the support; times ``t`` (k,) [s]; pressures ``normal`` (k, m) [Pa] and shear tractions ``shear`` (k, m) [Pa] of the
    support on the body along the tangents."""

    points: Array
    normals: Array
    tangents: Array
    t: Array
    normal: Array
    shear: Array

    def at(self, t: float) -> tuple[Array, Array]:
        """Return (pressure, shear) of the step that ends next to t."""
        row = int(np.argmin(np.abs(self.t - t)))
        return self.normal[row], self.shear[row]


@dataclass(frozen=True)
class StoredFrames:
    """Hold the fields of a run: ``points`` (n, 2) [m], ``cells`` (c, corners), times ``t`` (f,) [s], their files."""

    points: Array
    cells: Indices
    t: Array
    paths: tuple[Path, ...]

    def at(self, t: float) -> tuple[float, Array, Array]:
        """Return (its time [s], u (n, 2) [m], von Mises stress (c,) [Pa]) of the frame nearest to t."""
        import h5py

        row = int(np.argmin(np.abs(self.t - t)))
        with h5py.File(self.paths[row]) as file:
            return float(self.t[row]), file["u"][:, :2], file["von_mises"][:]


def read_tractions(folder: str | Path) -> Tractions:
    """Read tractions from the history of a run in the plane. InputError for a folder without one."""
    import h5py

    path = Path(folder) / HISTORY_H5
    if not path.is_file():
        raise InputError(f"{path} does not exist: give the folder of a finished run with contact in it")
    with h5py.File(path) as file:
        if "pressure" not in file or file["contact/points"].shape[1] != 2:
            raise InputError(f"{path} is not of a body in the plane with the recorder Contact(): run it with both")
        points, normals, pressure = file["contact/points"][:], file["contact/normals"][:], file["pressure"][:]
        shear = -file["traction_t"][:, :, 0] if "traction_t" in file else np.zeros_like(pressure)
        return Tractions(points, normals, _tangents(normals), file["t"][:], pressure, shear)


def _tangents(normals: Array) -> Array:
    """Return the tangents of nodal frames: along an axis where the normal is along the other one, else (-n_y, n_x)."""
    turned = np.column_stack([-normals[:, 1], normals[:, 0]])
    axis = np.count_nonzero(normals, axis=1) == 1
    return np.where(axis[:, None], np.abs(turned), turned)


def read_frames(folder: str | Path) -> StoredFrames:
    """Read the frames from the fields of a run. InputError for a folder without them."""
    import h5py

    fields, history = Path(folder) / FIELDS, Path(folder) / HISTORY_H5
    paths = sorted(fields.glob("frame_*.h5"))
    if not paths or not history.is_file():
        raise InputError(f"no frames in {fields}: run it with out and fields=fem.XDMF(every=...)")
    with h5py.File(history) as file:
        times = dict(zip(file["k"][:].astype(int), file["t"][:], strict=True))
    with h5py.File(fields / "mesh.h5") as file:
        t = np.array([times[int(path.stem.removeprefix("frame_"))] for path in paths])
        return StoredFrames(file["points"][:, :2], file["cells"][:], t, tuple(paths))
