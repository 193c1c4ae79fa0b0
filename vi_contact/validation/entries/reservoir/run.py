"""Empty a reservoir that a vertical fault has displaced, which sticks or has no friction."""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem, meshes
from vi_contact.validation import Data, Found, Inputs

UNITS = {
    "E": "Pa",
    "nu": "-",
    "alpha": "-",
    "dp": "Pa",
    "inner": "m",
    "outer": "m",
    "left": "-",
    "squeeze": "Pa",
    "mu": "-",
    "depth": "m",
    "y": "m",
}
CELL = {"smallest": 12.5, "coarse": 6.25, "fine": 3.125}  # near the reservoir [m]
EVEN = 300.0  # m from the middle of the fault: cells are even up to there
GROWTH = {"smallest": 1.3, "coarse": 1.15, "fine": 1.1}  # of a cell over the one before
FLAT = 60.0  # m from the middle of the fault: where the slip is compared
MEGA = 1e6


def figures(inputs: Inputs, fineness: str) -> Found:
    """Return the shear of the stuck fault, and the slip without friction.

    Args:
        inputs: the rock, the reservoir and its pressure; rows of places.
        fineness: a key of ``CELL``.
    """
    found = Found()
    system, surface = build_fault(inputs, fineness)
    y = surface.everywhere(surface.points[:, 1])
    order = np.argsort(y)

    # the fault sticks; sigma_xy is the force of the right side on the left one, -r_t
    stuck = vc.ContactProblem(system, surface, friction=vc.Coulomb(inputs["mu"]))
    state = vc.static_equilibrium(stuck)
    found.add_equilibrium(stuck, state)
    assert state.r_t is not None
    shear = -surface.everywhere(state.r_t[:, 0] / surface.weights) / MEGA
    for row in inputs.rows:
        place = int(np.argmin(np.abs(y - row["y"])))
        found.figures[f"shear of the stuck fault at y = {row['y']:g} m"] = float(shear[place])

    # the fault slips without friction; the left side goes up on the right one
    smooth = vc.ContactProblem(system, surface)
    state = vc.static_equilibrium(smooth)
    found.add_equilibrium(smooth, state)
    slip = surface.everywhere(surface.slip(state.u, state.t)[:, 0])
    middle = slip[np.abs(y) < FLAT]
    words = f"for |y| < {FLAT:g} m"
    found.figures[f"slip without friction, mean {words}"] = float(middle.mean())
    found.figures[f"slip without friction, largest departure from flat {words}"] = float(
        np.max(np.abs(middle - middle.mean()))
    )
    found.curves["fault"] = (y[order], shear[order], slip[order])
    return found


def build_fault(inputs: Inputs, fineness: str) -> tuple[Any, Any]:
    """Return the system of both blocks, and the contact of the fault.

    Args:
        inputs: of the entry.
        fineness: a key of ``CELL``.
    """
    across = grow(CELL[fineness], CELL[fineness], GROWTH[fineness], inputs["depth"])
    up = grow(CELL[fineness], EVEN, GROWTH[fineness], inputs["depth"])
    heights = np.concatenate([-up[:0:-1], up])
    blocks = {}
    for name, places in (("left", -across[::-1]), ("right", across)):
        blocks[name] = meshes.BlockMesh(
            lengths=(1.0, 1.0),
            divisions=(len(places) - 1, len(heights) - 1),
            deform=partial(place_nodes, across=places, up=heights),
        )
    mesh, tags = fem.build_mesh(meshes.Blocks(blocks), MPI.COMM_WORLD)

    # the reservoir on each side of the fault, whose cells lie between its corners
    a = inputs["inner"]
    b = inputs["outer"]
    slack = 1e-6 * a
    sides = {
        "left": lambda x: (x[0] < slack) & (x[1] > -a - slack) & (x[1] < b + slack),
        "right": lambda x: (x[0] > -slack) & (x[1] > -b - slack) & (x[1] < a + slack),
    }
    strain = inputs["alpha"] * inputs["dp"] * (1.0 - 2.0 * inputs["nu"]) / inputs["E"]
    shares = {"left": inputs["left"], "right": 1.0}
    loads = []
    for name, inside in sides.items():
        if shares[name]:
            cells = fem.Cells.where(f"reservoir_{name}", mesh, inside)
            loads.append(fem.InitialStrain(shares[name] * strain, cells=cells))

    # sides that squeeze the fault, and a bottom that cannot sink
    way = inputs["squeeze"] * (1.0 - inputs["nu"] ** 2) / inputs["E"] * inputs["depth"]
    held = [
        fem.Prescribed(tags["left_left"], (way, 0.0), components=(0,)),
        fem.Prescribed(tags["right_right"], (-way, 0.0), components=(0,)),
        fem.Prescribed(tags["left_bottom"], components=(1,)),
        fem.Prescribed(tags["right_bottom"], components=(1,)),
    ]
    rock = vc.LinearElastic(E=inputs["E"], nu=inputs["nu"], rho=2500.0)
    system = fem.assemble(mesh, rock, prescribed=held, loads=loads)
    return system, fem.contact_pair(system, tags["left_right"], tags["right_left"])


def grow(cell: float, even: float, growth: float, end: float) -> np.ndarray:
    """Return places from 0 to ``end``: even cells up to ``even``, then growing ones.

    Args:
        cell: size of the even cells [m].
        even: up to where they go [m].
        growth: of a cell over the one before.
        end: the last place [m].
    """
    places = list(np.arange(0.0, even + 0.5 * cell, cell))
    while places[-1] < end:
        places.append(places[-1] + growth * (places[-1] - places[-2]))
    growing = np.array(places)
    first = round(even / cell)
    stretch = (end - even) / (growing[-1] - even)
    growing[first:] = even + stretch * (growing[first:] - even)
    return growing


def place_nodes(points: np.ndarray, across: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Return the nodes of an even lattice on the unit square, moved to given columns and rows.

    Args:
        points: (n, 2) of the lattice.
        across: (k,) places of its columns [m].
        up: (l,) places of its rows [m].
    """
    columns = np.rint(points[:, 0] * (len(across) - 1)).astype(int)
    rows = np.rint(points[:, 1] * (len(up) - 1)).astype(int)
    return np.column_stack([across[columns], up[rows]])


def draw(found: Found, data: Data, path: Path) -> None:
    """Draw the shear of the stuck fault and the slip without friction, with the closed forms.

    Args:
        found: what ``figures`` returned.
        data: the numbers of the source.
        path: of the picture.
    """
    from vi_contact.validation.pictures import canvas, save

    y, shear, slip = found.curves["fault"]
    figure, axes = canvas(1, 2, (9.0, 4.2), sharey=True)
    left, right = axes[0]
    near = np.abs(y) < EVEN
    left.plot(shear[near], y[near], label="stuck fault")
    left.plot(
        [row["shear"] for row in data.rows],
        [row["y"] for row in data.rows],
        "x",
        color="black",
        label="closed form",
    )
    left.set_xlabel("shear [MPa]")
    left.set_ylabel("y [m]")
    right.plot(slip[near], y[near], label="without friction")
    right.axvline(0.18173, color="black", lw=0.7, ls="--", label="closed form, |y| < 75 m")
    right.set_xlabel("slip [m]")
    for axis in axes[0]:
        axis.legend()
    save(figure, path)
