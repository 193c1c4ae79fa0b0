"""Checks of arguments: what passes comes back in its type, what does not is named in one
sentence."""

from __future__ import annotations

import math

import numpy as np
import pytest

from vi_contact.core import checks
from vi_contact.core.errors import InputError

pytestmark = pytest.mark.serial
HUGE = 10**5000  # more digits than a float holds and Python prints


def test_what_is_no_number_is_named():
    for value in ("1", None, True, np.bool_(True), math.nan, math.inf, HUGE, 1j, [1.0], np.ones(1)):
        with pytest.raises(
            InputError, match=r"^Beam: its length is .*; give a finite number in m$"
        ):
            checks.number("Beam", "its length", value, unit="m")


def test_numbers_come_back_as_floats_and_signs_are_asked_for():
    for value in (2, 2.0, np.float32(2.0), np.int64(2)):
        found = checks.number("Beam", "its length", value, positive=True)
        assert type(found) is float and found == 2.0
    assert checks.number("Beam", "its gap", 0, not_negative=True) == 0.0
    with pytest.raises(InputError, match="Beam: its length is 0; give a finite number above zero"):
        checks.number("Beam", "its length", 0, positive=True)
    with pytest.raises(
        InputError, match=r"Beam: its gap is -1\.0; give zero or a positive finite number"
    ):
        checks.number("Beam", "its gap", -1.0, not_negative=True)


def test_whole_numbers():
    for value in (3, 3.0, np.int32(3)):
        found = checks.whole("march", "steps", value)
        assert type(found) is int and found == 3
    for value in (2.5, -1, math.inf, math.nan, "3", True, HUGE):
        with pytest.raises(
            InputError, match="march: steps is .*; give a whole number of at least 0 and at most 9"
        ):
            checks.whole("march", "steps", value, most=9)


def test_a_class_is_no_object():
    with pytest.raises(
        InputError, match=r"is the class ValueError; make an object of it, ValueError\(…\), or give"
    ):
        checks.instance("run", "the error", ValueError, ValueError, "give an error")
    with pytest.raises(InputError, match="run: the error is 'text'; give an error"):
        checks.instance("run", "the error", "text", (ValueError, TypeError), "give an error")
    error = ValueError()
    assert checks.instance("run", "the error", error, ValueError, "give an error") is error


def test_protocols_are_asked_for_their_names():
    assert checks.provides("run", "the list", [], ("append", "pop"), "give a list") == []
    for value in (list, 3, None):
        with pytest.raises(InputError, match="run: the list is .*give a list"):
            checks.provides("run", "the list", value, ("append", "pop"), "give a list")


def test_arrays_have_shapes_and_finite_numbers():
    found = checks.array("state", "u", [1, 2], (2,))
    assert found.dtype == float and np.array_equal(found, [1.0, 2.0])
    assert checks.array("state", "u", np.ones((3, 2)), (None, 2)).shape == (3, 2)
    with pytest.raises(
        InputError, match=r"state: u has shape \(2,\); give numbers of shape \(3,\)"
    ):
        checks.array("state", "u", [1, 2], (3,))
    with pytest.raises(InputError, match=r"state: u is nan at \(1,\); give finite numbers"):
        checks.array("state", "u", [1, math.nan], (2,))
    for value in ("text", [1j], [[1], [1, 2]], None, [True]):
        with pytest.raises(InputError, match=r"state: u is .*; give real numbers of shape \(2,\)"):
            checks.array("state", "u", value, (2,))


def test_long_and_broken_values_are_shown_on_one_line():
    class Broken:
        def __repr__(self) -> str:
            raise RuntimeError("no")

    assert checks.quote(Broken()) == "an object of type Broken"
    assert checks.quote(HUGE) == "an object of type int"
    assert len(checks.quote(np.arange(1000.0))) == checks.SHOWN and "\n" not in checks.quote("a\nb")
