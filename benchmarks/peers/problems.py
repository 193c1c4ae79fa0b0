"""Hold the three problems on which programs are compared.

They are meshes, data, reference answers and measures. Only numpy and scipy are used, so that no
program that is compared judges itself. SI units throughout. A peer's file (`peer_NAME.py` in this
folder) defines

    INSTALL   {"pip": [...]} or {"apt": [...]}: what the program consists of;
              {"system": []} for this project's stack
    TITLE     its name in the tables
    WAYS      {problem: {"best": how, "default": how}}: one sentence each;
              a problem that is left out needs MISSING
    STOPS     {problem: {way: when its iteration ends}}
    MISSING   {problem: reason}: what the program cannot do (optional)
    BY_HAND   {problem: what}: the part that the program has not and the file writes out (optional)
    version() -> str
    signorini(n, way), thrown(way), bar(way) -> dict of numbers and arrays, described at `measure`

and ends with `problems.main(globals())`. `compare.py` runs every row in a process of its own.
"""

from __future__ import annotations

import ast
import json
import resource
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
PROBLEMS = ("signorini", "thrown", "bar")
SIZES = (16, 64)  # squares along an edge, of the static problem
TOLERANCE = 1e-8  # relative, of every iteration


@dataclass(frozen=True)
class Square:
    """Hold the unit square of n x n squares, each cut into two triangles by its rising diagonal.

    Node number i + (n + 1) j lies at (i/n, j/n). triangles (2 n², 3) run anticlockwise.
    """

    n: int
    points: Any = field(init=False)
    triangles: Any = field(init=False)

    def __post_init__(self) -> None:
        """Make points and triangles."""
        n = self.n
        x, y = np.meshgrid(np.arange(n + 1) / n, np.arange(n + 1) / n)
        i, j = np.meshgrid(np.arange(n), np.arange(n))
        a = (i + (n + 1) * j).ravel()
        lower = np.stack([a, a + 1, a + n + 2], axis=1)
        upper = np.stack([a, a + n + 2, a + n + 1], axis=1)
        object.__setattr__(self, "points", np.stack([x.ravel(), y.ravel()], axis=1))
        object.__setattr__(self, "triangles", np.stack([lower, upper], axis=1).reshape(-1, 3))

    @property
    def bottom(self) -> Any:
        """Return the nodes with y = 0, from left to right."""
        return np.arange(self.n + 1)

    @property
    def top(self) -> Any:
        """Return the nodes with y = 1, from left to right."""
        return np.arange(self.n + 1) + (self.n + 1) * self.n

    @property
    def left(self) -> Any:
        """Return the nodes with x = 0, from below."""
        return np.arange(self.n + 1) * (self.n + 1)


# The static square: E, nu, plane strain; u_x = 0 on the left, rigid frictionless ground below, t_y
# on the top.
SIGNORINI = {"E": 1.0e9, "nu": 0.3}


def traction(x: Any) -> Any:
    """Return t_y [Pa] on the top of the static square: pressure on the left, tension elsewhere."""
    return -1.0e6 * (1.2 - 2.0 * np.asarray(x))


# The thrown square, above rigid frictionless ground.
THROWN = {
    "E": 1.0e7,
    "nu": 0.3,
    "rho": 1000.0,
    "gap": 0.01,
    "speed": 1.0,
    "n": 16,
    "dt": 2.5e-4,
    "steps": 400,
}

# The bouncing bar of Doyen, Ern and Piperno (2011), upright, foot at x = 0, released above the
# ground under gravity. Period 16/3 s with two bounces in it; one step is one crossing of an element
# (Courant number 1).
BAR = {
    "length": 10.0,
    "E": 900.0,
    "rho": 1.0,
    "gravity": 10.0,
    "height": 5.0,
    "elements": 100,
    "dt": 1.0 / 300.0,
    "steps": 8000,
    "bounces": 10,
}


