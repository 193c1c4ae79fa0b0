"""Old paths of rooms: they give the same modules, with a warning, in a process of their own."""

from __future__ import annotations

import subprocess
import sys

import pytest

pytestmark = pytest.mark.serial


def printed(script: str) -> str:
    """Return what a fresh process prints."""
    done = subprocess.run(
        [sys.executable, "-W", "always", "-c", script], capture_output=True, text=True, check=True
    )
    return done.stdout + done.stderr


def test_an_old_path_gives_the_same_module_and_a_warning() -> None:
    """A file within a room too; what one path has loaded is not loaded again by the other."""
    text = printed(
        "import vi_contact.ground_motion.record as old\n"
        "import vi_contact.practice.ground_motion.record as new\n"
        "from vi_contact.ground_motion import read_record\n"
        "print(old is new, new.__spec__.name, read_record.__module__)"
    )
    name = "vi_contact.practice.ground_motion.record"
    assert f"True {name} vi_contact.practice.ground_motion" in text
    assert "DeprecationWarning: vi_contact.ground_motion is now" in text


def test_a_room_of_the_package_is_handed_on_without_a_warning() -> None:
    text = printed(
        "import vi_contact\n"
        "from vi_contact import ground_motion, soil\n"
        "print(vi_contact.soil is soil, soil.__name__, ground_motion.__name__)"
    )
    assert text == "True vi_contact.practice.soil vi_contact.practice.ground_motion\n"


def test_a_path_that_never_was_is_not_found() -> None:
    with pytest.raises(ModuleNotFoundError):
        __import__("vi_contact.soils")
