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
from ..core.checks import check_count
from .boundary_mesh import BoundaryMesh
from .element_pairs import ElementPairs
from .tails import tail

NUMBERS = 4_000_000_000  # in the blocks of a body: 32 GB
MULTIPLE = 3  # steps, at whose multiples windows begin and end: more pairs have the same
AHEAD = 3  # times the steps asked for: how long blocks are kept
LONGEST = 20_000  # steps
ENTRIES = 36  # most entries that a pair of elements has in V, K and D of one step

# Yields V^j, K^j, D^j, step after step, of the pairs (p,) wanted at the time i dt.
BlockSteps = Callable[[Callable[[int], Mask]], Iterable[tuple[Array, Array, Array] | None]]


@dataclass(frozen=True)
class Stretch:
    """Hold entries of the same window, which change in the same steps.

    Attributes:
        first: first step in which they are not zero.
        smooth: first step of their tail.
        tail: (q,) steps of the tail that are kept.
        weights: (length of the tail, q) that give all steps of the tail from these.
        errors: (3,) bounds of the errors of entries of V, K and D (tails.py).
        places: (numbers,) places of the entries in the matrices of a step, one behind the other.
        values: (kept steps, numbers) entries in all steps from ``first`` to ``smooth``, then in
            the steps ``tail``.
    """

    first: int
    smooth: int
    tail: Indices
    weights: Array
    errors: Array
    places: Indices
    values: Array

    def record(self, j: int, numbers: Array) -> None:
        """Keep the entries of step j, given those of all matrices, if this step is kept."""
        if self.first <= j < self.smooth:
            self.values[j - self.first] = numbers[self.places]
        self.values[self.smooth - self.first :][self.tail == j] = numbers[self.places]


