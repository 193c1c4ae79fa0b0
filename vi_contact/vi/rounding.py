"""Say how far two values of a field may differ by rounding alone.

A value of a field is often computed from larger ones: sin(pi x) is 1.2e-16 at x = 1, where 0 is
meant. What rounding leaves at a node is relative to the size of the whole field and not to the
value at that node.
"""

import numpy as np

from ..core.algebra import Array, Comm, largest, max_abs

OFF = 1e-12  # of the field's size
# a bound beyond which no other number of the problem comes, not even by this factor, stands for "no
# bound"
FAR = 1e4


def measure_field(values: Array, lower: Array, upper: Array, comm: Comm) -> float:
    """Return the largest finite number among the values of a field and its bounds. Collective.

    Users write 1e7 or 1e20 where there is no bound. Such walls say nothing of the size of the
    field: the largest numbers are left out for as long as they lie on the far side of zero (lower <
    0 or upper > 0) and are more than ``FAR`` times as large as the next smaller number.

    Args:
        values: (n,) owned ones.
        lower: (n,) bounds from below.
        upper: (n,) bounds from above.
        comm: of the mesh.
    """
    # Numbers that the field certainly reaches: its own values, and bounds that keep it away from
    # zero.
    reached = largest(
        comm,
        max(
            max_abs(_finite(values)),
            max_abs(_finite(np.maximum(lower, 0.0))),
            max_abs(_finite(np.minimum(upper, 0.0))),
        ),
    )

    # Bounds on the far side of zero, the largest first, each with the next smaller number.
    walls = np.concatenate([_finite(np.maximum(-lower, 0.0)), _finite(np.maximum(upper, 0.0))])
    top = largest(comm, max_abs(walls))
    while top > reached:
        walls = walls[walls < top]
        below = max(reached, largest(comm, max_abs(walls)))
        if below == 0.0 or top <= FAR * below:
            return top
        top = below
    return reached


def _finite(values: Array) -> Array:
    """Return the values that are finite."""
    return np.asarray(values[np.isfinite(values)])
