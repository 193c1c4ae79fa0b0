"""Slide elastic columns down a slope: finite elements, and base slip with one mode."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem, meshes, schemes
from vi_contact.validation import Data, Found, Inputs

UNITS = {
    "gravity": "m/s²",
    "record": "",
    "peak": "g",
    "ky": "g",
    "wave_speed": "m/s",
    "damping": "-",
    "stiffer": "-",
    "angle": "°",
    "mu_factor": "-",
    "normal_sense": "-",
    "H": "m",
    "sense": "name",
}
CENTI = 1e-2
DENSITY = 2000.0  # kg/m³; slips do not depend on it
NU = 0.3  # of the column; nor on it: nothing moves along its axis but its weight
CELLS = {"smallest": 8, "coarse": 16, "fine": 32}  # along the column
DT = {"smallest": 0.02, "coarse": 0.01, "fine": 0.005}  # s; that of the record is 0.01
END = {"smallest": 10.5, "coarse": 20.0, "fine": math.inf}  # s; what is later adds 0.1 % at most


def figures(inputs: Inputs, fineness: str) -> Found:
    """Return the slip [cm] of every row, by both models.

    Args:
        inputs: the column, its slope and its record; rows of heights and senses.
        fineness: a key of ``CELLS``.
    """
    found = Found()
    assert inputs.records is not None
    record = vc.read_record(inputs.records / f"{inputs['record']}.csv", "g")
    record = vc.ground_motion.scaled_to_pga(record, inputs["peak"] * inputs["gravity"])
    end = min(record.duration, END[fineness])
    record = vc.ground_motion.trimmed(record, 0.0, end)
    if DT[fineness] > record.dt:
        record = vc.ground_motion.resampled(record, DT[fineness])
    models = {"finite elements": build_column, "base slip and one mode": build_mode}
    for row in inputs.rows:
        side = inputs["normal_sense"] * {"normal": 1.0, "inverse": -1.0}[row["sense"]]
        motion = vc.GroundMotion(record, direction=(1.0, 0.0), scale=side)
        for words, build in models.items():
            problem = build(inputs, row["H"], motion, CELLS[fineness])
            name = f"{words}, H {row['H']:g} m, {row['sense']}"
            slip = slide(found, problem, motion, name, DT[fineness])
            found.figures[name] = slip / CENTI
    return found


def find_mu(inputs: Inputs) -> Any:
    """Return the law of friction whose yield acceleration downhill is ky."""
    angle = math.radians(inputs["angle"])
    mu = inputs["mu_factor"] * (inputs["ky"] + math.sin(angle)) / math.cos(angle)
    return vc.Coulomb(mu) if mu > 0.0 else vc.Frictionless()


def build_column(
    inputs: Inputs, height: float, motion: vc.GroundMotion, cells: int
) -> vc.ContactProblem:
    """Return the column of finite elements.

    Args:
        inputs: of the entry.
        height: of the column [m].
        motion: of the ground along the slope.
        cells: along the column.
    """
    angle = math.radians(inputs["angle"])
    width = height / cells
    block = meshes.BlockMesh(lengths=(width, height), divisions=(1, cells))
    mesh, tags = fem.build_mesh(block, MPI.COMM_WORLD)
    speed = inputs["wave_speed"] * math.sqrt(inputs["stiffer"])
    shear = DENSITY * speed**2
    frequency = 0.5 * math.pi * speed / height
    weight = DENSITY * inputs["gravity"]
    beta = 2.0 * inputs["damping"] / frequency
    system = fem.assemble(
        mesh,
        vc.LinearElastic(E=2.0 * (1.0 + NU) * shear, nu=NU, rho=DENSITY),
        damping=vc.Rayleigh(alpha=0.0, beta=beta) if beta > 0.0 else vc.NoDamping(),
        tied=fem.Tied(tags["left"], tags["right"]),
        loads=fem.BodyForce((weight * math.sin(angle), -weight * math.cos(angle))),
    )
    slope = vc.HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=slope)
    return vc.ContactProblem(system, surface, friction=find_mu(inputs), excitation=motion)


def build_mode(
    inputs: Inputs, height: float, motion: vc.GroundMotion, cells: int
) -> vc.ContactProblem:
    """Return base slip and one mode, for a column of one square metre.

    Args:
        inputs: of the entry.
        height: of the column [m].
        motion: of the ground along the slope.
        cells: is not read: the mode has no mesh.
    """
    # shares of the mass in the shape sin(pi z / 2 H): of the whole, of its mean, of its square
    mass = DENSITY * height
    mean = 2.0 * mass / math.pi
    modal = 0.5 * mass
    speed = inputs["wave_speed"] * math.sqrt(inputs["stiffer"])
    frequency = 0.5 * math.pi * speed / height

    # unknowns: slip of the base along the slope and away from it, and the mode
    M = [[mass, 0.0, mean], [0.0, mass, 0.0], [mean, 0.0, modal]]
    C = np.diag([0.0, 0.0, 2.0 * inputs["damping"] * frequency * modal])
    K = np.diag([0.0, 0.0, frequency**2 * modal])
    angle = math.radians(inputs["angle"])
    along = inputs["gravity"] * math.sin(angle)
    across = inputs["gravity"] * math.cos(angle)
    system = vc.system_from_arrays(
        M,
        C if inputs["damping"] > 0.0 else None,
        K,
        coordinates=[[0.0, 0.0], [0.0, height]],
        unknowns=[[0, 0], [0, 1], [1, -1]],
        load=[mass * along, -mass * across, mean * along],
    )
    surface = vc.contact_points(system, [0], [0.0, -1.0])
    return vc.ContactProblem(system, surface, friction=find_mu(inputs), excitation=motion)


def slide(
    found: Found, problem: vc.ContactProblem, motion: vc.GroundMotion, name: str, dt: float
) -> float:
    """Return how far the base is downhill in the end [m].

    Args:
        found: takes the certificate, the energy defect and the history.
        problem: the column.
        motion: of the ground.
        name: of the figure.
        dt: time step [s].
    """
    solution = vc.simulate(
        problem,
        scheme=schemes.MoreauJean(),
        solver=vc.Condensed(),
        dt=dt,
        steps=round(motion.duration / dt),
        state=vc.static_equilibrium(problem),
        record=[vc.Energy(), vc.Resultants("base", (0.0, 0.0))],
        progress=False,
    )
    found.add_run(solution)
    history = solution.history
    slips = np.abs(history["sliding_base"] - history["sliding_base"][0])
    found.curves[name] = (history["t"], slips / CENTI)
    return float(slips[-1])


def draw(found: Found, data: Data, path: Path) -> None:
    """Draw the slip histories of every column, and the end value of SLAMMER.

    Args:
        found: what ``figures`` returned.
        data: the numbers of the source.
        path: of the picture.
    """
    from vi_contact.validation.pictures import canvas, save

    heights = sorted({row["H"] for row in data.rows})
    figure, axes = canvas(2, 2, (9.0, 6.0))
    for axis, height in zip(axes.ravel(), heights, strict=True):
        for row, colour in zip(
            [row for row in data.rows if row["H"] == height],
            ("tab:blue", "tab:orange"),
            strict=True,
        ):
            for words, line in (("finite elements", "-"), ("base slip and one mode", ":")):
                name = f"{words}, H {height:g} m, {row['sense']}"
                if name in found.curves:
                    axis.plot(
                        *found.curves[name], line, color=colour, label=f"{words}, {row['sense']}"
                    )
            axis.axhline(row["slip"], color=colour, ls="--", lw=0.8)
        axis.set_title(f"H = {height:g} m (dashed: SLAMMER)")
        axis.set_xlabel("time [s]")
        axis.set_ylabel("slip [cm]")
    axes[0, 0].legend(fontsize=7)
    save(figure, path)
