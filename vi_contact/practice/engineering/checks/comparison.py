"""Set what a run found beside what a formula expects.

This is what all checks of ``engineering.checks`` have in common.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar

from ....core.algebra import Array
from ....core.arguments import check_fields
from ....core.checks import check_word
from ....core.quantities import RATIO, Between, Positive, Unit, read_quantities

History = Mapping[str, Array]  # column -> values (rows,)
Inputs = Mapping[str, tuple[float, str]]  # name -> (value, unit)
# expected, found, why the formula does not apply, inputs taken from the run
Numbers = tuple[float, float, str, Inputs]
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

    @property
    def ratio(self) -> float:
        """Return found/expected; nan where the formula does not apply or expects nothing."""
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
        answers: what ``of`` may ask for -> unit.
    """

    text: str
    source: str
    range: str
    fields: tuple[str, ...]
    reads: tuple[str, ...]
    answers: Mapping[str, str]


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

    def gather_inputs(self) -> Inputs:
        """Return the fields that the formula takes, without those that are None."""
        units = read_quantities(type(self))
        inputs: dict[str, tuple[float, str]] = {}
        for name in self.formula.fields:
            value = getattr(self, name)
            if value is not None:
                inputs[name] = (value, units[name].symbol or "-")
        return inputs

    def compare(self, history: History) -> Comparison:
        """Return the comparison for the history of a run.

        The history is column -> values (rows,), as of a solution or run folder.
        """
        columns = [column.format(**vars(self)) for column in self.formula.reads]
        lacking = [column for column in columns if column not in history]
        if lacking:
            expected = math.nan
            found = math.nan
            why = f"the run has no column {lacking[0]}: record it"
            inputs_of_run: Inputs = {}
        else:
            expected, found, why, inputs_of_run = self.numbers(history)

        # Choices such as passive=True stand behind the name, and among the inputs as 1.
        choices = [name for name, value in vars(self).items() if value is True]
        words = [name.replace("_", " ") for name in choices]
        return Comparison(
            name=", ".join([type(self).__name__, *words]),
            formula=self.formula.text,
            source=self.formula.source,
            range=self.formula.range,
            inputs={
                **self.gather_inputs(),
                **dict.fromkeys(choices, (1.0, "-")),
                **inputs_of_run,
            },
            expected=math.nan if why else expected,
            found=found,
            unit=self.formula.answers[self.of],
            applies=why,
        )
