# ruff: noqa
# The public names of this package: one line each, here only. docs/make_api.py sorts them and writes
# __all__.
from .cross_check import CrossChecked as CrossChecked
from .cross_check import cross_check as cross_check
from .files.reading import RunFolder as RunFolder
from .files.reading import read_run as read_run
from .march import march as march
from .march_many import march_many as march_many
from .method import with_defaults as with_defaults
from .recorders import Contact as Contact
from .recorders import Energy as Energy
from .recorders import Probe as Probe
from .simulate import simulate as simulate
from .simulate_many import simulate_many as simulate_many
from .solution import Solution as Solution
from .static import quasi_static as quasi_static
from .static import static_equilibrium as static_equilibrium
from .time_steps import HalvedAtImpact as HalvedAtImpact
from .time_steps import Schedule as Schedule

__all__: list[str] = [
    "Contact",
    "CrossChecked",
    "Energy",
    "HalvedAtImpact",
    "Probe",
    "RunFolder",
    "Schedule",
    "Solution",
    "cross_check",
    "march",
    "march_many",
    "quasi_static",
    "read_run",
    "simulate",
    "simulate_many",
    "static_equilibrium",
    "with_defaults",
]
