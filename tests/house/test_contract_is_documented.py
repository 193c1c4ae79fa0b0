"""The contract is the best-documented page: every method of its protocols says what it gets and
gives."""

from __future__ import annotations

import inspect
import re
from typing import Any

import pytest

from vi_contact import core
from vi_contact.core import step

pytestmark = pytest.mark.serial
PROTOCOLS = (
    core.Scheme,
    core.Solver,
    step.PreparedSolver,
    core.Recorder,
    core.FrictionLaw,
    core.ImpactLaw,
    core.MassLaw,
    core.Excitation,
    core.Obstacle,
    core.Companion,
)
METHODS = [
    pytest.param(method, id=f"{protocol.__name__}.{name}")
    for protocol in PROTOCOLS
    for name, method in vars(protocol).items()
    if callable(getattr(method, "fget", method))
    and not inspect.isclass(method)
    and (name == "__call__" or not name.startswith("_"))
]
GIVEN = {"self"}


def unnamed(method: Any) -> list[str]:
    """Arguments that the docstring does not name, or all of them when there is none."""
    function = getattr(method, "fget", method)
    told = inspect.getdoc(function) or ""
    return [
        name
        for name in inspect.signature(function).parameters
        if name not in GIVEN and not re.search(rf"\b{name}\b", told)
    ]


@pytest.mark.parametrize("method", METHODS)
def test_every_method_names_its_arguments(method: Any) -> None:
    function = getattr(method, "fget", method)
    told = inspect.getdoc(function)
    assert told and re.match(r"(Return|Raise|Take) ", told), (
        f"{function.__qualname__}: what does it give?"
    )
    assert not unnamed(method), (
        f"{function.__qualname__} does not name {', '.join(unnamed(method))}"
    )


def test_all_methods_are_asked_and_a_silent_one_is_found() -> None:
    def silent(self: object, dt: float) -> None:
        """Return nothing."""

    assert len(METHODS) == 27
    assert unnamed(silent) == ["dt"]
