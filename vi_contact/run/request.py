"""Hold and check what is asked of one run, before anything is computed or overwritten.

Three checks stand one after another: here, of arguments by themselves (kinds, numbers, and what
needs an output folder); in ``method.choose_method``, of the problem with its scheme and solver; in
``simulate.open_run``, of the folder and of what a checkpoint in it is of. The checks of
``core.checks`` take (whose argument it is, its name, its value, …), and raise one sentence.
"""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from ..core.algebra import Comm
from ..core.arguments import check_type
from ..core.checks import flag, function, optional, provides, several, whole
from ..core.collective import Parts, agree
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..core.state_checks import check_problem_given
from ..core.step import Recorder, Report, Scheme, Solver, State
from .files.writer import FieldWriter
from .time_steps import TimeSteps

OWNER = "simulate"  # whose arguments the sentences of errors speak of
RECORDER = ("columns", "start", "row")  # methods that a recorder has: ``core.step.Recorder``


class CrossCheck(Protocol):
    """Report how far other routes to the same steps were off: ``cross_check.CrossChecked``."""

    def report(self) -> Mapping[str, Mapping[str, float]]:
        """Return method -> quantity -> difference relative to the largest value."""


@dataclass(frozen=True)
class RunRequest:
    """Hold the arguments of ``simulate``, as they were given; its docstring explains each.

    The fields have no defaults: these stand in the signature of ``simulate`` alone, which names
    every field in one call.
    """

    problem: ContactProblem
    scheme: Scheme | None
    solver: Solver | None
    dt: TimeSteps
    t_end: float | None
    steps: int | None
    record: Sequence[Recorder] | None
    out: str | Path | None
    state: State | None
    escalation: Sequence[Solver]
    tolerance: float
    checkpoint_every: int
    restart: bool | str | Path
    changed: bool
    progress: bool
    fields: FieldWriter | None
    cross_check: CrossCheck | None
    wall_time: str | None
    callback: Callable[[State, Report], Any] | None

    @property
    def comm(self) -> Comm:
        """Return the communicator of the ranks that share the run."""
        return self.problem.system.algebra.comm

    def check(self) -> None:
        """Raise InputError for arguments that are wrong by themselves, or differ between ranks.

        What depends on the problem is looked at by ``method.choose_method``. Collective.
        """
        check_problem_given(OWNER, self.problem)

        # First that all ranks were given the same: what follows then fails on all of them alike.
        agree(self.comm, OWNER, self._values_to_compare())
        self._check_outputs()
        self._check_fields_and_cross_check()
        remedy = "give a function of a state and a report, or None"
        optional(function, OWNER, "callback", self.callback, remedy)

        # Arguments that make no sense without another one.
        if self.wall_time is not None and self.out is None:
            raise InputError("wall_time needs a folder from which the run continues: give out")
        if self.changed and self.restart is False:
            raise InputError(
                "changed=True is for a run that is continued, and this one begins anew: give "
                "restart too, or leave it out"
            )

    def _values_to_compare(self) -> dict[str, Any]:
        """Return what has to be the same on all ranks: name -> value.

        The problem is left out, of which every rank has its part, and progress, which rank 0 alone
        shows. ``Parts`` leaves out the arrays of a state, of which every rank has its part too.
        """
        values = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        del values["problem"]
        del values["progress"]
        values["record"] = _describe_recorders(self.record)
        values["out"] = None if self.out is None else str(self.out)  # a path or its text
        values["state"] = Parts(self.state)
        return values

    def _check_outputs(self) -> None:
        """Raise InputError for what is no recorder, folder, number of steps or truth value."""
        recorders: Sequence[Recorder] = ()
        if self.record is not None:
            remedy = "give a list of recorders, or None"
            recorders = several(OWNER, "record", self.record, remedy)
        for recorder in recorders:
            remedy = "give Energy(), Contact(), Probe(…) or another"
            provides(OWNER, "a recorder", recorder, RECORDER, remedy)
        check_type(OWNER, "out", self.out, str | Path | None)
        check_type(OWNER, "restart", self.restart, bool | str | Path)
        whole(OWNER, "checkpoint_every", self.checkpoint_every, least=1)
        flag(OWNER, "progress", self.progress)
        flag(OWNER, "changed", self.changed)

    def _check_fields_and_cross_check(self) -> None:
        """Raise InputError for fields that cannot be written, and for what is no cross-check."""
        if self.fields is not None:
            if self.out is None:
                raise InputError("fields need an output folder: give out, or leave out fields")
            provides(OWNER, "fields", self.fields, ("open",), "give fem.XDMF(every=10), or None")
        if self.cross_check is not None:
            remedy = "give a CrossChecked solver, or None"
            provides(OWNER, "cross_check", self.cross_check, ("report",), remedy)


def _describe_recorders(record: Any) -> Any:
    """Return what of the recorders is compared over ranks.

    This is their kinds, and the settings of those of the package: each rank may hold its part of
    what is recorded. Of a recorder of the user's nobody knows which attributes are settings. What
    is no list of recorders is compared as it is, and refused later.
    """
    if not isinstance(record, list | tuple):
        return record
    descriptions: list[Any] = []
    for recorder in record:
        kind = type(recorder)
        is_own = kind.__module__.startswith("vi_contact.")
        descriptions.append(Parts(recorder) if is_own else kind)
    return descriptions
