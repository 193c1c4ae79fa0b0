"""Put a reservoir before a wet face: its pressure at rest, silt, and the mass of its water.

At rest p = gamma (level - y) acts on the face and on the floor. A face that moves with the
acceleration a is pressed by more, and this is a mass M_w beside that of the body:

- "added mass": p = 7/8 rho sqrt(h (h - y)) a·n, with h the depth and y the height above the floor.
  H. M. Westergaard, Trans. ASCE 98 (1933) 418-433; on any slope J. S.-H. Kuo,
  Fluid-structure interactions: added mass computations for incompressible fluid,
  UCB/EERC-82/09 (1982).
- "incompressible": the exact pressure of incompressible water before this face, by Laplace's
  equation (``water_pressure``). A rigid wall then feels 0.5428 rho a h², Westergaard's formula
  gives 7/12 = 0.5833.

The water moves with the ground sideways, and does not weigh: a horizontal acceleration r of the
ground is a load -(M + M_w) r, a vertical one -M r, and so is the weight. Damping by alpha M does
not count M_w.
"""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import scipy.sparse as sp
import ufl

from ...core.algebra import Array, largest
from ...core.arguments import check_fields
from ...core.checks import instance, optional, quote
from ...core.errors import InputError
from ...core.quantities import RATIO, Finite, NotNegative, Positive, Unit
from ...core.units import STANDARD_GRAVITY, WATER_WEIGHT
from .. import compat
from ..matrices.petsc_rows import aij_of, rows_of
from ..mesh.group_checks import facets_of
from ..mesh.tagged_mesh import Facets
from .loads import Pressure
from .space import FemSpace
from .water_pressure import find_compliance

MODELS = ("added mass", "incompressible", "at rest")
WESTERGAARD = 0.875
QUADRATURE = 8  # degree, for the root of the depth
ALIKE = 1e-9  # of the depth: nodes of one height


