"""Set what a run found beside what a formula expects: what all checks of ``engineering.checks`` have in common."""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from ...core.algebra import Array
from ...core.checks import between, check_word, number

History = Mapping[str, Array]  # column -> values (rows,)
Inputs = Mapping[str, tuple[float, str]]  # name -> (value, unit)
Numbers = tuple[float, float, str, Inputs]  # expected, found, why it does not apply, inputs taken from the run
LIMITS = {  # of fields that need not be above zero
    "nu": (0.0, 0.5), "phi": (0.0, 1.57), "delta": (0.0, 1.57), "slope": (-1.57, 1.57), "batter": (-1.57, 1.57),
    "surcharge": (0.0, math.inf), "kh": (0.0, 10.0), "kv": (-0.9, 0.9),
}


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


@dataclass(frozen=True, kw_only=True)
class Check(ABC):
    """Compare a run with a formula: base of all checks, frozen dataclasses with fields in SI units, angles in radians.

    units: of the fields that the formula takes; answers: what ``of`` may ask for -> unit; reads: columns, with fields.
    InputError for other answers, and numbers that are not above zero, or not as LIMITS say.
    """

    formula: ClassVar[str]
    source: ClassVar[str]
    units: ClassVar[Mapping[str, str]]
    answers: ClassVar[Mapping[str, str]]
    reads: ClassVar[tuple[str, ...]]
    of: str = ""

    def __post_init__(self) -> None:
        name = type(self).__name__
        check_word(f"{name}: of", self.of, tuple(self.answers))
        for key, (value, unit) in self.given().items():
            if key in LIMITS:
                angle = " radians, 30 degrees are 0.5236" if unit == "rad" else ""
                low, high = LIMITS[key]
                between(f"{name}: {key}", value, low, high, f"give one from {low:g} to {high:g}{angle}")
            else:
                number(name, key, value, positive=True, unit=unit)

    @abstractmethod
    def numbers(self, history: History) -> Numbers:
        """Return both numbers, why they cannot be compared, and the inputs of the run, which has the columns."""

    def given(self) -> Inputs:
        """Return the fields that the formula takes."""
        every = {name: (getattr(self, name), unit) for name, unit in self.units.items()}
        return {name: one for name, one in every.items() if one[0] is not None}

    def compare(self, history: History) -> Comparison:
        """Return the comparison for the history of a run: column -> values (rows,), as of a solution or run folder."""
        lacking = [name for one in self.reads if (name := one.format(**vars(self))) not in history]
        lack: Numbers = math.nan, math.nan, f"the run has no column {', '.join(lacking[:1])}: record it", {}
        expected, found, why, more = lack if lacking else self.numbers(history)
        return Comparison(type(self).__name__, self.formula, self.source, {**self.given(), **more},
                          math.nan if why else expected, found, self.answers[self.of], why)
