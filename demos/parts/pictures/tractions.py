"""Read contact tractions from the folder of a run that records ``Contact()``, to draw them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.practice.plots.deformed import compute_tangents, find_nearest
from vi_contact.run.files.reading import read_run


@dataclass(frozen=True)
class Tractions:
    """Hold contact tractions on the body.

    There are ``points``, ``normals`` (m, d) [m], the normals towards the support; ``tangents`` (m,
    d, d - 1); times ``t`` (k,) [s]; pressures ``normal`` (k, m) [Pa] and shear tractions ``shear``
    (k, m, d - 1) [Pa] of the support on the body along the tangents.
    """

    points: Array
    normals: Array
    tangents: Array
    t: Array
    normal: Array
    shear: Array

    def at(self, t: float) -> tuple[Array, Array]:
        """Return (pressure (m,), shear (m, d) along the axes) of the step that ends next to t."""
        (row,) = find_nearest(self.t, [t])
        return self.normal[row], np.einsum("mj,mij->mi", self.shear[row], self.tangents)


def read_tractions(folder: str | Path) -> Tractions:
    """Read tractions from the history of a run. InputError for a folder without one."""
    run = read_run(folder)
    contact, history = run.contact, run.history
    if contact is None or "pressure" not in history or contact.points.shape[1] < 2:
        raise InputError(
            f"'{folder}' is not a finished run in plane or space with Contact(): finish one"
        )
    pressure = history["pressure"]
    tangents = compute_tangents(contact)
    shear = (
        -history["traction_t"]
        if "traction_t" in history
        else np.zeros((*pressure.shape, tangents.shape[2]))
    )
    return Tractions(contact.points, contact.normals, tangents, history["t"], pressure, shear)
