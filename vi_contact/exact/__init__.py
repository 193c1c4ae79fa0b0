"""Hold exact solutions, closed forms that tests, demos and users compare a computation with.

Each is a value of its data, with functions of time and place; its file has equations and source. Begin with ``bar.py``.
>>> from vi_contact.exact import ThrownBar
>>> print(ThrownBar().contact_start, round(ThrownBar().contact_end, 6))  # s: length 10 m, waves of 30 m/s
0.5 1.166667
"""

from ..core.lazy import lazy

_CONTENTS = {
    "bar": ("PeriodicBar", "ThrownBar"),
    "bouncing_bar": ("BouncingBar",),
    "hertz": ("HertzImpact", "HertzPoint", "contact_modulus", "contact_radius"),
    "housner": ("HousnerBlock",),
    "surface_waves": ("dashpot_energy", "dashpot_reflection"),
}
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
