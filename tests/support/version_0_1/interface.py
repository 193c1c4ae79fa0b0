"""Write the public names of a version, their arguments and members: ``python3 interface.py > interface.json``.

``interface.json`` was written in the source tree of version 0.1; test_upgrade.py compares today's names with it.
"""

import inspect
import json
from enum import Enum
from importlib import import_module
from types import ModuleType
from typing import Any

PACKAGES = ("vi_contact", *(f"vi_contact.{room}" for room in ("beam", "bem", "fem", "ground_motion", "studies")))


def interface(what: Any) -> dict[str, list[str]]:
    """Arguments of what can be called, and what belongs to a class; nothing of a module.

    The arguments of an Enum are left out: they are those of Python's own class, and differ between its versions.
    """
    if isinstance(what, ModuleType):
        return {}
    try:
        own = not (inspect.isclass(what) and issubclass(what, Enum))
        arguments = list(inspect.signature(what).parameters) if own else []
    except (TypeError, ValueError):
        arguments = []
    members = {*dir(what), *getattr(what, "__dataclass_fields__", ())} if inspect.isclass(what) else set()
    public = sorted(name for name in members if not name.startswith("_"))
    return {"arguments": arguments} | ({"members": public} if public else {})


if __name__ == "__main__":
    packages = [import_module(package) for package in PACKAGES]
    names = {one.__name__: {name: interface(getattr(one, name)) for name in sorted(one.__all__)} for one in packages}
    print(json.dumps(names, separators=(",", ":")).replace('}},"vi', '}},\n"vi').replace('},"', '},\n"'))
