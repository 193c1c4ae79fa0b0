"""Render bodies, and the contact pressure inside of them, with pyvista where it is installed."""

from pathlib import Path
from typing import Any

import numpy as np

from vi_contact.core.algebra import Indices
from vi_contact.core.errors import InputError
from vi_contact.practice.plots.bodies import Scene
from vi_contact.run.files.reading import RunFolder


def render_deformed(
    run: RunFolder, path: str | Path, *, t: float, magnified: float | None = None
) -> Path:
    """Render the bodies of a run with fields in space.

    They are translucent, in the frame next to ``t`` [s], and coloured by von Mises stress; opaque
    are the contact faces between them by their pressure, both displaced as by ``plot_deformed``.

    InputError without pyvista (pip install pyvista), and for a run in the plane or without fields.
    """
    try:
        import pyvista
    except ImportError as error:
        raise InputError(
            "render_deformed needs pyvista: install it, or draw with plot_deformed"
        ) from error
    scene = Scene.read(run, [t], magnified)
    if scene.points.shape[1] != 3:
        raise InputError(f"the run in '{run.folder}' is in the plane: draw it with plot_deformed")
    plotter = pyvista.Plotter(off_screen=True)
    skin = pyvista.PolyData(scene.displace(0), _counted(scene.polygons))
    skin.cell_data["von Mises stress [Pa]"] = scene.stress[0]
    bars = (
        {"vertical": True, "position_x": x, "position_y": 0.1, "height": 0.7, "fmt": "%.3g"}
        for x in (0.06, 0.83)
    )
    plotter.add_mesh(skin, cmap="YlGnBu", opacity=0.4, show_edges=True, scalar_bar_args=next(bars))
    if len(scene.sides):
        faces = pyvista.PolyData(scene.displace(0)[scene.nodes], _counted(scene.sides))
        faces.point_data["contact pressure [Pa]"] = scene.pressure[0]
        plotter.add_mesh(faces, cmap="YlOrRd", scalar_bar_args=next(bars))
    plotter.add_text(
        f"t = {scene.times[0]:.4g} s, displacements x {scene.magnified:g}", font_size=10
    )
    upright = scene.up == "z"
    plotter.view_vector(
        (0.6, -1.0, 0.5) if upright else (0.6, 0.5, 1.0), viewup=(0, not upright, upright)
    )
    plotter.add_axes()
    plotter.screenshot(str(path))
    plotter.close()
    return Path(path)


def _counted(polygons: Indices) -> Any:
    """Polygons (p, corners) as VTK lists them: the number of corners before each."""
    return np.column_stack([np.full(len(polygons), polygons.shape[1]), polygons]).ravel()
