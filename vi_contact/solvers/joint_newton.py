"""Find where the end of a step with a joint is, by Newton's method in the displacements.

After a pass with the strengths F, C, mu the law has others at its end. With H = G⁻¹, the stiffness
of the bodies at their contact unknowns, and S the slopes of the law, the changes du and r' obey

    (H + scale S_F) du_n + r' - r'_old = scale (F(g) - F),       0 <= r'  ⊥  g - du_n >= 0
    (H + r' S_mu e eᵀ) du_t = -e (r' (mu(w) - mu) + scale (C(g) - C))

along the slip e of points that slip; those that stick do not move. Where the pass is only supposed,
its reactions miss their conditions by something, which stands at the right of both. The contact
conditions are met by the primal-dual active set method: points that would go into the obstacle are
closed, those that would be pulled are opened, until none is left. In space the limit of friction
also turns with the slip, which adds limit/|slip| across it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from ..core.algebra import Array, Mask
from ..core.joints import JointStep, Strength
from .condensed_passes import CondensedPasses, Expected, PassEnd

SETS = 12  # contact sets of one step of Newton's method


@dataclass(frozen=True)
class Linearised:
    """Hold the law of a joint about the end of a pass, for all M conditions of all ranks.

    Attributes:
        springs: (M, d, d) the slopes of the law.
        force: (M, d) by how much its forces are others there.
    """

    springs: Array
    force: Array


def correct(
    joint: JointStep,
    end: PassEnd,
    small: CondensedPasses,
    place: tuple[Array, Array],
    there: Strength,
    used: Strength,
    scale: float,
) -> Expected | None:
    """Return where the end of the step is expected. Collective.

    None where the matrix of Newton's method is not positive: the joint snaps back.

    Args:
        joint: at the beginning of the step.
        end: of the last pass.
        small: which has made it.
        place: openings (m,) and slips (m, d - 1) of its end.
        there: the strength there [N].
        used: the strength of the pass [N].
        scale: how many times newtons its reactions are.
    """
    law = _linearise(joint, end, small, place, there, used, scale)
    g1 = np.asarray(small.surface.everywhere(place[0]))
    try:
        du, closed = _solve(law, end, small, g1)
    except LinAlgError:
        return None
    gap = np.where(closed, 0.0, np.maximum(g1 - du[:, 0], 0.0))
    return Expected(gap, end.slip + du[:, 1:], closed, end.sticks)


def _linearise(
    joint: JointStep,
    end: PassEnd,
    small: CondensedPasses,
    place: tuple[Array, Array],
    there: Strength,
    used: Strength,
    scale: float,
) -> Linearised:
    """Return the law about the end of a pass; the arguments are those of ``correct``."""
    slope = joint.find_slope(*place)
    limit = used.cohesion - used.mu * used.tension
    columns = [
        slope.tension,
        slope.mu,
        there.tension - used.tension,
        there.mu - used.mu,
        there.cohesion - there.mu * there.tension - limit,
        limit,
        used.mu,
    ]
    of_all = np.asarray(small.surface.everywhere(np.column_stack(columns)))
    of_tension, of_mu, tension, friction, cohesion, limit, mu = of_all.T
    count, width = end.r.shape
    r_n = np.maximum(end.r[:, 0], 0.0)
    springs = np.zeros((count, width, width))
    force = np.zeros((count, width))
    springs[:, 0, 0] = scale * of_tension
    force[:, 0] = scale * tension + np.where(end.closed, 0.0, end.r[:, 0])
    if width > 1:
        way = np.linalg.norm(end.slip, axis=1)
        moves = way > 0.0
        e = np.divide(end.slip, way[:, None], out=np.zeros(end.slip.shape), where=moves[:, None])
        along = e[:, :, None] * e[:, None, :]
        across = moves[:, None, None] * np.eye(width - 1) - along
        bears = scale * limit + mu * r_n
        turn = np.divide(bears, way, out=np.zeros(count), where=moves)
        springs[:, 1:, 1:] = (r_n * of_mu)[:, None, None] * along
        springs[:, 1:, 1:] += turn[:, None, None] * across
        force[:, 1:] = end.r[:, 1:] - e * (bears + r_n * friction + scale * cohesion)[:, None]
    return Linearised(springs, force)


def _solve(law: Linearised, end: PassEnd, small: CondensedPasses, g1: Array) -> tuple[Array, Mask]:
    """Return the changes (M, d) [m] of the contact unknowns, and the contact set (M,).

    Args:
        law: about the end of the pass.
        end: of the pass.
        small: which has made it.
        g1: openings (M,) [m] of its end.

    Raises:
        LinAlgError: the matrix is not positive.
    """
    assert small.stiffness is not None  # whoever asks has looked
    closed = end.closed
    for _ in range(SETS):
        du, r_n = _solve_on_set(law, end, small.stiffness, g1, closed)
        g2 = g1 - du[:, 0]
        opens = closed & (r_n < 0.0)
        closes = ~closed & (g2 < 0.0)
        if not (opens.any() or closes.any()):
            break
        closed = (closed & ~opens) | closes
    return du, closed


def _solve_on_set(
    law: Linearised, end: PassEnd, H: Array, g1: Array, closed: Mask
) -> tuple[Array, Array]:
    """Return the changes (M, d) [m] with a contact set, and r' (M,) of closed points.

    Args:
        law: about the end of the pass.
        end: of the pass.
        H: G⁻¹.
        g1: openings (M,) [m] of the end.
        closed: the contact set (M,).
    """
    count, width = end.r.shape
    free = np.repeat(~end.sticks[:, None], width, axis=1)
    free[:, 0] = ~closed
    du = np.zeros((count, width))
    du[:, 0] = np.where(closed, g1, 0.0)  # points that close go all of their way
    chosen = np.flatnonzero(free)
    force = law.force.ravel() - H @ du.ravel() if du.any() else law.force.ravel()
    if len(chosen):
        matrix = H[np.ix_(chosen, chosen)]
        _add_springs(matrix, law.springs, free)
        factor = cho_factor(matrix, lower=True, overwrite_a=True, check_finite=False)
        du.ravel()[chosen] = cho_solve(factor, force[chosen], check_finite=False)
    rest = law.force[:, 0] - (H[::width] @ du.ravel()) - law.springs[:, 0, 0] * du[:, 0]
    return du, np.where(closed, end.r[:, 0] + rest, 0.0)


def _add_springs(matrix: Array, springs: Array, free: Mask) -> None:
    """Add the springs of the law to the stiffness of the free unknowns.

    Args:
        matrix: (k, k) of the free unknowns, changed.
        springs: (M, d, d).
        free: (M, d) which unknowns are free.
    """
    place = np.cumsum(free.ravel()).reshape(free.shape) - 1
    width = free.shape[1]
    for row in range(width):
        for column in range(width):
            both = free[:, row] & free[:, column]
            matrix[place[both, row], place[both, column]] += springs[both, row, column]
