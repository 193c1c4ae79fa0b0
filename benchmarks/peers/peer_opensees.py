"""Solve the three problems with OpenSeesPy: elements tri31 and Truss on springs.

The springs have no tension, or a gap.
"""

from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import openseespy.opensees as ops
import problems
from problems import BAR, SIGNORINI, THROWN, Square, stiffness, traction_load

TITLE = "OpenSeesPy"
INSTALL = {"pip": ["openseespy"]}
WAYS = {
    "signorini": {
        "best": (
            "zeroLength elements with the material ENT (no tension), 1e16 N/m a node, Newton to "
            "1e-8 relative, UmfPack"
        ),
        "default": (
            "zeroLengthContact2D elements of 1000 E a node (OpenSees has no default penalty), "
            "Newton, BandGeneral"
        ),
    },
    "thrown": {
        "best": (
            "zeroLength elements with the material ElasticPPGap (the gap is its own), 10 E a node, "
            "integrator TRBDF2"
        ),
        "default": (
            "the same elements, 1000 E a node, integrator Newmark(0.5, 0.25), which its "
            "examples use"
        ),
    },
    "bar": {
        "best": (
            "Truss elements, zeroLength with ElasticPPGap of an element's stiffness, "
            "integrator TRBDF2"
        ),
        "default": (
            "the same elements, 1000 times an element's stiffness, integrator Newmark(0.5, 0.25), "
            "which its examples use"
        ),
    },
}
STOPS = {
    "signorini": {"best": "1e-8 (correction)", "default": "1e-8 (correction)"},
    "thrown": {"best": "1e-8 (correction)", "default": "1e-8 (correction)"},
    "bar": {"best": "1e-8 (correction)", "default": "1e-8 (correction)"},
}
BY_HAND = {
    "thrown": "energy: from recorded displacements and velocities",
    "bar": "energy: from recorded displacements and velocities",
}


def version() -> str:
    """Return the versions of the Python package and of OpenSees inside it."""
    from importlib.metadata import version as of

    return f"{of('openseespy')} (OpenSees {ops.version()})"


def signorini(n: int, way: str) -> dict[str, Any]:
    """Solve the static square on springs without tension, or on contact elements by default."""
    mesh = Square(n)
    ground = plane(mesh, SIGNORINI["E"], SIGNORINI["nu"])
    for node in mesh.left.tolist():
        ops.fix(node + 1, 1, 0)
    force = traction_load(mesh)
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    for node in mesh.top.tolist():
        ops.load(node + 1, 0.0, float(force[2 * node + 1]))
    if way == "best":
        ops.uniaxialMaterial("ENT", 2, 1e16)
        springs(mesh, ground)
    else:
        for k, node in enumerate(mesh.bottom.tolist()):
            ops.element(
                "zeroLengthContact2D",
                len(mesh.triangles) + 1 + k,
                node + 1,
                ground + k,
                1000.0 * SIGNORINI["E"],
                0.0,
                0.0,
                "-normal",
                0.0,
                1.0,
            )
    solver("UmfPack" if way == "best" else "BandGeneral", "LoadControl", 1.0)
    ops.analysis("Static")
    done(ops.analyze(1))
    u = np.array([ops.nodeDisp(node + 1) for node in range(len(mesh.points))])
    ops.reactions()
    return {"u": u, "r": np.abs([ops.nodeReaction(ground + k)[1] for k in range(n + 1)])}


def thrown(way: str) -> dict[str, Any]:
    """Throw the square at springs with a gap; its mass is lumped, as tri31 lumps it."""
    mesh = Square(THROWN["n"])
    ground = plane(mesh, THROWN["E"], THROWN["nu"], THROWN["rho"])
    count = len(mesh.points)
    for node in range(count):
        ops.setNodeVel(node + 1, 2, -THROWN["speed"], "-commit")
    ops.uniaxialMaterial(
        "ElasticPPGap", 2, (10.0 if way == "best" else 1000.0) * THROWN["E"], -1e30, -THROWN["gap"]
    )
    springs(mesh, ground)
    u, v, force = march(way, (1, count), (1, 2), (ground, ground + THROWN["n"]), 2, THROWN)
    # tri31 lumps it
    mass = np.repeat(
        np.bincount(mesh.triangles.ravel()) * THROWN["rho"] / (6.0 * THROWN["n"] ** 2), 2
    )
    strain = 0.5 * np.einsum("ti,ti->t", u, u @ stiffness(mesh, THROWN["E"], THROWN["nu"]))
    return {
        "t": THROWN["dt"] * np.arange(1, len(u) + 1),
        "force": force.sum(axis=1),
        "energy": 0.5 * v**2 @ mass + strain,
        "gap": THROWN["gap"] + u[:, 2 * mesh.bottom + 1].min(axis=1),
    }


