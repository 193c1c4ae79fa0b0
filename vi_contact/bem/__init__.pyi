# ruff: noqa
# The public names of this package: one line each, here only. docs/make_api.py sorts them and writes
# __all__.
from .boundary_mesh import BoundaryMesh as BoundaryMesh
from .boundary_mesh import circle as circle
from .boundary_mesh import polygon as polygon
from .boundary_operators import Galerkin as Galerkin
from .boundary_operators import OperatorMatrices as OperatorMatrices
from .compressed import CompressedBlocks as CompressedBlocks
from .contact import BoundaryContact as BoundaryContact
from .contact import Conditions as Conditions
from .contact import conditions_on as conditions_on
from .contact_run import ContactRun as ContactRun
from .contact_run import march_contact as march_contact
from .energetic import EnergeticBlocks as EnergeticBlocks
from .energetic import energetic_blocks as energetic_blocks
from .fundamental_solution import TimeKernels as TimeKernels
from .joined_bodies import TwoBodies as TwoBodies
from .loads import traction_forces as traction_forces
from .multiplier_mesh import MultiplierMesh as MultiplierMesh
from .poincare_steklov import BoundaryMotion as BoundaryMotion
from .poincare_steklov import BoundaryProblem as BoundaryProblem
from .poincare_steklov import CondensedCompliance as CondensedCompliance
from .poincare_steklov import PoincareSteklov as PoincareSteklov
from .quadrature import Orders as Orders
from .uzawa_space_time import SpaceTimeUzawa as SpaceTimeUzawa

__all__: list[str] = [
    "BoundaryContact",
    "BoundaryMesh",
    "BoundaryMotion",
    "BoundaryProblem",
    "CompressedBlocks",
    "CondensedCompliance",
    "Conditions",
    "ContactRun",
    "EnergeticBlocks",
    "Galerkin",
    "MultiplierMesh",
    "OperatorMatrices",
    "Orders",
    "PoincareSteklov",
    "SpaceTimeUzawa",
    "TimeKernels",
    "TwoBodies",
    "circle",
    "conditions_on",
    "energetic_blocks",
    "march_contact",
    "polygon",
    "traction_forces",
]
