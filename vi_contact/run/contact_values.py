"""Say what acts and slips at every contact point of a state, along the axes of coordinates."""

from dataclasses import dataclass

import numpy as np

from ..core.algebra import Array, Mask
from ..core.corners import find_tangents
from ..core.joints import find_limit
from ..core.problem import ContactProblem
from ..core.state_checks import check_problem_given, check_sizes
from ..core.step import State


@dataclass(frozen=True, eq=False)
class ContactValues:
    """Hold the values of the m contact points of all ranks, in the order of their numbers.

    Attributes:
        points: (m, d) positions in the undeformed body [m].
        normals: (m, d) unit contact directions, from the body to its support.
        weights: (m,) tributary length times thickness, or area [m²].
        pressure: (m,) r_n / weight [Pa].
        traction: (m, d) tangential traction of the body on its support [Pa], along the axes: it
            points the way in which the body slides. That on the body is the opposite.
        limit: (m,) the largest size that the law of friction at rest allows it [Pa].
        slip: (m, d) tangential displacement of the body on its support [m], along the axes. Open
            points have one too.
        gap: (m,) [m].
        active: (m,) whether the point is closed.
    """

    points: Array
    normals: Array
    weights: Array
    pressure: Array
    traction: Array
    limit: Array
    slip: Array
    gap: Array
    active: Mask

    @property
    def used(self) -> Array:
        """Return |traction| / limit (m,), 1 where a point slides; nan where there is no limit."""
        size = np.linalg.norm(self.traction, axis=1)
        nothing = np.full(len(size), np.nan)
        return np.divide(size, self.limit, out=nothing, where=self.limit > 0.0)


def contact_values(
    problem: ContactProblem, state: State, *, since: State | None = None
) -> ContactValues:
    """Return pressure, traction, slip and gap of every contact point, equal on all ranks.

    They are vectors along the axes, where the arrays of a state and of ``Contact()`` are in the
    tangents of nodal frames. Collective.

    Args:
        problem: the problem.
        state: a state of it, of a static stage or of a run.
        since: an earlier state, from which on slip is measured; the undeformed body when None.

    Raises:
        InputError: a state of another problem.
    """
    check_problem_given("contact_values", problem)
    check_sizes("contact_values", problem, state)
    surface = problem.surface
    weights = surface.weights[:, None]
    slip = surface.slip(state.u, state.t)
    if since is not None:
        check_sizes("contact_values", problem, since)
        slip = slip - surface.slip(since.u, since.t)
    r_t = np.zeros_like(slip) if state.r_t is None else state.r_t
    normal = surface.normal_values(state.u)
    own = {
        "pressure": state.r_n / surface.weights,
        "limit": find_limit(problem, state) / surface.weights,
        "gap": surface.gap(state.t) - normal + surface.compliance * state.r_n,
        "active": state.active,
    }

    # Tangents of a node with several directions follow from all of these, so from all conditions.
    whole = surface.whole()
    tangents = find_tangents(whole)
    traction = np.einsum("kdc,kc->kd", tangents, surface.everywhere(r_t / weights))
    slip = np.einsum("kdc,kc->kd", tangents, surface.everywhere(slip))
    return ContactValues(
        points=whole.points,
        normals=whole.normals,
        weights=whole.weights,
        traction=traction,
        slip=slip,
        **{name: surface.everywhere(values) for name, values in own.items()},
    )