def stiffness(mesh: Square, E: float, nu: float) -> Any:
    """Return the stiffness of plane strain (2N, 2N), unknown 2 i + c for component c of node i."""
    lame, shear = E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), E / (2.0 * (1.0 + nu))
    law = np.array(
        [[lame + 2.0 * shear, lame, 0.0], [lame, lame + 2.0 * shear, 0.0], [0.0, 0.0, shear]]
    )
    corners = mesh.points[mesh.triangles]
    across = np.roll(corners, -1, axis=1) - np.roll(corners, -2, axis=1)  # opposite edges
    one, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = 0.5 * np.abs(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])
    slope = np.stack([across[..., 1], -across[..., 0]], axis=-1) / (2.0 * area[:, None, None])
    strain = np.zeros((len(area), 3, 6))
    strain[:, 0, 0::2], strain[:, 1, 1::2] = slope[..., 0], slope[..., 1]
    strain[:, 2, 0::2], strain[:, 2, 1::2] = slope[..., 1], slope[..., 0]
    return _assemble(mesh, np.einsum("e,eki,kl,elj->eij", area, strain, law, strain))


def mass(mesh: Square, rho: float) -> Any:
    """Return the consistent mass (2N, 2N), numbered as the stiffness."""
    one = np.kron((np.ones((3, 3)) + np.eye(3)) / 12.0, np.eye(2)) * rho * 0.5 / mesh.n**2
    return _assemble(mesh, np.broadcast_to(one, (len(mesh.triangles), 6, 6)))


def _assemble(mesh: Square, local: Any) -> Any:
    """Return the sum of element matrices (e, 6, 6)."""
    from scipy import sparse

    numbers = (2 * mesh.triangles[..., None] + np.arange(2)).reshape(-1, 6)
    rows, columns = np.repeat(numbers, 6, axis=1), np.tile(numbers, 6)
    size = 2 * len(mesh.points)
    return sparse.csr_matrix(
        (local.reshape(-1), (rows.ravel(), columns.ravel())), shape=(size, size)
    )


def traction_load(mesh: Square) -> Any:
    """Return the nodal forces (2N,) [N/m] of the traction.

    It is linear: its integrals with P1 are exact.
    """
    force, h = np.zeros(2 * len(mesh.points)), 1.0 / mesh.n
    t = traction(mesh.points[mesh.top, 0])
    force[2 * mesh.top[:-1] + 1] += h * (2.0 * t[:-1] + t[1:]) / 6.0
    force[2 * mesh.top[1:] + 1] += h * (t[:-1] + 2.0 * t[1:]) / 6.0
    return force


def signorini_reference(n: int) -> tuple[Any, Any]:
    """Return u (2N,) [m] and contact forces r (n + 1,) [N/m] of the static square, to round-off.

    They solve its discrete problem.

    The displacements of all but the ground's nodes are eliminated; the linear complementarity
    problem of the rest, S y - g = r >= 0, y >= 0, y·r = 0, is solved by active sets.
    """
    from scipy.sparse import linalg

    mesh = Square(n)
    K, f = stiffness(mesh, **SIGNORINI).tocsc(), traction_load(mesh)
    ground = 2 * mesh.bottom + 1
    free = np.setdiff1d(np.arange(K.shape[0]), np.concatenate([2 * mesh.left, ground]))
    factor = linalg.splu(K[free][:, free])
    coupling = K[free][:, ground].toarray()
    S = K[ground][:, ground].toarray() - coupling.T @ factor.solve(coupling)
    g = f[ground] - coupling.T @ factor.solve(f[free])
    y, r = complementarity(0.5 * (S + S.T), g)
    u = np.zeros(K.shape[0])
    u[ground] = y
    u[free] = factor.solve(f[free] - coupling @ y)
    return u, np.where(y > 0.0, 0.0, r)


def complementarity(S: Any, g: Any) -> tuple[Any, Any]:
    """Return y and r of S y - g = r >= 0, y >= 0, y·r = 0, by active sets of a projected step.

    S is positive semidefinite. Raises RuntimeError when the sets return to one that was there
    before.
    """
    closed, seen = np.ones(len(g), dtype=bool), set()
    scale = float(np.abs(np.diag(S)).max())
    while closed.tobytes() not in seen:
        seen.add(closed.tobytes())
        y, r = np.zeros(len(g)), np.zeros(len(g))
        opened = ~closed
        if opened.any():
            y[opened] = np.linalg.solve(S[np.ix_(opened, opened)], g[opened])
        r[closed] = S[np.ix_(closed, opened)] @ y[opened] - g[closed]
        next_closed = r - scale * y > 0.0
        if np.array_equal(next_closed, closed):
            return y, r
        closed = next_closed
    raise RuntimeError("the active sets of the reference go in circles")


