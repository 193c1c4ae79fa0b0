#!/usr/bin/env python3
"""Break a bar in tension: a phase field whose damage can only grow, which is a lower bound on d.

Each step is staggered: a plain linear solve gives the displacement, then the damage is found
between its values before and one. First the bar stays homogeneous, and is loaded beyond its peak
and unloaded; the answer is the closed form to the last digit. Then the ends keep d = 0, and the bar
breaks in the middle at once: the elastic energy falls to nothing. The surface energy is that of the
crack and of the damage all over the bar, which came before and cannot heal. The crack alone costs
Gc (1 + h / (2 l)); this is the least energy with d = 1 where the bar broke, a strip of nodes that
is h wide. The data are E = Gc = 1 and length 1.

    bash demos/run.sh crack                # a table and a figure, into results/crack
    bash demos/run.sh -n 2 crack           # the same on two ranks
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

# run from the source tree without installing
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import dolfinx
import numpy as np
import ufl
from mpi4py import MPI

from demos.parts.exact.crack import critical, homogeneous
from demos.parts.pictures.bounds import gathered, plot_crack
from vi_contact import vi
from vi_contact.fem import compat
from vi_contact.practice.cli import status_of
from vi_contact.solvers import ReducedNewton

# Parameters
# --------------------------------------------------------------------------------------------------
WIDTH = 0.05  # l
HEIGHT = 0.1
ACROSS = 8  # cells; the strip has ten times as many along it
# of the homogeneous bar, over the critical one
STRAINS = (0.4, 0.8, 1.0, 1.3, 1.6, 1.0, 0.4, 1.2, 1.6, 2.0)
PULLS = (0.5, 0.8, 0.95, 1.02, 1.1, 1.2)  # of the bar that breaks
LEFT = 1e-8  # of the stiffness where d = 1
SETTLED = 1e-5  # of d, between two rounds
ROUNDS = 1500  # of u and d in turn, at most
BROKEN = 0.98  # damage of nodes that count as broken
OUT = Path("results/crack")


class Bar:
    """Hold a strip without lateral displacement: displacement u along it, damage d.

    ``held`` says whether d = 0 at its ends. ``rounds`` of the staggered iteration, and the
    ``worst`` certificate, so far.
    """

    def __init__(self, comm: Any, across: int, held: bool) -> None:
        self.comm = comm
        self.across = across
        self.rounds = 0
        self.worst = 0.0
        on = dolfinx.mesh.create_rectangle(
            comm, [[-0.5, 0.0], [0.5, HEIGHT]], [10 * across, across]
        )
        V = compat.lagrange(on, 1)
        self.u, self.d, self.before = (dolfinx.fem.Function(V) for _ in range(3))
        self.pull = dolfinx.fem.Constant(on, 0.0)
        ends = [
            dolfinx.fem.locate_dofs_topological(
                V,
                1,
                dolfinx.mesh.locate_entities_boundary(on, 1, lambda x, at=at: np.isclose(x[0], at)),
            )
            for at in (-0.5, 0.5)
        ]
        zero = dolfinx.fem.Constant(on, 0.0)
        pulled = [
            dolfinx.fem.dirichletbc(zero, ends[0], V),
            dolfinx.fem.dirichletbc(self.pull, ends[1], V),
        ]
        sound = [dolfinx.fem.dirichletbc(zero, one, V) for one in ends] if held else []
        v, w = ufl.TestFunction(V), ufl.TrialFunction(V)
        left = (1.0 - self.d) ** 2 + LEFT
        balance = left * ufl.inner(ufl.grad(w), ufl.grad(v)) * ufl.dx, zero * v * ufl.dx
        self.balance = vi.Problem(balance, self.u, bcs=pulled, method=ReducedNewton())
        strain = ufl.inner(ufl.grad(self.u), ufl.grad(self.u))  # twice the energy, E = 1
        inner = ufl.inner(ufl.grad(self.d), ufl.grad(v))
        growth = (-(1.0 - self.d) * strain * v + self.d * v / WIDTH + WIDTH * inner) * ufl.dx
        self.growth = vi.Problem(growth, self.d, bcs=sound)
        surface = 0.5 * (self.d**2 / WIDTH + WIDTH * ufl.inner(ufl.grad(self.d), ufl.grad(self.d)))
        parts = (0.5 * left * strain, surface, (1.0 - self.d) ** 2 * self.u.dx(0))
        self.parts = [compat.compile_form(one * ufl.dx) for one in parts]

    def load(self, pull: float) -> tuple[float, float, float]:
        """Pull so far; return elastic and surface energy over Gc H, and the mean stress."""
        self.pull.value = pull
        self.before.x.array[:] = self.d.x.array
        for _ in range(ROUNDS):
            last = self.d.x.array.copy()
            linear = self.balance.solve()
            result = self.growth.solve(lower=self.before, upper=1.0)
            self.worst = max(self.worst, linear.certificate.worst, result.certificate.worst)
            self.rounds += 1
            if (
                self.comm.allreduce(float(np.max(np.abs(self.d.x.array - last))), op=MPI.MAX)
                < SETTLED
            ):
                break
        return self.energies()

    def energies(self) -> tuple[float, float, float]:
        """Return elastic and surface energy over Gc H, and the mean stress."""
        found = [
            float(self.comm.allreduce(dolfinx.fem.assemble_scalar(one))) / HEIGHT
            for one in self.parts
        ]
        return found[0], found[1], found[2]

    def crack_alone(self) -> float:
        """Let all damage heal but that of broken nodes, without load.

        It returns the surface energy over Gc H.
        """
        self.u.x.array[:] = 0.0
        self.before.x.array[:] = self.d.x.array > BROKEN
        self.growth.solve(lower=self.before, upper=1.0)
        return self.energies()[1]


def main(quick: bool = False, out: Path = OUT) -> dict[str, float]:
    """Run both bars (``quick``: half the cells, and the second one breaks at once).

    It returns stresses and energies.
    """
    comm = MPI.COMM_WORLD
    numbers = {}
    strain, stress = critical(WIDTH)
    even = Bar(comm, 2, held=False)
    found = np.array([even.load(one * strain)[2] for one in STRAINS]) / stress
    known = homogeneous(np.array(STRAINS) * strain, WIDTH)[1] / stress
    numbers["homogeneous: stress error"] = float(np.max(np.abs(found - known)))
    numbers["homogeneous: certificate"] = even.worst

    bar = Bar(comm, ACROSS // 2 if quick else ACROSS, held=True)
    pulls = PULLS[-1:] if quick else PULLS
    energies = np.array([bar.load(one * strain)[:2] for one in pulls])
    h = HEIGHT / bar.across
    numbers |= {
        "elastic": energies[-1, 0],
        "surface": energies[-1, 1],
        "h / l": h / WIDTH,
        "rounds": float(bar.rounds),
        "certificate": bar.worst,
    }
    broken = gathered(bar.d)
    numbers["crack alone"] = bar.crack_alone()
    numbers["1 + h / (2 l)"] = 1.0 + 0.5 * h / WIDTH
    alone = gathered(bar.d)
    if comm.rank == 0:
        assert broken is not None and alone is not None
        axis = np.abs(broken[0][:, 1]) < 1e-9
        x = broken[0][axis, 0]
        open_ = broken[1][axis] > BROKEN
        numbers["middle"] = float(np.mean(x[open_]))
        numbers["d"] = float(np.max(broken[1]))
        away = np.linspace(-9.0, 9.0, 801)
        near = np.maximum(np.abs(away) - 0.5 * float(np.ptp(x[open_])) / WIDTH, 0.0)
        out.mkdir(parents=True, exist_ok=True)
        path = np.interp(
            np.linspace(0, len(STRAINS), 500), np.arange(len(STRAINS) + 1), (0.0, *STRAINS)
        )
        place = (x - numbers["middle"]) / WIDTH
        plot_crack(
            (STRAINS, found, path, homogeneous(path * strain, WIDTH)[1] / stress),
            pulls,
            {"elastic": energies[:, 0], "surface": energies[:, 1]},
            {"just broken": (place, broken[1][axis]), "the crack alone": (place, alone[1][axis])},
            (away, np.exp(-near)),
            out / "crack.png",
        )
        print("\n".join(f"{name:<28} {value:.6g}" for name, value in numbers.items()))
        print(f"\nThe figure is in {out}.")
    comm.Barrier()
    return {key: comm.bcast(numbers.get(key)) for key in ("middle", "d")} | numbers


# Things to try: upper=1.0 left out: nothing changes; lower=0.0: cracks heal when the load goes
# back.
if __name__ == "__main__":
    raise SystemExit(status_of(main))
