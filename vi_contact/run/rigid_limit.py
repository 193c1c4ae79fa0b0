"""Bound the limit load of rigid blocks in the plane by linear programming.

The unknowns are a pressing force N and a shear T at both ends of each joint, and the multiplier
lambda of the live load. With the equilibrium H of the blocks, three rows each,

    maximise lambda   so that   H (N, T) + dead + lambda live = 0,   N >= 0,   |T| <= mu N.

The flow is associated: where a joint slides it opens too, by mu times the slip. By the theorems of
limit analysis lambda is the limit load of this material, and no less than that of Coulomb friction,
where joints slide without opening. The dual values of equilibrium are the velocities of the blocks
at the limit: the mechanism.

Livesley, R. K.: Limit analysis of structures formed from rigid blocks. Int. J. Numer. Methods
Engrg. 12 (1978), 1853-1871.
"""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy.sparse as sp

from ..core.algebra import Array
from ..core.checks import array, describe_point, find_shape, instance, quote
from ..core.errors import InputError, StepFailure
from .rigid_blocks import GROUND, RigidBlocks

OWNER = "rigid_limit_load"
TOLERANCE = 1e-10  # of HiGHS, the least that it takes; loads are scaled to a sum of one
OPTIMAL = 0  # of scipy's linprog
UNBOUNDED = 3
METHODS = ("highs-ds", "highs-ipm", "highs")
BALANCED = 1e-9  # least sum of further loads, of the loads, from which there is no equilibrium
CERTIFIED = 1e-7  # largest residual, of the sum of the loads
MOVES = 1e-6  # of the largest velocity
NAMED = 6  # joints in a sentence


@dataclass(frozen=True, eq=False)
class RigidLimit:
    """Hold the limit load of rigid blocks, with the forces and the mechanism there.

    Attributes:
        multiplier: lambda; infinite where the live load alone is borne at any size.
        forces: (m, 2, 2) pressing force N and shear T at both ends of each joint; they need not be
            the only ones in equilibrium. On the first block they are -N n + T t, t = (-n_y, n_x),
            on the second the opposite.
        velocities: (n, 3) of the blocks, along x, along y and anticlockwise [1/m] about their
            centres; scaled so that the fastest end of a joint or centre has the velocity one.
            Zeros where the multiplier is infinite.
        rates: (m, 2, 2) at both ends of each joint, how fast it opens, and how fast the second
            block slides along (-n_y, n_x) over the first, in the same scale.
        moving: numbers of the joints that open or slide.
        certificate: largest of the residuals of equilibrium, of the mechanism and of the equality
            of their works, over the sum of the loads.
        blocks: the blocks.
    """

    multiplier: float
    forces: Array = field(repr=False)
    velocities: Array = field(repr=False)
    rates: Array = field(repr=False)
    moving: tuple[int, ...]
    certificate: float
    blocks: RigidBlocks = field(repr=False)

    def describe(self) -> str:
        """Return the joints that move, as words."""
        return describe_moving(self.blocks, self.rates, self.velocities)


