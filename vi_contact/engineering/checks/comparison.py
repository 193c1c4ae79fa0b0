"""Set what a run found beside what a formula expects: what all checks of ``engineering.checks`` have in common."""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from ...core.algebra import Array

History = Mapping[str, Array]  # column -> values (rows,)
Inputs = Mapping[str, tuple[float, str]]  # name -> (value, unit)


@dataclass(frozen=True)
class Comparison:
    """Hold a number of a run beside that of a formula, both in ``unit``.

    name, formula, source: of the check; inputs: name -> (value, unit) of what went into the formula; applies: empty, or
    the sentence that says why the formula does not apply: then ``expected`` is nan. found: nan without its columns.
    """

    name: str
    formula: str
    source: str
    inputs: Inputs
    expected: float
    found: float
    unit: str
    applies: str = ""

    @property
    def ratio(self) -> float:
        """Return found/expected; nan where the formula does not apply or expects nothing."""
        return self.found / self.expected if self.expected else math.nan


@dataclass(frozen=True)
class Numbers:
    """Hold what a check makes of a run; ``why``: it does not apply; ``inputs``: those that it took from the run."""

    expected: float = math.nan
    found: float = math.nan
    why: str = ""
    inputs: Inputs = field(default_factory=dict)


class Check(ABC):
    """Compare a run with a formula: base of all checks, frozen dataclasses with fields in SI units, angles in radians.

    ``units``: name -> unit of the fields that the formula takes; unit, columns: of the answer, and those it reads.
    """

    formula: ClassVar[str]
    source: ClassVar[str]
    units: ClassVar[Mapping[str, str]]
    unit: ClassVar[str]
    columns: ClassVar[tuple[str, ...]]

    @abstractmethod
    def numbers(self, history: History) -> Numbers:
        """Return both numbers, for a history that has the columns."""

    def compare(self, history: History) -> Comparison:
        """Return the comparison for the history of a run: column -> values (rows,), as of a solution or run folder."""
        lacking = [name for name in self.columns if name not in history]
        found = Numbers(why=f"the run has no column {lacking[0]}: record it") if lacking else self.numbers(history)
        fields = {name: (getattr(self, name), unit) for name, unit in self.units.items()}
        inputs = {name: one for name, one in fields.items() if one[0] is not None} | dict(found.inputs)
        return Comparison(type(self).__name__, self.formula, self.source, inputs,
                          math.nan if found.why else found.expected, found.found, self.unit, found.why)
