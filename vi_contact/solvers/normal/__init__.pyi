from .active_set import ActiveSet as ActiveSet
from .hildreth import Hildreth as Hildreth
from .lemke import Lemke as Lemke
from .uniqueness import PMatrix as PMatrix
from .uniqueness import p_matrix as p_matrix
