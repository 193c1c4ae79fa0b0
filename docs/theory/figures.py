#!/usr/bin/env python3
"""Make the figures of the theory pages, and compare their numbers with those of the pages.

    python3 docs/theory/figures.py                       # all of them, into docs/figures
    python3 docs/theory/figures.py step friction         # two of them
    python3 docs/theory/figures.py --out results/theory  # into another folder

Each function draws docs/figures/theory_NAME.png of the page docs/theory/NAME.md and returns the
phrases with numbers that the page states about it. They are printed; where a page lacks one, the
status is 1.
"""

from __future__ import annotations

import argparse
import logging
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")
ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

import numpy as np  # noqa: E402
import scipy.sparse as sp  # noqa: E402

import vi_contact as vc  # noqa: E402
from vi_contact import solvers  # noqa: E402
from vi_contact.core import kkt_residual  # noqa: E402
from vi_contact.core.stage import make_matrix  # noqa: E402
from vi_contact.core.state_checks import initial_state  # noqa: E402
from vi_contact.exact.bar import PeriodicBar, ThrownBar  # noqa: E402
from vi_contact.exact.bouncing_bar import BouncingBar  # noqa: E402
from vi_contact.practice.plots.histories import canvas, save  # noqa: E402

BLUE, RED, GREEN, GREY = "tab:blue", "tab:red", "tab:green", "0.7"


# Small bodies
# --------------------------------------------------------------------------------------------------
def spring_mass(force: float) -> vc.ContactProblem:
    """Hang a mass of 1 kg on a spring of 100 N/m and push it towards a wall that is 5 cm away."""
    system = vc.system_from_arrays([1.0], None, [[100.0]], coordinates=[[0.0]], load=[force])
    return vc.ContactProblem(system, vc.contact_points(system, [0], [1.0], gap0=0.05))


def two_masses() -> vc.ContactProblem:
    """Join two masses of 1 kg, each on its own spring, by a third spring; each has a wall."""
    K = [[200.0, -100.0], [-100.0, 200.0]]
    system = vc.system_from_arrays([1.0, 1.0], None, K, coordinates=[[0.0], [1.0]], v0=[1.0, 0.2])
    return vc.ContactProblem(system, vc.contact_points(system, [0, 1], [1.0], gap0=[0.02, 0.04]))


def bar(case: Any, n: int, *, damping: float = 0.0, **more: Any) -> vc.ContactProblem:
    """Put a bar of n linear elements above its wall, section 1 m²; ``damping`` [s] times K is C."""
    h, side, ends = case.length / n, np.ones(n), np.full(n + 1, 2.0)
    ends[[0, -1]] = 1.0
    K = case.E / h * sp.diags([-side, ends, -side], [-1, 0, 1])
    M = case.rho * h / 6.0 * sp.diags([side, 2.0 * ends, side], [-1, 0, 1])
    x = np.linspace(0.0, case.length, n + 1)
    data: dict[str, Any] = {"coordinates": x[:, None]}
    if isinstance(case, PeriodicBar):
        data |= {"clamped": [n], "u0": 0.5 * (1.0 - x)}
    elif isinstance(case, ThrownBar):
        data["v0"] = np.full(n + 1, -case.speed)
    else:
        data["load"] = -case.gravity * np.asarray(M.sum(axis=1)).ravel()
    system = vc.system_from_arrays(M, damping * K if damping else None, K, **data)
    surface = vc.contact_points(system, [0], [-1.0], gap0=getattr(case, "height", 0.0))
    return vc.ContactProblem(system, surface, **more)


def simulated(problem: vc.ContactProblem, scheme: Any, dt: float, t_end: float) -> Any:
    """Return the history and the facts of a run that writes nothing else."""
    found = vc.simulate(
        problem,
        scheme=scheme,
        dt=dt,
        t_end=t_end,
        record=(vc.Energy(), vc.Contact()),
        progress=False,
    )
    return found.history, found.facts


