"""Add the second-order effect of a static load.

It is the geometric stiffness of its stresses (P-Delta, gravity's moment).

In first-order statics a block that has tilted about its corner by theta still has its weight at the
lever arm b. The arm b - h theta of the tilted block, hence uplift that ends in overturning, needs
the work of the initial stresses sigma0 on the second-order part of the strains,

    E_ij = ½ (u_i,j + u_j,i + u_k,i u_k,j)   ->   ½ uᵀ K_G u = ½ ∫ sigma0_ij u_k,i u_k,j dx

(Bathe, Finite Element Procedures, sect. 6.3; Zienkiewicz and Taylor, The Finite Element Method 2,
initial stress matrix). For a rotation u = theta x (.) in the plane that is ½ theta² ∫ tr sigma0,
and by the virial theorem, exact for the finite element solution because x itself is a displacement
of the space, ∫ tr sigma0 = Σ f·x - Σ r·x: for a block on level ground minus m g times the height
h_c of its centre of mass, so that the energy changes by -½ m g h_c theta².
"""

from dataclasses import replace
from typing import Any

import ufl

from vi_contact.core.algebra import Array
from vi_contact.core.problem import ContactProblem
from vi_contact.core.state_checks import check_problem_given, check_sizes
from vi_contact.core.step import State
from vi_contact.core.system import Load, SemiDiscreteSystem
from vi_contact.fem import compat
from vi_contact.fem.body.space import FemSpace, space_of, warn_of_other_matrices
from vi_contact.fem.matrices.petsc_algebra import PetscMatrix


def geometric_stiffness(problem: ContactProblem, state: State) -> SemiDiscreteSystem:
    """Linearise the problem's system about a static state.

    There is K + K_G instead of K, f + K_G u0 instead of f.

    The state stays an equilibrium with the same reactions, and motions about it feel the geometric
    stiffness of its stresses: (K + K_G) u = f + K_G u0 - B_nᵀ r_n - B_tᵀ r_t. Use it as
    ``dataclasses.replace(problem, system=...)`` and start from the same state. Damping keeps the K
    it was made of. sigma0 is that of the state for good: when contact moves to a corner the
    stresses change, their mean does not (reactions at y = 0 add nothing to Σ r·x).

    Args:
        problem: its system made by ``fem.assemble``.
        state: of ``static_equilibrium``; u in the problem's basis, as all states.

    Raises:
        InputError: a system that fem.assemble did not make.
    """
    check_problem_given("geometric_stiffness", problem)
    system = problem.system
    space = space_of("geometric_stiffness", problem.system)
    check_sizes("geometric_stiffness", problem, state)
    warn_of_other_matrices("geometric_stiffness", system, "K")
    u0 = problem.cartesian(state.u)
    full = initial_stress_matrix(space, space.expand(u0, state.t), state.t)
    reduced = PetscMatrix(space.reduce(full))
    load = replace(system.load, constant=system.load.constant + reduced @ u0)
    if any(condition.moves for condition in space.prescribed):
        load = _with_prescribed(space, PetscMatrix(full), load, state.t)
    K = system.algebra.combine([(1.0, system.K), (1.0, reduced)])
    stiffer = system.changed(K=K, load=load)
    if not space.forms.foreign(system, "K"):
        space.forms.own(stiffer)
    return stiffer


def initial_stress_matrix(space: FemSpace, nodal: Array, t: float = 0.0) -> Any:
    """Assemble K_G [N/m] of the stresses of nodal displacements at a time.

    It is of PETSc, for all unknowns; displacements are (owned nodes, d) [m].

    Of a rotation the integrand is tr sigma0, a polynomial once multiplied by the Jacobian: exact on
    all cells.
    """
    forms = space.forms
    u0 = compat.function(space.V)
    u0.x.array[: nodal.size] = nodal.ravel()
    u0.x.scatter_forward()
    u, v = ufl.TrialFunction(space.V), ufl.TestFunction(space.V)
    sigma = forms.stress(u0)
    forms.follow(u0, t)  # with the initial strains of this time
    form = ufl.inner(ufl.dot(ufl.grad(u), sigma), ufl.grad(v)) * ufl.dx
    return compat.assemble_matrix(space.compile_form(form))


def _with_prescribed(space: FemSpace, full: PetscMatrix, load: Load, t0: float) -> Load:
    """Return the load and the pull of prescribed displacements on the new part.

    It is -Pᵀ K_G (U(t) - U(t0)).
    """
    start = space.evaluate_prescribed(t0)

    def pull(t: float) -> Array:
        return -space.pull(full @ (space.evaluate_prescribed(t) - start))

    return replace(load, general=(*load.general, pull))
