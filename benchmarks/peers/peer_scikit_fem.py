"""Solve the three problems with scikit-fem.

It assembles; contact and time steps are written by hand.
"""

from typing import Any

import numpy as np
import problems
import skfem
from problems import BAR, SIGNORINI, THROWN, TOLERANCE
from scipy.sparse.linalg import splu
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity
from skfem.models.poisson import laplace, mass, unit_load

TITLE = "scikit-fem"
INSTALL = {"pip": ["scikit-fem==12.0.2"]}
WAYS = {
    "signorini": {
        "best": (
            "active sets of nodes around skfem.solve(*skfem.condense(…)), until the set repeats"
        ),
        "default": "penalty form on the facets of the ground, 1e3 E, Newton to 1e-8",
    },
    "thrown": {
        "best": "trapezoidal rule, ground nodes without mass, active sets on the ground's unknowns",
        "default": "trapezoidal rule, consistent mass, active sets on the ground's unknowns",
    },
    "bar": {
        "best": "trapezoidal rule, foot without mass, active sets on the foot's unknown",
        "default": "trapezoidal rule, consistent mass, active sets on the foot's unknown",
    },
}
STOPS = {
    "signorini": {"best": "set repeats", "default": "1e-8 (correction)"},
    "thrown": {"best": "set repeats", "default": "set repeats"},
    "bar": {"best": "set repeats", "default": "set repeats"},
}
BY_HAND = {
    "signorini": "the contact condition and its iteration",
    "thrown": "the contact condition and its iteration, the time steps",
    "bar": "the contact condition and its iteration, the time steps",
}


def version() -> str:
    """Return the version that the module tells."""
    return str(skfem.__version__)


def square(n: int) -> Any:
    """Return our mesh, the mesh as scikit-fem keeps it, and the basis of the displacements."""
    ours = problems.Square(n)
    mesh = skfem.MeshTri(ours.points.T, ours.triangles.T)
    return ours, mesh, skfem.Basis(mesh, skfem.ElementVector(skfem.ElementTriP1()))


def signorini(n: int, way: str) -> dict[str, Any]:
    """Solve the static square by active sets, or by a penalty of 1e3 E by default."""
    ours, mesh, basis = square(n)
    K = linear_elasticity(*lame_parameters(SIGNORINI["E"], SIGNORINI["nu"])).assemble(basis)
    top = basis.boundary(mesh.facets_satisfying(lambda x: x[1] == 1.0))
    f = skfem.LinearForm(lambda v, w: problems.traction(w.x[0]) * v[1]).assemble(top)
    held, ground = basis.nodal_dofs[0, ours.left], basis.nodal_dofs[1, ours.bottom]
    u, change, closed = np.zeros(basis.N), 1.0, np.full(n + 1, True)
    if way == "best":
        while True:
            u = skfem.solve(*skfem.condense(K, f, D=np.concatenate([held, ground[closed]])))
            wanted = np.where(closed, (K @ u - f)[ground] > 0.0, u[ground] < 0.0)
            if np.array_equal(wanted, closed):
                break
            closed = wanted
    else:
        floor = basis.boundary(mesh.facets_satisfying(lambda x: x[1] == 0.0))
        stiff = 1e3 * SIGNORINI["E"]
        tangent = skfem.BilinearForm(lambda u, v, w: stiff * (w.old[1] <= 0.0) * u[1] * v[1])
        for _ in range(100):
            A = K + tangent.assemble(floor, old=floor.interpolate(u))
            new = skfem.solve(*skfem.condense(A, f, D=held))
            change, u = np.linalg.norm(new - u) / np.linalg.norm(new), new
            if change < TOLERANCE:
                break
    return {"u": u[basis.nodal_dofs].T, "r": (K @ u - f)[ground]}


