# ruff: noqa
# The public names of this package: one line each, here only. docs/make_api.py sorts them and writes
# __all__.
from .assembly import assemble as assemble
from .contact.joined import joined_surfaces as joined_surfaces
from .contact.matching import NodeToNode as NodeToNode
from .contact.mortar import DualMortar as DualMortar
from .contact.pairs import contact_pair as contact_pair
from .contact.surface import contact_surface as contact_surface
from .dashpots import CompliantBase as CompliantBase
from .dashpots import Dashpots as Dashpots
from .heterogeneous import Heterogeneous as Heterogeneous
from .initial_strains import InitialStrain as InitialStrain
from .linear_forms import LinearForm as LinearForm
from .loads import BodyForce as BodyForce
from .loads import Prescribed as Prescribed
from .loads import Pressure as Pressure
from .loads import TangentialTraction as TangentialTraction
from .loads import Traction as Traction
from .mesh import Cells as Cells
from .mesh import Facets as Facets
from .mesh import Tags as Tags
from .mesh import build_mesh as build_mesh
from .mesh import node_numbers as node_numbers
from .mesh import read_mesh as read_mesh
from .output.fields import XDMF as XDMF
from .output.functions import as_function as as_function
from .output.functions import read_function as read_function
from .output.largest_strain import LargestStrain as LargestStrain
from .output.reactions import Reactions as Reactions
from .output.section_forces import SectionForces as SectionForces
from .own_forms import Forms as Forms
from .petsc_system import system_from_matrices as system_from_matrices
from .released_supports import release as release
from .space import bodies_of as bodies_of
from .ties import Tied as Tied

__all__: list[str] = [
    "BodyForce",
    "Cells",
    "CompliantBase",
    "Dashpots",
    "DualMortar",
    "Facets",
    "Forms",
    "Heterogeneous",
    "InitialStrain",
    "LargestStrain",
    "LinearForm",
    "NodeToNode",
    "Prescribed",
    "Pressure",
    "Reactions",
    "SectionForces",
    "Tags",
    "TangentialTraction",
    "Tied",
    "Traction",
    "XDMF",
    "as_function",
    "assemble",
    "bodies_of",
    "build_mesh",
    "contact_pair",
    "contact_surface",
    "joined_surfaces",
    "node_numbers",
    "read_function",
    "read_mesh",
    "release",
    "system_from_matrices",
]