@dataclass(frozen=True)
class Reservoir:
    """Put water before a face by the equations of the module.

    Args:
        face: the wet face of the body.
        level: height of the water level [m], on the last axis of the mesh.
        model: "added mass", "incompressible", or "at rest" for the pressure at rest alone.
        floor: bottom of the reservoir, which the water presses too; None: it has none.
        tail_face: face of the tail water, at rest; given with ``tail``.
        tail: height of the tail water [m].
        silt: height of the silt before the face [m]; None: no silt.
        silt_weight: weight of the silt under water, gamma' [N/m³].
        silt_ratio: K, its horizontal pressure over the vertical one.
        gamma: weight of the water [N/m³].
        length: distance of the far end [m], of "incompressible" water; 5 times the depth when None.
    """

    face: Facets
    level: Annotated[float, Finite, Unit("m"), "the level"]
    model: str = "added mass"
    floor: Facets | None = None
    tail_face: Facets | None = None
    tail: Annotated[float | None, Finite, Unit("m"), "the tail water"] = None
    silt: Annotated[float | None, Finite, Unit("m"), "the silt"] = None
    silt_weight: Annotated[float, NotNegative, Unit("N/m³"), "silt_weight"] = 9000.0
    silt_ratio: Annotated[float, NotNegative, RATIO, "silt_ratio"] = 0.5
    gamma: Annotated[float, Positive, Unit("N/m³"), "gamma"] = WATER_WEIGHT
    length: Annotated[float | None, Positive, Unit("m"), "the length"] = None

    def __post_init__(self) -> None:
        check_fields(self)
        facets_of("Reservoir", "face", self.face)
        for name in ("floor", "tail_face"):
            optional(facets_of, "Reservoir", name, getattr(self, name))
        if self.model == "acoustic":
            raise InputError(
                "Reservoir: model 'acoustic', compressible water, is not there yet: give "
                "'incompressible', which is exact for slow motions, or 'added mass'"
            )
        if self.model not in MODELS:
            raise InputError(
                f"Reservoir: model is {quote(self.model)}; give {' or '.join(map(quote, MODELS))}"
            )
        if (self.tail is None) != (self.tail_face is None):
            raise InputError(
                "Reservoir: tail and tail_face belong together: give the level of the tail water "
                "and its face, or none of the two"
            )
        if self.tail is not None and self.tail > self.level:
            raise InputError(
                f"Reservoir: the tail water at {self.tail:g} m is above the level {self.level:g} "
                "m: exchange face and tail_face"
            )

    def make_loads(self) -> list[Pressure]:
        """Return the pressures at rest: of water, of silt and of the tail water."""
        loads = [Pressure(self.face, self._press_at(self.level, self.gamma))]
        if self.floor is not None:
            loads.append(Pressure(self.floor, self._press_at(self.level, self.gamma)))
        if self.silt is not None:
            weight = self.silt_ratio * self.silt_weight
            loads.append(Pressure(self.face, self._press_at(self.silt, weight)))
        if self.tail_face is not None and self.tail is not None:
            loads.append(Pressure(self.tail_face, self._press_at(self.tail, self.gamma)))
        return loads

    def name_loads(self) -> list[str]:
        """Return what the loads of ``make_loads`` are, such as "silt on 'face'"."""
        names = [f"water on '{self.face.name}'"]
        if self.floor is not None:
            names.append(f"water on '{self.floor.name}'")
        if self.silt is not None:
            names.append(f"silt on '{self.face.name}'")
        if self.tail_face is not None:
            names.append(f"tail water on '{self.tail_face.name}'")
        return names

    def _press_at(self, level: float, weight: float) -> Any:
        """Return the function (points, t) -> weight max(level - y, 0) [Pa]."""
        return lambda points, t: weight * np.maximum(level - points[:, -1], 0.0)

    def assemble_mass(self, space: FemSpace, thickness: float) -> Any:
        """Return M_w of all components (PETSc), None for water at rest. Collective.

        Args:
            space: the body's unknowns.
            thickness: of the section [m].

        Raises:
            InputError: a level above the face or below it, and faces that the model does not take.
        """
        bottom, top = self._find_ends(space)
        if self.level > top + ALIKE * (top - bottom):
            raise InputError(
                f"Reservoir: the level {self.level:g} m is above the top of '{self.face.name}' at "
                f"{top:g} m: water that flows over is not modelled, so give a lower level"
            )
        if self.level <= bottom:
            raise InputError(
                f"Reservoir: the level {self.level:g} m is below the foot of '{self.face.name}' at "
                f"{bottom:g} m: give a higher level, or leave the reservoir out"
            )
        if self.model == "at rest":
            return None
        if self.model == "added mass":
            return self._assemble_westergaard(space, bottom, thickness)
        return self._assemble_exact(space, thickness)

    @property
    def density(self) -> float:
        """Return rho of the water [kg/m³]."""
        return self.gamma / STANDARD_GRAVITY

    def _find_ends(self, space: FemSpace) -> tuple[float, float]:
        """Return the lowest and the highest height [m] of nodes of the face. Collective."""
        heights = space.points[space.facet_blocks(self.face.indices), -1]
        low = -largest(space.comm, np.max(-heights, initial=-np.inf))
        return low, largest(space.comm, np.max(heights, initial=-np.inf))

    def _assemble_westergaard(self, space: FemSpace, bottom: float, thickness: float) -> Any:
        """Return ∫ 7/8 rho sqrt(h (h - y)) (u·n)(v·n). Collective."""
        mesh = space.mesh
        u = ufl.TrialFunction(space.V)
        v = ufl.TestFunction(space.V)
        n = ufl.FacetNormal(mesh)
        below = ufl.max_value(self.level - ufl.SpatialCoordinate(mesh)[mesh.geometry.dim - 1], 0.0)
        mass = WESTERGAARD * self.density * ufl.sqrt((self.level - bottom) * below)
        measure = compat.measure(mesh, mesh.topology.dim - 1, self.face.indices)
        measure = measure(metadata={"quadrature_degree": QUADRATURE})
        form = thickness * mass * ufl.dot(u, n) * ufl.dot(v, n) * measure
        return compat.assemble_matrix(space.compile_form(form))

    def _assemble_exact(self, space: FemSpace, thickness: float) -> Any:
        """Return rho S G Sᵀ, with S the forces of nodal pressures and G of ``water_pressure``.

        Collective.
        """
        if space.dimension != 2:
            raise InputError(
                "Reservoir: model 'incompressible' is for the plane: give 'added mass' in space"
            )

        # S: forces [m²] on all components of a pressure of one at each node, ∫ psi_j n_c N_i.
        g = ufl.TrialFunction(space.V)
        v = ufl.TestFunction(space.V)
        n = ufl.FacetNormal(space.mesh)
        measure = compat.measure(space.mesh, space.mesh.topology.dim - 1, self.face.indices)
        form = thickness * ufl.inner(g[0] * n, v) * measure
        mat = compat.assemble_matrix(space.compile_form(form))
        own = rows_of(mat).tocoo()
        first = mat.getOwnershipRange()[0]
        size = mat.getSize()[1]
        columns = mat.getLocalSize()[1]
        mat.destroy()

        # All ranks know the face: its nodes from the floor up, and S.
        blocks = space.facet_blocks(self.face.indices)
        numbers = first + space.dimension * blocks
        parts = space.comm.bcast(
            space.comm.gather((numbers, space.points[blocks], own.row + first, own.col, own.data))
        )
        number, points, rows, places, values = (
            np.concatenate([part[k] for part in parts]) for k in range(5)
        )
        order = np.argsort(points[:, 1], kind="stable")
        number = number[order]
        points = points[order]
        S = sp.csr_matrix((values, (rows, places)), shape=(size, size))

        G = self._find_compliance(S, number, points)
        touched = np.unique(rows)
        of_face = S[touched][:, number].toarray()
        # S has the thickness on both sides, and the water has it once
        dense = self.density / thickness * (of_face @ G @ of_face.T)
        mine = (touched >= first) & (touched < first + own.shape[0])
        place = np.repeat(touched[mine] - first, len(touched))
        added = sp.csr_matrix(
            (dense[mine].ravel(), (place, np.tile(touched, int(mine.sum())))),
            shape=(own.shape[0], size),
        )
        return aij_of(added, space.mesh.comm, columns)

    def _find_compliance(self, S: Any, number: Array, points: Array) -> Array:
        """Return G (k, k) of all nodes of the face, zero above the level.

        Args:
            S: forces of nodal pressures.
            number: their rows of the first component (k,), from the floor up.
            points: (k, 2) [m].
        """
        depth = self.level - points[0, 1]
        if np.any(np.diff(points[:, 1]) <= ALIKE * depth):
            raise InputError(
                f"Reservoir: '{self.face.name}' has two nodes at one height: 'incompressible' "
                "water needs a face that goes up all the way, so name its floor apart"
            )
        wet = np.flatnonzero(points[:, 1] < self.level - ALIKE * depth)
        x = points[wet, 0]
        y = points[wet, 1]

        # A node of the water at the level: that of the face, or one on the line to the next node.
        end = points[wet[-1] + 1]
        share = (self.level - y[-1]) / (end[1] - y[-1])
        x = np.append(x, x[-1] + share * (end[0] - x[-1]))
        y = np.append(y, self.level)

        # n is out of the body, and so into the water.
        side = 1.0 if S[:, number].sum(axis=1)[number].sum() > 0.0 else -1.0
        length = self.length or 5.0 * depth
        G = np.zeros((len(points), len(points)))
        G[np.ix_(wet, wet)] = find_compliance(x, y, side, length)[:-1, :-1]
        return G


def list_pressures(reservoir: Any) -> list[Pressure]:
    """Return the pressures at rest of a reservoir; none without one.

    Raises:
        InputError: it is no ``Reservoir``.
    """
    if reservoir is None:
        return []
    remedy = "give fem.Reservoir(…), or leave it out"
    instance("assemble", "reservoir", reservoir, Reservoir, remedy)
    pressures: list[Pressure] = reservoir.make_loads()
    return pressures
