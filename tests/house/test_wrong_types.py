"""Every public function and class, with a value of a wrong type for each of its arguments in turn:
a sentence, or an answer; never another exception."""

from __future__ import annotations

import inspect
import re
import traceback
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from public_callables import callables, right

import vi_contact as vc
from vi_contact import ground_motion, laws, meshes, run, studies
from vi_contact.core.arguments import check_arguments, check_fields, check_type, describe_type, fits
from vi_contact.core.errors import InputError

pytestmark = pytest.mark.serial
ROOT = Path(vc.__file__).parent
LONGEST = 900


class Odd:
    """An object of a class that nothing asks for."""


WRONG: list[Any] = [
    None,
    "abc",
    3,
    float("nan"),
    [],
    Odd(),
    "a\0b",
    -1.0,
    {},
    np.array([1.0, np.nan]),
    object,
    b"x",
]
EXEMPT = {  # name -> why
    "StepProblem": (
        "made by schemes in every step; solvers check what they are given by its protocol"
    ),
    "energy_balance": "called in every step with what a scheme has made",
    "kkt_residual": "called in every step with what scheme and solver have made",
    "Metric": "an enumeration, whose members are written by their names",
    "Check": "an abstract class, which Python refuses to make",
}


def calls(
    found: Callable[..., Any], values: dict[str, Any]
) -> Iterator[tuple[str, Any, list[Any], dict[str, Any]]]:
    """(argument, wrong value, positional and named arguments of a call)."""
    kinds = inspect.Parameter
    try:
        parameters = inspect.signature(found).parameters.values()
    except ValueError:  # a dictionary by another name (Tags), which takes what dictionaries take
        return
    every = [one for one in parameters if one.kind not in (kinds.VAR_POSITIONAL, kinds.VAR_KEYWORD)]
    for one in every:
        for wrong in WRONG:
            given = {
                other.name: values.get(other.name, 1.0)
                for other in every
                if other.default is other.empty
            }
            given[one.name] = wrong
            first = [
                given.pop(other.name)
                for other in every
                if other.kind is kinds.POSITIONAL_ONLY and other.name in given
            ]
            yield one.name, wrong, first, given


def defect(found: Callable[..., Any], first: list[Any], given: dict[str, Any]) -> str:
    """What is wrong with the answer: another exception than InputError, or one of several lines;
    else empty."""
    try:
        found(*first, **given)
    except InputError as error:
        text = str(error)
        return (
            ""
            if "\n" not in text and len(text.split()) > 3 and len(text) < LONGEST
            else f"no sentence: {text!r}"
        )
    except Exception as error:  # what the interface must never raise here
        place = traceback.extract_tb(error.__traceback__)[-1]
        return (
            f"{type(error).__name__}: {str(error)[:100]} ({Path(place.filename).name}, line "
            f"{place.lineno})"
        )
    return ""


@pytest.mark.fuzz
def test_a_wrong_type_is_one_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("dolfinx")
    pytest.importorskip("matplotlib")
    monkeypatch.chdir(tmp_path)
    count, values, defects = 0, right(), []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name, found in callables():
            if name.split(".")[1] in EXEMPT:
                continue
            for argument, wrong, first, given in calls(found, values):
                count += 1
                if said := defect(found, first, given):
                    defects.append(f"{name}({argument}={wrong!r:.30}) -> {said}")
    assert not defects, "\n".join(defects[:60])
    assert count > 9000


def test_a_raw_exception_is_found() -> None:
    """The test can fail: a function that does not look at its argument."""
    values = right()
    naive = [
        defect(lambda record: record.dt, *rest)
        for _, _, *rest in calls(lambda record: record, values)
    ]
    assert sum(map(bool, naive)) == len(WRONG) and all("AttributeError" in said for said in naive)


RAW: dict[str, tuple[Callable[[], Any], str]] = {
    "periods": (
        lambda: ground_motion.response_spectrum(right()["record"], "abc"),
        "periods is 'abc'; give real n",
    ),
    "seed": (
        lambda: ground_motion.synthetic(ground_motion.KanaiTajimi(s0=0.01), 2.0, 0.01, seed="a"),
        "seed is 'a'",
    ),
    "no record": (lambda: ground_motion.read_record(None), "path is None; give a path"),
    "a number for a record": (lambda: ground_motion.read_record(3), "path is 3; give a path"),
    "a number for a run": (lambda: run.read_run(3), "folder is 3; give a path"),
    "NUL in out": (
        lambda: vc.simulate(right()["problem"], dt=0.01, steps=1, out="a\0b"),
        r"out is 'a\\x00b'",
    ),
    "height": (lambda: meshes.WallMesh(height="9"), "height is '9'; give a real number"),
    "folder of a case": (lambda: studies.read_case(3), "path is 3; give a path"),
    "a class": (lambda: ground_motion.pga(ground_motion.Record), "record is the class Record"),
    "a law": (lambda: laws.Coulomb(mu="0.3"), "mu"),
}


@pytest.mark.parametrize("name", RAW)
def test_the_sentence_names_argument_and_value(name: str) -> None:
    call, text = RAW[name]
    with pytest.raises(InputError, match=text):
        call()


def test_types_as_annotations_have_them() -> None:
    from collections.abc import Mapping, Sequence

    for value, kind, fit in [
        (1, float, True),
        (np.float64(1.0), float, True),
        (np.array(2.0), float, True),
        (True, float, False),
        ("1", float, False),
        (float("nan"), float, True),
        (3.0, int, True),
        (3.5, int, False),
        (None, int, False),
        ([1, 2], Sequence[float], True),
        ("ab", Sequence[str], False),
        (["a"], Sequence[float], False),
        (np.arange(3), Sequence[float], True),
        ((1, 2), tuple[int, int], True),
        ((1,), tuple[int, int], False),
        ((1, 2, 3), tuple[float, ...], True),
        ({"a": 1}, Mapping[str, float], True),
        ({1: 1}, Mapping[str, int], False),
        ("x", str | Path, True),
        ("x\0", str | Path, False),
        ("", str | Path, False),
        (None, float | None, True),
        (print, Callable[[], Any], True),
        (3, Callable[[], Any], False),
        (Odd, Odd, False),
        (Odd(), Odd, True),
        (np.array([1.0]), np.ndarray, True),
        ("abc", np.ndarray, False),
        ([[1], [1, 2]], np.ndarray, False),
    ]:
        assert fits(value, kind) == fit, (value, kind)
        if not fit:
            with pytest.raises(InputError, match="it: x is .*; give "):
                check_type("it", "x", value, kind)
    assert describe_type(float | None) == "a real number or None"
    assert describe_type(str | Path) == "a path"


def test_what_is_checked_keeps_its_face() -> None:
    """Name, text and signature, which pages of names and case files read; arguments that are wrong
    by name stay."""

    @check_arguments
    def one(x: float, *, name: str = "a") -> float:
        """Return x."""
        return x

    assert one.__name__ == "one" and one.__doc__ == "Return x."
    assert str(inspect.signature(one)).startswith("(x: 'float'")
    assert one(2.0) == 2.0
    with pytest.raises(TypeError):
        one(2.0, nothing=1)  # type: ignore[call-arg]
    assert (
        re.match("EC8", ground_motion.EC8Spectrum.__name__)
        and check_fields(meshes.WallMesh()) is None
    )
