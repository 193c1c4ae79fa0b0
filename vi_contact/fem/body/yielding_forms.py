"""State a body of materials that yield: K, C and the internal force by points of integration.

M is that of the densities. K is the elastic stiffness, the reference of the steps and of damping.
"""

import logging
from collections.abc import Callable, Sequence
from math import radians, sin
from typing import Any

import numpy as np
import ufl

from ...core.algebra import Array, Mask, total
from ...core.errors import InputError
from ...core.internal import InternalForce
from ...laws.drucker_prager import DruckerPrager
from ...laws.materials import Damping, LinearElastic, PlaneStress, Section
from ...laws.mohr_coulomb import MohrCoulomb
from ...laws.yielding import YieldingMaterial
from .. import compat
from .forms import ElasticForms
from .space import FemSpace
from .strain_points import StrainPoints
from .yielding import YieldingForce, make_elastic_matrix, make_parts, make_starts

log = logging.getLogger(__name__)
LOCKS = (
    "%s lock where materials flow without a change of volume: limit loads are too large by 15 %% "
    "and more. Give %s"
)


class YieldingForms(ElasticForms):
    """Hold the matrices and the internal force of one body that yields."""

    tells_stress = False
    takes_companions = True
    nonlinear = "a material that yields"

    def __init__(
        self,
        space: FemSpace,
        materials: list[tuple[Any, Any]],
        section: Section,
        damping: Damping,
        *,
        integration: str,
        initial_stress: Callable[[Array], Array] | None,
    ) -> None:
        """Tabulate strains, and begin without any yielding. Collective.

        Args:
            space: the body's unknowns.
            materials: pairs of local cells and a material, which cover every cell once.
            section: that of the body.
            damping: the law of C, of the elastic K.
            integration: "full" or "bbar".
            initial_stress: that of the points at the start.

        Raises:
            InputError: what materials that yield do not go with.
        """
        refuse_beside(space, [given for _, given in materials], section)
        materials = keep_present(space, materials)
        elastic = [(where, getattr(given, "elastic", given)) for where, given in materials]
        super().__init__(space, elastic, section, damping)
        if any(type(given) is not YieldingMaterial for _, given in materials):
            warn_of_locking(space, integration)
        self.integration = integration
        self._given = materials
        self._points = StrainPoints(
            space,
            section.thickness,
            degree=space.quadrature_degree,
            mean_dilatation=integration == "bbar",
        )
        self._parts = make_parts(self._points, materials)
        self._betas = [damping.coefficients(given)[1] for _, given in elastic]
        if initial_stress is None:
            _warn_of_weak_ratio(space, [given for _, given in materials])
        starts = make_starts(space, self._points, self._parts, initial_stress)
        self.internal: InternalForce = YieldingForce(space, self._points, self._parts, starts)
        self.notes = describe([given for _, given in materials], integration)

    @property
    def given_materials(self) -> list[tuple[Any, Any]]:
        """Return (local cells, material) as they were given, of present cells. Collective."""
        comm = self.space.comm
        return [pair for pair in self._given if total(comm, float(len(pair[0]))) > 0.0]

    def matrix(self, name: str) -> Any:
        """Assemble the full matrix M, K, or C (PETSc), before elimination."""
        if name == "M":
            return super().matrix("M")
        if name == "K":
            return make_elastic_matrix(self._points, self._parts)
        matrix = compat.assemble_matrix(self.space.compile_form(self.bilinear("C")))
        share = make_elastic_matrix(self._points, self._parts, self._betas)
        matrix.axpy(1.0, share, structure=share.Structure.DIFFERENT_NONZERO_PATTERN)
        share.destroy()
        return matrix

    def bilinear(self, name: str) -> Any:
        """Return the form of M or K, or that part of C which is not of K."""
        if name != "C":
            return super().bilinear(name)
        form = self.fields["alpha_rho"] * ufl.inner(self.u, self.v) * ufl.dx
        return form + self._viscous_form() if self.viscous else form

    def find_damping_row(self, values: Array, inside: Mask) -> Array:
        """Return the part of rᵀC that is of the elastic stiffness, (owned nodes d,). Collective.

        Args:
            values: r (local nodes d,), ghosts among them.
            inside: (local cells,) the cells that count.
        """
        points = self._points
        eps = points.strain_of(values) * _repeat(points, inside)
        sigma = np.zeros_like(eps)
        for part, beta in zip(self._parts, self._betas, strict=True):
            sigma[part.points] = beta * eps[part.points] @ part.law.stiffness(points.components)
        return points.nodal_force(sigma)

    def find_stress_row(self, values: Array, inside: Mask) -> Array:
        """Return w (B r) (points, n) [m³], whose product with stresses is their work on r.

        Args:
            values: r (local nodes d,), ghosts among them.
            inside: (local cells,) the cells that count.
        """
        points = self._points
        eps = points.strain_of(values) * _repeat(points, inside)
        return points.weights.reshape(-1, 1) * eps

    def stresses(self, u: Any) -> tuple[Any, Any]:
        """Return the elastic stress of the trial function; refuse the stress of a displacement.

        Raises:
            InputError: a material that yields has no stress that a displacement alone tells.
        """
        if u is self.u:
            return super().stresses(u)
        raise InputError(
            "the stress of a material that yields depends on its past: read it from the memory of "
            "a state, as docs/guide/yielding.md shows"
        )


