from .inequality import solve as solve
from .problem import Problem as Problem
from .problem import Result as Result
