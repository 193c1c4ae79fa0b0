"""Space-time boundary elements for plane elastodynamics (seed 003), with numpy and scipy only."""

from .boundary_mesh import BoundaryMesh, circle, from_segments, polygon, smooth_curve
from .boundary_operators import Galerkin, OperatorMatrices
from .energetic import EnergeticBlocks, Marching, energetic_blocks
from .fundamental_solution import LaplaceKernels, TimeKernels
from .loads import traction_forces
from .operators import Operators
from .poincare_steklov import BoundaryMotion, BoundaryProblem, CondensedCompliance, PoincareSteklov
from .quadrature import Orders
from .storage import load_blocks, save_blocks, stored_blocks

__all__ = [
    "BoundaryMesh", "BoundaryMotion", "BoundaryProblem", "CondensedCompliance", "EnergeticBlocks", "Galerkin",
    "LaplaceKernels", "Marching", "OperatorMatrices", "Operators", "Orders", "PoincareSteklov", "TimeKernels",
    "circle", "energetic_blocks", "from_segments", "load_blocks", "polygon", "save_blocks", "smooth_curve",
    "stored_blocks", "traction_forces",
]