def bar_reference() -> Any:
    """Return the exact bouncing bar.

    It has force(t) [Pa], displacement(x, t) [m] and energy [J/m²].
    """
    sys.path.insert(0, str(HERE.parents[1]))
    from vi_contact.exact import BouncingBar

    return BouncingBar(**{key: BAR[key] for key in ("length", "E", "rho", "gravity", "height")})


def thrown_reference() -> dict[str, Any]:
    """Return what `python3 benchmarks/peers/thrown_reference.py` has stored."""
    return dict(json.loads((HERE / "thrown_reference.json").read_text(encoding="utf-8")))


# Measures
# --------------------------------------------------------------------------------------------------
def measure(problem: str, answer: dict[str, Any], n: int) -> dict[str, float]:
    """Return the measures of an answer.

    The answer holds, for

    signorini: u (N, 2) [m], numbered as Square; r (n + 1,) [N/m], contact forces of Square.bottom,
        positive in compression, or None when the program tells none (they are then the residual of
        the displacements);
    thrown: t [s], force [N/m], energy (kinetic and strain) [J/m] and gap (smallest one) [m], one
        value a step; the force is the one that the program reports for the step, the gap that at
        the end of the step;
    bar: t [s], force [Pa], energy (kinetic, strain and weight, zero for the bar on the ground)
        [J/m²] and foot (its height) [m], one value a step; u (101,) [m] at the end, from the foot.
        Divide by the section of a strip.
    """
    return {"signorini": _signorini, "thrown": _thrown, "bar": _bar}[problem](answer, n)


def initial_energy(problem: str) -> float:
    """Return the energy [J/m] of the thrown square, [J/m²] of the bar, at the start."""
    if problem == "thrown":
        return float(0.5 * THROWN["rho"] * THROWN["speed"] ** 2)
    return float(BAR["rho"] * BAR["gravity"] * BAR["length"] * BAR["height"])


def _signorini(answer: dict[str, Any], n: int) -> dict[str, float]:
    """Compare with the discrete solution.

    The potential energy is that of the common matrix for all.
    """
    mesh = Square(n)
    exact, forces = signorini_reference(n)
    K, f = stiffness(mesh, **SIGNORINI), traction_load(mesh)
    u = np.asarray(answer["u"], dtype=float).reshape(-1)
    r = answer.get("r")
    found = (K @ u - f)[2 * mesh.bottom + 1] if r is None else np.asarray(r, dtype=float)
    energy, best = (float(0.5 * (v @ (K @ v)) - f @ v) for v in (u, exact))
    return {
        "force_error": float(np.linalg.norm(found - forces) / np.linalg.norm(forces)),
        "penetration": float(max(0.0, -u[2 * mesh.bottom + 1].min()) / np.abs(u).max()),
        "energy_error": abs(energy - best) / abs(best),
    }


def _thrown(answer: dict[str, Any], n: int) -> dict[str, float]:
    """Compare with the fine reference; the initial energy is exact."""
    reference = thrown_reference()
    force, energy = (np.asarray(answer[key], dtype=float) for key in ("force", "energy"))
    initial = initial_energy("thrown")
    impulse = float(force.sum() * THROWN["dt"])
    return {
        "energy_end": float(energy[-1] / initial),
        "energy_largest": float(energy.max() / initial),
        "impulse": impulse,
        "impulse_error": abs(impulse / reference["impulse"] - 1.0),
        "largest_force": float(force.max()),
        "largest_force_error": abs(float(force.max()) / reference["largest_force"] - 1.0),
        "penetration": float(max(0.0, -np.min(answer["gap"])) / THROWN["gap"]),
    }


