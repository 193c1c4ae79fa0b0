"""Solve for normal and tangential reactions on the contact points, Tresca or Coulomb."""

from ...core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
