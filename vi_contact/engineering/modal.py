"""Find the lowest natural frequency of a system, for choosing excitations and time steps."""

import numpy as np

from ..core.checks import instance, whole
from ..core.errors import InputError
from ..core.system import SemiDiscreteSystem


def lowest_frequency(system: SemiDiscreteSystem, *, max_iterations: int = 2000) -> float:
    """Return f1 [Hz] of K phi = (2 pi f)² M phi without contact, by inverse iteration with one factorisation of K.

    The start vector is the static answer to a uniform acceleration in all directions: deterministic, and not
    orthogonal to the first mode of structures that a base motion can excite.
    Raises InputError for a floating body (K singular) and when the iteration does not settle.
    """
    instance("lowest_frequency", "system", system, SemiDiscreteSystem, "give a system, such as fem.assemble returns")
    whole("lowest_frequency", "max_iterations", max_iterations, least=1)
    if system.floating:
        raise InputError("the body floats: its lowest frequency is zero; clamp a part of it")
    dot = system.algebra.dot
    factor = system.algebra.factor(system.K)
    force = system.M @ (system.influence @ (1.0 + 0.1 * np.arange(system.influence.shape[1])))
    square = 0.0
    for _ in range(max_iterations):
        mode = factor.solve(force)
        inertia = system.M @ mode
        norm = dot(mode, inertia)
        last, square = square, dot(mode, force) / norm
        force = inertia / np.sqrt(norm)
        if abs(square - last) <= 1e-15 * square:
            break
    if not abs(square - last) <= 1e-10 * square:
        raise InputError("the lowest frequency did not settle: give the excitation frequency explicitly")
    return float(np.sqrt(square)) / (2.0 * np.pi)
