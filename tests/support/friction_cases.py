"""Steps with friction on the blocks of ``volume_cases`` and on random bodies in space, for routes
to agree on."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from volume_cases import Case, case, pushed_block

from vi_contact.core.algebra import Array
from vi_contact.core.step import StepResult
from vi_contact.core.verify import kkt_residual
from vi_contact.laws.friction import Coulomb, ExponentialDecay, SlipRateCoulomb, Tresca

M = 8  # contact points of pushed_block
LAWS = [
    Coulomb(0.2),
    Coulomb(tuple(np.linspace(0.0, 1.0, M))),
    Tresca(0.1),
    Tresca(tuple(np.linspace(0.0, 0.2, M))),
    SlipRateCoulomb(ExponentialDecay(0.5, 0.3, 2.0)),
]
OPTIONS: dict[str, dict[str, Any]] = {
    "rigid": {},
    "bilateral": {"bilateral": np.arange(M) % 3 == 0},
    "springs and rigid points": {"compliance": np.array([0.3, 0.0] * 4), "scale": 2.0},
}


def rubbing(c: Case, law: Any, slip0: Any, tangents: int = 1) -> Case:
    """The case with friction along the unknowns that follow each normal one."""
    step = c.step
    places = step.surface.owned[:, None] + np.arange(1, 1 + tangents)
    surface = replace(step.surface, tangents=places)
    slip0 = np.broadcast_to(np.asarray(slip0, dtype=float), (surface.total, tangents))[
        surface.slots
    ]
    law = replace(law, **{name: mine(value, surface) for name, value in vars(law).items()})
    return replace(c, step=replace(step, surface=surface, friction=law, slip0=slip0))


def mine(value: Any, surface: Any) -> Any:
    """Of coefficients of all points those of this rank."""
    return tuple(np.array(value)[surface.slots]) if isinstance(value, tuple) else value


def random_case(
    law: Any, *, seed: int = 2, parallel: bool = False, length: float = 1.0, **options: Any
) -> Case:
    """pushed_block with friction, from points that have slid before."""
    before = 0.1 * length * np.random.default_rng(seed).normal(size=(M, 1))
    c = rubbing(pushed_block(seed=seed, parallel=parallel, length=length, **options), law, before)
    return replace(c, step=replace(c.step, rate_factor=1.0))


def spatial(
    law: Any, seed: int, *, parallel: bool = False, m: int = 6, alone: float = 1.0
) -> tuple[Case, Array]:
    """m points of three unknowns each on a random elastic body; the less they stand ``alone``, the
    more they couple."""
    rng = np.random.default_rng(seed)
    n = 3 * m
    root = rng.normal(size=(n, n))
    matrix = sp.csr_matrix(root @ root.T / n + alone * np.diag(rng.uniform(0.5, 2.0, n)))
    b = rng.normal(size=n)
    b[::3] += 0.3
    c = case(matrix, np.arange(0, n, 3), b, 0.1 * rng.random(m), parallel=parallel, of_node=3)
    return rubbing(c, law, 0.1 * rng.normal(size=(m, 2)), tangents=2), b


def agree(c: Case, one: StepResult, other: StepResult) -> None:
    """x, r_n and r_t to 1e-9 of their largest values; contact sets; certificates."""
    found, wanted = c.whole(one), c.whole(other)
    for a, b in ((found.x, wanted.x), (found.r_n, wanted.r_n), (found.r_t, wanted.r_t)):
        assert np.max(np.abs(a - b)) <= 1e-9 * np.max(np.abs(b))
    assert np.array_equal(found.active, wanted.active)
    assert max(kkt_residual(c.step, one).worst, kkt_residual(c.step, other).worst) <= 1e-9


def states(c: Case, result: StepResult) -> tuple[int, int, int]:
    """Numbers of open, sticking and slipping points."""
    slip = np.linalg.norm(c.step.surface.tangential_values(result.x) - c.step.slip0, axis=1)
    slips = result.active & (slip > 0.0)
    found = (~result.active).sum(), (result.active & ~slips).sum(), slips.sum()
    return tuple(int(count) for count in c.step.surface.comm.sum(np.array(found)))
