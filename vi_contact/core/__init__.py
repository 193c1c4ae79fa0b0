"""Hold the contract between schemes and solvers, and what everything stands on. Read ``step`` first."""

from __future__ import annotations

from .lazy import lazy

_CONTENTS = {
    "errors": ("InputError", "Interrupted", "StepFailure", "ViContactError"),
    "problem": ("ContactProblem",),
    "protocols": ("Excitation", "Frictionless", "FrictionLaw", "ImpactLaw", "MassLaw"),
    "step": ("Certificate", "Recorder", "Report", "Scheme", "Solver", "State", "StepProblem", "StepResult"),
    "surfaces": ("AnalyticGap", "ContactSurface", "HalfSpace", "Touching"),
    "system": ("Load", "SemiDiscreteSystem"),
    "verify": ("energy_balance", "kkt_residual"),
}
__all__ = sorted(name for names in _CONTENTS.values() for name in names)
__getattr__, __dir__ = lazy(__name__, _CONTENTS)
