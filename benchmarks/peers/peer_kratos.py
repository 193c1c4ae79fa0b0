"""Solve the three problems with Kratos.

Its contact is mortar contact by augmented Lagrangian (ALM) with a fixed strip below.
"""

import json
from typing import Any

import KratosMultiphysics as KM
import numpy as np
import problems
from KratosMultiphysics.StructuralMechanicsApplication.structural_mechanics_analysis import (
    StructuralMechanicsAnalysis,
)
from problems import BAR, SIGNORINI, THROWN, Square, traction_load

TITLE = "Kratos"
INSTALL = {
    "pip": [
        "KratosMultiphysics",
        "KratosLinearSolversApplication",
        "KratosStructuralMechanicsApplication",
        "KratosContactStructuralMechanicsApplication",
    ]
}
WAYS = {
    "signorini": {
        "best": (
            "ALM mortar contact, frictionless, all tolerances 1e-8, "
            "LinearSolversApplication.sparse_lu"
        ),
        "default": (
            "ALM mortar contact, frictionless, contact_residual_criterion as in its examples, "
            "else by default"
        ),
    },
    "thrown": {
        "best": (
            "ALM mortar contact, Bossak's scheme with alpha = -0.3, all tolerances 1e-8, sparse_lu"
        ),
        "default": (
            "ALM mortar, Bossak's scheme, contact_residual_criterion as in its examples, rest "
            "by default"
        ),
    },
    "bar": {
        "best": (
            "a strip one cell wide; ALM mortar contact, Bossak's scheme with alpha = -0.3, all "
            "tolerances 1e-8, sparse_lu"
        ),
        "default": (
            "a strip one cell wide; ALM mortar contact, Bossak's scheme, "
            "contact_residual_criterion as in its examples, all else by default"
        ),
    },
}
STOPS = {
    "signorini": {"best": "1e-8 (residual, correction)", "default": "1e-4 (residual), built in"},
    "thrown": {"best": "1e-8 (residual, correction)", "default": "1e-4 (residual), built in"},
    "bar": {"best": "1e-8 (residual, correction)", "default": "1e-4 (residual), built in"},
}
BY_HAND = {
    "signorini": "nodal contact forces: the residual of the displacements",
    "thrown": "energy: from displacements and velocities",
    "bar": "energy: from displacements and velocities",
}


def version() -> str:
    """Return the version of the installed package, with Kratos told to print errors alone."""
    from importlib.metadata import version as of

    quiet()
    return of("KratosMultiphysics")


class Run(StructuralMechanicsAnalysis):
    """Run an analysis whose model is made by nodes, cells and foot.

    It keeps what its nodes tell at every step.
    """

    def __init__(
        self, way: str, body: tuple[Any, Any], foot: list[int], data: dict[str, Any], **given: Any
    ) -> None:
        """Write the files of the model and read them."""
        self.points, self.foot, self.given, self.data = np.asarray(body[0]), foot, given, data
        self.told: list[tuple[Any, Any, float]] = []
        model_files(self.points, body[1], foot, data, given)
        super().__init__(KM.Model(), KM.Parameters(json.dumps(settings(way, data))))

    def Initialize(self) -> None:
        """Fix and start nodes."""
        super().Initialize()
        part = self.model["Structure"]
        self.body = [part.GetNode(k + 1) for k in range(len(self.points))]
        self.ground = list(part.GetSubModelPart("Ground").Nodes)
        for node in self.ground:
            node.Fix(KM.DISPLACEMENT_X)
            node.Fix(KM.DISPLACEMENT_Y)
        for k in self.given.get("held", []):
            self.body[k].Fix(KM.DISPLACEMENT_X)
        for node in self.body:
            if "speed" in self.data:
                node.SetSolutionStepValue(KM.VELOCITY_Y, 0, -self.data["speed"])
                node.SetSolutionStepValue(KM.VELOCITY_Y, 1, -self.data["speed"])
            if "gravity" in self.data:
                node.SetSolutionStepValue(KM.VOLUME_ACCELERATION_Y, -self.data["gravity"])
                node.SetSolutionStepValue(KM.ACCELERATION_Y, 0, -self.data["gravity"])
                node.SetSolutionStepValue(KM.ACCELERATION_Y, 1, -self.data["gravity"])

    def ApplyBoundaryConditions(self) -> None:
        """Set the loads."""
        super().ApplyBoundaryConditions()
        from KratosMultiphysics.StructuralMechanicsApplication import POINT_LOAD_Y

        for k, force in self.given.get("loads", {}).items():
            self.body[k].SetSolutionStepValue(POINT_LOAD_Y, force)

    def FinalizeSolutionStep(self) -> None:
        """Keep displacements, velocities and the force of the ground."""
        super().FinalizeSolutionStep()
        told = (
            np.array([[node.GetSolutionStepValue(one) for one in pair] for node in self.body])
            for pair in ((KM.DISPLACEMENT_X, KM.DISPLACEMENT_Y), (KM.VELOCITY_X, KM.VELOCITY_Y))[
                : 1 + ("dt" in self.data)
            ]
        )
        force = sum(node.GetSolutionStepValue(KM.REACTION_Y) for node in self.ground)
        self.told.append((*told, force))