def _repeat(points: StrainPoints, inside: Mask) -> Array:
    """Return one (points, 1) where the cell of a point counts, else zero."""
    return np.repeat(np.asarray(inside[: points.cells], dtype=float), points.each)[:, None]


def refuse_beside(space: FemSpace, materials: Sequence[Any], section: Section) -> None:
    """Raise InputError for what materials that yield do not go with.

    Args:
        space: the body's unknowns.
        materials: all of the body.
        section: that of the body.
    """
    name = next(type(given).__name__ for given in materials if isinstance(given, YieldingMaterial))
    if isinstance(section, PlaneStress) or space.dimension == 1:
        raise InputError(
            f"{name} is for plane strain and for bodies in space, where the stress across the "
            "plane is known: give PlaneStrain(), or leave the section out"
        )
    if space.moves:
        raise InputError(
            f"{name} does not go with supports that move: hold them, and shake the body by "
            "excitation=, or let the obstacle move"
        )
    for given in materials:
        if not isinstance(given, LinearElastic | YieldingMaterial):
            raise InputError(
                f"{name} does not go with {type(given).__name__} in one body: give a LinearElastic "
                "where nothing yields"
            )


def keep_present(space: FemSpace, materials: list[tuple[Any, Any]]) -> list[tuple[Any, Any]]:
    """Return the materials with their present cells; a material of none stays, with no cells.

    Args:
        space: the body's unknowns.
        materials: pairs of local cells and a material.
    """
    if space.absent is None:
        return materials
    kept = []
    for where, given in materials:
        cells = np.asarray(where)
        kept.append((cells[~space.absent[cells]], given))
    return kept


def warn_of_locking(space: FemSpace, integration: str) -> None:
    """Warn, on rank 0, of cells that are too stiff where the flow keeps the volume."""
    if space.degree == 2 or integration == "bbar" or space.comm.rank != 0:
        return
    if compat.is_simplex(space.mesh):
        log.warning(LOCKS, "first-order triangles and tetrahedra", "degree=2")
    else:
        log.warning(LOCKS, "first-order cells", "integration='bbar' or degree=2")


def _warn_of_weak_ratio(space: FemSpace, materials: Sequence[Any]) -> None:
    """Warn, on rank 0, of soil without cohesion that level ground yields under its own weight.

    Elastic ground at rest has the ratio nu/(1 - nu) of stresses, which must not be below Ka.
    """
    for given in materials:
        if not isinstance(given, DruckerPrager | MohrCoulomb) or given.cohesion or space.comm.rank:
            continue
        sine = sin(radians(given.phi))
        active = (1.0 - sine) / (1.0 + sine)
        elastic = given.nu / (1.0 - given.nu)
        if elastic < active:
            log.warning(
                "%s: level ground yields under its own weight, as nu/(1 - nu) = %.3g is below "
                "Ka = %.3g: give a larger nu, or a stress at rest (initial_stress)",
                type(given).__name__,
                elastic,
                active,
            )


def describe(materials: Sequence[Any], integration: str) -> tuple[str, ...]:
    """Return sentences on the materials, for log and summary.

    Args:
        materials: all of the body.
        integration: "full" or "bbar".
    """
    names = sorted({type(given).__name__ for given in materials})
    mean = ", tr eps as its mean over each cell" if integration == "bbar" else ""
    notes = [f"the body may yield ({', '.join(names)}{mean}): damping is of its elastic stiffness"]
    fits = sorted({given.fit for given in materials if isinstance(given, DruckerPrager)})
    if fits:
        notes.append(f"DruckerPrager stands for Mohr and Coulomb by the fit {' and '.join(fits)}")
    return tuple(notes)
