"""Close an inclined crack in a large body by pressure, and let it slip."""

import math
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
    "pressure": "Pa",
    "half": "m",
    "inclination": "°",
    "friction_angle": "°",
    "mu_factor": "-",
    "side": "m",
}
# sizes of cells over the half length of the crack: at its tips, in its middle
SIZES = {"smallest": (0.01, 0.07), "coarse": (0.002, 0.03), "fine": (0.002, 0.012)}
# of the sizes of cells, over the distance from the tips and from the crack
GROWTH = {"smallest": 0.2, "coarse": 0.15, "fine": 0.1}
INNER = 0.9  # of the half length: where tractions and slips are judged
MEGA = 1e6
MILLI = 1e-3


@dataclass(frozen=True)
class CrackedSquare:
    """Describe the mesh of a square with an inclined line through its middle."""

    side: float  # half width [m]
    half: float  # of the line [m]
    angle: float  # rad
    sizes: tuple[float, float]  # of cells at the ends and along the line [m]
    growth: float  # of these sizes, over the distance

    def build(self, gmsh: Any) -> None:
        """Add it to Gmsh's current model."""
        geo = gmsh.model.geo
        corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        outer = [geo.addPoint(self.side * x, self.side * y, 0.0) for x, y in corners]
        sides = [geo.addLine(outer[k], outer[(k + 1) % 4]) for k in range(4)]
        surface = geo.addPlaneSurface([geo.addCurveLoop(sides)])
        way = self.half * math.cos(self.angle), self.half * math.sin(self.angle)
        ends = [geo.addPoint(sign * way[0], sign * way[1], 0.0) for sign in (-1.0, 1.0)]
        crack = [geo.addLine(*ends)]
        geo.synchronize()
        gmsh.model.mesh.embed(1, crack, 2, surface)
        for name, dim, tags in (("rock", 2, [surface]), ("sides", 1, sides), ("crack", 1, crack)):
            gmsh.model.setPhysicalName(dim, gmsh.model.addPhysicalGroup(dim, tags), name)
        self.grade(gmsh, crack, ends)
        with_field = {"Mesh.MeshSizeExtendFromBoundary": 0, "Mesh.MeshSizeFromPoints": 0}
        before = {name: gmsh.option.getNumber(name) for name in with_field}
        for name, value in with_field.items():
            gmsh.option.setNumber(name, value)
        gmsh.model.mesh.generate(2)
        for name, value in before.items():
            gmsh.option.setNumber(name, value)

    def grade(self, gmsh: Any, crack: list[int], ends: list[int]) -> None:
        """Let the sizes of cells grow with the distance from the crack and from its tips.

        Args:
            gmsh: its module.
            crack: tags of the curves of the crack.
            ends: tags of its ends.
        """
        fields = gmsh.model.mesh.field
        places = {"CurvesList": crack, "PointsList": ends}
        terms = []
        for size, (kind, tags) in zip(self.sizes[::-1], places.items(), strict=True):
            distance = fields.add("Distance")
            fields.setNumbers(distance, kind, tags)
            if kind == "CurvesList":
                fields.setNumber(distance, "NumPointsPerCurve", 400)
            sized = fields.add("MathEval")
            fields.setString(sized, "F", f"{size} + {self.growth} * F{distance}")
            terms.append(sized)
        least = fields.add("Min")
        fields.setNumbers(least, "FieldsList", terms)
        fields.setAsBackgroundMesh(least)


