"""Hold the contract between schemes and solvers, and what everything stands on.

Read ``step.py`` first: ``Scheme``, ``Solver``, ``Recorder`` and the values between them. A ``ContactProblem`` is a
``SemiDiscreteSystem`` (M, C, K, loads) with a ``ContactSurface``; ``verify.py`` judges. See docs/theory/routes.md."""

from .lazy import lazy

_CONTENTS = {
    "certificate": ("Certificate",),
    "errors": ("InputError", "Interrupted", "OutOfTime", "StepFailure", "ViContactError"),
    "obstacles": ("AnalyticGap", "HalfSpace", "Obstacle", "Touching"),
    "problem": ("ContactProblem",),
    "protocols": ("Excitation", "Frictionless", "FrictionLaw", "ImpactLaw", "MassLaw"),
    "step": ("PreparedSolver", "Recorder", "Report", "Scheme", "Solver", "State", "StepProblem", "StepResult"),
    "surfaces": ("ContactSurface",),
    "system": ("Companion", "Load", "SemiDiscreteSystem"),
    "verify": ("energy_balance", "kkt_residual"),
}
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
