"""Draw what the demo of the beam shows beside its command: contact at the tip, and the limit of the regularisation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.plots.histories import History, canvas, panels, save


def plot_rubbing(history: History, path: str | Path, *, mu: float, gap: float, title: str) -> Path:
    """Draw gap, contact force with the friction it allows, and motion of the tip across, of ``rubbing_problem``.

    history: with the columns of ``Contact`` and of a ``Probe`` labelled "tip". gap: of the rod at rest [m].
    """
    figure, (top, middle, bottom) = panels(3, (9.0, 8.0))
    t, force = history["t"], history["contact_resultant"]
    top.plot(t, gap - history["u_x_tip"], color="black", lw=1.1)
    top.set(ylabel="gap [m]", title=title)
    middle.fill_between(t, -mu * force, mu * force, color="0.85", lw=0.0, label="friction allowed, ± mu r_n")
    middle.plot(t, -history["friction_force_y"], color="tab:red", lw=1.0, label="friction on the wall")
    middle.plot(t, mu * force, color="0.5", lw=0.6)
    middle.plot(t, -mu * force, color="0.5", lw=0.6)
    middle.set(ylabel="friction force [N]")
    middle.legend(fontsize=8, loc="lower right")
    bottom.plot(t, history["u_y_tip"], color="black", lw=1.1, label="tip")
    slip = np.append(0.0, np.diff(history["u_y_tip"]))
    _shade(bottom, t, (force > 0.0) & (np.abs(slip) <= 1e-12 * np.max(np.abs(slip))), "sticking")
    bottom.set(ylabel="displacement across [m]")
    bottom.legend(fontsize=8, loc="lower left")
    return save(figure, path)


def _shade(axis: Any, t: Array, where: Array, label: str) -> None:
    """Marks the times at which something holds."""
    low, high = axis.get_ylim()
    axis.fill_between(t, low, high, where=where, color="tab:orange", alpha=0.25, lw=0.0, label=label)
    axis.set_ylim(low, high)


def plot_regularisation(
    eps: Sequence[float], errors: Mapping[str, Array], tips: Mapping[str, tuple[Array, Array]], path: str | Path
) -> Path:
    """Draw the largest difference of the tip from the exact law over eps, left; tips (t, u) of some runs, right."""
    figure, ((left, right),) = canvas(1, 2, (11.0, 4.5))
    for label, values in errors.items():
        left.loglog(eps, values, "o-", ms=4, lw=1.1, label=label)
    last = min(values[-1] for values in errors.values())
    left.loglog(eps, last * np.asarray(eps) / eps[-1], color="0.6", ls=":", label="order 1")
    left.set(xlabel="eps [m]", ylabel="largest difference of the tip [m]", title="Regularised against exact friction")
    left.legend(fontsize=8)
    for label, (t, u) in tips.items():
        right.plot(t, u, lw=1.1, label=label)
    right.set(xlabel="time [s]", ylabel="tip [m]", title="Motion of the tip")
    right.legend(fontsize=8)
    figure.savefig(path, dpi=130)
    return Path(path)
