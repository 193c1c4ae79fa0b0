"""Parts of setting up tell how long they took."""

from __future__ import annotations

import sys

import pytest

from vi_contact.core import timing

pytestmark = pytest.mark.serial


def test_a_long_part_is_told_at_the_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Longer than a second, and only where it is wanted; nothing of a stage that fails."""
    times = iter((0.0, 2.0, 10.0, 10.5, 20.0, 22.0, 30.0, 32.0, 40.0))
    monkeypatch.setattr(timing.time, "perf_counter", lambda: next(times))
    timing.take_report()
    for shown, terminal in ((True, True), (True, True), (True, False), (False, True)):
        monkeypatch.setattr(sys.stderr, "isatty", lambda terminal=terminal: terminal)
        timing.show_on_terminal(shown)
        assert timing.report_time("meshing")(lambda x: x + 1)(1) == 2
    with pytest.raises(ZeroDivisionError):
        timing.report_time("dividing")(lambda: 1 / 0)()
    assert capsys.readouterr().err == "vi-contact: meshing 2 s\n"
    assert (
        timing.take_report() == "meshing 2 s, meshing 0.5 s, meshing 2 s, meshing 2 s"
        and timing.take_report() == ""
    )