def settings(way: str, data: dict[str, Any]) -> dict[str, Any]:
    """Return the parameters of the project."""
    moving = "dt" in data
    solver: dict[str, Any] = {
        "solver_type": "Dynamic" if moving else "Static",
        "model_part_name": "Structure",
        "domain_size": 2,
        "analysis_type": "non_linear",
        "echo_level": 0,
        "model_import_settings": {"input_type": "mdpa", "input_filename": "model"},
        "material_import_settings": {"materials_filename": "materials.json"},
        "time_stepping": {"time_step": data["dt"] if moving else 1.1},
        "convergence_criterion": "contact_residual_criterion",
        "contact_settings": {"mortar_type": "ALMContactFrictionless"},
    }
    if moving:
        solver |= {"time_integration_method": "implicit", "scheme_type": "bossak"}
    if way == "best":
        tight = {
            f"{what}_{kind}_tolerance": 1e-8 if kind == "relative" else 1e-15
            for what in ("displacement", "residual")
            for kind in ("relative", "absolute")
        }
        solver |= tight | {
            "max_iteration": 50,
            "linear_solver_settings": {"solver_type": "LinearSolversApplication.sparse_lu"},
        }
        solver["contact_settings"] |= {f"contact_{key}": value for key, value in tight.items()}
    contact = {
        "python_module": "alm_contact_process",
        "kratos_module": "KratosMultiphysics.ContactStructuralMechanicsApplication",
        "process_name": "ALMContactProcess",
        "Parameters": {
            "model_part_name": "Structure",
            "contact_model_part": {"0": ["Foot", "Top"]},
            "assume_master_slave": {"0": ["Foot"]},
            "contact_type": "Frictionless",
        },
    }
    return {
        "problem_data": {
            "problem_name": "peer",
            "parallel_type": "OpenMP",
            "echo_level": 0,
            "start_time": 0.0,
            "end_time": data["dt"] * (data["steps"] - 0.5) if moving else 1.0,
        },
        "solver_settings": solver,
        "processes": {"contact_process_list": [contact]},
        "output_processes": {},
    }


def model_files(
    points: Any, cells: Any, foot: list[int], data: dict[str, Any], given: dict[str, Any]
) -> None:
    """Write model.mdpa and materials.json: the body, and below it a strip of cells.

    The strip is as wide as the foot's.
    """
    h = points[foot[1], 0] - points[foot[0], 0]
    edge = np.arange(-1, len(foot) + 1) * h
    ground = [(x, y - data.get("gap", 0.0)) for y in (-h, 0.0) for x in edge]
    first, across, count = len(points) + 1, len(edge), len(cells)
    lines = [
        "Begin ModelPartData",
        "End ModelPartData",
        "Begin Properties 0",
        "End Properties",
        "Begin Properties 1",
        "End Properties",
    ]
    lines += ["Begin Nodes"]
    lines += [
        f"{k + 1} {x:.16g} {y:.16g} 0.0" for k, (x, y) in enumerate([*map(tuple, points), *ground])
    ]
    kind = np.asarray(cells).shape[1]
    lines += ["End Nodes", f"Begin Elements SmallDisplacementElement2D{kind}N"]
    lines += [
        f"{k + 1} 1 " + " ".join(str(node + 1) for node in nodes) for k, nodes in enumerate(cells)
    ]
    lines += ["End Elements", "Begin Elements SmallDisplacementElement2D4N"]
    quads = [
        (first + k, first + k + 1, first + across + k + 1, first + across + k)
        for k in range(across - 1)
    ]
    lines += [f"{count + k + 1} 1 " + " ".join(map(str, nodes)) for k, nodes in enumerate(quads)]
    lines += ["End Elements", "Begin Conditions LineCondition2D2N"]
    lower = [(foot[k] + 1, foot[k + 1] + 1) for k in range(len(foot) - 1)]
    upper = [(first + across + k + 1, first + across + k) for k in range(across - 1)]
    lines += [f"{k + 1} 0 {a} {b}" for k, (a, b) in enumerate(lower + upper)]
    lines += ["End Conditions"]
    loads = list(given.get("loads", {}))
    numbers = range(len(lower + upper) + 1, len(lower + upper + loads) + 1)
    if loads:
        lines += ["Begin Conditions PointLoadCondition2D1N"]
        lines += [f"{number} 0 {node + 1}" for number, node in zip(numbers, loads, strict=True)] + [
            "End Conditions"
        ]
    parts = {
        "Body": (range(1, first), range(1, count + 1), ()),
        "Ground": (range(first, first + 2 * across), range(count + 1, count + across), ()),
        "Foot": ([node + 1 for node in foot], (), range(1, len(lower) + 1)),
        "Top": (
            range(first + across, first + 2 * across),
            (),
            range(len(lower) + 1, len(lower + upper) + 1),
        ),
    }
    if loads:
        parts["Load"] = ([node + 1 for node in loads], (), numbers)
    for name, members in parts.items():
        lines += [f"Begin SubModelPart {name}"]
        for what, ids in zip(("Nodes", "Elements", "Conditions"), members, strict=True):
            lines += [f"Begin SubModelPart{what}", *map(str, ids), f"End SubModelPart{what}"]
        lines += ["End SubModelPart"]
    with open("model.mdpa", "w", encoding="ascii") as file:
        file.write("\n".join(lines) + "\n")
    variables = {
        "DENSITY": data.get("rho", 1.0),
        "YOUNG_MODULUS": data["E"],
        "POISSON_RATIO": data.get("nu", 0.0),
        "THICKNESS": 1.0,
    }
    material = {
        "constitutive_law": {"name": "LinearElasticPlaneStrain2DLaw"},
        "Variables": variables,
        "Tables": {},
    }
    with open("materials.json", "w", encoding="ascii") as file:
        json.dump(
            {
                "properties": [
                    {"model_part_name": "Structure", "properties_id": 1, "Material": material}
                ]
            },
            file,
        )


