"""Interfere with a run at one of its steps, as a recorder."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NoReturn

from vi_contact.core.problem import ContactProblem
from vi_contact.core.step import Report, State


class AtStep:
    """A recorder of ones that does something when it records step k; never for k = -1."""

    def __init__(self, k: int, action: Callable[[], Any]) -> None:
        self._k, self._action = k, action

    def columns(self) -> dict[str, tuple[str, str]]:
        return {"one": ("-", "always one")}

    def start(self, problem: ContactProblem, state: State, resumed: Any = None) -> dict[str, float]:
        return {"one": 1.0}

    def row(self, report: Report) -> dict[str, float]:
        if report.new.k == self._k:
            self._action()
        return {"one": 1.0}


def failing(error: BaseException | type[BaseException]) -> Callable[[], NoReturn]:
    """Return what raises an error: the user's Ctrl-C, or a defect in the user's own recorder."""

    def fail() -> NoReturn:
        raise error

    return fail
