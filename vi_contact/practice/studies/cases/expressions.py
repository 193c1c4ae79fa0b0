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

LENGTH = 500  # characters of a text, at most
DEPTH = 20  # of brackets in each other
POWER = 100  # of an exponent that is a number
_WORD = re.compile(r"(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?|[A-Za-z]\w*|[-+*/^(),]", re.ASCII)
_WITHOUT_SIGN = re.compile(r"[\w.)]\s+([A-Za-z]\w*)", re.ASCII)  # as kN in "9.81*y kN"
_Functions = Mapping[str, Callable[..., Any]]
_OF_ONE_VALUE: _Functions = {
    "sqrt": np.sqrt,
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "exp": np.exp,
    "log": np.log,
    "abs": np.abs,
    "step": lambda a: np.heaviside(a, 1.0),
}
_OPERATIONS: _Functions = {
    "Add": np.add,
    "Sub": np.subtract,
    "Mult": np.multiply,
    "Div": np.divide,
    "Pow": np.power,
}
_OF_SEVERAL_VALUES: _Functions = {"min": np.minimum, "max": np.maximum}


@dataclass(frozen=True)
class Expression:
    """Hold arithmetic of these variables; step(a) is 1 from a = 0 on and 0 before.

    Called with the time and values of the other variables, which may be arrays, it returns its own;
    NaN where there is none, as of the root of a negative number.

    Attributes:
        text: the arithmetic, as "9810*max(0, 35 - y)".
        variables: letters that may occur in it, of x, y, z and t.
        program: numbers, variables and (function, count of its values), in the order in which a
            stack works them off.

    Raises:
        InputError: with what is wrong in the text.
    """

    text: str
    variables: str = ""
    program: tuple[Any, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if len(self.text) > LENGTH:
            raise InputError(f"it has {len(self.text)} characters, and {LENGTH} are the most")
        # What is left when all words of arithmetic are taken out does not belong to it.
        strange = _WORD.sub("", self.text).strip()
        if strange:
            raise InputError(f"'{strange[0]}' in it does not belong to arithmetic")

        # The words alone go to Python's parser, which runs nothing.
        words = " ".join(word[0] for word in _WORD.finditer(self.text))
        try:
            tree = ast.parse(words.replace("^", "**").strip(), mode="eval").body
        except (SyntaxError, RecursionError, MemoryError):
            # MemoryError: the parser's stack is full
            lone = _WITHOUT_SIGN.search(self.text)
            if lone is not None:
                raise InputError(
                    f"'{lone[1]}' in it has no sign before it: give one, or leave it out if it is "
                    "a unit, as arithmetic with variables is in SI units"
                ) from None
            raise InputError("its brackets, signs or commas are not arithmetic") from None
        object.__setattr__(self, "program", tuple(self._compile(tree, 0)))

    @property
    def used(self) -> frozenset[str]:
        """Return the variables that occur in it."""
        return frozenset(word for word in self.program if isinstance(word, str))

    def __call__(self, t: float = 0.0, **places: Any) -> Any:
        """Return the value at time t [s] and these values of the other variables."""
        return _run(self.program, {"t": t, **places})

    def _compile(self, node: Any, depth: int) -> Iterator[Any]:
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
            yield from self._compile(node.operand, depth + 1)
            if isinstance(node.op, ast.USub):
                yield np.negative, 1
        elif isinstance(node, ast.BinOp):
            yield from self._compile_operation(node, depth)
        elif isinstance(node, ast.Call) and name in _select_functions(len(node.args)):
            yield from self._compile_call(node, name, depth)
        else:
            letters = "".join(f", {letter}" for letter in self.variables)
            raise InputError(
                f"'{name or ast.unparse(node)[:20]}' in it is not a number{letters}, pi or one of "
                f"{', '.join((*_OF_ONE_VALUE, *_OF_SEVERAL_VALUES))} with its values in brackets"
            )

    def _compile_operation(self, node: ast.BinOp, depth: int) -> Iterator[Any]:
        """Yield the program of an operation with two operands."""
        # A sum or product of many terms leans to the left: its length is no depth.
        chain = isinstance(node.op, ast.Add | ast.Sub | ast.Mult | ast.Div)
        yield from self._compile(node.left, depth if chain else depth + 1)
        right = list(self._compile(node.right, depth + 1))
        if isinstance(node.op, ast.Pow):
            if any(isinstance(word, str) for word in right):
                raise InputError("an exponent has a variable: write a^x as exp(x*log(a))")
            if not abs(_run(right, {})) <= POWER:  # NaN is refused, too
                raise InputError(f"an exponent is larger than {POWER}")
        yield from (*right, (_OPERATIONS[type(node.op).__name__], 2))

    def _compile_call(self, node: ast.Call, name: str, depth: int) -> Iterator[Any]:
        """Yield the program of the call of a function."""
        yield from self._compile(node.args[0], depth + 1)
        for argument in node.args[1:]:
            yield from self._compile(argument, depth + 1)
            yield _OF_SEVERAL_VALUES[name], 2
        if name in _OF_ONE_VALUE:
            yield _OF_ONE_VALUE[name], 1


def _select_functions(count: int) -> _Functions:
    """Return the functions that take so many values."""
    if count > 1:
        return _OF_SEVERAL_VALUES
    return _OF_ONE_VALUE if count == 1 else {}


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

    Called with points (k, d) [m] and the time [s], it returns (k,) of one, (k, n) of n.

    Raises:
        InputError: for axes beyond d.
    """

    expressions: Expression | tuple[Expression, ...]

    def __call__(self, points: Array, t: float = 0.0) -> Array:
        """Return the values (k,) or (k, n) at points (k, d) [m] and time t [s]."""
        check_axes(self, points.shape[1], "the expression")
        places = dict(zip("xyz", points.T, strict=False))
        count = len(points)
        if isinstance(self.expressions, tuple):
            columns = [np.broadcast_to(one(t, **places), count) for one in self.expressions]
            return np.column_stack(columns)
        return np.array(np.broadcast_to(self.expressions(t, **places), count))


def check_axes(node: Any, d: int, source: str) -> None:
    """Raise InputError where an expression has a coordinate beyond d dimensions.

    Args:
        node: a value of a case; it holds one expression, several, or none.
        d: dimension of the model.
        source: the beginning of the sentence.
    """
    expressions = node.expressions if isinstance(node, Places) else node
    beyond = {*"xyz"[d:]}
    for expression in expressions if isinstance(expressions, tuple) else (expressions,):
        if isinstance(expression, Expression) and expression.used & beyond:
            raise InputError(
                f"{source} {quote(expression.text)} has {min(expression.used & beyond)}, and a "
                f"model of dimension {d} has only {', '.join('xyz'[:d])}: use these only"
            )


def _run(program: Any, values: Mapping[str, Any]) -> Any:
    """Return what a program leaves on its stack, for these values of its variables."""
    stack: list[Any] = []
    with np.errstate(all="ignore"):  # NaN and infinity are answers
        for word in program:
            if isinstance(word, tuple):
                function, count = word
                stack[-count:] = [function(*stack[-count:])]
            else:
                stack.append(values[word] if isinstance(word, str) else np.float64(word))
    return stack[0]
