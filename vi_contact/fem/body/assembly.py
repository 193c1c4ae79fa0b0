"""Assemble the semi-discrete system M u'' + C u' + K u = f(t) of a linear elastic body.

    sigma = lambda_eff tr(eps) I + 2 mu eps,   M = ∫ rho u·v
    K = ∫ sigma(u):eps(v),   C = alpha M + beta K

integrated over the mesh times the section's thickness (boundary method, eqs. 7-10a). Prescribed
displacements are eliminated: u = P u_free + U(t), so M, C, K are Pᵀ(·)P and the load gets -Pᵀ(K U +
C U' + M U'').

The order of work: what is given is checked (``assembly_checks``, ``conditions``, ``dirichlet``);
unknowns are numbered (``FemSpace``); forms, dashpots and loads are stated and assembled
(``forms``, ``own_forms``, ``dashpots``, ``loads``); held and tied components are eliminated
(``elimination``).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from typing import Annotated, Any

import numpy as np
import ufl
from dolfinx.mesh import Mesh

from ...core.algebra import Array, Mask, Matrix, from_each, largest
from ...core.checks import instance
from ...core.collective import Parts, agree
from ...core.errors import InputError
from ...core.quantities import Unit
from ...core.system import Load, SemiDiscreteSystem
from ...core.timing import report_time
from ...laws.free_motions import Unheld, floats
from ...laws.geostatic import Geostatic
from ...laws.materials import Damping, Section
from ...laws.yielding import YieldingMaterial
from .. import compat
from ..matrices.half import algebra_for
from ..matrices.petsc_algebra import PetscAlgebra, PetscMatrix, as_petsc
from ..matrices.petsc_rows import transfer
from ..mesh.communicators import MpiComm, give_back
from ..mesh.numbering import number_nodes
from ..mesh.tagged_mesh import Cells, Facets
from .absent import find_absent, hold_absent, let_remember, refuse_inner
from .assembly_checks import (
    check_body,
    check_initial,
    check_nodes,
    check_ratios,
    has_no_mass,
    refuse_folded,
    refuse_in_yielding,
    refuse_without_mass,
)
from .conditions import Conditions, as_tuple, gather_conditions
from .dashpots import DashpotMatrix, Dashpots, describe_boundaries
from .dirichlet import choose_space, read_values, refuse_contradictions, refuse_uneven
from .elimination import Elimination
from .forms import ElasticForms, Materials, cell_materials
from .hyperelastic import TURNING
from .initial_strains import InitialStrain, InitialStrains
from .linear_forms import AnyLoad, LinearForm, Loads
from .loads import BodyForce, Prescribed, Traction, evaluate
from .own_forms import Forms, OwnForms
from .reservoir import Reservoir, add_water, list_pressures
from .space import FemSpace, translations
from .ties import Tied
from .turning_forms import TurningForms, refuse_beside_turning
from .yielding_forms import YieldingForms

Field = tuple[float, ...] | Callable[[Array], Array]
Initial = Field | Sequence[tuple[Cells, Field]] | None

# what the notes of a system say of base_inertia=False
LIGHTER = (
    "inertia load of the ground motion: the convention of the catalogue's reference numbers, which "
    "leave out the mass that elements share with the base"
)


@report_time("assembling")
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
    reservoir: Reservoir | None = None,
    damping: Damping | None = None,
    initial_displacement: Annotated[Initial, Unit("m")] = None,
    initial_velocity: Annotated[Initial, Unit("m/s")] = None,
    base_inertia: bool = True,
    degree: int = 1,
    quadrature_degree: int | None = None,
    integration: str = "full",
    initial_stress: Annotated[Geostatic | Callable[[Array], Array] | None, Unit("Pa")] = None,
    absent: Cells | Sequence[Cells] | None = None,
    space: Any = None,
    bcs: Any = (),
) -> SemiDiscreteSystem:
    """Assemble the system of a body, on the free unknowns.

    Args:
        mesh: DOLFINx mesh (``read_mesh``) with cells of first order or, with degree 2, of second
            order too.
        degree: degree of the displacement in each cell: 1 for P1 or Q1, 2 for P2 or Q2
            (docs/guide/second_order.md).
        material: LinearElastic, Orthotropic or fem.Heterogeneous, a material that yields
            (``laws.J2``, DruckerPrager, MohrCoulomb, Iwan: docs/guide/yielding.md), or (cells,
            material) pairs that cover the mesh. A body that turns is of SaintVenantKirchhoff,
            NeoHookean or fem.Hyperelastic alone (docs/guide/turning.md).
        forms: the user's own weak forms, ``fem.Forms``; a material beside them gives the density
            where they have no mass, and the wave speeds that dashpots and free fields need. Without
            a mass at all the system is for static stages alone.
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
        reservoir: water before a face, ``Reservoir``: its pressure is a load and its mass is in M.
        base_inertia: whether the inertia load of a ground motion counts the mass that elements
            share with prescribed nodes. True is right for motions relative to the ground; False is
            the load of docs/start/first_wall.md.
        integration: "full", or "selective" for nearly incompressible bodies of quadrilaterals or
            hexahedra, where each cell has one mean value of tr eps (``dilatation``). "bbar" is
            the like for materials that yield.
        initial_stress: of a body that yields, at the displacement zero: ``laws.Geostatic``, or
            a function, points (k, d) [m] ->
            components (k, 4) xx, yy, zz, xy or (k, 6) xx, yy, zz, xy, yz, xz [Pa], tension
            positive. Loads should hold it in equilibrium.
        absent: cells of bodies that are not there, which a later stage adds or an earlier one has
            removed (``fem.place``, docs/guide/lifts.md). Nodes of these alone are held. () of
            bodies that are all there, in a run whose stages add and remove some: stresses of
            linear materials are remembered then too.
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
    instance(
        "assemble", "mesh", mesh, Mesh, "give a DOLFINx mesh, such as fem.read_mesh(path, comm)[0]"
    )
    comm = MpiComm(mesh.comm)
    agree(
        comm,
        "assemble",
        {
            "material": material,
            "forms": Parts(forms),
            "section": section,
            "clamped": clamped,
            "prescribed": prescribed,
            "tied": tied,
            "dashpots": dashpots,
            "loads": loads,
            "reservoir": reservoir,
            "damping": damping,
            "initial_displacement": initial_displacement,
            "initial_velocity": initial_velocity,
            "base_inertia": base_inertia,
            "degree": degree,
            "quadrature_degree": quadrature_degree,
            "integration": integration,
            "initial_stress": initial_stress,
            "absent": absent,
        },
    )
    missing = None if absent is None else find_absent(mesh, absent)
    material = material if missing is None else let_remember(material, forms)

    # what is given: kinds, groups, conditions that go together
    bcs = as_tuple(bcs)
    refuse_uneven(comm, bcs)
    pressures = list_pressures(reservoir)
    refuse_inner(mesh, (*as_tuple(loads), *pressures))
    if bcs or space is not None:
        space, degree = choose_space(mesh, space, bcs)
    section, damping = check_body(
        mesh,
        material,
        forms,
        section,
        damping,
        base_inertia=base_inertia,
        degree=degree,
        quadrature_degree=quadrature_degree,
        integration=integration,
        initial_stress=initial_stress,
    )
    check_initial(mesh, displacement=initial_displacement, velocity=initial_velocity)
    conditions = gather_conditions(
        mesh,
        clamped=clamped,
        prescribed=prescribed,
        tied=tied,
        dashpots=dashpots,
        loads=(*as_tuple(loads), *pressures),
    )

    space = _number_unknowns(
        mesh,
        space,
        bcs,
        conditions,
        missing,
        degree=degree,
        quadrature_degree=quadrature_degree,
    )
    if reservoir is not None:
        add_water(reservoir, space, section.thickness)
    rigid = np.column_stack([space.restrict(motion) for motion in space.translations])

    # the body: weak forms of its materials or of the user, absorbing boundaries, loads
    materials = [] if material is None else cell_materials(mesh, material)
    if any(isinstance(given, YieldingMaterial) for _, given in materials):
        refuse_in_yielding(forms, conditions.loads)
    if any(isinstance(given, TURNING) for _, given in materials):
        refuse_beside_turning(conditions.dashpots, conditions.loads)
    refuse_without_mass([given for _, given in materials], forms, conditions.dashpots)
    make_body = _choose_forms(forms, materials, integration=integration, stress=initial_stress)
    body = make_body(space, materials=materials, section=section, damping=damping)
    body.boundaries = conditions.dashpots
    check_ratios(
        damping,
        [given for _, given in materials],
        conditions.dashpots,
        ratio=body.largest_ratio,
        damps=body.law_damps,
    )
    algebra = algebra_for(space.comm.mpi, space.dimension, space.unknowns, symmetric=body.symmetric)
    absorbers = [DashpotMatrix(space, body, boundary) for boundary in conditions.dashpots]
    acting: list[Any] = [absorber.dashpots.loads(absorber, body) for absorber in absorbers]
    # refused before matrices are assembled
    companions = _gather_companions(body, conditions.prescribed, acting)
    load = assemble_loads(space, section, conditions.loads)
    u0 = _evaluate_initial(space, "initial displacement", initial_displacement)
    v0 = _evaluate_initial(space, "initial velocity", initial_velocity)

    # the equations of the free unknowns, with the loads of prescribed motions and of boundaries
    reduced = _reduce(
        body,
        absorbers,
        algebra,
        base_inertia=base_inertia,
        water=_weigh_water(space, reservoir, section.thickness),
    )
    M = reduced.M
    massless = _find_massless(comm, materials, M, rigid)
    base_mass = None
    if reduced.momenta is not None:
        base_mass = reduced.momenta - np.column_stack([M @ r for r in rigid.T])
    notes = body.notes if base_inertia else (*body.notes, LIGHTER)
    system = SemiDiscreteSystem(
        algebra=algebra,
        M=M,
        C=reduced.C,
        K=reduced.K,
        load=_add_boundary_loads(load, reduced, acting),
        influence=rigid,
        base_mass=base_mass,
        u0=u0,
        v0=v0,
        space=space,
        floating=floats(Unheld(algebra, M, reduced.K, rigid, space.bodies, space.coordinates)),
        tied=space.tied_unknowns,
        massless=massless,
        has_massless_bodies=massless is not None,
        absolute=any(boundary.lets_waves_in for boundary in conditions.dashpots),
        notes=describe_boundaries(conditions.dashpots, comm.rank, notes),
        companions=companions,
        statics_only=body.statics_only,
        internal=body.internal,
    )
    body.own(system)

    # matrices of all components are large: they go before anything else is made
    del absorbers, reduced
    give_back(mesh.comm)
    return system


