from .ball import BallMesh as BallMesh
from .block import BlockMesh as BlockMesh
from .channel import ChannelMesh as ChannelMesh
from .cut import CutOpen as CutOpen
from .cut import Welded as Welded
from .geo_file import GeoFile as GeoFile
from .two_blocks import Blocks as Blocks
from .two_blocks import TwoBlocks as TwoBlocks
from .wall import WallMesh as WallMesh

__all__: list[str]
