#!/usr/bin/env python3
"""Shake a block by near-fault pulses of several frequencies, and see how far it slides.

A stiff block lies on level ground with Coulomb friction. The pulses have the same velocity. One
that is slow against mu g does not move the block; one that is fast pushes it back and forth. What
stays is compared with Newmark's rigid block (Geotechnique 15, 1965), integrated in small steps:

    u'' = -a(t) - mu g sgn(u')  while it slides,    u'' = 0  while it sticks and |a| <= mu g

    bash demos/run.sh near_fault                # a table
    bash demos/run.sh -n 2 near_fault           # the same on two ranks
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem, laws, meshes
from vi_contact.practice.cli import status_of

# Parameters
# --------------------------------------------------------------------------------------------------
LENGTHS = (1.0, 0.5)  # of the block [m]
STONE = vc.LinearElastic(E=3.0e9, nu=0.0, rho=2400.0)
GRAVITY = 9.81  # [m/s²]
MU = 0.3
VELOCITY = 1.2  # of the pulses [m/s]
CYCLES = 1.5
FREQUENCIES = (0.3, 0.6, 1.0, 2.0)  # [Hz]
DT = 2.0e-3  # [s]


def shaken(comm: MPI.Comm, pulse: laws.NearFaultPulse) -> float:
    """Return how far the centre of the block has moved on the ground when all is over [m]."""
    mesh, tags = fem.build_mesh(meshes.BlockMesh(lengths=LENGTHS, divisions=(4, 2)), comm)
    system = fem.assemble(
        mesh,
        STONE,
        section=vc.PlaneStress(1.0),
        damping=vc.Rayleigh(alpha=0.0, beta=1.0e-4),
        loads=fem.BodyForce((0.0, -STONE.rho * GRAVITY)),
    )
    ground = vc.HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=ground)
    problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(MU), excitation=pulse)
    history = vc.simulate(
        problem,
        scheme=vc.MoreauJean(),
        solver=vc.Condensed(),
        dt=DT,
        t_end=rest(pulse),
        state=vc.static_equilibrium(problem),
        record=[vc.Probe({"centre": (0.5 * LENGTHS[0], 0.5 * LENGTHS[1])})],
        progress=False,
    ).history
    return float(history["u_x_centre"][-1] - history["u_x_centre"][0])


def rest(pulse: laws.NearFaultPulse) -> float:
    """Return a time at which a block that slides has stopped [s]: v = mu g t after the pulse."""
    return pulse.duration + 2.0 * VELOCITY / (MU * GRAVITY)


def newmark(pulse: laws.NearFaultPulse, steps: int = 20_000) -> float:
    """Return how far the rigid block has moved on the ground in the end [m].

    In each small step the acceleration is that of its middle; the block stops where its velocity
    would change its sign, and starts where |a| exceeds mu g.
    """
    dt = rest(pulse) / steps
    most = MU * GRAVITY
    u = 0.0
    v = 0.0
    for k in range(steps):
        push = -pulse.acceleration((k + 0.5) * dt)
        if v == 0.0 and abs(push) <= most:
            continue
        way = math.copysign(1.0, v if v != 0.0 else push)
        new = v + dt * (push - way * most)
        if new * way < 0.0:  # it would turn round: it stops within the step
            new = 0.0
        u += 0.5 * dt * (v + new)
        v = new
    return u


def main() -> dict[float, tuple[float, float]]:
    """Print a table; return (computed, rigid) slips that stay [m] for each frequency [Hz]."""
    comm = MPI.COMM_WORLD
    slips = {}
    if comm.rank == 0:
        print("frequency [Hz]   largest a / mu g   slip that stays [m]   of the rigid block [m]")
    for frequency in FREQUENCIES:
        pulse = laws.NearFaultPulse(VELOCITY, frequency, CYCLES)
        peak = max(abs(pulse.acceleration(k / 1000 * pulse.duration)) for k in range(1001))
        slips[frequency] = shaken(comm, pulse), newmark(pulse)
        if comm.rank == 0:
            computed, rigid = slips[frequency]
            print(f"{frequency:14.1f} {peak / (MU * GRAVITY):18.3f} {computed:21.4f} {rigid:24.4f}")
    return slips


# Things to try: phase=math.pi / 2 gives an odd pulse; CYCLES = 3 one that swings more often.
if __name__ == "__main__":
    raise SystemExit(status_of(main))
