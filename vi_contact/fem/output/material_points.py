"""Tell the stresses of a body that yields, and how much it yields, from what its points remember.

    stress                sigma [Pa]
    equivalent_stress     √(3/2) |dev sigma| [Pa]
    plastic_strain        √(2/3) |eps_p|, eps_p = eps - C⁻¹ (sigma - sigma_start): what would stay
    mobilised_strength    the share of its strength that a point bears (``YieldingMaterial``)

A displacement alone does not tell them: they are of a state, and of the way to it.
"""

from typing import Any

import numpy as np

from ...core.algebra import Array, Indices
from ...core.checks import quote
from ...core.errors import InputError
from ...core.internal import remembers
from ...core.problem import ContactProblem
from ...core.state_checks import check_problem_given, check_sizes
from ...core.step import State
from ...laws.mandel import to_tensors
from .. import compat
from ..body.space import FemSpace, space_of

SCALARS = ("equivalent_stress", "plastic_strain", "mobilised_strength")
NAMES = ("stress", *SCALARS)


def stand(problem: ContactProblem, state: State) -> Any:
    """Return the internal force of a body that yields, which stands at a state. Collective.

    Args:
        problem: that of the state.
        state: with what its materials remember; one without is of a body that is new.
    """
    internal: Any = problem.system.internal
    return internal.go_on(state.memory, problem.cartesian(state.u))


def refuse_elastic(owner: str, problem: ContactProblem, name: str) -> None:
    """Raise InputError for a body without materials that yield.

    Args:
        owner: who asks.
        problem: what was given.
        name: the quantity.
    """
    if not remembers(problem.system.internal):
        raise InputError(
            f"{owner}: {quote(name)} is of materials that yield, and this body has none: give "
            "fem.assemble a law such as J2 or MohrCoulomb"
        )


def at_points(problem: ContactProblem, state: State, name: str) -> tuple[Array, Array]:
    """Return a quantity of a body that yields at the points of integration. Collective.

    Args:
        problem: the problem of the state.
        state: of simulate, march, static_equilibrium or quasi_static of this problem.
        name: "stress" [Pa], tension positive, "equivalent_stress" [Pa] (von Mises),
            "plastic_strain" √(2/3) |eps_p| of the strain that stays, or "mobilised_strength", from
            0 to 1.

    Returns:
        Places (k, d) [m] of the points of this rank's cells, cell by cell, and values there: (k,),
        of the stress (k, 3, 3).

    Raises:
        InputError: a body that does not yield, a state of another problem, no such quantity.
    """
    check_problem_given("at_points", problem)
    if not isinstance(name, str) or name not in NAMES:
        raise InputError(
            f"at_points: {quote(name)} is not a quantity; give one of {', '.join(map(repr, NAMES))}"
        )
    space_of("at_points", problem.system)
    refuse_elastic("at_points", problem, name)
    check_sizes("at_points", problem, state)
    standing = stand(problem, state)
    values = standing.tell(name)
    points = standing.points
    return points.places.reshape(-1, points.places.shape[2]), (
        to_tensors(values) if name == "stress" else values
    )


def compute_cell_means(standing: Any, name: str) -> Array:
    """Return the means (owned cells, …) of a quantity, by the weights of its points. Collective.

    Args:
        standing: the force of the body, which stands at a state.
        name: the quantity.
    """
    points = standing.points
    values = standing.tell(name)
    table = values.reshape(points.cells, points.each, -1)
    means = np.einsum("cq,cqk->ck", points.weights, table)
    means /= points.weights.sum(axis=1)[:, None]
    return means.reshape(points.cells, *values.shape[1:])


def make_function(problem: ContactProblem, state: State, name: str, continuous: bool) -> Any:
    """Return a quantity as a Function: constant in cells, or continuous of degree 1. Collective.

    The continuous one has the nodal values ∑ w phi_i q / ∑ w phi_i over the points, which keep the
    integral and lie between the values of the points.

    Args:
        problem: the problem of the state.
        state: where it stands.
        name: the quantity.
        continuous: whether the Function is.
    """
    space: FemSpace = space_of("as_function", problem.system)
    standing = stand(problem, state)
    d = space.dimension
    tensor = (d, d) if name == "stress" else ()
    degree = 1 if continuous else 0
    system = problem.system
    V = system.make_once(
        f"points {tensor} {continuous}",
        lambda: compat.lagrange(space.mesh, degree, tensor, continuous=continuous),
    )
    function = compat.function(V)
    owned = standing.points.cells
    blocks = compat.cell_blocks(V)[:owned].astype(np.int64)
    if continuous:
        table = standing.tell(name).reshape(owned, standing.points.each, -1)
        table = _take_plane(table, d, tensor)
        _fill_nodes(function, blocks, standing.points, table)
    else:
        table = compute_cell_means(standing, name).reshape(owned, 1, -1)
        rows = function.x.array.reshape(-1, max(d * d, 1) if tensor else 1)
        rows[blocks[:, 0]] = _take_plane(table, d, tensor)[:, 0]
        function.x.scatter_forward()
    function.name = name
    return function


def _take_plane(table: Array, d: int, tensor: tuple[int, ...]) -> Array:
    """Return rows (cells, points, d d) of tensors in Mandel's notation; numbers as they are.

    Args:
        table: (cells, points, components).
        d: dimension of the body.
        tensor: the shape of a value, () of a number.
    """
    if not tensor:
        return table
    return to_tensors(table)[..., :d, :d].reshape(*table.shape[:2], d * d)


def _fill_nodes(function: Any, blocks: Indices, points: Any, table: Array) -> None:
    """Give a continuous Function the weighted means of the points round each node. Collective.

    Args:
        function: of degree 1.
        blocks: (cells, nodes) of its space.
        points: of integration.
        table: (cells, points, k) their values.
    """
    shapes = points.tabulate(blocks.shape[1])
    shares = np.einsum("cq,qn->cqn", points.weights, shapes)
    own = np.einsum("cqn,cqk->cnk", shares, table)
    sizes = np.broadcast_to(shares.sum(axis=1)[:, :, None], own.shape)
    summed = []
    for values in (own, sizes):
        rows = function.x.array.reshape(-1, table.shape[2])
        rows[:] = 0.0
        np.add.at(rows, blocks, values)
        compat.add_to_owners(function)
        function.x.scatter_forward()
        summed.append(np.array(function.x.array))
    function.x.array[:] = summed[0] / summed[1]
