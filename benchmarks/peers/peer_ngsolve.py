"""Solve the three problems with NGSolve: forms of penalty at the ground, its Newton iterations.

Its time steps are used as well.
"""

from collections.abc import Callable
from typing import Any

import ngsolve as ng
import numpy as np
import problems
from netgen.meshing import Element0D, Element1D, Element2D, FaceDescriptor, MeshPoint, Pnt
from netgen.meshing import Mesh as Builder
from ngsolve.nonlinearsolvers import NewtonMinimization, NewtonSolver
from ngsolve.timestepping import Newmark
from problems import BAR, SIGNORINI, THROWN, Square

TITLE = "NGSolve"
INSTALL = {"pip": ["ngsolve"]}
WAYS = {
    "signorini": {
        "best": (
            "energy of penalty on the boundary, integrated at the nodes, 1e8 E/h, "
            "NewtonMinimization to 1e-8 of the root of the energy"
        ),
        "default": (
            "ContactBoundary of the square and a fixed block below it, energy of penalty 1000 E/h "
            "with the default rule of order 4, NewtonMinimization with its default tolerance"
        ),
    },
    "thrown": {
        "best": (
            "own midpoint rule with the discrete gradient of the penalty's energy, which conserves "
            "their sum; 10 E/h, NewtonSolver"
        ),
        "default": (
            "ngsolve.timestepping.Newmark (average acceleration) with penalty 1000 E/h and a "
            "direct solver"
        ),
    },
    "bar": {
        "best": (
            "own midpoint rule with the discrete gradient of the penalty's energy, which conserves "
            "their sum; E/h, NewtonSolver"
        ),
        "default": (
            "ngsolve.timestepping.Newmark (average acceleration) with penalty 1000 E/h and a "
            "direct solver"
        ),
    },
}
STOPS = {
    "signorini": {"best": "1e-8 (root of energy)", "default": "1e-11, absolute, built in"},
    "thrown": {"best": "1e-8 (root of energy)", "default": "1e-8 (root of energy)"},
    "bar": {"best": "1e-8 (root of energy)", "default": "1e-8 (root of energy)"},
}
BY_HAND = {
    "signorini": "contact with rigid ground: the form of its penalty (best)",
    "thrown": "the form of the penalty; the time step (best)",
    "bar": "the form of the penalty; the time step (best)",
}
NODES = ng.IntegrationRule([(0.0, 0.0), (1.0, 0.0)], [0.5, 0.5])


def version() -> str:
    """Return the version that the module tells."""
    return str(ng.__version__)


def signorini(n: int, way: str) -> dict[str, Any]:
    """Solve the static square by a penalty at the nodes, or by ContactBoundary on a block."""
    square = Square(n)
    mesh = plane(square, block=way == "default")
    space = ng.VectorH1(
        mesh,
        order=1,
        dirichletx="left",
        dirichlet="block_bottom|block_top" if way == "default" else "",
    )
    u = ng.GridFunction(space)
    # a little contact, without which the first matrix is singular
    u.components[1].Set(-1e-9, definedon=mesh.Materials("body"))
    form = ng.BilinearForm(space, symmetric=True)
    d = space.TrialFunction()
    form += ng.Variation(strain_energy(d, **SIGNORINI) * ng.dx("body"))
    pull = ng.GridFunction(ng.H1(mesh, order=1))  # the traction is linear
    pull.vec.FV().NumPy()[square.top] = problems.traction(square.points[square.top, 0])
    form += ng.Variation(-pull * d[1] * ng.ds("top"))
    contact = ng.BilinearForm(space, symmetric=True)
    if way == "best":
        below = ng.Variation(
            0.5e8
            * SIGNORINI["E"]
            * n
            * ng.IfPos(-d[1], d[1] ** 2, 0.0)
            * ng.ds("bottom", intrules={ng.SEGM: NODES})
        )
        form += below
        contact += below
        code, _ = NewtonMinimization(
            form, u, maxerr=1e-8 * 15.0, inverse="sparsecholesky", printing=False
        )
    else:
        pair = ng.ContactBoundary(mesh.Boundaries("bottom"), mesh.Boundaries("block_top"))
        gap = (ng.y + d[1]) - (ng.y.Other() + d.Other()[1])
        pair.AddEnergy(ng.IfPos(-gap, 500.0 * SIGNORINI["E"] * n * gap**2, 0.0))
        pair.Update(u, form, maxdist=1.0 / n)
        code, _ = NewtonMinimization(form, u, printing=False)
        pair.Update(u, contact, maxdist=1.0 / n)
    if code:
        raise RuntimeError("NGSolve: Newton might not converge")
    force = u.vec.CreateVector()
    contact.Apply(u.vec, force)
    count = mesh.nv
    numbers = np.arange((n + 1) ** 2)
    return {
        "u": u.vec.FV().NumPy().reshape(2, count).T[numbers],
        "r": -force.FV().NumPy()[count:][: n + 1],
    }


