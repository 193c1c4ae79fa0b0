"""Record reactions of boundaries, held or absorbing ones: base shear and overturning moment."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ...core.algebra import largest
from ...core.checks import array, column_name
from ...core.errors import InputError
from ...core.problem import ContactProblem
from ...core.quantities import Unit
from ...core.step import Columns, Report, Row, State
from ...fem.body.space import FemSpace
from ...fem.mesh.group_checks import facets_of
from ...fem.mesh.tagged_mesh import Facets
from ...fem.output.nodal_work import Loads, NodalWork, check_actions


@dataclass
class Reactions:
    """Record what a prescribed or absorbing boundary does to its body.

    It is a force [N] and a moment about a centre [N m].

    On the components c of the nodes of the facets that are held, and on all of those with dashpots,
    with the loads f on them, K, C, M of the elements and the absolute acceleration a + a_g:

        R = (K u + C v + M (a + r a_g) - f)_c

    Where materials yield, the force of their stresses at points of integration is in the place of K
    u, and C is of the elastic K.

    On held components they are rows of the equation of motion that the elimination of prescribed
    displacements took out, less contact forces (on a prescribed side 2 of a pair and on edges of P2
    tetrahedra); at nodes with dashpots what these and the waves that come in (CompliantBase,
    FreeField) do to the elements, and contact if there is any at these nodes. Nodes that two
    boundaries share count in both. In the relative frame the inertia load of the ground motion is M
    r a_g, of the held nodes too, so that R is the same force as with the ground moved by
    ``Prescribed``, and balances all masses, loads and contact forces of the body (with
    ``base_inertia=True``, the default of ``assemble``; K, C, M are those of the elements, whatever
    a time scheme does to the mass of contact nodes). Values are those of the step's equation of
    motion, its mean or end, as the contact reactions are; row 0 is that of the initial state at
    rest.

    Columns reaction_x_<name>, reaction_y_<name>, …: the force on the body; reaction_M_<name> about
    the centre, anticlockwise positive (reaction_M_x_<name>, … in three dimensions). Base shear is
    reaction_x, the overturning moment of the body on its base is -reaction_M.

    Args:
        facets: a boundary with prescribed components or dashpots; other components of its nodes are
            not counted.
        loads: those given to ``assemble``: their part on the held nodes goes straight into the
            support.
        gravity: acceleration (d,) [m/s²] of ``with_weight``, (0, -9.80665) for example: likewise.

    Raises:
        InputError: nothing is prescribed on the facets, and they have no dashpots.
    """

    name: str
    facets: Facets
    centre: Annotated[Sequence[float], Unit("m")]
    loads: Loads = ()
    gravity: Annotated[Sequence[float] | None, Unit("m/s²")] = None

    def __post_init__(self) -> None:
        column_name("reaction name", self.name)
        facets_of("Reactions", "facets", self.facets)
        array("Reactions", "the centre", self.centre, (None,), unit="metres")
        check_actions("Reactions", self.loads, self.gravity)

    def columns(self) -> Columns:
        """Call ``start`` first."""
        force = "N", f"force of boundary {self.name} on the body"
        moment = "N m", f"moment of boundary {self.name} on the body about its centre"
        columns = {}
        for part in self._parts:
            unit, text = moment if part.startswith("M") else force
            if part != "M":  # the moment in the plane has no axis
                text = f"{text} along {part[-1]}"
            columns[f"reaction_{part}_{self.name}"] = (unit, text)
        return columns

    def start(
        self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None
    ) -> Row:
        """Prepare the work of rigid motions of the held nodes; return the row of the state at rest.

        Collective.

        Args:
            problem: what is marched.
            state: the first state.
            resumed: the last row of the run that is continued, None for a new run.

        Raises:
            InputError: the boundary is neither held nor has it dashpots.
        """
        owner = f"reactions '{self.name}'"
        self._work = NodalWork(owner, problem, self.loads, self.gravity)
        space: FemSpace = self._work.space
        if len(self.centre) != space.dimension:
            raise InputError(
                f"{owner}: the centre has {len(self.centre)} coordinates: give {space.dimension}"
            )

        # The components that count: held ones on the facets, and all of those with dashpots.
        held = np.zeros_like(space.held)
        facets_of(owner, "facets", self.facets, space.mesh)
        blocks = space.facet_blocks(self.facets.indices)
        held[blocks] = space.held[blocks]
        for boundary in space.forms.boundaries:
            shared = np.intersect1d(self.facets.indices, boundary.facets.indices)
            held[space.facet_blocks(shared)] = True
        if not largest(space.comm, held.any()):
            raise InputError(
                f"nothing is prescribed on boundary group '{self.facets.name}', and it has no "
                "dashpots, so it has no reactions: give a boundary that is held"
            )
        self._parts = {1: ["x"], 2: ["x", "y", "M"], 3: ["x", "y", "z", "M_x", "M_y", "M_z"]}[
            space.dimension
        ]
        self._work.take([(held, np.asarray(self.centre, dtype=float), None, None)])
        return self._row(self._work.at_rest(state))

    def row(self, report: Report) -> Row:
        """Return the row of the step that ``report`` tells of."""
        return self._row(self._work.of_step(report))

    def _row(self, values: np.ndarray) -> Row:
        """Return components of force and moment, in the order of the columns, as a row."""
        return dict(zip(self.columns(), values.tolist(), strict=True))
