from .arch import ArchMesh as ArchMesh
from .ball import BallMesh as BallMesh
from .block import BlockMesh as BlockMesh
from .bricks import BricksMesh as BricksMesh
from .channel import ChannelMesh as ChannelMesh
from .cut import CutOpen as CutOpen
from .cut import Welded as Welded
from .cut_apart import CutApart as CutApart
from .drums import DrumsMesh as DrumsMesh
from .geo_file import GeoFile as GeoFile
from .masonry import MasonryMesh as MasonryMesh
from .two_blocks import Blocks as Blocks
from .two_blocks import TwoBlocks as TwoBlocks
from .wall import WallMesh as WallMesh

__all__: list[str]
