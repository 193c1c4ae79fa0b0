"""Integrate the motion (u, v, a) of a base that an acceleration shakes, by the run's own scheme.

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
        acceleration = np.sum([excitation(t) for excitation in self.excitations], axis=0)
        return np.zeros(2), np.zeros(2), acceleration


@dataclass(frozen=True)
class BaseMotion(GroundFrame):
    """Hold the motion of the ground from rest at t = 0, in m, m/s and m/s².

    ``displacement``, ``velocity`` and ``acceleration`` take points (k, d) and t and return (k, d),
    as ``fem.Prescribed`` wants them; ``at(t)`` gives the three vectors.
    """

    path: CompanionRun = field(repr=False)

    def at(self, t: float) -> tuple[Array, Array, Array]:
        """Return (u_g, v_g, a_g) at time t, each (d,)."""
        u, v = self.path.at(t)
        _, _, a = super().at(t)
        return u, v, a

    @property
    def companions(self) -> tuple[CompanionRun, ...]:
        """Return what a run binds to its scheme and time steps."""
        return (self.path,)

    def displacement(self, points: Array, t: float) -> Array:
        """Return u_g at every point."""
        u, _, _ = self.at(t)
        return np.tile(u, (len(points), 1))

    def velocity(self, points: Array, t: float) -> Array:
        """Return v_g at every point."""
        _, v, _ = self.at(t)
        return np.tile(v, (len(points), 1))

    def acceleration(self, points: Array, t: float) -> Array:
        """Return a_g at every point."""
        _, _, a = self.at(t)
        return np.tile(a, (len(points), 1))

    def carrying(self, surface: ContactSurface, system: SemiDiscreteSystem) -> ContactSurface:
        """Return the contact surface of ``system`` on an obstacle that moves with the ground.

        Between two deformable bodies nothing changes: both are moved by the ground.
        """
        # What the conditions see of a rigid motion of the ground, along each axis. Where both sides
        # deform, it is relative to the other side: see SemiDiscreteSystem.in_relative.
        rigid = np.array([surface.in_frames(r) for r in system.influence.T])
        if surface.coupling is not None:
            rigid = np.array([2.0 * r - surface.coupling @ r for r in rigid])
        normal = np.array([surface.normal_values(r) for r in rigid])
        tangential = np.array([surface.tangential_values(r) for r in rigid])

        def ground(t: float) -> Array:
            """Return the displacement of the ground (d,) [m]."""
            u, _, _ = self.at(t)
            return u

        moved = surface.moving(
            lambda t: -ground(t) @ normal,
            lambda t: np.tensordot(ground(t), tangential, axes=1),
        )
        watched = tuple(nodes.carry(ground) for nodes in surface.watched)
        return replace(moved, companions=(*surface.companions, self.path), watched=watched)


def base_motion(excitation: Excitation | Sequence[Excitation]) -> BaseMotion:
    """Return the ground motion that the run's scheme and time steps make of an acceleration.

    Systems and surfaces that it moves hand it to the run, which binds it (``CompanionRun.bind``).
    What the acceleration leaves behind (a final velocity, a drift) is in it: correct the baseline
    of a record first (``baseline_corrected``).

    Raises:
        InputError: no excitation, or excitations of different dimensions.
    """
    excitations = tuple(excitation) if isinstance(excitation, Sequence) else (excitation,)
    remedy = "give Harmonic(…), GroundMotion(record) or another"
    for one_excitation in excitations:
        provides("base_motion", "excitation", one_excitation, EXCITATION, remedy)
    sizes = {len(one_excitation.direction) for one_excitation in excitations}
    if len(sizes) != 1:
        raise InputError(
            "base_motion needs one or more excitations with directions of the same number of "
            "components"
        )
    d = sizes.pop()

    # A free unit mass under the force a_g.
    forces = []
    for one_excitation in excitations:
        direction = np.asarray(one_excitation.direction, dtype=float)
        forces.append((direction, one_excitation.acceleration))
    load = Load(np.zeros(d), tuple(forces))
    problem = linear_problem(sp.identity(d), None, sp.csr_matrix((d, d)), load, d)
    return BaseMotion(excitations, CompanionRun("base_motion", lambda: problem))
