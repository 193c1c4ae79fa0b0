"""Name what is marched beside a run: systems and surfaces hold such companions and import this."""

from typing import Any, Protocol


class Companion(Protocol):
    """Provide a motion among the loads that is marched beside the run: of the ground, or of a free field."""

    def bind(self, scheme: Any, dt: Any) -> None:
        """Take over ``scheme``, a ``core.step.Scheme``, and the time steps ``dt`` [s] of the run that is about to step.

        Called on every rank before each base step, so binding the same again must change nothing; another scheme or
        other steps begin the motion anew, from rest at t = 0. ``dt`` is a number or a plan of ``run.time_steps``.
        InputError for a plan that the motion cannot follow.
        """
