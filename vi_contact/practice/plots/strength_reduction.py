"""Draw how a body gives way when its strength is reduced."""

from pathlib import Path
from typing import Any

import numpy as np

from ...core.algebra import Array
from ...core.checks import number, provides
from ...core.errors import InputError
from ...core.files import on_root
from ...core.problem import ContactProblem
from ...core.step import State
from ...fem.output.fields import FrameValues
from .histories import canvas, save

SIZE = 0.06  # of the mechanism: largest displacement over the size of the body
CORNERS = {"Triangle": 3, "Triangle_6": 3, "Quadrilateral": 4, "Quadrilateral_9": 4}


def plot_strength_reduction(
    found: Any, path: str | Path, *, size: float = SIZE, title: str | None = None
) -> Path:
    """Draw the mechanism and the displacements of the trials, for bodies in the plane. Collective.

    On the left are the cells at the largest factor with an equilibrium, coloured by what their
    plastic strain has grown since the smallest factor, and moved as they have moved since. On the
    right is the largest displacement over the factor, with the factor that was not reached.

    Args:
        found: of ``strength_reduction``.
        path: the picture; its ending says the format.
        size: largest displacement that is drawn, over the size of the body.
        title: stands above the picture; None for the factor.

    Returns:
        the path.

    Raises:
        InputError: what is no answer of a strength reduction, a body in space, a format that
            matplotlib does not write.
    """
    owner = "plot_strength_reduction"
    provides(owner, "found", found, ("trials", "factor"), "give studies.strength_reduction(…)")
    number(owner, "size", size)
    values = FrameValues(owner, found.problem, {})
    last = _gather(values, found.problem, found.state)
    first = _gather(values, found.problem, found.first)
    if found.problem.system.space.dimension != 2:
        raise InputError(
            f"{owner} draws bodies in the plane: write frames of found.state in space, or take "
            "fem.as_function(found.problem, found.state, 'plastic_strain')"
        )

    def draw() -> Path:
        moved = last[0] - first[0]
        strain = last[1] - first[1]
        heading = f"Strength over {found.factor:.3f}" if title is None else title
        return save(_draw(found, values.grid, moved, strain, size), path, heading)

    on_root(values.comm, draw)
    return Path(path)


def _gather(values: FrameValues, problem: ContactProblem, state: State) -> tuple[Array, Array]:
    """Return displacements (n, 3) [m] and plastic strains of the cells, on rank 0. Collective.

    Args:
        values: of frames.
        problem: that of the state.
        state: an equilibrium.
    """
    nodal, cellwise = values.gather(state, np.zeros_like(state.u), None)
    return nodal["u"], cellwise["plastic_strain"]


def _draw(found: Any, grid: Any, moved: Array, strain: Array, size: float) -> Any:
    """Return the figure.

    Args:
        found: the answer.
        grid: of the mesh.
        moved: displacements (n, 3) [m] of the mechanism.
        strain: (c,) plastic strains of the cells in it.
        size: as of ``plot_strength_reduction``.
    """
    from matplotlib.collections import PolyCollection

    figure, axes = canvas(1, 2, (11.0, 3.6), gridspec_kw={"width_ratios": (3.0, 1.0)})
    left, right = axes[0]
    left.grid(visible=False)
    points = grid.points[:, :2]
    extent = float(np.max(np.ptp(points, axis=0)))
    fastest = float(np.max(np.linalg.norm(moved, axis=1), initial=0.0))
    scale = size * extent / fastest if fastest > 0.0 else 0.0
    shape = points + scale * moved[:, :2]
    corners = grid.cells[:, : CORNERS[grid.kind]]
    cells = PolyCollection(shape[corners], array=strain, cmap="YlOrRd", edgecolors="0.8", lw=0.2)
    left.add_collection(cells)
    left.autoscale_view()
    left.set_aspect("equal")
    left.set_xlabel("x [m]")
    left.set_ylabel("y [m]")
    bar = figure.colorbar(cells, ax=left, shrink=0.7)
    bar.set_label("growth of plastic strain")
    _draw_trials(found, right)
    return figure


def _draw_trials(found: Any, axes: Any) -> None:
    """Draw the largest displacement over the factor."""
    standing = [trial for trial in found.trials if trial.stands]
    factors = [trial.factor for trial in standing]
    axes.plot(factors, [trial.displacement for trial in standing], "o-", ms=3)
    axes.axvline(found.failed, color="#c8401e", ls="--", lw=1.0)
    axes.set_xlabel("strength over")
    axes.set_ylabel("largest displacement [m]")