@dataclass(frozen=True, eq=False)
class CompressedBlocks:
    """Hold the blocks of density 1, as EnergeticBlocks does, compressed in time.

    Attributes:
        mesh: the boundary, of n elements.
        c_p: speed of pressure waves [m/s].
        c_s: speed of shear waves [m/s].
        dt: time step [s].
        steps: number of steps asked for.
        reach: number of steps kept.
        stretches: the entries, by their windows.
        places: (28 n²,) place of each entry of the matrices of a step, one behind the other, among
            the numbers of all stretches.
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
        """Return the bounds (3,) of what interpolation changes of entries of V, K and D.

        Rounding is not in them.
        """
        return np.asarray(np.max([part.errors for part in self.stretches], axis=0))

    def combine(self, weights: NDArray) -> Iterator[tuple[NDArray, NDArray, NDArray]]:
        """Yield complex sums of single, double and hyper over all steps, for each row of weights.

        The weights are (f, up to reach).
        """
        f = len(weights)
        n = len(self.mesh)
        weights = np.pad(weights, ((0, 0), (0, self.reach - weights.shape[1])))

        # The steps of a tail that are left out add their weights to those that are kept.
        numbers = np.empty((2 * f, sum(len(part.places) for part in self.stretches)))
        start = 0
        for part in self.stretches:
            of_window = weights[:, part.first : part.smooth]
            of_tail = weights[:, part.smooth :] @ part.weights
            of_kept = np.hstack([of_window, of_tail])
            end = start + len(part.places)
            real_and_imaginary = np.concatenate([of_kept.real, of_kept.imag])
            np.matmul(real_and_imaginary, part.values, numbers[:, start:end])
            start = end

        # One full matrix at a time: half of the memory.
        for real, imaginary in zip(*np.split(numbers, 2), strict=True):
            entries = (real + 1j * imaginary)[self.places]
            single, double, hyper = np.split(entries, [16 * n**2, 24 * n**2])
            yield single.reshape(4 * n, -1), double.reshape(4 * n, -1), hyper.reshape(2 * n, -1)

    @cached_property
    def _entries(self) -> tuple[Indices, Indices, Indices]:
        """Return number, row and column of all entries of [V 0 0; 0 K 0; 0 0 Kᵀ; 0 D 0].

        They are sorted by number, the place among the numbers of all stretches.
        """
        n = len(self.mesh)
        shapes = ((4, 4), (4, 2), (4, 2), (2, 2))  # of V, K, K (turned below) and D, over n
        corners = ((0, 0), (4, 4), (8, 6), (10, 4))  # first row and column, over n
        indices = [np.indices((a * n, b * n)).reshape(2, -1) for a, b in shapes]
        indices[2] = indices[2][::-1]
        for k, (row, column) in enumerate(corners):
            indices[k] = indices[k] + n * np.array([[row], [column]])
        rows, columns = np.hstack(indices)

        # The entries of K stand there twice.
        of_double = self.places[16 * n**2 : 24 * n**2]
        numbers = np.insert(self.places, np.full(8 * n**2, 24 * n**2), of_double)
        order = np.argsort(numbers, kind="stable")
        return numbers[order], rows[order], columns[order]

    def apply(self, p: Array, u: Array, jumps: Array) -> list[Array]:
        """Return sum_j V^j p_j, K^j u_j, K^jᵀ jumps_j, D^j u_j.

        Args:
            p: (steps, 4n), tractions, latest first.
            u: (steps, 2n), increments of displacement, latest first.
            jumps: (steps, 4n), jumps of the tractions, latest first.
        """
        n = len(self.mesh)
        histories = np.pad(np.hstack([p, u, jumps]), ((0, self.reach - len(p)), (0, 0)))
        numbers, rows, columns = self._entries
        total = np.zeros(12 * n)
        start = 0
        for part in self.stretches:
            # What the kept steps meet: those of the window as they are, those of the tail by their
            # weights.
            of_window = histories[part.first : part.smooth]
            of_tail = part.weights.T @ histories[part.smooth :]
            of_kept = np.vstack([of_window, of_tail])

            end = start + len(part.places)
            some = slice(*np.searchsorted(numbers, [start, end]))
            entries = part.values[:, numbers[some] - start]
            terms = np.einsum("ke,ke->e", entries, of_kept[:, columns[some]])
            total += np.bincount(rows[some], terms, 12 * n)
            start = end
        return np.split(total, [4 * n, 8 * n, 10 * n])


def compress_blocks(
    mesh: BoundaryMesh,
    pairs: ElementPairs,
    speeds: tuple[float, float],
    dt: float,
    steps: int,
    assemble: BlockSteps,
) -> CompressedBlocks:
    """Assemble the blocks and keep them compressed.

    Args:
        mesh: the boundary, of n elements.
        pairs: its p pairs of elements.
        speeds: (c_P, c_S) [m/s].
        dt: time step [s].
        steps: number of steps asked for.
        assemble: yields the blocks of all steps. It gets a function of i that returns the pairs
            (p,) to integrate at the time i dt; where there are none, it yields None.

    Raises:
        InputError: too many steps, or too many numbers for the memory.
    """
    check_count("boundary elements", f"a circle of {steps} steps", steps, "steps", most=LONGEST)
    reach = AHEAD * steps
    n = len(mesh)
    above, spans = _find_windows(mesh, pairs, speeds, dt, reach)
    windows, group = np.unique(spans, axis=1, return_inverse=True)
    group = np.ravel(group)
    h = float(mesh.lengths.max())
    tails = {int(end): tail(int(end), reach, dt, speeds, h) for end in np.unique(windows[1])}

    # How much will be kept is known before anything is allocated.
    tail_lengths = np.array([len(tails[int(end)][0]) for end in windows[1]])
    kept_steps = windows[1] - windows[0] + tail_lengths
    total = ENTRIES * (np.bincount(group) * kept_steps).sum()
    check_count(
        "boundary elements", f"{steps} steps of {n} elements", total, "numbers", most=NUMBERS
    )

    matrices = _number_entries(n)
    stretches = []
    pairs_of_nodes = []
    for number, (begin, end) in enumerate(windows.T):
        a, b = above[:, group == number]
        kept_tail, weights, errors = tails[int(end)]
        places = _find_places(matrices, a, b)
        steps_of_window = np.append(np.arange(begin, end), kept_tail)
        values = np.empty((len(steps_of_window), len(places)))
        stretches.append(Stretch(int(begin), int(end), kept_tail, weights, errors, places, values))

        # A block of step j is a difference of operators at the times j - 1, j and j + 1.
        times = np.add.outer(steps_of_window, (-1, 0, 1))
        pairs_of_nodes.append((a, b, np.isin(np.arange(-1, reach + 1), times)))

    def among(i: int) -> Mask:
        """Return the pairs of elements (p,) that blocks to keep need at the time i dt."""
        is_needed = np.zeros((n, n), bool)
        for a, b, needed in pairs_of_nodes:
            is_needed[a, b] = needed[i + 1]
        # An entry at a node comes from the element that starts there and the one before.
        is_needed |= is_needed[mesh.after]
        is_needed |= is_needed[:, mesh.after]
        return is_needed[pairs.first, pairs.second] | is_needed[pairs.second, pairs.first]

    for j, blocks in enumerate(assemble(among)):
        if blocks is None:
            continue
        numbers = np.concatenate([block.ravel() for block in blocks])
        for part in stretches:
            part.record(j, numbers)
    order = np.concatenate([part.places for part in stretches])
    places = _locate_entries(matrices, order)
    return CompressedBlocks(mesh, *speeds, dt, steps, reach, tuple(stretches), places)


def _find_windows(
    mesh: BoundaryMesh,
    pairs: ElementPairs,
    speeds: tuple[float, float],
    dt: float,
    reach: int,
) -> tuple[Indices, Indices]:
    """Return the pairs of nodes a <= b (2, p), and the steps (2, p) where their windows are.

    A window begins before the first wave arrives, and ends when its points of quadrature rest.

    Args:
        mesh: the boundary, of n elements.
        pairs: its pairs of elements.
        speeds: (c_P, c_S) [m/s].
        dt: time step [s].
        reach: number of steps that are kept.
    """
    n = len(mesh)
    h = float(mesh.lengths.max())

    # Distances of pairs of elements, the least ones with a minus so that both become maxima; then
    # of pairs of nodes, to which the element before each node belongs too.
    farthest = np.empty((2, n, n))
    distances = (-pairs.r_min, pairs.r_max)
    farthest[:, pairs.first, pairs.second] = distances
    farthest[:, pairs.second, pairs.first] = distances
    before = np.argsort(mesh.after)
    for axis in (1, 2):
        farthest = np.maximum(farthest, np.take(farthest, before, axis))

    first = (-farthest[0] / (speeds[0] * dt)).astype(int)
    # It ends half a step late or more, so that rounding does not matter.
    smooth = ((farthest[1] + h) / (speeds[1] * dt) + 2.5).astype(int)
    spans = np.minimum([first - first % MULTIPLE, smooth + -smooth % MULTIPLE], reach)
    above = np.stack(np.triu_indices(n))
    return above, spans[:, above[0], above[1]]


def _number_entries(n: int) -> tuple[Indices, Indices, Indices]:
    """Return the places of all entries of V, K and D (4n, 4n), (4n, 2n), (2n, 2n) of a step."""
    single, double, hyper = np.split(np.arange(28 * n**2), [16 * n**2, 24 * n**2])
    return single.reshape(4 * n, 4 * n), double.reshape(4 * n, 2 * n), hyper.reshape(2 * n, 2 * n)


def _find_places(matrices: tuple[Indices, Indices, Indices], a: Indices, b: Indices) -> Indices:
    """Return the places of the entries of pairs of nodes, half of those of symmetric matrices.

    Args:
        matrices: places of all entries (``_number_entries``).
        a: numbers of the first nodes.
        b: numbers of the second nodes.
    """
    single, double, hyper = matrices
    n = len(hyper) // 2
    single = single.reshape(2, n, 2, 2, n, 2)
    double = double.reshape(2, n, 2, 2, n)
    hyper = hyper.reshape(2, n, 2, n)
    parts = (single[:, a, :, :, b], double[:, a, :, :, b], double[:, b, :, :, a], hyper[:, a, :, b])
    return np.concatenate([part.ravel() for part in parts])


def _locate_entries(matrices: tuple[Indices, Indices, Indices], order: Indices) -> Indices:
    """Return where every entry of the matrices of a step stands among the kept numbers.

    ``order`` has the places of the kept numbers. Of two mirrored entries one is kept, and both get
    its number.
    """
    single, double, hyper = matrices
    mirrored = np.concatenate([single.T.ravel(), double.ravel(), hyper.T.ravel()])
    places = np.empty_like(mirrored)
    numbers = np.arange(len(order))
    places[mirrored[order]] = numbers
    places[order] = numbers
    return places
