"""Read deformed bodies in the plane and their contact tractions from the folder of a run, to draw them.

A run that writes fields (``fields=fem.XDMF(every=...)``) and records ``Contact()`` leaves all that is needed there.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core.algebra import Array, Indices
from ..core.errors import InputError
from ..core.files import FIELDS, frames_of
from ..run.files.folder import HISTORY_H5
from ..run.files.reading import read_run


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
    """Hold fields of a run: ``points`` (n, 2) [m], ``cells`` (c, corners), times ``t`` (f,) [s], (file, group) each."""

    points: Array
    cells: Indices
    t: Array
    places: tuple[tuple[Path, str], ...]

    def at(self, t: float) -> tuple[float, Array, Array]:
        """Return (its time [s], u (n, 2) [m], von Mises stress (c,) [Pa]) of the frame nearest to t."""
        import h5py

        row = int(np.argmin(np.abs(self.t - t)))
        path, group = self.places[row]
        with h5py.File(path) as file:
            return float(self.t[row]), file[group]["u"][:, :2], file[group]["von_mises"][:]


def read_tractions(folder: str | Path) -> Tractions:
    """Read tractions from the history of a run in the plane. InputError for a folder without one."""
    run = read_run(folder)
    contact, history = run.contact, run.history
    if contact is None or "pressure" not in history or contact.points.shape[1] != 2:
        raise InputError(f"'{folder}' is not of a finished run in the plane with Contact(): run it with both")
    turned = np.column_stack([-contact.normals[:, 1], contact.normals[:, 0]])
    along = np.count_nonzero(contact.normals, axis=1) == 1  # an axis: tangents of nodal frames are along the other one
    tangents = np.where(along[:, None], np.abs(turned), turned)
    shear = -history["traction_t"][:, :, 0] if "traction_t" in history else np.zeros_like(history["pressure"])
    return Tractions(contact.points, contact.normals, tangents, history["t"], history["pressure"], shear)


def read_frames(folder: str | Path) -> StoredFrames:
    """Read the frames from the fields of a run. InputError for a folder without them."""
    import h5py

    fields, history = Path(folder) / FIELDS, Path(folder) / HISTORY_H5
    places = dict(sorted(frames_of(Path(folder)).items()))
    if not places or not history.is_file():
        raise InputError(f"no frames in {fields}: run it with out and fields=fem.XDMF(every=...)")
    with h5py.File(history) as file:
        times = dict(zip(file["k"][:].astype(int), file["t"][:], strict=True))
    with h5py.File(fields / "mesh.h5") as file:
        t = np.array([times[k] for k in places])
        return StoredFrames(file["points"][:, :2], file["cells"][:], t, tuple(places.values()))
