"""Let a fault in the plane rupture, and find when it arrives and how far it slips."""

from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem, laws, meshes, schemes
from vi_contact.validation import Data, Found, Inputs

UNITS = {
    "c_p": "m/s",
    "c_s": "m/s",
    "rho": "kg/m³",
    "normal": "Pa",
    "shear": "Pa",
    "loaded": "Pa",
    "nucleus": "m",
    "static": "-",
    "kinetic": "-",
    "distance": "m",
    "fault": "m",
    "arrived": "m/s",
    "duration": "s",
    "half": "m",
    "depth": "m",
}
SIZES = {"smallest": (500.0,), "coarse": (250.0,), "fine": (250.0, 125.0)}  # of elements [m]
COURANT = 0.5  # of the time in which the fastest wave passes an element
HOLDS = 1e12  # cohesion beyond the ends of the fault [Pa]
NEAR, FAR = 3e3, 9e3  # [m] from the middle


def figures(inputs: Inputs, fineness: str) -> Found:
    """Return arrivals of the rupture, slips, and how well its energy is divided.

    Args:
        inputs: the rock, the stress of the fault and its friction.
        fineness: a key of ``SIZES``.
    """
    found = Found()
    arrivals = []
    for size in SIZES[fineness]:
        run = rupture(inputs, size)
        found.add_run(run)
        surface = run.problem.surface
        x = surface.points[:, 0] - inputs["half"]
        order = np.argsort(x)
        x = x[order]
        dt = COURANT * size / inputs["c_p"]
        slip = np.abs(np.asarray(run.history["slip"])).reshape(-1, len(x))[:, order]
        rate = np.diff(slip, axis=0) / dt
        t = np.asarray(run.history["t"])[1:] - 0.5 * dt  # a rate is a mean over its step
        arrivals.append([find_arrival(x, t, rate, at, inputs["arrived"]) for at in (NEAR, FAR)])
    near, far = arrivals[-1]
    share = divide_energy(inputs, surface.weights[order], slip[-1])
    rubbed = float(run.history["loss_rubbing"][-1])
    names = ("arrival at 3 km", "arrival at 3 km, long elements")
    found.figures = dict.fromkeys(names, near)
    found.figures |= {
        "arrival at 9 km, elements of 125 m": far,
        "arrival at 9 km, long elements": far,
        # by order 2, that of elements and of the midpoint rule
        "arrival at 9 km, extrapolated": far + (far - arrivals[0][1]) / 3.0,
        "slip in the middle": float(np.interp(0.0, x, slip[-1])),
        "slip at 3 km": float(np.interp(NEAR, x, slip[-1])),
        "heat and fracture energy over the work of friction": share / rubbed if rubbed else np.nan,
    }
    found.curves["fault"] = (x, t, rate, slip[1:])
    return found


