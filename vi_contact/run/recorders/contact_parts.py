"""Sum up what a part of a contact surface does to its body.

That is uplift, opening, slip, thrust, N, T, M and theta.

With the contact direction n of a point (from the body to its obstacle), its tangent t and the
reactions of the body on the support, the force on the body at a point X is f = -r_n n - r_t t. Over
the points of a part, about its centre c:

    uplift = 1 - L_contact / L (by weight),    F = sum f,
    M = sum (X - c) x f   (anticlockwise positive)
    N = -F·n̄ (compression positive),  T = F·t̄,  e = M / N,
    height = sum r_n (X - c)·up / sum r_n

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
pressure_low and pressure_high are r_n / weight at its two ends, which are toe and heel of a wall's
base. Points that are hardly covered by the other side have no pressure (``uncovered``): the ends
are then the covered points next to them.
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

Where = Callable[[Array, Array], Mask]  # points (m, d) [m], normals (m, d) -> mask (m,) of a part
# what has points (m, d), normals (m, d), weights (m,): a ContactSurface, the contact of a RunFolder
Geometry = Any
# of the largest singular value of the rigid modes of a part: less says nothing about a motion
DETERMINED = 1e-9
ROUNDING = 1e-9  # of the largest side of the contact: points so near to a box are in it
CANCEL = 1e-6  # of the weight of a part: normals whose sum is shorter have no mean direction


def check_part(name: str, centre: Any, where: Any, normal: Any) -> None:
    """Raise InputError unless centre and direction are numbers and the mask is a function.

    Args:
        name: of the part, for the sentence.
        centre: of the part (d,) [m], or None.
        where: what picks the points, or None.
        normal: direction of N (d,), or None.
    """
    owner = f"part '{name}'"
    optional(array, owner, "the centre", centre, (None,), unit="metres")
    remedy = "give a function of points and normals, or None"
    optional(function, owner, "where", where, remedy)
    optional(array, owner, "normal", normal, (None,))


class Part:
    """Hold a part of a contact surface: its points, and what makes its resultants of their values.

    Centre, direction and sizes are those of the whole part; arrays have a row for each of the k
    points of it whose condition this rank holds.

    Attributes:
        name: of the part.
        dimension: d.
        centre: (d,) [m], about which moments count.
        normal: (d,) unit vector n̄ towards the support, the direction of N.
        whole: sum of the weights of the whole part [m²].
        lowest: height of the lowest point above the centre [m]; nan where the part has no height.
        tall: height of the part [m].
        axis: along which the part is longest.
        span: coordinates of its two ends along this axis [m].
        mask: (m,) which conditions of this rank are in the part.
        weights: (k,) areas of the points [m²].
        normals: (k, d) their contact directions.
        tangents: (k, d, d - 1) their tangents.
        arms: (k, d) X - c [m].
        fit: (k, q + 1): u_n @ fit is theta (q,) [rad] and the settlement [m].
        ends: (k, 2): r_n @ ends is the pressure at the low and at the high end [Pa].
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
        """Pick the points, and find centre, direction and sizes of the part.

        Args:
            name: of the part.
            geometry: all conditions of the surface, of all ranks.
            centre: (d,) [m]; None for the middle of the part by weight, at the level of its lowest
                point.
            where: picks the points; None for all of them.
            normal: which N is meant; None for the mean direction of the part by weight.
            slots: the numbers of the conditions whose rows are held, those of one rank; None for
                all.

        Raises:
            InputError: the part has no points, the centre is of another dimension, or the
                directions cancel (a closed ring) and no ``normal`` is given.
        """
        check_part(name, centre, where, normal)
        self.name = name
        owner = f"part '{name}'"

        # The points of the part, out of all points of the surface.
        points = geometry.points
        normals = geometry.normals
        chosen = np.ones(len(points), dtype=bool)
        if where is not None:
            meaning = "what where(points, normals) returns"
            chosen = mask(owner, meaning, where(points, normals), (len(points),))
        if not chosen.any():
            raise InputError(f"part '{name}' has no contact points: change its mask")
        self.dimension = points.shape[1]
        self.weights = geometry.weights[chosen]
        self.normals = normals[chosen]
        self.whole = self.weights.sum()
        places = points[chosen]

        # Centre, direction and height.
        place: Any = centre
        if centre is None:
            middle = self.weights @ places / self.weights.sum()
            place = np.append(middle[:-1], places[:, -1].min())
        self.centre = array(owner, "the centre", place, points.shape[1:], unit="metres")
        self.arms = places - self.centre
        self.normal = self._find_direction(normal)
        self.tall = float(np.ptp(places[:, -1]))
        self.lowest = float(places[:, -1].min() - self.centre[-1])
        if not self.tall > DETERMINED * np.ptp(places, axis=0).max():
            self.lowest = np.nan  # a level part

        # The tangents of a node are those of all its conditions; run folders do not tell of nodes,
        # whose places stand for them.
        numbers = np.unique(points, axis=0, return_inverse=True)[1].ravel()
        nodes = getattr(geometry, "frame_nodes", numbers)
        self.tangents = make_tangent_vectors(normals, nodes)[chosen]
        self.fit = self._fit_motion().T
        uncovered = getattr(geometry, "uncovered", None)
        covered = np.ones(len(places), dtype=bool) if uncovered is None else ~uncovered[chosen]
        self.axis = int(np.argmax(np.ptp(places, axis=0)))
        along = places[:, self.axis]
        self.span = (float(along.min()), float(along.max()))
        self.ends = self._average_ends(along, covered).T

        # Of all this only the rows of one rank stay.
        slots = np.arange(len(points)) if slots is None else slots
        self.mask = chosen[slots]
        own = (np.cumsum(chosen) - 1)[slots[self.mask]]
        for attribute in ("weights", "normals", "arms", "tangents", "fit", "ends"):
            setattr(self, attribute, getattr(self, attribute)[own])

    def _find_direction(self, normal: Sequence[float] | None) -> Array:
        """Return the unit vector n̄: along ``normal``, or the mean of the part's by weight."""
        direction = self.weights @ self.normals if normal is None else normal
        owner = f"part '{self.name}'"
        direction = array(owner, "normal", direction, self.centre.shape)
        size = float(np.linalg.norm(direction))
        if size <= CANCEL * (self.weights.sum() if normal is None else 1.0):
            raise InputError(
                f"{owner}: its contact directions cancel: give the direction of N by normal="
            )
        return np.asarray(direction / size)

    def _average_ends(self, along: Array, covered: Mask) -> Array:
        """Return rows (2, k) that make of r_n the pressures at the low and the high end.

        The ends are those along the longest axis; the pressure there is the sum of r_n over the sum
        of the weights.

        Args:
            along: coordinates of the points along this axis (k,) [m].
            covered: (k,) which points have a pressure; all count where none has.
        """
        counts = covered if covered.any() else ~covered
        slack = DETERMINED * np.ptp(along)
        low = along[counts].min() + slack
        high = along[counts].max() - slack
        ends = np.stack([counts & (along <= low), counts & (along >= high)])
        return np.asarray(ends / (ends @ self.weights)[:, None])

    def _fit_motion(self) -> Array:
        """Return rows (q + 1, k) that make of u_n the rotation theta and the settlement.

        A rigid motion (u, theta) has the normal displacements u·n + theta·(arm x n). The smallest
        one that fits u_n best, by weight, is

            p = (√w modes)⁺ √w u_n,    p = (u, size theta),    modes = [n, (arm x n) / size]

        with theta in units of 1 / size, so that its entries compare with those of u. A row of what
        the points do not determine is nan.
        """
        size = float(np.max(np.abs(self.arms), initial=0.0)) or 1.0
        turns = [component / size for component in cross(self.arms, self.normals)]
        root = np.sqrt(self.weights)
        modes = np.column_stack([self.normals, *turns])
        inverse = np.linalg.pinv(root[:, None] * modes, rcond=DETERMINED) * root

        # What is asked of p: theta, and after it the settlement u·n̄.
        asked = np.roll(block_diag(self.normal, np.eye(len(turns)) / size), -1, axis=0)

        # asked p of a motion that u_n does not see is zero: nothing is said about such a row.
        seen = np.linalg.norm(asked @ inverse @ modes, axis=1)
        is_determined = seen > DETERMINED * np.linalg.norm(asked, axis=1)
        return np.where(is_determined[:, None], asked @ inverse, np.nan)

    def sum_up(self, r_n: Array, r_t: Array | None, active: Mask) -> Array:
        """Return what adds up over the points of this rank, for several states at once.

        Args:
            r_n: normal reactions (rows, m) [N].
            r_t: tangential reactions (rows, m, d - 1) [N], or None.
            active: which conditions are closed (rows, m).

        Returns:
            (rows, d + q + 3): F [N], M [N m], Σ r_n [N], Σ r_n (X - c)·up [N m], and the weight
            that is open [m²].
        """
        r_n = r_n[:, self.mask]
        forces = -r_n[:, :, None] * self.normals  # on the body
        if r_t is not None:
            forces = forces - np.einsum("rkc,kdc->rkd", r_t[:, self.mask], self.tangents)
        moments = [component.sum(axis=1) for component in cross(self.arms, forces)]
        is_open = ~active[:, self.mask]
        return np.column_stack(
            [
                forces.sum(axis=1),
                *moments,
                r_n.sum(axis=1),
                r_n @ self.arms[:, -1],
                is_open @ self.weights,
            ]
        )

    def find_largest(self, gap: Array, slip: Array | None) -> Array:
        """Return the largest gap [m] and, with friction, slip [m] of this rank: (rows, 1 or 2).

        Args:
            gap: (rows, m) [m].
            slip: (rows, m, d - 1) [m], or None.
        """
        sizes = [gap[:, self.mask]]
        if slip is not None and slip.shape[2]:
            sizes.append(np.linalg.norm(slip[:, self.mask], axis=2))
        return np.column_stack([values.max(axis=1, initial=-np.inf) for values in sizes])

    def derive(self, sums: Array, largest: Array) -> dict[str, Array]:
        """Return quantity -> (rows,), by the equations at the head of this file.

        e and height are nan where N or Σ r_n is zero.

        Args:
            sums: of ``sum_up``, over all ranks.
            largest: of ``find_largest``, of all ranks.
        """
        d = self.dimension
        force = 0.0 + sums[:, :d]  # no negative zeros
        moment = sums[:, d:-3]
        thrust, raised, open_weight = sums.T[-3:]
        compression = 0.0 - force @ self.normal
        across = force + compression[:, None] * self.normal

        # What there is in any dimension.
        values = {"uplift": open_weight / self.whole}
        values |= dict(zip(("opening", "slip"), largest.T, strict=False))
        values |= _name_components("force", force)
        values["N"] = compression
        values["T"] = np.linalg.norm(across, axis=1)
        e = _divide(np.zeros(len(sums)), compression)

        if d == 2:  # T, M and e have signs
            values["T"] = force @ [-self.normal[1], self.normal[0]]
            values["M"] = moment[:, 0]
            e = _divide(moment[:, 0], compression)
        if d == 3:  # they are vectors: T and e are their sizes
            lever = np.cross(moment, self.normal)
            values |= _name_components("T", across)
            values |= _name_components("M", moment)
            values |= _name_components("e", _divide(lever.T, compression).T)
            e = _divide(np.linalg.norm(lever, axis=1), compression)
        values["e"] = e
        values["height"] = _divide(raised, thrust)
        return values


