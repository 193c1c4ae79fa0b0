"""Set elastic dams on rigid rock, and find what the contact carries."""

from collections.abc import Mapping
from dataclasses import dataclass
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
    "water_weight": "kN/m³",
    "lower": "m",
    "uplift": "-",
    "mu_factor": "-",
    "dam": "name",
    "height": "m",
    "crest": "m",
    "base": "m",
    "batter": "m",
    "weight": "kN/m³",
    "water": "m",
    "tail": "m",
    "drain_at": "m",
    "drain_head": "m",
    "crest_load": "kPa",
    "mu": "-",
}
KILO = 1e3
# cells for a metre of height and, at least, along the base
A_METRE = {"smallest": 1, "coarse": 4, "fine": 8}
ALONG = {"smallest": 32, "coarse": 64, "fine": 192}


@dataclass(frozen=True)
class Dam:
    """Hold a dam and its water, in SI units; x runs downstream from the heel."""

    height: float
    crest: float
    base: float
    batter: float  # how far the upstream face leans over its height
    weight: float  # N/m³
    water_weight: float
    water: float
    tail: float
    heads: tuple[tuple[float, ...], tuple[float, ...]]  # places along the base, heads of uplift
    crest_load: float
    mu: float

    def press_upstream(self, points: np.ndarray, t: float) -> np.ndarray:
        """Return the pressure of the reservoir at points (k, 2)."""
        return self.water_weight * np.maximum(self.water - points[:, 1], 0.0)

    def press_downstream(self, points: np.ndarray, t: float) -> np.ndarray:
        """Return the pressure of the tailwater at points (k, 2)."""
        return self.water_weight * np.maximum(self.tail - points[:, 1], 0.0)

    def lift(self, points: np.ndarray, t: float) -> np.ndarray:
        """Return the uplift at points (k, 2)."""
        return self.water_weight * np.interp(points[:, 0], *self.heads)

    def shape(self, points: np.ndarray) -> np.ndarray:
        """Return points of a rectangle, base x height, as points of the dam."""
        level = points[:, 1] / self.height
        low = level * self.batter
        width = self.base + level * (self.crest - self.base)
        return np.column_stack([low + width * points[:, 0] / self.base, points[:, 1]])

    def sums(self) -> tuple[float, float]:
        """Return the vertical and the horizontal sum of all loads [N/m]."""
        places, heads = self.heads
        steps = np.diff(places)
        uplift = float(np.sum(0.5 * steps * (np.array(heads[1:]) + heads[:-1])))
        downstream = self.base - self.crest - self.batter
        on_faces = self.batter * self.water**2 + downstream * self.tail**2
        weight = 0.5 * (self.base + self.crest) * self.height * self.weight
        down = 0.5 * on_faces / self.height - uplift
        across = 0.5 * (self.water**2 - self.tail**2)
        loads = weight + self.crest * self.crest_load
        return loads + self.water_weight * down, self.water_weight * across


def read_dam(inputs: Inputs, row: Mapping[str, Any]) -> Dam:
    """Return the dam of a row of data.csv."""
    water = row["water"] - inputs["lower"]
    places = [0.0, row["base"]]
    heads = [water, row["tail"]]
    if row["drain_at"] is not None:
        places.insert(1, row["drain_at"])
        heads.insert(1, row["drain_head"])
    return Dam(
        height=row["height"],
        crest=row["crest"],
        base=row["base"],
        batter=row["batter"],
        weight=KILO * row["weight"],
        water_weight=KILO * inputs["water_weight"],
        water=water,
        tail=row["tail"],
        heads=(tuple(places), tuple(inputs["uplift"] * head for head in heads)),
        crest_load=KILO * row["crest_load"],
        mu=inputs["mu_factor"] * row["mu"],
    )


def figures(inputs: Inputs, fineness: str) -> Found:
    """Return resultants, linear stresses and the safety against sliding of every dam.

    Args:
        inputs: material, water; rows of dams.
        fineness: a key of ``ALONG``.
    """
    found = Found()
    for row in inputs.rows:
        dam = read_dam(inputs, row)
        add_dam(found, inputs, dam, f"dam {row['dam']}", fineness)
    return found


