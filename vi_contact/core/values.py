"""Make frozen dataclasses in a fifth of the time: before Python 3.13 the standard library compiles six functions for
each, half of what importing this package takes. Here they have all but the first in common."""

import dataclasses
from dataclasses import MISSING, FrozenInstanceError, field, fields, is_dataclass, replace
from functools import partial
from reprlib import recursive_repr
from typing import TYPE_CHECKING, Any

__all__ = ["dataclass", "field", "fields", "is_dataclass", "replace"]
_MADE = type("_Made", (), {"__repr__": lambda self: "<factory>"})()  # the default that a factory makes


def _values(self: Any) -> tuple[Any, ...]:
    return tuple([getattr(self, one.name) for one in fields(self) if one.compare])


def _equal(self: Any, other: object) -> Any:
    return _values(self) == _values(other) if other.__class__ is self.__class__ else NotImplemented


def _hash(self: Any) -> int:
    return hash(_values(self))


@recursive_repr()
def _repr(self: Any) -> str:
    said = ", ".join(f"{one.name}={getattr(self, one.name)!r}" for one in fields(self) if one.repr)
    return f"{type(self).__qualname__}({said})"


def _frozen(self: Any, name: str, *value: Any) -> None:
    """Refuse; but subclasses that are no dataclasses may have attributes of their own."""
    if "__dataclass_fields__" in vars(type(self)) or name in self.__dataclass_fields__:
        raise FrozenInstanceError(f"cannot {'assign to' if value else 'delete'} field {name!r}")
    (object.__setattr__ if value else object.__delattr__)(self, name, *value)


_SHARED = {"__repr__": _repr, "__setattr__": _frozen, "__delattr__": _frozen, "__eq__": _equal, "__hash__": _hash}


def _init(cls: type) -> Any:
    """The function that is every class's own."""
    names: dict[str, Any] = {"_put": object.__setattr__, "_made": _MADE, "__name__": cls.__module__}
    given, lines = ["self"], ["pass"]
    for one in fields(cls):
        name, value, default = one.name, one.name, ""
        if one.default_factory is not MISSING:
            names[f"_of_{name}"], default = one.default_factory, "=_made"
            value = f"_of_{name}() if {name} is _made else {name}" if one.init else f"_of_{name}()"
        elif one.default is not MISSING:
            names[f"_of_{name}"], default = one.default, f"=_of_{name}"
        given += [name + default] if one.init else []
        lines += [f"_put(self, '{name}', {value})"] if one.init or default == "=_made" else []
    lines += ["self.__post_init__()"] if hasattr(cls, "__post_init__") else []
    exec(f"def __init__({', '.join(given)}):\n " + "\n ".join(lines), names)
    made = names["__init__"]
    made.__qualname__ = f"{cls.__qualname__}.__init__"
    made.__annotations__ = {one.name: one.type for one in fields(cls) if one.init} | {"return": None}
    return made


if TYPE_CHECKING:
    from dataclasses import dataclass
else:

    def dataclass(cls=None, *, frozen=False, eq=True, kw_only=False):
        """Do what the decorator of the standard library does."""
        if cls is None:
            return partial(dataclass, frozen=frozen, eq=eq, kw_only=kw_only)
        if kw_only or not frozen or any(map(is_dataclass, cls.__mro__[1:])):
            return dataclasses.dataclass(cls, frozen=frozen, eq=eq, kw_only=kw_only)
        own = set(vars(cls)) | (set() if eq else {"__eq__", "__hash__"})
        made = dataclasses.dataclass(cls, init=False, repr=False, eq=False)
        made.__dataclass_params__.frozen = True  # asked of the bases of another
        for name, function in {"__init__": _init(made), **_SHARED}.items():
            if name not in own:
                setattr(made, name, function)
        return made