def _find_massless(comm: Any, materials: Any, M: Matrix, rigid: Array) -> Mask | None:
    """Return which unknowns (n,) have no mass, None without materials of density 0. Collective.

    Args:
        comm: the ranks.
        materials: (cells, material) pairs.
        M: the mass of the free unknowns.
        rigid: (n, d) their translations: unknowns of water have none, and are left out.
    """
    if not any(has_no_mass(given) for _, given in materials):
        return None
    massless = np.asarray((M.diagonal() == 0.0) & rigid.any(axis=1))
    return massless if largest(comm, massless.any()) else None


def _number_unknowns(
    mesh: Any,
    space: Any,
    bcs: tuple[Any, ...],
    conditions: Conditions,
    missing: Mask | None,
    *,
    degree: int,
    quadrature_degree: int | None,
) -> FemSpace:
    """Make the numbered unknowns: held and tied components of nodes are eliminated.

    Args:
        mesh: DOLFINx mesh.
        space: the user's own DOLFINx space, or None.
        bcs: the user's own ``dirichletbc`` objects.
        conditions: what holds, ties and loads the body.
        missing: which local cells are absent, or None where all are there for good.
        degree: of the displacement in each cell.
        quadrature_degree: of all integrals, or None.

    Raises:
        InputError: nodes without a cell, folded cells, values that contradict one another.
    """
    V = compat.vector_space(mesh, degree) if space is None else space
    comm = MpiComm(mesh.comm)
    nodes = number_nodes(V)
    check_nodes(comm, nodes, degree)
    if nodes.curved:
        refuse_folded(mesh)

    # what conditions hold of the owned blocks of the displacement's space
    supports = [
        held.support(compat.locate_owned_blocks(V, held.facets.indices), mesh.geometry.dim)
        for held in conditions.held
    ]
    if bcs:
        supports += [values.support(nodes.owned) for values in read_values(mesh, V, bcs)]
    supports += [] if missing is None else hold_absent(comm, V, nodes, missing)

    numbered = FemSpace(
        V,
        nodes,
        supports,
        conditions.tied,
        degree=degree,
        quadrature_degree=quadrature_degree,
        absent=missing,
    )
    if bcs:
        refuse_contradictions(numbered)
    return numbered


