"""Run the case of the backfilled wall under another motion, and read what is left of it.

The case is demos/cases/backfilled_wall.toml: wall, ground and three lifts. Its excitation is
replaced, and fields are written as well.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from demos.parts.pictures.yielding import CORNERS, Snapshot
from vi_contact.core.algebra import Array
from vi_contact.core.files import list_frames, open_hdf5
from vi_contact.practice.ground_motion import Record, write_at2
from vi_contact.practice.studies import read_case

CASES = Path(__file__).parents[2] / "cases"
NAME = "backfilled_wall"


def write_case(folder: Path, record: Record, every: int) -> Path:
    """Write the case with another motion, and its mesh and record, into a folder.

    Args:
        folder: the place.
        record: the motion of the rock.
        every: a frame each so many steps of 0.01 s.
    """
    folder.mkdir(parents=True, exist_ok=True)
    text = (CASES / f"{NAME}.toml").read_text()
    head, rest = text.split("[[excitation]]", 1)
    rest = rest[rest.index("[[stage]]") :]
    motion = f"""[[excitation]]
type = "GroundMotion"
record = {{path = "motion.at2", processing = {{resample = 0.01}}}}
direction = [1.0, 0.0]

[run]
dt = 0.01
t_end = {record.duration:.6g}

[fields]
every = {every}

"""
    path = folder / f"{NAME}.toml"
    path.write_text(head + motion + rest)
    (folder / f"{NAME}.geo").write_text((CASES / f"{NAME}.geo").read_text())
    write_at2(record, folder / "motion.at2")
    return path


def shake(comm: MPI.Comm, folder: Path, record: Record, every: int = 10) -> Any:
    """Run the case, and return its solution, whose run folder is ``folder``/run. Collective.

    Args:
        comm: the ranks.
        folder: of case and run.
        record: the motion of the rock.
        every: a frame each so many steps.
    """
    if comm.rank == 0:
        write_case(folder, record, every)
    comm.barrier()
    case = read_case(folder / f"{NAME}.toml")
    return case.run(comm, progress=False, out=folder / "run")


def find_pushed(history: Any) -> Array:
    """Return how far the base has slid since the motion began, away from the fill positive [m].

    Args:
        history: of a run of the case.
    """
    slid = history["sliding_base"]
    away: Array = slid[0] - slid
    return away


def read_snapshots(run: Path, times: Array) -> list[Snapshot]:
    """Return a snapshot of each frame of a run, on one rank.

    Displacements are those since the motion began; strains are the whole ones.

    Args:
        run: the run folder.
        times: [s] of all steps.
    """
    with open_hdf5(run / "fields" / "mesh.h5") as file:
        points = file["points"][()][:, :2]
        nodes = file["cells"][()]
    cells = nodes[:, list(CORNERS[nodes.shape[1]])]
    snapshots = []
    begun = np.zeros((len(points), 2))
    for k, (path, group) in sorted(list_frames(run).items()):
        with open_hdf5(path) as file:
            u = file[group]["u"][()][:, :2]
            strain = file[group]["plastic_strain"][()]
        if k == 0:
            begun = u
        text = f"a wall and its fill, t = {times[k]:.2f} s"
        snapshots.append(Snapshot(points[cells], (u - begun)[cells], strain, text))
    return snapshots
