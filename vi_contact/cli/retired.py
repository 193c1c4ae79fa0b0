"""Answer the commands of version 0.1 that have become cases: one sentence that says the same in today's words."""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence

from ..core.errors import InputError

COMMANDS = ("wall", "channel", "beam", "layer")
_OPTION = re.compile(r"--([\w-]+)((?:[ =](?!--)\S+)*)")
_SAME = ("scale", "dt", "steps", "out", "cross-check", "restart", "restart-changed", "quiet")
_KEYS = {  # option of wall and channel -> key of the case
    "mu": "friction.mu", "fields-every": "fields.every", "units": "excitation.1.record.units",
    "pga": "excitation.1.record.processing.pga", "resample": "excitation.1.record.processing.resample",
} | {name: f"model.{name}" for name in (
    "case", "base-inertia", "divisions", "triangles", "size", "far", "width", "depth", "outer-width", "height", "wall",
    "slab", "base",
)}
_WORDS = {  # option and value -> what to write instead
    "--gravity": "--set model.weight=true", "--contact bilateral": "--set model.held=true",
    "--contact coulomb": "--set friction.type=Coulomb", "--sides tied": "--set model.sides.type=TiedSides",
    "--projection": "--set impact.update.type=ImpulseUpdate", "--impact none": "--set impact=",
    "--solver volume-reference": "--solver ReducedNewton", "--solver projected-cg": "--solver ProjectedCG",
    "--scheme zwt": "--scheme ZienkiewiczWoodTaylor", "--scheme hht": "--scheme HHT --set scheme.alpha=-0.1",
    "--gravity all": "--set model.weighing='[\"channel\",\"soil\"]'",
    "--sides free-field": "--set model.sides.type=FreeFieldSides",
} | {f"--{option} {word}": f"--{option} {word.title().replace('-', '')}" for option, words in {
    "solver": ("condensed", "hildreth", "volume"),
    "scheme": ("trapezoidal", "newmark", "houbolt", "midpoint", "moreau-jean"),
}.items() for word in words}


def refuse_retired(arguments: Sequence[str]) -> None:
    """Raise InputError for one of COMMANDS, with the command that does the same today."""
    if not arguments or arguments[0] not in COMMANDS:
        return
    command = arguments[0]
    options = {name: rest.replace("=", " ").split() for name, rest in _OPTION.findall(" ".join(arguments[1:]))}
    motion = [values[0] for name in ("motion", "vertical") if (values := options.pop(name, []))]
    said = [f"vi-contact run {command}", *([f"--motion {shlex.quote(','.join(motion))}"] if motion else [])]
    words = {name: _translated(command, name, values) for name, values in options.items()}
    said += [new for new in words.values() if new]
    left = [f"--{name}" for name, new in words.items() if not new]
    rest = f"; for {', '.join(left)} see CHANGELOG.md" if left else ""
    new = " ".join(said)
    raise InputError(f"'{command}' is a case now: give {new}, and for its pictures vi-contact report DIR{rest}")


def _translated(command: str, name: str, values: Sequence[str]) -> str:
    """Return an option of an old command in today's words; nothing where there are none so short."""
    whole = " ".join([f"--{name}", *values])
    if whole in _WORDS or name in _SAME and (name == "out" or command in ("wall", "channel")):
        return _WORDS.get(whole, shlex.join(whole.split()))
    key = _KEYS.get(name) if command in ("wall", "channel") else f"{command}.{name}"
    value = "true" if not values else values[0] if len(values) == 1 else f"[{', '.join(values)}]"
    return f"--set {shlex.quote(key.replace('-', '_') + '=' + value)}" if key else ""
