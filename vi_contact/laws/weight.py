"""Make the weight of a body a load on its unknowns."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated

import numpy as np

from ..core.algebra import Array, largest, max_abs
from ..core.arguments import checked
from ..core.checks import array, whole
from ..core.errors import InputError
from ..core.quantities import RATIO, Finite, Remedy, Unit
from ..core.system import SemiDiscreteSystem
from ..core.units import STANDARD_GRAVITY
from .free_motions import bodies_in

NOTHING = 1e-9  # of the largest weight of an unknown
ALIKE = 0.05  # of a weight: what 9.81 for 9.80665, or a rounded unit weight, is off
SHARE = 0.1  # of the unknowns of a body: a load on so many is no traction


@checked
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

    acceleration: g; direction: where it acts, of length one, (0, -1) or (0, 0, -1) by
    default, in one dimension (-1,). bodies: the numbers of those that have weight
    (``fem.bodies_of``), all by default. It is the load of ``BodyForce`` with the density of every
    material. InputError for a direction of another length, and a system without ``base_inertia``:
    it lost the mass at held nodes; for weight that no unknown feels; and for weight that the system
    has already, as a constant load of nearly its size: of ``BodyForce``, or of this function.
    Collective.
    """
    d = system.influence.shape[1]
    down = (*(0.0,) * (d - 1), -1.0)
    way = array("with_weight", "direction", down if direction is None else direction, (None,))
    if way.shape != (d,) or not np.isclose(np.linalg.norm(way), 1.0):
        raise InputError(
            f"the direction of gravity is {tuple(way)}: give {d} components of a vector of length "
            "one"
        )
    if system.base_mass is None:
        raise InputError("the weight needs the mass at held nodes: assemble with base_inertia=True")
    weight = system.inertia(acceleration * way)
    if bodies is not None:
        numbers = np.asarray(system.space.bodies)
        last = bodies_in(system.algebra.comm, numbers) - 1
        heavy = [whole("with_weight", "the number of a body", one, most=last) for one in bodies]
        weight = np.where(np.isin(numbers, heavy), weight, 0.0)
    if bodies is None or len(bodies):
        _refuse_vain(system, weight)
    return system.changed(load=replace(system.load, constant=system.load.constant + weight))


def _refuse_vain(system: SemiDiscreteSystem, weight: Array) -> None:
    """Raise InputError, on all ranks, for weight that is given in vain.

    Nothing feels it, or the constant loads hold it already.
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
    count = bodies_in(comm, numbers)
    having, doubled = comm.sum(
        np.array([np.bincount(numbers[one], minlength=count) for one in (heavy, alike)], float)
    )
    if np.any((doubled > 0.0) & (doubled >= SHARE * having)):
        raise InputError(
            "with_weight: the system has this weight already among its constant loads, as a "
            "BodyForce or from an earlier with_weight, and would weigh twice as much; leave one of "
            "the two out"
        )
