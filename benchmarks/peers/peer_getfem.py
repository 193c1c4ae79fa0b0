"""Solve the three problems with GetFEM.

The sources are its user documentation and the help texts of its Python interface.
"""

from typing import Any

import getfem as gf
import numpy as np
import problems
from problems import BAR, SIGNORINI, THROWN, TOLERANCE

TITLE = "GetFEM"
INSTALL = {"apt": ["python3-getfem"]}
WAYS = {
    "signorini": {
        "best": (
            "nodal contact brick, symmetric augmented Lagrangian, r = E, max_res 1e-8 of the load"
        ),
        "default": "nodal contact brick and solve without options, r = E",
        "default, scaled": "the same in units of force in which E = 1",
    },
    "thrown": {
        "best": (
            "units of force in which E = 1; add_Newmark_scheme(1/4, 1/2) and the nodal contact "
            "brick; mass bricks by regions: the lowest layer of elements has none, the next one "
            "has twice its own"
        ),
        "default": (
            "add_Newmark_scheme(1/4, 1/2), one mass brick, nodal contact brick; solve without "
            "options but 10 iterations at most"
        ),
    },
    "bar": {
        "best": (
            "units of force in which E = 1; add_Newmark_scheme(1/4, 1/2) and the basic contact "
            "brick; mass bricks by regions: the lowest element has none, the next one has twice "
            "its own"
        ),
        "default": (
            "add_Newmark_scheme(1/4, 1/2), one mass brick, basic contact brick; solve without "
            "options but 10 iterations at most"
        ),
    },
}
STOPS = {
    "signorini": {
        "best": "1e-8 (residual)",
        "default": "1e-8 (residual), built in",
        "default, scaled": "1e-8 (residual), built in",
    },
    "thrown": {"best": "1e-8 (residual)", "default": "1e-8 (residual), built in, or 10 iterations"},
    "bar": {"best": "1e-8 (residual)", "default": "1e-8 (residual), built in, or 10 iterations"},
}
FOOT, TOP, LEFT, BODY = 1, 2, 3, 4


