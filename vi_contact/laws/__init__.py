"""State how materials, friction, impacts, contact masses and the ground behave.

Take a material first; what is not given is frictionless and undamped. Your own laws:
docs/guide/extend.md.

>>> from vi_contact.laws import LinearElastic
>>> round(LinearElastic(E=2.0e10, nu=0.0, rho=2400.0).c_p)  # Pa, -, kg/m³; c_P in m/s
2887
"""

from ..core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
