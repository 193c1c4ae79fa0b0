"""Shake a site column of one soil that is elastic, equivalent-linear, or yields in time.

The case is demos/cases/site_column.toml: soil that yields (``Iwan``), on a compliant base of rock.
The elastic column is the same case with the stiffness of small strains. Equivalent-linear waves
take the same soil and rock, and the damping of the curves.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from vi_contact.core.algebra import Array
from vi_contact.practice import soil
from vi_contact.practice.ground_motion import Record, trimmed, write_at2
from vi_contact.practice.studies import read_case

CASE = Path(__file__).parents[2] / "cases" / "site_column.toml"
DEPTH = 20.0  # of the column in the case [m]
CURVES = soil.SoilCurves.seed_idriss()  # of the case
# what makes the case elastic: a setting without a value takes a key away
ELASTIC = [
    "material.sand.type=LinearElastic",
    "material.sand.curve=",
    "system.integration=selective",
    "record.3=",
]


@dataclass(frozen=True)
class Shaken:
    """Hold what is compared of one column.

    Attributes:
        surface: the absolute motion of its surface.
        strain: (cells,) largest shear strain of each cell, from the top.
        loop: (2, steps) shear strain and stress [Pa] half-way down; None where it was not recorded.
        facts: of the run; empty of waves.
    """

    surface: Record
    strain: Array
    loop: Array | None
    facts: Mapping[str, Any]


def make_settings(
    folder: Path, record: Path | None, until: float | None, cells: int, comm: MPI.Comm
) -> list[str]:
    """Return the settings of the case: its motion, its cells, and probes at all nodes. Collective.

    Args:
        folder: where a motion of its own is written.
        record: file of an outcrop of the rock; None: the synthetic motion of the case.
        until: end of the run [s]; None: that of the motion.
        cells: over the depth.
        comm: the ranks.
    """
    heights = np.linspace(0.0, DEPTH, cells + 1)
    probes = ", ".join(f"n{k} = [0.0, {y:.12g}]" for k, y in enumerate(heights))
    settings = [f"mesh.divisions=[1, {cells}]", f"record.2.points={{{probes}}}"]
    if record is not None:
        settings += [f'excitation.1.record={{path="{record.resolve()}"}}', "excitation.1.scale="]
    motion = read_motion(settings)
    if until is not None:
        motion = trimmed(motion, 0.0, until)
    if comm.rank == 0:
        folder.mkdir(parents=True, exist_ok=True)
        write_at2(motion, folder / "motion.at2")
    comm.barrier()
    written = f'excitation.1.record={{path="{(folder / "motion.at2").resolve()}"}}'
    return [*settings, written, "excitation.1.scale=", f"run.dt={motion.dt:.12g}"]


def read_motion(settings: list[str]) -> Record:
    """Return the motion of the outcrop that the case has with these settings."""
    motion: Any = read_case(CASE, settings).excitations()[0]
    record: Record = motion.record
    factor = motion.scale
    return record.changed(factor * record.acceleration, f"times {factor:g}")


def shake(comm: MPI.Comm, settings: list[str], out: Path) -> Shaken:
    """Run the case with these settings, and return what is compared. Collective.

    Args:
        comm: the ranks.
        settings: KEY=VALUE of the case.
        out: the run folder.
    """
    solution = read_case(CASE, settings).run(comm, progress=False, out=out)
    history = solution.history
    cells = sum(name.startswith("u_x_n") for name in history) - 1

    # The strain of a cell is constant over its height: the difference of its two nodes.
    u = np.array([history[f"u_x_n{k}"] for k in range(cells + 1)])
    strain = np.abs(np.diff(u, axis=0)).max(axis=1) / (DEPTH / cells)
    dt = float(history["t"][1] - history["t"][0])
    loop = None
    if "stress_xy_middle" in history:
        loop = np.array([history["strain_xy_middle"], history["stress_xy_middle"]])
    return Shaken(Record(history[f"a_x_n{cells}"], dt), strain[::-1], loop, solution.facts)


def send_waves(comm: MPI.Comm, settings: list[str], cells: int) -> Shaken:
    """Return what equivalent-linear waves make of the same soil, rock and motion. Collective.

    Args:
        comm: the ranks.
        settings: KEY=VALUE of the case.
        cells: layers of the soil.
    """
    space: Any = read_case(CASE, [*settings, *ELASTIC]).problem(comm).system.space
    ((_, sand),) = space.forms.materials
    (base,) = space.forms.boundaries
    layers = [(DEPTH / cells, sand, CURVES)] * cells
    found = soil.equivalent_linear(layers, read_motion(settings), rock=base.material)
    return Shaken(found.surface, found.strain, None, {})
