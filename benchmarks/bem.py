#!/usr/bin/env python3
"""Measure accuracy and cost of boundary elements against elements, steps and long times.

    python3 benchmarks/bem.py [--sides 5 10 20 40] [--steps 60 120 240] [--long] [--thin]
    python3 benchmarks/bem.py --json [--k 40 80] [--n 240 480]

The body is the unit square with c_P = 1, c_S = 1/2, rho = 1, k elements on a side, c_P dt = h, and
the symmetric form. Every row is computed by one thread in a process of its own, and its seconds are
processor time. Errors are relative L2 norms over all nodes and steps. Two problems have exact
solutions: oblique plane pulses of duration 2 up to T = 4 in a square without supports, and the top
of a rod between rollers under a step and under a sin² load up to T = 6.

--steps adds rows with k = 10 and other numbers of steps. --long computes the rod up to T = 60 for
c_P dt / h from 0.1 to 4. --thin computes a rod of widths down to h/20 under the sin² load, with c_P
dt = h and h/2, and by Radau IIA with c_P dt = h.

--json prints seconds and memory of two ways to store and to condense the blocks. "direct" stores
dense blocks and marches with all columns. "compressed" interpolates the tails and uses a circle of
frequencies. A row has these keys:

* k, steps, way;
* assembly_s, condensation_s, and total_s, which is their sum;
* march_s: the motion of the rod by the method of this way; it is left out beyond k = 40;
* peak_mb, blocks_mb: memory;
* ratio_to_direct: total_s over that of the direct way, measured in the same run at k = 20 and 120
  steps. For larger k it is over the direct cost that follows from it: assembly grows like N n²,
  condensation like N² n² (k + 1);
* error_against_exact: relative L2 error of the rod under the sin² load.

growth has the exponents of total_s in N at k = 10 between the two largest numbers of steps, before
(direct) and after (compressed). --k and --n are the sizes of the compressed rows.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"
ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "bem"), str(ROOT / "tests" / "support")]

import numpy as np  # noqa: E402
from convolution_operator import convolution_operator  # noqa: E402
from plane_waves import MATERIAL, SQUARE, pulse  # noqa: E402
from test_convolution import rod as convolution_rod  # noqa: E402
from test_energetic import echoes, rod, smooth_integral, smooth_load  # noqa: E402

from vi_contact import bem  # noqa: E402

DIRECT = (20, 120)  # k and steps of the row that ratios refer to
GROWTH = (10, (120, 240, 480))  # k and numbers of steps
COLUMNS = ("k", "steps", "assembly", "march", "condense", "blocks MB", "peak MB")
ERRORS = ("pulse P", "pulse S", "step", "sin²", "base", "max base")


def row(k: int, steps: int, *, errors: bool) -> dict[str, float]:
    """Return times [s], memory and errors of k elements a side and so many steps."""
    start = time.process_time()
    blocks = bem.energetic_blocks(bem.polygon(SQUARE, 1.0 / k), MATERIAL, dt=1.0 / k, steps=steps)
    result = {"k": k, "steps": steps, "assembly": time.process_time() - start}
    if errors:
        result |= wave_errors(blocks, k) | rod_errors(blocks)
    problem = rod(blocks, smooth_load)
    start = time.process_time()
    problem.solve()
    result["march"] = time.process_time() - start
    start = time.process_time()
    problem.condensed()
    result["condense"] = time.process_time() - start
    parts = (
        [part.values for part in blocks.stretches]
        if isinstance(blocks, bem.CompressedBlocks)
        else [blocks.single, blocks.double, blocks.hyper]
    )
    result["blocks MB"] = sum(part.nbytes for part in parts) / 1e6
    return result | {
        "peak MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0 * 1.048576
    }


def cost(k: int, steps: int, way: str) -> dict[str, float | str]:
    """Return seconds and memory of one size with dense ("direct") or compressed blocks."""
    start = time.process_time()
    blocks = bem.energetic_blocks(
        bem.polygon(SQUARE, 1.0 / k),
        MATERIAL,
        dt=1.0 / k,
        steps=steps,
        compressed=way == "compressed",
    )
    result: dict[str, float | str] = {
        "k": k,
        "steps": steps,
        "way": way,
        "assembly_s": time.process_time() - start,
    }
    problem = rod(blocks, smooth_load)
    start = time.process_time()
    problem.condensed()
    result["condensation_s"] = time.process_time() - start
    result["total_s"] = result["assembly_s"] + result["condensation_s"]
    if isinstance(blocks, bem.CompressedBlocks):
        result["blocks_mb"] = sum(part.values.nbytes for part in blocks.stretches) / 1e6
        result["errors"] = [float(value) for value in blocks.errors]
    else:
        result["blocks_mb"] = (
            sum(part.nbytes for part in (blocks.single, blocks.double, blocks.hyper)) / 1e6
        )
    if k <= 40:
        start = time.process_time()
        motion = problem.solve()
        result["march_s"] = time.process_time() - start
        exact = echoes(motion.times, smooth_integral)[:, None]
        top = motion.displacement[:, 1][:, blocks.mesh.nodes_of(blocks.mesh.labels == 2)]
        result["error_against_exact"] = float(
            np.linalg.norm(top - exact) / np.linalg.norm(np.broadcast_to(exact, top.shape))
        )
    result["peak_mb"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0 * 1.048576
    return result


def measured(*arguments: object) -> dict:
    """Return what this script prints as JSON in another process, whose memory is its own."""
    command = [sys.executable, __file__, *map(str, arguments)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def costs(sides: list[int], steps: list[int]) -> dict:
    """Return all rows of --json, and the growth in the number of steps."""
    direct = measured("--cost", *DIRECT, "direct")
    rows = [direct, measured("--cost", *DIRECT, "compressed")]
    rows += [measured("--cost", k, n, "compressed") for k, n in zip(sides, steps, strict=True)]
    for row in rows:
        in_n, in_k = row["steps"] / direct["steps"], row["k"] / direct["k"]
        before = in_n * in_k**2 * direct["assembly_s"] + (
            in_n**2 * in_k**2 * (row["k"] + 1) / (direct["k"] + 1) * direct["condensation_s"]
        )
        row["ratio_to_direct"] = row["total_s"] / before
    growth = {}
    for name, way in (("before", "direct"), ("after", "compressed")):
        last = [measured("--cost", GROWTH[0], n, way) for n in GROWTH[1]]
        rows += last
        growth[name] = {
            part: float(np.log2(last[-1][part] / last[-2][part]))
            for part in ("assembly_s", "condensation_s", "total_s")
        }
    return {"rows": rows, "growth_in_steps": growth}


def wave_errors(blocks: bem.EnergeticBlocks, k: int) -> dict[str, float]:
    """Return the relative L2 errors of plane P and S pulses that cross the square until T = 4."""
    errors = {}
    for name, shear in (("pulse P", False), ("pulse S", True)):
        wave = pulse(shear=shear)
        mesh = blocks.mesh
        forces = bem.traction_forces(mesh, wave.traction, dt=blocks.dt, steps=4 * k)
        exact = np.array(
            [wave.displacement(mesh.points, blocks.dt * (j + 1)).T for j in range(4 * k)]
        )
        found = bem.BoundaryProblem(bem.PoincareSteklov(blocks, 1.0), forces).solve().displacement
        errors[name] = float(np.linalg.norm(found - exact) / np.linalg.norm(exact))
    return errors


def rod_errors(blocks: bem.EnergeticBlocks) -> dict[str, float]:
    """Return the errors of the top of the rod under a step and under a sin² load.

    The step also gives the error of the force at the base and its maximum, which is exactly 2.
    """
    errors = {}
    mesh = blocks.mesh
    loads = {
        "step": (lambda t: 1.0, lambda t: np.maximum(t, 0.0)),
        "sin²": (smooth_load, smooth_integral),
    }
    for name, (load, integral) in loads.items():
        motion = rod(blocks, load).solve()
        exact = echoes(motion.times, integral)[:, None]
        top = motion.displacement[:, 1][:, mesh.nodes_of(mesh.labels == 2)]
        errors[name] = float(
            np.linalg.norm(top - exact) / np.linalg.norm(np.broadcast_to(exact, top.shape))
        )
        if name == "step":
            base = -motion.forces[:, 1][:, mesh.nodes_of(mesh.labels == 0)].sum(axis=1)
            middle = motion.times - 0.5 * blocks.dt
            exact_base = np.where((middle > 1.0) & ((middle - 1.0) % 4.0 < 2.0), 2.0, 0.0)
            errors["base"] = float(np.linalg.norm(base - exact_base) / np.linalg.norm(exact_base))
            errors["max base"] = float(base.max())
    return errors


def long_run(ratio: float, *, k: int = 5, end: float = 60.0) -> str:
    """Return the greatest displacement (exact: 1) and the work after the load, as a line.

    Both are those of the first and of the last ten time units.
    """
    dt = ratio / k
    blocks = bem.energetic_blocks(
        bem.polygon(SQUARE, 1.0 / k), MATERIAL, dt=dt, steps=round(end / dt)
    )
    motion = rod(blocks, smooth_load).solve()
    size = np.abs(motion.displacement[:, 1]).max(axis=1)
    early = (motion.times > 2.0) & (motion.times < 12.0)
    late = motion.times > end - 10.0
    return (
        f"{ratio:5.2f} {blocks.steps:5d}  {size[early].max():.4f} {size[late].max():.4f}  "
        f"{motion.work[early].max():.4f} {motion.work[late].max():.4f}"
    )


def thin(share: float, *, h: float = 0.1, end: float = 6.0) -> str:
    """Return the errors of the top of a rod of the width h/share by both methods, as a line."""
    half = 0.5 * h / share
    mesh = bem.polygon([(-half, -0.5), (half, -0.5), (half, 0.5), (-half, 0.5)], h)
    errors = []
    for dt in (h, 0.5 * h):
        blocks = bem.energetic_blocks(mesh, MATERIAL, dt=dt, steps=round(end / dt))
        errors.append(rod_errors(blocks)["sin²"])
    operator = convolution_operator(mesh, MATERIAL, dt=h, steps=round(end / h))
    motion = convolution_rod(operator, smooth_load).solve()
    exact = echoes(motion.times, smooth_integral)[:, None]
    top = motion.displacement[:, 1][:, mesh.nodes_of(mesh.labels == 2)]
    errors.append(
        float(np.linalg.norm(top - exact) / np.linalg.norm(np.broadcast_to(exact, top.shape)))
    )
    return " ".join(f"{value:9.3g}" for value in (1.0 / share, *errors))


def main() -> None:
    """Print the rows that the options ask for, each computed in its own process."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sides", type=int, nargs="*", default=[5, 10, 20])
    parser.add_argument("--steps", type=int, nargs="*", default=[60, 120, 240])
    parser.add_argument("--long", action="store_true")
    parser.add_argument("--thin", action="store_true")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--k", type=int, nargs="*", default=[40])
    parser.add_argument("--n", type=int, nargs="*")
    parser.add_argument("--cost", nargs=3, help=argparse.SUPPRESS)
    parser.add_argument("--one", type=int, nargs=3, help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.n and len(chosen.n) != len(chosen.k):
        parser.error(
            f"--n has {len(chosen.n)} numbers, --k {len(chosen.k)}; give one number of steps for "
            "each k"
        )
    if chosen.one:
        print(json.dumps(row(chosen.one[0], chosen.one[1], errors=bool(chosen.one[2]))))
        return
    if chosen.cost:
        print(json.dumps(cost(int(chosen.cost[0]), int(chosen.cost[1]), chosen.cost[2])))
        return
    if chosen.json:
        print(json.dumps(costs(chosen.k, chosen.n or [6 * k for k in chosen.k]), indent=1))
        return
    sizes = [(k, 6 * k, 1) for k in chosen.sides] + [(10, steps, 0) for steps in chosen.steps]
    print(*(f"{name:>9}" for name in COLUMNS + ERRORS))
    for size in sizes:
        command = [sys.executable, __file__, "--one", *map(str, size)]
        result = json.loads(
            subprocess.run(command, check=True, capture_output=True, text=True).stdout
        )
        print(
            *(
                f"{result[name]:9.4g}" if name in result else f"{'':>9}"
                for name in COLUMNS + ERRORS
            ),
            flush=True,
        )
    if chosen.long:
        print("\nc_P dt/h, steps, greatest displacement early and late, work early and late")
        for ratio in (0.1, 0.25, 1.0, 4.0):
            print(long_run(ratio), flush=True)
    if chosen.thin:
        print("\nwidth/h, error of the energetic method with c_P dt = h and h/2, of Radau IIA")
        for share in (1.0, 2.0, 5.0, 10.0, 20.0):
            print(thin(share), flush=True)


if __name__ == "__main__":
    main()
