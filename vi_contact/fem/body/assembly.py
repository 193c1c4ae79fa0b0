"""Assemble the semi-discrete system of a linear elastic body.

It is M u'' + C u' + K u = f(t) (boundary method, eqs. 7-10a).

    sigma = lambda_eff tr(eps) I + 2 mu eps,   M = ∫ rho u·v
    K = ∫ sigma(u):eps(v),   C = alpha M + beta K

integrated over the mesh times the section's thickness. Prescribed displacements are eliminated: u =
P u_free + U(t), so M, C, K are Pᵀ(·)P and the load gets -Pᵀ(K U + C U' + M U'').
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Annotated, Any

import numpy as np
import ufl

from ...core.algebra import Array, from_each
from ...core.checks import optional, whole
from ...core.collective import Parts, agree
from ...core.quantities import Unit
from ...core.stages import stage
from ...core.system import Load, SemiDiscreteSystem
from ...laws.free_motions import Unheld, floats
from ...laws.materials import Damping, Section
from .. import compat
from ..matrices.half import algebra_for
from ..matrices.petsc_algebra import PetscAlgebra, PetscMatrix, as_petsc
from ..matrices.petsc_rows import moved
from ..mesh.communicators import MpiComm, give_back
from ..mesh.numbering import number_nodes
from ..mesh.tagged_mesh import Cells, Facets
from .assembly_checks import (
    check_body,
    check_boundaries,
    check_initial,
    check_nodes,
    check_ratios,
    refuse_folded,
)
from .dashpots import DashpotMatrix, Dashpots, describe_boundaries
from .dirichlet import refuse_contradictions, taken, taken_space
from .forms import ElasticForms, Materials, cell_materials
from .initial_strains import InitialStrain, InitialStrains
from .linear_forms import AnyLoad, LinearForm, Loads
from .loads import Prescribed, as_tuple, evaluate
from .own_forms import Forms, OwnForms
from .space import FemSpace
from .ties import Tied

Field = tuple[float, ...] | Callable[[Array], Array]
Initial = Field | Sequence[tuple[Cells, Field]] | None

LIGHTER = (
    "inertia load of the ground motion: the convention of the catalogue's reference numbers, which "
    "leave out the mass that elements share with the base"
)


@stage("assembling")
def assemble(
    mesh: Any,
    material: Materials | None = None,
    *,
    forms: Forms | None = None,
    section: Section | None = None,
    clamped: Facets | Sequence[Facets] = (),
    prescribed: Prescribed | Sequence[Prescribed] = (),
    tied: Tied | Sequence[Tied] = (),
    dashpots: Dashpots | Sequence[Dashpots] = (),
    loads: Loads = (),
    damping: Damping | None = None,
    initial_displacement: Annotated[Initial, Unit("m")] = None,
    initial_velocity: Annotated[Initial, Unit("m/s")] = None,
    base_inertia: bool = True,
    degree: int = 1,
    quadrature_degree: int | None = None,
    integration: str = "full",
    space: Any = None,
    bcs: Any = (),
) -> SemiDiscreteSystem:
    """Assemble the system of a body, on the free unknowns.

    Args:
        mesh: DOLFINx mesh (``read_mesh``) with cells of first order or, with degree 2, of second
            order too.
        degree: degree of the displacement in each cell: 1 for P1 or Q1, 2 for P2 or Q2
            (docs/guide/second_order.md).
        material: LinearElastic, Orthotropic or fem.Heterogeneous, or (cells, material) pairs that
            cover the mesh.
        forms: the user's own weak forms, ``fem.Forms``; a material beside them gives the density
            where they have no mass, and the wave speeds that dashpots and free fields need.
        section: PlaneStrain() by default in 2D (Solid() in 3D); PlaneStress(thickness) for panels.
        space: the user's own DOLFINx space V of the displacement, which sets the degree.
        bcs: ``dirichletbc`` objects on V, a space like it, or V.sub(i). They keep their present
            values; where two meet, the last one counts.
        clamped: facets with u = 0.
        prescribed: facets that move (eq. 3) or are held in some components.
        dashpots: absorbing boundaries: Dashpots, CompliantBase, soil.FreeField. Their loss counts
            as damping.
        tied: boundaries whose opposite nodes move together.
        damping: NoDamping() by default, MassProportional(c) (eq. 7), Rayleigh, KelvinVoigt, or
            DampingRatio, which alone reads the xi of materials.
        loads: tractions (eqs. 4, 6), body forces, InitialStrain, LinearForm.
        base_inertia: whether the inertia load of a ground motion counts the mass that elements
            share with prescribed nodes. True is right for motions relative to the ground; False is
            the load of docs/start/first_wall.md.
        integration: "full", or "selective" for nearly incompressible bodies of quadrilaterals or
            hexahedra, where each cell has one mean value of tr eps (``dilatation``).
        initial_displacement: constant or points (k, d) -> (k, d) (eqs. 10, 10a), or (cells, value)
            pairs for several bodies. Where cells meet, the later pair counts; cells without a pair
            start from zero.
        initial_velocity: the like for the velocity.
        quadrature_degree: degree of all integrals; None means UFL's estimate, exact on cells with
            parallel sides.

    Raises:
        InputError: cells without a material, of an order that does not fit the degree, or folded;
            NaN in data, components that do not exist, a damping law that damps nothing, ratios xi
            that no law reads, dashpots on held facets, groups without facets or cells, of another
            mesh or kind, contradictions.
    """
    if hasattr(mesh, "comm"):
        agree(
            MpiComm(mesh.comm),
            "assemble",
            {
                "material": material,
                "forms": Parts(forms),
                "section": section,
                "clamped": as_tuple(clamped),
                "prescribed": as_tuple(prescribed),
                "tied": as_tuple(tied),
                "dashpots": as_tuple(dashpots),
                "loads": as_tuple(loads),
                "damping": damping,
                "initial_displacement": initial_displacement,
                "initial_velocity": initial_velocity,
                "base_inertia": base_inertia,
                "degree": degree,
                "quadrature_degree": quadrature_degree,
                "integration": integration,
            },
        )
    V, degree = taken_space(mesh, space, as_tuple(bcs), degree)
    optional(whole, "assemble", "quadrature_degree", quadrature_degree)
    section, damping = check_body(
        mesh, material, forms, section, damping, base_inertia, degree, integration
    )
    held, moved, boundaries = as_tuple(clamped), as_tuple(prescribed), as_tuple(dashpots)
    check_boundaries(mesh, held, moved, as_tuple(tied), boundaries, as_tuple(loads))
    check_initial(mesh, displacement=initial_displacement, velocity=initial_velocity)
    V = compat.vector_space(mesh, degree) if V is None else V
    nodes = number_nodes(V)
    check_nodes(MpiComm(mesh.comm), nodes, degree)
    if nodes.curved:
        refuse_folded(mesh)
    given = (*(Prescribed(facets) for facets in held), *moved, *taken(mesh, V, as_tuple(bcs)))
    space = FemSpace(
        V, nodes, given, as_tuple(tied), degree=degree, quadrature_degree=quadrature_degree
    )
    refuse_contradictions(space)
    body = _stated(
        space, material, forms, section, damping, boundaries, selective=integration == "selective"
    )
    algebra = algebra_for(space.comm.mpi, space.dimension, space.unknowns, symmetric=body.symmetric)
    absorbers = [DashpotMatrix(space, body, one) for one in boundaries]
    acting = [one.dashpots.loads(one, body) for one in absorbers]
    load = assemble_loads(space, section, as_tuple(loads))
    rigid = np.column_stack([space.restrict(one) for one in space.translations])
    # one after the other: each is large before it is reduced
    K, pull = _reduced(body.matrix("K"), space, algebra, 0)
    damper = _damper(body, absorbers)
    C, viscous = _reduced(damper, space, algebra, 1) if damper is not None else (None, ())
    # momenta, less M r: what accelerated prescribed nodes pull on the free ones
    mass = body.matrix("M")
    momenta = (
        [space.pull(PetscMatrix(mass) @ one) for one in space.translations] if base_inertia else []
    )
    M, inertial = _reduced(mass, space, algebra, 2)
    load = replace(
        load,
        inertial=inertial,
        viscous=(*viscous, *(one for part in acting for one in part.viscous)),
        general=(*load.general, *pull, *(one for part in acting for one in part.elastic)),
    )
    system = SemiDiscreteSystem(
        algebra=algebra,
        M=M,
        C=C,
        K=K,
        load=load,
        influence=rigid,
        base_mass=np.column_stack([one - M @ r for one, r in zip(momenta, rigid.T, strict=True)])
        if momenta
        else None,
        u0=_initial(space, "initial displacement", initial_displacement),
        v0=_initial(space, "initial velocity", initial_velocity),
        space=space,
        floating=floats(Unheld(algebra, M, K, rigid, space.bodies, space.coordinates)),
        tied=space.tied_unknowns,
        absolute=any(one.lets_waves_in for one in boundaries),
        notes=describe_boundaries(
            boundaries, mesh.comm.rank, body.notes if base_inertia else (*body.notes, LIGHTER)
        ),
        companions=tuple(one for part in (*moved, *acting) for one in part.companions),
    )
    body.own(system)
    del absorbers, damper, mass
    give_back(mesh.comm)
    return system


def _stated(
    space: FemSpace,
    material: Materials | None,
    forms: Forms | None,
    section: Section,
    damping: Damping,
    boundaries: tuple[Dashpots, ...],
    *,
    selective: bool,
) -> ElasticForms:
    """Return the forms of the materials, or the user's own.

    The user's own have those of the materials beside them.
    """
    materials = [] if material is None else cell_materials(space.mesh, material)
    if forms is None:
        body = ElasticForms(space, materials, section, damping, selective=selective)
    else:
        body = OwnForms(space, forms, materials, section, damping)
    body.boundaries = boundaries
    check_ratios(body, forms is None)
    return body


def _damper(forms: ElasticForms, absorbers: Sequence[DashpotMatrix]) -> Any:
    """Return C of materials and absorbing boundaries, before elimination (PETSc).

    It is None where nothing damps.
    """
    terms = ([forms.matrix("C")] if forms.damped else []) + [one.mat for one in absorbers]
    if not terms:
        return None
    return as_petsc(
        PetscAlgebra(forms.space.mesh.comm).combine([(1.0, PetscMatrix(one)) for one in terms])
    ).mat


def _reduced(
    full: Any, space: FemSpace, algebra: PetscAlgebra, derivative: int
) -> tuple[PetscMatrix, tuple[Callable[[float], Array], ...]]:
    """Return (Pᵀ A P as the algebra stores it, the load of prescribed motions).

    The full matrix is destroyed.
    """
    pull: tuple[Callable[[float], Array], ...] = ()
    if any(condition.moves for condition in space.prescribed):  # a part of -Pᵀ(K U + C U' + M U'')
        matrix, held = (
            PetscMatrix(moved(space.held_columns(full), space.comm.mpi)),
            space.held.ravel(),
        )
        pull = (lambda t: -space.pull(matrix @ space.prescribed_values(t, derivative)[held]),)
    part = space.reduced(full)
    full.destroy()
    return algebra.held(moved(part, algebra.comm.mpi)), pull


def assemble_loads(space: FemSpace, section: Section, loads: tuple[Any, ...]) -> Load:
    """Assemble f(t) on the free unknowns.

    It is that of tractions, body forces, linear forms and initial strains.
    """
    constant = np.zeros(len(space.ids))
    separable: list[tuple[Array, Callable[[float], float]]] = []
    general: list[Callable[[float], Array]] = []
    if strained := [one for one in loads if isinstance(one, InitialStrain)]:
        space.forms.initial = InitialStrains(space.forms, strained)
    for load in loads:
        at = _integrated(space, section, load)
        if load.history is not None:
            separable.append((at(0.0), load.history))
        elif load.is_constant:
            constant += at(0.0)
        else:
            general.append(at)
    return Load(constant, tuple(separable), tuple(general))


def _integrated(space: FemSpace, section: Section, load: AnyLoad) -> Callable[[float], Array]:
    """Return t -> Pᵀ ∫ interpolated value · v, as one product with a matrix assembled here.

    Of a form it is its own.
    """
    if isinstance(load, InitialStrain):
        return lambda t: space.forms.initial.forces(t, only=load)
    if isinstance(load, LinearForm):
        full = load.full(space, section.thickness)
        return lambda t: space.pull(full(t))
    g, v = ufl.TrialFunction(space.V), ufl.TestFunction(space.V)
    form = ufl.inner(load.acting(g, space.mesh), v) * load.measure(space.mesh)
    matrix = PetscMatrix(compat.assemble_matrix(space.compiled(form)))

    def at(t: float) -> Array:
        values = evaluate(type(load).__name__, load.value, space.points, t, space.comm)
        return space.pull(section.thickness * (matrix @ values.ravel()))

    return at


def _initial(space: FemSpace, name: str, value: Initial) -> Array:
    """Return initial values on the free unknowns."""
    if value is None:
        return np.zeros(len(space.ids))
    if isinstance(value, Sequence) and value and isinstance(value[0], tuple):
        pairs: Any = value
        values = np.zeros((len(space.nodes), space.dimension))
        for cells, one in pairs:
            blocks = np.unique(compat.cell_blocks(space.V)[cells.indices])
            shared = np.concatenate(
                from_each(space.comm, space.node_of_block[blocks[blocks >= len(values)]])
            )
            touched = np.isin(space.nodes, shared)  # by cells of other ranks
            touched[blocks[blocks < len(values)]] = True
            values[touched] = _nodal(space, name, one)[touched]
        return space.restrict(values)
    return space.restrict(_nodal(space, name, value))


def _nodal(space: FemSpace, name: str, value: Any) -> Array:
    field: Any = (lambda points, t: value(points)) if callable(value) else value
    return evaluate(name, field, space.points, 0.0, space.comm)
