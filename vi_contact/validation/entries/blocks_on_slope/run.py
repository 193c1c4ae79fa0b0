"""Slide a stiff block of finite elements down a slope that is shaken along itself."""

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
    "angle": "°",
    "size": "m",
    "wave_speed": "m/s",
    "mu_factor": "-",
    "ky_factor": "-",
    "normal_sense": "-",
    "record": "name",
    "ky": "g",
    "peak": "g",
    "sense": "name",
}
CENTI = 1e-2
DENSITY = 2000.0  # kg/m³; slips do not depend on it
NU = 0.2  # nor on it, as long as the block is stiff
CELLS = {"smallest": 1, "coarse": 2, "fine": 3}  # along each side
STEPS = {"smallest": 1, "coarse": 2, "fine": 4}  # in a step of the record
AFTER = 1.0  # s
DAMPING = 1e-3  # s, of the strain rates of the block: no wave in it outlives a step of the record


def figures(inputs: Inputs, fineness: str) -> Found:
    """Return the slip [cm] of every row.

    Args:
        inputs: the block and its slope; rows of records, yield accelerations and peaks.
        fineness: a key of ``CELLS``.
    """
    found = Found()
    for row in inputs.rows:
        name = f"{row['record']}, ky {row['ky']:g}, peak {row['peak']:g}, {row['sense']}"
        assert inputs.records is not None
        record = vc.read_record(inputs.records / f"{row['record']}.csv", "g")
        record = vc.ground_motion.scaled_to_pga(record, row["peak"] * inputs["gravity"])
        record = keep_strong_part(record, row["ky"] * inputs["gravity"])
        # downhill is +x: a motion of the ground to -x leaves the block behind
        side = inputs["normal_sense"] * {"normal": 1.0, "inverse": -1.0}[row["sense"]]
        motion = vc.GroundMotion(record, direction=(1.0, 0.0), scale=side)
        found.figures[name] = slide(found, inputs, row["ky"], motion, name, fineness) / CENTI
    return found


def keep_strong_part(record: vc.ground_motion.Record, yields: Any) -> vc.ground_motion.Record:
    """Return a record from half a second before it first exceeds ``yields`` [m/s²] to ``AFTER``.

    Before it the block stands still, and after the last time it comes to rest and stands still.
    """
    above = np.flatnonzero(np.abs(record.acceleration) > yields) * record.dt
    start = max(0.0, record.dt * round((above[0] - 0.5) / record.dt))
    end = min(record.duration, above[-1] + AFTER)
    return vc.ground_motion.trimmed(record, start, end)


def slide(
    found: Found, inputs: Inputs, ky: Any, motion: vc.GroundMotion, name: str, fineness: str
) -> float:
    """Return how far the block is downhill when the record is over [m].

    Args:
        found: takes the certificate, the energy defect and the history.
        inputs: of the entry.
        ky: yield acceleration [g].
        motion: of the ground along the slope.
        name: of the figure.
        fineness: a key of ``CELLS``.
    """
    angle = math.radians(inputs["angle"])
    size = inputs["size"]
    cells = CELLS[fineness]
    # twice as wide as it is high, or it would rock: mu is up to 0.93
    mesh, tags = fem.build_mesh(
        meshes.BlockMesh(lengths=(2.0 * size, size), divisions=(2 * cells, cells)), MPI.COMM_WORLD
    )
    shear = DENSITY * inputs["wave_speed"] ** 2
    weight = DENSITY * inputs["gravity"]
    system = fem.assemble(
        mesh,
        vc.LinearElastic(E=2.0 * (1.0 + NU) * shear, nu=NU, rho=DENSITY),
        damping=vc.Rayleigh(alpha=0.0, beta=DAMPING),
        loads=fem.BodyForce((weight * math.sin(angle), -weight * math.cos(angle))),
    )
    slope = vc.HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=slope)
    yields = inputs["ky_factor"] * ky + math.sin(angle)
    mu = inputs["mu_factor"] * yields / math.cos(angle)
    friction = vc.Coulomb(mu) if mu > 0.0 else vc.Frictionless()
    problem = vc.ContactProblem(system, surface, friction=friction, excitation=motion)
    rest = vc.static_equilibrium(problem)
    dt = motion.record.dt / STEPS[fineness]
    solution = vc.simulate(
        problem,
        scheme=schemes.MoreauJean(),
        solver=vc.Condensed(),
        dt=dt,
        steps=round(motion.duration / dt),
        state=rest,
        record=[vc.Energy(), vc.Contact(arrays=False), vc.Resultants("base", (size, 0.0))],
        progress=False,
    )
    found.add_run(solution)
    history = solution.history
    slips = np.abs(history["sliding_base"])
    found.curves[name] = (history["t"], slips / CENTI, history["a_g_x"])
    return float(slips[-1] - slips[0])


def draw(found: Found, data: Data, path: Path) -> None:
    """Draw the history of the first slip below the motion of the ground.

    Args:
        found: what ``figures`` returned.
        data: the numbers of the source.
        path: of the picture.
    """
    from vi_contact.validation.pictures import canvas, save

    figure, axes = canvas(2, 1, (6.5, 4.5), sharex=True)
    name, (t, slip, ground) = next(iter(found.curves.items()))
    wanted = {}
    for row in data.rows:
        wanted[f"{row['record']}, ky {row['ky']:g}, peak {row['peak']:g}, {row['sense']}"] = row
    axes[0, 0].plot(t, ground, lw=0.6, color="0.4")
    axes[0, 0].set_ylabel("ground [m/s²]")
    axes[0, 0].set_title(name)
    axes[1, 0].plot(t, slip, label="finite elements")
    axes[1, 0].axhline(wanted[name]["slip"], color="black", ls="--", label="SLAMMER, at the end")
    axes[1, 0].set_ylabel("slip [cm]")
    axes[1, 0].set_xlabel("time [s]")
    axes[1, 0].legend()
    save(figure, path)
