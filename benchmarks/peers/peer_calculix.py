"""Solve the three problems with CalculiX: wedges or bricks one layer deep.

*CONTACT PAIR joins them to a fixed brick below.
"""

import subprocess
from typing import Any

import numpy as np
import problems
from problems import BAR, SIGNORINI, THROWN, Square, traction_load

TITLE = "CalculiX"
INSTALL = {"apt": ["calculix-ccx"]}
WAYS = {
    "signorini": {
        "best": (
            "NODE TO SURFACE, PRESSURE-OVERCLOSURE=LINEAR of 1e17 Pa/m, residual and "
            "correction to 1e-8"
        ),
        "default": (
            "SURFACE TO SURFACE, PRESSURE-OVERCLOSURE=HARD without a number, default controls"
        ),
    },
    "thrown": {
        "best": "NODE TO SURFACE, LINEAR of 10 E/h, *DYNAMIC with its default ALPHA=-0.05, DIRECT, "
        "residual and correction to 1e-8",
        "default": (
            "SURFACE TO SURFACE, HARD without a number, *DYNAMIC with its default ALPHA=-0.05 and "
            "automatic increments up to the time step, default controls"
        ),
    },
    "bar": {
        "best": (
            "NODE TO SURFACE, LINEAR of E/h (10 E/h fails), *DYNAMIC with its default ALPHA=-0.05, "
            "DIRECT, residual and correction to 1e-8"
        ),
        "default": (
            "SURFACE TO SURFACE, HARD without a number, *DYNAMIC with its default ALPHA=-0.05 and "
            "automatic increments up to the time step, default controls"
        ),
    },
}
STOPS = {
    "signorini": {
        "best": "1e-8 (residual, correction)",
        "default": "5e-3 (residual), 1e-2 (correction), built in",
    },
    "thrown": {
        "best": "1e-8 (residual, correction)",
        "default": "5e-3 (residual), 1e-2 (correction), built in",
    },
    "bar": {
        "best": "1e-8 (residual, correction)",
        "default": "5e-3 (residual), 1e-2 (correction), built in",
    },
}
BY_HAND = {
    "signorini": (
        "nodal contact forces: the residual of the printed displacements, which have seven digits"
    )
}


def version() -> str:
    """Return the version that ccx prints of itself."""
    said = subprocess.run(["ccx", "-v"], capture_output=True, text=True, check=False).stdout
    return said.split("Version")[-1].split()[0]


def signorini(n: int, way: str) -> dict[str, Any]:
    """Solve the static square: half the load on each of both faces of the wedges."""
    mesh = Square(n)
    deck = square_deck(mesh, SIGNORINI | {"rho": 1.0, "gap": 0.0}, way, 1e17)
    deck += [f"{node},1,1" for node in both(mesh, mesh.left)]
    deck += ["*STEP,INC=1000", "*STATIC", "1.,1.", *controls(way), "*CLOAD"]
    force = 0.5 * traction_load(mesh)
    deck += [
        f"{node},2,{force[2 * ((node - 1) % len(mesh.points)) + 1]:.16g}"
        for node in both(mesh, mesh.top)
    ]
    told = run([*deck, "*NODE PRINT,NSET=FRONT", "U", "*END STEP"])
    return {"u": told["displacements"][0][:, 1:3]}


def thrown(way: str) -> dict[str, Any]:
    """Throw the square, whose gap to the brick is in the deck."""
    mesh = Square(THROWN["n"])
    deck = square_deck(mesh, THROWN, way, 10.0 * THROWN["E"] * THROWN["n"])
    deck += [
        "*INITIAL CONDITIONS,TYPE=VELOCITY",
        f"BODY,2,{-THROWN['speed']}",
        *dynamic(way, THROWN),
        "*END STEP",
    ]
    told = run(deck, THROWN["steps"])
    return histories(told, THROWN) | {
        "gap": THROWN["gap"] + np.array(told["displacements"])[:, mesh.bottom, 2].min(axis=1)
    }


