"""Record momentum, angular momentum, spin and the mean motion of a body."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ...core.algebra import Array
from ...core.checks import array, column_name, optional, several, whole
from ...core.errors import InputError
from ...core.problem import ContactProblem
from ...core.quantities import Unit
from ...core.step import AXES, Columns, Report, Row, State
from ...fem.mesh.group_checks import cells_of
from ...fem.mesh.tagged_mesh import Cells
from ...fem.output.body_momenta import BodyMomenta

# Quantity -> (unit, meaning); those of the second table are one number in the plane, none on a line
_ALONG: Columns = {
    "mean_u": ("m", "mean displacement over the mass"),
    "mean_v": ("m/s", "mean velocity over the mass, after the impact law"),
    "momentum": ("kg m/s", "momentum after the impact law"),
}
_ABOUT: Columns = {
    "angular_momentum": ("kg m²/s", "angular momentum after the impact law, anticlockwise"),
    "spin": ("rad/s", "rate at which the body turns about its centre of mass, anticlockwise"),
}


@dataclass
class BodyMotion:
    """Record how a body moves as a whole: columns <quantity>_<axis>_<name>.

    With the density rho, the mass m, the centre of mass c, the moments of inertia J about it and
    the undeformed positions X:

        mean_u = ∫ rho u / m,    mean_v = ∫ rho v / m,    momentum = ∫ rho v
        angular_momentum = ∫ rho (X - about) × v
        spin = J⁻¹ ∫ rho (X - c) × v

    In the plane angular_momentum_<name> and spin_<name> have no axis; on a line there are none. The
    mass is that of the elements, whatever a time scheme does to that of contact nodes, and in the
    plane that of the section's thickness. Of a system of matrices it is M of the rows that do not
    stand still. u and v are relative to the ground when an excitation shakes the body.

    Args:
        name: names the columns.
        cells: the group of cells that is summed up, a body or a part of one; everything when None.
        bodies: numbers of bodies in its place, as ``fem.bodies_of`` returns them.
        about: the point (d,) [m] of the angular momentum; the centre of mass when None.

    Raises:
        InputError: both cells and bodies, a body that does not exist, no mass.
    """

    name: str
    cells: Cells | None = None
    bodies: tuple[int, ...] | None = None
    about: Annotated[Sequence[float] | None, Unit("m")] = None

    def __post_init__(self) -> None:
        column_name("body name", self.name)
        optional(cells_of, "BodyMotion", "cells", self.cells)
        optional(array, "BodyMotion", "about", self.about, (None,), unit="metres")
        if self.bodies is not None:
            remedy = "give numbers such as fem.bodies_of returns, or None"
            for number in several("BodyMotion", "bodies", self.bodies, remedy):
                whole("BodyMotion", "the number of a body", number)
            if self.cells is not None:
                raise InputError(f"BodyMotion '{self.name}': give either cells or bodies, not both")

    def columns(self) -> Columns:
        """Name mean_u_x_<name>, …, spin_<name>. Call ``start`` first."""
        d = self._momenta.dimension
        columns = {}
        for quantity, (unit, meaning) in _ALONG.items():
            for axis in AXES[:d]:
                text = f"{meaning}, along {axis}, body {self.name}"
                columns[f"{quantity}_{axis}_{self.name}"] = (unit, text)
        for quantity, (unit, meaning) in _ABOUT.items():
            if d == 2:
                columns[f"{quantity}_{self.name}"] = (unit, f"{meaning}, body {self.name}")
            for axis in AXES if d == 3 else ():
                text = f"{meaning}, about {axis}, body {self.name}"
                columns[f"{quantity}_{axis}_{self.name}"] = (unit, text)
        return columns

    def start(
        self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None
    ) -> Row:
        """Sum up the mass, and return the row of the first state. Collective.

        Args:
            problem: what is marched.
            state: the first state.
            resumed: the last row of the run that is continued, None for a new run.
        """
        owner = f"BodyMotion '{self.name}'"
        self._momenta = BodyMomenta(owner, problem, cells=self.cells, bodies=self.bodies)
        self._about: Array = self._momenta.centre
        if self.about is not None:
            d = self._momenta.dimension
            self._about = array(owner, "about", self.about, (d,), unit="metres")
        self._names = list(self.columns())
        return self._row(state)

    def row(self, report: Report) -> Row:
        """Return the row of the step that ``report`` tells of. Collective."""
        return self._row(report.new)

    def _row(self, state: State) -> Row:
        """Return the row of a state. Collective."""
        body = self._momenta
        moments = body.compute_momenta(state.u, state.t, 0)
        momenta = body.compute_momenta(state.v, state.t, 1)
        values = [
            body.compute_mean(moments),
            body.compute_mean(momenta),
            momenta[: body.dimension],
            body.compute_angular(self._about, momenta),
            body.compute_spin(momenta),
        ]
        return dict(zip(self._names, np.concatenate(values).tolist(), strict=True))
