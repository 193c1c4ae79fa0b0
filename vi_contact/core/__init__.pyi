# ruff: noqa
# The public names of this package: one line each, here only. docs/make_api.py sorts them and writes
# __all__.
from .certificate import Certificate as Certificate
from .errors import InputError as InputError
from .errors import Interrupted as Interrupted
from .errors import OutOfTime as OutOfTime
from .errors import StepFailure as StepFailure
from .errors import ViContactError as ViContactError
from .obstacles import AnalyticGap as AnalyticGap
from .obstacles import HalfSpace as HalfSpace
from .obstacles import Obstacle as Obstacle
from .obstacles import Touching as Touching
from .problem import ContactProblem as ContactProblem
from .protocols import Excitation as Excitation
from .protocols import FrictionLaw as FrictionLaw
from .protocols import Frictionless as Frictionless
from .protocols import ImpactLaw as ImpactLaw
from .protocols import MassLaw as MassLaw
from .step import PreparedSolver as PreparedSolver
from .step import Recorder as Recorder
from .step import Report as Report
from .step import Scheme as Scheme
from .step import Solver as Solver
from .step import State as State
from .step import StepProblem as StepProblem
from .step import StepResult as StepResult
from .surfaces import ContactSurface as ContactSurface
from .system import Companion as Companion
from .system import Load as Load
from .system import SemiDiscreteSystem as SemiDiscreteSystem
from .verify import energy_balance as energy_balance
from .verify import kkt_residual as kkt_residual

__all__: list[str] = [
    "AnalyticGap",
    "Certificate",
    "Companion",
    "ContactProblem",
    "ContactSurface",
    "Excitation",
    "FrictionLaw",
    "Frictionless",
    "HalfSpace",
    "ImpactLaw",
    "InputError",
    "Interrupted",
    "Load",
    "MassLaw",
    "Obstacle",
    "OutOfTime",
    "PreparedSolver",
    "Recorder",
    "Report",
    "Scheme",
    "SemiDiscreteSystem",
    "Solver",
    "State",
    "StepFailure",
    "StepProblem",
    "StepResult",
    "Touching",
    "ViContactError",
    "energy_balance",
    "kkt_residual",
]