def thrown(way: str) -> dict[str, Any]:
    """Throw the square at a penalty of 10 E/h, or by default of 1000 E/h, at the nodes."""
    square, stiff = (
        Square(THROWN["n"]),
        (10.0 if way == "best" else 1000.0) * THROWN["E"] * THROWN["n"],
    )
    mesh = plane(square)
    space = ng.VectorH1(mesh, order=1)
    speed = ng.GridFunction(space)
    speed.vec.FV().NumPy()[mesh.nv :] = -THROWN["speed"]
    u, w = space.TnT()
    gaps: list[float] = []
    strain = ng.BilinearForm(space, symmetric=True)
    strain += ng.InnerProduct(stress(u, THROWN["E"], THROWN["nu"]), ng.Sym(ng.Grad(w))) * ng.dx
    found = march(
        way,
        strain,
        lambda d: THROWN["gap"] + d[1],
        (w[1], ng.ds("bottom", intrules={ng.SEGM: NODES})),
        stiff,
        speed,
        THROWN,
        lambda d: gaps.append(
            THROWN["gap"] + float(d.vec.FV().NumPy()[mesh.nv :][square.bottom].min())
        ),
    )
    return found | {"gap": gaps}


def bar(way: str) -> dict[str, Any]:
    """Drop the bar on a penalty of E/h, or by default of 1000 E/h, at its foot."""
    n, stiff = (
        BAR["elements"],
        (1.0 if way == "best" else 1000.0) * BAR["E"] * BAR["elements"] / BAR["length"],
    )
    mesh = interval(n, BAR["length"])
    space = ng.H1(mesh, order=1)
    u, w = space.TnT()
    weights, feet, end = [], [], ng.GridFunction(space)
    share = ng.LinearForm(BAR["rho"] * BAR["gravity"] * w * ng.dx).Assemble()
    strain = ng.BilinearForm(space, symmetric=True)
    strain += BAR["E"] * ng.Grad(u)[0] * ng.Grad(w)[0] * ng.dx

    def note(d: Any) -> None:
        feet.append(BAR["height"] + float(d.vec[0]))
        weights.append(ng.InnerProduct(share.vec, d.vec))
        end.vec.data = d.vec

    found = march(
        way,
        strain,
        lambda d: BAR["height"] + d,
        (w, ng.ds("foot")),
        stiff,
        ng.GridFunction(space),
        BAR,
        note,
        BAR["gravity"],
    )
    high = BAR["rho"] * BAR["gravity"] * BAR["length"] * BAR["height"]
    return found | {
        "foot": feet,
        "u": end.vec.FV().NumPy(),
        "energy": np.array(found["energy"]) + np.array(weights) + high,
    }


def march(
    way: str,
    strain: Any,
    gap: Callable[[Any], Any],
    virtual: tuple[Any, Any],
    stiff: float,
    speed: Any,
    data: dict[str, Any],
    note: Callable[[Any], None],
    gravity: float = 0.0,
) -> dict[str, Any]:
    """Run all steps; contact forces do work on `virtual`, on a part of the boundary.

    `note` is told the displacements of each step's end.
    """
    space, dt = strain.space, data["dt"]
    u, w = space.TnT()
    now, new, acceleration = ng.GridFunction(space), ng.GridFunction(space), ng.GridFunction(space)
    inertia = ng.BilinearForm(space, symmetric=True)
    inertia += data["rho"] * u * w * ng.dx
    inertia.Assemble()
    strain.Assemble()
    weight = data["rho"] * gravity * w * ng.dx
    force = ng.BilinearForm(space)
    if way == "best":
        a, b = (ng.IfPos(g, 0.0, g) for g in (gap(now), gap(u)))
        both = ng.IfPos(gap(now), 0.0, ng.IfPos(gap(u), 0.0, 1.0))
        moved = ng.IfPos(ng.Norm(gap(u) - gap(now)) - 1e-300, gap(u) - gap(now), 1.0)
        push = (
            0.5
            * stiff
            * (a + b)
            * ng.IfPos(both - 0.5, 1.0, (b - a) / moved)
            * virtual[0]
            * virtual[1]
        )
        form = ng.BilinearForm(space)
        form += data["rho"] * 2.0 / dt * ((u - now) / dt - speed) * w * ng.dx + push
        form += strained(u, w, data, 0.5) + strained(now, w, data, 0.5)
        if gravity:
            form += weight
        newton = NewtonSolver(form, new, inverse="umfpack")
    else:
        push = stiff * ng.IfPos(gap(u), 0.0, gap(u)) * virtual[0] * virtual[1]
        equation = data["rho"] * u.dt.dt * w * ng.dx + strained(u, w, data) + push
        if gravity:
            equation += weight
            acceleration.vec[:] = -gravity
        rule = Newmark(
            equation,
            dt,
            lin_solver_cls=lambda mat, pre: mat.Inverse(space.FreeDofs(), inverse="umfpack"),
            pc_cls=ng.preconditioners.Local,
        )
    force += push
    told, energy, forces = np.arange(1, data["steps"] + 1) * dt, [], []
    pushed, product = new.vec.CreateVector(), new.vec.CreateVector()
    for _ in told:
        if way == "best":
            new.vec.data = now.vec + dt * speed.vec
            code, _ = newton.Solve(maxerr=problems.TOLERANCE * root(data))
            if code:
                raise RuntimeError("NGSolve: Newton might not converge")
            force.Apply(new.vec, pushed)
            product.data = 2.0 / dt * (new.vec - now.vec) - speed.vec
            speed.vec.data = product
            now.vec.data = new.vec
        else:
            rule.Step(
                now, speed, acceleration, newton_args={"maxerr": problems.TOLERANCE * root(data)}
            )
            force.Apply(now.vec, pushed)
        forces.append(-float(np.sum(pushed.FV().NumPy())))
        product.data = inertia.mat * speed.vec
        kinetic = 0.5 * ng.InnerProduct(product, speed.vec)
        product.data = strain.mat * now.vec
        energy.append(kinetic + 0.5 * ng.InnerProduct(product, now.vec))
        note(now)
    return {"t": told, "force": forces, "energy": energy}