# Figures
# --------------------------------------------------------------------------------------------------
def inequality(path: Path) -> list[str]:
    """Draw the energy of a mass beside its wall, and reactions against gaps for growing loads."""
    k, g0, loads = 100.0, 0.05, (2.0, 8.0)
    figure, (left, right) = pair()
    u = np.linspace(-0.03, 0.11, 200)
    left.axvspan(g0, u[-1], color="0.9", zorder=0)
    left.text(g0 + 0.003, 0.32, "behind the wall", fontsize=9, color="0.4")
    answers = {}
    for f, colour in zip(loads, (BLUE, RED), strict=True):
        state = vc.static_equilibrium(spring_mass(f))
        answers[f] = float(state.u[0]), float(state.r_n[0])
        at, r = answers[f]
        energy = 0.5 * k * u**2 - f * u
        left.plot(u, energy, color=colour, label=f"f = {f:g} N")
        left.plot(at, 0.5 * k * at**2 - f * at, "o", color=colour, ms=8)
        if r > 0.0:
            left.plot(f / k, -0.5 * f**2 / k, "o", mfc="none", color=colour, ms=8)
            left.plot(
                [at - 0.02, at + 0.02],
                0.5 * k * at**2 - f * at + r * np.array([0.02, -0.02]),
                "--",
                lw=1,
                color="black",
                label=f"slope -{r:g} N = $-r_n$",
            )
    left.set(
        xlabel="displacement u [m]",
        ylabel="energy J(u) [J]",
        ylim=(-0.4, 0.4),
        title="minimum over $u \\leq g_0$",
    )
    left.legend(fontsize=8, loc="lower left")
    corner = np.array([[0.0, 7.0], [0.0, 0.0], [0.06, 0.0]])
    right.plot(
        1e3 * corner[:, 0], corner[:, 1], color=GREY, lw=5, solid_joinstyle="miter", zorder=0
    )
    for f in range(0, 11, 2):
        state = vc.static_equilibrium(spring_mass(float(f)))
        gap, r = g0 - float(state.u[0]), float(state.r_n[0])
        right.plot(1e3 * gap, r, "o", color="black")
        right.annotate(f"f = {f} N", (1e3 * gap, r), (5, 6), textcoords="offset points", fontsize=8)
    right.set(
        xlabel="gap $g_0 - u$ [mm]",
        ylabel="reaction $r_n$ [N]",
        xlim=(-3, 60),
        ylim=(-0.4, 7),
        title="gap and reaction: never both",
    )
    save(figure, path)
    (free, none), (at, r) = answers[2.0], answers[8.0]
    assert none == 0.0
    return [
        f"$f = 2$ N it rests at $u = {free:.2f}$ m",
        f"$f = 8$ N it rests at $u = {at:.2f}$ m with $r_n = {r:.0f}$ N",
        f"at $u = {8.0 / k:.2f}$ m",
    ]


def step(path: Path) -> list[str]:
    """Draw the quadratic program of a midpoint step of two masses.

    Beside it is the energy that schemes leave to an oscillator.
    """
    dt, figure, axes = 0.05, *pair()
    ((_, report),) = vc.march(
        two_masses(), scheme=vc.Midpoint(), solver=vc.Condensed(), dt=dt, steps=1
    )
    one = find_whole_step(report.step)
    x = report.new.u
    r = report.result.r_n
    A = np.column_stack([one.A @ e for e in np.eye(2)])
    free = np.linalg.solve(A, one.b)
    X, Y = np.meshgrid(np.linspace(0.0, 0.06, 121), np.linspace(-0.01, 0.05, 121))
    J = (
        0.5 * (A[0, 0] * X**2 + 2.0 * A[0, 1] * X * Y + A[1, 1] * Y**2)
        - one.b[0] * X
        - one.b[1] * Y
    )
    left, right = axes
    left.contour(
        1e3 * X,
        1e3 * Y,
        J - J.min(),
        levels=np.array([0.02, 0.08, 0.2, 0.4, 0.7, 1.1, 1.6]),
        colors=GREY,
        linewidths=1,
    )
    for bound, span, line in zip(
        1e3 * one.bound, (left.axvspan, left.axhspan), (left.axvline, left.axhline), strict=True
    ):
        span(bound, 100.0, color="0.85", alpha=0.6, zorder=0)
        line(bound, color="0.4", lw=1)
    left.plot(*(1e3 * free), "o", mfc="none", color=RED, ms=9, label="$A^{-1} b$, contact ignored")
    left.plot(*(1e3 * x), "o", color=BLUE, ms=9, label="x, the answer")
    left.annotate("", 1e3 * x, 1e3 * free, arrowprops={"arrowstyle": "->", "color": "black"})
    left.set(
        xlabel="$x_1$ [mm]",
        ylabel="$x_2$ [mm]",
        xlim=(0, 60),
        ylim=(-10, 50),
        title="one step: a quadratic program",
    )
    left.legend(fontsize=8, loc="lower right")
    kept = {}
    schemes = {
        "φ = ½, midpoint": vc.Midpoint(),
        "φ = 0.6": vc.ZienkiewiczWoodTaylor(0.6),
        "φ = 1, backward Euler": vc.ZienkiewiczWoodTaylor(1.0),
    }
    for (name, scheme), look in zip(schemes.items(), ("-", "--", ":"), strict=True):
        h, _ = simulated(released(), scheme, dt, 60 * dt)
        total = (h["energy_kinetic"] + h["energy_strain"]) / (
            h["energy_kinetic"] + h["energy_strain"]
        )[0]
        kept[name] = total[20]
        right.plot(h["t"], total, look, color="black", label=name)
    right.set(
        xlabel="time [s]",
        ylabel="energy / energy at the start [-]",
        ylim=(0, 1.1),
        title="what φ does, no contact",
    )
    right.legend(fontsize=8, loc="center right")
    save(figure, path)
    found = list(kept.values())
    return [
        f"${1e3 * free[0]:.1f}$ mm and ${1e3 * free[1]:.1f}$ mm",
        f"${1e3 * x[0]:.1f}$ mm and ${1e3 * x[1]:.1f}$ mm",
        f"$r_1 = {r[0]:.1f}$ N and $r_2 = {r[1]:.0f}$ N",
        f"${r[0] / one.scale:.1f}$ N in the mean",
        f"{100 * found[0]:.0f} %, {100 * found[1]:.0f} % and {100 * found[2]:.1f} %",
    ]


