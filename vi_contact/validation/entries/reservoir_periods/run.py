"""Find the first period of a dam, dry and with three models of the water before it."""

from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem, meshes
from vi_contact.run.modal import lowest_frequency
from vi_contact.validation import Data, Found, Inputs

UNITS = {
    "height": "m",
    "base": "m",
    "crest": "m",
    "level": "m",
    "E": "Pa",
    "nu": "-",
    "rho": "kg/m³",
    "gamma": "N/m³",
    "speed": "m/s",
    "water": "name",
}
CELLS = {"smallest": (6, 10), "coarse": (12, 20), "fine": (18, 30)}  # along base and height
MODELS = ("dry", "added mass", "incompressible", "acoustic")


def figures(inputs: Inputs, fineness: str) -> Found:
    """Return the first periods of the dam on a rigid ground.

    Args:
        inputs: the dam and its water.
        fineness: a key of ``CELLS``.
    """
    found = Found()
    for model in MODELS:
        system, _ = build(inputs, model, fineness, held=True)
        found.figures[f"first period, {model}"] = 1.0 / lowest_frequency(system)

    # The same dam, which stands on its ground by contact: the certificate of its rest.
    system, base = build(inputs, "incompressible", fineness, held=False)
    surface = fem.contact_surface(
        system, base, obstacle=vc.HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
    )
    problem = vc.ContactProblem(vc.with_weight(system), surface, friction=vc.Coulomb(2.0))
    found.add_equilibrium(problem, vc.static_equilibrium(problem))
    return found


def build(inputs: Inputs, model: str, fineness: str, *, held: bool) -> tuple[Any, Any]:
    """Return the system of the dam, and its base.

    Args:
        inputs: of the entry.
        model: of ``MODELS``.
        fineness: a key of ``CELLS``.
        held: whether the base is held.
    """
    height = inputs["height"]
    base = inputs["base"]

    def taper(points: Any) -> Any:
        width = base - (base - inputs["crest"]) * points[:, 1] / height
        return np.column_stack([points[:, 0] * width / base, points[:, 1]])

    block = meshes.BlockMesh(lengths=(base, height), divisions=CELLS[fineness], deform=taper)
    mesh, tags = fem.build_mesh(block, MPI.COMM_WORLD)
    water = None
    if model != "dry":
        speed = {"speed": inputs["speed"]} if model == "acoustic" else {}
        water = fem.Reservoir(
            face=tags["left"], level=inputs["level"], model=model, gamma=inputs["gamma"], **speed
        )
    concrete = vc.LinearElastic(E=inputs["E"], nu=inputs["nu"], rho=inputs["rho"])
    supports = {"clamped": tags["bottom"]} if held else {}
    system = fem.assemble(mesh, concrete, reservoir=water, degree=2, **supports)
    return system, tags["bottom"]


def draw(found: Found, data: Data, path: Path) -> None:
    """Draw the periods beside those of the source.

    Args:
        found: what ``figures`` returned.
        data: the numbers of the source.
        path: of the picture.
    """
    from vi_contact.validation.pictures import canvas, save

    figure, axes = canvas(1, 1, (6.0, 3.2))
    axis = axes[0][0]
    names = [row["water"] for row in data.rows]
    periods = [found.figures[f"first period, {name}"] for name in names]
    axis.bar(names, periods, width=0.5, color="0.7", label="vi_contact")
    axis.plot(names, [row["period"] for row in data.rows], "kx", label="other program")
    axis.set_ylabel("first period [s]")
    axis.legend(loc="lower right")
    save(figure, path)