def rigid_limit_load(
    blocks: RigidBlocks,
    *,
    mu: Any,
    live: Any = (1.0, 0.0),
    dead: Any = (0.0, -1.0),
) -> RigidLimit:
    """Return the largest multiple of a live load that rigid blocks bear beside a dead load.

    It is that of associated flow, an upper bound for Coulomb friction: the head of this module has
    the equations. The default is a horizontal load in proportion to the weight.

    Args:
        blocks: rigid blocks and joints in the plane, of ``rigid_blocks``.
        mu: coefficient of friction, one number or (m,) one for each joint.
        live: the load that is multiplied: (2,) a force for each unit of area, or (n, 3) forces
            along x and y and moments about the centre, for each block.
        dead: the load that stays, in the same form.

    Returns:
        the multiplier, the forces and the mechanism.

    Raises:
        InputError: wrong arguments, a live load of zeros.
        StepFailure: no equilibrium under the dead load, with the joints that move; a program that
            HiGHS does not solve.
    """
    instance(OWNER, "blocks", blocks, RigidBlocks, "give rigid_blocks(joints, fixed=…)")
    friction = _read_friction(blocks, mu)
    fixed_load = _read_load(blocks, "dead", dead)
    varied = _read_load(blocks, "live", live)
    if not varied.any():
        raise InputError(f"{OWNER}: live is zero everywhere; give the load that grows")

    # lengths over the size of the whole, loads over their sums: the program has numbers near one
    size = _find_size(blocks)
    equilibrium = _make_equilibrium(blocks, size) @ _make_cones(friction)
    scale = np.tile([1.0, 1.0, 1.0 / size], len(blocks.areas))
    f = varied.ravel() * scale
    d = fixed_load.ravel() * scale
    live_sum = float(np.abs(f).sum())
    dead_sum = float(np.abs(d).sum())
    if dead_sum > 0.0:
        _check_equilibrium(blocks, equilibrium, d / dead_sum, size)
    total = dead_sum or live_sum
    share = total / live_sum

    # maximise the multiplier; where it has no bound there is no mechanism
    solved = _maximise(equilibrium, d / total, f / live_sum)
    if solved is None:
        nothing = np.zeros((len(blocks.bodies), 2, 2))
        return RigidLimit(
            math.inf, nothing, np.zeros((len(blocks.areas), 3)), nothing, (), 0.0, blocks
        )
    parts, scaled, motion, residual = solved
    if not residual <= CERTIFIED:
        raise StepFailure(
            f"{OWNER}: the linear program is solved to {residual:.2g} of the loads only, more than "
            f"{CERTIFIED:g}: look for joints much shorter than the blocks"
        )
    velocities, rates = _describe_motion(blocks, motion, size)
    forces = total * (_make_cones(friction) @ parts)
    return RigidLimit(
        multiplier=scaled * share,
        forces=forces.reshape(-1, 2, 2),
        velocities=velocities,
        rates=rates,
        moving=_find_moving(rates),
        certificate=residual,
        blocks=blocks,
    )


def describe_moving(blocks: RigidBlocks, rates: Array, velocities: Array) -> str:
    """Return the joints that open or slide, or the blocks that move without one, as words.

    Args:
        blocks: the blocks.
        rates: (m, 2, 2) opening and sliding at both ends of each joint.
        velocities: (n, 3) of the blocks.
    """
    moving = _find_moving(rates)
    words = []
    for joint in moving:
        middle = blocks.ends[joint].mean(axis=0)
        middle = np.where(np.abs(middle) > 1e-9 * np.abs(blocks.ends).max(), middle, 0.0)
        words.append(f"{blocks.describe(joint)} at {describe_point(middle)}")
    if not words:
        size = np.abs(velocities).max(axis=1)
        words = [blocks.names[block] for block in np.flatnonzero(size > MOVES * size.max())]
    ending = f", and {len(words) - NAMED} more" if len(words) > NAMED else ""
    return "; ".join(words[:NAMED]) + ending


# Arguments
# --------------------------------------------------------------------------------------------------


def _read_friction(blocks: RigidBlocks, mu: Any) -> Array:
    """Return mu (m,) of the joints; InputError for negative numbers and other shapes."""
    count = len(blocks.bodies)
    shape = () if find_shape(mu) == () else (count,)
    values = np.broadcast_to(array(OWNER, "mu", mu, shape, unit="1"), (count,))
    if count and values.min() < 0.0:
        raise InputError(f"{OWNER}: mu is {quote(mu)}; give zero or positive numbers")
    return values


def _read_load(blocks: RigidBlocks, name: str, load: Any) -> Array:
    """Return forces and moments (n, 3) of a load on each block."""
    n = len(blocks.areas)
    if len(find_shape(load)) == 1:
        force = array(OWNER, name, load, (2,))
        return np.column_stack([np.outer(blocks.areas, force), np.zeros(n)])
    return array(OWNER, name, load, (n, 3))


