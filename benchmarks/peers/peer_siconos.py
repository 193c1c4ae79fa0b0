"""Solve the three problems with Siconos.

The sources are the help texts of its Python interface and its manual.
"""

from typing import Any

import numpy as np
import problems
import siconos.kernel as kernel
import siconos.numerics as numerics
from problems import BAR, SIGNORINI, THROWN
from scipy.sparse.linalg import splu

TITLE = "Siconos"
INSTALL = {"apt": ["python3-siconos"]}
WAYS = {
    "signorini": {
        "best": (
            "linear complementarity problem of the contact nodes by Lemke's method, which is "
            "also the default"
        ),
    },
    "thrown": {
        "best": (
            "TimeSteppingDirectProjection, Moreau-Jean with theta = 1/2 and e = 0: positions "
            "are projected too"
        ),
        "default": (
            "TimeStepping, Moreau-Jean with theta = 1/2 and e = 0, LCP with its default solver"
        ),
    },
    "bar": {
        "best": (
            "TimeSteppingDirectProjection, Moreau-Jean with theta = 1/2 and e = 0: positions "
            "are projected too"
        ),
        "default": (
            "TimeStepping, Moreau-Jean with theta = 1/2 and e = 0, LCP with its default solver"
        ),
    },
}
STOPS = {
    "signorini": {"best": "pivoting ends"},
    "thrown": {"best": "pivoting ends; projection built in", "default": "pivoting ends"},
    "bar": {"best": "pivoting ends; projection built in", "default": "pivoting ends"},
}
BY_HAND = {
    "signorini": (
        "mesh, matrices and the elimination of all nodes but those of the contact (it has no "
        "finite elements)"
    ),
    "thrown": "mesh and matrices (it has no finite elements)",
    "bar": "mesh and matrices (it has no finite elements)",
}


def version() -> str:
    """Return the version of the package python3-siconos, as dpkg has it."""
    import subprocess

    command = ["dpkg-query", "-W", "-f", "${Version}", "python3-siconos"]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def signorini(n: int, way: str) -> dict[str, Any]:
    """Solve the static square by Lemke's method on the Schur complement S of its ground."""
    mesh = problems.Square(n)
    K, f = problems.stiffness(mesh, **SIGNORINI).tocsc(), problems.traction_load(mesh)
    ground = 2 * mesh.bottom + 1
    free = np.setdiff1d(np.arange(len(f)), np.concatenate([2 * mesh.left, ground]))
    factor, coupling = splu(K[free][:, free]), K[free][:, ground].toarray()
    S = K[ground][:, ground].toarray() - coupling.T @ factor.solve(coupling)
    g = f[ground] - coupling.T @ factor.solve(f[free])
    y, r = np.zeros(n + 1), np.zeros(n + 1)  # r = S y - g
    options = numerics.SolverOptions(numerics.SICONOS_LCP_LEMKE)
    if numerics.lcp_lexicolemke(numerics.LCP(S, -g), y, r, options) != 0:
        raise RuntimeError("Lemke's method did not end")
    u = np.zeros(len(f))
    u[ground] = y
    u[free] = factor.solve(f[free] - coupling @ y)
    return {"u": u.reshape(-1, 2), "r": r}


def thrown(way: str) -> dict[str, Any]:
    """Throw the square with consistent mass as one Lagrangian system."""
    mesh = problems.Square(THROWN["n"])
    K, M = problems.stiffness(mesh, THROWN["E"], THROWN["nu"]), problems.mass(mesh, THROWN["rho"])
    v = np.tile([0.0, -THROWN["speed"]], len(mesh.points))
    return run(
        M.toarray(),
        K.toarray(),
        v,
        None,
        2 * mesh.bottom + 1,
        THROWN["gap"],
        way,
        THROWN["dt"],
        THROWN["steps"],
    )


def bar(way: str) -> dict[str, Any]:
    """Drop the bar of linear elements, with consistent mass."""
    h, nodes = BAR["length"] / BAR["elements"], BAR["elements"] + 1
    line = np.eye(nodes, k=1) + np.eye(nodes, k=-1)
    ends = np.diag(np.where(np.isin(np.arange(nodes), (0, nodes - 1)), 1.0, 2.0))
    M, K = BAR["rho"] * h / 6.0 * (2.0 * ends + line), BAR["E"] / h * (ends - line)
    pull = -BAR["gravity"] * M.sum(axis=1)
    found = run(M, K, np.zeros(nodes), pull, [0], BAR["height"], way, BAR["dt"], BAR["steps"])
    start = BAR["rho"] * BAR["gravity"] * BAR["length"] * BAR["height"]
    return found | {"foot": found["gap"], "energy": found["energy"] - found.pop("work") + start}


def run(
    M: Any, K: Any, v: Any, pull: Any, points: Any, gap: float, way: str, dt: float, steps: int
) -> dict[str, Any]:
    """Step on from u = 0, and return the histories."""
    body = kernel.LagrangianLinearTIDS(np.zeros(len(v)), v, M, K, np.zeros_like(K))
    if pull is not None:
        body.setFExtPtr(pull)
    model = kernel.NonSmoothDynamicalSystem(0.0, dt * steps)
    model.insertDynamicalSystem(body)
    law, contacts = kernel.NewtonImpactNSL(0.0), []
    for point in points:
        H = np.zeros((1, len(v)))
        H[0, point] = 1.0
        contacts.append(kernel.Interaction(law, kernel.LagrangianLinearTIR(H, [gap])))
        model.link(contacts[-1], body)
    clock = kernel.TimeDiscretisation(0.0, dt)
    if way == "best":
        positions = kernel.MLCPProjectOnConstraints()
        stepper = kernel.TimeSteppingDirectProjection(
            model, clock, kernel.MoreauJeanDirectProjectionOSI(0.5), kernel.LCP(), positions
        )
    else:
        stepper = kernel.TimeStepping(model, clock, kernel.MoreauJeanOSI(0.5), kernel.LCP())
    rows = []
    while stepper.hasNextEvent():
        stepper.computeOneStep()
        u, w = np.array(body.q()), np.array(body.velocity())
        impulse = sum(one.lambda_(1)[0] for one in contacts)
        work = 0.0 if pull is None else pull @ u
        rows.append(
            (
                stepper.nextTime(),
                impulse / dt,
                gap + u[points].min(),
                0.5 * (w @ M @ w + u @ K @ u),
                work,
            )
        )
        stepper.nextStep()
    t, force, gaps, energy, work = np.array(rows).T
    return {"t": t, "force": force, "gap": gaps, "energy": energy, "work": work, "u": u}


if __name__ == "__main__":
    problems.main(globals())
