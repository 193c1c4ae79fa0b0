# ruff: noqa
# Made from __init__.py by docs/make_api.py, for checkers of types and editors.
from .contact_law import ContactLayer as ContactLayer
from .contact_law import contact_layer as contact_layer
from .layer import Layer as Layer
from .metric import Metric as Metric
from .motion import ConstrainedSystem as ConstrainedSystem
from .particle import ParticleImpact as ParticleImpact
from .particle import layer_for as layer_for
from .scheme import BoundaryLayer as BoundaryLayer
from .trajectory import layer_motion as layer_motion

__all__: list[str] = ['BoundaryLayer', 'ConstrainedSystem', 'ContactLayer', 'Layer', 'Metric', 'ParticleImpact', 'contact_layer', 'layer_for', 'layer_motion']