def add_dam(found: Found, inputs: Inputs, dam: Dam, name: str, fineness: str) -> None:
    """Compute a dam at rest and add its figures.

    Args:
        found: takes them.
        inputs: of the entry.
        dam: what is computed.
        name: of the dam in the figures.
        fineness: a key of ``ALONG``.
    """
    cells = ALONG[fineness], round(A_METRE[fineness] * dam.height)
    block = meshes.BlockMesh(lengths=(dam.base, dam.height), divisions=cells, deform=dam.shape)
    mesh, tags = fem.build_mesh(block, MPI.COMM_WORLD)
    loads: list[Any] = [
        fem.BodyForce((0.0, -dam.weight)),
        fem.Pressure(tags["left"], dam.press_upstream),
        fem.Pressure(tags["bottom"], dam.lift),
    ]
    if dam.tail:
        loads.append(fem.Pressure(tags["right"], dam.press_downstream))
    if dam.crest_load:
        loads.append(fem.Pressure(tags["top"], dam.crest_load))
    concrete = vc.LinearElastic(E=inputs["E"], nu=inputs["nu"], rho=dam.weight / 9.81)
    system = fem.assemble(mesh, concrete, loads=loads)
    rock = vc.HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=rock)
    friction = vc.Coulomb(dam.mu) if dam.mu > 0.0 else vc.Frictionless()
    problem = vc.ContactProblem(system, surface, friction=friction)
    state = vc.static_equilibrium(problem)
    found.add_equilibrium(problem, state)

    # resultants of the contact about the middle of the base; the water pushes to the right
    base = vc.Resultants("base", (0.5 * dam.base, 0.0))
    row = base.start(problem, state)
    vertical = row["N_base"]
    horizontal = -row["T_base"]
    eccentricity = row["e_base"]
    bent = 6.0 * eccentricity / dam.base
    mean = vertical / dam.base
    found.figures |= {
        f"V of {name}": vertical / KILO,
        f"H of {name}": horizontal / KILO,
        f"e of {name}": eccentricity,
        f"linear stress at the toe of {name}": mean * (1.0 + bent) / KILO,
        f"linear stress at the heel of {name}": mean * (1.0 - bent) / KILO,
        f"safety against sliding of {name}": dam.mu * vertical / horizontal,
        f"open share of the base of {name}": row["uplift_base"],
    }
    down, across = dam.sums()
    found.figures[f"V of {name} over the sum of its loads"] = vertical / down
    found.figures[f"H of {name} over the sum of its loads"] = horizontal / across
    pressure = surface.everywhere(state.r_n / surface.weights)
    found.figures[f"largest contact pressure of {name}"] = float(pressure.max()) / KILO

    # for the picture: pressures along the base, and what the linear formula has
    x = surface.everywhere(surface.points[:, 0])
    order = np.argsort(x)
    linear = mean * (1.0 + bent * (2.0 * x[order] / dam.base - 1.0))
    found.curves[name] = (x[order], pressure[order] / KILO, linear / KILO)


def draw(found: Found, data: Data, path: Path) -> None:
    """Draw the contact pressure along the base of each dam beside the linear formula.

    Args:
        found: what ``figures`` returned.
        data: the numbers of the source.
        path: of the picture.
    """
    from vi_contact.validation.pictures import canvas, save

    figure, axes = canvas(1, len(found.curves), (5.0 * len(found.curves), 3.2))
    for axis, (name, (x, pressure, linear)) in zip(axes[0], found.curves.items(), strict=True):
        axis.plot(x, pressure, label="contact")
        axis.plot(x, linear, "--", color="0.4", label="linear formula")
        axis.set_ylim(min(1.3 * linear.min(), 0.0) - 5.0, 1.6 * linear.max())
        axis.set_title(name)
        axis.set_xlabel("from heel to toe [m]")
        axis.set_ylabel("pressure [kPa]")
        axis.legend()
    save(figure, path)
