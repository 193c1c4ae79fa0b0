from .inequality import Result as Result
from .inequality import solve as solve
