from .data import Data as Data
from .data import read_data as read_data
from .entry import Entry as Entry
from .entry import Inputs as Inputs
from .entry import entry_names as entry_names
from .entry import read_entry as read_entry
from .found import Found as Found
from .runner import Outcome as Outcome
from .runner import judge_mutant as judge_mutant
from .runner import run_entry as run_entry
from .statistics import Agreement as Agreement
from .statistics import agreement as agreement

__all__: list[str]
