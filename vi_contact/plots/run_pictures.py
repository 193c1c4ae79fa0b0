"""Draw the pictures of a run from its folder alone: motion, energy, certificate, contact, bodies, a film."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..core.errors import InputError
from ..core.files import frames_of
from ..core.surfaces import ContactSurface
from ..run.files.reading import ContactGeometry, RunFolder
from .bodies import film, plot_deformed
from .channel import Outline, plot_envelope, plot_interface, plot_openings, plot_rocking
from .deformed import read_frames
from .faces import plot_faces
from .histories import History, plain, plot_certificate, plot_energy, plot_excitation, plot_points, shaken
from .maps import arc_position, plot_contact

SOIL = "_soil"  # after the label of a point: that of the soil which touches it


def draw_run(run: RunFolder, out: Path, *, title: str, unilateral: Sequence[str] | None = None) -> list[Path]:
    """Draw all pictures of a run folder into ``out``: of its histories, of the buried channel its interface, in space
    the contact faces, with fields the deformed bodies and a film of them.

    ``unilateral``: labels of probes that are contact points, drawn with their bound (see ``plot_points``).
    """
    drawn = draw_histories(run.history, run.contact, out, title=title, unilateral=unilateral)
    if of_channel(run):
        drawn += illustrate(run, out, title=plain(title))
    if run.contact is not None and run.contact.points.shape[1] == 3 and "active" in run.history:
        drawn.append(plot_faces(run, out / "faces.png", title=title))
    if frames_of(run.folder) and read_frames(run).cells.shape[1] > 2:  # no bars
        drawn += [plot_deformed(run, out / "deformed.png", title=title), film(run, out / "film.gif", title=title)]
    return drawn


def draw_histories(
    history: History, contact: ContactSurface | ContactGeometry | None, out: Path, *, title: str,
    unilateral: Sequence[str] | None = None, reference: History | None = None,
) -> list[Path]:
    """Draw the pictures of recorded histories, each where there is something to draw; ``reference``: in grey."""
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


def of_channel(run: RunFolder) -> bool:
    """Return whether it is a finished run of the buried channel with its model's recorders."""
    return run.contact is not None and "pressure" in run.history and f"u_x_19{SOIL}" in run.history


def illustrate(run: RunFolder, folder: Path, *, title: str = "Buried channel") -> list[Path]:
    """Draw openings.png, rocking.png, interface.png and envelope.png of a run of the buried channel into a folder.

    Returns what was drawn. InputError for another run.
    """
    if run.contact is None or not of_channel(run):
        raise InputError(f"'{run.folder}' is not of a finished run of the buried channel: give the folder of one")
    outline = Outline.of(run.contact.points, run.contact.normals)
    return [
        plot_openings(run.history, folder / "openings.png", title=f"{title}, openings of the interface"),
        plot_rocking(run.history, folder / "rocking.png", title=f"{title}, bottom corners"),
        plot_interface({"": run.history}, outline, folder / "interface.png", title=f"{title}, interface"),
        plot_envelope({title: run.history}, outline, folder / "envelope.png", title=f"{title}, envelopes"),
    ]
