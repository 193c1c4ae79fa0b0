"""Hold exact solutions, closed forms that tests, demos and users compare a computation with.

Each is a value of its data, with functions of time and place; its file has equations and source. Upright bars against
a wall and Hertz's contact stand with the demos that show them: ``demos/exact``.
>>> from vi_contact.exact import HousnerBlock
>>> round(HousnerBlock(width=0.6, height=3.0).restitution, 6)  # of the angular velocity, from one corner to the other
0.942308
"""

from ..core.lazy import lazy

_CONTENTS = {"housner": ("HousnerBlock",)}
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