def _add_boundary_loads(load: Load, reduced: "_Reduced", acting: list[Any]) -> Load:
    """Return the load with what prescribed motions and absorbing boundaries add to it.

    Args:
        load: of tractions, body forces and the like.
        reduced: equations of the free unknowns, whose prescribed motions act as loads.
        acting: loads of absorbing boundaries.
    """
    viscous = chain.from_iterable(boundary.viscous for boundary in acting)
    elastic = chain.from_iterable(boundary.elastic for boundary in acting)
    return replace(
        load,
        inertial=reduced.inertial,
        viscous=(*reduced.viscous, *viscous),
        general=(*load.general, *reduced.elastic, *elastic),
    )


def _choose_forms(
    forms: Forms | None,
    materials: list[tuple[Any, Any]],
    *,
    integration: str,
    stress: Callable[[Array], Array] | None,
) -> Callable[..., ElasticForms]:
    """Return what makes the forms of a body: the user's own, or those of its materials.

    Args:
        forms: the user's own, or None.
        materials: pairs of local cells and a material.
        integration: "full", "selective" or "bbar".
        stress: that of a yielding body at the start, or None.
    """
    if forms is not None:
        return partial(OwnForms, given=forms)
    given = [material for _, material in materials]
    if any(isinstance(material, TURNING) for material in given):
        return TurningForms
    if any(isinstance(material, YieldingMaterial) for material in given):
        return partial(YieldingForms, integration=integration, initial_stress=stress)
    return partial(ElasticForms, selective=integration == "selective")


