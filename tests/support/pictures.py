"""Whether a file is a picture with something in it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

PNG = b"\x89PNG"


def is_drawn(path: Path, share: float = 0.005) -> bool:
    """Whether a PNG is whole and at least this share of its pixels has another colour than the
    ground."""
    from matplotlib.image import imread

    assert path.read_bytes().startswith(PNG), path
    pixels = imread(path)
    inked = float(np.mean(np.any(np.abs(pixels - pixels[0, 0]) > 0.02, axis=-1)))
    assert inked > share, f"{path}: {inked:.4f} of the pixels are drawn"
    return True
