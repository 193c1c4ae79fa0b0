"""A pytest plugin that lists the assertions within a factor 3 of their bound: which processor will
break them?

    VI_CONTACT_TIGHT=list.txt PYTHONPYCACHEPREFIX=/tmp/tight OPENBLAS_CORETYPE=Haswell
    VI_CONTACT_RANKS=1 \\
        bash tests/run.sh -p tests.tight -o enable_assertion_pass_hook=true

Looks at what is left of round-off: bounds below SMALL, and tolerances below SMALL of the number
they surround.
"""

from __future__ import annotations

import ast
import os
import re
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from math import nan
from operator import add, mul, sub, truediv

import pytest
from _pytest.assertion import util

FACTOR, SMALL, ENOUGH = 3.0, 1e-5, 200
NUMBER = r"(-?\d+(?:\.\d*)?(?:e[-+]?\d+)?)"
AROUND = re.compile(rf"{NUMBER} == {NUMBER} ± {NUMBER}")
seen: Counter[str] = Counter()
ARITHMETIC = {ast.Add: add, ast.Sub: sub, ast.Mult: mul, ast.Div: truediv, ast.Pow: pow}


def number(node: ast.expr) -> float:
    """The value of an expression of numbers; NaN for any other."""
    if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
        return float(node.value)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return -number(node.operand)
    if isinstance(node, ast.BinOp) and type(node.op) in ARITHMETIC:
        with suppress(ZeroDivisionError, OverflowError):
            return float(ARITHMETIC[type(node.op)](number(node.left), number(node.right)))
    return nan


def shares(explanation: str) -> Iterator[float]:
    """How much of each small bound is used up, from what pytest tells of an assertion with its
    values put in."""
    for value, middle, tolerance in AROUND.findall(explanation):
        if 0.0 < float(tolerance) < SMALL * abs(float(middle)):
            yield abs(float(value) - float(middle)) / float(tolerance)
    try:
        tree = ast.parse(explanation.split("\n")[0], mode="eval")
    except SyntaxError:
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            for left, sign, right in zip(sides, node.ops, sides[1:], strict=False):
                yield (
                    share(left, right)
                    if isinstance(sign, (ast.Lt, ast.LtE))
                    else share(right, left)
                )


def share(value: ast.expr, bound: ast.expr) -> float:
    """How much of the bound is used up, or of what is added to something else: now <= before +
    1e-12 * first."""
    before = 0.0
    if isinstance(bound, ast.BinOp) and isinstance(bound.op, ast.Add):
        before, bound = number(bound.left), bound.right
    factors = [bound, *((bound.left, bound.right) if isinstance(bound, ast.BinOp) else ())]
    small = any(0.0 < number(factor) < SMALL for factor in factors)
    return (number(value) - before) / number(bound) if small else 0.0


def pytest_assertion_pass(item: pytest.Item, lineno: int, orig: str, expl: str) -> None:
    """Write down what is tight; leave a test alone that asserts in every step, for explanations are
    slow."""
    seen[item.nodeid] += 1
    if seen[item.nodeid] == ENOUGH:
        util._assertion_pass = None
    used = max(shares(expl), default=0.0)
    if used * FACTOR > 1.0:
        with open(os.environ["VI_CONTACT_TIGHT"], "a") as file:
            file.write(f"{used:.2f} {item.nodeid} line {lineno}: {orig}\n")
