"""Squeeze a cube of metal, throw a column of it on its foot, and press a plate of soil."""

from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem, schemes
from vi_contact.core.surfaces import empty_surface
from vi_contact.laws import J2, ConsistentMass, MohrCoulomb
from vi_contact.meshes.block import BlockMesh
from vi_contact.validation import Data, Found, Inputs

UNITS = {
    "E": "Pa",
    "nu": "-",
    "rho": "kg/m³",
    "yield_stress": "Pa",
    "hardening": "Pa",
    "hardening_factor": "-",
    "strain": "-",
    "length": "m",
    "speed": "m/s",
    "end_weight": "-",
    "soil_E": "Pa",
    "soil_nu": "-",
    "cohesion": "Pa",
    "phi": "°",
    "psi": "°",
    "cell": "Pa",
}
STEPS = {"smallest": 40, "coarse": 80, "fine": 160}  # while the column is pressed together
CELLS = {"smallest": (1, 2), "coarse": (2, 4), "fine": (4, 8)}  # of the plate
PRESSED = (0.002, 0.004, 0.006, 0.008)  # ways of the press [m]
SOIL_RHO = 2000.0  # kg/m³; the plate stands still


def figures(inputs: Inputs, fineness: str) -> Found:
    """Return the stresses, the way of the column, and the dilatancy of the soil.

    Args:
        inputs: of the materials, and what is done to them.
        fineness: which of ``STEPS`` and ``CELLS``.
    """
    found = Found()
    metal = J2(
        inputs["E"],
        inputs["nu"],
        inputs["rho"],
        inputs["yield_stress"],
        isotropic=inputs["hardening_factor"] * inputs["hardening"],
    )
    found.figures["stress of the squeezed cube"] = squeeze(found, metal, inputs["strain"])
    way = throw(found, metal, inputs, STEPS[fineness])
    found.figures["largest way of the thrown column"] = way
    stress, dilatancy = press(found, inputs, CELLS[fineness])
    found.figures["stress of the pressed plate"] = stress
    found.figures["dilatancy of the pressed plate"] = dilatancy
    return found


def squeeze(found: Found, metal: J2, strain: float) -> float:
    """Return the stress [Pa] of a cube of one metre under a smooth press.

    Args:
        found: takes the certificates.
        metal: of the cube.
        strain: of its height, as it is pressed.
    """
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0,) * 3, divisions=(1, 1, 1)), MPI.COMM_WORLD)
    held = [(tags["left"], 0), (tags["bottom"], 1), (tags["back"], 2)]
    smooth = [fem.Prescribed(side, components=(k,)) for side, k in held]
    system = fem.assemble(mesh, metal, integration="bbar", prescribed=smooth)
    plate = vc.HalfSpace(point=(0.0, 0.0, 1.0), normal=(0.0, 0.0, -1.0))
    surface = fem.contact_surface(system, tags["front"], obstacle=plate)
    problem = vc.ContactProblem(system, surface.moving(towards=lambda t: t))
    (state,) = vc.quasi_static(problem, [strain])
    found.add_equilibrium(problem, state)
    return float(surface.everywhere(state.r_n).sum())


def throw(found: Found, metal: J2, inputs: Inputs, steps: int) -> float:
    """Return the largest way down [m] of the top of a column that is thrown on its foot.

    Args:
        found: takes the run and its history.
        metal: of the column.
        inputs: its length and speed, and the weight of the force at the end of a step.
        steps: of the way down, about.
    """
    length = inputs["length"]
    mesh, tags = fem.build_mesh(
        BlockMesh(lengths=(length, length), divisions=(1, 1)), MPI.COMM_WORLD
    )
    smooth = [fem.Prescribed(tags[side], components=(0,)) for side in ("left", "right")]
    speed = inputs["speed"]
    system = fem.assemble(
        mesh,
        metal,
        integration="bbar",
        prescribed=[*smooth, fem.Prescribed(tags["bottom"])],
        initial_velocity=lambda x: np.stack([0.0 * x[:, 0], -speed * x[:, 1] / length], axis=1),
    )
    surface = empty_surface(system.algebra.comm, 2)
    problem = vc.ContactProblem(system, surface, mass=ConsistentMass())
    quarter = 0.5 * np.pi * length / (np.sqrt(3.0) * metal.elastic.c_p)
    solution = vc.simulate(
        problem,
        scheme=schemes.ZienkiewiczWoodTaylor(inputs["end_weight"]),
        dt=quarter / steps,
        steps=2 * steps,
        record=[vc.Energy(), vc.Probe({"top": (0.5 * length, length)})],
        progress=False,
    )
    found.add_run(solution)
    history = solution.history
    down = -history["u_y_top"]
    found.curves["column"] = (history["t"], down)

    # the turn is between two steps, on the parabola through three
    k = int(np.argmax(down))
    before, top, after = down[k - 1 : k + 2]
    return float(top + (after - before) ** 2 / (8.0 * (2.0 * top - before - after)))


def press(found: Found, inputs: Inputs, cells: tuple[int, int]) -> tuple[float, float]:
    """Return the stress [Pa] under a press, and the growth of volume over what is pressed.

    Args:
        found: takes the certificates.
        inputs: of the soil and its cell pressure.
        cells: of the plate, across and along.
    """
    soil = MohrCoulomb(
        inputs["soil_E"],
        inputs["soil_nu"],
        SOIL_RHO,
        inputs["cohesion"],
        inputs["phi"],
        inputs["psi"],
    )
    cell = inputs["cell"]
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0, 2.0), divisions=cells), MPI.COMM_WORLD)
    system = fem.assemble(
        mesh,
        soil,
        integration="bbar",
        initial_stress=lambda x: np.tile([-cell, -cell, -cell, 0.0], (len(x), 1)),
        prescribed=[
            fem.Prescribed(tags["bottom"], components=(1,)),
            fem.Prescribed(tags["left"], components=(0,)),
        ],
        loads=fem.Pressure(tags["right"], cell),
    )
    plate = vc.HalfSpace(point=(0.0, 2.0), normal=(0.0, -1.0))
    surface = fem.contact_surface(system, tags["top"], obstacle=plate)
    problem = vc.ContactProblem(system, surface.moving(towards=lambda t: t))
    space: Any = system.space
    wide: list[float] = []
    for state in vc.quasi_static(problem, PRESSED):
        found.add_equilibrium(problem, state)
        moved = space.expand(problem.cartesian(state.u), 0.0)
        wide.append(float(moved[:, 0].max()))
    strain = 0.5 * (PRESSED[-1] - PRESSED[-2])
    grown = (wide[-1] - wide[-2]) - strain
    return float(surface.everywhere(state.r_n).sum()), grown / strain


def draw(found: Found, data: Data, path: Path) -> None:
    """Draw the way of the column over the time, and its largest by the closed form.

    Args:
        found: what ``figures`` returned.
        data: the numbers of the source.
        path: of the picture.
    """
    from vi_contact.validation.pictures import canvas, save

    figure, axes = canvas(1, 1, (5.0, 3.2))
    axis: Any = axes[0, 0]
    t, down = found.curves["column"]
    axis.plot(1e6 * t, 1e3 * down, color="black", label="computed")
    axis.axhline(1e3 * float(data.rows[0]["way"]), color="0.6", label="closed form")
    axis.set_xlabel("time [µs]")
    axis.set_ylabel("way of the top [mm]")
    axis.legend()
    save(figure, path)