def released() -> vc.ContactProblem:
    """Let a mass of 1 kg on a spring of 100 N/m go at 1 cm; it meets no wall."""
    system = vc.system_from_arrays([1.0], None, [[100.0]], coordinates=[[0.0]], u0=[0.01])
    return vc.ContactProblem(system, vc.contact_points(system, [0], [1.0], gap0=1.0))


def blow_up(path: Path) -> list[str]:
    """Draw contact force and energy of four schemes on the bar that bounces under its weight."""
    case, n, exact = BouncingBar(), 50, BouncingBar().force
    schemes = {
        "Newmark, mass at the contact node": (vc.Newmark(), vc.ConsistentMass()),
        "midpoint rule, mass at the contact node": (vc.Midpoint(), None),
        "Moreau–Jean, e = 0: condition on the velocity": (vc.MoreauJean(), None),
        "trapezoidal rule, no mass at the contact node": (vc.Trapezoidal(), None),
    }
    dt = 0.5 * case.length / n / case.wave_speed
    figure, axes = pair(5, 2.1, sharex=True)
    phrases, fine = [], np.linspace(0.0, case.period, 3000)
    top = float(exact(fine).max())
    for (name, (scheme, mass)), axis, look in zip(
        schemes.items(), axes, (RED, BLUE, GREEN, "black"), strict=False
    ):
        h, _ = simulated(bar(case, n, mass=mass), scheme, dt, case.period)
        # weight is in the input
        change = h["energy_kinetic"] + h["energy_strain"] - h["work_input"]
        energy = 1.0 + (change - change[0]) / case.energy
        force = h["contact_resultant"]
        axis.plot(fine, exact(fine), color=GREY, lw=3, label="exact")
        axis.plot(h["t"], force, color=look, lw=0.7)
        axis.set_ylim(-0.1 * top, 2.0 * top)
        axis.set_title(name, fontsize=10, loc="left")
        axis.set_ylabel("force [N]")
        axes[-1].plot(h["t"], energy, color=look, lw=1.2, label=name.split(",")[0])
        # chaotic: other digits elsewhere
        phrases.append(
            f"{force.max() / top:.2f} | {energy[-1]:.3f}"
            if energy[-1] < 10.0
            else f"more than 10 | more than {10 * int(energy[-1] / 10.0)}"
        )
        if force.max() > 2.0 * top:
            axis.text(
                0.33,
                0.8,
                f"up to {force.max() / top:.0f} times\nthe largest exact force",
                fontsize=9,
                va="top",
                transform=axis.transAxes,
                color=look,
            )
    axes[0].legend(fontsize=8, loc="upper left")
    axes[-1].set(xlabel="time [s]", ylabel="energy / exact [-]", ylim=(0.965, 1.02))
    axes[-1].set_title("energy; Newmark leaves the panel", fontsize=10, loc="left")
    axes[-1].legend(fontsize=8, loc="lower left")
    save(figure, path)
    return phrases


