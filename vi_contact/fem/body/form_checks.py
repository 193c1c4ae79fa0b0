"""Check the forms that a user gives for a body.

They must be functions that return bilinear forms of its mesh, with finite matrices and a positive
mass.
"""

from collections.abc import Callable
from inspect import signature
from typing import Any

import numpy as np
import ufl
from petsc4py import PETSc
from ufl.algorithms import compute_form_data
from ufl.algorithms.check_arities import ArityMismatch

from ...core.algebra import largest
from ...core.checks import function, instance, on_all
from ...core.errors import InputError
from ...core.matrix_checks import SYMMETRIC, measure_asymmetry, probe
from .. import compat
from ..matrices.petsc_algebra import PetscMatrix
from .space import FemSpace

PROBES = 4  # motions without a meaning whose kinetic energy is tried


def refuse_complex(owner: str) -> None:
    """Raise InputError where PETSc computes with complex numbers.

    Inequalities have no meaning there.
    """
    if np.issubdtype(PETSc.ScalarType, np.complexfloating):
        raise InputError(
            f"{owner}: this PETSc computes with complex numbers, of which none is less than "
            "another; use DOLFINx with a PETSc of real numbers (Debian: python3-dolfinx-real; "
            "PyPI: dolfinx-solver-real)"
        )


def takes(name: str, call: Any, *arguments: str) -> None:
    """Raise InputError unless this is a function of so many arguments."""
    remedy = f"give a function of {' and '.join(arguments)}"
    function("Forms", name, call, remedy)
    try:
        signature(call).bind(*arguments)
    except TypeError as error:
        raise InputError(
            f"Forms: {name} cannot be called with ({', '.join(arguments)}), {error}; {remedy}"
        ) from None
    except ValueError:  # of a function in C: it tells when it is called
        return


def form_of(owner: str, call: Callable[..., Any], space: FemSpace, *arguments: Any) -> Any:
    """Return call(*arguments), a form linear in all of them on the mesh of the space. Collective.

    Args:
        owner: who asks, the beginning of messages.
        call: the user's function that makes the form.
        space: that of the displacement.
        *arguments: what the form is linear in.

    Raises:
        InputError: on all ranks otherwise; it begins with ``owner``.
    """
    form = on_all(space.comm, owner, lambda: call(*arguments))
    instance(
        owner,
        "what it returns",
        form,
        ufl.Form,
        "return an integral, such as ufl.inner(…, …) * ufl.dx",
    )
    if set(on_all(space.comm, owner, form.arguments)) != set(arguments):
        raise InputError(
            f"{owner} is not a form in the given trial and test functions; return one that is not "
            "zero and is linear in each of them"
        )
    on_all(space.comm, owner, lambda: refuse_not_linear(owner, form))
    own = space.mesh.ufl_domain().ufl_id()
    spaces = [getattr(part, "function_space", space.V) for part in form.coefficients()]
    elsewhere = any(domain.ufl_id() != own for domain in form.ufl_domains())
    if elsewhere or any(V.mesh is not space.mesh for V in spaces):
        raise InputError(
            f"{owner} is of another mesh; give measures and Functions of the mesh of the body"
        )
    if any(integral.integral_type() == "interior_facet" for integral in form.integrals()):
        # with ghosts of nodes alone no rank knows both cells of a facet between ranks
        maps = space.V.dofmap.index_map, space.mesh.topology.index_map(space.mesh.topology.dim)
        nodes, cells = space.comm.sum(np.array([local.num_ghosts for local in maps]))
        if nodes and not cells:
            raise InputError(
                f"{owner} integrates over interior facets (dS), which on several ranks needs a "
                "mesh with ghost_mode=shared_facet"
            )
    return form


def refuse_not_linear(owner: str, form: Any) -> None:
    """Raise InputError unless UFL finds a form linear in its arguments.

    It is asked here, on every rank: the compiler asks on one, and the others would wait for it.

    Args:
        owner: who asks, the beginning of messages.
        form: the form.
    """
    try:
        compute_form_data(form)
    except (ArityMismatch, TypeError, ValueError):
        # the first is no Exception; others where UFL words it and fails
        raise InputError(
            f"{owner} is not linear in u or in v; return a sum of products of one and the other"
        ) from None


def matrix_of(name: str, space: FemSpace, compiled: Callable[[], Any]) -> Any:
    """Return the assembled matrix of a form, finite. Collective.

    Args:
        name: what messages call the form.
        space: that of the displacement.
        compiled: a function that returns the form compiled.
    """
    matrix = compat.assemble_matrix(on_all(space.comm, f"Forms: {name}", compiled))
    if not np.isfinite(matrix.norm(PETSc.NormType.FROBENIUS)):
        raise InputError(
            f"Forms: {name} has NaN or infinite entries; check its Functions and Constants"
        )
    return matrix


def is_symmetric(matrix: Any, space: FemSpace) -> bool:
    """Return whether a full matrix is symmetric to round-off. Collective."""
    return measure_asymmetry(PetscMatrix(matrix), space.comm, _numbers(space)) <= SYMMETRIC


def refuse_masses(matrix: Any, space: FemSpace) -> None:
    """Raise InputError unless a full mass matrix is symmetric and positive. Collective.

    Its diagonal tells, and the kinetic energies of translations and of ``PROBES`` other motions:
    necessary conditions, for eigenvalues would cost more than the run.
    """
    M = PetscMatrix(matrix)
    if not is_symmetric(matrix, space):
        raise InputError(
            "Forms: mass is not symmetric; give a form in which u and v may be exchanged"
        )
    least = -largest(space.comm, -np.min(M.diagonal(), initial=np.inf))
    motions = [*space.translations, *(probe(_numbers(space), j) for j in range(PROBES))]
    energies = [space.comm.sum(np.array([w @ (M @ w)]))[0] for w in motions]
    if not (least > 0.0 and min(energies) > 0.0):
        raise InputError(
            "Forms: mass is not positive: some motion would have a kinetic energy of zero or less; "
            "give a density above zero everywhere"
        )


def _numbers(space: FemSpace) -> Any:
    """Return the numbers of all owned components on any ranks, prescribed ones too."""
    return (space.nodes[:, None] * space.dimension + np.arange(space.dimension)).ravel()


def refuse_stress(call: Callable[[Any], Any], space: FemSpace) -> None:
    """Raise InputError unless call(u) is a tensor of UFL, (d, d) or in the plane (3, 3).

    Collective.

    Args:
        call: the user's function.
        space: that of the displacement.
    """
    d = space.dimension
    u = compat.function(space.V)
    stress = on_all(space.comm, "Forms: stress", lambda: call(u))
    shape = getattr(stress, "ufl_shape", None)
    if shape != (d, d) and not (d == 2 and shape == (3, 3)):
        more = " or, with sigma_zz, (3, 3)" if d == 2 else ""
        raise InputError(
            f"Forms: stress has shape {shape}; return a tensor of shape {(d, d)}{more}"
        )