def _gather_companions(
    body: ElasticForms, prescribed: Sequence[Prescribed], acting: Sequence[Any]
) -> tuple[Any, ...]:
    """Return the motions that are marched beside the run.

    Args:
        body: its forms.
        prescribed: motions of supports.
        acting: loads of absorbing boundaries.

    Raises:
        InputError: there are such motions, or compressible water, beside a body that is not linear.
    """
    if body.space.water is not None and body.internal is not None:
        raise InputError(
            f"Reservoir: model 'acoustic' is before linear bodies, and {body.nonlinear} is not "
            "linear: give 'incompressible' or 'added mass'"
        )
    companions = [companion for part in (*prescribed, *acting) for companion in part.companions]
    if companions and body.internal is not None and not body.takes_companions:
        raise InputError(
            f"{body.nonlinear} does not go with motions that are marched beside the run, such as "
            "a free field, as these are linear: take fem.Dashpots there"
        )
    return tuple(companions)


@dataclass(frozen=True, eq=False)
class _Reduced:
    """Hold the matrices of the free unknowns, and what held ones pull on them.

    Attributes:
        M: mass.
        C: damping, None where nothing damps.
        K: stiffness.
        elastic: loads t [s] -> (n,) [N] of prescribed motions U, -Pᵀ K U.
        viscous: the like, -Pᵀ C U'.
        inertial: the like, -Pᵀ M U''.
        momenta: (n, d) Pᵀ M of the unit translations of all nodes, None where nobody asks.
    """

    M: PetscMatrix
    C: PetscMatrix | None
    K: PetscMatrix
    elastic: tuple[Callable[[float], Array], ...]
    viscous: tuple[Callable[[float], Array], ...]
    inertial: tuple[Callable[[float], Array], ...]
    momenta: Array | None


