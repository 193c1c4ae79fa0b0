"""Let the ground go on behind boundaries: dashpots absorb waves, and a base lets waves in.

Lysmer and Kuhlemeyer (1969), J. Eng. Mech. Div. ASCE 95, 859-877: on facets with outward normal n

    sigma_n = -normal rho c_P v_n,    tau = -tangential rho c_S v_t

with factors 1 exact for waves that arrive at right angles. The tractions are integrated with the
shape functions and the section's thickness into C: their loss is in the damping column of the
energy ledger. They hold no static load. A compliant base adds the traction of an upgoing wave v_up,
whatever its direction:

    sigma_n += 2 rho c_P v_up_n,    tau += 2 rho c_S v_up_t.

The wave that comes back down passes through the dashpots: the record of the base is not the input,
but up + down.
"""

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

import numpy as np
import ufl

from ...core.algebra import Array, largest
from ...core.arguments import check_fields
from ...core.checks import function, instance, optional
from ...core.errors import InputError
from ...core.quantities import NotNegative
from ...laws.materials import LinearElastic, Section
from .. import compat
from ..matrices.petsc_algebra import PetscMatrix
from ..mesh.group_checks import facets_of
from ..mesh.tagged_mesh import Facets
from .space import FemSpace

log = logging.getLogger(__name__)
NO_RESISTANCE = 1e-12  # of the resistance of all dashpots: a smaller share is none


@dataclass(frozen=True)
class BoundaryLoads:
    """Hold what a boundary puts on the body: functions t [s] -> (n,) [N] on the free unknowns.

    Attributes:
        elastic: loads whose work is that of external forces.
        viscous: loads that belong to the damping of the boundary (``Load.viscous``).
        companions: motions marched beside the run, on which the loads depend.
    """

    elastic: tuple[Callable[[float], Array], ...] = ()
    viscous: tuple[Callable[[float], Array], ...] = ()
    companions: tuple[Any, ...] = ()


@dataclass(frozen=True)
class Dashpots:
    """Put absorbing dashpots on facets.

    Args:
        facets: a part of the outer boundary.
        material: that of the half-space behind; of the adjacent cells when None.
        normal: factor of rho c_P, to mistune or leave it out.
        tangential: the like for rho c_S.
    """

    facets: Facets
    material: LinearElastic | None = None
    normal: Annotated[float, NotNegative] = 1.0
    tangential: Annotated[float, NotNegative] = 1.0
    # no motion comes in here: where some does, displacements of a run are those in space, and no
    # longer relative to the ground
    lets_waves_in: ClassVar[bool] = False

    def __post_init__(self) -> None:
        owner = type(self).__name__
        facets_of(owner, "facets", self.facets)
        optional(
            instance,
            owner,
            "material",
            self.material,
            LinearElastic,
            "give a LinearElastic, or None",
        )
        check_fields(self)

    def loads(self, matrix: "DashpotMatrix", forms: Any) -> BoundaryLoads:
        """Return what acts on the body here besides the dashpots: nothing. Collective.

        Args:
            matrix: that of these dashpots.
            forms: the ElasticForms of the body.
        """
        return BoundaryLoads()

    @property
    def expects(self) -> str:
        """Return the words for the log that say which motion this boundary expects."""
        return "takes no motion: waves leave the body and none come in"


@dataclass(frozen=True, kw_only=True)
class CompliantBase(Dashpots):
    """Put dashpots and an upgoing wave on a boundary.

    Args:
        motion: t [s] -> v_up (d,) [m/s], half the velocity of an outcrop (``upgoing``).
    """

    motion: Callable[[float], Array] = field(repr=False)
    lets_waves_in: ClassVar[bool] = True

    def __post_init__(self) -> None:
        super().__post_init__()
        function(
            "CompliantBase",
            "motion",
            self.motion,
            "give upgoing(record), or a function of the time [s]",
        )

    def loads(self, matrix: "DashpotMatrix", forms: Any) -> BoundaryLoads:
        """Return the load of the upgoing wave, 2 Pᵀ D v_up."""
        load = matrix.make_load(self.motion, 2.0)
        load(0.0)  # a motion of other components is refused before any work
        return BoundaryLoads(viscous=(load,))

    @property
    def expects(self) -> str:
        """Return which motion the boundary expects, in words."""
        return (
            "expects the upgoing motion, half the velocity of an outcrop (not the within "
            "motion of its depth)"
        )


