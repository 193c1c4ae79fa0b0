# ruff: noqa
# The public names of this package: one line each, here only. docs/make_api.py sorts them and writes
# __all__.
from .block import BlockMesh as BlockMesh
from .channel import ChannelMesh as ChannelMesh
from .cut import CutOpen as CutOpen
from .cut import Welded as Welded
from .geo_file import GeoFile as GeoFile
from .two_blocks import Blocks as Blocks
from .two_blocks import TwoBlocks as TwoBlocks
from .wall import WallMesh as WallMesh

__all__: list[str] = [
    "BlockMesh",
    "Blocks",
    "ChannelMesh",
    "CutOpen",
    "GeoFile",
    "TwoBlocks",
    "WallMesh",
    "Welded",
]
