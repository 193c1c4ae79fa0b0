"""Keep the blocks of the energetic method in little memory.

Nothing is kept ahead of waves, and few steps behind the last one.

Element i starts at node i; entries at nodes come from the element before as well. With r_min and
r_max the least and greatest distance between the elements of an entry, and h the longest, the
blocks of step j (times t_(j-1) to t_(j+1))

    vanish while c_P t_(j+1) <= r_min,    are smooth in time once c_S t_(j-1) >= r_max + h,

for then the points of the integrals stay where they are (quadrature.py). All steps between are
integrated and kept, and of the tail those from which the others are interpolated (tails.py); of
symmetric matrices, one half. Blocks are kept AHEAD times as long as asked for: the circle of
frequencies needs them (frequency_circle.py).
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..core.algebra import Array, Indices, Mask
from ..core.checks import counted
from .boundary_mesh import BoundaryMesh
from .element_pairs import ElementPairs
from .tails import tail

NUMBERS = 4_000_000_000  # in the blocks of a body: 32 GB
MULTIPLE = 3  # steps, at whose multiples windows begin and end: more pairs have the same
AHEAD = 3  # times the steps asked for: how long blocks are kept
LONGEST = 20_000  # steps
BlockSteps = Callable[[Callable[[int], Mask]], Iterable[tuple[Array, Array, Array] | None]]


@dataclass(frozen=True)
class Stretch:
    """Hold entries of the same window.

    They are their places (numbers,) in the matrices of a step, one behind the other, and values
    (kept steps, numbers): all steps from `first` to `smooth`, then the steps `tail`, with weights
    that give all steps behind `smooth` and bounds of errors (tails.py).
    """

    first: int
    smooth: int
    tail: Indices
    weights: Array
    errors: Array
    places: Indices
    values: Array


@dataclass(frozen=True, eq=False)
class CompressedBlocks:
    """Hold the blocks of density 1, as EnergeticBlocks does, compressed in time.

    places: (28 n²,) of each entry of the matrices of a step, one behind the other, among the
    numbers of all stretches; steps: asked for; reach: kept.
    """

    mesh: BoundaryMesh
    c_p: float
    c_s: float
    dt: float
    steps: int
    reach: int
    stretches: tuple[Stretch, ...]
    places: Indices

    @property
    def errors(self) -> Array:
        """Return (3,) bounds of what interpolation, not rounding, changes.

        The entries are those of single, double and hyper.
        """
        return np.asarray(np.max([part.errors for part in self.stretches], axis=0))

    def combined(self, weights: NDArray) -> Iterator[tuple[NDArray, NDArray, NDArray]]:
        """Yield complex sums of single, double and hyper over all steps.

        There is one for each of the weights (f, up to reach).
        """
        f, n, start = len(weights), len(self.mesh), 0
        weights = np.pad(weights, ((0, 0), (0, self.reach - weights.shape[1])))
        numbers = np.empty((2 * f, sum(len(part.places) for part in self.stretches)))
        for part in self.stretches:
            kept = np.hstack(
                [weights[:, part.first : part.smooth], weights[:, part.smooth :] @ part.weights]
            )
            np.matmul(
                np.concatenate([kept.real, kept.imag]),
                part.values,
                numbers[:, start : start + len(part.places)],
            )
            start += len(part.places)
        # one full matrix at a time: half of the memory
        for real, imag in zip(*np.split(numbers, 2), strict=True):
            single, double, hyper = np.split(
                (real + 1j * imag)[self.places], [16 * n**2, 24 * n**2]
            )
            yield single.reshape(4 * n, -1), double.reshape(4 * n, -1), hyper.reshape(2 * n, -1)

    @cached_property
    def _entries(self) -> tuple[Indices, Indices, Indices]:
        """Return number, row and column of all entries of [V 0 0; 0 K 0; 0 0 Kᵀ; 0 D 0].

        They are sorted by number.
        """
        n = len(self.mesh)
        shapes, at = ((4, 4), (4, 2), (4, 2), (2, 2)), ((0, 0), (4, 4), (8, 6), (10, 4))
        indices = [np.indices((a * n, b * n)).reshape(2, -1) for a, b in shapes]
        indices[2] = indices[2][::-1]
        rows, columns = np.hstack(
            [part + n * np.array([start]).T for part, start in zip(indices, at, strict=True)]
        )
        numbers = np.insert(
            self.places, np.full(8 * n**2, 24 * n**2), self.places[16 * n**2 : 24 * n**2]
        )
        order = np.argsort(numbers, kind="stable")
        return numbers[order], rows[order], columns[order]

    def applied(self, p: Array, u: Array, jumps: Array) -> list[Array]:
        """Return sum_j V^j p_j, K^j u_j, K^jᵀ jumps_j, D^j u_j.

        The histories are (steps, 4n or 2n), latest first.
        """
        values, start, n = (
            np.pad(np.hstack([p, u, jumps]), ((0, self.reach - len(p)), (0, 0))),
            0,
            len(self.mesh),
        )
        (numbers, rows, columns), total = self._entries, np.zeros(12 * n)
        for part in self.stretches:
            kept = np.vstack(
                [values[part.first : part.smooth], part.weights.T @ values[part.smooth :]]
            )
            some = slice(*np.searchsorted(numbers, [start, start + len(part.places)]))
            terms = np.einsum(
                "ke,ke->e", part.values[:, numbers[some] - start], kept[:, columns[some]]
            )
            total += np.bincount(rows[some], terms, 12 * n)
            start += len(part.places)
        return np.split(total, [4 * n, 8 * n, 10 * n])


def compressed_blocks(
    mesh: BoundaryMesh,
    pairs: ElementPairs,
    speeds: tuple[float, float],
    dt: float,
    steps: int,
    assembled: BlockSteps,
) -> CompressedBlocks:
    """Keep the blocks for `steps` steps.

    ``speeds`` are (c_P, c_S) [m/s]; ``assembled`` gives the blocks of all steps from a function of
    i that returns the pairs (p,) of elements to integrate at time i dt, or None where it has none.
    """
    counted("boundary elements", f"a circle of {steps} steps", steps, "steps", most=LONGEST)
    asked, steps = steps, AHEAD * steps
    n, h, stretches, needed = len(mesh), float(mesh.lengths.max()), [], []
    entries = np.arange(28 * n**2)
    single, double, hyper = np.split(entries, [16 * n**2, 24 * n**2])
    mirrored = np.concatenate(
        [single.reshape(4 * n, -1).T.ravel(), double, hyper.reshape(2 * n, -1).T.ravel()]
    )
    single, double, hyper = (
        single.reshape(2, n, 2, 2, n, 2),
        double.reshape(2, n, 2, 2, n),
        hyper.reshape(2, n, 2, n),
    )
    full = np.empty((2, n, n))  # minus the least distance, the greatest
    full[:, pairs.first, pairs.second] = full[:, pairs.second, pairs.first] = (
        -pairs.r_min,
        pairs.r_max,
    )
    for axis in (1, 2):
        full = np.maximum(full, np.take(full, np.argsort(mesh.after), axis))
    first = (-full[0] / (speeds[0] * dt)).astype(int)
    # half a step late or more: rounding does not matter
    smooth = ((full[1] + h) / (speeds[1] * dt) + 2.5).astype(int)
    spans = np.minimum([first - first % MULTIPLE, smooth + -smooth % MULTIPLE], steps)
    above = np.stack(np.triu_indices(n))
    windows, group = np.unique(spans[:, above[0], above[1]], axis=1, return_inverse=True)
    tails = {int(end): tail(int(end), steps, dt, speeds, h) for end in np.unique(windows[1])}
    kept = windows[1] - windows[0] + np.array([len(tails[int(end)][0]) for end in windows[1]])
    total = 36 * (np.bincount(np.ravel(group)) * kept).sum()  # nothing is allocated yet
    counted("boundary elements", f"{asked} steps of {n} elements", total, "numbers", most=NUMBERS)
    for number, (begin, end) in enumerate(windows.T):
        (a, b), behind = above[:, np.ravel(group) == number], tails[int(end)]
        parts = (
            single[:, a, :, :, b],
            double[:, a, :, :, b],
            double[:, b, :, :, a],
            hyper[:, a, :, b],
        )
        places = np.concatenate([part.ravel() for part in parts])
        kept = np.append(np.arange(begin, end), behind[0])
        stretches.append(
            Stretch(int(begin), int(end), *behind, places, np.empty((len(kept), len(places))))
        )
        needed.append((a, b, np.isin(np.arange(-1, steps + 1), np.add.outer(kept, (-1, 0, 1)))))

    def among(i: int) -> Mask:
        wanted = np.zeros((n, n), bool)
        for a, b, times in needed:
            wanted[a, b] = times[i + 1]
        wanted |= wanted[mesh.after]
        wanted |= wanted[:, mesh.after]
        return wanted[pairs.first, pairs.second] | wanted[pairs.second, pairs.first]

    for j, blocks in enumerate(assembled(among)):
        if blocks is None:
            continue
        numbers = np.concatenate([block.ravel() for block in blocks])
        for part in stretches:
            if part.first <= j < part.smooth:
                part.values[j - part.first] = numbers[part.places]
            part.values[part.smooth - part.first :][part.tail == j] = numbers[part.places]
    places, order = np.empty_like(entries), np.concatenate([part.places for part in stretches])
    places[mirrored[order]] = places[order] = np.arange(len(order))
    return CompressedBlocks(mesh, *speeds, dt, asked, steps, tuple(stretches), places)