def _bar(answer: dict[str, Any], n: int) -> dict[str, float]:
    """Compare with the exact solution; force errors count wrong forces in flight too."""
    exact = bar_reference()
    t, force = (np.asarray(answer[key], dtype=float) for key in ("t", "force"))
    # a step's force is compared with that of its middle
    truth = np.asarray(exact.force(t - 0.5 * BAR["dt"]))
    first = t < exact.period / 2.0
    x = np.linspace(0.0, BAR["length"], BAR["elements"] + 1)
    away = np.asarray(answer["u"], dtype=float) - np.asarray(exact.displacement(x, float(t[-1])))

    def error(where: Any) -> float:
        return float(np.linalg.norm((force - truth)[where]) / np.linalg.norm(truth[where]))

    return {
        "energy_end": float(np.asarray(answer["energy"])[-1] / initial_energy("bar")),
        "energy_largest": float(np.max(answer["energy"]) / initial_energy("bar")),
        "force_error_first": error(first),
        "force_error": error(np.full(len(t), True)),
        "displacement_error": float(np.sqrt(np.mean(away**2)) / BAR["height"]),
        "penetration": float(max(0.0, -np.min(answer["foot"])) / BAR["height"]),
    }


# One row
# --------------------------------------------------------------------------------------------------
def seconds() -> float:
    """Return the processor time [s] of this process and of its finished children, all threads."""
    both = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in both)


def main(peer: dict[str, Any]) -> None:
    """Answer `peer_NAME.py PROBLEM N WAY FILE`: run one row and store its answer and time in FILE.

    The time is that of the call: from the mesh to the answer, without imports. `version` alone
    prints the version.
    """
    if sys.argv[1:] == ["version"]:
        print(peer["version"]())
        return
    problem, n, way, out = sys.argv[1:5]
    begin, clock = seconds(), time.perf_counter()
    answer = peer[problem](int(n), way) if problem == "signorini" else peer[problem](way)
    spent = {"solve": seconds() - begin, "clock": time.perf_counter() - clock}
    np.savez(out, **{key: value for key, value in answer.items() if value is not None}, **spent)


def _find_parts(tree: ast.Module) -> dict[str, ast.stmt]:
    """Return the statement of a file that defines or imports each of its names."""
    parts: dict[str, ast.stmt] = {}
    for node in tree.body:
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            parts[node.name] = node
        elif isinstance(node, (ast.Import, ast.ImportFrom)):
            parts.update({(one.asname or one.name).split(".")[0]: node for one in node.names})
        elif isinstance(node, (ast.Assign, ast.AnnAssign)):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            named = [name for one in targets for name in ast.walk(one)]
            parts.update({name.id: node for name in named if isinstance(name, ast.Name)})
    return parts


def _collect_used(parts: dict[str, ast.stmt], names: tuple[str, ...]) -> tuple[set[str], set[str]]:
    """Return the names of the file that these names use, themselves too, and all attributes."""
    wanted: set[str] = set()
    todo, taken = list(names), set()
    while todo:
        name = todo.pop()
        if name not in parts or name in wanted:
            continue
        wanted.add(name)
        nodes = list(ast.walk(parts[name]))
        todo += [one.id for one in nodes if isinstance(one, ast.Name)]
        taken.update(one.attr for one in nodes if isinstance(one, ast.Attribute))
    return wanted, taken


def _number_lines(part: ast.stmt) -> set[int]:
    """Return the numbers of the lines of a statement, without those of docstrings."""
    lines = set(range(part.lineno, (part.end_lineno or 0) + 1))
    for node in ast.walk(part):
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)) and ast.get_docstring(node):
            said = node.body[0]
            lines.difference_update(range(said.lineno, (said.end_lineno or 0) + 1))
    return lines


def lines_of(path: Path, *wanted_names: str) -> int:
    """Count the lines of code of a problem of a peer's file.

    They are those of its function and of what it uses of the file, imports too.

    What it takes of the assembly of this module counts too: a program that has no finite elements
    needs those lines. Blank lines, comments and docstrings are not counted.
    """
    source = path.read_text(encoding="utf-8")
    parts = _find_parts(ast.parse(source))
    wanted, taken = _collect_used(parts, wanted_names)
    lines: set[int] = set()
    for name in wanted:
        lines |= _number_lines(parts[name])
    text = source.splitlines()
    own = sum(
        bool(text[number - 1].strip()) and not text[number - 1].strip().startswith("#")
        for number in lines
    )
    borrowed = {"stiffness", "mass", "traction_load"} & taken if "problems" in wanted else set()
    if not borrowed or path == Path(__file__).resolve():
        return own
    # np is imported once
    return own + lines_of(Path(__file__).resolve(), *(borrowed | {"_assemble"})) - 1
