"""Check what schemes promise that keep nothing but displacement and velocity: restarts, and scaling
with the data."""

from __future__ import annotations

from typing import Any

import numpy as np
from bar import bar, run, thrown

from vi_contact.core.step import State
from vi_contact.laws.mass import ConsistentMass


def check_restart_from_bare_states(scheme: Any) -> None:
    """To the last bit, from a state stripped of reactions and contact set, in the middle of the
    contact."""
    problem = thrown(50, mass=ConsistentMass())
    whole = [report.new for report in run(problem, scheme, dt=1 / 150, steps=150)]
    half = whole[99]
    assert half.active[0] and not half.memory
    bare = State(half.t, half.k, half.u, half.v, np.zeros(1), np.zeros(1, dtype=bool))
    again = [report.new for report in run(problem, scheme, dt=1 / 150, steps=50, state=bare)]
    for one, two in zip(whole[100:], again, strict=True):
        assert np.array_equal(one.u, two.u) and np.array_equal(one.v, two.v) and one.r_n == two.r_n


def check_positive_homogeneity(scheme: Any) -> None:
    """A millionth of gap and velocity gives a millionth of everything: no absolute tolerance
    anywhere."""
    small: dict[str, Any] = {"gap": 5e-6, "v0": lambda x: np.full_like(x, -1e-5)}
    problems = (thrown(30, mass=ConsistentMass()), bar(30, **small, mass=ConsistentMass()))
    large, little = (list(run(problem, scheme, dt=1 / 90, steps=130)) for problem in problems)
    for one, two in zip(large, little, strict=True):
        np.testing.assert_allclose(1e6 * two.new.u, one.new.u, atol=1e-9 * 5.0)
        np.testing.assert_allclose(1e6 * two.new.r_n, one.new.r_n, atol=1e-9 * 300.0)
