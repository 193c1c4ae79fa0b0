"""Pose beams, frames and plates in unilateral contact.

Each stands beside what is known of it in closed form.

Frames are scipy matrices (``frame_elements``), plates a form of DOLFINx (``plates``); SI units.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import vi_contact as vc
from demos.parts.exact.structures import (
    DiskOnGround,
    LiftedBeam,
    clamped_disk,
    disk_on_ground,
    square_plate,
)
from vi_contact.core.algebra import Array
from vi_contact.core.problem import ContactProblem
from vi_contact.core.step import State

from .frame_elements import frame, line
from .plates import Plate, disk_mesh, plate_system, square_mesh

SECTION = {"EA": 4.0e8, "EI": 2.0e6, "rho_A": 80.0}  # of all beams: N, N m², kg/m
HEIGHT = 3.0  # of the frame [m]
ARM = 1.5  # of the frame [m]
END_LOAD = (2.0e4, -8.0e4)  # of the frame [N]
HEAVY = LiftedBeam(EI=SECTION["EI"], q=800.0, P=2600.0)
HEAVY_LENGTH, TIP_LENGTH = 10.0, 4.0  # [m]
PLATE = Plate()
SIDE = 2.0  # of the square, and diameter of the disk [m]
PRESSURE = 1000.0  # [Pa]
CANTILEVER = 1.8751040687119611  # root of cos z cosh z = -1


def frame_on_a_stop(gap: float, normal: tuple[float, float]) -> ContactProblem:
    """Return a clamped column with an arm, held by a stop.

    It is loaded at its end, which a stop in this direction [m] holds.
    """
    nodes = np.concatenate(
        [line([0.0, 0.0], [0.0, HEIGHT], 6), line([0.0, HEIGHT], [ARM, HEIGHT], 3)[1:]]
    )
    load = np.zeros(3 * len(nodes))
    load[-3:-1] = END_LOAD
    members = [(i, i + 1) for i in range(len(nodes) - 1)]
    system = vc.system_from_arrays(**frame(nodes, members, **SECTION), clamped=[0, 1, 2], load=load)
    return vc.ContactProblem(system, vc.contact_points(system, [len(nodes) - 1], normal, gap0=gap))


def heavy_beam(count: int) -> ContactProblem:
    """Return a beam of so many elements on the ground.

    Its left end is pulled up; its weight acts at the nodes. Its right end is clamped at the height
    of the ground, on which it lies there anyway.
    """
    h = HEAVY_LENGTH / count
    parts = frame(
        line([0.0, 0.0], [HEAVY_LENGTH, 0.0], count), [(i, i + 1) for i in range(count)], **SECTION
    )
    load = np.zeros((count + 1, 3))
    load[:, 1] = -HEAVY.q * h
    load[[0, -1], 1] *= 0.5
    load[0, 1] += HEAVY.P
    system = vc.system_from_arrays(**parts, clamped=3 * count + np.arange(3), load=load.ravel())
    return vc.ContactProblem(system, vc.contact_points(system, np.arange(count), [0.0, -1.0]))


def thrown_beam(count: int, gap: float, speed: float) -> tuple[ContactProblem, float]:
    """Return a cantilever that swings in its first mode.

    Its tip goes at this speed [m/s] towards a stop. With it comes the time [s] at which it touches;
    tip = speed/omega sin omega t until then.
    """
    x = np.linspace(0.0, TIP_LENGTH, count + 1)
    z = CANTILEVER / TIP_LENGTH
    ratio = (np.cosh(CANTILEVER) + np.cos(CANTILEVER)) / (np.sinh(CANTILEVER) + np.sin(CANTILEVER))
    mode = np.cosh(z * x) - np.cos(z * x) - ratio * (np.sinh(z * x) - np.sin(z * x))
    slope = z * (np.sinh(z * x) + np.sin(z * x) - ratio * (np.cosh(z * x) - np.cos(z * x)))
    v0 = -speed * np.column_stack([np.zeros(count + 1), mode, slope]) / mode[-1]
    parts = frame(
        line([0.0, 0.0], [TIP_LENGTH, 0.0], count), [(i, i + 1) for i in range(count)], **SECTION
    )
    system = vc.system_from_arrays(**parts, clamped=[0, 1, 2], v0=v0.ravel())
    surface = vc.contact_points(system, [count], [0.0, -1.0], gap0=gap)
    omega = z**2 * float(np.sqrt(SECTION["EI"] / SECTION["rho_A"]))
    problem = vc.ContactProblem(system, surface, mass=vc.ConsistentMass())
    return problem, float(np.arcsin(gap * omega / speed)) / omega


def plate_on_a_stop(
    comm: Any, disk: bool, cells: int, share: float
) -> tuple[ContactProblem, float]:
    """Return a plate under PRESSURE above a stop at its middle, and its exact force [N].

    The plate is a clamped disk or a simply supported square; the force is that of the stop;
    ``share`` is that of the free deflection, at which the stop is.
    """
    size = 0.5 * SIDE if disk else SIDE
    load, force = clamped_disk() if disk else square_plate()
    on = disk_mesh(comm, size, cells) if disk else square_mesh(comm, size, cells)
    system = plate_system(on, PLATE, clamped=disk, pressure=PRESSURE)
    w0 = load * PRESSURE * size**4 / PLATE.D
    middle = system.space.find_nodes(np.zeros((1, 3)))
    surface = vc.contact_points(system, middle, [0.0, 0.0, -1.0], gap0=share * w0)
    return vc.ContactProblem(system, surface), (1.0 - share) * w0 / (force * size**2 / PLATE.D)


def disk_above_ground(comm: Any, cells: int, share: float) -> tuple[ContactProblem, DiskOnGround]:
    """Return a clamped disk under PRESSURE above flat ground.

    There are conditions at the vertices of its triangles. With it comes its closed form in units of
    the radius; ``share`` is that of the free deflection, at which the ground is.
    """
    radius = 0.5 * SIDE
    known = disk_on_ground(share / 64.0)
    on = disk_mesh(comm, radius, cells)
    system = plate_system(on, PLATE, clamped=True, pressure=PRESSURE)
    own = on.geometry.x[np.hypot(*on.geometry.x[:, :2].T) < 0.99 * radius]
    # those on two ranks once
    vertices = np.unique(np.round(np.concatenate(comm.allgather(own)), 12), axis=0)
    gap = known.gap * PRESSURE * radius**4 / PLATE.D
    return vc.ContactProblem(
        system,
        vc.contact_points(system, system.space.find_nodes(vertices), [0.0, 0.0, -1.0], gap0=gap),
    ), known


def thrown_plate(comm: Any, cells: int, gap: float, speed: float) -> tuple[ContactProblem, float]:
    """Return a simply supported square that swings in its first mode.

    Its middle goes at this speed [m/s] towards a stop. With it comes the time [s] at which it
    touches.
    """

    def mode(x: Array) -> Array:
        return np.asarray(-speed * np.cos(np.pi * x[:, 0] / SIDE) * np.cos(np.pi * x[:, 1] / SIDE))

    system = plate_system(square_mesh(comm, SIDE, cells), PLATE, clamped=False, speed=mode)
    middle = system.space.find_nodes(np.zeros((1, 3)))
    surface = vc.contact_points(system, middle, [0.0, 0.0, -1.0], gap0=gap)
    omega = 2.0 * np.pi**2 / SIDE**2 * float(np.sqrt(PLATE.D / PLATE.mass))
    problem = vc.ContactProblem(system, surface, mass=vc.ConsistentMass())
    return problem, float(np.arcsin(gap * omega / speed)) / omega


def residual(problem: ContactProblem, state: State) -> float:
    """Return how far a state is from equilibrium in contact.

    It uses sums of its own: the largest of the force that is out of balance and of pull, over the
    largest force, and of penetration, over the largest displacement; the largest of reaction times
    gap over both. Collective.
    """
    system = problem.static_load
    surface = problem.surface
    comm = problem.system.algebra.comm
    load = system.load.at_rest(state.t)
    off = system.K @ state.u - load + surface.reaction_load(state.r_n, system.K.rows)
    left = surface.gap(state.t) - surface.normal_values(state.u)
    arrays = (load, state.r_n, state.u, off, -state.r_n, -left, np.abs(state.r_n * left))
    largest = [
        float(np.max(one, initial=0.0))
        for one in (
            np.abs(arrays[0]),
            *arrays[1:2],
            np.abs(arrays[2]),
            np.abs(arrays[3]),
            *arrays[4:],
        )
    ]
    f, r, u, balance, pull, deep, both = comm.max(np.array(largest)).tolist()
    return float(max(balance / max(f, r), pull / max(f, r), deep / u, both / (max(f, r) * u)))