def rupture(inputs: Inputs, size: float) -> Any:
    """Return the run of a rupture on squares.

    Args:
        inputs: of the entry.
        size: edge of the squares [m].
    """
    half = inputs["half"]
    depth = inputs["depth"]
    c_p, c_s = inputs["c_p"], inputs["c_s"]
    nu = (c_p**2 - 2.0 * c_s**2) / (2.0 * (c_p**2 - c_s**2))
    E = 2.0 * inputs["rho"] * c_s**2 * (1.0 + nu)
    divisions = (round(2.0 * half / size), round(depth / size))
    block = meshes.BlockMesh(lengths=(2.0 * half, depth), divisions=divisions)
    blocks = meshes.TwoBlocks(lower=block, upper=block)
    mesh, tags = fem.build_mesh(blocks, MPI.COMM_WORLD)
    upper, lower = blocks.interface
    ends = [f"{side}_{end}" for side in ("lower", "upper") for end in ("left", "right")]
    far = [fem.Dashpots(tags[side]) for side in (*ends, "lower_bottom", "upper_top")]
    rock = vc.LinearElastic(E=E, nu=nu, rho=inputs["rho"])
    system = fem.assemble(mesh, rock, dashpots=far)
    surface = fem.contact_pair(system, tags[upper], tags[lower])

    def away(x: Any) -> Any:
        """Return distances of points (m, 2) from the middle of the fault (m,) [m]."""
        return np.abs(x[:, 0] - half)

    joint = laws.SlipWeakening(
        static=inputs["static"],
        kinetic=inputs["kinetic"],
        distance=inputs["distance"],
        cohesion=lambda x: np.where(away(x) < inputs["fault"], 0.0, HOLDS),
        prestress=laws.Prestress(
            normal=inputs["normal"],
            shear=lambda x: np.where(
                away(x) < inputs["nucleus"], inputs["loaded"], inputs["shear"]
            ),
            nucleate=True,
        ),
    )
    problem = vc.ContactProblem(system, surface, joint=joint, mass=vc.ConsistentMass())
    return vc.simulate(
        problem,
        scheme=schemes.Midpoint(),
        solver=vc.Condensed(),
        dt=COURANT * size / c_p,
        t_end=inputs["duration"],
        progress=False,
    )


def find_arrival(x: Any, t: Any, rate: Any, place: float, arrived: float) -> float:
    """Return when the slip rate at a place exceeds a threshold [s]; nan for never.

    Args:
        x: places (m,) [m], increasing.
        t: times (k,) [s].
        rate: slip rates (k, m) [m/s].
        place: where [m].
        arrived: the threshold [m/s].
    """
    there = np.array([np.interp(place, x, row) for row in rate])
    after = int(np.argmax(there > arrived))
    if after == 0:
        return float("nan")
    pair = slice(after - 1, after + 1)
    return float(np.interp(arrived, there[pair], t[pair]))


def divide_energy(inputs: Inputs, weights: Any, slip: Any) -> float:
    """Return the heat and the fracture energy [J/m] of slips by the area under the law.

    Args:
        inputs: of the entry.
        weights: of the points (m,) [m²/m].
        slip: that they have gone through (m,) [m].
    """
    drop = inputs["static"] - inputs["kinetic"]
    lost = np.minimum(slip / inputs["distance"], 1.0)
    fracture = drop * inputs["distance"] * lost * (1.0 - 0.5 * lost)
    return float(inputs["normal"] * weights @ (inputs["kinetic"] * slip + fracture))


def draw(found: Found, data: Data, path: Path) -> None:
    """Draw slip rates over place and time, with arrivals of the source, and the slip at the end.

    Args:
        found: what ``figures`` returned.
        data: the numbers of the source.
        path: of the picture.
    """
    from vi_contact.validation.pictures import canvas, save

    x, t, rate, slip = found.curves["fault"]
    (row,) = data.rows
    figure, axes = canvas(1, 2, (10.0, 3.8))
    diagram, profile = axes[0]
    diagram.grid(False)
    drawn = diagram.pcolormesh(x / 1e3, t, rate, cmap="viridis_r", shading="nearest", vmin=0.0)
    figure.colorbar(drawn, ax=diagram, label="slip rate [m/s]")
    times = [row["arrival_3"], row["arrival_6"], row["arrival_9"]]
    for sign in (-1.0, 1.0):
        diagram.plot([3.0 * sign, 6.0 * sign, 9.0 * sign], times, "o", mfc="none", mec="crimson")
    diagram.set(xlim=(-11.0, 11.0), xlabel="along the fault [km]", ylabel="time [s]")
    profile.plot(x / 1e3, slip[-1], lw=1.0, label="slip at the end")
    profile.plot([0.0, 3.0], [row["slip_0"], row["slip_3"]], "o", mfc="none", mec="crimson")
    profile.set(xlim=(-11.0, 11.0), xlabel="along the fault [km]", ylabel="slip [m]")
    profile.legend()
    save(figure, path)
