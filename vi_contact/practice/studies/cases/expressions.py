"""Read arithmetic of numbers and of x, y, z, t.

It becomes a program for a stack of numbers; nothing is run as code.

There are numbers, pi, brackets, + - * / ^, sqrt sin cos tan exp log abs step min max. A text is cut
into these words; Python's parser, which runs nothing, then tells which belongs to which. Texts have
at most 500 characters, brackets in each other 20 deep and exponents that are numbers up to 100, so
that an evaluation is at most 500 products of arrays.
"""

import ast
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ....core.algebra import Array
from ....core.checks import quote
from ....core.errors import InputError

LENGTH, DEPTH, POWER = 500, 20, 100
_WORD = re.compile(r"(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?|[A-Za-z]\w*|[-+*/^(),]", re.ASCII)
_Functions = Mapping[str, Callable[..., Any]]
_OF_ONE: _Functions = {
    "sqrt": np.sqrt,
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "exp": np.exp,
    "log": np.log,
    "abs": np.abs,
    "step": lambda a: np.heaviside(a, 1.0),
}
_OF_TWO: _Functions = {
    "Add": np.add,
    "Sub": np.subtract,
    "Mult": np.multiply,
    "Div": np.divide,
    "Pow": np.power,
}
_OF_MORE: _Functions = {"min": np.minimum, "max": np.maximum}


@dataclass(frozen=True)
class Expression:
    """Hold arithmetic of these variables; step(a) is 1 from a = 0 on and 0 before.

    InputError says what is wrong.

    Called with the time and values of the other variables, which may be arrays, it returns its own;
    NaN where there is none, as of the root of a negative number.
    """

    text: str
    variables: str = ""
    # numbers, variables, (function, count)
    program: tuple[Any, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if len(self.text) > LENGTH:
            raise InputError(f"it has {len(self.text)} characters, and {LENGTH} are the most")
        if strange := _WORD.sub("", self.text).strip():
            raise InputError(f"'{strange[0]}' in it does not belong to arithmetic")
        words = " ".join(word[0] for word in _WORD.finditer(self.text))
        try:
            tree = ast.parse(words.replace("^", "**").strip(), mode="eval").body
        except (SyntaxError, RecursionError, MemoryError):
            # MemoryError: the parser's stack is full
            raise InputError("its brackets, signs or commas are not arithmetic") from None
        object.__setattr__(self, "program", tuple(self._program(tree, 0)))

    @property
    def used(self) -> frozenset[str]:
        """Return the variables that occur in it."""
        return frozenset(one for one in self.program if isinstance(one, str))

    def __call__(self, t: float = 0.0, **places: Any) -> Any:
        """Return the value at time t [s] and these values of the other variables."""
        return _run(self.program, {"t": t, **places})

    def _program(self, node: Any, depth: int) -> Iterator[Any]:
        """Yield numbers, variables and functions in the order in which they are worked off."""
        if depth > DEPTH:
            raise InputError(f"brackets, signs or powers in it are nested more than {DEPTH} deep")
        name = getattr(getattr(node, "func", node), "id", "")
        if _is_number(node):
            yield float(str(node.value))  # of a whole number with too many digits: infinite
        elif isinstance(node, ast.Name) and name == "pi":
            yield np.pi
        elif isinstance(node, ast.Name) and name in tuple(self.variables):
            yield name
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
            yield from self._program(node.operand, depth + 1)
            yield from [(np.negative, 1)] if isinstance(node.op, ast.USub) else []
        elif isinstance(node, ast.BinOp):
            yield from self._program_of_two(node, depth)
        elif isinstance(node, ast.Call) and (
            name in _OF_MORE if len(node.args) > 1 else node.args and name in _OF_ONE
        ):
            yield from self._program_of_call(node, name, depth)
        else:
            there = "".join(f", {one}" for one in self.variables)
            raise InputError(
                f"'{name or ast.unparse(node)[:20]}' in it is not a number{there}, pi or one of "
                f"{', '.join((*_OF_ONE, *_OF_MORE))} with its values in brackets"
            )

    def _program_of_two(self, node: ast.BinOp, depth: int) -> Iterator[Any]:
        """Yield the program of an operation with two operands."""
        chain = isinstance(node.op, ast.Add | ast.Sub | ast.Mult | ast.Div)
        yield from self._program(node.left, depth + (not chain))
        right = list(self._program(node.right, depth + 1))
        if isinstance(node.op, ast.Pow):
            if any(isinstance(one, str) for one in right):
                raise InputError("an exponent has a variable: write a^x as exp(x*log(a))")
            if not abs(_run(right, {})) <= POWER:
                raise InputError(f"an exponent is larger than {POWER}")
        yield from (*right, (_OF_TWO[type(node.op).__name__], 2))

    def _program_of_call(self, node: ast.Call, name: str, depth: int) -> Iterator[Any]:
        """Yield the program of the call of a function."""
        yield from self._program(node.args[0], depth + 1)
        for one in node.args[1:]:
            yield from self._program(one, depth + 1)
            yield _OF_MORE[name], 2
        yield from [(_OF_ONE[name], 1)] if name in _OF_ONE else []


def _is_number(node: ast.AST) -> bool:
    """Tell whether a node of the syntax tree is a number."""
    return (
        isinstance(node, ast.Constant)
        and isinstance(node.value, int | float)
        and not isinstance(node.value, bool)
    )


@dataclass(frozen=True)
class Places:
    """Give expressions of x, y, z and t as the function of the Python interface that a key takes.

    Called with points (k, d) [m] and the time [s], it returns (k,) of one, (k, n) of n; InputError
    for axes beyond d.
    """

    of: Expression | tuple[Expression, ...]

    def __call__(self, points: Array, t: float = 0.0) -> Array:
        """Return the values (k,) or (k, n) at points (k, d) [m] and time t [s]."""
        check_axes(self, points.shape[1], "the expression")
        places = dict(zip("xyz", points.T, strict=False))
        if isinstance(self.of, tuple):
            return np.column_stack(
                [np.broadcast_to(one(t, **places), len(points)) for one in self.of]
            )
        return np.array(np.broadcast_to(self.of(t, **places), len(points)))


def check_axes(node: Any, d: int, source: str) -> None:
    """Raise InputError where an expression has a coordinate beyond d dimensions.

    What a case holds may be one expression or several.
    """
    of = node.of if isinstance(node, Places) else node
    for one in of if isinstance(of, tuple) else (of,):
        if isinstance(one, Expression) and (beyond := one.used & {*"xyz"[d:]}):
            raise InputError(
                f"{source} {quote(one.text)} has {min(beyond)}, and a model of dimension {d} has "
                f"only {', '.join('xyz'[:d])}: use these only"
            )


def _run(program: Any, values: Mapping[str, Any]) -> Any:
    stack: list[Any] = []
    with np.errstate(all="ignore"):
        for one in program:
            if isinstance(one, tuple):
                stack[-one[1] :] = [one[0](*stack[-one[1] :])]
            else:
                stack.append(values[one] if isinstance(one, str) else np.float64(one))
    return stack[0]
