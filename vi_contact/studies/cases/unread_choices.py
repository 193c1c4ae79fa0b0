"""Refuse choices of a case that nothing reads: a law without what it acts on, a material of no cells, a table that every
stage replaces.

A choice in vain is a misunderstanding: the author believes in a model that is not the one computed. Each finding is a
sentence with the table, what makes the choice vain, and the remedy. What ``--set`` and short options make vain is let
be, as ``--set contact=`` does with the impact law of a file: this was asked for, and the file is in order."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

from ...core.errors import InputError
from .stage_tables import OF_MOTION, WHOLE
from .table_calls import Call, Node, nodes_in

RATIO_LAW = "DampingRatio"
BLIND_TO_RATIOS = ("NoDamping", "MassProportional", "Rayleigh", "Rayleigh.from_frequencies", "KelvinVoigt")
OF_CONTACT = {"friction": "rubs", "impact": "strikes", "mass": "touches"}  # laws of contact: what does not happen
MASSES = ("ConsistentMass", "Redistributed")
SUPPORTS = ("clamped", "prescribed", "tied", "dashpots")
AT_START = ("initial_displacement", "initial_velocity")


@dataclass(frozen=True)
class Part:
    """Hold a stage, or the whole of a case without stages: how sentences begin, its tables and the calls of them."""

    label: str
    tables: Mapping[str, Any]
    nodes: Mapping[str, Node]
    static: bool = False

    def calls(self, table: str) -> list[Call]:
        """Return the calls that a table, or an array of tables, makes itself; those in them not."""
        made = self.nodes.get(table, ())
        return [one for one in (made if isinstance(made, tuple) else (made,)) if isinstance(one, Call)]


def findings(path: Path, tables: Mapping[str, Any], parts: Sequence[Part]) -> Iterator[tuple[str, str]]:
    """Yield (the key that is in vain, sentence) of all choices without effect. ``tables``: of the file, with its
    stages; ``parts``: the stages in their order, or the one whole case."""
    yield from _materials(path, tables, parts)
    for part in parts:
        yield from _ratios(part)
        yield from _without_contact(part)
        yield from _of_solvers(part)
        yield from _twice(part)
    yield from _start(parts)
    yield from _ground(path, parts)
    if "stage" in tables:
        yield from _replaced(path, tables)


def left_over(path: Path, tables: Mapping[str, Any]) -> Iterator[str]:
    """Yield a sentence for each table that waits for a motion in a case of static stages. These are no mistake, as one
    looks at the weight alone before the motion is added, but they are told."""
    stages = tables.get("stage", ())
    if stages and all(one.get("type") == "static" for one in stages):
        for key in (one for one in OF_MOTION if one in tables):
            yield f"[{key}] of {path} is for motions and is not read, as every [[stage]] is static"


def refuse_unread(found: Sequence[tuple[str, str]], before: Sequence[tuple[str, str]] | None,
                  settings: Sequence[str]) -> None:
    """Raise InputError with the first finding. ``before``: those of the file without its settings, None where there are
    none or the file alone is no case. A finding that only settings of other keys have made is let be."""
    already = {key for key, _ in before or ()}
    asked = [setting.partition("=")[0].strip() for setting in settings]
    for key, sentence in found:
        table = key.partition(".")[0]
        of_settings = any(one.partition(".")[0] == table for one in asked)
        if not settings or key in already or of_settings:
            raise InputError(sentence)


def _materials(path: Path, tables: Mapping[str, Any], parts: Sequence[Part]) -> Iterator[tuple[str, str]]:
    """Materials that no stage's [system] names, for cells or for what is behind a boundary."""
    named = tables.get("material")
    for name in named if isinstance(named, Mapping) else ():
        users = [part for part in parts if any(one is part.nodes["material"][name]
                                               for one in nodes_in(part.nodes["system"]))]
        if not users:
            yield (f"material.{name}", f"{path}: [material.{name}] is of nothing, as [system] does not name it: give its "
                   "cell group in [system] material, or leave it out")


def _ratios(part: Part) -> Iterator[tuple[str, str]]:
    """The law of damping ratios without a ratio, and ratios without the law."""
    law = part.nodes["system"].arguments.get("damping")
    word = law.callee.name if isinstance(law, Call) else "NoDamping"
    used = [one for one in nodes_in(part.nodes["system"].arguments.get("material", ())) if isinstance(one, Call)]
    known = part.nodes.get("material", {})
    names = {name: one for name, one in known.items() if any(one is other for other in used)}
    damped = [name for name, one in names.items() if one.arguments.get("xi")]
    if word == RATIO_LAW and names and not damped and "strain_compatible" not in part.nodes:
        first = next(iter(names))
        yield ("system.damping", f"{part.label}: [system.damping] {RATIO_LAW} damps by the ratios of the materials, and "
               f"none has one: give [material.{first}] xi = 0.05, or another type of damping")
    if word in BLIND_TO_RATIOS and damped:
        yield (f"material.{damped[0]}", f"{part.label}: [material.{damped[0]}] has xi, which no damping reads here: give "
               f"[system] damping = {{type = \"{RATIO_LAW}\", frequency = …}} with a frequency in Hz, or leave xi out")


