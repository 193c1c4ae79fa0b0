"""Set what a run found beside what a formula expects.

This is what all checks of ``engineering.checks`` have in common.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, ClassVar, Self

import numpy as np

from ....core.algebra import Array
from ....core.arguments import check_fields
from ....core.checks import check_word
from ....core.quantities import RATIO, Between, Positive, Unit, read_quantities
from ..peak_values import NEARLY, find_stretch
from .model_facts import ModelFacts

History = Mapping[str, Array]  # column -> values (rows,)
Inputs = Mapping[str, tuple[float, str]]  # name -> (value, unit)
NO_JUDGEMENT = "the ratio is found over expected, and no judgement"
_RADIANS = "radians; 30 degrees are 0.5236"
Length = Annotated[float, Positive, Unit("m")]
Density = Annotated[float, Positive, Unit("kg/m³")]
Gravity = Annotated[float, Positive, Unit("m/s²")]
Poisson = Annotated[float, Between(0.0, 0.5, remedy="give one from 0 to 0.5"), RATIO]
Friction = Annotated[
    float, Between(0.0, 1.57, remedy=f"give one from 0 to 1.57 {_RADIANS}"), Unit("rad")
]
Incline = Annotated[
    float, Between(-1.57, 1.57, remedy=f"give one from -1.57 to 1.57 {_RADIANS}"), Unit("rad")
]


@dataclass(frozen=True)
class Numbers:
    """Hold what a check finds.

    Attributes:
        expected: number of the formula.
        found: number of the run.
        why: empty, or why the formula does not apply.
        inputs: name -> (value, unit) of what was taken from the run.
        peak: values (rows,) of which ``found`` is the largest; None where it is no peak.
        notes: sentences about both numbers.
    """

    expected: float
    found: float
    why: str = ""
    inputs: Inputs = field(default_factory=dict)
    peak: Array | None = None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Comparison:
    """Hold a number of a run beside that of a formula, both in ``unit``.

    Attributes:
        name: of the check.
        formula: in signs.
        source: author and year of the formula.
        inputs: name -> (value, unit) of what went into the formula.
        expected: number of the formula, nan where it does not apply.
        found: number of the run, nan where the run has not recorded its columns.
        unit: of both numbers.
        applies: empty, or the sentence that says why the formula does not apply.
        range: where the formula applies, in words.
        reading: what a ratio above or below 1 means, and which side is unsafe.
        lasted: how long the run stayed above 90 % of a peak [s]; nan for what is no peak.
        notes: sentences: what was taken from the run, what contradicts it, what is unsafe.
    """

    name: str
    formula: str
    source: str
    inputs: Inputs
    expected: float
    found: float
    unit: str
    applies: str = ""
    range: str = ""
    reading: str = ""
    lasted: float = math.nan
    notes: tuple[str, ...] = ()

    @property
    def ratio(self) -> float:
        """Return found/expected; nan where the formula does not apply or expects nothing.

        It is no judgement: ``reading`` says what it means.
        """
        return self.found / self.expected if self.expected else math.nan


@dataclass(frozen=True)
class Formula:
    """Hold what a check says of itself.

    Attributes:
        text: the formula, in signs.
        source: its author and year.
        range: where it applies, in words.
        fields: names of the fields of the check that go into it.
        reads: columns of the history that it reads; {name} stands for the value of a field.
        answers: what ``of`` may ask for -> unit; the first one goes without saying.
        reading: what a ratio above or below 1 means, and which side is unsafe.
    """

    text: str
    source: str
    range: str
    fields: tuple[str, ...]
    reads: tuple[str, ...]
    answers: Mapping[str, str]
    reading: str = ""


@dataclass(frozen=True, kw_only=True)
class Check(ABC):
    """Compare a run with a formula.

    This is the base of all checks, which are frozen dataclasses with fields in SI units and angles
    in radians. Each says in ``formula`` what it is.

    Attributes:
        of: which of the answers of the formula is compared; "" where there is one.
    """

    formula: ClassVar[Formula]

    of: str = ""

    def __post_init__(self) -> None:
        name = type(self).__name__
        check_word(f"{name}: of", self.of, tuple(self.formula.answers))
        check_fields(self)

    @abstractmethod
    def numbers(self, history: History) -> Numbers:
        """Return both numbers, why they cannot be compared, and the inputs taken from the run.

        The history has all columns that the formula reads.
        """

    @property
    def reading(self) -> str:
        """Return what a ratio above or below 1 means, and which side is unsafe."""
        return self.formula.reading

    def settle(self, history: History, facts: ModelFacts) -> tuple[Self, list[str]]:
        """Return the check with what it takes from the run, and sentences about that.

        A field that is None is filled in where the run knows it. One that is given and contradicts
        the run is told.
        """
        return self, []

    def gather_inputs(self) -> Inputs:
        """Return the fields that the formula takes, without those that are None."""
        units = read_quantities(type(self))
        inputs: dict[str, tuple[float, str]] = {}
        for name in self.formula.fields:
            value = getattr(self, name)
            if value is not None:
                inputs[name] = (value, units[name].symbol or "-")
        return inputs

    def compare_all(
        self, history: History, facts: ModelFacts | None = None
    ) -> tuple[Comparison, ...]:
        """Return all comparisons that the check makes without being asked; see ``compare``."""
        return (self.compare(history, facts),)

    def compare(self, history: History, facts: ModelFacts | None = None) -> Comparison:
        """Return the comparison for the history of a run.

        Args:
            history: column -> values (rows,), as of a solution or run folder.
            facts: what the model of the run says; None: nothing.
        """
        check, notes = self.settle(history, facts or ModelFacts())
        columns = [column.format(**vars(self)) for column in self.formula.reads]
        lacking = [column for column in columns if column not in history]
        if lacking:
            why = f"the run has no column {lacking[0]}: record it"
            numbers = Numbers(math.nan, math.nan, why)
        else:
            numbers = check.numbers(history)

        # How long the peak of the run lasts: one of a single step is not yet found.
        lasted = math.nan
        if numbers.peak is not None and "t" in history:
            lasted, rows = find_duration(history["t"], numbers.peak)
            if rows == 1:
                notes.append(
                    f"the peak of the run lasts one step ({lasted:.3g} s above 90 %): compute with "
                    "half the time step before you believe it"
                )

        # Choices such as passive=True stand behind the name, and among the inputs as 1.
        choices = [name for name, value in vars(check).items() if value is True]
        words = [name.replace("_", " ") for name in choices]
        if self.of != next(iter(self.formula.answers)):
            words.append(self.of)
        return Comparison(
            name=", ".join([type(self).__name__, *words]),
            formula=self.formula.text,
            source=self.formula.source,
            range=self.formula.range,
            inputs={
                **check.gather_inputs(),
                **dict.fromkeys(choices, (1.0, "-")),
                **numbers.inputs,
            },
            expected=math.nan if numbers.why else numbers.expected,
            found=numbers.found,
            unit=self.formula.answers[self.of],
            applies=numbers.why,
            reading=check.reading,
            lasted=lasted,
            notes=(*notes, *numbers.notes),
        )


def find_duration(t: Array, values: Array) -> tuple[float, int]:
    """Return how long values stay above 90 % of their largest one [s], and in how many rows.

    What counts is the time about the peak, up to where the lines between the rows cross 90 %.

    Args:
        t: (n,) times [s].
        values: (n,), the largest of them positive.
    """
    first, last = find_stretch(values)
    level = NEARLY * float(np.max(values))

    # The crossings of the level, between a row that is high and its neighbour that is low.
    start = float(t[first])
    if first > 0:
        share = (values[first] - level) / (values[first] - values[first - 1])
        start -= float(share * (t[first] - t[first - 1]))
    end = float(t[last])
    if last < len(values) - 1:
        share = (values[last] - level) / (values[last] - values[last + 1])
        end += float(share * (t[last + 1] - t[last]))
    return end - start, last - first + 1
