"""Say limits, unit and meaning of an argument once, in its annotation.

    E: Annotated[float, Positive, Unit("Pa"), "Young's modulus E"]
    depth: Annotated[int, Positive] = 5                    a whole number of at least 1
    nu: Annotated[float, Between(-1.0, 0.5, "()"), RATIO]  both ends excluded
    delay: Annotated[float | None, NotNegative, Unit("s")] = None

From it come the check and its sentence (``core.arguments``), the unit in which case files take a
number without one, and the schema of case files. Marks hold for every number of a value, those of a
list too, and not for None, functions and other objects.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from types import MappingProxyType
from typing import Annotated, Any, NamedTuple, get_args, get_origin, get_type_hints

ENDS = ("[]", "[)", "(]", "()")
_ASCII = str.maketrans({"²": "2", "³": "3", "·": "*", " ": "*"})


class Unit(NamedTuple):
    """Name the SI unit of a quantity, as "kg/m³"; "1" is that of ratios."""

    symbol: str

    def __repr__(self) -> str:
        return f"Unit({self.symbol!r})"

    @property
    def typed(self) -> str:
        """Return it as one types it in a case file, "kg/m3"."""
        return self.symbol.translate(_ASCII)


class Remedy(NamedTuple):
    """Say what to give in place of a value of another type, as "give a mesh of DOLFINx"."""

    text: str


class Between(NamedTuple):
    """Bound a number by two ends; whole numbers where the annotation is ``int``.

    Attributes:
        low: the lower end.
        high: the upper end; infinite numbers never hold.
        ends: "[]", "()", "[)" or "(]": a square bracket for an end that is included, a round one
            for an end that is not.
        remedy: what to do, such as "give a ratio, not per cent"; "" for words made of the ends.
    """

    low: float
    high: float
    ends: str = "[]"
    remedy: str = ""

    def __repr__(self) -> str:
        ends = "" if self.ends == "[]" else f", {self.ends!r}"
        return _NAMES.get(self, f"Between({self.low!r}, {self.high!r}{ends})")

    def holds(self, value: float) -> bool:
        """Return whether a number is finite and between the ends."""
        if not (self.low <= value <= self.high and math.isfinite(value)):
            return False
        if value == self.low and self.ends[0] == "(":
            return False
        return value != self.high or self.ends[1] == "]"

    def in_words(self, whole: bool = False) -> str:
        """Return the remedy as the end of a sentence: what to give, or which whole number."""
        if self.remedy:
            return self.remedy
        return f"give {self._describe_whole() if whole else self._describe_real()}"

    def least(self) -> float:
        """Return the least whole number that holds; -inf where there is none."""
        least = math.ceil(self.low) if math.isfinite(self.low) else self.low
        return least + 1 if self.ends[0] == "(" and least == self.low else least

    def most(self) -> float:
        """Return the largest whole number that holds; inf where there is none."""
        most = math.floor(self.high) if math.isfinite(self.high) else self.high
        return most - 1 if self.ends[1] == ")" and most == self.high else most

    def _describe_whole(self) -> str:
        """Return the words for whole numbers that hold."""
        ends = []
        if math.isfinite(self.low):
            ends.append(f"at least {self.least()}")
        if math.isfinite(self.high):
            ends.append(f"at most {self.most()}")
        return f"a whole number of {' and '.join(ends)}" if ends else "a whole number"

    def _describe_real(self) -> str:
        """Return the words for numbers that hold."""
        if self in _WORDS:
            return _WORDS[self]
        excludes_low = self.ends[0] == "("
        excludes_high = self.ends[1] == ")"
        if math.isinf(self.high):
            return f"a finite number {'above' if excludes_low else 'of at least'} {self.low:g}"
        if math.isinf(self.low):
            return f"a finite number {'below' if excludes_high else 'of at most'} {self.high:g}"
        if excludes_low and excludes_high:
            return f"a number between {self.low:g} and {self.high:g}, both excluded"
        if excludes_low:
            return f"a number above {self.low:g} and at most {self.high:g}"
        if excludes_high:
            return f"a number from {self.low:g} to less than {self.high:g}"
        return f"a number from {self.low:g} to {self.high:g}"


Finite = Between(-math.inf, math.inf)
"""Any number but NaN and the infinite ones."""
Positive = Between(0.0, math.inf, "(]")
"""Above zero and finite; of whole numbers at least 1."""
NotNegative = Between(0.0, math.inf)
"""Zero or above, and finite."""
RATIO = Unit("1")
"""The unit of ratios and coefficients, which case files take in per cent too."""
_NAMES = {Finite: "Finite", Positive: "Positive", NotNegative: "NotNegative"}
_WORDS = {
    Finite: "a finite number",
    Positive: "a finite number above zero",
    NotNegative: "zero or a positive finite number",
}


@dataclass(frozen=True)
class Quantity:
    """Hold what the annotation of an argument says of it.

    Attributes:
        kind: its type without marks.
        limit: the limits of its numbers; None for none.
        unit: its unit; None for none.
        meaning: words for it, with its name in them; "" for none.
        other: what to do about a value of another type; None for words made of the type.
    """

    kind: Any
    limit: Between | None = None
    unit: Unit | None = None
    meaning: str = ""
    other: Remedy | None = None

    @property
    def symbol(self) -> str:
        """Return the symbol of its unit; "" where it has none, or is a ratio."""
        return "" if self.unit in (None, RATIO) else self.unit.symbol

    def describe(self, name: str) -> str:
        """Return the words for it in a sentence, its meaning with the unit, or its name.

        The unit of an argument without a meaning stands in the remedy.
        """
        unit = f" [{self.symbol}]" if self.symbol else ""
        return f"{self.meaning}{unit}" if self.meaning else name

    def remedy(self, whole: bool = False) -> str:
        """Return the end of the sentence about a wrong number; "" where all are right."""
        if self.limit is None:
            return ""
        needs_unit = self.symbol and not (self.meaning or self.limit.remedy)
        unit = f" in {self.symbol}" if needs_unit else ""
        return f"{self.limit.in_words(whole)}{unit}"


@cache
def read_quantities(owner: Callable[..., Any]) -> Mapping[str, Quantity]:
    """Return what the annotations of a dataclass or function say, by argument.

    A field that a class declares anew without marks, for another default, keeps those of the class
    that it inherits from. Of a class whose own annotations cannot be resolved, as one made in a
    function, those that it inherits are read.
    """
    inherited: Mapping[str, Quantity] = {}
    if isinstance(owner, type) and owner is not object:
        inherited = read_quantities(owner.__mro__[1])
    try:
        marked = get_type_hints(owner, include_extras=True)
        bare = get_type_hints(owner)
    except NameError:
        if not isinstance(owner, type) or owner.__base__ is object:
            raise
        return inherited
    result = {name: _read_hint(marked[name], bare[name]) for name in bare}
    for name, quantity in inherited.items():
        if name in result and not any(_marks(marked[name])):
            result[name] = replace(quantity, kind=result[name].kind)
    return MappingProxyType(result)


def _read_hint(hint: Any, kind: Any) -> Quantity:
    """Return what a hint says; the kind is the hint without marks."""
    mark_of: dict[type, Any] = {}
    for mark in _marks(hint):
        first = mark_of.setdefault(type(mark), mark)
        if first != mark:
            raise TypeError(f"{hint} says two things at once: {first!r} and {mark!r}")
    limit = mark_of.get(Between)
    if limit is not None and (limit.ends not in ENDS or not limit.low < limit.high):
        raise TypeError(f"{hint}: give low < high, and ends out of {', '.join(ENDS)}")
    return Quantity(kind, limit, mark_of.get(Unit), mark_of.get(str, ""), mark_of.get(Remedy))


def _marks(hint: Any) -> Iterator[Any]:
    """Yield the marks of a hint, those inside unions and lists too."""
    if get_origin(hint) is Annotated:
        for mark in hint.__metadata__:
            if isinstance(mark, Between | Unit | Remedy | str):
                yield mark
    for argument in get_args(hint):
        yield from _marks(argument)
