"""Answer the commands of version 0.1 that have become cases: one sentence that says the same in today's words."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence

from ..core.errors import InputError

COMMANDS = ("wall", "channel", "beam", "layer")
_SAME = ("scale", "dt", "steps", "out", "cross-check", "restart", "restart-changed", "quiet")
_KEYS = {  # option of wall and channel -> key of the case; others of the same name are keys of [model]
    "mu": "friction.mu", "fields-every": "fields.every", "units": "excitation.1.record.units",
    "pga": "excitation.1.record.processing.pga", "resample": "excitation.1.record.processing.resample",
}
_OF_MODEL = ("case", "base-inertia", "divisions", "triangles", "size", "far", "width", "depth", "outer-width", "height",
             "wall", "slab")
_WORDS = {  # option and its value -> what to write instead
    "--gravity": "--set model.weight=true", "--gravity all": "--set 'model.weighing=[\"channel\", \"soil\"]'",
    "--gravity none": "--set 'model.weighing=[]'", "--contact bilateral": "--set model.held=true",
    "--contact sliding": "",
    "--contact coulomb": "--set friction.type=Coulomb", "--base relative": "", "--projection":
    "--set impact.update.type=ImpulseUpdate", "--base prescribed": "--set model.base=prescribed",
    "--base compliant": "--set model.base=compliant", "--sides rollers": "", "--sides tied":
    "--set model.sides.type=TiedSides", "--sides fixed": "--set model.sides.type=Fixed", "--sides free-field":
    "--set model.sides.type=FreeFieldSides", "--sides dashpots": "--set model.sides.type=DashpotSides",
    "--solver condensed": "", "--solver hildreth": "--solver Hildreth", "--solver projected-cg": "--solver ProjectedCG",
    "--solver volume": "--solver Volume", "--solver volume-reference": "--solver ReducedNewton",
    "--solver semismooth": "--solver SemismoothNewton", "--solver tron": "--solver TaoTron", "--scheme zwt": "",
    "--scheme trapezoidal": "--scheme Trapezoidal", "--scheme newmark": "--scheme Newmark",
    "--scheme hht": "--scheme HHT --set scheme.alpha=-0.1", "--scheme ss22": "--scheme SS22",
    "--scheme houbolt": "--scheme Houbolt", "--scheme midpoint": "--scheme Midpoint",
    "--scheme moreau-jean": "--scheme MoreauJean", "--scheme contact-stabilised": "--scheme ContactStabilisedNewmark",
    "--impact none": "--set impact=", "--impact inelastic": "--set impact.type=Inelastic",
    "--impact elastic": "--set impact.type=Elastic",
}  # fmt: skip


def refuse_retired(arguments: Sequence[str]) -> None:
    """Raise InputError for one of COMMANDS, with the command that does the same today."""
    if not arguments or arguments[0] not in COMMANDS:
        return
    command = arguments[0]
    said, left = [f"vi-contact run {command}"], []
    options = dict(_options(arguments[1:]))
    motion = [values[0] for name in ("motion", "vertical") if (values := options.pop(name, []))]
    said += [f"--motion {shlex.quote(','.join(motion))}"] if motion else []
    for name, values in options.items():
        new = _translated(command, name, values)
        said += [new] if new else []
        left += [f"--{name}"] if new is None else []
    rest = f"; for {', '.join(left)} see docs/guide/studies.md" if left else ""
    new = " ".join(said)
    raise InputError(f"'{command}' is a case now: give {new}, and for its pictures vi-contact report DIR{rest}")


def _translated(command: str, name: str, values: Sequence[str]) -> str | None:
    """Return an option of an old command in today's words, empty where nothing need be said; None for no such words."""
    whole = " ".join([f"--{name}", *values])
    if whole in _WORDS:
        return _WORDS[whole]
    key = _KEYS.get(name) or (f"model.{name}" if name in _OF_MODEL else None)
    if command in ("beam", "layer") and name not in ("out", "quiet"):
        key = f"{command}.{name}"
    if key is not None:
        value = "true" if not values else values[0] if len(values) == 1 else f"[{', '.join(values)}]"
        return f"--set {shlex.quote(key.replace('-', '_') + '=' + value)}"
    return " ".join(shlex.quote(word) for word in (f"--{name}", *values)) if name in _SAME else None


def _options(words: Sequence[str]) -> Iterator[tuple[str, list[str]]]:
    """Yield (name, values) of the options among the words."""
    found: list[str] | None = None
    for word in words:
        if word.startswith("--"):
            name, _, value = word[2:].partition("=")
            if found is not None:
                yield found[0], found[1:]
            found = [name, value] if value else [name]
        elif found is not None:
            found.append(word)
    if found is not None:
        yield found[0], found[1:]
