"""Two blocks whose meshes do not match, turned in space, with moved nodes and bent faces."""

from __future__ import annotations

from typing import Any

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.two_blocks import TwoBlocks

LENGTHS = (1.5, 1.0, 1.2)


def rotation(number: int) -> Array:
    """A rotation in space, none for 0."""
    q = np.linalg.qr(np.random.default_rng(number).standard_normal((3, 3)))[0]
    return np.eye(3) if number == 0 else q * np.linalg.det(q)


def placed(number: int, distorted: float = 0.0, bent: float = 0.0) -> Any:
    """Turn points, whose x and z, and y where they are to be bent, are moved before."""

    def deform(x: Array) -> Array:
        a, b = np.pi * x[:, 0] / LENGTHS[0], np.pi * x[:, 2] / LENGTHS[2]
        shift = distorted * np.column_stack(
            [np.sin(2 * a) * np.cos(b), 0.0 * a, np.cos(a) * np.sin(2 * b)]
        )
        moved = x + shift
        # nodes of both sides on one face
        moved[:, 1] += bent * ((moved[:, 0] - 0.9) ** 2 + moved[:, 0] * moved[:, 2])
        return np.asarray(moved @ rotation(number).T)

    return deform


def unlike(
    *,
    turn: int = 0,
    simplices: bool = False,
    distorted: tuple[float, float] = (0.0, 0.0),
    upper: tuple[float, float, float] = LENGTHS,
    divisions: Any = ((3, 2, 2), (2, 2, 3)),
    bent: float = 0.0,
    **data: Any,
) -> TwoBlocks:
    """Blocks on top of one another with meshes of their own, turned in space."""
    one, two = (
        BlockMesh(lengths=lengths, divisions=n, simplices=simplices, deform=placed(turn, d, bent))
        for lengths, n, d in zip((upper, LENGTHS), divisions, distorted, strict=True)
    )
    return TwoBlocks(upper=one, lower=two, **data)
