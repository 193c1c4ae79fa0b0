"""Push a wedge up a slope by a given way, and find the force that this takes."""

from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem, meshes
from vi_contact.validation import Data, Found, Inputs

UNITS = {
    "slope": "-",
    "E": "Pa",
    "nu": "-",
    "G": "N",
    "way": "m",
    "mu_factor": "-",
    "over": "",
    "mu": "-",
}
LENGTHS = (1.0, 0.5, 0.5)  # along the slope, up, across [m]
CELLS = {"smallest": (4, 2, 1), "coarse": (8, 4, 3), "fine": (16, 8, 6)}
SPACES = {"plane": 2, "space": 3}


def figures(inputs: Inputs, fineness: str) -> Found:
    """Return F/G for every mu, and the smallest share of the friction limit, T/(mu N).

    Args:
        inputs: slope, material, load, way; rows of mu.
        fineness: which of ``CELLS``.
    """
    found = Found()
    for place, dimension in SPACES.items():
        words = {"plane": "in the plane", "space": "in space"}[place]
        shares = []
        for row in inputs.rows:
            mu = inputs["mu_factor"] * row["mu"]
            ratio, share = push(found, inputs, mu, CELLS[fineness][:dimension])
            found.figures[f"F/G {words}, mu {row['mu']:g}"] = ratio
            shares.append(share)
        found.figures[f"smallest T/(mu N) of a point, {place}"] = min(shares)
    return found


def push(found: Found, inputs: Inputs, mu: float, cells: tuple[int, ...]) -> tuple[float, float]:
    """Return F/G, and the smallest T/(mu N) of a point (1 without friction).

    Args:
        found: takes the certificate.
        inputs: of the entry.
        mu: of friction.
        cells: along each side.
    """
    d = len(cells)
    lengths = LENGTHS[:d]
    slope = inputs["slope"]

    # the wedge on its slope, between walls without friction in space, and pushed at its left end
    def tilt(points: np.ndarray) -> np.ndarray:
        tilted = points.copy()
        tilted[:, 1] += slope * points[:, 0]
        return tilted

    block = meshes.BlockMesh(lengths=lengths, divisions=cells, deform=tilt)
    mesh, tags = fem.build_mesh(block, MPI.COMM_WORLD)
    weight = fem.BodyForce((0.0, -inputs["G"] / np.prod(lengths), 0.0)[:d])
    # not its lowest row of cells, whose nodes have contact conditions
    end = fem.Facets.where(
        "end", mesh, lambda x: np.isclose(x[0], 0.0) & (x[1] > 0.9 * lengths[1] / cells[1])
    )
    push_end = fem.Prescribed(end, (inputs["way"], 0.0, 0.0)[:d], components=(0,))
    across = [tags["back"], tags["front"]] if d == 3 else []
    sides = [fem.Prescribed(facets, components=(2,)) for facets in across]
    system = fem.assemble(
        mesh,
        vc.LinearElastic(E=inputs["E"], nu=inputs["nu"], rho=1.0),
        prescribed=[push_end, *sides],
        loads=weight,
    )
    ground = vc.HalfSpace(point=(0.0,) * d, normal=(-slope, 1.0, 0.0)[:d])
    surface = fem.contact_surface(system, tags["bottom"], obstacle=ground)
    friction = vc.Coulomb(mu) if mu > 0.0 else vc.Frictionless()
    problem = vc.ContactProblem(system, surface, friction=friction)
    state = vc.static_equilibrium(problem)
    found.add_equilibrium(problem, state)

    # F is what holds the left end where it is; N the sum of the normal reactions
    reactions = vc.Reactions("push", end, (0.0,) * d, loads=weight)
    force = reactions.start(problem, state)["reaction_x_push"]
    normal = surface.everywhere(state.r_n)
    below = {"G": inputs["G"], "N": float(normal.sum())}[inputs["over"]]
    if state.r_t is None or mu == 0.0:
        return force / below, 1.0
    tangential = np.linalg.norm(surface.everywhere(state.r_t), axis=1)
    pressed = normal > 0.0
    return force / below, float(np.min(tangential[pressed] / (mu * normal[pressed])))


def draw(found: Found, data: Data, path: Path) -> None:
    """Draw F/G over mu: the closed form, and what was found in the plane and in space.

    Args:
        found: what ``figures`` returned.
        data: the numbers of the source.
        path: of the picture.
    """
    from vi_contact.validation.pictures import canvas, save

    figure, axes = canvas(1, 1, (5.0, 3.2))
    axis: Any = axes[0, 0]
    mus = np.array([row["mu"] for row in data.rows], dtype=float)
    fine = np.linspace(0.0, 1.1 * mus.max(), 100)
    axis.plot(fine, (0.1 + fine) / (1.0 - 0.1 * fine), color="0.6", label="closed form")
    for words, marker in (("in the plane", "o"), ("in space", "x")):
        ratios = [found.figures[f"F/G {words}, mu {mu:g}"] for mu in mus]
        axis.plot(mus, ratios, marker, color="black", fillstyle="none", label=words)
    axis.set_xlabel("mu")
    axis.set_ylabel("F/G")
    axis.legend()
    save(figure, path)
