"""Read a product of units as "kN/m3", "kg/m^3", "Pa*s" or "1/s"."""

import re
import tomllib
from importlib.resources import files

from ...core.checks import quote
from ...core.errors import InputError

Dimension = tuple[int, ...]  # exponents of metre, kilogram, second, radian
NAME = "[A-Za-zµμ°%]+"  # of a unit
_FACTOR = re.compile(rf"([*·/]?)(?:(?<!\s)\s+)?(1(?=\s*/|$)|{NAME})(?:\^?(-?[0-9])|([²³]))?\s*")
_TABLES = tomllib.loads(files(__package__).joinpath("units.toml").read_text(encoding="utf-8"))
_UNITS = _TABLES["alone"] | {
    prefix + name: [factor * unit[0], *unit[1:]]
    for prefix, factor in _TABLES["prefixes"].items()
    for name, unit in _TABLES["with_prefix"].items()
}


def read_unit(text: str) -> tuple[float, Dimension]:
    """Return the factor to SI units and the dimension of a product.

    After a "/" all divides up to the next "*".

    Args:
        text: the product, such as "kN/m3".

    Raises:
        InputError: for what is no product of units.
    """
    size = 1.0
    total: Dimension = (0, 0, 0, 0)
    below = False  # whether factors divide
    position = 0
    while position < len(text):
        match = _FACTOR.match(text, position)
        if match is None:
            raise InputError(f"{quote(text)} is not a unit: write one as kN/m3, cm/s^2 or Pa*s")
        sign, name, digits, raised = match.groups()

        # The power of this factor, from "2", "^2" or "²"; negative below a "/".
        below = sign == "/" or (below and not sign)
        power = int(digits) if digits else {"²": 2, "³": 3}.get(raised, 1)
        if below:
            power = -power
        if name not in _UNITS:
            known = ", ".join((*_TABLES["with_prefix"], *_TABLES["alone"]))
            raise InputError(f"{quote(name)} is not a unit here: there are {known}, kPa, mm")

        factor, *dimension = _UNITS[name]
        size *= factor**power
        total = tuple(a + power * b for a, b in zip(total, dimension, strict=True))
        position = match.end()
    return size, total