def figures(inputs: Inputs, fineness: str) -> Found:
    """Return tractions and slip of the crack.

    Args:
        inputs: the body, its load and its crack.
        fineness: a key of ``SIZES``.
    """
    angle = math.radians(inputs["inclination"])
    half = inputs["half"]
    tip, middle = (half * size for size in SIZES[fineness])
    square = CrackedSquare(inputs["side"], half, angle, (tip, middle), GROWTH[fineness])
    towards = -math.sin(angle), math.cos(angle)
    mesh, tags = fem.build_mesh(
        meshes.CutOpen(square, group="crack", towards=towards), MPI.COMM_WORLD
    )

    # the strain of a pressure along x alone, in plane strain
    E = inputs["E"]
    nu = inputs["nu"]
    shorten = (1.0 - nu**2) * inputs["pressure"] / E
    widen = nu * (1.0 + nu) * inputs["pressure"] / E
    strain = np.array([-shorten, widen])
    moved = fem.Prescribed(tags["sides"], lambda x, t: x * strain)
    system = fem.assemble(mesh, vc.LinearElastic(E=E, nu=nu, rho=2500.0), prescribed=moved)
    surface = fem.contact_pair(system, tags["crack_1"], tags["crack_2"])
    mu = inputs["mu_factor"] * math.tan(math.radians(inputs["friction_angle"]))
    friction = vc.Coulomb(mu) if mu > 0.0 else vc.Frictionless()
    problem = vc.ContactProblem(system, surface, friction=friction)
    state = vc.static_equilibrium(problem)
    found = Found()
    found.add_equilibrium(problem, state)

    # along the crack: distance from its middle, tractions and slip
    points = surface.everywhere(surface.points)
    along = points @ np.array([math.cos(angle), math.sin(angle)])
    weights = surface.everywhere(surface.weights)
    normal = -surface.everywhere(state.r_n) / weights
    r_t = np.zeros((surface.count, 1)) if state.r_t is None else state.r_t
    shear = np.abs(surface.everywhere(r_t)[:, 0]) / weights
    slip = np.abs(surface.everywhere(surface.slip(state.u, state.t))[:, 0])

    inner = np.abs(along) <= INNER * half
    share = weights[inner] / weights[inner].sum()
    mean = float(share @ normal[inner])
    exact = -inputs["pressure"] * math.sin(angle) ** 2
    driving = math.cos(angle) - math.sin(angle) * mu
    axis = 4.0 * (1.0 - nu**2) / E * inputs["pressure"] * math.sin(angle) * driving * half
    ellipse = axis * np.sqrt(1.0 - np.minimum(np.abs(along) / half, 1.0) ** 2)
    beyond = float(np.max(np.abs(normal[inner] - exact)))
    apart = float(np.max(np.abs(slip[inner] - ellipse[inner])))
    found.figures = {
        "t_N, inner 90 %": mean / MEGA,
        "shear, inner 90 %": float(share @ shear[inner]) / MEGA,
        "slip in the middle": float(slip[np.argmin(np.abs(along))]) / MILLI,
        "largest departure of t_N, inner 90 %, over t_N": beyond / abs(exact)
        if exact
        else math.nan,
        "largest departure of the slip from the ellipse, inner 90 %, over its axis": (
            apart / axis if axis else math.nan
        ),
    }
    order = np.argsort(along)
    found.curves["crack"] = tuple(
        values[order]
        for values in (along, normal / MEGA, shear / MEGA, slip / MILLI, ellipse / MILLI)
    )
    return found


def draw(found: Found, data: Data, path: Path) -> None:
    """Draw tractions and slip along the crack, with the closed form.

    Args:
        found: what ``figures`` returned.
        data: the numbers of the source.
        path: of the picture.
    """
    from vi_contact.validation.pictures import canvas, save

    along, normal, shear, slip, ellipse = found.curves["crack"]
    (row,) = data.rows
    figure, axes = canvas(1, 2, (10.0, 3.4))
    tractions, slips = axes[0]
    tractions.plot(along, normal, ".", ms=3, label="normal traction")
    tractions.plot(along, shear, ".", ms=3, label="shear")
    for value in (row["t_N"], row["shear"]):
        tractions.axhline(value, color="black", lw=0.7, ls="--")
    tractions.set_ylim(1.5 * row["t_N"], 1.7 * row["shear"])
    tractions.set_ylabel("traction [MPa]")
    slips.plot(along, slip, ".", ms=3, label="slip")
    slips.plot(along, ellipse, "--", color="black", lw=0.7, label="closed form")
    slips.set_ylabel("slip [mm]")
    for axis in axes[0]:
        axis.set_xlabel("along the crack [m]")
        axis.legend()
    save(figure, path)