def _reduce(
    body: ElasticForms,
    absorbers: Sequence[DashpotMatrix],
    algebra: PetscAlgebra,
    *,
    base_inertia: bool,
    water: Any = None,
) -> _Reduced:
    """Assemble K, C and M of all components, and eliminate those that are held or tied. Collective.

    Args:
        body: its forms.
        absorbers: matrices of its absorbing boundaries.
        algebra: how the matrices are stored.
        base_inertia: whether ``momenta`` are asked for.
        water: mass of a reservoir (PETSc), which neither weighs nor rises with the ground.
    """
    space = body.space
    elimination = space.elimination
    directions = translations(len(space.nodes), space.dimension)
    motions = [
        partial(space.evaluate_prescribed, derivative=k) if space.moves else None for k in range(3)
    ]
    # one after the other: each is large before it is reduced
    K, elastic = _eliminate(body.matrix("K"), elimination, algebra, motions[0])
    C: PetscMatrix | None = None
    viscous: tuple[Callable[[float], Array], ...] = ()
    if body.damped or absorbers:
        C, viscous = _eliminate(
            _assemble_damping(body, absorbers), elimination, algebra, motions[1]
        )
    mass = body.matrix("M")
    # momenta, less M r: what accelerated prescribed nodes pull on the free ones
    momenta = None
    if base_inertia:
        momenta = np.column_stack([elimination.pull(PetscMatrix(mass) @ r) for r in directions])
    if water is not None:
        mass = _add_water(mass, water, momenta, elimination, directions)
    M, inertial = _eliminate(mass, elimination, algebra, motions[2])
    if space.water is not None:
        M, C, K = (
            space.water.join(name, part, algebra) for name, part in (("M", M), ("C", C), ("K", K))
        )
        if momenta is not None:
            space.water.add_momenta(momenta)
        if space.moves:
            inertial = (*inertial, space.water.make_load())
    return _Reduced(M, C, K, elastic, viscous, inertial, momenta)


def _weigh_water(space: FemSpace, reservoir: Reservoir | None, thickness: float) -> Any:
    """Return the mass of the water on the components of the face (PETSc), or None. Collective."""
    if reservoir is None:
        return None
    if space.water is not None:
        return space.water.mass_of_face()
    return reservoir.assemble_mass(space, thickness)


def _add_water(
    mass: Any,
    water: Any,
    momenta: Array | None,
    elimination: Elimination,
    directions: Sequence[Array],
) -> Any:
    """Return M + M_w (PETSc), and add the horizontal momenta of the water. Collective.

    Args:
        mass: M of the body; it is destroyed.
        water: M_w; it is destroyed.
        momenta: (n, d) of the body, changed; None where nobody asks.
        elimination: takes forces to the free unknowns.
        directions: unit translations of all components.
    """
    if momenta is not None:
        for column, r in enumerate(directions[:-1]):  # the last axis points up
            momenta[:, column] += elimination.pull(PetscMatrix(water) @ r)
    algebra = PetscAlgebra(mass.comm)
    whole = as_petsc(algebra.combine([(1.0, PetscMatrix(mass)), (1.0, PetscMatrix(water))])).mat
    mass.destroy()
    water.destroy()
    return whole


def _assemble_damping(body: ElasticForms, absorbers: Sequence[DashpotMatrix]) -> Any:
    """Return C of materials and absorbing boundaries, before elimination (PETSc)."""
    terms = [body.matrix("C")] if body.damped else []
    terms += [absorber.mat for absorber in absorbers]
    algebra = PetscAlgebra(body.space.mesh.comm)
    return as_petsc(algebra.combine([(1.0, PetscMatrix(term)) for term in terms])).mat


def _eliminate(
    full: Any,
    elimination: Elimination,
    algebra: PetscAlgebra,
    motion: Callable[[float], Array] | None,
) -> tuple[PetscMatrix, tuple[Callable[[float], Array], ...]]:
    """Return a matrix without held and tied components, and the load of prescribed motions.

    Of A = K, C, M and the derivative k = 0, 1, 2 of U it is PᵀAP and -PᵀA U^(k)(t).

    Args:
        full: A, a PETSc matrix of all components; it is destroyed.
        elimination: P.
        algebra: how the matrix is stored.
        motion: t -> U^(k)(t) (full,), None where nothing that is held moves.
    """
    loads: tuple[Callable[[float], Array], ...] = ()
    # the columns of held components are kept for the load, before the full matrix goes
    if motion is not None:
        matrix = PetscMatrix(transfer(elimination.take_held_columns(full), algebra.comm.mpi))
        loads = (lambda t: -elimination.pull(matrix @ motion(t)[elimination.held]),)
    part = elimination.reduce(full)
    full.destroy()
    return algebra.store(transfer(part, algebra.comm.mpi)), loads