def _name_components(quantity: str, vectors: Array) -> dict[str, Array]:
    """Return <quantity>_x, … -> (rows,) of vectors (rows, d)."""
    return {f"{quantity}_{axis}": vectors[:, i] for i, axis in enumerate(AXES[: vectors.shape[1]])}


def cross(arms: Array, vectors: Array) -> list[Array]:
    """Return the components (…) of arms x vectors, both (…, d).

    They are x, y, z in space, z in the plane, none on a line.
    """
    pairs = {1: (), 2: ((0, 1),), 3: ((1, 2), (2, 0), (0, 1))}[arms.shape[-1]]
    return [arms[..., i] * vectors[..., j] - arms[..., j] * vectors[..., i] for i, j in pairs]


def _divide(numerator: Array, denominator: Array) -> Array:
    """Return the quotient, nan where the denominator is zero."""
    quotient = np.full(numerator.shape, np.nan)
    return np.divide(numerator, denominator, out=quotient, where=denominator != 0.0)


def contact_summary(
    history: Mapping[str, Array],
    geometry: Geometry,
    *,
    centre: Sequence[float],
    name: str = "contact",
    where: Where | None = None,
    normal: Sequence[float] | None = None,
) -> dict[str, Array]:
    """Return the resultants of a part in all steps of a run that recorded ``Contact()``.

    The equations are at the head of this file. Slip and friction count where they were recorded,
    with friction.

    Args:
        history: column -> values, of a solution or a run folder, with arrays of the contact points.
        geometry: the surface of the problem (then collective), or ``read_run(folder).contact``.
        centre: (d,) [m], about which moments count.
        name: of the part, for sentences.
        where: points (m, d) [m], normals (m, d) -> mask (m,) of the part; None for all.
        normal: direction of N towards the support; None for the mean contact direction.

    Returns:
        Quantity -> (rows,), without theta and settlement, which need displacements.

    Raises:
        InputError: the history has no arrays of the contact points, or the part makes no sense.
    """
    instance("contact_summary", "history", history, Mapping, "give the history of a solution")
    needed = ("points", "normals", "weights")
    provides("contact_summary", "geometry", geometry, needed, "give a contact surface")
    column_name("part name", name)
    missing = [column for column in ("pressure", "gap", "active") if column not in history]
    if missing:
        raise InputError(
            f"the history has no column {missing[0]}: record Contact(), and read history.h5"
        )
    geometry = geometry.whole() if isinstance(geometry, ContactSurface) else geometry
    part = Part(name, geometry, centre, where, normal)
    rows = len(history["t"])
    m = len(geometry.weights)

    def read(column: str) -> Array:
        """Return a column as (rows, m, components)."""
        return np.reshape(np.asarray(history[column], dtype=float), (rows, m, -1))

    # Reactions are pressures times areas.
    r_n = read("pressure")[:, :, 0] * geometry.weights
    r_t = None
    if "traction_t" in history:
        r_t = read("traction_t") * geometry.weights[:, None]
    slip = read("slip") if "slip" in history else None
    active = read("active")[:, :, 0] > 0.5
    gap = read("gap")[:, :, 0]
    return part.derive(part.sum_up(r_n, r_t, active), part.find_largest(gap, slip))


def is_upright(part: str, history: Mapping[str, Array]) -> bool:
    """Say whether a part of the contact stands upright: it has a height, and its thrust a level.

    Args:
        part: its name in the columns.
        history: column -> values (rows,) of a run.
    """
    return bool(np.isfinite(history.get(f"level_{part}", np.nan)).any())


def find_in_box(points: Array, box: Sequence[Sequence[float]] | Array) -> Mask:
    """Return which points lie in a box, its faces included.

    Args:
        points: (m, d) [m].
        box: (2, d) two opposite corners [m].
    """
    low, high = np.sort(np.asarray(box, dtype=float), axis=0)
    slack = ROUNDING * np.ptp(points, axis=0).max()
    inside = (points >= low - slack) & (points <= high + slack)
    return np.asarray(inside.all(axis=1))
