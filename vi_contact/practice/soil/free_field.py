"""Continue level ground behind a body's sides, by dashpots and the stress of the free field.

On a vertical side with outward normal n, v_ff(y, t) and sigma_ff the motion and stress of the
ground far away,

    traction = sigma_ff·n - D (v - v_ff),    D v = rho c_P v_n n + rho c_S v_t

(FLAC and PLAXIS free-field boundaries; OpenSees ASDAbsorbingBoundary2D). Without a structure v =
v_ff, and it is as if there were no side. Here this is exact to round-off, since the column has the
heights and the materials of the side's own elements and is marched with the run's scheme. Waves
that a structure sends out leave through the dashpots. No static load is held: for a gravity stage
put the sides on rollers, then ``release`` them. A body may yield inside, but not along the side.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...core.algebra import Array, Indices, total
from ...core.checks import provides
from ...core.errors import InputError
from ...core.problem import ContactProblem
from ...core.protocols import EXCITATION, Excitation
from ...fem import compat
from ...fem.body.dashpots import BoundaryLoads, CompliantBase, DashpotMatrix, Dashpots, impedances
from ...fem.body.space import FemSpace
from ...fem.matrices.petsc_algebra import PetscMatrix
from ...laws.materials import Section
from ...laws.yielding import YieldingMaterial
from .companion import CompanionRun
from .moving_base import BaseMotion, GroundFrame
from .soil_column import SoilColumn

Base = Excitation | Sequence[Excitation] | BaseMotion | CompliantBase


@dataclass(frozen=True, kw_only=True)
class FreeField(Dashpots):
    """Describe one vertical side of a body in the plane, its lowest node at the base.

    The column behind the side is marched with the scheme and the time steps of the run, from t = 0.

    Attributes:
        base: the run's excitations (rigid base, frame of the ground), its ``BaseMotion``
            (prescribed base) or its ``CompliantBase``.
    """

    base: Base = field(repr=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        remedy = "give the excitations of the run, its BaseMotion or its CompliantBase"
        for excitation in getattr(self.ground, "excitations", ()):
            provides("FreeField", "base", excitation, EXCITATION, remedy)

    @property
    def ground(self) -> CompliantBase | GroundFrame:
        """Return what the column stands on.

        It is the base, or the frame of the ground that the excitations shake.
        """
        if isinstance(self.base, BaseMotion | CompliantBase):
            return self.base
        if isinstance(self.base, Sequence):
            return GroundFrame(tuple(self.base))
        return GroundFrame((self.base,))

    def loads(self, matrix: DashpotMatrix, forms: Any) -> BoundaryLoads:
        """Return the stress of the free field on the side, D v_ff, and the run of its column.

        Args:
            matrix: the dashpots D of the side.
            forms: of the body, with its materials.
        """
        side = FreeFieldSide(matrix, self, forms)
        companions = (side.run, *getattr(self.base, "companions", ()))
        return BoundaryLoads((side.elastic,), (side.viscous,), companions)

    @property
    def expects(self) -> str:
        """Return in words which motion it expects."""
        if self.ground.lets_waves_in:
            return "expects the upgoing motion of the compliant base"
        return "expects the motion of the rigid base itself (within motion)"


class FreeFieldSide:
    """March the column beside one side, and give the forces it puts on the body.

    Attributes:
        space: of the body.
        side: as the user describes it.
        run: the run of the column.
        column: its elements.

    Raises:
        InputError: a body in space; a side that is not vertical; a lowest node that is free on a
            rigid base, or held on a compliant one.
    """

    def __init__(self, absorber: DashpotMatrix, side: FreeField, forms: Any) -> None:
        """Make the column.

        Args:
            absorber: the dashpots of the side.
            side: as the user describes it.
            forms: of the body, with its materials.
        """
        name = side.facets.name
        self.space = absorber.space
        self.side = side
        self._ground = side.ground
        self.run = CompanionRun(f"FreeField on '{name}'", self._problem)
        if self.space.dimension != 2:
            raise InputError(
                "FreeField is for plane bodies: tie the sides of this one, or give them dashpots"
            )
        if self.space.degree > 1:
            raise InputError("FreeField has a soil column of first order: give assemble degree=1")
        self._section: Section = forms.section
        self._dashpots = PetscMatrix(absorber.mat)
        self.column, self._sign = _make_column(self.space, forms, self.side)

        # Nodes of the side on this rank, and the node of the column at the height of each.
        self._blocks = self.space.facet_blocks(self.side.facets.indices)
        heights = self.space.points[self._blocks, 1]
        self._rows = np.abs(heights[:, None] - self.column.heights).argmin(axis=1)
        lowest = self._blocks[self._rows == 0]
        held_components = total(self.space.comm, self.space.held[lowest].sum())
        compliant = self._ground.lets_waves_in
        if not compliant and held_components < 2:
            raise InputError(
                f"the lowest node of free-field side '{name}' is not held: fix or prescribe the "
                "base, or give the side its CompliantBase"
            )
        if compliant and held_components:
            raise InputError(
                f"the lowest node of free-field side '{name}' is held, but its base is compliant: "
                "leave the base free"
            )

    def _problem(self) -> ContactProblem:
        """Return the column on its base."""
        ground = self._ground
        column = self.column
        if isinstance(ground, CompliantBase):
            normal, shear = impedances(
                ground, self._section, column.lame[0], column.shear[0], column.rho[0]
            )
            return column.on_dashpots(float(shear), float(normal), ground.motion)
        return column.on_rigid_base(lambda t: ground.at(t)[2], lambda t: ground.at(t)[1])

    def motion(self, t: float) -> tuple[Array, Array]:
        """Return (u_ff, v_ff) at the heights of the column, (n+1, 2), in the frame of the run."""
        u_flat, v_flat = self.run.at(t)
        u = u_flat.reshape(-1, 2)
        v = v_flat.reshape(-1, 2)
        if isinstance(self._ground, CompliantBase):
            return u, v
        u_base, v_base, _ = self._ground.at(t)
        foot = np.zeros((1, 2))
        return np.vstack([foot, u]) + u_base, np.vstack([foot, v]) + v_base

    def elastic(self, t: float) -> Array:
        """Return Pᵀ times the nodal forces of sigma_ff·n."""
        u, _ = self.motion(t)
        return self._nodal(self.column.stress(u))

    def viscous(self, t: float) -> Array:
        """Return Pᵀ times D v_ff and the nodal forces of the damping stresses, added up."""
        _, v = self.motion(t)
        far = np.zeros((len(self.space.nodes), 2))
        far[self._blocks] = v[self._rows]
        damping = self.column.beta[:, None] * self.column.stress(v)
        return self.space.pull(self._dashpots @ far.ravel()) + self._nodal(damping)

    def _nodal(self, stress: Array) -> Array:
        """Return Pᵀ times ∫ sigma·n phi_i over the side; sigma (n, 2) is constant on an element."""
        halves = 0.5 * self._sign * np.diff(self.column.heights)[:, None] * stress
        at_nodes = np.zeros((len(self.column.heights), 2))
        at_nodes[:-1] += halves
        at_nodes[1:] += halves
        force = np.zeros((len(self.space.nodes), 2))
        force[self._blocks] = at_nodes[self._rows]
        return self.space.pull(force.ravel())


def _make_column(space: FemSpace, forms: Any, side: FreeField) -> tuple[SoilColumn, float]:
    """Return the column beside the side, the same on every rank, and the sign of its normal.

    The sign is that of the x component of the side's outward normal.
    """
    mesh = space.mesh
    name = side.facets.name
    facets = side.facets.indices
    owned = facets[facets < mesh.topology.index_map(1).size_local]

    # A row for each facet of the side: its ends, the materials of its cell, where this cell is.
    mesh.topology.create_connectivity(1, 2)
    cells_at = mesh.topology.connectivity(1, 2)
    cells = np.array([cells_at.links(facet)[0] for facet in owned], dtype=np.int64)
    ends = mesh.geometry.x[compat.entities_to_geometry(mesh, 1, owned)][:, :, :2]
    nodes_of_cells = compat.geometry_dofmap(mesh)
    middles = np.array([mesh.geometry.x[nodes_of_cells[cell], 0].mean() for cell in cells])
    _refuse_unlike(forms, name)
    _refuse_yielding(space, forms, cells, name)
    values = [forms.cellwise(key)[cells] for key in ("lame", "shear", "rho", "alpha_rho", "beta")]
    low = ends[:, :, 1].min(axis=1)
    high = ends[:, :, 1].max(axis=1)
    columns = [low, high, *values, ends[:, 0, 0], ends[:, 1, 0], middles]
    own_rows = np.column_stack(columns).reshape(-1, len(columns))

    # The rows of all ranks, upwards.
    rows = np.concatenate(space.comm.bcast(space.comm.gather(own_rows)))
    rows = rows[np.argsort(rows[:, 0])]
    low, high, lame, shear, rho, alpha_rho, beta, *x_of_ends, middle = rows.T
    if np.isnan(rows).any():
        raise InputError(
            f"free-field side '{name}' stands beside orthotropic cells, and its soil column is "
            "isotropic: put a LinearElastic there, or Dashpots(…, material=)"
        )
    tolerance = 1e-9 * space.size
    if np.ptp(x_of_ends) > tolerance or np.any(np.abs(low[1:] - high[:-1]) > tolerance):
        raise InputError(
            f"free-field side '{name}' is not one vertical line of facets: give a straight side of "
            "the body"
        )
    column = SoilColumn(np.append(low, high[-1]), lame, shear, rho, alpha_rho / rho, beta)
    is_right_of_body = x_of_ends[0][0] > middle[0]
    return column, 1.0 if is_right_of_body else -1.0


def _refuse_unlike(forms: Any, name: str) -> None:
    """Raise InputError where the column could not be what the body is beside it."""
    if not forms.fields:
        limit = "of materials, and forms=… have none"
    elif forms.viscous:
        limit = "of Rayleigh damping only, not KelvinVoigt"
    else:
        return
    raise InputError(
        f"free-field side '{name}': its column is {limit}: put Dashpots(…, material=) there"
    )


def _refuse_yielding(space: FemSpace, forms: Any, cells: Indices, name: str) -> None:
    """Raise InputError where a cell at the side may yield, as the column does not. Collective.

    Args:
        space: of the body.
        forms: of the body, with its materials.
        cells: (k,) local cells at the facets of the side that this rank owns.
        name: of the side.
    """
    if forms.internal is None:
        return
    for where, given in forms.given_materials:
        beside = float(np.isin(cells, where).sum())
        if isinstance(given, YieldingMaterial) and total(space.comm, beside):
            raise InputError(
                f"free-field side '{name}' stands beside cells of {type(given).__name__}, and its "
                "soil column is linear: put a LinearElastic along the side, or Dashpots there"
            )