def certificate(path: Path) -> list[str]:
    """Draw certificates of a run, of answers that were spoiled, and beside the velocity's error."""
    case, reports, figure, axes = ThrownBar(), [], *pair(3, 3.2)
    n = 100
    dt = 0.5 * case.length / n / case.wave_speed
    for _, report in vc.march(bar(case, n), solver=vc.Condensed(), dt=dt, t_end=1.5):
        reports.append(report)
    worst = np.array([report.certificate.worst for report in reports])
    spoiled = np.array(
        [
            kkt_residual(
                report.step, replace(report.result, r_n=report.result.r_n * (1.0 + 1e-5))
            ).worst
            for report in reports
        ]
    )
    t, floor = [report.new.t for report in reports], 1e-17
    left, middle, right = axes
    left.semilogy(
        t, np.maximum(spoiled, floor), color=RED, lw=1, label="reactions too large by 1e-5"
    )
    left.semilogy(t, np.maximum(worst, floor), color="black", lw=1, label="as solved")
    left.set(xlabel="time [s]", ylabel="certificate [-]", title="every step")
    inside = reports[len(reports) * 2 // 3]
    sizes = 10.0 ** np.arange(-16, 0.5, 0.5)
    for what, look in (("reaction", "o-"), ("foot", "s--")):
        residuals = [
            kkt_residual(inside.step, spoil(inside.result, inside.step, what, size)).worst
            for size in sizes
        ]
        middle.loglog(
            sizes,
            np.maximum(residuals, floor),
            look,
            ms=3,
            lw=1,
            color="black" if what == "foot" else RED,
            label={"reaction": "reaction too large", "foot": "foot in the wall"}[what],
        )
    middle.set(
        xlabel="relative size of the fault [-]", ylabel="certificate [-]", title="a spoiled step"
    )
    counts, errors, tops = (10, 20, 40, 80, 160), [], []
    for n in counts:
        error, top = velocity_error(case, n)
        errors.append(error)
        tops.append(top)
    right.loglog(counts, errors, "o-", color=BLUE, label="error of the velocity")
    right.loglog(counts, np.maximum(tops, floor), "o-", color="black", label="worst certificate")
    right.set(xlabel="elements [-]", ylabel="relative size [-]", title="what it does not see")
    for axis in axes:
        axis.axhline(1e-9, color=GREEN, ls="--", lw=1.5, label="tolerance")
        axis.set_ylim(1e-17, 10.0)
        axis.legend(
            fontsize=7.5,
            loc="lower right"
            if axis is middle
            else "upper right"
            if axis is left
            else "center right",
        )
    save(figure, path)
    assert worst.max() < 1e-13 and max(tops) < 1e-13
    told = spoiled[[report.new.active.any() for report in reports]]
    # the largest fault of the reaction that the tolerance accepts
    largest = 1e-5 * 1e-9 / np.median(told)
    tolerated = f"${1e9 * largest:.0f} \\cdot 10^{{-9}}$"
    slope = np.log(errors[-1] / errors[0]) / np.log(counts[-1] / counts[0])
    return [
        f"{len(reports)} steps",
        "below 1e-13",
        tolerated,
        f"from {100 * errors[0]:.0f} % with 10 elements to {100 * errors[-1]:.0f} % with 160",
        f"order {-slope:.2f}",
    ]


def find_whole_step(step: vc.StepProblem) -> vc.StepProblem:
    """Return the step for x itself, as pages write it, of one that is posed for an increment."""
    origin = step.origin
    return replace(
        step,
        b=step.b + step.A @ origin,
        bound=step.bound + step.surface.normal_values(origin),
        guess=origin,
        origin=None,
        internal=None,
    )


def spoil(result: Any, problem: Any, what: str, size: float) -> Any:
    """Return an answer with a reaction too large by ``size``, or a foot that far in the wall."""
    if what == "reaction":
        return replace(result, r_n=result.r_n * (1.0 + size))
    x = result.x.copy()
    x[problem.surface.owned] += size * np.abs(problem.origin + x).max()
    return replace(result, x=x)


def velocity_error(case: ThrownBar, n: int) -> tuple[float, float]:
    """Return the relative error of the velocities amid the contact, and the worst certificate.

    The error is that of the mean square.
    """
    problem, h = bar(case, n), case.length / n
    at = case.contact_start + 0.5 * case.crossing
    steps = round(at / (0.5 * h / case.wave_speed))
    worst = 0.0
    for _, report in vc.march(problem, solver=vc.Condensed(), dt=at / steps, steps=steps):
        worst = max(worst, report.certificate.worst)
    x = np.linspace(0.0, case.length, n + 1)
    wanted, v = case.velocity(x, at), problem.cartesian(report.new.v)
    return float(np.linalg.norm(np.ravel(v) - wanted) / np.linalg.norm(wanted)), worst


@dataclass(frozen=True)
class Careless(vc.ZienkiewiczWoodTaylor):
    """Step by the midpoint rule with a fault.

    It takes the mean velocity of the step for the one at its end.
    """

    phi: float = 0.5

    def finish(self, problem: Any, state: Any, stage: Any, answer: Any, dt: float) -> Any:
        """Return the state with v1 = (u1 - u0)/dt."""
        right = super().finish(problem, state, stage, answer, dt)
        return replace(right, v=(answer.x - state.u) / dt)


def ledger(path: Path) -> list[str]:
    """Draw where the energy of the clamped bar goes, and the defects of two schemes.

    One of them is sound, the other has a fault.
    """
    case, n, end = PeriodicBar(), 20, 8.6
    dt, (figure, (left, right)) = 0.5 / n, pair()
    inelastic = vc.Inelastic(vc.ImpulseUpdate())
    terms = {
        "energy_kinetic": "kinetic energy",
        "energy_strain": "strain energy",
        "loss_damping": "damping",
        "loss_contact": "closing contact",
        "loss_impact": "impact law",
        "loss_algorithmic": "scheme",
    }
    sound = bar(case, n, damping=1.5e-3, impact=inelastic)
    h, facts = simulated(sound, vc.ZienkiewiczWoodTaylor(0.53), dt, end)
    start = (h["energy_kinetic"] + h["energy_strain"])[0]
    left.stackplot(
        h["t"],
        [h[name] / start for name in terms],
        labels=list(terms.values()),
        colors=["#9ecae1", "#3182bd", "#fdae6b", "#a1d99b", "#d62728", "0.6"],
    )
    left.set(
        xlabel="time [s]",
        ylabel="share of E(0) [-]",
        ylim=(0, 1.02),
        xlim=(0, end),
        title="a closed ledger",
    )
    left.legend(fontsize=8, loc="lower left", framealpha=0.9)
    right.semilogy(
        h["t"],
        np.maximum(np.abs(h["energy_defect"]) / start, 1e-17),
        color="black",
        lw=1,
        label="sound scheme",
    )
    faulty, wrong = simulated(bar(case, n), Careless(), dt, end)
    scale = (faulty["energy_kinetic"] + faulty["energy_strain"])[0]
    right.semilogy(
        faulty["t"],
        np.maximum(np.abs(faulty["energy_defect"]) / scale, 1e-17),
        color=RED,
        lw=1.2,
        label="faulty scheme",
    )
    right.semilogy(
        faulty["t"],
        np.maximum(faulty["certificate"], 1e-17),
        color=GREEN,
        lw=1,
        ls="--",
        label="certificate of the faulty one",
    )
    right.set(
        xlabel="time [s]", ylabel="|defect| / E(0) [-]", ylim=(1e-17, 10), title="an open one"
    )
    right.legend(fontsize=8, loc="center right")
    save(figure, path)
    shares = {name: h[name][-1] / start for name in terms}
    assert facts["energy_defect"] < 1e-12 and wrong["worst_certificate"] < 1e-13
    assert abs(sum(shares.values()) - 1.0) < 1e-12
    return [
        *(f"{100 * share:.1f} %" for share in shares.values()),
        f"{100 * abs(faulty['energy_defect'][-1]) / scale:.0f} %",
    ]


def condensation(path: Path) -> list[str]:
    """Draw the Delassus operator of a block's face, and how it decays for three time steps."""
    problem = hanging_block(
        (1.0, 0.5), (60, 30), (0.0, -300.0), gap=0.001, mass=vc.ConsistentMass()
    )
    surface, c = problem.surface, np.sqrt(1000.0 * 0.7 / (1.3 * 0.4))
    order = np.argsort(surface.points[:, 0])
    position, flexibility = surface.points[order, 0], {}
    for courant in (1.0, 4.0, 16.0):
        dt = courant / 60.0 / c
        stage = vc.Midpoint().stage(problem, initial_state(problem), dt)
        A = make_matrix(problem.equations, stage)
        flexibility[courant] = (
            vc.Condensed().prepare(A, surface, 2.0).delassus[np.ix_(order, order)]
        )
    figure, (left, right) = pair(height=4.2, lattice=False)
    G = np.abs(flexibility[16.0])
    image = left.imshow(np.log10(G / G.max()), cmap="viridis", extent=(0, 1, 1, 0), vmin=-4, vmax=0)
    figure.colorbar(image, ax=left, label="$\\log_{10}(|G_{ij}|$ / largest) [-]", shrink=0.85)
    left.set(
        xlabel="place of point j [m]", ylabel="place of point i [m]", title="G at Courant number 16"
    )
    middle, phrases = len(order) // 2, []
    far = position[middle:] - position[middle]
    for (courant, G), look in zip(flexibility.items(), ("-", "--", ":"), strict=True):
        decay = np.abs(G[middle, middle:]) / G[middle, middle]
        right.semilogy(far, decay, look, color="black", label=f"Courant number {courant:g}")
        if courant == 4.0:
            tail = (far > 0.15) & (far < 0.4)
            length = -1.0 / np.polyfit(far[tail], np.log(decay[tail]), 1)[0]
            phrases = [
                f"$c_P \\Delta t/2 = {1e3 * 0.5 * courant / 60.0:.0f}$ mm",
                f"${1e3 * length:.0f}$ mm",
            ]
    right.set(
        xlabel="distance of the points [m]",
        ylabel="$|G_{ij}|$ / $G_{ii}$ [-]",
        ylim=(1e-8, 2),
        xlim=(0, 0.5),
        title="how far a push is felt in a step",
    )
    right.legend(fontsize=8)
    right.grid(alpha=0.3)
    save(figure, path)
    checked = vc.cross_check(
        problem, scheme=vc.Midpoint(), solvers=(vc.Condensed(), vc.Volume()), dt=1e-3, steps=40
    )
    assert checked.worst < 1e-9, checked.worst
    return [f"{problem.system.rows} unknowns", f"{surface.total} contact points", *phrases]


def friction(path: Path) -> list[str]:
    """Draw how the fixed point on Tresca's law converges, and what points of a rubbing block do."""
    figure, (left, right) = pair()
    G, none, rates = np.array([[1.0, 0.5], [0.5, 1.0]]), np.zeros(1), []
    method = solvers.FixedPoint()
    for mu, look in zip((0.4, 1.0, 1.6), ("-", "--", ":"), strict=True):
        found = method.prepare(G, np.zeros(1, dtype=bool)).solve(
            np.array([[-1.0, -3.0]]), none, np.array([mu])
        )
        history = np.array(found.history)
        left.semilogy(
            1 + np.arange(len(history)),
            history,
            look,
            color="black",
            label=f"one point, μ = {mu:g}",
        )
        rates.append(float((history[-1] / history[4]) ** (1.0 / (len(history) - 5))))
    problem, dt = rubbing_block(0.6)
    _, report = next(
        iter(
            vc.march(
                problem,
                scheme=vc.ZienkiewiczWoodTaylor(1.0),
                dt=dt,
                steps=1,
                solver=vc.Condensed(friction_method=method),
            )
        )
    )
    history = report.result.history
    left.semilogy(
        1 + np.arange(len(history)), history, "o-", ms=4, color=BLUE, label="block, μ = 0.6"
    )
    left.set(
        xlabel="Tresca problems [-]",
        ylabel="relative change of the limits [-]",
        xlim=(0, 60),
        ylim=(1e-13, 2),
        title="fixed point on Tresca's law",
    )
    left.legend(fontsize=8)
    weights, r_n, r_t = problem.surface.weights, report.new.r_n, report.new.r_t[:, 0]
    slip = problem.surface.tangential_values(report.new.u)[:, 0]
    slides = report.new.active & (np.abs(slip) > 1e-12)
    sticks = report.new.active & ~slides
    top = 1.1 * (r_n / weights).max()
    right.fill_between([0.0, top], [0.0, -0.6 * top], [0.0, 0.6 * top], color="0.92", zorder=0)
    right.plot([0.0, top], [0.0, 0.6 * top], color="0.4", lw=1)
    right.plot([0.0, top], [0.0, -0.6 * top], color="0.4", lw=1)
    right.plot(
        (r_n / weights)[sticks],
        (r_t / weights)[sticks],
        "o",
        mfc="none",
        color=BLUE,
        label="sticks",
    )
    right.plot((r_n / weights)[slides], (r_t / weights)[slides], "o", color=RED, label="slips")
    right.set(
        xlabel="pressure $r_n$ / weight [Pa]",
        ylabel="friction $r_t$ / weight [Pa]",
        xlim=(0, top),
        title="a step: the points in Coulomb's cone",
    )
    right.legend(fontsize=8, loc="lower right")
    save(figure, path)
    assert np.allclose(
        r_t[slides], 0.6 * r_n[slides] * np.sign(slip[slides]), rtol=1e-9, atol=1e-9 * r_n.max()
    )
    assert np.all(np.abs(r_t[sticks]) <= 0.6 * r_n[sticks] * (1.0 + 1e-9))
    return [
        ", ".join(f"{rate:.2f}" for rate in rates[:2]) + f" and {rates[2]:.2f}",
        f"{len(history) + 1} problems of Tresca",
        f"{np.count_nonzero(sticks)} of {np.count_nonzero(report.new.active)} closed points stick",
    ]


def rubbing_block(mu: float) -> tuple[vc.ContactProblem, float]:
    """Press a block down and aside, and return it with a long time step [s]."""
    return hanging_block((1.0, 1.0), (24, 24), (110.0, -200.0), friction=vc.Coulomb(mu)), 1.0


def hanging_block(
    lengths: Any, divisions: Any, force: Any, gap: float = 0.0, **more: Any
) -> vc.ContactProblem:
    """Hang a block by its clamped top over the ground, to be moved by body forces."""
    from mpi4py import MPI

    from vi_contact import fem
    from vi_contact.meshes import BlockMesh

    mesh, tags = fem.build_mesh(BlockMesh(lengths=lengths, divisions=divisions), MPI.COMM_WORLD)
    system = fem.assemble(
        mesh,
        vc.LinearElastic(E=1000.0, nu=0.3, rho=1.0),
        section=vc.PlaneStrain(),
        clamped=tags["top"],
        loads=fem.BodyForce(force),
    )
    ground = vc.HalfSpace(point=(0.0, -gap), normal=(0.0, 1.0))
    return vc.ContactProblem(
        system, fem.contact_surface(system, tags["bottom"], obstacle=ground), **more
    )


def pair(rows: int = 2, height: float = 3.7, **more: Any) -> tuple[Any, Any]:
    """Make a figure of panels above each other, as narrow as a telephone can show."""
    figure, axes = canvas(rows, 1, (5.8, rows * height), **more)
    return figure, axes[:, 0]


PAGES: dict[str, Callable[[Path], list[str]]] = {
    one.__name__: one
    for one in (inequality, step, blow_up, certificate, ledger, condensation, friction)
}


def lacking(name: str, phrases: list[str]) -> list[str]:
    """Return the phrases that the page of this name does not have, wherever its lines break."""
    text = " ".join((ROOT / "docs" / "theory" / f"{name}.md").read_text(encoding="utf-8").split())
    return [phrase for phrase in phrases if " ".join(phrase.split()) not in text]


def main() -> int:
    """Draw what was asked for; 1 when a page states other numbers."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", help=f"of {', '.join(PAGES)}; all when none is given")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "figures")
    options = parser.parse_args()
    # some schemes are here because they gain energy
    logging.getLogger("vi_contact").setLevel(logging.ERROR)
    options.out.mkdir(parents=True, exist_ok=True)
    status = 0
    for name in options.names or PAGES:
        phrases = PAGES[name](options.out / f"theory_{name}.png")
        missing = lacking(name, phrases)
        for phrase in phrases:
            print(f"{name}: {phrase}", flush=True)
        for phrase in missing:
            print(f"docs/theory/{name}.md does not say: {phrase}", file=sys.stderr)
        status = 1 if missing else status
    return status


if __name__ == "__main__":
    raise SystemExit(main())
