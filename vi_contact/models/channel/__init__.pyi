# ruff: noqa
# Made from __init__.py by docs/make_api.py, for checkers of types and editors.
from .ends import Sides as Sides
from .model import Channel as Channel
from .model import ChannelModel as ChannelModel
from .model import Openings as Openings
from .model import SoilProbe as SoilProbe
from .model import build as build
from .model import staged as staged
from .model import weighted as weighted
from .sides import DashpotSides as DashpotSides
from .sides import Fixed as Fixed
from .sides import FreeFieldSides as FreeFieldSides
from .sides import RockBelow as RockBelow
from .sides import Rollers as Rollers
from .sides import TiedSides as TiedSides
from .sides import bedrock as bedrock

__all__: list[str] = ['Channel', 'ChannelModel', 'DashpotSides', 'Fixed', 'FreeFieldSides', 'Openings', 'RockBelow', 'Rollers', 'Sides', 'SoilProbe', 'TiedSides', 'bedrock', 'build', 'staged', 'weighted']
