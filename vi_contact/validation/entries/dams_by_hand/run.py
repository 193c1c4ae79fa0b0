"""Set the two dams of calculation.md on rigid rock: the model is that of the entry ``dam``."""

from vi_contact.validation.entries.dam.run import UNITS, draw, figures

__all__ = ["UNITS", "draw", "figures"]
