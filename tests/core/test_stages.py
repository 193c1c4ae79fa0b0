"""Stages of setting up tell how long they took."""

from __future__ import annotations

import sys

import pytest

from vi_contact.core import stages

pytestmark = pytest.mark.serial


def test_a_long_stage_is_told_at_the_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Longer than a second, and only where it is wanted; nothing of a stage that fails."""
    times = iter((0.0, 2.0, 10.0, 10.5, 20.0, 22.0, 30.0, 32.0, 40.0))
    monkeypatch.setattr(stages.time, "perf_counter", lambda: next(times))
    stages.done()
    for shown, terminal in ((True, True), (True, True), (True, False), (False, True)):
        monkeypatch.setattr(sys.stderr, "isatty", lambda terminal=terminal: terminal)
        stages.show(shown)
        assert stages.stage("meshing")(lambda x: x + 1)(1) == 2
    with pytest.raises(ZeroDivisionError):
        stages.stage("dividing")(lambda: 1 / 0)()
    assert capsys.readouterr().err == "vi-contact: meshing 2 s\n"
    assert (
        stages.done() == "meshing 2 s, meshing 0.5 s, meshing 2 s, meshing 2 s"
        and stages.done() == ""
    )
