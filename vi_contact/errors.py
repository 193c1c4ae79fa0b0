"""The two ways a run stops early: wrong input, or a time step that no method could certify."""

from __future__ import annotations


class ViContactError(Exception):
    """Base of every error this package raises on purpose; the command line prints its one sentence and exits with 1."""


class InputError(ViContactError, ValueError):
    """The input is wrong. The message is one sentence that names the offending thing and the remedy."""


class StepFailure(ViContactError, RuntimeError):
    """A time step stayed above the certificate tolerance with every method; nothing computed before it is lost."""
