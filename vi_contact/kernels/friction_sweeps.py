"""Sweep over a small problem with friction by projected Gauss-Seidel, compiled.

The problem has m nodes of d unknowns each, r = (r_n, r_t) and w = q + G r: for every node

    0 <= r_n  ⊥  w_n >= 0 (bilateral: w_n = 0),    |r_t| <= cohesion + slope max(r_n, 0)

and r_t opposes the slip w_t. Here r are reactions [N] (or ``scale`` times newtons), w gaps and
slips, and G the flexibility between the two. ``solvers.friction.nsgs`` sweeps the same way in
numpy, node by node and in double precision.
"""

from ctypes import c_double
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.algebra import Array, Mask
from .compiler import locate_arrays

Short = NDArray[np.float32]


class FrictionSweeps:
    """Hold r and w of one problem, which sweeps change in place.

    Attributes:
        r: reactions (m, d).
        w: q + G r (m, d), as far as sums in single precision can tell.
    """

    def __init__(
        self,
        loops: Any,
        G: Short,
        H: Short | None,
        blocks: Short | None,
        cohesion: Array,
        slope: Array,
        bilateral: Mask,
        r: Array,
        w: Array,
    ) -> None:
        """Copy r and w, and note where all arrays lie.

        Args:
            loops: the compiled functions (``compiler.load_loops``).
            G: the matrix (m d, m d).
            H: its inverse, with which every second sweep goes faster; None where there is none.
            blocks: the inverses (m, d, d) of the blocks of H on its diagonal; None with H.
            cohesion: (m,), the limit of |r_t| without pressure.
            slope: (m,), by how much the limit grows with r_n.
            bilateral: (m,), which r_n may pull.
            r: reactions (m, d) to start from.
            w: q + G r (m, d).
        """
        self.r = np.array(r, order="C")
        self.w = np.array(w, order="C")
        self._loops = loops
        self._shape = r.shape

        # Room of the C function: changes that are summed in single precision (m d), and behind them
        # the states of the nodes now and before (2 m bytes, which are fewer than m numbers).
        room = np.empty(r.size + len(r), dtype=np.float32)

        # The arrays are held here, for as long as their addresses are used.
        self._read: list[NDArray[Any] | None] = [G, H, blocks, cohesion, slope, bilateral]
        self._written: list[NDArray[Any]] = [self.r, self.w, room]

    def sweep(self, count: int, least: float) -> None:
        """Make up to this many sweeps over all nodes; r and w change in place.

        Args:
            count: number of sweeps.
            least: change of r, in its unit, below which they end; with H they end when no node
                goes from open, stick or slip to another of these.
        """
        m, d = self._shape
        read = locate_arrays(*self._read)
        written = locate_arrays(*self._written)
        self._loops.relax(m, d, *read, count, c_double(least), *written)
