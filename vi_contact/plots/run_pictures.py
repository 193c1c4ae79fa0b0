"""Draw the pictures of a run from its folder alone: motion, energy, certificate, contact, bodies, a film."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..core.files import frames_of
from ..core.surfaces import ContactSurface
from ..run.files.reading import ContactGeometry, RunFolder
from .bodies import film, plot_deformed
from .deformed import read_frames
from .faces import plot_faces
from .histories import History, plain, plot_certificate, plot_energy, plot_excitation, plot_points, shaken
from .maps import arc_position, plot_contact

SOIL = "_soil"  # after the label of a point: that of the soil which touches it


def draw_run(run: RunFolder, out: Path, *, title: str) -> list[Path]:
    """Draw all pictures of a run folder into ``out``: of its histories, in space of the contact
    faces, with fields of the deformed bodies and a film of them."""
    drawn = draw_histories(run.history, run.contact, out, title=title)
    if run.contact is not None and run.contact.points.shape[1] == 3 and "active" in run.history:
        drawn.append(plot_faces(run, out / "faces.png", title=title))
    if frames_of(run.folder) and read_frames(run).cells.shape[1] > 2:  # no bars
        drawn += [plot_deformed(run, out / "deformed.png", title=title), film(run, out / "film.gif", title=title)]
    return drawn


def draw_histories(
    history: History, contact: ContactSurface | ContactGeometry | None, out: Path, *, title: str,
    unilateral: Sequence[str] | None = None, reference: History | None = None,
) -> list[Path]:
    """Draw the pictures of recorded histories, each where there is something to draw; ``reference``: in grey.

    ``unilateral``: labels of probes that are contact points, drawn with their bound (see ``plot_points``).
    """
    drawn = []
    if shaken(history):
        drawn.append(plot_excitation(history, out / "excitation.png"))
    for axis in "xyz":
        labels = [name.removeprefix(f"u_{axis}_") for name in history
                  if name.startswith(f"u_{axis}_") and not name.endswith(SOIL)]
        if any(np.any(history[f"u_{axis}_{label}"]) for label in labels):
            drawn.append(plot_points(history, labels, out / f"displacements_{axis}.png", title=plain(title),
                                     component=axis, unilateral=unilateral if axis == "x" else None,
                                     reference=reference))
    if "energy_defect" in history:
        drawn.append(plot_energy(history, out / "energy.png"))
    drawn.append(plot_certificate(history, out / "certificate.png"))
    if contact is not None and "pressure" in history and contact.points.shape[0] and contact.points.shape[1] == 2:
        position, label = arc_position(contact.points, contact.normals)
        drawn.append(plot_contact(history, out / "contact.png", position=position, axis_label=label))
    return drawn
