"""Every room with public names gives them, and the example of its docstring prints what it says."""

import doctest
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

import vi_contact

pytestmark = pytest.mark.serial
ROOMS = sorted(path.parent.name for path in Path(vi_contact.__file__).parent.glob("*/__init__.pyi"))


@pytest.mark.parametrize("name", ROOMS)
def test_a_room_keeps_what_it_says(name):
    room = import_module(f"vi_contact.{name}")
    import_module("vi_contact.run.simulate")  # a module that is called like a name of its room
    assert doctest.testmod(room, globs={}).failed == 0
    assert room.__all__ and all(is_there(room, public) for public in room.__all__)


def is_there(room, public):
    """Whether a public name is there and is not the module that is called like it."""
    return not isinstance(getattr(room, public), ModuleType)
