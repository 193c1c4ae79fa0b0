"""Let the ground go on behind boundaries.

There are dashpots that absorb waves, and a base that lets waves in from below.

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

    ``elastic`` and ``viscous``: general and viscous parts of the load; ``companions``: motions
    marched beside the run.
    """

    elastic: tuple[Callable[[float], Array], ...] = ()
    viscous: tuple[Callable[[float], Array], ...] = ()
    companions: tuple[Any, ...] = ()


@dataclass(frozen=True)
class Dashpots:
    """Put absorbing dashpots on facets.

    ``material``: of the adjacent cells when None, or of the half-space behind.

    ``normal``, ``tangential``: factors of rho c_P and rho c_S, to mistune or leave one out.
    """

    facets: Facets
    material: LinearElastic | None = None
    normal: Annotated[float, NotNegative] = 1.0
    tangential: Annotated[float, NotNegative] = 1.0
    lets_waves_in: ClassVar[bool] = (
        False  # the run's motion does not come in here; displacements would be of space
    )

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
        """Return what acts on the body here besides the dashpots: nothing.

        ``forms``: ``ElasticForms``. Collective.
        """
        return BoundaryLoads()

    @property
    def expects(self) -> str:
        """Return the words for the log that say which motion this boundary expects."""
        return "takes no motion: waves leave the body and none come in"


@dataclass(frozen=True, kw_only=True)
class CompliantBase(Dashpots):
    """Put dashpots and an upgoing wave ``motion`` on a boundary.

    It is t [s] -> v_up (d,) [m/s], half the outcrop's (``upgoing``).
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
    """Assemble the full matrix D of some dashpots (PETSc), with n·D v the force that resists them.

    InputError for facets that are not on the outer boundary, or prescribed in a direction that the
    dashpots resist.
    """

    def __init__(self, space: FemSpace, forms: Any, dashpots: Dashpots) -> None:
        self.space = space
        self.dashpots = dashpots
        own = dashpots.material is not None
        if not own and not forms.fields:
            raise InputError(
                f"dashpots on '{dashpots.facets.name}' need a density and wave speeds, and forms=… "
                f"have none: give {type(dashpots).__name__}(…, material=), or a material beside "
                "the forms"
            )
        cells = compat.cell_space(space.mesh) if own else forms.fields["rho"].function_space
        # times thickness
        moduli = (0.0 if own else forms.fields[name].x.array for name in ("lame", "shear", "rho"))
        cellwise = []
        for values in impedances(dashpots, forms.section, *moduli):
            cellwise.append(compat.function(cells))
            cellwise[-1].x.array[:] = values
        self._normal, self._tangential = cellwise
        self.mat = self._matrix(dashpots.facets.indices)
        self._refuse_held()

    def _matrix(self, facets: Any) -> Any:
        """Assemble D over some facets."""
        u = ufl.TrialFunction(self.space.V)
        v = ufl.TestFunction(self.space.V)
        n = ufl.FacetNormal(self.space.mesh)
        along = ufl.dot(u, n) * ufl.dot(v, n)
        density = self._normal * along + self._tangential * (ufl.inner(u, v) - along)
        measure = compat.measure(self.space.mesh, self.space.mesh.topology.dim - 1, facets)
        return compat.assemble_matrix(self.space.compile_form(density * measure))

    def _resistance(self, mat: Any) -> Array:
        """Return ∫ e_c·D e_c of every direction c, on all ranks."""
        whole = PetscMatrix(mat)
        return self.space.comm.sum(np.array([e @ (whole @ e) for e in self.space.translations]))

    def _refuse_held(self) -> None:
        name = self.dashpots.facets.name
        total = self._resistance(self.mat).sum()
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
        for condition in self.space.prescribed:
            for both, held in condition.on_facets(self.space, self.dashpots.facets.indices):
                if not largest(self.space.comm, len(both)):
                    continue
                resisted = self._resistance(self._matrix(both)) > NO_RESISTANCE * total
                if any(resisted[c] for c in held):
                    raise InputError(
                        f"boundary '{name}' has dashpots in a direction that is prescribed on "
                        f"'{condition.name}': a component is either prescribed or damped, so leave "
                        "out one of the two"
                    )

    def make_load(
        self, motion: Callable[[float], Array], factor: float
    ) -> Callable[[float], Array]:
        """Return the load factor Pᵀ D v(t), v the same at all nodes."""
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
    """Return thickness · (normal rho c_P, tangential rho c_S).

    They are those of the ground beside the dashpots, whose constants given here hold the thickness
    already, or of their own material.

    Args:
        dashpots: the absorbing boundary.
        section: that of the body.
        lame: Lamé's first constant beside it, times the thickness [Pa m].
        shear: the shear modulus, times the thickness [Pa m].
        rho: the density, times the thickness [kg/m²].
    """
    if dashpots.material is not None:
        rho = section.thickness * dashpots.material.rho
        lame, shear = (
            section.thickness * value for value in section.elastic_constants(dashpots.material)
        )
    return dashpots.normal * np.sqrt((lame + 2.0 * shear) * rho), dashpots.tangential * np.sqrt(
        shear * rho
    )


def describe_boundaries(
    boundaries: Sequence[Dashpots], rank: int, notes: tuple[str, ...] = ()
) -> tuple[str, ...]:
    """Return these notes and what each boundary expects, logged on rank 0.

    Args:
        boundaries: absorbing boundaries.
        rank: this one's.
        notes: what comes first.
    """
    notes += tuple(
        f"{type(one).__name__} on '{one.facets.name}' {one.expects}" for one in boundaries
    )
    for note in notes if rank == 0 else ():
        log.info("%s", note)
    return notes
