"""Record resultants of a part of the contact surface: thrust, shear, moment, uplift, rotation."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from ...core.algebra import from_each, largest
from ...core.checks import array, column_name, optional, provides
from ...core.errors import InputError
from ...core.problem import ContactProblem
from ...core.quantities import Unit
from ...core.step import AXES, Columns, Report, Row, State
from ...core.surfaces import ContactSurface
from ...engineering.resultants import DETERMINED, Part, Where, check_part

# Quantity -> (unit, meaning).
_MEANING: Columns = {
    "uplift": ("-", "uplift ratio 1 - L_contact/L"),
    "opening": ("m", "largest gap"),
    "slip": ("m", "largest tangential displacement on the support"),
    "force": ("N", "contact force on the body"),
    "N": ("N", "normal force -F·n, compression positive"),
    "T": ("N", "tangential force F·t on the body"),
    "M": ("N m", "moment on the body about the centre, anticlockwise positive"),
    "e": ("m", "eccentricity M/N; nan without normal force"),
    "height": ("m", "height of the thrust above the centre; nan while open"),
    "theta": (
        "rad",
        (
            "rocking angle, anticlockwise positive; nan where the points of the part do not "
            "determine it"
        ),
    ),
    "settlement": ("m", "mean displacement towards the support"),
    "level": (
        "-",
        ("height of the thrust above the lowest point over the height of the part; nan while open"),
    ),
    "sliding": ("m", "mean tangential displacement on the support; in space its size"),
    "margin": ("-", "share of the friction that is left, 1 - |T|/limit; nan while open"),
    "pressure_low": ("Pa", "contact pressure at the end where the longest coordinate is least"),
    "pressure_high": ("Pa", "contact pressure at the end where the longest coordinate is largest"),
}


@dataclass
class Resultants:
    """Record columns <quantity>_<name> of a named part of the contact surface, such as N_base.

    The quantities are uplift, opening, slip, force_x, force_y, N, T, M, e, height, theta,
    settlement (relative to the support), level, sliding, pressure_low, pressure_high and, with
    friction, margin. In space there are also force_z and the components of T and e, and those of M
    and theta take the place of M and theta, as M_x. What has slid in the end is the last
    ``sliding`` less the first.

    Args:
        name: names the columns; that of the group ``part`` when left out. centre: (d,) the point of
            reference, of a footing the middle of its base, of a wall a point at the level from
            which ``height`` counts [m]; the middle of the part at the level of its lowest point
            when None.
        part: a boundary group, fem.Facets, or two opposite corners of a box, which has its faces
            too: a node belongs wholly, with all its force and weight, to each part that it is in;
            where: points (m, d), normals (m, d) -> boolean mask (m,). The whole surface when both
            are None.
        normal: direction of N towards the support; the part's mean contact direction when None.

    Reactions are those of the step (mean or end value, as the scheme says), on a unilateral and on
    a held support. InputError for both part and where, and for a part of no contact points.
    """

    name: str = ""
    centre: Annotated[Sequence[float] | None, Unit("m")] = None
    where: Where | None = None
    normal: Sequence[float] | None = None
    part: Any = None

    def __post_init__(self) -> None:
        own = self.name if isinstance(self.name, str) else column_name("part name", self.name)
        self.name = own or getattr(self.part, "name", "")
        column_name("part name", self.name)
        check_part(self.name, self.centre, self.where, self.normal)
        if self.part is not None and self.where is not None:
            raise InputError(f"part '{self.name}' has both part and where: leave one of them out")
        if not hasattr(self.part, "indices"):
            optional(
                array, f"part '{self.name}'", "part, a box,", self.part, (2, None), unit="metres"
            )

    def columns(self) -> Columns:
        """Call ``start`` first."""
        found = {}
        for quantity in self._quantities:
            kind, _, axis = ("", "", "") if quantity in _MEANING else quantity.partition("_")
            unit, text = _MEANING[kind or quantity]
            found[f"{quantity}_{self.name}"] = (
                unit,
                f"{text}{f' along {axis}' if axis else ''}, part {self.name}",
            )
        return found

    def start(
        self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None
    ) -> Row:
        """Find the part once, and return the row of the state, a static one or the start of a run.

        Collective.
        """
        self._surface, self._problem = problem.surface, problem
        whole = problem.surface.whole()
        where = self.where if self.part is None else self._chosen(whole)
        self._part = Part(self.name, whole, self.centre, where, self.normal, problem.surface.slots)
        return self._row(state)

    def _chosen(self, whole: ContactSurface) -> Where:
        """Return what picks the part out of all conditions.

        Collective.
        """
        if hasattr(self.part, "indices"):
            space: Any = self._problem.system.space
            provides(
                f"part '{self.name}'",
                "the system's space",
                space,
                ("facet_blocks",),
                "use one of fem.assemble",
            )
            own = space.nodes[space.facet_blocks(self.part.indices)]
            found = np.isin(whole.nodes, np.concatenate(from_each(self._surface.comm, own)))  # type: ignore[arg-type]
            clamped = from_each(self._surface.comm, space.nodes[space.held.all(axis=1)])
            touching = np.isin(
                space.corners_of_facets(self.part.indices), np.concatenate([whole.nodes, *clamped])
            )
            if not largest(self._surface.comm, touching.all(axis=1).any()):
                raise InputError(
                    f"part '{self.name}': its group has no whole facet in contact: give a group of "
                    "the contact, or a box"
                )
            alone = found.copy()
            for rows in whole.corners:
                alone[rows] = False
            mean = whole.weights[alone] @ whole.normals[alone]
            for rows in whole.corners:  # of a corner the face that is in the group
                found[rows] &= np.arange(len(rows)) == np.argmax(whole.normals[rows] @ mean)
        else:
            low, high = np.sort(np.asarray(self.part, dtype=float), axis=0)
            slack = DETERMINED * np.ptp(whole.points, axis=0).max()
            found = np.all((whole.points >= low - slack) & (whole.points <= high + slack), axis=1)
        return lambda points, normals: found

    def row(self, report: Report) -> Row:
        """Return the values of a step."""
        return self._row(report.new)

    def _row(self, state: State) -> Row:
        """Return sums and maxima of this rank's conditions, then of all ranks."""
        surface, part, r_n, d = self._surface, self._part, state.r_n, self._part.dimension
        u_n, slip = surface.normal_values(state.u), surface.slip(state.u, state.t)
        gap = surface.gap(state.t) - u_n + surface.compliance * r_n
        sums = part.sums(
            r_n[None], None if state.r_t is None else state.r_t[None], state.active[None]
        )
        limit = self._problem.friction.limit(r_n, surface.weights, 1.0)[part.mask].sum()
        slid = np.einsum("k,kdc,kc->d", part.weights, part.tangents, slip[part.mask]) / part.whole
        more = [u_n[part.mask] @ part.fit, r_n[part.mask] @ part.ends, slid, [limit]]
        whole = surface.comm.sum(np.concatenate([sums[0], *more]))
        sums, motion, (low, high), slid, (limit,) = np.split(
            whole, np.cumsum([len(sums[0]), *map(len, more[:-1])])
        )
        tops = surface.comm.max(part.tops(gap[None], slip[None])[0])
        names = ([], ["theta", "settlement"], [*(f"theta_{axis}" for axis in AXES), "settlement"])[
            d - 1
        ]
        found = {
            quantity: float(values[0])
            for quantity, values in part.quantities(sums[None], tops[None]).items()
        }
        found |= dict(zip(names, motion.tolist(), strict=False))
        along = slid @ [-part.normal[1], part.normal[0]] if d == 2 else np.linalg.norm(slid)
        found |= {
            "level": (found["height"] - part.lowest) / part.tall if part.tall else np.nan,
            "sliding": float(along),
            "pressure_low": float(low),
            "pressure_high": float(high),
        }
        if self._problem.frictional:
            found["margin"] = float(1.0 - abs(found["T"]) / limit) if limit > 0.0 else np.nan
        self._quantities = list(found)
        return {f"{quantity}_{self.name}": value for quantity, value in found.items()}