def bar(way: str) -> dict[str, Any]:
    """Drop the bar of bricks; energies count its weight from the ground on."""
    n, h = BAR["elements"], BAR["length"] / BAR["elements"]
    deck = ["*NODE,NSET=BODY"]
    deck += [
        f"{4 * k + c + 1},{x},{k * h:.16g},{z}"
        for k in range(n + 1)
        for c, (x, z) in enumerate(((0, 0), (0, 1), (1, 1), (1, 0)))
    ]
    deck += ["*NSET,NSET=FRONT,GENERATE", f"1,{4 * n + 1},4", "*ELEMENT,TYPE=C3D8,ELSET=SOLID"]
    deck += [",".join(map(str, [k + 1, *range(4 * k + 1, 4 * k + 9)])) for k in range(n)]
    deck += ground(
        BAR | {"gap": BAR["height"], "nu": 0.0}, ["1,S1"], 4 * n + 5, n + 1, way, BAR["E"] / h
    ) + ["BODY,1,1"]
    weight = ["*DLOAD", f"SOLID,GRAV,{BAR['gravity']},0.,-1.,0."]
    told = run([*deck, *dynamic(way, BAR), *weight, "*END STEP"], BAR["steps"])
    found, u = histories(told, BAR), np.array(told["displacements"])[..., 2]
    share = np.full(n + 1, BAR["rho"] * BAR["gravity"] * h)
    share[[0, -1]] *= 0.5
    return found | {
        "energy": found["energy"] + (BAR["height"] + u) @ share,
        "foot": BAR["height"] + u[:, 0],
        "u": u[-1],
    }


def both(mesh: Square, nodes: Any) -> list[int]:
    """Return the numbers of nodes of the front and of the back."""
    return [int(node) + 1 + back * len(mesh.points) for back in (0, 1) for node in nodes]


def square_deck(mesh: Square, data: dict[str, Any], way: str, stiff: float) -> list[str]:
    """Return the model of the square, a layer of wedges of depth 1 m."""
    count = len(mesh.points)
    deck = ["*NODE,NSET=BODY"]
    deck += [
        f"{k + 1 + z * count},{x:.16g},{y:.16g},{z}"
        for z in (0, 1)
        for k, (x, y) in enumerate(mesh.points)
    ]
    deck += ["*NSET,NSET=FRONT,GENERATE", f"1,{count}", "*ELEMENT,TYPE=C3D6,ELSET=SOLID"]
    deck += [
        ",".join(map(str, [k + 1, *(nodes + 1), *(nodes + 1 + count)]))
        for k, nodes in enumerate(mesh.triangles)
    ]
    faces = [f"{2 * k + 1},S3" for k in range(mesh.n)]
    return deck + ground(data, faces, 2 * count + 1, len(mesh.triangles) + 1, way, stiff)


def ground(
    data: dict[str, Any], faces: list[str], node: int, element: int, way: str, stiff: float
) -> list[str]:
    """Return material, the fixed brick below the body, the contact pair and what holds both."""
    deck = ["*NODE,NSET=GROUND"]
    corners = [
        (x, y, z)
        for z in (-0.5, 1.5)
        for x, y in ((-0.5, -1.0), (1.5, -1.0), (1.5, 0.0), (-0.5, 0.0))
    ]
    deck += [f"{node + k},{x},{y - data['gap']},{z}" for k, (x, y, z) in enumerate(corners)]
    deck += [
        "*ELEMENT,TYPE=C3D8,ELSET=BRICK",
        ",".join(map(str, [element, *range(node, node + 8)])),
        "*MATERIAL,NAME=STUFF",
    ]
    deck += ["*ELASTIC", f"{data['E']},{data['nu']}", "*DENSITY", f"{data['rho']}"]
    deck += [f"*SOLID SECTION,ELSET={name},MATERIAL=STUFF" for name in ("SOLID", "BRICK")]
    deck += [
        "*SURFACE,NAME=FOOT",
        *faces,
        "*SURFACE,NAME=TOP",
        f"{element},S5",
        "*SURFACE INTERACTION,NAME=TOUCH",
    ]
    if way == "best":
        deck += ["*SURFACE BEHAVIOR,PRESSURE-OVERCLOSURE=LINEAR", f"{stiff:.16g},1.e-3"]
    else:
        deck += ["*SURFACE BEHAVIOR,PRESSURE-OVERCLOSURE=HARD"]
    deck += [
        f"*CONTACT PAIR,INTERACTION=TOUCH,TYPE={'NODE' if way == 'best' else 'SURFACE'} TO SURFACE",
        "FOOT,TOP",
    ]
    return [*deck, "*BOUNDARY", "GROUND,1,3", "BODY,3,3"]