def assemble_loads(space: FemSpace, section: Section, loads: tuple[Any, ...]) -> Load:
    """Assemble f(t) on the free unknowns. Collective.

    Args:
        space: the body's unknowns, whose forms tell the stress of initial strains.
        section: its thickness.
        loads: tractions, body forces, linear forms and initial strains.
    """
    constant = np.zeros(len(space.ids))
    separable: list[tuple[Array, Callable[[float], float]]] = []
    general: list[Callable[[float], Array]] = []
    strains = [load for load in loads if isinstance(load, InitialStrain)]
    if strains:
        space.forms.initial = InitialStrains(space.forms, strains)
    # what changes with time by a factor alone is assembled once, what is constant is added up
    for load in loads:
        force = _make_force(space, section, load)
        if load.history is not None:
            separable.append((force(0.0), load.history))
        elif load.is_constant:
            constant += force(0.0)
        else:
            general.append(force)
    return Load(constant, tuple(separable), tuple(general))


def _make_force(space: FemSpace, section: Section, load: AnyLoad) -> Callable[[float], Array]:
    """Return t [s] -> (n,) [N], the load on the free unknowns, less its history. Collective.

    Args:
        space: the body's unknowns.
        section: its thickness.
        load: what acts.
    """
    if isinstance(load, InitialStrain):
        return lambda t: space.forms.initial.forces(t, only=load)
    full = make_nodal_force(space, section, load)
    return lambda t: space.pull(full(t))


def make_nodal_force(
    space: FemSpace, section: Section, load: Traction | BodyForce | LinearForm
) -> Callable[[float], Array]:
    """Return t [s] -> (owned full,) [N], the load on all nodes, less its history. Collective.

    Of tractions and body forces it is ∫ interpolated value · v, one product with a matrix that is
    assembled here; linear forms assemble vectors of their own.

    Args:
        space: the body's unknowns.
        section: its thickness.
        load: what acts.
    """
    if isinstance(load, LinearForm):
        return load.full(space, section.thickness)
    # ∫ g·v of nodal values g of the load: at each time only these are evaluated anew
    g = ufl.TrialFunction(space.V)
    v = ufl.TestFunction(space.V)
    form = ufl.inner(load.acting(g, space.mesh), v) * load.measure(space.mesh)
    matrix = PetscMatrix(compat.assemble_matrix(space.compile_form(form)))
    name = type(load).__name__

    def force(t: float) -> Array:
        values = evaluate(name, load.value, space.points, t, space.comm)
        return np.asarray(section.thickness * (matrix @ values.ravel()))

    return force


def _evaluate_initial(space: FemSpace, name: str, value: Initial) -> Array:
    """Return initial values on the free unknowns (n,). Collective.

    Args:
        space: the body's unknowns.
        name: what messages call the values.
        value: a constant, a function of points, or (cells, value) pairs.
    """
    if value is None:
        return np.zeros(len(space.ids))
    if not (isinstance(value, Sequence) and value and isinstance(value[0], tuple)):
        return space.restrict(_evaluate_nodal(space, name, value))
    pairs: Any = value
    values = np.zeros((len(space.nodes), space.dimension))
    for cells, field in pairs:
        # nodes of the cells: of this rank's, and owned ones of cells that other ranks have
        blocks = np.unique(compat.cell_blocks(space.V)[cells.indices])
        ghosts = space.node_of_block[blocks[blocks >= len(values)]]
        touched = np.isin(space.nodes, np.concatenate(from_each(space.comm, ghosts)))
        touched[blocks[blocks < len(values)]] = True
        values[touched] = _evaluate_nodal(space, name, field)[touched]
    return space.restrict(values)


def _evaluate_nodal(space: FemSpace, name: str, value: Any) -> Array:
    """Return the values (k, d) of a constant or a function of points at the owned nodes.

    Args:
        space: the body's unknowns.
        name: what messages call the values.
        value: (d,) numbers, or a function of points (k, d) [m].
    """
    field: Any = (lambda points, t: value(points)) if callable(value) else value
    return evaluate(name, field, space.points, 0.0, space.comm)
