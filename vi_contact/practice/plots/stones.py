"""Draw bodies with the joints between them, and the mechanism of rigid blocks at their limit."""

from pathlib import Path
from typing import Any

import numpy as np

from ...core.algebra import Array, Indices
from ...core.checks import number, provides
from ...core.errors import InputError
from ...run.limit_load import LimitLoad
from ...run.rigid_limit import RigidLimit
from .axes_in_plane import FIXED, LONGEST, STONES, make_axis
from .histories import canvas, save
from .moved_cells import draw_moved_cells

JOINT = "#c8401e"
OPENS = "#c8401e"
SLIDES = "#2b6cb0"
CORNER = "#6a3d9a"
MOST_NUMBERS = 250  # joints that get a number; more could not be read
SIZE = 0.12  # of a mechanism: fastest displacement over the size of the whole, by default


def plot_joints(joints: Any, path: str | Path, *, title: str | None = None) -> Path:
    """Draw all bodies of a mesh and the joints that were found, with their numbers.

    Joints are red, with the numbers of the table of ``joints``; points at which only corners touch
    are violet rings. In space the outer sides are drawn, and the numbers are at the middles of the
    joints.

    Args:
        joints: what ``fem.find_joints`` found.
        path: the picture; its ending says the format.
        title: stands above the picture; None for how many joints there are.

    Returns:
        the path.

    Raises:
        InputError: what is no list of joints, a format that matplotlib does not write.
    """
    provides("plot_joints", "joints", joints, ("outlines", "corners"), "give fem.find_joints(…)")
    heading = title
    if heading is None:
        heading = f"{len(joints)} joints of {len(joints.names)} bodies"
    draw = _draw_in_plane if joints.dimension == 2 else _draw_in_space
    return save(draw(joints), path, heading)


def plot_mechanism(
    limit: RigidLimit | LimitLoad,
    path: str | Path,
    *,
    size: float = SIZE,
    title: str | None = None,
) -> Path:
    """Draw bodies at their limit load, moved as the mechanism moves them.

    Where they stand is drawn in grey. Of rigid blocks the sides of joints that open are red, of
    those that only slide blue; of a mesh the cells are drawn.

    Args:
        limit: of ``rigid_limit_load``, whose blocks are those of a mesh; or of ``limit_load`` or
            ``tilt`` in the plane, on one rank.
        path: the picture; its ending says the format.
        size: largest displacement, over the size of the whole.
        title: stands above the picture; None for the multiplier.

    Returns:
        the path.

    Raises:
        InputError: blocks without outlines, no mechanism, bodies without a mesh in the plane, a
            format that matplotlib does not write.
    """
    number("plot_mechanism", "size", size, positive=True)
    if isinstance(limit, LimitLoad):
        heading = title or f"mechanism above {limit.multiplier:.4g} times the load"
        return save(draw_moved_cells(limit, size), path, heading)
    blocks = limit.blocks
    if blocks.outlines is None or blocks.outline_bodies is None:
        raise InputError(
            "plot_mechanism: the blocks have no outlines: make them by rigid_blocks, or give "
            "outlines= and outline_bodies="
        )
    if not np.isfinite(limit.multiplier):
        raise InputError("plot_mechanism: the multiplier has no limit, and there is no mechanism")
    whole = float(np.ptp(blocks.outlines.reshape(-1, 2), axis=0).max())
    moved = _move(limit, blocks.outlines, blocks.outline_bodies, size * whole)
    figure, axis = make_axis(np.concatenate([blocks.outlines, moved]).reshape(-1, 2))
    _draw_bodies(axis, blocks.outlines, blocks.outline_bodies, faint=True)
    _draw_bodies(axis, moved, blocks.outline_bodies)
    for colour, label, some in _sort_joints(limit):
        if len(some):
            # both sides of each joint, where they have moved
            for side in (0, 1):
                ends = _move(limit, blocks.ends[some], blocks.bodies[some, side], size * whole)
                axis.plot(*ends.transpose(2, 1, 0), color=colour, lw=1.8, zorder=3)
            axis.plot([], [], color=colour, lw=1.8, label=label)
    axis.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=8)
    heading = title if title is not None else f"mechanism at {limit.multiplier:.4g} times the load"
    return save(figure, path, heading)


def _sort_joints(limit: RigidLimit) -> list[tuple[str, str, Indices]]:
    """Return colour, name and numbers of joints that open, and of those that only slide.

    Where the flow is associated a joint that slides opens by mu times the slip: a joint opens here
    if it turns, or leaves at both ends faster than it slides.
    """
    moving = np.array(limit.moving, dtype=np.int64)
    opening = limit.rates[moving, :, 0]
    sliding = np.abs(limit.rates[moving, :, 1]).max(axis=1)
    turns = np.ptp(opening, axis=1) > 1e-6
    opens = turns | (opening.max(axis=1) > sliding)
    return [
        (OPENS, "opens", moving[opens]),
        (SLIDES, "slides", moving[~opens]),
    ]


