"""Every limit that an annotation of a public class or function marks is checked, and told with its
meaning, its unit and what to give."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterator
from typing import Any, get_args

import pytest

pytest.importorskip("dolfinx")

from public_callables import callables, right

from vi_contact.core.arguments import _check_quantity, fits
from vi_contact.core.errors import InputError
from vi_contact.core.quantities import Between, Quantity, read_quantities
from vi_contact.practice.engineering import checks
from vi_contact.practice.studies.cases.vocabulary import _FUNCTIONS

pytestmark = pytest.mark.serial
BEHIND = {  # checked behind what needs a body, which the tests of these have
    "fem.Dashpots",
    "fem.CompliantBase",
    "soil.FreeField",
    "bem.CondensedCompliance",
    "bem.MultiplierMesh",
    "bem.PoincareSteklov",
    "bem.march_contact",
}


def marked() -> Iterator[tuple[str, Callable[..., Any], str, Quantity]]:
    """(room.name, function or class, argument, what is said of it) of all limits of public
    names."""
    cases = [
        (f"case files.{one.__name__}", one)
        for words in _FUNCTIONS.values()
        for one in (found() for found in words.values())
        if inspect.isfunction(one) and one.__module__.endswith("vocabulary")
    ]
    of_checks = [(f"checks.{one}", getattr(checks, one)) for one in checks.__all__]
    for name, found in [*callables(), *of_checks, *cases]:
        plain = inspect.isclass(found) and not hasattr(found, "__dataclass_fields__")
        said = read_quantities(found.__init__ if plain else found)  # type: ignore[misc]
        for argument in inspect.signature(found).parameters if said else ():
            if argument in said and said[argument].limit is not None:
                yield name, found, argument, said[argument]


def beyond(limit: Between) -> list[float]:
    """NaN and numbers just beyond both ends."""
    found = [math.nan, math.inf, -math.inf]
    if math.isfinite(limit.low):
        found += [limit.low - 1.0] + [limit.low] * (limit.ends[0] == "(")
    if math.isfinite(limit.high):
        found += [limit.high * 2 + 1.0] + [limit.high] * (limit.ends[1] == ")")
    return found


def within(asked: Quantity, name: str, values: dict[str, Any]) -> Any:
    """A value that an argument takes."""
    limit, kinds = asked.limit, (*get_args(asked.kind), asked.kind)
    tried = [values[name]] if name in values else []
    for one in [*tried, 1.0, 0.3, 0.75, 12, (1.0,), "a", True, print, []]:
        if fits(one, asked.kind) and (
            limit is None or not isinstance(one, float | int) or limit.holds(one)
        ):
            return one
    return object.__new__(next(one for one in kinds if inspect.isclass(one)))


def test_every_limit_of_an_annotation_is_told() -> None:
    values, count, defects = right(), 0, []
    for name, found, argument, asked in marked():
        count += 1
        limit = asked.limit
        assert limit is not None
        whole = int in (asked.kind, *get_args(asked.kind))
        alone = fits(1, asked.kind)
        for wrong in [one if alone else (1.0, one) for one in beyond(limit)]:
            try:
                if name in BEHIND:
                    _check_quantity(name, argument, wrong, asked)
                else:
                    call(found, argument, wrong, values)
                defects.append(f"{name}({argument}={wrong}) is taken")
            except InputError as error:
                if asked.describe(argument) not in str(error) or limit.in_words(whole) not in str(
                    error
                ):
                    defects.append(f"{name}({argument}={wrong}): {error}")
            except Exception as error:  # what is made without a body may raise anything
                defects.append(f"{name}({argument}={wrong}): {type(error).__name__} {error}")
    assert not defects, "\n".join(defects)
    assert count > 180


def call(found: Callable[..., Any], argument: str, wrong: Any, values: dict[str, Any]) -> None:
    """Call with one wrong argument and those that are needed."""
    said = read_quantities(found)
    parameters = inspect.signature(found).parameters.values()
    given = {
        one.name: within(said.get(one.name, Quantity(Any)), one.name, values)
        for one in parameters
        if one.default is one.empty and one.name != argument
    }
    found(**(given | {argument: wrong}))