def controls(way: str) -> list[str]:
    """Return the common tolerance, or nothing for the default."""
    return (
        ["*CONTROLS,PARAMETERS=FIELD", f"{problems.TOLERANCE},{problems.TOLERANCE}"]
        if way == "best"
        else []
    )


def dynamic(way: str, data: dict[str, Any]) -> list[str]:
    """Return the step of a motion with what is printed.

    By default its increments may be smaller than dt.
    """
    dt, end, points = data["dt"], data["dt"] * data["steps"], ""
    deck = [f"*STEP,INC={100 * data['steps']}"]
    if way == "best":
        deck += ["*DYNAMIC,DIRECT", f"{dt:.16g},{end:.16g}"]
    else:  # one more print, at the end of half a step more, so that rounding loses none
        end, points = end + 0.5 * dt, ",TIME POINTS=EACH"
        deck = ["*TIME POINTS,NAME=EACH,GENERATE", f"{dt:.16g},{end:.16g},{dt:.16g}", *deck]
        deck += ["*DYNAMIC", f"{dt:.16g},{end:.16g},{1e-6 * dt:.8g},{dt:.16g}"]
    printed = [
        f"*NODE PRINT,NSET=FRONT{points}",
        "U",
        f"*NODE PRINT,NSET=GROUND,TOTALS=ONLY{points}",
        "RF",
    ]
    return [
        *deck,
        *controls(way),
        *printed,
        f"*EL PRINT,ELSET=SOLID,TOTALS=ONLY{points}",
        "ELSE,ELKE",
    ]


def run(deck: list[str], steps: int = 1) -> dict[str, list[Any]]:
    """Run ccx in the current folder; return the printed blocks by what their titles name."""
    with open("deck.inp", "w", encoding="ascii") as file:
        file.write("\n".join(deck) + "\n")
    said = subprocess.run(["ccx", "deck"], capture_output=True, text=True, check=False).stdout
    told: dict[str, list[Any]] = {}
    with open("deck.dat", encoding="ascii") as file:
        for line in file:
            if "time" in line:
                key = next(
                    word
                    for word in ("displacements", "force", "internal", "kinetic")
                    if word in line
                )
                told.setdefault(key, []).append([])
            elif line.strip():
                told[key][-1].append([float(word) for word in line.split()])
    done = len(told.get("displacements", []))
    if done < steps or "*ERROR" in said:
        where = said[said.find("*ERROR") :].split("\n\n")[0] if "*ERROR" in said else "ended early"
        raise RuntimeError(f"ccx, after {done} of {steps} steps: {' '.join(where.split())}")
    return {key: [np.array(block) for block in blocks[:steps]] for key, blocks in told.items()}


def histories(told: dict[str, list[Any]], data: dict[str, Any]) -> dict[str, Any]:
    """Return times, the force of the ground and the energy."""
    energy = np.array(told["internal"]).ravel() + np.array(told["kinetic"]).ravel()
    return {
        "t": data["dt"] * np.arange(1, len(energy) + 1),
        "force": np.abs(np.array(told["force"])[:, 0, 1]),
        "energy": energy,
    }


if __name__ == "__main__":
    problems.main(globals())
