"""Integrate the motion (u, v, a) of a base that an acceleration shakes.

The time scheme is that of the run.

A run in the frame of the ground, -M r a_g (``ContactProblem(excitation=...)``), and one whose base
is moved (``fem.Prescribed``) are the same problem in two frames, u = u_relative + r u_g. They are
the same discrete problem if u_g and v_g are what the scheme makes of u_g'' = a_g: for the
trapezoidal rule

    v_1 = v_0 + dt (a_0 + a_1)/2,    u_1 = u_0 + dt (v_0 + v_1)/2.

The scheme is asked: a free unit mass is marched with it under the force a_g. Mass-proportional
damping acts on the absolute velocity of a moved base and on the relative one in the frame of the
ground: with alpha M the frames differ. So do MoreauJean and ContactStabilisedNewmark, whose contact
looks at velocities or at a prediction. Source: seismic practice, prescribed base; a base moved by
(u, v, a) integrated otherwise drifts against its inertia.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np
import scipy.sparse as sp

from ...core.algebra import Array
from ...core.checks import provides
from ...core.errors import InputError
from ...core.protocols import EXCITATION, Excitation
from ...core.surfaces import ContactSurface
from ...core.system import Load, SemiDiscreteSystem
from .companion import CompanionRun, linear_problem


@dataclass(frozen=True)
class GroundFrame:
    """Describe the base in the frame of the ground.

    There it is at rest, and the excitations shake as inertia loads.
    """

    excitations: tuple[Excitation, ...]
    lets_waves_in: ClassVar[bool] = False

    def at(self, t: float) -> tuple[Array, Array, Array]:
        """Return (0, 0, a_g) at time t, each (2,)."""
        return (
            np.zeros(2),
            np.zeros(2),
            np.sum([excitation(t) for excitation in self.excitations], axis=0),
        )


@dataclass(frozen=True)
class BaseMotion(GroundFrame):
    """Hold displacement [m], velocity [m/s] and acceleration [m/s²] of the ground.

    It starts from rest at t = 0.

    ``displacement``, ``velocity`` and ``acceleration`` take points (k, d) and t and return (k, d),
    as ``fem.Prescribed`` wants them; ``at(t)`` gives the three vectors.
    """

    path: CompanionRun = field(repr=False)

    def at(self, t: float) -> tuple[Array, Array, Array]:
        """Return (u_g, v_g, a_g) at time t, each (d,)."""
        return *self.path.at(t), super().at(t)[2]

    @property
    def companions(self) -> tuple[CompanionRun, ...]:
        """Return what a run binds to its scheme and time steps."""
        return (self.path,)

    def displacement(self, points: Array, t: float) -> Array:
        """Return u_g at every point."""
        return np.tile(self.at(t)[0], (len(points), 1))

    def velocity(self, points: Array, t: float) -> Array:
        """Return v_g at every point."""
        return np.tile(self.at(t)[1], (len(points), 1))

    def acceleration(self, points: Array, t: float) -> Array:
        """Return a_g at every point."""
        return np.tile(self.at(t)[2], (len(points), 1))

    def carrying(self, surface: ContactSurface, system: SemiDiscreteSystem) -> ContactSurface:
        """Return the contact surface of ``system`` on an obstacle that moves with the ground.

        Between two deformable bodies nothing changes: both are moved by the ground.
        """
        rigid = np.array([surface.in_frames(r) for r in system.influence.T])
        # relative to the other side: see SemiDiscreteSystem.in_relative
        if surface.coupling is not None:
            rigid = np.array([2.0 * r - surface.coupling @ r for r in rigid])
        normal = np.array([surface.normal_values(r) for r in rigid])
        tangential = np.array([surface.tangential_values(r) for r in rigid])
        moved = surface.moving(
            lambda t: -self.at(t)[0] @ normal,
            lambda t: np.tensordot(self.at(t)[0], tangential, axes=1),
        )
        watched = tuple(one.carried(lambda t: self.at(t)[0]) for one in surface.watched)
        return replace(moved, companions=(*surface.companions, self.path), watched=watched)


def base_motion(excitation: Excitation | Sequence[Excitation]) -> BaseMotion:
    """Return the ground motion that the run's scheme makes of an acceleration.

    It has the run's time steps.

    Systems and surfaces that it moves hand it to the run, which binds it (``CompanionRun.bind``).
    What the acceleration leaves behind (a final velocity, a drift) is in it: correct the baseline
    of a record first (``baseline_corrected``). InputError for no excitation, or excitations of
    different dimensions.
    """
    excitations = tuple(excitation) if isinstance(excitation, Sequence) else (excitation,)
    for one in excitations:
        provides(
            "base_motion",
            "excitation",
            one,
            EXCITATION,
            "give Harmonic(…), GroundMotion(record) or another",
        )
    sizes = {len(one.direction) for one in excitations}
    if len(sizes) != 1:
        raise InputError(
            "base_motion needs one or more excitations with directions of the same number of "
            "components"
        )
    d = sizes.pop()
    forces = tuple(
        (np.asarray(one.direction, dtype=float), one.acceleration) for one in excitations
    )
    problem = linear_problem(
        sp.identity(d), None, sp.csr_matrix((d, d)), Load(np.zeros(d), forces), d
    )
    return BaseMotion(excitations, CompanionRun("base_motion", lambda: problem))
