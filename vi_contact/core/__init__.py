"""Hold the contract between schemes and solvers, and what everything stands on.

Read ``step.py`` first: ``Scheme``, ``Solver``, ``Recorder`` and the values between them. A
``ContactProblem`` is a ``SemiDiscreteSystem`` (M, C, K, loads) with a ``ContactSurface``;
``verify.py`` judges. See docs/theory/routes.md.
"""

from .lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
