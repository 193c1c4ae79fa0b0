"""What acts on a body: prescribed displacements (seed 000 eq. 3), tractions (eqs. 4, 6) and body forces.

Fields are given at points: a callable takes points (k, d) [m] and the time [s] and returns values (k, d). They are
interpolated at the nodes and then integrated exactly, so a load costs one sparse product a step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..algebra import Array, Comm
from ..errors import InputError
from .mesh import Facets

Field = Callable[[Array, float], Array]
Value = tuple[float, ...] | Field


def evaluate(name: str, value: Value, points: Array, t: float, comm: Comm) -> Array:
    """The value at this rank's points, shape (k, d); collective. InputError, on all ranks, for NaN or a wrong shape."""
    result, defect = evaluate_here(name, value, points, t)
    refuse([defect], comm)
    return result


def evaluate_here(name: str, value: Value, points: Array, t: float) -> tuple[Array, str]:
    """(values at the points, what is wrong with them or an empty text); zeros where something is wrong."""
    if len(points) == 0:
        return np.zeros_like(points), ""  # users' functions need not cope with no points
    if callable(value):
        result = np.asarray(value(points, t), dtype=float)
    else:
        result = np.tile(np.asarray(value, dtype=float), (len(points), 1))
    if result.shape != points.shape:
        shape = f"shape {result.shape} for {len(points)} points"
        return np.zeros_like(points), f"{name} returned {shape}: return {points.shape[1]} components per point"
    if not np.all(np.isfinite(result)):
        where = f"NaN or infinite values at t = {t:g} s"
        return np.zeros_like(points), f"{name} contains {where}: check its function or data"
    return result, ""


def refuse(defects: Sequence[str], comm: Comm) -> None:
    """InputError on all ranks with the first text that is not empty; collective."""
    if comm.max(np.array([float(any(defects))]))[0]:
        found = comm.bcast(comm.gather(list(defects)))
        raise InputError(next(text for texts in found for text in texts if text))


def _zero(points: Array, t: float) -> Array:
    return np.zeros_like(points)


@dataclass(frozen=True)
class Prescribed:
    """u_i = U_i(x, t) on facets (eq. 3), with the velocity and acceleration of the same motion.

    ``components``: which displacement components are prescribed (all when None); the others stay free (rollers).
    The mass and damping of the boundary nodes enter the equations, so all three time functions are needed;
    left out they are zero (a clamped part, or a displacement constant in time).
    """

    facets: Facets
    displacement: Value = _zero
    velocity: Value = _zero
    acceleration: Value = _zero
    components: tuple[int, ...] | None = None

    @property
    def motions(self) -> tuple[Value, Value, Value]:
        """(U, U', U'')."""
        return self.displacement, self.velocity, self.acceleration

    @property
    def moves(self) -> bool:
        """False for a clamped part."""
        return any(value is not _zero for value in self.motions)


@dataclass(frozen=True)
class Traction:
    """S_i = F_i(x, t) [Pa] on facets (eq. 4). ``history``: a factor f(t) of a value that is constant in time.

    With a history, or with a tuple, the load is assembled once; a callable without history is evaluated every step.
    """

    facets: Facets
    value: Value
    history: Callable[[float], float] | None = None


@dataclass(frozen=True)
class TangentialTraction(Traction):
    """The given tangential traction S_T = C_T(x, t) of eq. 6 on the contact boundary: the part of ``value`` along the
    facet, its normal component is removed."""


@dataclass(frozen=True)
class BodyForce:
    """Volume force f_i(x, t) [N/m³] (eq. 7). Weight of a material is BodyForce((0, -rho * 9.80665))."""

    value: Value
    history: Callable[[float], float] | None = None


def is_constant(load: Traction | BodyForce) -> bool:
    """Whether one assembly serves all times."""
    return load.history is not None or not callable(load.value)


def as_tuple(items: Any) -> tuple[Any, ...]:
    """One item or a sequence of items, as a tuple; None is none."""
    if items is None:
        return ()
    return tuple(items) if isinstance(items, list | tuple) else (items,)