def root(data: dict[str, Any]) -> float:
    """Return the root of the first energy.

    NGSolve's tolerance is absolute, and means the root of residual times correction.
    """
    return float(
        np.sqrt(
            0.5 * data["rho"] * data["speed"] ** 2
            if "speed" in data
            else data["rho"] * data["gravity"] * data["length"] * data["height"]
        )
    )


def strained(u: Any, w: Any, data: dict[str, Any], part: float = 1.0) -> Any:
    """Return a part of the virtual work of the stresses of u."""
    if "nu" in data:
        return part * ng.InnerProduct(stress(u, data["E"], data["nu"]), ng.Sym(ng.Grad(w))) * ng.dx
    return part * data["E"] * ng.Grad(u)[0] * ng.Grad(w)[0] * ng.dx


def stress(u: Any, E: float, nu: float) -> Any:
    """Return the stress of plane strain."""
    e = ng.Sym(ng.Grad(u))
    return E / (1.0 + nu) * (e + nu / (1.0 - 2.0 * nu) * ng.Trace(e) * ng.Id(2))


def strain_energy(u: Any, E: float, nu: float) -> Any:
    """Return its energy's density."""
    return 0.5 * ng.InnerProduct(stress(u, E, nu), ng.Sym(ng.Grad(u)))


def plane(square: Square, block: bool = False) -> Any:
    """Return the square's mesh, with a block of one cell's height under it if asked."""
    build, n = Builder(dim=2), square.n
    points = [build.Add(MeshPoint(Pnt(x, y, 0.0))) for x, y in square.points.tolist()]
    sides = {
        "bottom": square.bottom,
        "top": square.top[::-1],
        "left": square.left[::-1],
        "right": square.left + n,
    }
    build.Add(FaceDescriptor(surfnr=1, domin=1, bc=1))
    build.SetMaterial(1, "body")
    for nodes in square.triangles.tolist():
        build.Add(Element2D(1, [points[node] for node in nodes]))
    if block:
        corners = [
            build.Add(MeshPoint(Pnt(x, y, 0.0)))
            for x, y in ((0, -1 / n), (1, -1 / n), (1, 0), (0, 0))
        ]
        build.Add(FaceDescriptor(surfnr=2, domin=2, bc=2))
        build.SetMaterial(2, "block")
        for nodes in ((0, 1, 2), (0, 2, 3)):
            build.Add(Element2D(2, [corners[node] for node in nodes]))
    for number, (name, nodes) in enumerate(sides.items(), 1):
        for a, b in zip(nodes[:-1].tolist(), nodes[1:].tolist(), strict=True):
            build.Add(Element1D([points[a], points[b]], index=number))
        build.SetBCName(number - 1, name)
    if block:
        for number, name, a, b in ((5, "block_bottom", 0, 1), (6, "block_top", 2, 3)):
            build.Add(Element1D([corners[a], corners[b]], index=number))
            build.SetBCName(number - 1, name)
    return ng.Mesh(build)


def interval(n: int, length: float) -> Any:
    """Return the bar's mesh."""
    build = Builder(dim=1)
    points = [build.Add(MeshPoint(Pnt(length * k / n, 0.0, 0.0))) for k in range(n + 1)]
    for a, b in zip(points[:-1], points[1:], strict=True):
        build.Add(Element1D([a, b], index=1))
    for number, name, point in ((1, "foot", points[0]), (2, "head", points[-1])):
        build.Add(Element0D(point, index=number))
        build.SetBCName(number - 1, name)
    return ng.Mesh(build)


if __name__ == "__main__":
    problems.main(globals())