def _find_size(blocks: RigidBlocks) -> float:
    """Return the size of all blocks together [m]."""
    points = np.concatenate([blocks.centres, blocks.ends.reshape(-1, 2)])
    return float(np.ptp(points, axis=0).max()) or float(np.sqrt(blocks.areas.max()))


# The linear program
# --------------------------------------------------------------------------------------------------


def _make_equilibrium(blocks: RigidBlocks, size: float) -> sp.csr_matrix:
    """Return H (3 n, 4 m): loads on blocks by (N, T) at the first and the second end of each joint.

    On the first block act -N n and T t, t = (-n_y, n_x), on the second the opposite.

    Args:
        blocks: n blocks and m joints.
        size: by which moments are divided [m].
    """
    m = len(blocks.bodies)
    along = np.stack([-blocks.normals[:, 1], blocks.normals[:, 0]], axis=1)
    rows = []
    columns = []
    values = []
    for side, sign in ((0, 1.0), (1, -1.0)):
        body = blocks.bodies[:, side]
        for end in (0, 1):
            arm = blocks.ends[:, end] - blocks.centres[body]
            for kind, direction in ((0, -blocks.normals), (1, along)):
                force = sign * direction
                moment = (arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]) / size
                for row, value in enumerate((force[:, 0], force[:, 1], moment)):
                    moves = body != GROUND
                    rows.append(3 * body[moves] + row)
                    columns.append(4 * np.flatnonzero(moves) + 2 * end + kind)
                    values.append(value[moves])
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sp.csr_matrix(entries, shape=(3 * len(blocks.areas), 4 * m))


def _make_cones(friction: Array) -> sp.csr_matrix:
    """Return G (4 m, 4 m): (N, T) of each end by what acts along both edges of its cone.

    N >= 0 and |T| <= mu N are (N, T) = a (1, mu) + b (1, -mu) with a, b >= 0; the edges are unit
    vectors here.

    Args:
        friction: (m,) mu of the joints.
    """
    length = np.sqrt(1.0 + friction**2)
    cones = []
    for one, mu in zip(length, friction, strict=True):
        cones += 2 * [np.array([[1.0, 1.0], [mu, -mu]]) / one]
    return sp.block_diag(cones, format="csr") if cones else sp.csr_matrix((0, 0))


def _maximise(
    equilibrium: sp.csr_matrix, dead: Array, live: Array
) -> tuple[Array, float, Array, float] | None:
    """Maximise the multiplier of the live load.

    Args:
        equilibrium: (3 n, 4 m) loads by forces along the edges of cones.
        dead: (3 n,) the load that stays.
        live: (3 n,) the load that is multiplied.

    Returns:
        the forces (4 m,), the multiplier, the velocities (3 n,) with the power one of the live
        load, and the largest residual; None where the multiplier has no limit.

    Raises:
        StepFailure: HiGHS finds no answer.
    """
    matrix = sp.hstack([equilibrium, sp.csr_matrix(live[:, None])], format="csr")
    cost = np.zeros(matrix.shape[1])
    cost[-1] = -1.0
    solved = _minimise(cost, matrix, dead)
    if solved is None:
        return None
    unknowns, motion = solved
    multiplier = float(unknowns[-1])

    # optimal are pressing forces in equilibrium and velocities at which no force of a cone takes
    # work, with the power one of the live load, and equal works: lambda = -dead·w
    out_of_balance = np.abs(matrix @ unknowns + dead).max(initial=0.0)
    pulled = -unknowns.min(initial=0.0)
    size = np.abs(motion).max(initial=0.0) or 1.0
    taken = -np.min(equilibrium.T @ motion, initial=0.0) / size
    works = abs(multiplier * float(live @ motion) + float(dead @ motion)) / size
    return unknowns[:-1], multiplier, motion, float(max(out_of_balance, pulled, taken, works))


