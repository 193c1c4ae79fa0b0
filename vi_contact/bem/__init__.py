"""Space-time boundary elements for plane elastodynamics (seed 003), with numpy and scipy only."""

from .boundary_mesh import BoundaryMesh, circle, from_segments, polygon, smooth_curve
from .boundary_operators import Galerkin, OperatorMatrices
from .convolution_operator import ConvolutionOperator, ConvolutionProblem, convolution_operator
from .convolution_quadrature import ConvolutionQuadrature, Frequencies
from .energetic import EnergeticBlocks, Marching, energetic_blocks
from .fundamental_solution import LaplaceKernels, TimeKernels
from .interior import interior_displacement
from .loads import traction_forces
from .operators import Operators
from .poincare_steklov import BoundaryMotion, BoundaryProblem, CondensedCompliance, PoincareSteklov
from .quadrature import Orders
from .radial_table import RadialTable
from .storage import load_blocks, save_blocks, stored_blocks
from .time_methods import BDF2, RadauIIA, TimeMethod, Trapezoid

__all__ = [
    "BDF2", "BoundaryMesh", "BoundaryMotion", "BoundaryProblem", "CondensedCompliance", "ConvolutionOperator",
    "ConvolutionProblem", "ConvolutionQuadrature", "EnergeticBlocks", "Frequencies", "Galerkin", "LaplaceKernels",
    "Marching", "OperatorMatrices", "Operators", "Orders", "PoincareSteklov", "RadauIIA", "RadialTable",
    "TimeKernels", "TimeMethod", "Trapezoid", "circle", "convolution_operator", "energetic_blocks", "from_segments",
    "interior_displacement", "load_blocks", "polygon", "save_blocks", "smooth_curve", "stored_blocks",
    "traction_forces",
]