def _move(limit: RigidLimit, points: Array, bodies: Indices, size: float) -> Array:
    """Return sides (k, 2, 2) of blocks moved by the mechanism.

    Args:
        limit: with the velocities.
        points: (k, 2, 2) [m].
        bodies: (k,) their blocks.
        size: displacement where the velocity is one [m].
    """
    velocities = np.vstack([limit.velocities, np.zeros(3)])  # the last row, -1, does not move
    centres = np.vstack([limit.blocks.centres, np.zeros(2)])
    # small displacements, so that blocks which move as one stay together
    arm = points - centres[bodies][:, None]
    aside = np.stack([-arm[:, :, 1], arm[:, :, 0]], axis=2)
    shift = velocities[bodies, None, :2] + velocities[bodies, 2][:, None, None] * aside
    return points + size * shift


def _draw_in_plane(joints: Any) -> Any:
    """Return a figure of bodies and joints in the plane."""
    figure, axis = make_axis(joints.outlines.reshape(-1, 2))
    _draw_bodies(axis, joints.outlines, joints.outline_bodies)
    for joint in joints:
        axis.plot(*joint.ends.T, color=JOINT, lw=1.8, zorder=3)
    for joint in joints[:MOST_NUMBERS]:
        axis.annotate(
            f"{joint.number + 1}",
            joint.ends.mean(axis=0),
            fontsize=6.5,
            ha="center",
            va="center",
            zorder=5,
            bbox={"boxstyle": "round,pad=0.12", "fc": "white", "ec": "none", "alpha": 0.85},
        )
    if len(joints.corners):
        axis.plot(*joints.corners.T, "o", ms=7, mfc="none", mec=CORNER, mew=1.4, zorder=4)
    return figure


def _draw_in_space(joints: Any) -> Any:
    """Return a figure of bodies and joints in space."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    figure, axes = canvas(1, 1, (LONGEST, 0.85 * LONGEST), False, subplot_kw={"projection": "3d"})
    axis = axes[0, 0]
    # y upwards, as in the plane
    turned = joints.outlines[:, :, [0, 2, 1]]
    colours = [STONES[body % len(STONES)] for body in joints.outline_bodies]
    axis.add_collection3d(
        Poly3DCollection(turned, facecolors=colours, edgecolors="#9a9180", lw=0.3, alpha=0.35)
    )
    for joint in joints[:MOST_NUMBERS]:
        x, y, z = joint.middle
        axis.text(x, z, y, f"{joint.number + 1}", color=JOINT, fontsize=7, ha="center")
    if len(joints.corners):
        x, y, z = joints.corners.T
        axis.plot(x, z, y, "o", ms=5, mfc="none", mec=CORNER, mew=1.2)
    low = turned.min(axis=(0, 1))
    high = turned.max(axis=(0, 1))
    axis.set(
        xlim=(low[0], high[0]),
        ylim=(high[1], low[1]),  # z points to the viewer
        zlim=(low[2], high[2]),
        xlabel="x [m]",
        ylabel="z [m]",
        zlabel="y [m]",
    )
    axis.locator_params(nbins=5)
    axis.set_box_aspect(high - low, zoom=0.85)  # room for the words of the axes
    return figure


def _draw_bodies(axis: Any, outlines: Array, bodies: Indices, *, faint: bool = False) -> None:
    """Fill the bodies whose sides are given.

    Args:
        axis: of matplotlib.
        outlines: (k, 2, 2) sides [m].
        bodies: (k,) their bodies; those below zero do not move.
        faint: whether only their sides are drawn, in grey.
    """
    from matplotlib.collections import LineCollection, PolyCollection

    if faint:
        axis.add_collection(LineCollection(outlines, colors="#bbbbbb", lw=0.6, zorder=1))
        axis.autoscale_view()
        return
    polygons = []
    colours = []
    for body in np.unique(bodies):
        for loop in _close(outlines[bodies == body]):
            polygons.append(loop)
            colours.append(FIXED if body < 0 else STONES[body % len(STONES)])
    axis.add_collection(
        PolyCollection(polygons, facecolors=colours, edgecolors="#5a5244", lw=0.7, zorder=2)
    )
    axis.autoscale_view()


def _close(sides: Array) -> list[Array]:
    """Return the closed loops (c, 2) that sides (k, 2, 2) make, each end beside the next start.

    Args:
        sides: each from its start to its end, anticlockwise round the body.
    """
    from scipy.spatial import cKDTree

    _, after = cKDTree(sides[:, 0]).query(sides[:, 1])
    left = set(range(len(sides)))
    loops = []
    while left:
        start = min(left)
        loop = []
        side = start
        while side in left:
            left.discard(side)
            loop.append(sides[side, 0])
            side = int(after[side])
        loops.append(np.array(loop))
    return loops
