"""The theory pages state the numbers of their figures, and the solutions of their exercises those
of the program.

python3 docs/theory/figures.py compares all figures.
"""

from __future__ import annotations

import logging
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from pictures import is_drawn
from posed import matrix_of

import vi_contact as vc
from vi_contact import solvers
from vi_contact.core import kkt_residual
from vi_contact.core.ledger import compute_energies

pytest.importorskip("matplotlib")
pytestmark = pytest.mark.serial
ROOT = Path(__file__).resolve().parents[2]
THEORY = ROOT / "docs" / "theory"


@pytest.fixture(scope="module")
def figures() -> ModuleType:
    """docs/theory/figures.py, which is no module of a package."""
    spec = spec_from_file_location("theory_figures", THEORY / "figures.py")
    assert spec is not None and spec.loader is not None
    found = module_from_spec(spec)
    sys.modules[spec.name] = found  # its data classes ask for it
    spec.loader.exec_module(found)
    return found


@pytest.mark.promise("theory/certificate.md", "In all of its 900 steps the certificate stays below")
@pytest.mark.promise("theory/certificate.md", "This error falls from 19 % with 10 elements")
@pytest.mark.promise("theory/condensation.md", "both agree over 40 steps to better than 1e-9")
@pytest.mark.promise("theory/ledger.md", "Every step is solved to round-off")
@pytest.mark.promise("theory/ledger.md", "It is as small as rounding and the tolerance")
@pytest.mark.promise("theory/ledger.md", "at the end its defect is 25 % of the initial energy")
@pytest.mark.parametrize("name", ["inequality", "certificate", "ledger", "condensation"])
@pytest.mark.promise("theory/ledger.md", "At the end 31.1 % of it")
@pytest.mark.promise(
    "theory/certificate.md", "In the figure a reaction that is wrong by the relative size"
)
def test_pages_state_what_their_figures_show(
    figures: ModuleType, name: str, tmp_path: Path
) -> None:
    phrases = figures.PAGES[name](tmp_path / "figure.png")
    assert len(phrases) >= 3 and figures.lacking(name, phrases) == []
    assert is_drawn(tmp_path / "figure.png")
    # a page that states another number is found
    assert figures.lacking(name, ["$f = 2$ N it rests at $u = 0.03$ m"])


def test_every_figure_is_on_its_page(figures: ModuleType) -> None:
    drawn = {path.name for path in (ROOT / "docs" / "figures").glob("theory_*.png")}
    assert drawn == {f"theory_{name}.png" for name in figures.PAGES}
    for name in figures.PAGES:
        assert f"](../figures/theory_{name}.png)" in (THEORY / f"{name}.md").read_text(
            encoding="utf-8"
        )


