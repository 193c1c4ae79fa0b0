"""A small run in the plane that plot, film and report draw: a wall that is shaken on its ground,
with frames."""

from __future__ import annotations

from pathlib import Path

from vi_contact.core.algebra import Comm
from vi_contact.run.recorders import Contact, Energy
from vi_contact.run.simulate import Solution, simulate
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor


def drawn_run(comm: Comm, folder: Path, steps: int = 6, *, frames_per_file: int = 1) -> Solution:
    """The run, with a frame every second step."""
    from fem_problems import shaken_wall

    from vi_contact.fem.output.fields import XDMF

    return simulate(
        shaken_wall(comm),
        scheme=ZienkiewiczWoodTaylor(),
        dt=1e-3,
        steps=steps,
        out=folder,
        record=[Energy(), Contact()],
        fields=XDMF(every=2, frames_per_file=frames_per_file),
        progress=False,
    )
