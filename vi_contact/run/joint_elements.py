"""Say when elements at a joint are too long for the way over which it loses its strength.

A joint that opens loses its strength over a zone at the tip of its crack, about E G_f/f_t² long,
and a fault that slips over about mu* dc/(sigma (mu_s - mu_d)), mu* = G/(1 - nu). Points that are
further apart are lost one by one, in jumps that release energy as waves of the mesh, and forces at
the crack are too large. Elements of a half and of a third of these lengths follow it. Sources:
A. Hillerborg, Int. J. Cem. Compos. 7 (1985) 33-39; S. M. Day, L. A. Dalguer, N. Lapusta and Y. Liu,
J. Geophys. Res. 110 (2005) B12307.
"""

from typing import Any

import numpy as np

from ..core.algebra import Array
from ..core.problem import ContactProblem

BARRIER = 10.0  # a coefficient of friction beyond any other: the ends of a fault, which hold
NEIGHBOURS = 8  # cells around a point of which the softest counts


def joint_warning(problem: ContactProblem) -> str | None:
    """Return a sentence where the elements at a joint are too long. Collective.

    At a point of distance h to its neighbours, of the law's steepest losses S,

        h > E G_f/(2 f_t²) = E/(4 S_n),    h > mu*/(3 sigma S_t)

    where sigma is the prestress.

    Args:
        problem: with or without a joint.

    Returns:
        The sentence, about the point that is the furthest beyond; None where there is none, or
        nothing is known of the elements or of the law.
    """
    law: Any = problem.joint
    surface = problem.surface
    forms: Any = getattr(problem.system.space, "forms", None)
    known = law is not None and hasattr(law, "softening_of") and bool(getattr(forms, "fields", {}))
    dimension = surface.points.shape[1]
    if not known or dimension == 1 or not surface.total:
        return None
    pressure = np.zeros(surface.count)
    if getattr(law, "prestress", None) is not None:
        pressure = law.prestress.spread("normal", surface.count)
    slope = law.softening_of(pressure)
    still = np.zeros(surface.count)
    slip = np.zeros(surface.tangents.shape)
    at_rest = law.strength(law.start(surface.count), still, still, slip, slip, 1.0)
    E, shear = _find_moduli(forms, surface.points)
    thickness = forms.section.thickness
    h = surface.weights / thickness if dimension == 2 else np.sqrt(surface.weights)

    # What is lost at once has no zone, and no elements follow it.
    steep = np.where(np.isfinite(slope.tension), slope.tension, 0.0)
    opening = 4.0 * h * steep / E
    slipping = np.where(at_rest.mu > BARRIER, 0.0, 3.0 * h * pressure * slope.mu / shear)
    rows = np.asarray(surface.everywhere(np.column_stack([h, opening, slipping])))
    for column, words in ((1, OPENS), (2, SLIPS)):
        worst = rows[np.argmax(rows[:, column])]
        if worst[column] > 1.0:
            return words.format(h=worst[0], most=worst[0] / worst[column])
    return None


OPENS = (
    "elements of {h:.3g} m at the joint are longer than E G_f/(2 f_t²) = {most:.3g} m, and points "
    "are lost one by one with forces that are too large: take smaller elements there, or more "
    "fracture energy"
)
SLIPS = (
    "elements of {h:.3g} m at the fault are longer than mu* dc/(3 sigma (mu_s - mu_d)) = "
    "{most:.3g} m, a third of the zone in which it weakens, and the rupture runs too fast or too "
    "slowly: take smaller elements there, or a longer distance"
)


def _find_moduli(forms: Any, points: Array) -> tuple[Array, Array]:
    """Return E and G/(1 - nu) (m,) [Pa] of the softest of the nearest cells of this rank.

    Args:
        forms: of the body, with Lamé's constants times the thickness.
        points: (m, d) [m].
    """
    # Imported here, as runs without finite elements need no DOLFINx.
    from ..fem.output.sizes import measure_cells

    _, centroids = measure_cells(forms.space.mesh)
    owned = len(centroids)
    thickness = forms.section.thickness
    names = ("lame", "shear", "lame_out")
    lame, G, out = (forms.cellwise(name)[:owned] / thickness for name in names)

    # In plane stress lambda is already that of the plane.
    plane = 4.0 * G * (lame + G) / (lame + 2.0 * G)
    young = G * (3.0 * lame + 2.0 * G) / (lame + G)
    if points.shape[1] == 2:
        young = np.where(out == lame, young, plane)
    count = min(NEIGHBOURS, owned)
    if not count:
        return np.full(len(points), np.inf), np.full(len(points), np.inf)
    from scipy.spatial import cKDTree  # late: it takes a while

    _, near = cKDTree(centroids).query(points, k=count)
    near = np.reshape(near, (len(points), count))
    return young[near].min(axis=1), 0.5 * plane[near].min(axis=1)
