#!/usr/bin/env python3
"""Compute the reference of the thrown square on fine meshes and store it beside this file.

    python3 benchmarks/peers/thrown_reference.py            # n = 64, 128, 256; a few minutes

Central differences on lumped masses. The nodes at the ground have no mass in the normal direction;
the nodes above them have it. Their normal displacements follow the rest statically: every step
solves the complementarity problem of the ground's nodes, so that no impact of a mass disturbs the
force. The energy at the end over the first is stored.

The impulse is that of the finest mesh; its difference from the next mesh is stored as its error.
The largest force is exact: at touch-down the bottom starts a plane wave, of pressure rho c_P v, and
waves from the free sides lower the force from then on. The force of every mesh overshoots there for
a few crossings of an element; its mean over 2 ms is stored beside the exact value, which it
approaches as the mesh is refined, until the fall of the force itself shows.
"""

from __future__ import annotations

import json
import sys
import time

import numpy as np
from problems import HERE, THROWN, Square, complementarity, mass, stiffness


def speed() -> float:
    """Return c_P [m/s] of plane strain."""
    nu = THROWN["nu"]
    return float(
        np.sqrt(THROWN["E"] * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu)) / THROWN["rho"])
    )


def run(n: int) -> dict[str, float]:
    """Return the numbers of the thrown square on a mesh of n x n squares.

    They are impulse [N s/m], largest mean force [N/m], times of contact [s], and the energy at the
    end over the first.
    """
    mesh = Square(n)
    K = stiffness(mesh, THROWN["E"], THROWN["nu"])
    M = np.asarray(mass(mesh, THROWN["rho"]).sum(axis=1)).ravel()
    ground, above = 2 * mesh.bottom + 1, 2 * (mesh.bottom + n + 1) + 1
    M[above] += M[ground]
    rest = np.setdiff1d(np.arange(len(M)), ground)
    end = THROWN["dt"] * THROWN["steps"]
    steps = int(np.ceil(end / (0.5 / (n * speed()))))
    dt = end / steps
    K_gg, K_gr = K[ground][:, ground].toarray(), K[ground][:, rest]
    K_rr, K_rg, inverse = K[rest][:, rest], K[rest][:, ground], 1.0 / M[rest]
    flexible = np.linalg.inv(K_gg)
    u, v = np.zeros(len(rest)), np.zeros(len(rest))
    v[np.isin(rest, 2 * np.arange(len(mesh.points)) + 1)] = -THROWN["speed"]
    force, closed, y = np.zeros(steps + 1), False, np.zeros(n + 1)
    first, energy = 0.5 * M[rest] @ v**2, 0.0
    for k in range(steps + 1):
        pull = -(K_gr @ u)  # K_gg y = pull + r
        y = flexible @ pull
        closed = bool((y < -THROWN["gap"]).any())
        if closed:
            lifted, r = complementarity(K_gg, pull + K_gg.sum(axis=1) * THROWN["gap"])
            y, force[k] = lifted - THROWN["gap"], r.sum()
        acceleration = -(K_rr @ u + K_rg @ y) * inverse
        if k == steps:
            middle = v + 0.5 * dt * acceleration
            everything = np.zeros(len(M))
            everything[rest], everything[ground] = u, y
            energy = 0.5 * M[rest] @ middle**2 + 0.5 * everything @ (K @ everything)
        v = v + (dt if k else 0.5 * dt) * acceleration
        u = u + dt * v
    window = max(1, round(2.0e-3 / dt))
    mean = np.convolve(force, np.ones(window) / window, "valid")
    touching = np.flatnonzero(force > 0.0)
    return {
        "n": n,
        "steps": steps,
        "impulse": float(force.sum() * dt),
        "largest_mean_of_2_ms": float(mean.max()),
        "contact_start": float(touching[0] * dt),
        "contact_end": float(touching[-1] * dt),
        "energy_end": float(energy / first),
    }


def main(sizes: tuple[int, ...] = (64, 128, 256)) -> None:
    """Run all sizes, print them and store the finest."""
    runs = []
    for n in sizes:
        begin = time.process_time()
        runs.append(run(n))
        print(json.dumps(runs[-1]), f"{time.process_time() - begin:.1f} s", flush=True)
    fine, coarse = runs[-1], runs[-2]
    stored = {
        "command": "python3 benchmarks/peers/thrown_reference.py",
        "impulse": fine["impulse"],
        "impulse_uncertainty": abs(fine["impulse"] / coarse["impulse"] - 1.0),
        "largest_force": THROWN["rho"] * speed() * THROWN["speed"],
        "runs": runs,
    }
    if "--dry" not in sys.argv:
        (HERE / "thrown_reference.json").write_text(
            json.dumps(stored, indent=1) + "\n", encoding="utf-8"
        )


if __name__ == "__main__":
    main((16, 32) if "--dry" in sys.argv else (64, 128, 256))
