"""Throw half a ball at thick glass at many angles, and find how it leaves."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem, meshes
from vi_contact.exact import HertzImpact, contact_modulus
from vi_contact.validation import Data, Found, Inputs

UNITS = {
    "R": "m",
    "E": "Pa",
    "nu": "-",
    "rho": "kg/m³",
    "E_glass": "Pa",
    "nu_glass": "-",
    "rho_glass": "kg/m³",
    "speed": "m/s",
    "mu": "-",
    "mu_factor": "-",
    "anvil": "",
    "dashpots": "",
    "spin_term": "",
    "angle": "deg",
    "graph": "name",
}
FOOT = 1.3  # contact side over the largest contact radius of Hertz's impact at 0 deg
GROWTH = 1.2  # of the cells, over their number in that radius, with the distance from the foot
HEIGHT = 1.0e-8  # between ball and glass at the start [m]: what the facets of the ball leave out
LENGTH = 1.05  # of a run, over the time of Hertz's impact at its normal speed
LONGER = 1.5  # the same at the angles at which waves have to leave the glass
# angles [deg] at which more than a measured quantity is told or judged
RESTITUTION = (4.22, 20.22, 39.54, 71.07)
MOMENT = (20.22, 39.54)
WAVES = (20.22,)
SLIDING = (71.07, 79.23, 85.17)  # the whole contact slides all the time
DRAWN = (4.22, 20.22, 39.54)  # their forces are drawn


@dataclass(frozen=True)
class Fineness:
    """Say how finely an entry is computed.

    Attributes:
        cells: in the largest contact radius.
        depth: of the anvil [m], and as much to every side.
        steps: in the time of the impact at 0 deg.
    """

    cells: float
    depth: float
    steps: int


FINENESS = {
    "smallest": Fineness(cells=4, depth=0.012, steps=40),
    "coarse": Fineness(cells=4, depth=0.012, steps=100),
    "fine": Fineness(cells=8, depth=0.018, steps=200),
}


@dataclass(frozen=True)
class Bodies:
    """Hold ball and glass at rest.

    Attributes:
        problem: both just before they touch.
        ball: the cells of the ball.
        along: velocities in the unknowns of the equations, of a ball that moves along the glass
            with one metre a second.
        up: the same away from the glass.
    """

    problem: vc.ContactProblem
    ball: fem.Cells
    along: np.ndarray
    up: np.ndarray


def figures(inputs: Inputs, fineness: str) -> Found:
    """Return tangential restitution, spin, normal restitution and patch angle of every impact.

    Args:
        inputs: ball, glass, speed, friction; rows of angles.
        fineness: which of ``FINENESS``.
    """
    found = Found()
    fine = FINENESS[fineness]
    impact = hertz(inputs)
    bodies = set_up(inputs, impact, fine)
    runs = [throw(inputs, bodies, impact, fine, row["angle"]) for row in inputs.rows]
    for number, solution in vc.simulate_many(runs):
        if not isinstance(solution, vc.Solution):
            raise solution
        found.add_run(solution)
        row = inputs.rows[number]
        add_impact(found, inputs, row["angle"], row["graph"], solution.history)
    return found


def hertz(inputs: Inputs) -> HertzImpact:
    """Return the quasi-static impact at 0 deg, by which mesh and time steps are chosen."""
    bodies = [(inputs["E"], inputs["nu"])]
    if inputs["anvil"] == "glass":
        bodies.append((inputs["E_glass"], inputs["nu_glass"]))
    mass = inputs["rho"] * 4.0 / 3.0 * math.pi * inputs["R"] ** 3
    return HertzImpact(
        mass=mass, speed=inputs["speed"], modulus=contact_modulus(*bodies), radius=inputs["R"]
    )


def set_up(inputs: Inputs, impact: HertzImpact, fine: Fineness) -> Bodies:
    """Return half of the ball just above the glass.

    Args:
        inputs: of the entry.
        impact: tells the largest contact radius.
        fine: how finely it is meshed.
    """
    radius = impact.deepest.contact_radius
    on_glass = inputs["anvil"] == "glass"
    mesh, tags = fem.build_mesh(
        meshes.BallMesh(
            radius=inputs["R"],
            size=radius / fine.cells,
            foot=FOOT * radius,
            growth=GROWTH / fine.cells,
            coarsest=inputs["R"] / fine.cells,
            half=True,
            anvil=fine.depth if on_glass else None,
            height=HEIGHT,
        ),
        MPI.COMM_WORLD,
    )

    # the plane z = 0 is one of symmetry; waves leave the glass through its far sides
    alumina = vc.LinearElastic(E=inputs["E"], nu=inputs["nu"], rho=inputs["rho"])
    material: Any = alumina
    mirrors = [tags["side_z"]]
    dashpots: list[Any] = []
    if on_glass:
        glass = vc.LinearElastic(
            E=inputs["E_glass"], nu=inputs["nu_glass"], rho=inputs["rho_glass"]
        )
        material = [(tags["ball"], alumina), (tags["anvil"], glass)]
        mirrors.append(tags["anvil_side_z"])
        dashpots = [fem.Dashpots(tags["anvil_far"])] if inputs["dashpots"] else []
    held = [fem.Prescribed(facets, components=(2,)) for facets in mirrors]
    system = fem.assemble(mesh, material, prescribed=held, dashpots=dashpots)

    # the glass is side 1: the direction of contact is that of its plane, along which the ball moves
    if on_glass:
        surface = fem.contact_pair(
            system, tags["anvil_foot"], tags["cap"], matching=fem.DualMortar()
        )
    else:
        plane = vc.HalfSpace(point=(0.0, 0.0, 0.0), normal=(0.0, 1.0, 0.0))
        surface = fem.contact_surface(system, tags["foot"], obstacle=plane)
    mu = inputs["mu_factor"] * inputs["mu"]
    friction = vc.Coulomb(mu) if mu > 0.0 else vc.Frictionless()
    problem = vc.ContactProblem(system, surface, friction=friction)

    # Impacts differ in their first velocities alone, so that all of them share their matrices.
    own = np.isin(system.space.bodies, fem.bodies_of(system, tags["ball"]))
    along, up = (
        replace(problem, system=replace(system, v0=np.where(own, unit, 0.0))).equations.v0
        for unit in system.influence.T[:2]
    )
    return Bodies(problem, tags["ball"], along, up)


def throw(
    inputs: Inputs, bodies: Bodies, impact: HertzImpact, fine: Fineness, angle: float
) -> Mapping[str, Any]:
    """Return the arguments of the run of one impact.

    Args:
        inputs: of the entry.
        bodies: ball and glass at rest.
        impact: that at 0 deg, which all time steps are a part of.
        fine: how many steps it has.
        angle: between the velocity and the normal [deg].
    """
    theta = math.radians(angle)
    down = inputs["speed"] * math.cos(theta)
    v = inputs["speed"] * math.sin(theta) * bodies.along - down * bodies.up
    rest = np.zeros(bodies.problem.surface.count)
    state = vc.State(0.0, 0, np.zeros(len(v)), v, rest, rest > 0.0)
    duration = replace(impact, speed=down).duration
    return {
        "problem": bodies.problem,
        "state": state,
        "dt": impact.duration / fine.steps,
        "t_end": (LONGER if angle in WAVES else LENGTH) * duration + HEIGHT / down,
        "record": [vc.Energy(), vc.Contact(arrays=False), vc.BodyMotion("ball", bodies.ball)],
    }


def add_impact(
    found: Found, inputs: Inputs, angle: float, graph: str, history: Mapping[str, np.ndarray]
) -> None:
    """Take the figures of one impact.

    Args:
        found: takes them, and what is drawn.
        inputs: of the entry.
        angle: between the velocity and the normal [deg].
        graph: what was measured at it, "e_t" or "spin".
        history: of the run.
    """
    if history["contact_resultant"][-1] > 0.0:
        raise vc.StepFailure(f"the impact at {angle:g} deg did not end in the time of its run")
    name = f"{angle:g} deg"
    radius = inputs["R"]
    along = history["mean_v_x_ball"]
    up = history["mean_v_y_ball"]
    spin = -float(history["spin_z_ball"][-1])
    e_t = float(along[-1] / along[0])
    e_n = float(-up[-1] / up[0])

    # the velocity of the contact patch after the impact: that of the ball less that of its spin
    turning = radius * spin if inputs["spin_term"] else 0.0
    patch = math.degrees(math.atan((along[-1] - turning) / up[-1]))

    # An impulse mu (1 + e_n) m v_n of gross sliding takes away as much speed along the plane. By
    # its moment about the centre a ball with J = 2/5 m R² gets 5/2 of that speed over R as spin.
    mu = inputs["mu_factor"] * inputs["mu"]
    ratio = mu * (1.0 + e_n) / math.tan(math.radians(angle))
    sliding = {
        "e_t": 1.0 - ratio,
        "spin": 2.5 * along[0] * ratio / radius,
        "patch": math.degrees(math.atan(along[0] * (1.0 - 3.5 * ratio) / up[-1])),
    }
    on_ball = 1.0 if inputs["anvil"] == "glass" else -1.0  # friction is told of the first body
    friction = history.get("friction_force_x", 0.0 * history["t"])
    found.curves[name] = {
        "angle": angle,
        "e_t": e_t,
        "spin": spin,
        "patch": patch,
        "sliding": sliding,
        "t": history["t"],
        "N": history["contact_resultant"],
        "T": on_ball * friction,
        "mu": mu,
        "moment": 2.5 * along[0] / radius,
    }

    found.figures[f"{graph}, {name}"] = {"e_t": e_t, "spin": spin}[graph]
    if angle in RESTITUTION:
        found.figures[f"e_n, {name}"] = e_n
    if angle in SLIDING:
        found.figures[f"e_t less that of gross sliding, {name}"] = e_t - sliding["e_t"]
        found.figures[f"patch angle less that of gross sliding, {name}"] = patch - sliding["patch"]
    if angle in MOMENT:  # of the tangential impulse, R about the centre
        moment = 2.5 * along[0] * (1.0 - e_t) / radius
        found.figures[f"spin over that of e_t, {name}"] = spin / moment if moment else math.nan
    if angle in WAVES:
        share = float(history["loss_damping"][-1] / wave_loss(history, spin))
        found.figures[f"share of the dashpots in the wave loss, {name}"] = share


def wave_loss(history: Mapping[str, np.ndarray], spin: float) -> float:
    """Return what the ball has lost as a rigid body and friction has not taken [J].

    Args:
        history: of the run.
        spin: after the impact [rad/s].
    """
    along = history["mean_v_x_ball"]
    up = history["mean_v_y_ball"]
    mass = history["momentum_x_ball"][0] / along[0]
    turning = 0.5 * abs(history["angular_momentum_z_ball"][-1] * spin)
    before = 0.5 * mass * (along[0] ** 2 + up[0] ** 2)
    after = 0.5 * mass * (along[-1] ** 2 + up[-1] ** 2) + turning
    return float(before - after - history["loss_friction"][-1])


def draw(found: Found, data: Data, path: Path) -> None:
    """Draw e_t, spin and patch angle over the angle, and the forces of three impacts."""
    from vi_contact.validation.pictures import canvas, save

    figure, axes = canvas(2, 2, (9.0, 6.4))
    impacts = sorted(found.curves.values(), key=lambda one: one["angle"])
    angles = [one["angle"] for one in impacts]
    panels: list[tuple[Any, str, str]] = [
        (axes[0, 0], "e_t", "tangential restitution e_t"),
        (axes[0, 1], "spin", "spin after the impact [rad/s]"),
        (axes[1, 0], "patch", "rebound angle of the contact patch [deg]"),
    ]
    for axis, key, words in panels:
        theory = [one["sliding"][key] for one in impacts]
        slides = [k for k, one in enumerate(impacts) if one["sliding"]["e_t"] > 5.0 / 7.0]
        axis.plot(angles, [one[key] for one in impacts], "o-", ms=3.5, lw=0.9, label="computed")
        axis.plot(
            [angles[k] for k in slides],
            [theory[k] for k in slides],
            color="0.5",
            ls="--",
            label="gross sliding",
        )
        measured = [row for row in data.rows if row.get(key) is not None]
        if measured:
            axis.plot(
                [row["angle"] for row in measured],
                [row[key] for row in measured],
                "kx",
                label="measured",
            )
        if key == "spin":  # what the moment about the centre asks for
            pairs = [(one, row) for one in impacts for row in data.rows]
            pairs = [pair for pair in pairs if pair[0]["angle"] == pair[1]["angle"]]
            asked = [
                (one["angle"], one["moment"] * (1.0 - row["e_t"]))
                for one, row in pairs
                if row["e_t"] is not None
            ]
            axis.plot(*np.transpose(asked), "k+", label="of measured e_t")
        axis.set_xlabel("angle from the normal [deg]")
        axis.set_ylabel(words)
        axis.legend()

    # T/(mu N) = 1 where all slides; T changes its sign where the ball rolls back
    axis = axes[1, 1]
    for one in impacts:
        if one["angle"] not in DRAWN:
            continue
        (line,) = axis.plot(1e6 * one["t"], one["T"], label=f"{one['angle']:g} deg")
        limit = one["mu"] * one["N"]
        for side in (limit, -limit):
            axis.plot(1e6 * one["t"], side, color=line.get_color(), lw=0.7, ls=":")
    axis.set_xlabel("time [µs]")
    axis.set_ylabel("friction [N]; dotted: ± mu N")
    axis.legend()
    save(figure, path)
