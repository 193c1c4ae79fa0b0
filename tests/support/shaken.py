"""A chain that a base motion throws against its wall again and again."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from chain import chain_problem

from vi_contact.core.problem import ContactProblem
from vi_contact.core.step import Report
from vi_contact.laws.excitation import Harmonic

SHAKE = Harmonic(-30.0, 3.0, phase=0.3, direction=(1.0,))


def shaken(impact: Any = None, **system: Any) -> ContactProblem:
    """Six masses that hit the wall many times in 200 steps of 5 ms."""
    settings = {
        "gap": 0.01,
        "stiffness": 2e4,
        "consistent": True,
        "damping": 1e-4,
        "excitation": SHAKE,
    }
    return chain_problem(6, impact=impact, **(settings | system))


def changes(reports: Iterable[Report]) -> int:
    """How often the contact opened or closed."""
    return sum(bool(np.any(report.new.active != report.old.active)) for report in reports)