def _without_contact(part: Part) -> Iterator[tuple[str, str]]:
    """Laws of contact where there is none, or none that they act on."""
    for table, happens in OF_CONTACT.items():
        laws = part.calls(table)
        own = table == "mass" and laws and laws[0].callee.name not in MASSES  # it may change all masses
        if laws and not part.calls("contact") and not own:
            yield (table, f"{part.label}: [{table}] has no effect, as nothing {happens} without [[contact]]: give the "
                   "contact, or leave it out")
    surfaces = part.calls("contact")
    dt = part.nodes["run"].arguments.get("dt")
    if isinstance(dt, Call) and dt.callee.name == "HalvedAtImpact" and not surfaces:
        yield ("run.dt", f"{part.label}: [run] dt is HalvedAtImpact, which halves nothing without [[contact]]: give the "
               "contact, or the step alone")
    if part.calls("mass") and any("mass" in one.arguments for one in part.calls("scheme")):
        yield ("scheme.mass", f"{part.label}: [scheme] mass is not read, as [mass] comes before it: leave one of the two "
               "out")
    if part.calls("impact") and surfaces and all("springs" in one.arguments for one in surfaces):
        yield ("impact", f"{part.label}: [impact] has no effect, as every [[contact]] has springs, which do not collide: "
               "leave it out")


def _of_solvers(part: Part) -> Iterator[tuple[str, str]]:
    """Methods of the condensed solver for steps that the case does not have; a solver to escalate to that has failed."""
    rubs = [one.callee.name for one in part.calls("friction") if one.callee.name != "Frictionless"]
    for table in ("solver", "escalation"):
        for one in part.calls(table):
            if one.callee.name != "Condensed":
                continue
            if rubs and "method" in one.arguments:
                yield (table, f"{part.label}: [{table}] method is for contact without friction, and [friction] is given: "
                       "give friction_method in its place, or leave it out")
            for key in ("friction_method", "rates"):
                if key in one.arguments and not rubs:
                    yield (table, f"{part.label}: [{table}] {key} is for contact with friction, and there is no "
                           "[friction]: give the friction, or leave it out")
            if "rates" in one.arguments and rubs and rubs[0] in ("Coulomb", "Tresca"):
                yield (table, f"{part.label}: [{table}] rates is for friction that depends on the slip rate, and "
                       f"{rubs[0]} does not: leave it out")
    tried = [*part.calls("solver"), *part.calls("escalation")]
    for one, other in combinations(tried, 2):
        if one == other:
            yield ("escalation", f"{part.label}: [[escalation]] names {other.callee.name} with the same keys as the "
                   "solver before it, which has failed by then: leave it out, or change a key")


def _twice(part: Part) -> Iterator[tuple[str, str]]:
    """The same load or excitation, word for word."""
    system = part.tables.get("system", {})
    lists = {"system.loads": system.get("loads"), "system.dashpots": system.get("dashpots"),
             "excitation": part.tables.get("excitation")}
    for key, given in lists.items():
        for one, other in combinations(given if isinstance(given, list) else (), 2):
            if one == other:
                yield (key, f"{part.label}: [[{key}]] has two tables that are alike, word for word: leave one of them out, "
                       "or give one of twice the size")


def _start(parts: Sequence[Part]) -> Iterator[tuple[str, str]]:
    """Initial values that a static equilibrium, or the stage before, takes away."""
    first, *later = parts
    at_rest = "the static stage" if first.static else "[gravity]" if "gravity" in first.nodes else ""
    if at_rest and "initial_velocity" in first.nodes["system"].arguments:
        yield ("system.initial_velocity", f"{first.label}: [system] initial_velocity is lost, as {at_rest} lets the body "
               "begin at rest, in equilibrium: leave one of the two out")
    for part in later:
        for key in AT_START:
            if key in part.nodes["system"].arguments and key not in first.nodes["system"].arguments:
                yield (f"system.{key}", f"{part.label}: system has {key}, and a stage begins where the stage before has "
                       "left the body: give it in the first stage, or leave it out")


def _ground(path: Path, parts: Sequence[Part]) -> Iterator[tuple[str, str]]:
    """Masses of held nodes that no ground motion and no weight accelerates."""
    given = any("base_inertia" in part.nodes["system"].arguments for part in parts)
    if given and not any(part.calls("excitation") or part.calls("gravity") for part in parts):
        yield ("system.base_inertia", f"{path}: [system] base_inertia is about the inertia load of a ground motion, and "
               "there is no [[excitation]]: leave it out")


def _replaced(path: Path, tables: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Tables and keys of the case that no stage takes over."""
    stages = tables["stage"]
    moving = [one for one in stages if one.get("type") == "dynamic"]
    for key in (one for one in WHOLE if one in tables):
        readers = moving if key in OF_MOTION else stages
        if readers and all(one.get(key) for one in readers):  # excitation = [] takes it away, which is said
            yield (key, f"{path}: [{key}] is read by no stage, as every [[stage]] that could read it has its own: leave "
                   "it out there or here")
    own = tables.get("system")
    for key in own if isinstance(own, Mapping) else ():
        if all(key in one.get("system", {}) for one in stages):
            yield (f"system.{key}", f"{path}: [system] {key} is read by no stage, as every [[stage]] has its own: leave "
                   "it out there or here")
    for before, one in zip(stages, stages[1:], strict=False):
        held = [{key: {**tables.get("system", {}), **stage.get("system", {})}.get(key) for key in SUPPORTS}
                for stage in (before, one)]
        if one.get("release") is True and held[0] == held[1]:
            yield ("stage", f"{path}: [[stage]] '{one.get('name')}' has release = true, and the supports of the stage "
                   "before it: leave it out, or change the supports")
