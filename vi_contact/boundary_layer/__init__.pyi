# ruff: noqa
# Made from __init__.py by docs/make_api.py, for checkers of types and editors.
from .layer import Layer as Layer
from .metric import Metric as Metric
from .motion import ConstrainedSystem as ConstrainedSystem
from .particle import ParticleImpact as ParticleImpact
from .particle import layer_for as layer_for
from .trajectory import layer_motion as layer_motion

__all__: list[str] = ['ConstrainedSystem', 'Layer', 'Metric', 'ParticleImpact', 'layer_for', 'layer_motion']
