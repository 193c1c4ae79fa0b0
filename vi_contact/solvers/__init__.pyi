from .automatic import Automatic as Automatic
from .condensed import Condensed as Condensed
from .friction import *  # noqa: F403
from .iterative import *  # noqa: F403
from .normal import *  # noqa: F403
from .volume import *  # noqa: F403
