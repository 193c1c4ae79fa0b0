"""Solve for normal reactions on the contact points: the linear complementarity problem."""

from ...core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