def signorini(n: int, way: str) -> dict[str, Any]:
    """Solve the static square with nodal loads on its top."""
    quiet()
    mesh = Square(n)
    force = traction_load(mesh)
    loads = {int(k): float(force[2 * k + 1]) for k in mesh.top}
    run = Run(
        way,
        (mesh.points, mesh.triangles),
        mesh.bottom.tolist(),
        SIGNORINI,
        held=mesh.left.tolist(),
        loads=loads,
    )
    run.Run()
    return {"u": run.told[-1][0]}


def thrown(way: str) -> dict[str, Any]:
    """Throw the square; its energies are taken with the common matrices, as Kratos tells none."""
    quiet()
    mesh = Square(THROWN["n"])
    run = Run(way, (mesh.points, mesh.triangles), mesh.bottom.tolist(), THROWN)
    run.Run()
    K, M = problems.stiffness(mesh, THROWN["E"], THROWN["nu"]), problems.mass(mesh, THROWN["rho"])
    u, v = (np.array([one[k] for one in run.told]).reshape(len(run.told), -1) for k in (0, 1))
    energy = 0.5 * np.einsum("ti,ti->t", v, v @ M) + 0.5 * np.einsum("ti,ti->t", u, u @ K)
    return {
        "t": THROWN["dt"] * np.arange(1, len(u) + 1),
        "force": [abs(one[-1]) for one in run.told],
        "energy": energy,
        "gap": THROWN["gap"] + u[:, 2 * mesh.bottom + 1].min(axis=1),
    }


def bar(way: str) -> dict[str, Any]:
    """Drop a strip one cell wide, held across, and return its forces per width."""
    quiet()
    n, h = BAR["elements"], BAR["length"] / BAR["elements"]
    points = [(x * h, k * h) for k in range(n + 1) for x in (0, 1)]
    cells = [(2 * k, 2 * k + 1, 2 * k + 3, 2 * k + 2) for k in range(n)]
    run = Run(way, (points, cells), [0, 1], BAR | {"gap": BAR["height"]}, held=range(len(points)))
    run.Run()
    u, v = (np.array([one[k][::2, 1] for one in run.told]) for k in (0, 1))
    left, right = v[:, :-1], v[:, 1:]
    energy = BAR["rho"] * h / 6.0 * (left**2 + left * right + right**2).sum(axis=1)
    energy += 0.5 * BAR["E"] / h * (np.diff(u, axis=1) ** 2).sum(axis=1)
    energy += (
        BAR["rho"] * BAR["gravity"] * h * (BAR["height"] + 0.5 * (u[:, :-1] + u[:, 1:])).sum(axis=1)
    )
    return {
        "t": BAR["dt"] * np.arange(1, len(u) + 1),
        "force": [abs(one[-1]) / h for one in run.told],
        "energy": energy,
        "foot": BAR["height"] + u[:, 0],
        "u": u[-1],
    }


def quiet() -> None:
    """Print errors alone."""
    KM.Logger.GetDefaultOutput().SetSeverity(KM.Logger.Severity.WARNING)


if __name__ == "__main__":
    problems.main(globals())