def bar(way: str) -> dict[str, Any]:
    """Drop the bar of trusses on one spring with a gap."""
    n, h = BAR["elements"], BAR["length"] / BAR["elements"]
    mass = np.full(n + 1, BAR["rho"] * h)
    mass[[0, -1]] *= 0.5
    ops.wipe()
    ops.model("basic", "-ndm", 1, "-ndf", 1)
    ops.uniaxialMaterial("Elastic", 1, BAR["E"])
    ops.timeSeries("Constant", 1)
    ops.pattern("Plain", 1, 1)
    for k in range(n + 1):
        ops.node(k + 1, k * h)
        ops.load(k + 1, float(-mass[k] * BAR["gravity"]))
    for k in range(n):
        ops.element("Truss", k + 1, k + 1, k + 2, 1.0, 1, "-rho", BAR["rho"])
    ops.uniaxialMaterial(
        "ElasticPPGap", 2, (1.0 if way == "best" else 1000.0) * BAR["E"] / h, -1e30, -BAR["height"]
    )
    ops.node(n + 2, 0.0)
    ops.fix(n + 2, 1)
    ops.element("zeroLength", n + 1, n + 2, 1, "-mat", 2, "-dir", 1)
    u, v, force = march(way, (1, n + 1), (1,), (n + 2, n + 2), 1, BAR)
    energy = 0.5 * v**2 @ mass + 0.5 * BAR["E"] / h * (np.diff(u, axis=1) ** 2).sum(axis=1)
    energy += BAR["gravity"] * (u + BAR["height"]) @ mass
    return {
        "t": BAR["dt"] * np.arange(1, len(u) + 1),
        "force": force.ravel(),
        "energy": energy,
        "foot": BAR["height"] + u[:, 0],
        "u": u[-1],
    }


def plane(mesh: Square, E: float, nu: float, rho: float = 0.0) -> int:
    """Make the square of plane strain and a fixed node below each of its ground's nodes.

    It returns the first of these.
    """
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 2)
    ops.nDMaterial("ElasticIsotropic", 1, E, nu)
    for k, point in enumerate(mesh.points.tolist()):
        ops.node(k + 1, *point)
    for k, nodes in enumerate((mesh.triangles + 1).tolist()):
        ops.element("tri31", k + 1, *nodes, 1.0, "PlaneStrain", 1, 0.0, rho, 0.0, 0.0)
    ground = len(mesh.points) + 1
    for k, node in enumerate(mesh.bottom.tolist()):
        ops.node(ground + k, *mesh.points[node].tolist())
        ops.fix(ground + k, 1, 1)
    return ground


def springs(mesh: Square, ground: int) -> None:
    """Join the ground's nodes with springs of material 2."""
    for k, node in enumerate(mesh.bottom.tolist()):
        ops.element(
            "zeroLength", len(mesh.triangles) + 1 + k, ground + k, node + 1, "-mat", 2, "-dir", 2
        )


def solver(system: str, *integrator: Any) -> None:
    """Choose Newton's iteration to the common tolerance."""
    ops.constraints("Plain")
    ops.numberer("RCM")
    ops.system(system)
    ops.test("RelativeNormDispIncr", problems.TOLERANCE, 50)
    ops.algorithm("Newton")
    ops.integrator(*integrator)


def done(code: int) -> None:
    """Raise RuntimeError when OpenSees says that it failed."""
    if code:
        raise RuntimeError(f"OpenSees: analyze failed, returned {code}")


def march(
    way: str,
    nodes: tuple[int, int],
    dofs: tuple[int, ...],
    ground: tuple[int, int],
    normal: int,
    data: dict[str, Any],
) -> Any:
    """Run all steps; return displacements and velocities of the nodes and forces of the ground.

    Each has one row a step.
    """
    with TemporaryDirectory() as folder:
        for what in ("disp", "vel"):
            ops.recorder(
                "Node",
                "-file",
                f"{folder}/{what}",
                "-precision",
                16,
                "-nodeRange",
                *nodes,
                "-dof",
                *dofs,
                what,
            )
        ops.recorder(
            "Node",
            "-file",
            f"{folder}/reaction",
            "-precision",
            16,
            "-nodeRange",
            *ground,
            "-dof",
            normal,
            "reaction",
        )
        solver("UmfPack", *(("TRBDF2",) if way == "best" else ("Newmark", 0.5, 0.25)))
        ops.analysis("Transient")
        done(ops.analyze(data["steps"], data["dt"]))
        ops.wipe()  # closes the files
        return [np.loadtxt(f"{folder}/{what}", ndmin=2) for what in ("disp", "vel", "reaction")]


if __name__ == "__main__":
    problems.main(globals())
