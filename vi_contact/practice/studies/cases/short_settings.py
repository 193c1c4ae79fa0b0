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
from .bodies import find_body_table
from .parsing import suggest_nearest
from .quantities import read_quantity
from .stage_tables import refuse_own
from .table_calls import Spot
from .toml_file import format_value, list_tables, with_settings

# of a layer shaken sideways
ROLLERS = [{"facets": side, "components": [1]} for side in ("left_side", "right_side")]
# of one shaken both ways
TIED = ["system.prescribed=", 'system.tied={first="left_side", second="right_side"}']
REFERENCE = {"type": "Volume", "method": {"type": "ReducedNewton"}}
# whose contact points have mass: they take an impact law
IMPULSIVE = ("ZienkiewiczWoodTaylor", "SS22")


@dataclass(frozen=True)
class ShortOptions:
    """Hold what people change most; None: as the case says.

    Attributes:
        motion: record files joined by commas, the first one horizontal, the last one of two
            vertical.
        scale: a factor on what shakes.
        dt: the time step [s].
        steps: their number.
        solver: its name in case files.
        scheme: its name in case files.
        cross_check: whether another solver accompanies every step.
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

        Args:
            tables: of the case.
            given: settings KEY=VALUE that the user has written.

        Raises:
            InputError: for an option that the case has no use for.
        """
        first = [
            *self._replace_motion(tables),
            *self._replace_steps(),
            *self._replace_methods(tables),
        ]
        after = with_settings(dict(tables), [*first, *given])
        last = [*self._multiply_scale(after), *self._add_cross_check(after)]
        for setting in (*first, *last):
            refuse_own(tables, setting, "a short option")
        return [*first, *given, *last]

    def _replace_motion(self, tables: Mapping[str, Any]) -> list[str]:
        """Replace what shakes by records; the run lasts as long as they do."""
        if self.motion is None:
            return []
        files = self.motion.split(",")
        before = list_tables(tables.get("excitation"))
        direction = before[0].get("direction") if before else None
        axes = len(direction) if isinstance(direction, list) else _count_axes(tables)
        if not all(files) or len(files) > 2:
            raise InputError(
                f"--motion {quote(self.motion)}: give FILE, or FILE,FILE with a vertical motion"
            )

        # The first record goes along the first axis, the second along the last one.
        motions: list[dict[str, Any]] = []
        for number, file in enumerate(files):
            axis = 0 if number == 0 else axes - 1
            old = before[number] if number < len(before) else {}
            motions.append(_put_record(old, str(Path(file).absolute()), axis, axes))
        settings = [f"excitation={format_value(motions)}"]

        # Recorded motions have an inertia load, and a vertical one cannot shake a layer on rollers.
        system = next(iter(list_tables(tables.get("system"))), {})
        if system.get("base_inertia") is False:
            settings.append("system.base_inertia=true")
        if len(files) == 2 and system.get("prescribed") == ROLLERS:
            settings += TIED
        return [*settings, "run.steps=", "run.t_end="]

    def _replace_steps(self) -> list[str]:
        """Replace the time step and the number of steps."""
        settings = [] if self.dt is None else [f"run.dt={self.dt!r}"]
        if self.steps is not None:
            settings += [f"run.steps={self.steps}", "run.t_end="]
        return settings

    def _replace_methods(self, tables: Mapping[str, Any]) -> list[str]:
        """Replace scheme and solver.

        Schemes that need no impact law run without the one of the case.
        """
        if self.scheme is None and self.solver is None:
            return []
        from ....core.step import Scheme
        from ....solvers.condensed import SmallMethod
        from ....solvers.volume.route import Method

        # late: it needs the finite elements, which not every case does
        from .vocabulary import list_names

        settings = []
        if self.scheme is not None:
            schemes: dict[str, Sequence[str]] = dict.fromkeys(list_names(Scheme), ())
            settings.append(f"scheme={_name_method('scheme', self.scheme, schemes)}")
            if "impact" in tables and self.scheme not in IMPULSIVE and ":" not in self.scheme:
                settings.append("impact=")
        if self.solver is not None:
            solvers = {
                "Automatic": (),
                "Condensed": list_names(SmallMethod),
                "Iterative": (),
                "Volume": list_names(Method),
            }
            settings.append(f"solver={_name_method('solver', self.solver, solvers)}")
        return settings

    def _multiply_scale(self, tables: Mapping[str, Any]) -> list[str]:
        """Multiply the scale of every record, and the amplitude of all else that shakes."""
        if self.scale is None:
            return []
        excitation = tables.get("excitation")
        settings = []
        for number, table in enumerate(list_tables(excitation), start=1):
            if table.get("type") == "GroundMotion":
                key = "scale"
                unit = "1"
                value = table.get(key, 1.0)
            else:
                key = "amplitude"
                unit = "m/s2"
                value = table.get(key)
            if isinstance(value, str):
                spot = Spot("--scale", f"excitation[{number}]", key, unit)
                value = read_quantity(value, [float], spot)
            if not isinstance(value, int | float) or isinstance(value, bool):
                raise InputError(
                    f"--scale: [excitation] {number} has no amplitude to scale: change its own "
                    "numbers"
                )
            place = f"excitation.{number}" if isinstance(excitation, list) else "excitation"
            settings.append(f"{place}.{key}={value * self.scale!r}")
        if not settings:
            raise InputError(
                "the case cannot use --scale, as nothing shakes it: leave it out, or give --motion"
            )
        return settings

    def _add_cross_check(self, tables: Mapping[str, Any]) -> list[str]:
        """Let the other route accompany every step.

        It is the one to which the case escalates first, or the condensed one.
        """
        if not self.cross_check:
            return []
        solver = tables.get("solver", {"type": "Condensed"})
        if not isinstance(solver, dict) or solver.get("type") == "CrossChecked":
            return []
        other: dict[str, Any] = {"type": "Condensed"}
        if solver.get("type") == "Condensed":
            escalation = list_tables(tables.get("escalation"))
            routes = [table for table in escalation if table.get("type") == "Volume"]
            other = routes[0] if routes else REFERENCE
        both = {"type": "CrossChecked", "primary": solver, "others": [other]}
        return [f"solver={format_value(both)}"]


