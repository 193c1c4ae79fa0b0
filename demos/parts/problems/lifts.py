"""State a retaining wall whose backfill is placed in lifts, and measure the moment at its stem.

The wall stands on elastic ground by contact alone, and the fill rubs on it. K0 is given nowhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem, laws, meshes
from vi_contact.core.algebra import Array

# Parameters
# --------------------------------------------------------------------------------------------------
SHAPE = Path(__file__).with_suffix(".geo")
CONCRETE = vc.LinearElastic(E=30e9, nu=0.2, rho=2500.0)
GROUND = vc.LinearElastic(E=325e6, nu=0.3, rho=2000.0)
SOIL = laws.MohrCoulomb(E=40e6, nu=0.3, rho=1900.0, cohesion=1e3, phi=34.0, psi=34.0)
ELASTIC = vc.LinearElastic(E=40e6, nu=0.3, rho=1900.0)
MU = 0.5  # of the fill on the wall, and of the wall on the ground
FOOT = (1.5, 0.6)  # of the stem [m], on the side of the fill
HEIGHT = 5.4  # of the fill above the foot [m]
LAYERS = 6  # of the mesh; a lift is one of them or several
WEIGHT = SOIL.rho * 9.80665  # [N/m³]
PAIRS = (
    ("stem_back", "fill_stem"),
    ("heel_top", "fill_heel"),
    ("heel_end", "fill_end"),
    ("base_bottom", "ground_base"),
)


@dataclass(frozen=True)
class Backfilled:
    """Hold what is measured of one wall.

    Attributes:
        name: of the variant.
        size: of the cells at the wall [m].
        heights: (lifts,) of the fill above the foot after each lift [m].
        thrusts: (lifts,) on the stem [N/m].
        moments: (lifts,) at its foot [N m/m].
        points: (m,) heights of contact points of the stem above the foot [m].
        pressures: (m,) contact pressures there in the end [Pa].
        certificate: the worst of all stages.
    """

    name: str
    size: float
    heights: Array
    thrusts: Array
    moments: Array
    points: Array
    pressures: Array
    certificate: float


class Wall:
    """Hold the mesh of wall, ground and layers of fill."""

    def __init__(self, comm: MPI.Comm, size: float, fill: Any) -> None:
        """Mesh it. Collective.

        Args:
            comm: the ranks.
            size: of the cells at the wall [m].
            fill: the material of all layers.
        """
        shape = meshes.GeoFile(path=SHAPE, numbers={"size": size})
        self.mesh, self.tags = fem.build_mesh(shape, comm)
        self.layers = [self.tags[f"fill_{k}"] for k in range(1, LAYERS + 1)]
        self.materials = [(self.tags["wall"], CONCRETE), (self.tags["ground"], GROUND)]
        self.materials += [(layer, fill) for layer in self.layers]

    def stand(self, layers: int) -> vc.ContactProblem:
        """Return the problem with so many layers of fill."""
        sides = [self.tags[side] for side in ("left_side", "right_side")]
        system = vc.with_weight(
            fem.assemble(
                self.mesh,
                self.materials,
                degree=2,
                clamped=self.tags["rock"],
                prescribed=[fem.Prescribed(side, components=(0,)) for side in sides],
                absent=self.layers[layers:],
            )
        )
        pairs = [fem.contact_pair(system, self.tags[a], self.tags[b]) for a, b in PAIRS]
        there = [pair.with_frictionless_corners() for pair in pairs if pair.total]
        surface = there[0] if len(there) == 1 else fem.joined_surfaces(*there)
        return vc.ContactProblem(system, surface, friction=vc.Coulomb(MU))


def backfill(comm: MPI.Comm, name: str, lifts: int, fill: Any, size: float) -> Backfilled:
    """Return what is measured of a wall whose fill is placed in so many lifts. Collective.

    Args:
        comm: the ranks.
        name: of the variant.
        lifts: 1, 2, 3 or 6.
        fill: its material.
        size: of the cells at the wall [m].
    """
    wall = Wall(comm, size, fill)
    problem = wall.stand(0)
    state = vc.static_equilibrium(problem)
    worst = state.certificate or 0.0
    stem = vc.Resultants("stem", part=wall.tags["stem_back"], centre=FOOT)
    rows = []
    for k in range(1, lifts + 1):
        problem, first = fem.place(problem, state, wall.stand(k * LAYERS // lifts))
        state = vc.static_equilibrium(problem, state=first)
        worst = max(worst, state.certificate or 0.0)
        rows.append(stem.start(problem, state))

    # pressures on the back of the stem, of all ranks
    surface = problem.surface
    points = np.asarray(surface.everywhere(surface.points))
    pressures = np.asarray(surface.everywhere(state.r_n / surface.weights))
    on_stem = (np.abs(points[:, 0] - FOOT[0]) < 1e-6 * HEIGHT) & (points[:, 1] > FOOT[1])
    return Backfilled(
        name=name,
        size=size,
        heights=HEIGHT / lifts * np.arange(1, lifts + 1),
        thrusts=np.array([row["N_stem"] for row in rows]),
        moments=np.array([row["M_stem"] for row in rows]),
        points=points[on_stem, 1] - FOOT[1],
        pressures=pressures[on_stem],
        certificate=worst,
    )


def find_by_hand() -> dict[str, float]:
    """Return coefficients of horizontal earth pressure K, of P = ½ K gamma h², without cohesion.

    The active one of Coulomb's wedge for a vertical rough wall and level fill is K_a cos(delta), of
    Rankine's smooth wall tan²(45° - phi/2), and that at rest Jaky's 1 - sin(phi).
    """
    phi = math.radians(SOIL.phi)
    delta = math.atan(MU)
    root = math.sqrt(math.sin(phi + delta) * math.sin(phi) / math.cos(delta))
    return {
        "active, Coulomb": (math.cos(phi) / (1.0 + root)) ** 2,
        "active, Rankine": math.tan(0.25 * math.pi - 0.5 * phi) ** 2,
        "at rest": 1.0 - math.sin(phi),
    }
