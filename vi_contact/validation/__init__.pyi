from .data import Data as Data
from .entry import Entry as Entry
from .entry import Inputs as Inputs
from .entry import entry_names as entry_names
from .entry import read_entry as read_entry
from .found import Found as Found
from .runner import Outcome as Outcome
from .runner import run_entry as run_entry

__all__: list[str]
