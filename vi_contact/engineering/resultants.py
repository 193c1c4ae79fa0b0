"""Sum up what a part of a contact surface does to its body: uplift, opening, slip, thrust, N, T, M and theta.

With the contact direction n of a point (from the body to its obstacle), its tangent t and the reactions of the body on
the support, the force on the body at a point X is f = -r_n n - r_t t. Over the points of a part, about its centre c:

    uplift = 1 - L_contact / L (by weight),    F = sum f,    M = sum (X - c) x f   (anticlockwise positive)
    N = -F·n̄ (compression positive),  T = F·t̄,  e = M / N,    height = sum r_n (X - c)·up / sum r_n

n̄ is the mean direction of the part by weight, t̄ = (-n̄_y, n̄_x), up the last axis. On level ground N is the vertical
force, T points to the right, and N acts at the distance e to the right of the centre; of a wall N is the thrust and
``height`` the height of its line of action above the centre. Positions are those of the undeformed body.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ..core.algebra import Array, Mask
from ..core.checks import array, column_name, function, instance, mask, optional, provides
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..core.step import AXES, Columns, Report, Row, State
from ..core.surfaces import ContactSurface, nodal_blocks, nodal_frames, tangential_columns

Where = Callable[[Array, Array], Mask]


class Geometry(Protocol):
    """Describe where contact points are: a ContactSurface, or the contact of a ``run_folder.RunFolder``."""

    @property
    def points(self) -> Array: ...
    @property
    def normals(self) -> Array: ...
    @property
    def weights(self) -> Array: ...


def check_part(name: str, centre: Any, where: Any, normal: Any) -> None:
    """Raise InputError unless centre and direction are numbers and the mask is a function."""
    array(f"part '{name}'", "the centre", centre, (None,), unit="metres")
    optional(function, f"part '{name}'", "where", where, "give a function of points and normals, or None")
    optional(array, f"part '{name}'", "normal", normal, (None,))


class Part:
    """Hold the points of a contact surface that a mask picks, with the directions of its resultants.

    ``where``: points (m, d), normals (m, d) -> mask (m,); all points when None. InputError for a part without points,
    a centre of other dimension, or directions that cancel (a closed ring), unless ``normal`` says which N is meant.
    """

    def __init__(
        self, name: str, geometry: Geometry, centre: Sequence[float], where: Where | None,
        normal: Sequence[float] | None,
    ) -> None:
        check_part(name, centre, where, normal)
        points, normals = geometry.points, geometry.normals
        given = np.ones(len(points), dtype=bool) if where is None else where(points, normals)
        chosen = mask(f"part '{name}'", "what where(points, normals) returns", given, (len(points),))
        if not chosen.any():
            raise InputError(f"part '{name}' has no contact points: change its mask")
        self.centre = array(f"part '{name}'", "the centre", centre, points.shape[1:], unit="metres")
        self.mask, self.weights = chosen, geometry.weights[chosen]
        self.normals, self.arms = normals[chosen], points[chosen] - self.centre
        self.normal = self._direction(name, normal)
        self.tangents = tangent_vectors(self.normals)
        self.shared = len(np.unique(points[chosen], axis=0)) < int(chosen.sum())
        self.name, self.dimension = name, points.shape[1]

    def _direction(self, name: str, given: Sequence[float] | None) -> Array:
        direction = self.weights @ self.normals if given is None else given
        direction = array(f"part '{name}'", "normal", direction, self.centre.shape)
        size = float(np.linalg.norm(direction))
        if size <= 1e-6 * (self.weights.sum() if given is None else 1.0):
            raise InputError(f"part '{name}': its contact directions cancel, give normal= the direction of N")
        return np.asarray(direction / size)

    def resultants(self, r_n: Array, r_t: Array | None) -> dict[str, Array]:
        """Return force, N, T, M, e and height of reactions (rows, m), (rows, m, d - 1); nan where N or r_n is zero."""
        r_n = r_n[:, self.mask]
        at_points = -r_n[:, :, None] * self.normals
        if r_t is not None:
            if self.shared and self.dimension == 3:
                raise InputError(f"part '{self.name}' has points with two contact directions, whose friction has no "
                                 "frame of its own in three dimensions: leave them out of the mask")
            at_points = at_points - np.einsum("rkc,kdc->rkd", r_t[:, self.mask], self.tangents)
        force = 0.0 + at_points.sum(axis=1)
        thrust = r_n.sum(axis=1)
        raised = np.full(len(thrust), np.nan)
        np.divide(r_n @ self.arms[:, -1], thrust, out=raised, where=thrust != 0.0)
        found = {f"force_{axis}": force[:, i] for i, axis in enumerate(AXES[: self.dimension])}
        return found | self._about_centre(at_points, force) | {"height": raised}

    def _about_centre(self, at_points: Array, force: Array) -> dict[str, Array]:
        """Return N, T, M, e: with signs in the plane; in 3D T, e are sizes and M a vector; no M in one."""
        compression = 0.0 - force @ self.normal
        if self.dimension == 2:
            tangent = np.array([-self.normal[1], self.normal[0]])
            moment = (self.arms[:, 0] * at_points[:, :, 1] - self.arms[:, 1] * at_points[:, :, 0]).sum(axis=1)
            moments, lever, along = {"M": moment}, moment, force @ tangent
        elif self.dimension == 3:
            vector = np.cross(self.arms, at_points).sum(axis=1)
            moments = {f"M_{axis}": vector[:, i] for i, axis in enumerate(AXES)}
            lever = np.linalg.norm(np.cross(self.normal, vector), axis=1)
            along = np.linalg.norm(force + compression[:, None] * self.normal, axis=1)
        else:
            moments, lever, along = {}, np.zeros(len(force)), np.zeros(len(force))
        away = np.full(len(force), np.nan)
        np.divide(lever, compression, out=away, where=compression != 0.0)
        return {"N": compression, "T": along} | moments | {"e": away}

    def opening(self, active: Mask, gap: Array, slip: Array | None) -> dict[str, Array]:
        """Return uplift ratio, largest gap and, with slips, the largest slip of every row."""
        found = {
            "uplift": (~active[:, self.mask]) @ self.weights / self.weights.sum(),
            "opening": gap[:, self.mask].max(axis=1),
        }
        if slip is not None and slip.shape[2]:
            found["slip"] = np.linalg.norm(slip[:, self.mask], axis=2).max(axis=1)
        return found

    def rotation(self, u_n: Array) -> dict[str, float]:
        """Return rocking angle and settlement of the smallest rigid motion that fits u_n best by weight; plane only."""
        size = float(np.max(np.abs(self.arms), initial=0.0)) or 1.0
        turn = (self.normals[:, 1] * self.arms[:, 0] - self.normals[:, 0] * self.arms[:, 1]) / size
        root = np.sqrt(self.weights)
        modes = np.column_stack([self.normals, turn])
        motion = np.linalg.lstsq(root[:, None] * modes, root * u_n[self.mask], rcond=1e-9)[0]
        return {"theta": float(motion[2] / size), "settlement": float(motion[:2] @ self.normal)}


def tangent_vectors(normals: Array) -> Array:
    """Return the tangents (m, d, d - 1) of contact directions (m, d), in which surfaces have slip and r_t.

    Points with several directions are not covered: in the plane nothing rubs there.
    """
    column, blocks = nodal_blocks(nodal_frames(normals))
    return np.take_along_axis(blocks, tangential_columns(column, normals.shape[1])[:, None, :], axis=2)


_MEANING = {
    "uplift": ("-", "uplift ratio 1 - L_contact/L"),
    "opening": ("m", "largest gap"),
    "slip": ("m", "largest tangential displacement on the support"),
    "N": ("N", "normal force -F·n, compression positive"),
    "T": ("N", "tangential force F·t on the body"),
    "M": ("N m", "moment on the body about the centre, anticlockwise positive"),
    "e": ("m", "eccentricity M/N; nan without normal force"),
    "height": ("m", "height of the thrust above the centre; nan while open"),
    "theta": ("rad", "rocking angle, anticlockwise positive"),
    "settlement": ("m", "mean displacement towards the support"),
}


def _unit_and_meaning(quantity: str, name: str) -> tuple[str, str]:
    kind, _, axis = quantity.partition("_")
    if kind == "force":
        return "N", f"contact force on the body along {axis}, part {name}"
    unit, text = _MEANING[kind]
    return unit, f"{text}{f' along {axis}' if axis else ''}, part {name}"


@dataclass
class Resultants:
    """Record columns <quantity>_<name> of a named part of the contact surface; the module's head lists the quantities.

    uplift, opening, slip, force_x, force_y (force_z), N, T, M (M_x, M_y, M_z in 3D), e, height and, in the plane, theta
    and settlement: the rigid motion of the part relative to its support that fits the normal displacements best.

    Args:
        name: names the columns. centre: (d,) the point of reference, of a footing the middle of its base, of a wall a
            point at the level from which ``height`` counts [m].
        where: points (m, d), normals (m, d) -> boolean mask (m,); the whole surface when None.
        normal: direction of N towards the support; the part's mean contact direction when None.
    Reactions are those of the step (mean or end value, as the scheme says), on a unilateral and on a held support.
    """

    name: str
    centre: Sequence[float]
    where: Where | None = None
    normal: Sequence[float] | None = None

    def __post_init__(self) -> None:
        column_name("part name", self.name)
        check_part(self.name, self.centre, self.where, self.normal)

    def columns(self) -> Columns:
        """Call ``start`` first."""
        return {f"{quantity}_{self.name}": _unit_and_meaning(quantity, self.name) for quantity in self._quantities}

    def start(self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None) -> Row:
        """Find the part once, and return the row of the state, a static one or the start of a run."""
        self._surface = problem.surface
        self._part = Part(self.name, problem.surface.whole(), self.centre, self.where, self.normal)
        return self._row(state)

    def row(self, report: Report) -> Row:
        return self._row(report.new)

    def _row(self, state: State) -> Row:
        surface, part = self._surface, self._part
        u_n, slip = surface.normal_values(state.u), surface.slip(state.u, state.t)
        gap = surface.gap(state.t) - u_n + surface.compliance * state.r_n
        rubbing = [slip] if state.r_t is None else [slip, state.r_t]
        values = surface.everywhere(np.column_stack([gap, state.r_n, u_n, state.active, *rubbing]))
        gap, r_n, u_n, active = (np.ascontiguousarray(column) for column in values.T[:4])
        slip, r_t = (np.ascontiguousarray(part) for part in np.hsplit(values[:, 4:], [slip.shape[1]]))
        series = part.opening(active[None] > 0.0, gap[None], slip[None]) | part.resultants(
            r_n[None], None if state.r_t is None else r_t[None]
        )
        found: dict[str, Any] = {quantity: float(values[0]) for quantity, values in series.items()}
        if part.dimension == 2:
            found |= part.rotation(u_n)
        self._quantities = list(found)
        return {f"{quantity}_{self.name}": value for quantity, value in found.items()}


def contact_summary(
    history: Mapping[str, Array], geometry: Geometry, *, centre: Sequence[float], name: str = "contact",
    where: Where | None = None, normal: Sequence[float] | None = None,
) -> dict[str, Array]:
    """Return the resultants of a run that recorded ``Contact()``: quantity -> (rows,), without theta.

    ``geometry``: the surface of the problem (then collective), or ``read_run(folder).contact``. Slip and friction count
    where they were recorded, with friction. InputError without arrays of the contact points.
    """
    instance("contact_summary", "history", history, Mapping, "give the history of a solution")
    provides("contact_summary", "geometry", geometry, ("points", "normals", "weights"), "give a contact surface")
    column_name("part name", name)
    missing = [column for column in ("pressure", "gap", "active") if column not in history]
    if missing:
        raise InputError(f"the history has no column {missing[0]}: record Contact() and read history.h5")
    geometry = geometry.whole() if isinstance(geometry, ContactSurface) else geometry
    part = Part(name, geometry, centre, where, normal)
    rows, m = len(history["t"]), len(geometry.weights)

    def per_point(column: str) -> Array:
        return np.reshape(np.asarray(history[column], dtype=float), (rows, m, -1))

    r_t = per_point("traction_t") * geometry.weights[:, None] if "traction_t" in history else None
    slip = per_point("slip") if "slip" in history else None
    found = part.opening(per_point("active")[:, :, 0] > 0.5, per_point("gap")[:, :, 0], slip)
    return found | part.resultants(per_point("pressure")[:, :, 0] * geometry.weights, r_t)