def thrown(way: str) -> dict[str, Any]:
    """Throw the square; the best way moves the mass of its ground to the nodes above."""
    ours, _, basis = square(THROWN["n"])
    K = linear_elasticity(*lame_parameters(THROWN["E"], THROWN["nu"])).assemble(basis)
    M = skfem.BilinearForm(lambda u, v, w: THROWN["rho"] * dot(u, v)).assemble(basis)
    ground, above = (
        basis.nodal_dofs[1, nodes] for nodes in (ours.bottom, ours.bottom + THROWN["n"] + 1)
    )
    v = np.zeros(basis.N)
    v[basis.nodal_dofs[1]] = -THROWN["speed"]
    if way == "best":
        M = without_mass(M, ground, above)
    return run(M, K, 0.0 * v, v, 0.0 * v, ground, THROWN["gap"], THROWN["dt"], THROWN["steps"])


def bar(way: str) -> dict[str, Any]:
    """Drop the bar; the best way moves the mass of its foot to the node above."""
    line = np.linspace(0.0, BAR["length"], BAR["elements"] + 1)
    basis = skfem.Basis(skfem.MeshLine(line), skfem.ElementLineP1())
    M, K = BAR["rho"] * mass.assemble(basis), BAR["E"] * laplace.assemble(basis)
    pull = -BAR["rho"] * BAR["gravity"] * unit_load.assemble(basis)
    foot, above = basis.nodal_dofs[0, :1], basis.nodal_dofs[0, 1:2]
    if way == "best":
        M = without_mass(M, foot, above)
        pull = -BAR["gravity"] * M.sum(axis=1).A1
    fall = np.full(basis.N, -BAR["gravity"])
    found = run(M, K, pull, 0.0 * pull, fall, foot, BAR["height"], BAR["dt"], BAR["steps"])
    start = BAR["rho"] * BAR["gravity"] * BAR["length"] * BAR["height"]
    energy = found["energy"] + start - found.pop("work")
    return found | {"foot": found["gap"], "energy": energy, "u": found["u"][basis.nodal_dofs[0]]}


def without_mass(M: Any, ground: Any, above: Any) -> Any:
    """Return the mass matrix with the mass of the ground's unknowns moved to those above them."""
    moved, mine = M.tolil(), np.asarray(M.sum(axis=1)).ravel()
    moved[ground], moved[:, ground] = 0.0, 0.0
    # of the ground, and of what it shared with its neighbours
    lost = mine - np.asarray(moved.sum(axis=1)).ravel()
    shared = np.setdiff1d(np.flatnonzero(lost), ground)
    moved[shared, shared] += lost[shared]
    moved[above, above] += lost[ground]
    return moved.tocsr()


def run(
    M: Any, K: Any, f: Any, v: Any, a: Any, ground: Any, gap: float, dt: float, steps: int
) -> dict[str, Any]:
    """Step on from u = 0 by the trapezoidal rule with contact at the end of the step."""
    u, rows, closed = 0.0 * v, [], np.full(len(ground), False)
    factor = splu((4.0 / dt**2 * M + K).tocsc())
    unit = np.zeros((len(v), len(ground)))
    unit[ground, np.arange(len(ground))] = 1.0
    reach = factor.solve(unit)
    flexible = reach[ground]
    for k in range(steps):
        free = factor.solve(f + M @ (4.0 / dt**2 * u + 4.0 / dt * v + a))
        for _ in range(50):
            r = np.zeros(len(ground))
            r[closed] = np.linalg.solve(
                flexible[np.ix_(closed, closed)], -gap - free[ground][closed]
            )
            height = gap + free[ground] + flexible @ r
            wanted = np.where(closed, r > 0.0, height < 0.0)
            if np.array_equal(wanted, closed):
                break
            closed = wanted
        new = free + reach @ r
        speed = 2.0 / dt * (new - u) - v
        u, v, a = new, speed, 2.0 / dt * (speed - v) - a
        rows.append((dt * (k + 1), r.sum(), height.min(), 0.5 * (v @ (M @ v) + u @ (K @ u)), f @ u))
    t, force, gaps, energy, work = np.array(rows).T
    return {"t": t, "force": force, "gap": gaps, "energy": energy, "work": work, "u": u}


if __name__ == "__main__":
    problems.main(globals())
