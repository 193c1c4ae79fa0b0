"""Every room says how to use it, in words and in an example that runs, and lists its public
names."""

import doctest
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

import vi_contact

pytestmark = pytest.mark.serial
ROOMS = sorted(path.parent.name for path in Path(vi_contact.__file__).parent.glob("*/__init__.py"))
WITHOUT_EXAMPLE = {"core", "meshes", "run", "plots", "cli"}


@pytest.mark.parametrize("name", ROOMS)
def test_a_room_says_how_to_use_it(name):
    room = import_module(f"vi_contact.{name}")
    import_module("vi_contact.run.simulate")  # a module that is called like a name of its room
    assert 4 <= len([line for line in room.__doc__.splitlines() if line.strip()]) <= 9
    ran = doctest.testmod(room, globs={})
    assert ran.failed == 0 and (ran.attempted > 0) is (name not in WITHOUT_EXAMPLE)
    found = [getattr(room, public) for public in room.__all__]
    assert found and not any(isinstance(one, ModuleType) for one in found)
