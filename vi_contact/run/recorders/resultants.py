"""Record resultants of a part of the contact surface: thrust, shear, moment, uplift, rotation."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from ...core.algebra import Mask, from_each, largest
from ...core.checks import array, column_name, optional, provides
from ...core.errors import InputError
from ...core.joints import find_limit
from ...core.problem import ContactProblem
from ...core.quantities import Unit
from ...core.step import AXES, Columns, Report, Row, State
from ...core.surfaces import ContactSurface
from .contact_parts import DETERMINED, Part, Where, check_part, find_in_box

# Quantity -> (unit, meaning).
_MEANING: Columns = {
    "uplift": ("-", "open share 1 - L_contact/L"),
    "opening": ("m", "largest gap"),
    "slip": ("m", "largest tangential displacement along the ground"),
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
    "settlement": ("m", "mean displacement towards the ground"),
    "level": (
        "-",
        ("height of the thrust above the lowest point over the height of the part; nan while open"),
    ),
    "sliding": ("m", "mean tangential displacement along the ground; in space its size"),
    "margin": ("-", "share of the friction that is left, 1 - |T|/limit; nan while open"),
    "pressure_low": ("Pa", "contact pressure at the end where the longest coordinate is least"),
    "pressure_high": ("Pa", "contact pressure at the end where the longest coordinate is largest"),
}
# What the normal displacements of a part tell of its motion, by dimension.
_MOTIONS: Mapping[int, Sequence[str]] = {
    1: (),
    2: ("theta", "settlement"),
    3: (*(f"theta_{axis}" for axis in AXES), "settlement"),
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
        name: names the columns; that of the group ``part`` when left out.
        centre: the point of reference (d,) [m], of a footing the middle of its base, of a wall a
            point at the level from which ``height`` counts; the middle of the part at the level of
            its lowest point when None.
        where: points (m, d) [m], normals (m, d) -> boolean mask (m,) of the part.
        normal: direction of N towards the support; the part's mean contact direction when None.
        part: a boundary group, fem.Facets, or two opposite corners of a box, which has its faces
            too: a node belongs wholly, with all its force and weight, to each part that it is in.
            The whole surface when ``part`` and ``where`` are None.
        toe: a point (d,) [m] at or beyond the end of the part over which its body would tip; the
            other end is the heel. The meanings of pressure_low and pressure_high then say which of
            them is at the toe.

    Reactions are those of the step (mean or end value, as the scheme says), on a unilateral and on
    a held support. InputError for both part and where, for a part of no contact points, and for a
    toe that is as near to one end as to the other.
    """

    name: str = ""
    centre: Annotated[Sequence[float] | None, Unit("m")] = None
    where: Where | None = None
    normal: Sequence[float] | None = None
    part: Any = None
    toe: Annotated[Sequence[float] | None, Unit("m")] = None

    def __post_init__(self) -> None:
        if not isinstance(self.name, str):
            column_name("part name", self.name)
        self.name = self.name or getattr(self.part, "name", "")
        column_name("part name", self.name)
        check_part(self.name, self.centre, self.where, self.normal)
        if self.part is not None and self.where is not None:
            raise InputError(f"part '{self.name}' has both part and where: leave one of them out")
        if not hasattr(self.part, "indices"):
            optional(
                array, f"part '{self.name}'", "part, a box,", self.part, (2, None), unit="metres"
            )
        optional(array, f"part '{self.name}'", "the toe", self.toe, (None,), unit="metres")

    def columns(self) -> Columns:
        """Call ``start`` first."""
        columns = {}
        for quantity in self._quantities:
            kind = quantity
            axis = ""
            if quantity not in _MEANING:  # a component, such as force_x
                kind, _, axis = quantity.partition("_")
            unit, text = _MEANING[kind]
            if quantity in self._ends:
                text = f"contact pressure at the {self._ends[quantity]}"
            if axis:
                text = f"{text} along {axis}"
            columns[f"{quantity}_{self.name}"] = (unit, f"{text}, part {self.name}")
        return columns

    def start(
        self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None
    ) -> Row:
        """Find the part once, and return the row of the state, a static one or the start of a run.

        Collective.

        Args:
            problem: what is marched.
            state: the first state.
            resumed: the last row of the run that is continued, None for a new run.

        Raises:
            InputError: the part has no contact points, or there is no direction of N.
        """
        self._problem = problem
        self._surface = problem.surface
        whole = problem.surface.whole()
        where = self.where if self.part is None else self._make_where(whole)
        self._part = Part(self.name, whole, self.centre, where, self.normal, problem.surface.slots)
        self._ends = {} if self.toe is None else self._name_ends(self.toe)
        return self._row(state)

    def _name_ends(self, toe: Sequence[float]) -> dict[str, str]:
        """Return pressure_low and pressure_high -> "toe" or "heel"."""
        part = self._part
        owner = f"part '{self.name}'"
        place = array(owner, "the toe", toe, (part.dimension,), unit="metres")[part.axis]
        low, high = part.span
        if abs(abs(place - low) - abs(place - high)) <= DETERMINED * (high - low):
            raise InputError(
                f"{owner}: its toe is as near to one end as to the other: give a point at or "
                "beyond one end"
            )
        names = ("toe", "heel") if abs(place - low) < abs(place - high) else ("heel", "toe")
        return dict(zip(("pressure_low", "pressure_high"), names, strict=True))

    def _make_where(self, whole: ContactSurface) -> Where:
        """Return what picks the conditions of ``part`` out of all. Collective."""
        is_group = hasattr(self.part, "indices")
        chosen = self._pick_in_group(whole) if is_group else find_in_box(whole.points, self.part)
        return lambda points, normals: chosen

    def _pick_in_group(self, whole: ContactSurface) -> Mask:
        """Return which of all conditions (m,) are in the boundary group ``part``. Collective."""
        space: Any = self._problem.system.space
        comm = self._surface.comm
        owner = f"part '{self.name}'"
        remedy = "use one of fem.assemble"
        provides(owner, "the system's space", space, ("facet_blocks",), remedy)
        nodes = from_each(comm, space.nodes[space.facet_blocks(self.part.indices)])
        conditions = np.zeros(0, dtype=np.int64) if whole.nodes is None else whole.nodes
        chosen = np.isin(conditions, np.concatenate(nodes))
        if not chosen.any() and getattr(space, "absent", None) is not None:
            raise InputError(
                f"{owner}: nothing is in contact there while bodies are absent: record it in "
                "stages that have both sides, by record tables of their own"
            )

        # A group that only touches the contact at an edge is a mistake: it has to have a facet all
        # of whose corners are contact nodes, or clamped ones.
        clamped = from_each(comm, space.nodes[space.held.all(axis=1)])
        contact = np.concatenate([conditions, *clamped])
        touching = np.isin(space.corners_of_facets(self.part.indices), contact)
        if not largest(comm, touching.all(axis=1).any()):
            raise InputError(
                f"{owner}: its group has no whole facet in contact: give a group of the contact, "
                "or a box"
            )

        # A node at a corner has a condition for each face: the one counts whose direction is
        # nearest to the mean of the conditions of the group that are not at corners.
        alone = chosen.copy()
        for rows in whole.corners:
            alone[rows] = False
        mean = whole.weights[alone] @ whole.normals[alone]
        for rows in whole.corners:
            nearest = np.argmax(whole.normals[rows] @ mean)
            chosen[rows] &= np.arange(len(rows)) == nearest
        return chosen

    def row(self, report: Report) -> Row:
        """Return the values of a step."""
        return self._row(report.new)

    def _row(self, state: State) -> Row:
        """Return the row of a state. Collective."""
        surface = self._surface
        part = self._part
        d = part.dimension

        # What the conditions of this rank have: reactions, displacements, slips and gaps, those of
        # springs with their shortening.
        r_n = state.r_n
        u_n = surface.normal_values(state.u)
        slip = surface.slip(state.u, state.t)
        gap = surface.gap(state.t) - u_n + surface.compliance * r_n

        # What adds up over the conditions: of this rank, then of all ranks in one message. The part
        # takes several states at once, of which this is one: [None].
        r_t = None if state.r_t is None else state.r_t[None]
        forces = part.sum_up(r_n[None], r_t, state.active[None])[0]
        motion = u_n[part.mask] @ part.fit
        ends = r_n[part.mask] @ part.ends
        slid = np.einsum("k,kdc,kc->d", part.weights, part.tangents, slip[part.mask]) / part.whole
        limit = find_limit(self._problem, state)[part.mask].sum()
        own = [forces, motion, ends, slid, [limit]]
        everywhere = surface.comm.sum(np.concatenate(own))
        borders = np.cumsum([len(values) for values in own[:-1]])
        forces, motion, (low, high), slid, (limit,) = np.split(everywhere, borders)

        # Largest values, then the quantities that sums and largest values make.
        largest_values = surface.comm.max(part.find_largest(gap[None], slip[None])[0])
        quantities = part.derive(forces[None], largest_values[None])
        row = {quantity: float(values[0]) for quantity, values in quantities.items()}

        # The motion of the part, and what a report asks: the equations are in contact_parts.
        row |= dict(zip(_MOTIONS[d], motion.tolist(), strict=False))  # on a line nothing has a name
        along_t = [-part.normal[1], part.normal[0]] if d == 2 else None  # t̄ in the plane
        sliding = np.linalg.norm(slid) if along_t is None else slid @ along_t
        row["level"] = (row["height"] - part.lowest) / part.tall if part.tall else np.nan
        row["sliding"] = float(sliding)
        row["pressure_low"] = float(low)
        row["pressure_high"] = float(high)
        if self._problem.frictional:
            row["margin"] = float(1.0 - abs(row["T"]) / limit) if limit > 0.0 else np.nan
        self._quantities = list(row)
        return {f"{quantity}_{self.name}": value for quantity, value in row.items()}