class DashpotMatrix:
    """Assemble the matrix D of some dashpots: D v are the nodal forces against a velocity v.

        vᵀD w = ∫ (z_P (v·n)(w·n) + z_S (v·w - (v·n)(w·n))) ds

    with the impedances z_P = normal rho c_P and z_S = tangential rho c_S times the thickness.

    Attributes:
        mat: D of all components, before elimination (PETSc).
    """

    def __init__(self, space: FemSpace, forms: Any, dashpots: Dashpots) -> None:
        """Assemble D. Collective.

        Args:
            space: the body's unknowns.
            forms: its ElasticForms.
            dashpots: the boundary.

        Raises:
            InputError: no material to take wave speeds from, facets that are not on the outer
                boundary, or prescribed in a direction that the dashpots resist.
        """
        self.space = space
        self.dashpots = dashpots
        own = dashpots.material is not None
        if not own and not forms.fields:
            raise InputError(
                f"dashpots on '{dashpots.facets.name}' need a density and wave speeds, and forms=… "
                f"have none: give {type(dashpots).__name__}(…, material=), or a material beside "
                "the forms"
            )
        # impedances as functions on the cells: of their constants, which carry the thickness, or
        # everywhere those of the material behind
        if own:
            cells = compat.cell_space(space.mesh)
            moduli = [0.0, 0.0, 0.0]
        else:
            cells = forms.fields["rho"].function_space
            moduli = [forms.fields[name].x.array for name in ("lame", "shear", "rho")]
        cellwise = []
        for values in impedances(dashpots, forms.section, *moduli):
            impedance = compat.function(cells)
            impedance.x.array[:] = values
            cellwise.append(impedance)
        self._normal, self._tangential = cellwise
        self.mat = self._assemble(dashpots.facets.indices)
        self._refuse_held()

    def _assemble(self, facets: Any) -> Any:
        """Assemble D over some local facets. Collective."""
        u = ufl.TrialFunction(self.space.V)
        v = ufl.TestFunction(self.space.V)
        n = ufl.FacetNormal(self.space.mesh)
        along = ufl.dot(u, n) * ufl.dot(v, n)
        density = self._normal * along + self._tangential * (ufl.inner(u, v) - along)
        measure = compat.measure(self.space.mesh, self.space.mesh.topology.dim - 1, facets)
        return compat.assemble_matrix(self.space.compile_form(density * measure))

    def _sum_resistance(self, mat: Any) -> Array:
        """Return e_cᵀD e_c (d,) of the unit translation in every direction c. Collective."""
        whole = PetscMatrix(mat)
        return self.space.comm.sum(np.array([e @ (whole @ e) for e in self.space.translations]))

    def _refuse_held(self) -> None:
        """Raise InputError where D resists nothing, or a motion that is prescribed. Collective."""
        name = self.dashpots.facets.name
        total = self._sum_resistance(self.mat).sum()
        if np.isnan(total):
            raise InputError(
                f"dashpots on '{name}' stand beside orthotropic cells, whose waves have several "
                f"speeds: give {type(self.dashpots).__name__}(…, material=)"
            )
        if total == 0.0:
            raise InputError(
                f"dashpots on '{name}' resist nothing: choose facets of the outer boundary and a "
                "positive factor"
            )
        # on facets that a condition holds in some components, D must not resist these
        for condition in self.space.prescribed:
            for both, held in condition.on_facets(self.space, self.dashpots.facets.indices):
                if not largest(self.space.comm, len(both)):
                    continue
                resisted = self._sum_resistance(self._assemble(both)) > NO_RESISTANCE * total
                if any(resisted[c] for c in held):
                    raise InputError(
                        f"boundary '{name}' has dashpots in a direction that is prescribed on "
                        f"'{condition.name}': a component is either prescribed or damped, so leave "
                        "out one of the two"
                    )

    def make_load(
        self, motion: Callable[[float], Array], factor: float
    ) -> Callable[[float], Array]:
        """Return the load t -> factor Pᵀ D v(t) [N] on the free unknowns. Collective.

        Args:
            motion: t [s] -> v (d,) [m/s], the same at all nodes.
            factor: 2 of an upgoing wave, which the boundary throws back.
        """
        # v is a sum of unit translations, so that D is multiplied once and not at every time
        whole = PetscMatrix(self.mat)
        rows = [self.space.pull(whole @ e) for e in self.space.translations]
        columns = factor * np.column_stack(rows)
        name = type(self.dashpots).__name__

        def load(t: float) -> Array:
            v = np.asarray(motion(t))
            if v.dtype.kind not in "iuf" or v.shape != (len(rows),) or not np.all(np.isfinite(v)):
                raise InputError(
                    f"{name}: motion({t:g}) is {v}: return {len(rows)} finite velocities"
                )
            return np.asarray(columns @ v)

        return load


def impedances(
    dashpots: Dashpots, section: Section, lame: Any, shear: Any, rho: Any
) -> tuple[Any, Any]:
    """Return the impedances normal rho c_P and tangential rho c_S, times the thickness [Pa s].

        rho c_P = sqrt((lambda + 2 mu) rho),   rho c_S = sqrt(mu rho)

    They are those of the dashpots' own material or, where they have none, of the ground beside.

    Args:
        dashpots: the absorbing boundary.
        section: that of the body.
        lame: Lamé's first constant beside it, times the thickness [Pa m].
        shear: the shear modulus, times the thickness [Pa m].
        rho: the density, times the thickness [kg/m²].
    """
    # the thickness is a factor of both constants under the root, and so of the root
    if dashpots.material is not None:
        rho = section.thickness * dashpots.material.rho
        lame, shear = (
            section.thickness * value for value in section.elastic_constants(dashpots.material)
        )
    normal = dashpots.normal * np.sqrt((lame + 2.0 * shear) * rho)
    return normal, dashpots.tangential * np.sqrt(shear * rho)


def describe_boundaries(
    boundaries: Sequence[Dashpots], rank: int, notes: tuple[str, ...] = ()
) -> tuple[str, ...]:
    """Return these notes, and which motion each boundary expects; rank 0 logs them.

    Args:
        boundaries: absorbing boundaries.
        rank: this one's.
        notes: sentences that come first.
    """
    notes += tuple(
        f"{type(boundary).__name__} on '{boundary.facets.name}' {boundary.expects}"
        for boundary in boundaries
    )
    if rank == 0:
        for note in notes:
            log.info("%s", note)
    return notes
