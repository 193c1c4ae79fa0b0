"""Sum up what a part of a contact surface does to its body.

That is uplift, opening, slip, thrust, N, T, M and theta.

With the contact direction n of a point (from the body to its obstacle), its tangent t and the
reactions of the body on the support, the force on the body at a point X is f = -r_n n - r_t t. Over
the points of a part, about its centre c:

    uplift = 1 - L_contact / L (by weight),    F = sum f,
    M = sum (X - c) x f   (anticlockwise positive)
    N = -F·n̄ (compression positive),  T = F·t̄,  e = M / N,    height = sum r_n (X - c)·up / sum r_n

n̄ is the mean direction of the part by weight, t̄ = (-n̄_y, n̄_x), up the last axis. On level
ground N is the vertical force, T points to the right, and N acts at the distance e to the right of
the centre; of a wall N is the thrust and ``height`` the height of its line of action above the
centre. Positions are those of the undeformed body. In space T and e are the sizes of vectors in the
plane across n̄, whose components along the axes stand beside them:

    T = F + N n̄,    e = M x n̄ / N   (from the centre to where N acts)

The rotation theta and the settlement u·n̄ of the centre are those of the smallest rigid motion u +
theta x (X - c) whose normal displacements fit those of the part best, by weight; nan for what they
say nothing about: a level base does not tell how it turns about the vertical. ``Resultants`` adds
what a report asks of a part:

    level = h / H,    sliding = (sum w slip / sum w)·t̄,
    margin = 1 - |T| / sum limit(r_n)    (mu N - |T| over mu N)

h is the height of the thrust above the lowest point of the part, H the height of the part;
pressure_low and pressure_high are r_n / weight at its two ends, of the heel and the toe of a wall's
base.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from ...core.algebra import Array, Indices, Mask
from ...core.checks import array, column_name, function, instance, mask, optional, provides
from ...core.corners import make_tangent_vectors
from ...core.errors import InputError
from ...core.step import AXES
from ...core.surfaces import ContactSurface

Where = Callable[[Array, Array], Mask]
# with points (m, d), normals (m, d), weights (m,): a ContactSurface, the contact of a RunFolder
Geometry = Any
# of the largest singular value of the rigid modes of a part: less says nothing about a motion
DETERMINED = 1e-9


def check_part(name: str, centre: Any, where: Any, normal: Any) -> None:
    """Raise InputError unless centre and direction are numbers and the mask is a function."""
    optional(array, f"part '{name}'", "the centre", centre, (None,), unit="metres")
    optional(
        function, f"part '{name}'", "where", where, "give a function of points and normals, or None"
    )
    optional(array, f"part '{name}'", "normal", normal, (None,))


class Part:
    """Hold the points of a contact surface that a mask picks.

    With them come the directions of its resultants.

    ``where``: points (m, d), normals (m, d) -> mask (m,); all points when None. InputError for a
    part without points, a centre of other dimension, or directions that cancel (a closed ring),
    unless ``normal`` says which N is meant. ``centre`` None: the middle of the part by weight, at
    the level of its lowest point. ``slots``: the numbers of the conditions whose share in it is
    held; those of one rank, all when None.
    """

    def __init__(
        self,
        name: str,
        geometry: Geometry,
        centre: Sequence[float] | None,
        where: Where | None,
        normal: Sequence[float] | None,
        slots: Indices | None = None,
    ) -> None:
        check_part(name, centre, where, normal)
        points, normals = geometry.points, geometry.normals
        given = np.ones(len(points), dtype=bool) if where is None else where(points, normals)
        chosen = mask(
            f"part '{name}'", "what where(points, normals) returns", given, (len(points),)
        )
        if not chosen.any():
            raise InputError(f"part '{name}' has no contact points: change its mask")
        weights, box = geometry.weights[chosen], points[chosen]
        middle = (
            np.append((weights @ box / weights.sum())[:-1], box[:, -1].min())
            if centre is None
            else centre
        )
        self.centre = array(f"part '{name}'", "the centre", middle, points.shape[1:], unit="metres")
        self.name, self.dimension = name, points.shape[1]
        self.weights, self.normals, self.arms = (
            geometry.weights[chosen],
            normals[chosen],
            points[chosen] - self.centre,
        )
        self.normal, self.whole = self._direction(name, normal), self.weights.sum()
        # run folders do not tell of nodes
        places = np.unique(points, axis=0, return_inverse=True)[1].ravel()
        self.tangents = make_tangent_vectors(normals, getattr(geometry, "nodes", places))[chosen]
        self.fit, self.ends = self._fit().T, self._ends(box).T
        lowest, self.tall = float(box[:, -1].min() - self.centre[-1]), float(np.ptp(box[:, -1]))
        self.lowest = lowest if self.tall > DETERMINED * np.ptp(box, axis=0).max() else np.nan
        slots = np.arange(len(points)) if slots is None else slots
        self.mask = chosen[slots]
        for kept in ("weights", "normals", "arms", "tangents", "fit", "ends"):
            setattr(self, kept, getattr(self, kept)[(np.cumsum(chosen) - 1)[slots[self.mask]]])

    def _direction(self, name: str, given: Sequence[float] | None) -> Array:
        direction = self.weights @ self.normals if given is None else given
        direction = array(f"part '{name}'", "normal", direction, self.centre.shape)
        size = float(np.linalg.norm(direction))
        if size <= 1e-6 * (self.weights.sum() if given is None else 1.0):
            raise InputError(
                f"part '{name}': its contact directions cancel: give the direction of N by normal="
            )
        return np.asarray(direction / size)

    def _ends(self, points: Array) -> Array:
        """Return rows (2, k) that make the pressures at the low and the high end of r_n.

        The ends are those along the longest axis.
        """
        along = points[:, np.argmax(np.ptp(points, axis=0))]
        slack = DETERMINED * np.ptp(along)
        ends = np.stack([along <= along.min() + slack, along >= along.max() - slack])
        return np.asarray(ends / (ends @ self.weights)[:, None])

    def _fit(self) -> Array:
        """Return rows (q + 1, k) that make theta and settlement of normal displacements.

        What is not determined is nan.
        """
        size = float(np.max(np.abs(self.arms), initial=0.0)) or 1.0
        turns = [one / size for one in turning(self.arms, self.normals)]
        root, modes = np.sqrt(self.weights), np.column_stack([self.normals, *turns])
        asked = np.roll(block_diag(self.normal, np.eye(len(turns)) / size), -1, axis=0)
        inverse = np.linalg.pinv(root[:, None] * modes, rcond=DETERMINED) * root
        told = np.linalg.norm(asked @ inverse @ modes, axis=1) > DETERMINED * np.linalg.norm(
            asked, axis=1
        )
        return np.where(told[:, None], asked @ inverse, np.nan)

    def sums(self, r_n: Array, r_t: Array | None, active: Mask) -> Array:
        """Return (rows, …) of sums.

        They are F, M, Σ r_n, Σ r_n (X - c)·up and the open weight of rows of reactions, (rows, m),
        (rows, m, d - 1) or None, and of closed conditions (rows, m).
        """
        r_n = r_n[:, self.mask]
        at_points = -r_n[:, :, None] * self.normals
        if r_t is not None:
            at_points = at_points - np.einsum("rkc,kdc->rkd", r_t[:, self.mask], self.tangents)
        moments = [one.sum(axis=1) for one in turning(self.arms, at_points)]
        lifted = (~active[:, self.mask]) @ self.weights
        return np.column_stack(
            [at_points.sum(axis=1), *moments, r_n.sum(axis=1), r_n @ self.arms[:, -1], lifted]
        )

    def tops(self, gap: Array, slip: Array | None) -> Array:
        """Return (rows, 1 or 2) the largest gap and slip.

        They are those of rows (rows, m), (rows, m, d - 1) or None.
        """
        found = [gap[:, self.mask]]
        if slip is not None and slip.shape[2]:
            found.append(np.linalg.norm(slip[:, self.mask], axis=2))
        return np.column_stack([one.max(axis=1, initial=-np.inf) for one in found])

    def quantities(self, sums: Array, tops: Array) -> dict[str, Array]:
        """Return quantity -> (rows,) of sums and tops of all its points.

        They are nan where N or Σ r_n is zero.
        """
        d = self.dimension
        force, moment, (thrust, raised, lifted) = 0.0 + sums[:, :d], sums[:, d:-3], sums.T[-3:]
        compression = 0.0 - force @ self.normal
        across, lever = force + compression[:, None] * self.normal, np.zeros((len(sums), d))

        def along(kind: str, vectors: Array) -> dict[str, Array]:
            return {f"{kind}_{axis}": vectors[:, i] for i, axis in enumerate(AXES[:d])}

        found = {"uplift": lifted / self.whole} | dict(
            zip(("opening", "slip"), tops.T, strict=False)
        )
        found |= along("force", force) | {"N": compression, "T": np.linalg.norm(across, axis=1)}
        if d == 2:
            found |= {"T": force @ [-self.normal[1], self.normal[0]], "M": moment[:, 0]}
            return found | {
                "e": _ratio(moment[:, 0], compression),
                "height": _ratio(raised, thrust),
            }
        if d == 3:
            lever = np.cross(moment, self.normal)
            found |= (
                along("T", across) | along("M", moment) | along("e", _ratio(lever.T, compression).T)
            )
        return found | {
            "e": _ratio(np.linalg.norm(lever, axis=1), compression),
            "height": _ratio(raised, thrust),
        }


def turning(arms: Array, vectors: Array) -> list[Array]:
    """Return the components (…) of arms x vectors (…, d).

    They are x, y, z in space, z in the plane, none on a line.
    """
    pairs = {1: (), 2: ((0, 1),), 3: ((1, 2), (2, 0), (0, 1))}[arms.shape[-1]]
    return [arms[..., i] * vectors[..., j] - arms[..., j] * vectors[..., i] for i, j in pairs]


def _ratio(one: Array, other: Array) -> Array:
    return np.divide(one, other, out=np.full(one.shape, np.nan), where=other != 0.0)


def contact_summary(
    history: Mapping[str, Array],
    geometry: Geometry,
    *,
    centre: Sequence[float],
    name: str = "contact",
    where: Where | None = None,
    normal: Sequence[float] | None = None,
) -> dict[str, Array]:
    """Return the resultants of a run that recorded ``Contact()``.

    They are quantity -> (rows,), without theta and settlement.

    ``geometry``: the surface of the problem (then collective), or ``read_run(folder).contact``.
    Slip and friction count where they were recorded, with friction. InputError without arrays of
    the contact points.
    """
    instance("contact_summary", "history", history, Mapping, "give the history of a solution")
    provides(
        "contact_summary",
        "geometry",
        geometry,
        ("points", "normals", "weights"),
        "give a contact surface",
    )
    column_name("part name", name)
    missing = [column for column in ("pressure", "gap", "active") if column not in history]
    if missing:
        raise InputError(
            f"the history has no column {missing[0]}: record Contact(), and read history.h5"
        )
    geometry = geometry.whole() if isinstance(geometry, ContactSurface) else geometry
    part = Part(name, geometry, centre, where, normal)
    rows, m = len(history["t"]), len(geometry.weights)

    def per_point(column: str) -> Array:
        return np.reshape(np.asarray(history[column], dtype=float), (rows, m, -1))

    r_t = per_point("traction_t") * geometry.weights[:, None] if "traction_t" in history else None
    slip = per_point("slip") if "slip" in history else None
    sums = part.sums(
        per_point("pressure")[:, :, 0] * geometry.weights, r_t, per_point("active")[:, :, 0] > 0.5
    )
    return part.quantities(sums, part.tops(per_point("gap")[:, :, 0], slip))
