"""The buried channel of V4.2 followed over its steps: what its tests look at."""

from __future__ import annotations

from functools import cache
from typing import Any

from mpi4py import MPI

import vi_contact as vc
from demos.parts.problems.channel import Channel, ChannelModel, build
from vi_contact.run.simulate import Solution
from vi_contact.soil.moving_base import base_motion

SCHEME = vc.ZienkiewiczWoodTaylor(phi=0.5)
CHANNEL = Channel()
DT = CHANNEL.time_step()
FRICTION = vc.Coulomb(0.4)
EXACT = 1e-12


@cache
def model(*, alone: bool = False, weighing: tuple[str, ...] = ("channel",)) -> ChannelModel:
    """The channel of V4.2 on all ranks together, or on this rank alone."""
    return build(CHANNEL, MPI.COMM_SELF if alone else MPI.COMM_WORLD, weighing=weighing)


def follow(one: ChannelModel, problem: vc.ContactProblem, steps: int, **more: Any) -> Solution:
    """From rest under the weight on, with everything that the model records."""
    solver = vc.Condensed()
    start = vc.static_equilibrium(problem, solver=solver)
    more = {"scheme": SCHEME, "dt": DT, "state": start, "progress": False} | more
    return vc.simulate(problem, solver=solver, steps=steps, record=one.recorders(), **more)


@cache
def shaken(contact: str, *, steps: int = 400, amplitude: float = 2.0) -> Solution:
    """The seed's harmonic; ``contact``: sliding, rubbing or bilateral."""
    one = model()
    friction = FRICTION if contact == "rubbing" else None
    problem = one.problem(
        friction=friction, bilateral=contact == "bilateral", excitation=CHANNEL.harmonic(amplitude)
    )
    return follow(one, problem, steps)


def moved(excitation: Any, steps: int, *, friction: Any = None) -> Solution:
    """With a moved bedrock, in the frame of an observer at rest."""
    one = build(CHANNEL, MPI.COMM_WORLD, base=base_motion(excitation))
    return follow(one, one.problem(friction=friction, excitation=()), steps)