def version() -> str:
    """Return the version of the package python3-getfem, as dpkg has it."""
    import subprocess

    gf.util_trace_level(0)
    return subprocess.run(
        ["dpkg-query", "-W", "-f", "${Version}", "python3-getfem"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout


def square(n: int) -> Any:
    """Return mesh with its regions, displacement space, integration and the unknowns in our order.

    The last is the number of every unknown.
    """
    gf.util_trace_level(0)
    ours = problems.Square(n)
    mesh = gf.Mesh("ptND", ours.points.T, ours.triangles.T)
    faces = mesh.outer_faces()
    normals = mesh.normal_of_faces(faces)
    mesh.set_region(FOOT, faces[:, normals[1] < -0.5])
    mesh.set_region(TOP, faces[:, normals[1] > 0.5])
    mesh.set_region(LEFT, faces[:, normals[0] < -0.5])
    space = gf.MeshFem(mesh, 2)
    space.set_fem(gf.Fem("FEM_PK(2,1)"))
    places = np.rint(n * space.basic_dof_nodes()).astype(int)
    order = np.lexsort((np.arange(places.shape[1]), places[0], places[1]))
    return mesh, space, gf.MeshIm(mesh, gf.Integ("IM_TRIANGLE(4)")), order


def elastic(space: Any, mim: Any, E: float, nu: float) -> Any:
    """Return a model of plane strain."""
    model = gf.Model("real")
    model.add_fem_variable("u", space)
    model.add_initialized_data("E", E)
    model.add_initialized_data("nu", nu)
    model.add_isotropic_linearized_elasticity_pstrain_brick(mim, "u", "E", "nu")
    return model


def pushes(space: Any) -> Any:
    """Return the order from left to right of the multipliers of the nodal contact brick."""
    foot = space.basic_dof_on_region(FOOT)
    return np.argsort(space.basic_dof_nodes()[0, foot[::2]])


def signorini(n: int, way: str) -> dict[str, Any]:
    """Solve the static square by the nodal contact brick, with forces over E or in newtons."""
    mesh, space, mim, order = square(n)
    unit = SIGNORINI["E"] if way == "default, scaled" else 1.0  # of force [N]
    model = elastic(space, mim, SIGNORINI["E"] / unit, SIGNORINI["nu"])
    model.add_source_term(mim, f"{1e6 / unit}*(2*X(1)-1.2)*Test_u(2)", TOP)
    model.add_normal_Dirichlet_condition_with_multipliers(mim, "u", 1, LEFT)
    model.add_variable("push", n + 1)
    model.add_initialized_data("r", SIGNORINI["E"] / unit)
    version = [2] if way == "best" else []
    model.add_nodal_contact_with_rigid_obstacle_brick(mim, "u", "push", "r", FOOT, "y", *version)
    model.solve(*(["max_res", TOLERANCE] if way == "best" else []))
    return {
        "u": model.variable("u")[order].reshape(-1, 2),
        "r": -unit * model.variable("push")[pushes(space)],
    }


def inertia(model: Any, mim: Any, space: Any, mesh: Any, rho: float, low: Any) -> Any:
    """Add time scheme and mass bricks, and return the mass matrix.

    `low`: elements of the two layers next to the foot.
    """
    body = np.setdiff1d(np.arange(mesh.nbcvs()), np.concatenate(low))
    model.add_Newmark_scheme("u", 0.25, 0.5)
    total = gf.Spmat("empty", space.nbdof(), space.nbdof())
    for number, (elements, factor) in enumerate(
        ((low[1], 2.0 if len(low[0]) else 1.0), (body, 1.0))
    ):
        mesh.set_region(BODY + number, np.stack([elements, np.full(len(elements), -1)]))
        model.add_initialized_data(f"rho{number}", factor * rho)
        model.add_mass_brick(mim, "Dot2_u", f"rho{number}", BODY + number)
        part = gf.asm_mass_matrix(mim, space, space, BODY + number)
        part.scale(factor * rho)
        total = gf.Spmat("add", total, part)
    return total


def thrown(way: str) -> dict[str, Any]:
    """Throw the square; the best way takes the mass from its lowest layer of elements."""
    n, gap, unit = THROWN["n"], THROWN["gap"], THROWN["E"] if way == "best" else 1.0  # of force [N]
    mesh, space, mim, _ = square(n)
    model = elastic(space, mim, THROWN["E"] / unit, THROWN["nu"])
    layers = np.split(np.arange(4 * n), 2) if way == "best" else (np.arange(0), np.arange(2 * n))
    M = inertia(model, mim, space, mesh, THROWN["rho"] / unit, layers)
    model.add_variable("push", n + 1)
    model.add_initialized_data("r", THROWN["E"] / unit)
    version = [2] if way == "best" else []
    model.add_nodal_contact_with_rigid_obstacle_brick(
        mim, "u", "push", "r", FOOT, f"y+{gap}", *version
    )
    model.set_variable("Previous_Dot_u", np.tile([0.0, -THROWN["speed"]], space.nbdof() // 2))
    foot = space.basic_dof_on_region(FOOT)[1::2]
    plain = gf.MeshFem(mesh, 1)
    plain.set_classical_fem(0)
    E, nu, one = THROWN["E"] / unit, THROWN["nu"], np.ones(plain.nbdof())
    lame, shear = E * nu / (1.0 + nu) / (1.0 - 2.0 * nu), 0.5 * E / (1.0 + nu)
    K = gf.asm_linear_elasticity(mim, space, plain, lame * one, shear * one)
    rows = run(model, M, K, way, THROWN["dt"], THROWN["steps"])
    return {
        "t": rows["t"],
        "force": unit * rows["force"],
        "energy": unit * rows["energy"],
        "gap": gap + np.array([u[foot].min() for u in rows["u"]]),
    }


def bar(way: str) -> dict[str, Any]:
    """Drop the bar; the best way takes the mass from its lowest element."""
    elements, weight, unit = (
        BAR["elements"],
        BAR["rho"] * BAR["gravity"],
        BAR["E"] if way == "best" else 1.0,
    )
    gf.util_trace_level(0)
    mesh = gf.Mesh("cartesian", np.linspace(0.0, BAR["length"], elements + 1))
    space, mim = gf.MeshFem(mesh, 1), gf.MeshIm(mesh, gf.Integ("IM_GAUSS1D(3)"))
    space.set_fem(gf.Fem("FEM_PK(1,1)"))
    order = np.argsort(space.basic_dof_nodes()[0])
    model = gf.Model("real")
    model.add_fem_variable("u", space)
    model.add_initialized_data("E", BAR["E"] / unit)
    model.add_generic_elliptic_brick(mim, "u", "E")
    layers = (np.array([0]), np.array([1])) if way == "best" else (np.arange(0), np.array([0]))
    M = inertia(model, mim, space, mesh, BAR["rho"] / unit, layers)
    model.add_initialized_data("weight", -weight / unit)
    model.add_source_term_brick(mim, "u", "weight")
    model.add_variable("push", 1)
    for name, value in (("r", BAR["E"] / unit), ("height", BAR["height"])):
        model.add_initialized_data(name, value)
    down = gf.Spmat("empty", 1, elements + 1)
    down.add(0, int(order[0]), -1.0)
    model.add_basic_contact_brick("u", "push", "r", down, "height")
    model.set_variable("Previous_Dot2_u", np.full(elements + 1, -BAR["gravity"]))
    one = gf.MeshFem(mesh, 1)
    one.set_classical_fem(0)
    K = gf.asm_laplacian(mim, space, one, np.full(one.nbdof(), BAR["E"] / unit))
    rows = run(model, M, K, way, BAR["dt"], BAR["steps"])
    up = (
        BAR["height"]
        + np.array([np.trapz(u[order], dx=BAR["length"] / elements) for u in rows["u"]])
        / BAR["length"]
    )
    return {
        "t": rows["t"],
        "force": unit * rows["force"],
        "foot": BAR["height"] + rows["u"][:, order[0]],
        "energy": unit * rows["energy"] + weight * BAR["length"] * up,
        "u": rows["u"][-1, order],
    }


def run(model: Any, M: Any, K: Any, way: str, dt: float, steps: int) -> dict[str, Any]:
    """Step on, and return histories of force, energy and displacements."""
    options = ["max_iter", 10, *(["max_res", TOLERANCE] if way == "best" else [])]
    rows, moved = [], []
    model.set_time_step(dt)
    for k in range(steps):
        model.solve(*options)
        u, v = model.variable("u"), model.variable("Dot_u")
        rows.append(
            (dt * (k + 1), -model.variable("push").sum(), 0.5 * (v @ M.mult(v) + u @ K.mult(u)))
        )
        moved.append(u)
        model.shift_variables_for_time_integration()
    t, force, energy = np.array(rows).T
    return {"t": t, "force": force, "energy": energy, "u": np.array(moved)}


if __name__ == "__main__":
    problems.main(globals())
