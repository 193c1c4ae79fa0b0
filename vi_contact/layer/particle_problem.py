"""Make the contact problem of a particle before a wall, for ``march`` and ``simulate``.

    m u'' = f(t) - r_n,    0 <= distance - u  ⊥  r_n >= 0,    u(0) = 0,    u'(0) = speed

u is the way towards the wall [m], r_n the force of the wall [N], which pushes the particle away.
With ``BoundaryLayer`` the layer stands in the place of the inequality: ``ParticleImpact`` has its
closed form.
"""

from collections.abc import Callable
from typing import Annotated

import numpy as np

from ..core.arguments import check_arguments
from ..core.checks import number
from ..core.problem import ContactProblem
from ..core.quantities import Finite, NotNegative, Positive, Unit
from ..core.system import Load
from ..fem.contact.points import contact_points
from ..fem.matrices.own_matrices import system_from_arrays
from ..laws.mass import ConsistentMass


@check_arguments
def particle_problem(
    mass: Annotated[float, Positive, Unit("kg")],
    *,
    speed: Annotated[float, Finite, Unit("m/s")],
    distance: Annotated[float, NotNegative, Unit("m")],
    force: Annotated[Callable[[float], float] | None, Unit("N")] = None,
) -> ContactProblem:
    """Return the problem of a particle that flies towards a wall, by the equation above.

    Args:
        mass: m [kg].
        speed: u' at t = 0 [m/s], positive towards the wall.
        distance: of the wall at t = 0 [m].
        force: t [s] -> f [N], positive towards the wall; None: no force.

    Returns:
        A problem of one unknown with one contact point of weight 1, at which a law per unit area is
        a law of forces. It keeps its mass.

    Raises:
        InputError: an argument is outside its range, or, at a time, the force is no finite number.

    Source: the particle of ENOC 2017, A solution of the general single contact frictionless problem
    using tools of b-geometry, equation 35.
    """
    loads = () if force is None else ((np.ones(1), _finite(force)),)
    system = system_from_arrays(
        [[mass]],
        None,
        [[0.0]],
        coordinates=[[0.0]],
        load=Load(np.zeros(1), loads),
        v0=[speed],
    )
    wall = contact_points(system, [0], [1.0], gap0=distance)
    return ContactProblem(system, wall, mass=ConsistentMass())


def _finite(force: Callable[[float], float]) -> Callable[[float], float]:
    """Return the force with a check of what it returns."""
    return lambda t: number("particle_problem", f"force({t:.6g} s)", force(t), unit="N")
