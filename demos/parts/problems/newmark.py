"""Slide blocks and a wall under one pulse, by contact and by Newmark's equation.

    u'' = -a(t) - k_y g sgn(u')  while it slides,   u'' = 0  while it sticks and |a| <= k_y g

u [m] is the slip on the ground, a [m/s²] the acceleration of the ground. Newmark, Geotechnique 15
(1965), 139-160. A wall before its fill slides to one side only.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from mpi4py import MPI
from scipy.optimize import brentq

import vi_contact as vc
from vi_contact import fem, laws
from vi_contact.core.algebra import Array
from vi_contact.meshes.block import BlockMesh
from vi_contact.practice.ground_motion import Record

GRAVITY = 9.80665  # [m/s²]
STONE = vc.LinearElastic(E=3.0e9, nu=0.0, rho=2400.0)
MU = 0.3  # of the block
FREQUENCY = 2.0  # of the pulse [Hz]
CYCLES = 2.0
PHI = math.radians(34.0)  # of the fill, and of friction in it behind the heel
BASE = 0.5  # friction of the base of the wall
WEIGHT = 1900.0 * GRAVITY  # of the fill [N/m³]
HEIGHT = 6.0  # of wall and fill [m]
ON_BASE = (
    2500.0 * (0.5 * 5.4 + 0.6 * 4.0) + 1900.0 * 2.5 * 5.4
) * GRAVITY  # wall, fill on it [N/m]


def make_pulse(peak: float) -> laws.NearFaultPulse:
    """Return a pulse whose largest acceleration is ``peak`` [m/s²], towards +x."""
    unit = laws.NearFaultPulse(1.0, FREQUENCY, CYCLES, phase=0.5 * math.pi)
    times = np.linspace(0.0, unit.duration, 2001)
    values = np.array([unit.acceleration(t) for t in times])
    largest = float(values[np.argmax(np.abs(values))])
    return laws.NearFaultPulse(peak / largest, FREQUENCY, CYCLES, phase=0.5 * math.pi)


def make_record(pulse: laws.NearFaultPulse, dt: float, length: float) -> Record:
    """Return a pulse as a record of so many seconds [s]."""
    times = dt * np.arange(round(length / dt) + 1)
    return Record(np.array([pulse.acceleration(t) for t in times]), dt)


def slide(
    pulse: Any, times: Array, resistance: float, *, one_sided: bool = False, parts: int = 50
) -> Array:
    """Return the slip of Newmark's block at times (n,) [m], positive against the acceleration.

    In each small step the acceleration is that of its middle. The block stops where its velocity
    would change its sign, and starts where the push is more than the resistance.

    Args:
        pulse: of the ground, with ``acceleration(t)`` [m/s²].
        times: of the answer, equally spaced [s].
        resistance: k_y g [m/s²].
        one_sided: whether it slides along the positive direction only.
        parts: small steps in each step.
    """
    dt = (times[1] - times[0]) / parts
    slip = velocity = 0.0
    slips = [slip]
    for start in times[:-1]:
        for k in range(parts):
            push = pulse.acceleration(start + (k + 0.5) * dt)
            if velocity == 0.0 and (abs(push) <= resistance or (one_sided and push < 0.0)):
                continue
            way = math.copysign(1.0, velocity if velocity != 0.0 else push)
            new = velocity + dt * (push - way * resistance)
            if new * way < 0.0:  # it would turn round: it stops within the step
                new = 0.0
            slip += 0.5 * dt * (velocity + new)
            velocity = new
        slips.append(slip)
    return np.array(slips)


def slide_block(comm: MPI.Comm, ratio: float, dt: float) -> tuple[Array, Array, Array]:
    """Return times [s], slips by contact and by Newmark [m], of a block on level ground.

    Args:
        comm: the ranks.
        ratio: k_y / k_max, with k_y = mu.
        dt: step [s].
    """
    pulse = make_pulse(MU * GRAVITY / ratio)
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0, 0.25), divisions=(4, 1)), comm)
    system = vc.with_weight(fem.assemble(mesh, STONE, damping=vc.Rayleigh(alpha=0.0, beta=1.0e-4)))
    ground = vc.HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=ground)
    problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(MU), excitation=pulse)
    history = vc.simulate(
        problem,
        dt=dt,
        t_end=pulse.duration + 0.5,
        state=vc.static_equilibrium(problem),
        record=[vc.BodyMotion("block")],
        progress=False,
    ).history
    slips = history["mean_u_x_block"][0] - history["mean_u_x_block"]
    return history["t"], slips, slide(pulse, history["t"], MU * GRAVITY)


def find_resistance() -> float:
    """Return k_y of the wall with the fill on its base, by hand.

    Richards and Elms (J. Geotech. Eng. Div. 105 (1979), 449-464): k_y W + P cos(delta) = mu (W +
    P sin(delta)), with the earth pressure of Mononobe and Okabe on the plane over the heel's end,
    where fill rubs on fill, delta = phi.
    """

    def lack(k: float) -> float:
        theta = math.atan(k)
        root = math.sqrt(math.sin(2.0 * PHI) * math.sin(PHI - theta) / math.cos(PHI + theta))
        below = math.cos(theta) * math.cos(PHI + theta) * (1.0 + root) ** 2
        P = 0.5 * WEIGHT * HEIGHT**2 * math.cos(PHI - theta) ** 2 / below
        return BASE * (ON_BASE + P * math.sin(PHI)) - k * ON_BASE - P * math.cos(PHI)

    return float(brentq(lack, 0.0, 0.5))
