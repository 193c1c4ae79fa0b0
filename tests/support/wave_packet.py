"""Give a packet of plane waves that travels up at an angle: initial values with a known
reflection."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np
from dashpot_reflection import dashpot_energy
from fem_problems import linear

from vi_contact import fem
from vi_contact.core.algebra import Array
from vi_contact.laws.materials import LinearElastic
from vi_contact.meshes.block import BlockMesh
from vi_contact.run.march import march


@dataclass(frozen=True)
class WavePacket:
    """Describe waves "P" or "S" around ``angle`` [rad] from the vertical, of one wavelength along
    x: ``period`` [m].

        u = sum over k_y of weight(k_y) d cos(k_x x + k_y (y - centre) - w t)
        k_x = 2 pi/period,   w = c |k|

    with d the direction of motion and Gaussian weights of standard deviation 1/length: a packet of
    about 4 ``length`` [m] in height, around the height ``centre`` [m] at t = 0.
    """

    material: LinearElastic
    wave: str
    angle: float
    period: float
    length: float
    centre: float

    @property
    def speed(self) -> float:
        """Return c_P or c_S [m/s]."""
        return self.material.c_p if self.wave == "P" else self.material.c_s

    @property
    def wavelength(self) -> float:
        """Return the wavelength of the middle of the packet in its direction of travel [m]."""
        return self.period * math.sin(self.angle)

    def _waves(self) -> tuple[Array, Array, Array]:
        """Return (k_y, weights, angles)."""
        k_x = 2.0 * math.pi / self.period
        k_y = k_x / math.tan(self.angle) + np.linspace(-4.0, 4.0, 161) / self.length
        weights = np.exp(-0.5 * np.linspace(-4.0, 4.0, 161) ** 2)
        return k_y, weights / weights.sum(), np.arctan2(k_x, k_y)

    def motion(self, points: Array, t: float = 0.0) -> tuple[Array, Array]:
        """Return (u, v) at points (n, 2), each (n, 2)."""
        k_x = 2.0 * math.pi / self.period
        u, v = np.zeros(points.shape), np.zeros(points.shape)
        for k_y, weight, angle in zip(*self._waves(), strict=True):
            w = self.speed * math.hypot(k_x, k_y)
            phase = k_x * points[:, 0] + k_y * (points[:, 1] - self.centre) - w * t
            along = np.array([math.sin(angle), math.cos(angle)])
            d = along if self.wave == "P" else np.array([along[1], -along[0]])
            u += weight * np.cos(phase)[:, None] * d
            v += weight * w * np.sin(phase)[:, None] * d
        return u, v

    def reflected(self) -> float:
        """Return the mean energy that dashpots on a horizontal boundary above send back, over the
        packet's."""
        k_y, weights, angles = self._waves()
        shares = [
            dashpot_energy(self.material, angle, wave=self.wave) if angle < 0.5 * math.pi else 1.0
            for angle in angles
        ]
        energies = weights**2 * (k_y**2 + (2.0 * math.pi / self.period) ** 2)
        return float(np.sum(energies * shares) / np.sum(energies))


def energy_sent_back(
    comm: Any, material: LinearElastic, wave: str, angle: float, *, length: float, cells: int
) -> tuple[float, float]:
    """Send a packet up a periodic strip between dashpots; return the share of energy left, and the
    theory's.

    angle [rad] from the vertical; length of the packet in wavelengths; cells per wavelength.
    Collective.
    """
    period = 1.0 / math.sin(angle)  # wavelength 1
    nx = round(cells * period)
    ny = round(12.0 * length * nx / period)
    packet = WavePacket(material, wave, angle, period, length, 5.0 * length)
    mesh, tags = fem.build_mesh(
        BlockMesh(lengths=(period, ny * period / nx), divisions=(nx, ny)), comm
    )
    system = fem.assemble(
        mesh,
        material,
        tied=fem.Tied(tags["left"], tags["right"]),
        dashpots=[fem.Dashpots(tags["top"]), fem.Dashpots(tags["bottom"])],
        initial_displacement=lambda x: packet.motion(x)[0],
        initial_velocity=lambda x: packet.motion(x)[1],
    )
    dt = 0.5 * period / nx / packet.speed
    steps = round(11.5 * length / (packet.speed * math.cos(angle)) / dt)
    ((state, _),) = deque(march(linear(system), dt=dt, steps=steps), maxlen=1)
    left = system.kinetic_energy(state.v) + system.strain_energy(state.u)
    return left / (
        system.kinetic_energy(system.v0) + system.strain_energy(system.u0)
    ), packet.reflected()