def test_the_spoiled_answer_prints_what_its_page_says() -> None:
    page = (THEORY / "certificate.md").read_text(encoding="utf-8")
    ((code, text),) = re.findall(
        r"^```python\n(.*?)^```\n\n```text\n(.*?)^```$", page, re.MULTILINE | re.DOTALL
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, encoding="utf-8", timeout=600
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == text


# Solutions of the exercises: what each of these returns stands on the page
# ------------------------------------------
def solved_inequality(figures: ModuleType) -> list[str]:
    """Two masses of which the second never touches, and penalties in the place of the wall."""
    K = np.array([[200.0, -100.0], [-100.0, 200.0]])
    for force, reaction in ((7.5, 0.0), (9.0, 1.5), (1e6, 1e6 - 7.5)):
        system = vc.system_from_arrays(
            [1.0, 1.0], None, K, coordinates=[[0.0], [1.0]], load=[force, 0.0]
        )
        problem = vc.ContactProblem(
            system, vc.contact_points(system, [0, 1], [1.0], gap0=[0.05, 0.1])
        )
        state = vc.static_equilibrium(problem)
        assert state.u == pytest.approx([0.05, 0.025], rel=1e-9)
        assert state.r_n == pytest.approx([reaction, 0.0], rel=1e-9, abs=1e-9)
    rows = [
        f"| {k_p:.0e} | {3.0 / (100.0 + k_p):.1e} | {np.linalg.cond(K + np.diag([k_p, 0.0])):.0f} |"
        for k_p in (1e4, 1e6)
    ]
    return [
        "$f = \\tfrac32 k g_0 = 7.5$ N",
        "$u_1 = 50$ mm, $u_2 = 25$ mm and $r_1 = f - 7.5$ N",
        *rows,
    ]


def solved_step(figures: ModuleType) -> list[str]:
    """The midpoint step of two masses: matrix, velocity after it, and energies."""
    ((_, report),) = vc.march(
        figures.two_masses(), scheme=vc.Midpoint(), solver=vc.Condensed(), dt=0.05, steps=1
    )
    A, b, (x, y), r = (
        np.column_stack([report.step.A @ e for e in np.eye(2)]),
        figures.find_whole_step(report.step).b,
        report.new.u,
        report.result.r_n,
    )
    free = 1e3 * np.linalg.solve(A, b)
    assert y == pytest.approx(18.0 / 1800.0) and r[0] == pytest.approx(80.0 - 36.0 + 1.0)
    v = report.new.v
    kinetic, strain = 0.5 * float(v @ v), 0.5 * float(100.0 * (x**2 + y**2 + (x - y) ** 2))
    assert 0.52 - kinetic - strain == pytest.approx(22.5 * 0.02)
    return [
        f"diagonal of $A$ is {A[0, 0]:.0f} N/m, the other entries are {A[0, 1]:.0f} N/m",
        f"$b = ({b[0]:.0f}, {b[1]:.0f})$ N",
        f"$x = A^{{-1}} b = ({free[0]:.1f}, {free[1]:.1f})$ mm",
        f"$r_1 = 80 - 36 + 1 = {r[0]:.0f}$ N",
        f"$v_1 = 2 \\cdot 0.02/0.05 - 1 = {v[0]:.1f}$ m/s",
        f"$22.5 \\cdot 0.02 = {22.5 * 0.02:.2f}$ J",
        f"of 0.52 J at the start {kinetic:.2f} J are left as kinetic and {strain:.2f} J as strain "
        "energy",
    ]


def arrival(share: float, scheme: Any, dt: float = 1.0, steps: int = 3) -> tuple[Any, Any]:
    """The velocities and reactions of a mass 1 with the velocity 1 that meets a wall after a share
    of the time 1."""
    system = vc.system_from_arrays([1.0], None, [[0.0]], coordinates=[[0.0]], v0=[1.0])
    surface = vc.contact_points(system, [0], [1.0], gap0=share)
    problem = vc.ContactProblem(system, surface, mass=vc.ConsistentMass())
    found = [report.new for _, report in vc.march(problem, scheme=scheme, dt=dt, steps=steps)]
    return np.array([one.v[0] for one in found]), np.array([one.r_n[0] for one in found])


def solved_blow_up(figures: ModuleType) -> list[str]:
    """A mass that arrives in the midst of a step."""
    rows = []
    for share in (0.25, 0.5, 0.75):
        for name, scheme in (("midpoint", vc.Midpoint()), ("Newmark", vc.Newmark())):
            v, r = arrival(share, scheme)
            told = [", ".join(f"{round(one, 6) + 0.0:.2f}" for one in values) for values in (v, r)]
            rows.append(f"| {share:.2f} | {name} | {told[0]} | {told[1]} | {v[-1] ** 2:.2f} |")
    # velocities after Newmark's steps
    early, late = (Polynomial([-3.0, 4.0]), Polynomial([5.0, -8.0]))
    for share, speed in ((0.1, early), (0.6, early), (0.7, late), (0.9, late)):
        assert arrival(share, vc.Newmark())[0][-1] == pytest.approx(speed(share))
        assert arrival(share, vc.Midpoint())[0][-1] ** 2 == pytest.approx((2.0 * share - 1.0) ** 2)
    one, two = (early**2).integ(), (late**2).integ()
    rows.append(f"91/27 = {one(2 / 3) - one(0.0) + two(1.0) - two(2 / 3):.2f}")
    return rows


def test_bouncing_bar_on_coarse_meshes(figures: ModuleType) -> None:
    """The table of energies and forces, to a hundredth; those of Newmark's scheme are chaotic and
    have bounds."""
    schemes = {
        "trapezoidal, no mass at the foot": (vc.Trapezoidal(), None),
        "Houbolt, no mass at the foot": (vc.Houbolt(), None),
        "Moreau–Jean, $e = 0$": (vc.MoreauJean(), None),
        "midpoint rule": (vc.Midpoint(), None),
        "Newmark, mass at the foot": (vc.Newmark(), vc.ConsistentMass()),
    }
    text, case = (THEORY / "solutions.md").read_text(encoding="utf-8"), figures.PeriodicBar()
    for name, (scheme, mass) in schemes.items():
        (row,) = re.findall(rf"^ +\| {re.escape(name)} \| (.*) \|$", text, re.MULTILINE)
        for (n, courant), cell in zip(
            ((10, 0.5), (10, 0.1), (20, 0.5)), row.split(" | "), strict=True
        ):
            problem, force = figures.bar(case, n, mass=mass), 0.0
            for _, report in vc.march(problem, scheme=scheme, dt=courant / n, t_end=case.period):
                force = max(force, float(report.new.r_n[0]) / 0.5)
            energy = (
                compute_energies(problem.equations, report.new.u, report.new.v).total / case.energy
            )
            bounds = re.fullmatch(r"more than (\d+), more than (\d+)", cell)
            if bounds:
                assert energy > float(bounds[1]) and force > float(bounds[2])
            else:
                assert [float(one) for one in cell.split(", ")] == pytest.approx(
                    [energy, force], abs=0.01
                )


def solved_certificate(figures: ModuleType) -> list[str]:
    """What each residual says to a spoiled answer, and what a penalty does to the matrix of the
    thrown bar."""
    system = vc.system_from_arrays([1.0], None, [[100.0]], coordinates=[[0.0]], load=[8.0])
    problem = vc.ContactProblem(system, vc.contact_points(system, [0], [1.0], gap0=0.05))
    *_, (_, report) = vc.march(problem, scheme=vc.Midpoint(), dt=0.05, steps=3)
    rows, good = [], report.result
    for name, changes in {
        "x=1.001 * x": {"x": 1.001 * good.x},
        "x=0.999 * x": {"x": 0.999 * good.x},
        "active=~active": {"active": ~good.active},
        "r_n=-r_n": {"r_n": -good.r_n},
    }.items():
        found = kkt_residual(report.step, replace(good, **changes))
        names = ("equilibrium", "penetration", "tension", "complementarity")
        told = [f"{one} {getattr(found, one):.0e}" for one in names if getattr(found, one) > 1e-14]
        rows.append(f"| `{name}` | {', '.join(told)} |")
    case, n = figures.ThrownBar(), 100
    problem = figures.bar(case, n)
    dt = 0.5 * case.length / n / case.wave_speed
    ((_, report),) = vc.march(problem, solver=vc.Condensed(), dt=dt, steps=1)
    A = np.column_stack([report.step.A @ e for e in np.eye(n + 1)])
    largest = np.abs(case.displacement(np.linspace(0.0, case.length, n + 1), 1.0)).max()
    k_p, foot, before = float(case.force(1.0)) / (1e-9 * largest), A[0, 0], np.linalg.cond(A)
    A[0, 0] += k_p
    assert round(k_p / foot / 1e6) == 5
    return [
        *rows,
        f"$r_n = \\rho c v = {float(case.force(1.0)):.0f}$ N and the largest displacement "
        f"{largest:.2f} m",
        f"$k_p = 300/(6.67 \\cdot 10^{{-9}}) = {k_p / 1e10:.1f} \\cdot 10^{{10}}$ N/m",
        f"without a penalty {foot:.0f} N/m, becomes five million times as large",
        f"grows from {before:.0f} to ${np.linalg.cond(A) / 1e5:.1f} \\cdot 10^5$",
        f"rounded to ${1e16 * np.spacing(5.0):.0f} \\cdot 10^{{-16}}$ m",
        f"in leaps of ${1e5 * k_p * np.spacing(5.0):.0f} \\cdot 10^{{-5}}$ N",
    ]


def solved_ledger(figures: ModuleType) -> list[str]:
    """The loss of a closing step that is halved, and the largest defect of the faulty scheme."""
    losses = [
        1.0 - arrival(0.375, vc.Midpoint(), 1.0 / cuts, cuts)[0][-1] ** 2 for cuts in (1, 2, 4, 8)
    ]
    defects = []
    for cuts in (1, 2):
        h, _ = figures.simulated(
            figures.bar(figures.PeriodicBar(), 20), figures.Careless(), 0.025 / cuts, 1.5
        )
        defects.append(100.0 * np.abs(h["energy_defect"]).max() / h["energy_strain"][0])
        assert h["t"][np.abs(h["energy_defect"]).argmax()] == pytest.approx(np.sqrt(2.0), abs=0.03)
    return [
        ", ".join(f"{one:.4f}" for one in losses[:3]) + f" and {losses[3]:.4f}",
        f"with 1/40 and 1/80 s are {defects[0]:.1f} % and {defects[1]:.1f} % of it",
    ]


def solved_condensation(figures: ModuleType) -> list[str]:
    """The Delassus operators of a chain on a wall and of a free pair."""
    mu, k = 4.0 / 0.05**2, 100.0
    found = []
    for K in ([[2.0 * k, -k], [-k, k]], [[k, -k], [-k, k]]):
        system = vc.system_from_arrays([1.0, 1.0], None, K, coordinates=[[0.0], [1.0]])
        problem = vc.ContactProblem(system, vc.contact_points(system, [1], [1.0], gap0=1.0))
        A = matrix_of(vc.Midpoint(), problem, 0.05)
        found.append(float(vc.Condensed().prepare(A, problem.surface, 2.0).delassus.item()))
    chain, pair = found
    assert chain == pytest.approx((mu + 2.0 * k) / ((mu + 2.0 * k) * (mu + k) - k**2), rel=1e-12)
    assert pair == pytest.approx(0.5 / mu + 0.5 / (mu + 2.0 * k), rel=1e-12)
    return [f"$S = {1.0 / chain:.1f}$ N/m"]


def solved_friction(figures: ModuleType) -> list[str]:
    """Three answers to one load, and the reactions that stay after a shear."""
    G, q, mu = np.array([[1.0, 0.5], [0.5, 1.0]]), np.array([1.0, 8.0]), 3.0
    answers = ((0.0, 0.0), (2.0, -6.0), (4.0, -10.0))
    for r in answers:
        gap, back = q + G @ r
        assert gap >= 0.0 and r[0] >= 0.0 and r[0] * gap == 0.0
        assert abs(r[1]) <= mu * r[0] and (r[1] == -mu * r[0] * np.sign(back) or back == 0.0)
    for method in (solvers.FrictionNewton(), solvers.FixedPoint()):
        found = method.prepare(G, np.zeros(1, dtype=bool)).solve(
            q[None], np.zeros(1), np.array([mu])
        )
        assert not found.active.any() and not found.r.any()
    K = np.zeros((5, 5))
    K[:3, :3] = 1000.0 * np.array([[2.0, -1.0, -1.0], [-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]])
    u, states = None, []
    for force in (1.6, 0.0):
        system = vc.system_from_arrays(
            np.ones(5),
            None,
            K,
            coordinates=[[0.0, 1.0], [0.0, 0.0], [1.0, 0.0]],
            u0=u,
            unknowns=[(0, 0), (1, 0), (2, 0), (1, 1), (2, 1)],
            load=[force, 0.0, 0.0, -1.0, -3.0],
        )
        problem = vc.ContactProblem(
            system,
            vc.contact_points(system, [1, 2], [0.0, -1.0], gap0=0.0),
            friction=vc.Coulomb(0.5),
        )
        ((_, report),) = vc.march(problem, scheme=vc.ZienkiewiczWoodTaylor(1.0), dt=1e3, steps=1)
        u = report.new.u
        states.append((report.new.r_t[:, 0], 1e3 * u))
    (sheared, there), (left, after) = states
    return [
        ", ".join(f"$({a:.0f}, {b:.0f})$" for a, b in answers[:2])
        + " and $({:.0f}, {:.0f})$".format(*answers[2]),
        f"$r_t = ({sheared[0]:.1f}, {sheared[1]:.1f})$ N, and the first point has slipped by "
        f"{there[1]:.1f} mm",
        f"$r_t = ({left[0]:.1f}, {left[1]:.1f})$ N, and the top stays displaced by {after[0]:.1f} "
        "mm",
    ]


SOLVED: dict[str, Callable[[ModuleType], list[str]]] = {
    "inequality": solved_inequality,
    "step": solved_step,
    "blow_up": solved_blow_up,
    "certificate": solved_certificate,
    "ledger": solved_ledger,
    "condensation": solved_condensation,
    "friction": solved_friction,
}


@pytest.mark.parametrize("name", SOLVED)
@pytest.mark.promise("theory/solutions.md", "with 1/40 and 1/80 s are")
@pytest.mark.promise("theory/solutions.md", "The penetration may be")
def test_solutions_state_what_the_program_finds(
    figures: ModuleType, name: str, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.ERROR, "vi_contact")  # Newmark gains energy
    assert figures.lacking("solutions", SOLVED[name](figures)) == []


def test_each_exercise_has_its_solution(figures: ModuleType) -> None:
    """Pages and solutions link to each other and count the same exercises, of every page that has a
    figure."""
    text = (THEORY / "solutions.md").read_text(encoding="utf-8")
    parts = re.split(r"^## .*\n\n\[Exercises\]\((\w+)\.md#exercise\)\n", text, flags=re.MULTILINE)[
        1:
    ]
    solved = dict(zip(parts[::2], parts[1::2], strict=True))
    assert list(solved) == list(figures.PAGES) == list(SOLVED)
    for name, solution in solved.items():
        page = (THEORY / f"{name}.md").read_text(encoding="utf-8")
        exercises = page.partition("## Exercise\n")[2].partition("## Sources")[0]
        assert "[solutions](solutions.md#" in exercises
        numbers = [re.findall(r"^(\d)\. ", one, re.MULTILINE) for one in (exercises, solution)]
        assert numbers[0] == numbers[1] == ["1", "2", "3"]
