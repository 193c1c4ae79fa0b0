"""Arithmetic in case files: the values of closed forms, and one sentence for what is none."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest

from vi_contact.core.errors import InputError
from vi_contact.practice.studies.cases.expressions import DEPTH, LENGTH, Expression, Places

pytestmark = pytest.mark.serial
VALUES = {
    "2*9.81": 19.62,
    "3.2e6/2": 1.6e6,
    "1/200": 0.005,
    "-2^2": -4.0,
    "(-2)^2": 4.0,
    "2^3^2": 512.0,
    "2^-1": 0.5,
    "2 - 3 - 4": -5.0,
    "8/4/2": 1.0,
    "1 + 2*3": 7.0,
    "+-+1": -1.0,
    ".5 + 5.": 5.5,
    "1E-3": 1e-3,
    "pi/2": math.pi / 2,
    "sqrt(2)": math.sqrt(2.0),
    "sin(1) + cos(2)": math.sin(1.0) + math.cos(2.0),
    "exp(log(7))": 7.0,
    "tan(0.3)": math.tan(0.3),
    "abs(-3)": 3.0,
    "max(1, 5, 3)": 5.0,
    "min(2, -1)": -1.0,
    "step(0)": 1.0,
    "step(-1e-9)": 0.0,
    " 4 ": 4.0,
    "9" * 400: math.inf,
    "((((1))))": 1.0,
}


@pytest.mark.parametrize("text", VALUES)
def test_values(text: str) -> None:
    assert Expression(text)() == pytest.approx(VALUES[text], rel=1e-15)


BAD = {
    "no end": ("sqrt(2", "are not arithmetic"),
    "nothing": ("", "are not arithmetic"),
    "two": ("1 2", "not arithmetic"),
    "two stars": ("2**3", "not arithmetic"),
    "import": ("__import__('os')", "'_' in it does not belong"),
    "attribute": ("pi.real", "'.' in it does not belong"),
    "index": ("x[0]", "does not belong to arithmetic"),
    "call of a call": ("sin(1)(2)", "is not a number, x, y"),
    "name": ("height", "'height' in it is not a"),
    "of another": ("open(1)", "'open' in it"),
    "no values": ("max()", "'max' in it"),
    "one value": ("max(1)", "'max'"),
    "too many": ("sqrt(1, 2)", "'sqrt' in it"),
    "a function alone": ("sin", "'sin' in it"),
    "keyword": ("x if x else y", "in it is not a number"),
    "logic": ("not x", "in it is not a number"),
    "walrus": ("(x := 2)", "':' in it"),
    "truth": ("True", "'True' in it"),
    "falsehood": ("False", "'False' in it"),
    "none": ("None", "'None' in it"),
    "lambda": ("lambda: 1", "':' in it"),
    "stars": ("max(*x, 2)", "in it is not a number"),
    "a pair": ("(1, 2)", "in it is not a number"),
    "hex": ("0x10", "are not arithmetic"),
    "octal": ("010", "are not arithmetic"),
    "complex": ("1j", "are not arithmetic"),
    "text": ("'a'", "does not belong to arithmetic"),
    "unicode": ("２", "'２' in"),
    "lookalike": ("ѕin(1)", "in it does not belong"),
    "operator's name": ("Add(1, 2)", "'Add' in it"),
    "NUL": ("1\0", "in it"),
    "floor": ("7 // 2", "are not arithmetic"),
    "comparison": ("1 < 2", "'<' in it"),
    "modulo": ("7 % 2", "'%' in it"),
    "power": ("2^101", "larger than 100"),
    "tower": ("9^9^9^9", "larger than 100"),
    "NaN power": ("2^(0/0)", "larger than 100"),
    "variable power": ("2^x", "write a\\^x as exp"),
    "long": ("1+" * LENGTH + "1", "has 1001 characters, and 500"),
    "signs": ("-" * 400 + "1", "nested more than 20"),
    "functions": ("sin(" * (DEPTH + 2) + "1" + ")" * (DEPTH + 2), "nested more than 20"),
    "brackets": ("(" * 249 + "1" + ")" * 249, "are not arithmetic"),
    "powers": ("2^" * 30 + "1", "nested more than 20"),
    "empty bracket": ("2*()", "in it is not a number"),
}


@pytest.mark.parametrize("what", BAD)
def test_what_is_no_arithmetic_is_refused_at_once(what: str) -> None:
    text, said = BAD[what]
    start = time.process_time()
    with pytest.raises(InputError, match=said) as caught:
        Expression(text, "xyzt")
    assert time.process_time() - start < 0.5 and "\n" not in str(caught.value)


def test_the_longest_expressions_are_quick() -> None:
    """Of 500 characters, on ten thousand points: they can be long, not slow."""
    text = "+".join(["sin(x)"] * 71)
    points = np.random.default_rng(1).uniform(size=(10_000, 2))
    start = time.process_time()
    found = Places(Expression(text, "xyzt"))(points)
    assert time.process_time() - start < 2.0
    assert np.allclose(found, 71.0 * np.sin(points[:, 0]), rtol=1e-13)


def test_functions_of_places_and_time() -> None:
    points = np.array([[1.0, 2.0], [3.0, 50.0]])
    water = Places(Expression("9810*max(0, 35 - y)*t", "xyzt"))
    assert np.array_equal(water(points, 2.0), [9810.0 * 33.0 * 2.0, 0.0])
    both = Places((Expression("x*y", "xyzt"), Expression("1 + z", "xyzt")))
    assert np.array_equal(both(np.column_stack([points, [0.0, 7.0]])), [[2.0, 1.0], [150.0, 8.0]])
    with pytest.raises(
        InputError, match=r"expression '1 \+ z' has z, and a model of dimension 2 has only x, y"
    ):
        both(points)
    assert Places(Expression("7", "xyz"))(points).tolist() == [7.0, 7.0]
    assert Expression("t^2", "t")(3.0) == 9.0
    assert water == Places(Expression("9810*max(0, 35 - y)*t", "xyzt")) and water != both
