"""Turn the short options of ``vi-contact run`` into settings KEY=VALUE of a case.

Those it has no use for are refused.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any

from ....core.checks import quote
from ....core.errors import InputError
from .bodies import own_body
from .parsing import nearest
from .quantities import text_node
from .stage_tables import refuse_own
from .table_calls import Spot
from .toml_file import toml_value, with_settings

# of a layer shaken sideways
ROLLERS = [{"facets": side, "components": [1]} for side in ("left_side", "right_side")]
# of one shaken both ways
TIED = ["system.prescribed=", 'system.tied={first="left_side", second="right_side"}']
REFERENCE = {"type": "Volume", "method": {"type": "ReducedNewton"}}
# whose contact points have mass: they take an impact law
IMPULSIVE = ("ZienkiewiczWoodTaylor", "SS22")


@dataclass(frozen=True)
class ShortOptions:
    """Hold what people change most.

    motion: record files joined by commas, the first one horizontal, the last one of two vertical;
    scale: a factor on what shakes; solver, scheme: names of case files; None: as the case says.
    """

    motion: str | None = None
    scale: float | None = None
    dt: float | None = None
    steps: int | None = None
    solver: str | None = None
    scheme: str | None = None
    cross_check: bool = False

    def settings(self, tables: Mapping[str, Any], given: Sequence[str] = ()) -> list[str]:
        """Return all settings of a case.

        They are those that replace, then those ``given``, then those that change the result.

        InputError for an option that the case has no use for.
        """
        first = [*self._motion(tables), *self._step(), *self._methods(tables)]
        after = with_settings(dict(tables), [*first, *given])
        last = [*self._scale(after), *self._cross_check(after)]
        for setting in (*first, *last):
            refuse_own(tables, setting, "a short option")
        return [*first, *given, *last]

    def _motion(self, tables: Mapping[str, Any]) -> list[str]:
        """Replace what shakes by records; the run lasts as long as they do."""
        if self.motion is None:
            return []
        files = self.motion.split(",")
        before = _tables(tables.get("excitation"))
        direction = before[0].get("direction") if before else None
        axes = len(direction) if isinstance(direction, list) else _axes(tables)
        if not all(files) or len(files) > 2:
            raise InputError(
                f"--motion {quote(self.motion)}: give FILE, or FILE,FILE with a vertical motion"
            )
        motions: list[dict[str, Any]] = []
        for number, file in enumerate(files):
            old = (
                before[number]
                if number < len(before) and before[number].get("type") == "GroundMotion"
                else {}
            )
            record, axis = old.get("record"), 0 if number == 0 else axes - 1
            motions.append(
                {"type": "GroundMotion", "direction": [float(k == axis) for k in range(axes)]}
                | old
                | {
                    "record": (
                        {}
                        if not isinstance(record, dict) or record.get("type") == "synthetic"
                        else record
                    )
                    | {"path": str(Path(file).absolute())}
                }
            )
        found = [f"excitation={toml_value(motions)}"]
        system = next(iter(_tables(tables.get("system"))), {})
        if system.get("base_inertia") is False:
            found.append("system.base_inertia=true")
        if len(files) == 2 and system.get("prescribed") == ROLLERS:
            found += TIED
        return [*found, "run.steps=", "run.t_end="]

    def _step(self) -> list[str]:
        found = [] if self.dt is None else [f"run.dt={self.dt!r}"]
        return found if self.steps is None else [*found, f"run.steps={self.steps}", "run.t_end="]

    def _methods(self, tables: Mapping[str, Any]) -> list[str]:
        """Replace scheme and solver.

        Schemes that need no impact law run without the one of the case.
        """
        if self.scheme is None and self.solver is None:
            return []
        from ....core.step import Scheme
        from ....solvers.condensed import SmallMethod
        from ....solvers.volume.route import Method

        # late: it needs the finite elements, which not every case does
        from .vocabulary import names_of

        found = []
        if self.scheme is not None:
            found.append(
                f"scheme={_named('scheme', self.scheme, dict.fromkeys(names_of(Scheme), ()))}"
            )
            if "impact" in tables and self.scheme not in IMPULSIVE and ":" not in self.scheme:
                found.append("impact=")
        if self.solver is not None:
            methods = {
                "Automatic": (),
                "Condensed": names_of(SmallMethod),
                "Iterative": (),
                "Volume": names_of(Method),
            }
            found.append(f"solver={_named('solver', self.solver, methods)}")
        return found

    def _scale(self, tables: Mapping[str, Any]) -> list[str]:
        if self.scale is None:
            return []
        shaking = tables.get("excitation")
        found = []
        for number, one in enumerate(_tables(shaking), start=1):
            key, unit = (
                ("scale", "1") if one.get("type") == "GroundMotion" else ("amplitude", "m/s2")
            )
            value = one.get(key, 1.0 if key == "scale" else None)
            if isinstance(value, str):
                value = text_node(
                    value, [float], Spot("--scale", f"excitation[{number}]", key, unit)
                )
            if not isinstance(value, int | float) or isinstance(value, bool):
                raise InputError(
                    f"--scale: [excitation] {number} has no amplitude to scale: change its own "
                    "numbers"
                )
            place = f"excitation.{number}" if isinstance(shaking, list) else "excitation"
            found.append(f"{place}.{key}={value * self.scale!r}")
        if not found:
            raise InputError(
                "the case cannot use --scale, as nothing shakes it: leave it out, or give --motion"
            )
        return found

    def _cross_check(self, tables: Mapping[str, Any]) -> list[str]:
        """Let the other route accompany every step.

        It is the one to which the case escalates first, or the condensed one.
        """
        if not self.cross_check:
            return []
        solver = tables.get("solver", {"type": "Condensed"})
        if not isinstance(solver, dict) or solver.get("type") == "CrossChecked":
            return []
        routes = [
            one for one in _tables(tables.get("escalation")) if one.get("type") == "Volume"
        ] or [REFERENCE]
        other = routes[0] if solver.get("type") == "Condensed" else {"type": "Condensed"}
        return [
            f"solver={toml_value({'type': 'CrossChecked', 'primary': solver, 'others': [other]})}"
        ]


def _axes(tables: Mapping[str, Any]) -> int:
    """Return the dimension of a body, as far as its tables tell: one of a rod and a particle."""
    body = next(iter(_tables(tables.get(own_body(tables)))), {})
    return 1 if "particle" in tables or body.get("type") == "rod_problem" else 2


def _tables(value: Any) -> list[dict[str, Any]]:
    """Return a table, or the tables of a list."""
    return [one for one in (value if isinstance(value, list) else [value]) if isinstance(one, dict)]


def _named(kind: str, name: str, methods: Mapping[str, Sequence[str]]) -> str:
    """Return the table of one of the keys, or of a method's own, as TOML.

    A class of others has a colon.
    """
    for owner, names in methods.items():
        if name in names:
            return toml_value({"type": owner, "method": {"type": name}})
    if name not in methods and ":" not in name:
        raise InputError(
            f"unknown {kind} {quote(name)}: {nearest(name, [*methods, *chain(*methods.values())])}"
        )
    return toml_value({"type": name})
