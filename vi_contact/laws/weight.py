"""Make the weight of a body a load on its unknowns."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated

import numpy as np

from ..core.algebra import Array, largest, max_abs
from ..core.arguments import check_arguments
from ..core.checks import array, whole
from ..core.errors import InputError
from ..core.quantities import RATIO, Finite, Remedy, Unit
from ..core.system import SemiDiscreteSystem
from ..core.units import STANDARD_GRAVITY
from .free_motions import count_bodies

NOTHING = 1e-9  # of the largest weight of an unknown
ALIKE = 0.05  # of a weight: what 9.81 for 9.80665, or a rounded unit weight, is off
SHARE = 0.1  # of the unknowns of a body: a load on so many is no traction


@check_arguments
def with_weight(
    system: Annotated[SemiDiscreteSystem, Remedy("give a system, such as fem.assemble returns")],
    *,
    acceleration: Annotated[float, Finite, Unit("m/s²")] = STANDARD_GRAVITY,
    direction: Annotated[tuple[float, ...] | None, RATIO] = None,
    bodies: Annotated[
        Sequence[int] | None, Remedy("give numbers such as fem.bodies_of returns, or None")
    ] = None,
) -> SemiDiscreteSystem:
    """Return the same system under its own weight, f + M r g: whatever its materials and densities.

    It is the load of ``BodyForce`` with the density of every material. Collective.

    Args:
        system: the system.
        acceleration: g [m/s²].
        direction: (d,) where it acts, of length one; None for (0, -1) or (0, 0, -1), in one
            dimension (-1,).
        bodies: the numbers of those that have weight (``fem.bodies_of``); None for all.

    Raises:
        InputError: a direction of another length; a system without ``base_inertia``, which lost the
            mass at held nodes; weight that no unknown feels; weight that the system has already, as
            a constant load of nearly its size: of ``BodyForce``, or of this function.
    """
    owner = "with_weight"
    system.refuse_statics_only(owner)
    d = system.influence.shape[1]
    if direction is None:
        direction = (*[0.0] * (d - 1), -1.0)
    down = array(owner, "direction", direction, (None,))
    if down.shape != (d,) or not np.isclose(np.linalg.norm(down), 1.0):
        raise InputError(
            f"the direction of gravity is {tuple(down)}: give {d} components of a vector of length "
            "one"
        )
    if system.base_mass is None:
        raise InputError("the weight needs the mass at held nodes: assemble with base_inertia=True")
    weight = system.inertia(acceleration * down)
    if bodies is not None:
        numbers = np.asarray(system.space.bodies)
        last = count_bodies(system.algebra.comm, numbers) - 1
        heavy = [whole(owner, "the number of a body", number, most=last) for number in bodies]
        weight = np.where(np.isin(numbers, heavy), weight, 0.0)
    if bodies is None or len(bodies):
        _refuse_vain(system, weight)
    return system.changed(load=replace(system.load, constant=system.load.constant + weight))


def _refuse_vain(system: SemiDiscreteSystem, weight: Array) -> None:
    """Raise InputError, on all ranks, for weight (n,) [N] that is given in vain.

    Nothing feels it, or it is among the constant loads already.
    """
    comm = system.algebra.comm
    size = largest(comm, max_abs(weight))
    if not size:
        raise InputError(
            "with_weight: no unknown feels the weight, as its acceleration is zero or its bodies "
            "are held everywhere; leave it out"
        )
    # Body by body: of how many unknowns the constant load is the weight. Tractions touch few, a
    # weight nearly all.
    numbers = np.asarray(system.space.bodies)
    heavy = np.abs(weight) > NOTHING * size
    alike = heavy & (np.abs(system.load.constant - weight) <= ALIKE * np.abs(weight))
    count = count_bodies(comm, numbers)
    counts = [
        np.bincount(numbers[heavy], minlength=count),
        np.bincount(numbers[alike], minlength=count),
    ]
    with_weight_here, with_it_already = comm.sum(np.array(counts, float))
    if np.any((with_it_already > 0.0) & (with_it_already >= SHARE * with_weight_here)):
        raise InputError(
            "with_weight: the system has this weight already among its constant loads, as a "
            "BodyForce or from an earlier with_weight, and would weigh twice as much; leave one of "
            "the two out"
        )
