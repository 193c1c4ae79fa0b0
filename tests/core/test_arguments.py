"""Limits, units and meanings in annotations: one sentence for each kind of mark."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

from vi_contact.core.algebra import Array
from vi_contact.core.arguments import check_arguments, check_fields
from vi_contact.core.errors import InputError
from vi_contact.core.quantities import (
    RATIO,
    Between,
    Finite,
    NotNegative,
    Positive,
    Unit,
    read_quantities,
)

pytestmark = pytest.mark.serial
Length = Annotated[float, Positive, Unit("m")]


@dataclass(frozen=True)
class Beam:
    """One argument of each kind."""

    E: Annotated[float, Positive, Unit("Pa"), "Young's modulus E"] = 1.0
    length: Length = 1.0
    width: Length | None = None
    gap: Annotated[float, NotNegative] = 0.0
    shift: Annotated[float, Finite, Unit("m")] = 0.0
    nu: Annotated[float, Between(-1.0, 0.5, "()"), RATIO, "Poisson's ratio nu"] = 0.3
    xi: Annotated[float, Between(0.0, 1.0, "[)", "give a ratio, not per cent")] = 0.0
    pieces: Annotated[int, Positive] = 1
    order: Annotated[int, Between(0, 8)] = 0
    springs: Annotated[tuple[float, ...], Positive, Unit("N/m")] = ()
    mu: Annotated[float | Array | Sequence[float], NotNegative, RATIO] = 0.0
    load: Annotated[float | Callable[[float], float], Finite, Unit("N")] = 0.0
    name: str = ""

    def __post_init__(self) -> None:
        check_fields(self)


HUGE = 10**5000
REFUSED: list[tuple[str, tuple[Any, ...], str]] = [
    (
        "E",
        (-1, 0.0, "1", None, True, math.nan, math.inf, HUGE, np.ones(1)),
        r"Beam: Young's modulus E \[Pa\] is .*; give a finite number above zero$",
    ),
    ("length", (0, "1"), r"Beam: length is .*; give a finite number above zero in m$"),
    ("width", (0, "1"), r"Beam: width is .*; give a finite number above zero in m$"),
    ("gap", (-1e-300, math.nan), "Beam: gap is .*; give zero or a positive finite number$"),
    ("shift", (math.inf, False), "Beam: shift is .*; give a finite number in m$"),
    (
        "nu",
        (-1.0, 0.5, "0"),
        "Beam: Poisson's ratio nu is .*; give a number between -1 and 0.5, both excluded$",
    ),
    ("xi", (-0.1, 1.0, [0.1]), "Beam: xi is .*; give a ratio, not per cent$"),
    (
        "pieces",
        (0, 2.5, math.inf, "3", None),
        "Beam: pieces is .*; give a whole number of at least 1$",
    ),
    ("order", (-1, 9, HUGE), "Beam: order is .*; give a whole number of at least 0 and at most 8$"),
    (
        "springs",
        ((1.0, 0.0),),
        r"Beam: springs\[1\] is 0.0; give a finite number above zero in N/m$",
    ),
    ("springs", (3.0, ("a",)), "Beam: springs is .*; give real numbers in a tuple$"),
    ("mu", (-1.0,), "Beam: mu is -1.0; give zero or a positive finite number$"),
    (
        "mu",
        ([0.1, math.nan], np.array([0.1, math.nan])),
        r"Beam: mu\[1\] is .*nan\)?; give zero or",
    ),
    ("load", (math.nan,), "Beam: load is nan; give a finite number in N$"),
    ("load", ("p",), "Beam: load is 'p'; give a real number or a function$"),
]


@pytest.mark.parametrize("name, values, said", REFUSED)
def test_each_mark_refuses_in_a_sentence(name: str, values: tuple[Any, ...], said: str) -> None:
    for value in values:
        with pytest.raises(InputError, match=f"^{said}"):
            Beam(**{name: value})


def test_what_is_within_stays_what_it_was() -> None:
    kept: dict[str, Any] = {
        "E": 2,
        "length": np.float32(1.0),
        "width": 0.1,
        "gap": 0,
        "shift": np.array(-1.0),
        "nu": -0.99,
        "xi": 0,
        "pieces": 3.0,
        "order": np.int64(8),
        "springs": [1, 2.0],
        "mu": np.array([0.0, 0.5]),
        "load": math.sin,
    }
    beam = Beam(**kept)
    assert all(getattr(beam, name) is one for name, one in kept.items())
    with pytest.raises(AttributeError):
        beam.E = 1.0  # type: ignore[misc]


def test_subclasses_inherit_the_marks_and_add_theirs() -> None:
    """Also where an annotation of their own names what only a function knows."""
    local = float

    @dataclass(frozen=True)
    class Tapered(Beam):
        end: Annotated[local, Positive] = 1.0  # type: ignore[valid-type]

    with pytest.raises(InputError, match="Tapered: length is -1; give a finite number above zero"):
        Tapered(length=-1)
    assert Tapered(end=2.0).end == 2.0


def test_functions_say_the_same() -> None:
    @check_arguments
    def bend(
        moment: Annotated[float, Finite, Unit("N·m")],
        *lengths: float,
        steps: Annotated[int, Positive],
    ) -> float:
        return moment

    assert bend(2.0, 1.0, steps=3) == 2.0
    with pytest.raises(InputError, match="bend: moment is nan; give a finite number in N·m$"):
        bend(math.nan, steps=1)
    with pytest.raises(InputError, match="bend: steps is 0; give a whole number of at least 1$"):
        bend(1.0, steps=0)


@pytest.mark.parametrize(
    "limit, whole, said",
    [
        (Between(0.0, 1.0), False, "a number from 0 to 1"),
        (Between(0.0, 1.0, "[)"), False, "a number from 0 to less than 1"),
        (Between(0.0, 1.0, "(]"), False, "a number above 0 and at most 1"),
        (Between(1.0, math.inf), False, "a finite number of at least 1"),
        (Between(1.0, math.inf, "(]"), False, "a finite number above 1"),
        (Between(-math.inf, 1.0), False, "a finite number of at most 1"),
        (Between(-math.inf, 1.0, "[)"), False, "a finite number below 1"),
        (Between(-math.inf, 5), True, "a whole number of at most 5"),
        (Between(2, 5, "()"), True, "a whole number of at least 3 and at most 4"),
        (Between(2.5, 4.5), True, "a whole number of at least 3 and at most 4"),
        (Finite, True, "a whole number"),
    ],
)
def test_remedies_are_told_from_the_ends(limit: Between, whole: bool, said: str) -> None:
    assert limit.in_words(whole) == f"give {said}"


def test_annotations_are_read_as_they_are_written() -> None:
    said = read_quantities(Beam)
    assert said["E"].unit == Unit("Pa") and said["E"].kind is float
    assert said["width"].kind == float | None and said["width"].limit is Positive
    assert Unit("kg/m³").typed == "kg/m3" and Unit("Pa·s").typed == "Pa*s"
    assert repr(Positive) == "Positive" and repr(Between(0, 1, "[)")) == "Between(0, 1, '[)')"

    def nothing(x: Annotated[float, Between(1.0, 0.0)]) -> None: ...

    with pytest.raises(TypeError, match="give low < high"):
        read_quantities(nothing)

    def twice(x: Annotated[Length, Unit("s")]) -> None: ...

    with pytest.raises(TypeError, match="two things at once"):
        read_quantities(twice)


@dataclass(frozen=True)
class Short(Beam):
    """A field that is declared anew for another default keeps its limits."""

    length: float = 0.5


def test_another_default_keeps_the_limits() -> None:
    assert Short().length == 0.5
    assert read_quantities(Short)["length"] == read_quantities(Beam)["length"]
    with pytest.raises(InputError, match="Short: length is -1; give a finite number above zero"):
        Short(length=-1)


def test_truth_values_are_no_numbers() -> None:
    for wrong in ((True, False), np.array([True, False])):
        with pytest.raises(InputError, match="Beam: mu"):
            Beam(mu=wrong)


def test_a_protocol_with_brackets_is_that_protocol() -> None:
    """As those in numpy's ArrayLike are."""

    @check_arguments
    def centre(where: ArrayLike) -> ArrayLike:
        return where

    assert centre((0.0, 1.0)) == (0.0, 1.0)
