"""Draw what the demos of bounds on a field show.

They show a membrane over a ball, a bar in torsion and a bar that cracks.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vi_contact.exact.membrane import HALF, Membrane
from vi_contact.practice.plots.histories import canvas, plain_numbers, save


def gathered(function: Any) -> tuple[Any, Any] | None:
    """Return (points (n, 3), values (n,)) of a scalar Function on rank 0, None on the others.

    Collective.
    """
    space = function.function_space
    n = space.dofmap.index_map.size_local
    parts = space.mesh.comm.gather(
        (space.tabulate_dof_coordinates()[:n], np.array(function.x.array[:n])), root=0
    )
    if parts is None:
        return None
    points, values = zip(*parts, strict=True)
    return np.concatenate(points), np.concatenate(values)


def plot_membrane(
    u: tuple[Any, Any],
    push: tuple[Any, Any],
    sizes: Sequence[float],
    errors: Mapping[str, Sequence[float]],
    path: str | Path,
) -> Path:
    """Draw the membrane along y = 0, the nodes that lie on the ball.

    Errors are drawn against the cell size.
    """
    figure, axes = canvas(1, 3, (13.0, 4.0))
    section, plan, order = axes[0]
    known = Membrane()
    (points, heights), (_, forces) = u, push
    x = np.linspace(-HALF, HALF, 801)
    line = np.vstack([x, 0.0 * x, 0.0 * x])
    section.fill_between(
        x,
        0.0,
        np.where(np.abs(x) < 1.0, np.sqrt(np.maximum(1.0 - x**2, 0.0)), 0.0),
        color="0.85",
        label="ball",
    )
    section.plot(x, known.height(line), color="0.5", lw=3.0, label="exact")
    middle = np.abs(points[:, 1]) < 1e-9
    order_of = np.argsort(points[middle, 0])
    section.plot(
        points[middle, 0][order_of], heights[middle][order_of], "k.", ms=4, label="computed"
    )
    section.set(xlabel="x at y = 0", ylabel="height u", xlim=(-HALF, HALF), ylim=(0.0, 1.05))
    section.legend(fontsize=8)
    held = forces > 0.0
    plan.plot(*points[held, :2].T, "s", color="tab:blue", ms=3, label="nodes on the ball")
    plan.plot(*points[~held, :2].T, ".", color="0.8", ms=2)
    angle = np.linspace(0.0, 2.0 * np.pi, 200)
    plan.plot(
        known.radius * np.cos(angle),
        known.radius * np.sin(angle),
        color="tab:red",
        lw=1.5,
        label=f"exact contact radius {known.radius:.4f}",
    )
    plan.set(xlabel="x", ylabel="y", xlim=(-1.1, 1.1), ylim=(-1.1, 1.1), aspect="equal")
    plan.legend(fontsize=8, loc="upper right")
    for (name, values), mark in zip(errors.items(), "osd", strict=False):
        order.loglog(sizes, values, f"{mark}-", lw=1.2, label=name)
    order.loglog(sizes, 0.3 * np.array(sizes) ** 2, color="0.6", ls="--", lw=1.0, label="order 2")
    order.set(xlabel="cell size h", ylabel="error", ylim=(2e-6, 0.2))
    plain_numbers(order.xaxis)
    order.legend(fontsize=8, loc="lower right")
    return save(figure, path)


def plot_torsion(
    fields: Mapping[str, tuple[Any, Any, Any]],
    curves: Mapping[str, tuple[Any, Any]],
    path: str | Path,
) -> Path:
    """Draw the stress function and the plastic zone of sections, and torque against twist.

    ``fields``: name -> (points (n, 3), u (n,), plastic (n,)); ``curves``: name -> (twists, torques
    / limit torque).
    """
    figure, axes = canvas(1, len(fields) + 1, (4.6 * (len(fields) + 1), 4.0), lattice=False)
    for axis, (name, (points, values, plastic)) in zip(axes[0], fields.items(), strict=False):
        drawn = axis.tricontourf(points[:, 0], points[:, 1], values, 12, cmap="viridis")
        axis.plot(*points[plastic, :2].T, ".", color="tab:red", ms=2.5, label="plastic")
        axis.set(title=name, xlabel="x / a", ylabel="y / a", aspect="equal")
        axis.legend(fontsize=8, loc="upper right")
        figure.colorbar(drawn, ax=axis, label="stress function u / (k a)", shrink=0.8)
    last = axes[0, -1]
    for (name, (twist, torque)), style in zip(
        curves.items(), ("-", "o", "s", "--", ":"), strict=False
    ):
        last.plot(twist, torque, style, color="0.4" if style in "-:--" else None, ms=5, label=name)
    last.set(xlabel="twist G θ a / k", ylabel="torque / limit torque", ylim=(0.0, 1.05))
    last.grid(visible=True, alpha=0.4)
    last.legend(fontsize=8)
    return save(figure, path)


def plot_crack(
    law: tuple[Any, Any, Any, Any],
    pulls: Any,
    energies: Mapping[str, Any],
    cracks: Mapping[str, tuple[Any, Any]],
    profile: tuple[Any, Any],
    path: str | Path,
) -> Path:
    """Draw stress against strain of the bar that stays homogeneous.

    It is (strain, stress, exact strain, exact stress). Besides, the energies of the one that breaks
    against how far it is pulled are drawn, and its damage along the axis beside the exact one.
    """
    figure, axes = canvas(1, 3, (13.0, 4.0))
    stress, energy, damage = axes[0]
    stress.plot(law[2], law[3], color="0.6", lw=3.0, label="closed form")
    stress.plot(law[0], law[1], "k.", ms=5, label="computed, loaded and unloaded")
    stress.set(xlabel="strain / critical strain", ylabel="stress / critical stress")
    stress.legend(fontsize=8)
    for name, values in energies.items():
        energy.plot(pulls, values, ".-", lw=1.2, label=name)
    energy.axhline(1.0, color="0.6", ls="--", lw=1.0, label="one crack, $G_c H$")
    energy.set(xlabel="mean strain / critical strain", ylabel="energy / $G_c H$")
    energy.legend(fontsize=8)
    damage.plot(*profile, color="0.6", lw=3.0, label="exp(-|x|/l) beside the broken nodes")
    for (name, crack), mark in zip(cracks.items(), ("kx", "k."), strict=False):
        damage.plot(*crack, mark, ms=4, label=name)
    damage.set(xlabel="x / l from the crack", ylabel="damage d", ylim=(-0.03, 1.3))
    damage.legend(fontsize=8, loc="upper right")
    return save(figure, path)
