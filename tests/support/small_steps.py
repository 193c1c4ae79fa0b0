"""Make small frictional steps with random numbers."""

from __future__ import annotations

import numpy as np

from vi_contact.core.algebra import Array, Mask


def small(seed: int, m: int, d: int) -> tuple[Array, Array, Mask]:
    """(G, q, bilateral): strongly coupled, with rows of very different sizes and some held ones."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(m * d, m * d + 3))
    size = np.repeat(10.0 ** rng.uniform(-2.0, 2.0, m), d)
    G = size[:, None] * (root @ root.T / (m * d) + 0.1 * np.eye(m * d)) * size
    return G, size.reshape(m, d) * rng.normal(size=(m, d)), rng.random(m) < 0.2
