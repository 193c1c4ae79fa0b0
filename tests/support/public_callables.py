"""Every public function and class of the package, and right values for their arguments."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from chain import chain_problem

import vi_contact as vc
from vi_contact import ground_motion
from vi_contact.core.state_checks import initial_state

ROOT = Path(vc.__file__).parent


def right() -> dict[str, Any]:
    """Right values for arguments of these names; all others get 1.0, which most of them take."""
    problem = chain_problem(3, gap=1e-3)
    record = ground_motion.Record(np.sin(np.arange(200.0)), 0.01)
    return {
        "record": record,
        "motion": record,
        "problem": problem,
        "system": problem.system,
        "surface": problem.surface,
        "state": initial_state(problem),
        "scheme": vc.ZienkiewiczWoodTaylor(),
        "dt": 0.01,
        "steps": 2,
        "periods": [0.1, 1.0],
        "path": "x.png",
        "folder": "nowhere",
        "E": 1e7,
        "nu": 0.3,
        "rho": 2000.0,
        "mu": 0.3,
        "e": 0.5,
        "duration": 2.0,
        "frequency": 2.0,
        "amplitude": 1.0,
        "values": [1.0, 2.0],
        "t": 0.5,
        "points": [[0.0]],
        "direction": (1.0,),
        "seed": 1,
        "acceleration": [0.0, 1.0, 0.0],
        "height": 2.0,
        "damping": 0.05,
        "units": "g",
        "history": {"t": np.arange(3.0)},
        "columns": {},
        "nodes": [1],
        "weights": [1.0],
        "text": "pga",
        "factor": 2.0,
        "every": 1,
        "name": "u",
        "start": 0.05,
        "end": 0.95,
        "spectrum": ground_motion.KanaiTajimi(s0=0.01),
        "ground": "B",
        "title": "a title",
        "rise": 0.5,
        "decay": 1.0,
    }


def callables() -> Iterator[tuple[str, Callable[..., Any]]]:
    """(room.name, function, class or class method) of all public names."""
    rooms = ["", *sorted(path.parent.name for path in ROOT.glob("*/__init__.pyi"))]
    seen: set[int] = set()
    for room in rooms:
        module = importlib.import_module(f"vi_contact.{room}" if room else "vi_contact")
        for name in module.__all__:
            found = getattr(module, name)
            if not callable(found) or getattr(found, "_is_protocol", False) or id(found) in seen:
                continue
            seen.add(id(found))
            if inspect.isclass(found) and issubclass(found, BaseException):
                continue
            yield f"{room}.{name}", found
            for inner, value in vars(found).items() if inspect.isclass(found) else ():
                if isinstance(value, classmethod | staticmethod) and not inner.startswith("_"):
                    yield f"{room}.{name}.{inner}", getattr(found, inner)
