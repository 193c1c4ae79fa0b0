"""Draw the pictures of a run from its folder alone: motion, energy, certificate, contact; of the channel a film too."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..core.algebra import Array
from ..core.errors import InputError
from ..core.surfaces import ContactSurface
from ..run.files.reading import ContactGeometry, RunFolder
from .channel import Outline, opening, plot_envelope, plot_interface, plot_openings, plot_rocking
from .channel_mesh import animate, read_bodies
from .histories import History, plain, plot_certificate, plot_energy, plot_excitation, plot_points, shaken
from .maps import arc_position, plot_contact

SOIL = "_soil"  # after the label of a point: that of the soil which touches it
FILM_FRAMES = 48  # at most: a film of two megabytes
DRAWN = 0.15  # of the channel's height: how large its largest displacement is drawn


def draw_run(run: RunFolder, out: Path, *, title: str, unilateral: Sequence[str] | None = None) -> list[Path]:
    """Draw all pictures of a run folder into ``out``, of the buried channel those of its interface too.

    ``unilateral``: labels of probes that are contact points, drawn with their bound (see ``plot_points``).
    """
    drawn = draw_histories(run.history, run.contact, out, title=title, unilateral=unilateral)
    return drawn + (illustrate(run, out, title=plain(title)) if of_channel(run) else [])


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
    """Draw openings.png, rocking.png, interface.png and envelope.png of a run of the buried channel into a folder, and
    with fields channel.gif, around the widest opening.

    Returns what was drawn. InputError for another run.
    """
    if run.contact is None or not of_channel(run):
        raise InputError(f"'{run.folder}' is not of a finished run of the buried channel: give the folder of one")
    outline = Outline.of(run.contact.points, run.contact.normals)
    drawn = [
        plot_openings(run.history, folder / "openings.png", title=f"{title}, openings of the interface"),
        plot_rocking(run.history, folder / "rocking.png", title=f"{title}, bottom corners"),
        plot_interface({"": run.history}, outline, folder / "interface.png", title=f"{title}, interface"),
        plot_envelope({title: run.history}, outline, folder / "envelope.png", title=f"{title}, envelopes"),
    ]
    if (run.folder / "fields" / "mesh.h5").is_file():
        tops = {
            "top of the left wall": opening(run.history, "19", (-1.0, 0.0)),
            "of the right wall": opening(run.history, "13", (1.0, 0.0)),
        }
        widest = float(run.history["t"][int(np.argmax(sum(tops.values())))])
        times, magnified = film(run.folder, widest)
        drawn.append(animate(run.folder, folder / "channel.gif", title=title, history=run.history, openings=tops,
                             times=times.tolist(), magnified=magnified))
    return drawn


def film(folder: Path, around: float) -> tuple[Array, float]:
    """Return (times of the frames next to a moment [s], a round factor that makes their displacements visible)."""
    bodies = read_bodies(folder)
    frames = bodies.frames
    first = int(np.argmin(np.abs(frames.t - around))) - FILM_FRAMES // 2
    first = max(min(first, len(frames.t) - FILM_FRAMES), 0)
    times = frames.t[first : first + FILM_FRAMES]
    own = np.unique(frames.cells[bodies.cells])
    largest = max(float(np.abs(frames.at(t)[1][own]).max()) for t in times)
    if largest == 0.0:
        return times, 1.0
    factor = DRAWN * bodies.height / largest
    power = 10.0 ** np.floor(np.log10(factor))
    return times, float(max(step for step in (1.0, 2.0, 5.0) if step * power <= factor) * power)
