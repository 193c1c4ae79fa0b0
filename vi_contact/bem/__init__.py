"""Solve plane elastodynamics by space-time boundary elements (Aimi, Di Credico, Gimperlein 2024), without DOLFINx.

In this order: a ``BoundaryMesh``, ``energetic_blocks``, ``PoincareSteklov``, ``BoundaryProblem``, ``BoundaryContact``,
``march_contact``. Theory and an example: docs/theory/bem.md; ready problems: ``models/boundary_elements.py``.
>>> from vi_contact.bem import circle
>>> round(circle(radius=1.0, count=64).area, 3)  # of the polygon, m²
3.137
"""

from .boundary_mesh import BoundaryMesh, circle, from_segments, polygon
from .boundary_operators import Galerkin, OperatorMatrices
from .contact import BoundaryContact, Conditions, conditions_on
from .contact_run import ContactLedger, ContactRun, ledger, march_contact
from .convolution_operator import ConvolutionOperator, convolution_operator
from .convolution_quadrature import Frequencies
from .energetic import EnergeticBlocks, energetic_blocks
from .fundamental_solution import LaplaceKernels, TimeKernels
from .interior import interior_displacement
from .loads import traction_forces
from .poincare_steklov import BoundaryMotion, BoundaryProblem, CondensedCompliance, PoincareSteklov
from .quadrature import Orders
from .radial_table import RadialTable
from .storage import stored_blocks
from .two_bodies import TwoBodies
from .uzawa_space_time import SpaceTimeUzawa

__all__ = [
    "BoundaryContact", "BoundaryMesh", "BoundaryMotion", "BoundaryProblem", "CondensedCompliance", "Conditions",
    "ContactLedger", "ContactRun", "ConvolutionOperator", "EnergeticBlocks", "Frequencies", "Galerkin",
    "LaplaceKernels", "OperatorMatrices", "Orders", "PoincareSteklov", "RadialTable", "SpaceTimeUzawa", "TimeKernels",
    "TwoBodies", "circle", "conditions_on", "convolution_operator", "energetic_blocks", "from_segments",
    "interior_displacement", "ledger", "march_contact", "polygon", "stored_blocks", "traction_forces",
]
