"""The wall of seed 000 followed over its steps: what the V4 tests compare with the reference."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from mpi4py import MPI

from demos.parts.problems.wall import Wall, WallModel, build
from vi_contact.core.algebra import Array, Mask
from vi_contact.core.problem import ContactProblem
from vi_contact.core.step import State
from vi_contact.core.verify import energy_balance
from vi_contact.laws.impact import ImpulseUpdate, Inelastic
from vi_contact.run.march import march
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed

# columns of the reference table: top of the contact side, two of its points, the opposite side
POINTS = (12, 6, 7, 26)
SCHEME = ZienkiewiczWoodTaylor(phi=0.5)


@dataclass(frozen=True)
class History:
    """Every step: u_x of POINTS and of all contact points [m], contact sets, energies and losses
    [J], iterations."""

    u: Array
    contact: Array
    active: Mask
    energy: Array
    losses: dict[str, float]
    energy_steps: Array
    iterations: Array
    certificate: float
    state: State


@cache
def model(wall: Wall = Wall(), *, alone: bool = False) -> WallModel:
    """The wall by the catalogue's convention, on all ranks together or on this rank alone."""
    return build(wall, MPI.COMM_SELF if alone else MPI.COMM_WORLD, base_inertia="catalogue")


def problem(case: str, *, reading: Any = None, a0: float = 1.0, **one: Any) -> ContactProblem:
    one = model(**one)
    impact = Inelastic() if reading is None else Inelastic(reading)
    return one.problem(case, excitation=one.harmonic(a0), impact=impact)


def follow(
    given: ContactProblem,
    *,
    steps: int = 400,
    dt: float,
    solver: Any = None,
    state: State | None = None,
) -> History:
    system = given.equations
    space = given.system.space
    nodes = space.find_nodes(np.array([Wall().point(number) for number in POINTS]))
    names = ("input", "damping", "contact", "algorithmic", "defect")
    losses = dict.fromkeys((*names, "impact"), 0.0)
    rows, sets, energy, changes, iterations, worst = [], [], [], [], [], 0.0
    for new, report in march(
        given, scheme=SCHEME, solver=solver or Condensed(), dt=dt, steps=steps, state=state
    ):
        free = State(new.t, new.k, new.u, report.v_minus, new.r_n, new.active)
        step = energy_balance(given, report.old, free, report.balance)
        for name in names:
            losses[name] += getattr(step, name)
        impact = system.kinetic_energy(report.v_minus) - system.kinetic_energy(new.v)
        losses["impact"] += impact
        changes.append((impact, step.contact, step.change - impact))
        energy.append(system.kinetic_energy(new.v) + system.strain_energy(new.u))
        u = space.sample(given.cartesian(new.u), nodes, new.t)[:, 0]
        rows.append((u, given.surface.everywhere(given.surface.normal_values(new.u))))
        sets.append(given.surface.everywhere(new.active))
        iterations.append(report.result.iterations)
        worst = max(worst, report.certificate.worst)
    u, contact = (np.array(column) for column in zip(*rows, strict=True))
    return History(
        u,
        contact,
        np.array(sets),
        np.array(energy),
        losses,
        np.array(changes),
        np.array(iterations),
        worst,
        new,
    )


@cache
def history(case: str, *, projection: bool = False, **one: Any) -> History:
    reading = ImpulseUpdate() if projection else None
    return follow(problem(case, reading=reading, **one), dt=model(**one).time_step())
