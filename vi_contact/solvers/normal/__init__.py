"""Solve for normal reactions on the contact points: the linear complementarity problem."""

from ...core.lazy import lazy

_CONTENTS = {
    "active_set": ("ActiveSet",),
    "hildreth": ("Hildreth",),
    "lemke": ("Lemke",),
    "uniqueness": ("PMatrix", "p_matrix"),
}
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
