"""Problems with joints that tests march: a mass that a spring tears off, a slider, a strip."""

from __future__ import annotations

from typing import Any

import numpy as np

import vi_contact as vc
from vi_contact import laws

MASS, STIFF, STRENGTH, SPEED = 1000.0, 1e6, 2000.0, 0.1  # kg, N/m, N, m/s of the spring's end
SLIDER: dict[str, float] = {"a": 0.01, "b": 0.015, "mu0": 0.6, "V0": 1e-6, "dc": 1e-5}
PRESSURE = 5e6  # Pa on the slider
CRITICAL = PRESSURE * (SLIDER["b"] - SLIDER["a"]) / SLIDER["dc"]  # N/m


def torn_mass(**joint: Any) -> vc.ContactProblem:
    """A mass on a joint, torn off by a spring whose end moves away at SPEED."""
    system = vc.system_from_arrays(
        np.array([MASS]), None, np.array([[STIFF]]), coordinates=[[0.0]]
    ).with_load((np.array([STIFF * SPEED]), lambda t: t))
    surface = vc.contact_points(system, [0], [[-1.0]])
    law = laws.Joint(tension=STRENGTH / surface.weights[0], **joint)
    return vc.ContactProblem(system, surface, joint=law)


def slider(k: float, load_speed: float, start: float, law: str) -> tuple[Any, vc.State]:
    """A block on rate-and-state friction, pulled by a spring [N/m] whose end moves at a speed
    [m/s]; and its state of steady slip at ``start`` [m/s]."""
    steady = SLIDER["mu0"] + (SLIDER["a"] - SLIDER["b"]) * np.log(start / SLIDER["V0"])
    system = vc.system_from_arrays(
        np.array([1000.0, 1000.0]), None, np.diag([k, 1e12]), coordinates=[[0.0, 0.0]]
    ).with_load(
        (np.array([0.0, -PRESSURE]), lambda t: 1.0), (np.array([k * load_speed, 0.0]), lambda t: t)
    )
    surface = vc.contact_points(system, [0], [[0.0, -1.0]])
    joint = laws.RateAndState(**SLIDER, law=law, theta=SLIDER["dc"] / start, speed=start)
    problem = vc.ContactProblem(system, surface, joint=joint, mass=vc.ConsistentMass())
    state = vc.State(
        t=0.0,
        k=0,
        u=surface.in_frames(np.array([-PRESSURE * steady / k, 0.0])),
        v=surface.in_frames(np.array([start, 0.0])),
        r_n=np.array([PRESSURE]),
        active=np.ones(1, dtype=bool),
        r_t=np.zeros((1, 1)),
    )
    return problem, state


def strip(elements: int, softening: str) -> tuple[Any, Any]:
    """A strip of Hermite beam elements, bound to a rigid plane by 1e5 Pa and 0.1 mm, whose end is
    pulled away by a stiff spring to t metres; and a function (state, t) -> (w, P) of the end."""
    EI, width, stress, opening, length, spring = 2000.0, 0.1, 1e5, 1e-4, 1.35, 1e7
    h = length / elements
    one = [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h]]
    one += [[-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]
    K = np.zeros((2 * elements + 2, 2 * elements + 2))
    for element in range(elements):
        places = np.arange(2 * element, 2 * element + 4)
        K[np.ix_(places, places)] += EI / h**3 * np.array(one)
    K[2 * elements, 2 * elements] += spring
    unknowns = [[j // 2, 1 if j % 2 == 0 else -1] for j in range(2 * elements + 2)]
    x = np.linspace(0.0, length, elements + 1)
    system = vc.system_from_arrays(
        np.ones(len(K)),
        None,
        K,
        coordinates=np.column_stack([x, 0.0 * x]),
        unknowns=np.array(unknowns),
        clamped=[0, 1],
    )
    end = 2 * elements - 2
    pull = np.zeros(system.rows)
    pull[end] = spring
    system = system.with_load((pull, lambda t: t))
    nodes = np.arange(1, elements)
    surface = vc.contact_points(system, nodes, [[0.0, -1.0]] * len(nodes))
    tension = tuple(stress * width * h / surface.weights)
    joint = laws.Joint(tension=tension, opening=opening, softening=softening)
    problem = vc.ContactProblem(system, surface, joint=joint)

    def measure(state: vc.State, t: float) -> tuple[float, float]:
        w = float(problem.cartesian(state.u)[end])
        return w, spring * (t - w)

    return problem, measure