def _put_record(old: dict[str, Any], path: str, axis: int, axes: int) -> dict[str, Any]:
    """Return the table of a ground motion with the record of a file.

    Keys of the motion that it replaces stay, but for those of a synthetic record.

    Args:
        old: the table of the excitation that is replaced, or {}.
        path: of the record.
        axis: along which it shakes.
        axes: dimension of the body.
    """
    if old.get("type") != "GroundMotion":
        old = {}
    motion = {"type": "GroundMotion", "direction": [float(k == axis) for k in range(axes)]} | old
    record = old.get("record")
    if not isinstance(record, dict) or record.get("type") == "synthetic":
        record = {}
    return motion | {"record": record | {"path": path}}


def _count_axes(tables: Mapping[str, Any]) -> int:
    """Return the dimension of a body, as far as its tables tell: one of a rod and a particle."""
    body = next(iter(list_tables(tables.get(find_body_table(tables)))), {})
    return 1 if "particle" in tables or body.get("type") == "rod_problem" else 2


def _name_method(kind: str, name: str, methods: Mapping[str, Sequence[str]]) -> str:
    """Return the table of one of the keys, or of a method's own, as TOML.

    A class of others has a colon.

    Args:
        kind: "scheme" or "solver", for the sentence.
        name: what the user has written.
        methods: scheme or solver -> the names of its own methods.
    """
    for owner, names in methods.items():
        if name in names:
            return format_value({"type": owner, "method": {"type": name}})
    if name not in methods and ":" not in name:
        known = [*methods, *chain(*methods.values())]
        raise InputError(f"unknown {kind} {quote(name)}: {suggest_nearest(name, known)}")
    return format_value({"type": name})
