"""March a step in time: one scheme a file, each a value that satisfies ``core.step.Scheme``."""

from __future__ import annotations

from ..core.lazy import lazy

_CONTENTS = {
    "contact_stabilised": ("ContactStabilisedNewmark",),
    "generalised_alpha": ("GeneralisedAlpha",),
    "hht": ("HHT",),
    "houbolt": ("Houbolt",),
    "linear_multistep": ("LinearMultistep",),
    "midpoint": ("Midpoint",),
    "moreau_jean": ("MoreauJean",),
    "newmark": ("Newmark",),
    "ss22": ("SS22",),
    "trapezoidal": ("Trapezoidal",),
    "zienkiewicz_wood_taylor": ("ZienkiewiczWoodTaylor",),
}
__all__, __getattr__, __dir__ = lazy(__name__, _CONTENTS)