def _check_equilibrium(
    blocks: RigidBlocks, equilibrium: sp.csr_matrix, dead: Array, size: float
) -> None:
    """Raise StepFailure where the dead load has no equilibrium, with the joints that move.

    The least sum of further loads with which there is equilibrium is zero, or there is none
    without them. The dual values are then velocities at which the dead load does work.

    Args:
        blocks: the blocks.
        equilibrium: (3 n, 4 m) loads by forces along the edges of cones.
        dead: (3 n,) the load, of the sum one.
        size: of all blocks together [m].
    """
    n, m = equilibrium.shape
    eye = sp.identity(n, format="csr")
    matrix = sp.hstack([equilibrium, eye, -eye], format="csr")
    cost = np.concatenate([np.zeros(m), np.ones(2 * n)])
    solved = _minimise(cost, matrix, dead)
    assert solved is not None  # a sum of further loads is never below zero
    unknowns, motion = solved
    if unknowns[m:].sum() > BALANCED:
        velocities, rates = _describe_motion(blocks, motion, size)
        raise StepFailure(
            f"{OWNER}: the blocks have no equilibrium under the dead load, these open, slide or "
            f"fall: {describe_moving(blocks, rates, velocities)}"
        )


def _minimise(cost: Array, matrix: sp.csr_matrix, load: Array) -> tuple[Array, Array] | None:
    """Minimise cost·x so that matrix x + load = 0, x >= 0.

    Args:
        cost: (k,).
        matrix: (3 n, k).
        load: (3 n,).

    Returns:
        x (k,) and the velocities (3 n,), which are minus the dual values; None without a minimum.

    Raises:
        StepFailure: HiGHS finds no answer.
    """
    from scipy.optimize import linprog  # late: it takes a while

    # near the limit one of the methods may stop without an answer, where another has one
    for method in METHODS:
        out = linprog(
            cost,
            A_eq=matrix,
            b_eq=-load,
            bounds=(0.0, None),
            method=method,
            options={
                "primal_feasibility_tolerance": TOLERANCE,
                "dual_feasibility_tolerance": TOLERANCE,
            },
        )
        if out.status == UNBOUNDED:
            return None
        if out.status == OPTIMAL:
            return np.asarray(out.x), -np.asarray(out.eqlin.marginals)
    raise StepFailure(f"{OWNER}: HiGHS does not solve the linear program: {out.message}")


# The mechanism
# --------------------------------------------------------------------------------------------------


def _describe_motion(blocks: RigidBlocks, motion: Array, size: float) -> tuple[Array, Array]:
    """Return velocities (n, 3) of the blocks and rates (m, 2, 2) at the ends of joints.

    Args:
        blocks: the blocks.
        motion: (3 n,) what belongs to forces, and to moments over the size.
        size: of all blocks together [m].
    """
    velocities = motion.reshape(-1, 3) * [1.0, 1.0, 1.0 / size]
    along = np.stack([-blocks.normals[:, 1], blocks.normals[:, 0]], axis=1)
    moved = np.zeros((2, len(blocks.bodies), 2, 2))
    for side in (0, 1):
        body = blocks.bodies[:, side]
        moves = body != GROUND
        arm = blocks.ends[moves] - blocks.centres[body[moves], None]
        spin = velocities[body[moves], 2][:, None]
        moved[side, moves, :, 0] = velocities[body[moves], 0][:, None] - spin * arm[:, :, 1]
        moved[side, moves, :, 1] = velocities[body[moves], 1][:, None] + spin * arm[:, :, 0]
    fastest = max(
        float(np.linalg.norm(moved, axis=3).max(initial=0.0)),
        float(np.linalg.norm(velocities[:, :2], axis=1).max(initial=0.0)),
    )
    fastest = fastest or 1.0
    away = (moved[1] - moved[0]) / fastest
    opening = np.einsum("mec,mc->me", away, blocks.normals)
    sliding = np.einsum("mec,mc->me", away, along)
    return velocities / fastest, np.stack([opening, sliding], axis=2)


def _find_moving(rates: Array) -> tuple[int, ...]:
    """Return the joints that open or slide, by their rates (m, 2, 2)."""
    fast = np.abs(rates).max(axis=(1, 2), initial=0.0) > MOVES
    return tuple(int(joint) for joint in np.flatnonzero(fast))
