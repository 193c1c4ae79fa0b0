"""Refuse choices of a case that nothing reads.

Such are a law without what it acts on, a material of no cells, or a table that every stage
replaces.

A choice in vain is a misunderstanding: the author believes in a model that is not the one computed.
Each finding is a sentence with the table, what makes the choice vain, and the remedy. What
``--set`` and short options make vain is let be, as ``--set contact=`` does with the impact law of a
file: this was asked for, and the file is in order.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

from ....core.errors import InputError
from .bodies import BODY_TABLES
from .stage_tables import OF_MOTION, WHOLE
from .table_calls import Call, Node, walk_nodes

RATIO_LAW = "DampingRatio"
BLIND_TO_RATIOS = (
    "NoDamping",
    "MassProportional",
    "Rayleigh",
    "Rayleigh.from_frequencies",
    "KelvinVoigt",
)
OF_CONTACT = {  # what does not happen
    "friction": "rubs",
    "impact": "strikes",
    "mass": "touches",
    "layer": "touches",
}
# bodies that have no direction across
STRAIGHT = {"rod_problem": "the tip of a rod", "particle_problem": "a particle"}
MASSES = ("ConsistentMass", "Redistributed")
WITHOUT_RATES = ("Coulomb", "Tresca")
SUPPORTS = ("clamped", "prescribed", "tied", "dashpots")
AT_START = ("initial_displacement", "initial_velocity")
Finding = tuple[str, str]  # the key that is in vain, and the sentence


@dataclass(frozen=True)
class Part:
    """Hold a stage, or the whole of a case without stages.

    label: how sentences begin; tables and nodes: its tables, and the calls that they are.
    """

    label: str
    tables: Mapping[str, Any]
    nodes: Mapping[str, Node]
    static: bool = False

    def calls(self, table: str) -> list[Call]:
        """Return the calls that a table, or an array of tables, makes itself; those in them not."""
        made = self.nodes.get(table, ())
        every = made if isinstance(made, tuple) else (made,)
        return [one for one in every if isinstance(one, Call)]

    @property
    def system(self) -> Mapping[str, Node]:
        """Return the arguments of [system]."""
        arguments: Mapping[str, Node] = (
            self.nodes["system"].arguments if "system" in self.nodes else {}
        )
        return arguments


def find_unread(path: Path, tables: Mapping[str, Any], parts: Sequence[Part]) -> Iterator[Finding]:
    """Yield all choices without effect.

    tables: of the file, with its stages; parts: the stages in their order, or the one whole
    case.
    """
    yield from _materials(path, tables, parts)
    for part in parts:
        yield from _ratios(part)
        yield from _without_contact(part)
        yield from _of_solvers(part)
        yield from _twice(part)
        yield from _recorded_weight(part)
    yield from _start(parts)
    yield from _ground(path, parts)
    if "stage" in tables:
        yield from _replaced(path, tables)
        yield from _released(path, tables)


def find_left_over(path: Path, tables: Mapping[str, Any]) -> Iterator[str]:
    """Yield a sentence for each table that waits for a motion in a case of static stages.

    These are no mistake, as one looks at the weight alone before the motion is added: they are
    told.
    """
    stages = tables.get("stage", ())
    if stages and all(one.get("type") == "static" for one in stages):
        for key in (one for one in OF_MOTION if one in tables):
            yield f"[{key}] of {path} is for motions and is not read, as every [[stage]] is static"


def refuse_unread(
    found: Sequence[Finding], before: Sequence[Finding], settings: Sequence[str]
) -> None:
    """Raise InputError with the first finding that settings of other tables have not made.

    before: findings in the file without its settings; none where the file alone is no case.
    """
    already = {key for key, _ in before}
    asked = {setting.partition("=")[0].strip().partition(".")[0] for setting in settings}
    for key, sentence in found:
        if not settings or key in already or key.partition(".")[0] in asked:
            raise InputError(sentence)


def _materials(path: Path, tables: Mapping[str, Any], parts: Sequence[Part]) -> Iterator[Finding]:
    """Yield materials that no stage's [system] names.

    They are for cells or for what is behind a boundary.
    """
    named = tables.get("material")
    for name in named if isinstance(named, Mapping) else ():
        users = [
            part
            for part in parts
            if any(one is part.nodes["material"][name] for one in walk_nodes(part.nodes["system"]))
        ]
        if not users:
            yield (
                f"material.{name}",
                (
                    f"{path}: [material.{name}] is of nothing, as [system] does not name it: give "
                    "its cell group in [system] material, or leave it out"
                ),
            )


def _ratios(part: Part) -> Iterator[Finding]:
    """Yield the law of damping ratios without a ratio, and ratios without the law."""
    law = part.system.get("damping")
    word = law.callee.name if isinstance(law, Call) else "NoDamping"
    used = [one for one in walk_nodes(part.system.get("material", ())) if isinstance(one, Call)]
    named = part.nodes.get("material", {})
    names = [name for name, one in named.items() if any(one is other for other in used)]
    damped = [name for name in names if named[name].arguments.get("xi")]
    if word == RATIO_LAW and names and not damped and "strain_compatible" not in part.nodes:
        yield (
            "system.damping",
            (
                f"{part.label}: [system.damping] {RATIO_LAW} damps by the ratios of the materials, "
                f"and none has one: give [material.{names[0]}] xi = 0.05, or another type of "
                "damping"
            ),
        )
    if word in BLIND_TO_RATIOS and damped:
        yield (
            f"material.{damped[0]}",
            (
                f"{part.label}: [material.{damped[0]}] has xi, which no damping reads here: give "
                f'[system] damping = {{type = "{RATIO_LAW}", frequency = …}} with a frequency in '
                "Hz, or "
                "leave xi out"
            ),
        )


def _without_contact(part: Part) -> Iterator[Finding]:
    """Yield laws of contact where there is none.

    It yields them too where there is none that they act on, or another before them.
    """
    surfaces = [one for key in ("contact", *BODY_TABLES) for one in part.calls(key)]
    yield from _without_slip(part)
    for table, happens in OF_CONTACT.items():
        laws = part.calls(table)
        # may change all masses
        own = table == "mass" and laws and laws[0].callee.name not in MASSES
        if laws and not surfaces and not own:
            yield (
                table,
                (
                    f"{part.label}: [{table}] has no effect, as nothing {happens} without "
                    "[[contact]]: give the contact, or leave it out"
                ),
            )
    if part.calls("impact") and surfaces and all("springs" in one.arguments for one in surfaces):
        yield (
            "impact",
            (
                f"{part.label}: [impact] has no effect, as every [[contact]] has springs, which do "
                "not collide: leave it out"
            ),
        )
    dt = part.nodes["run"].arguments.get("dt")
    if isinstance(dt, Call) and dt.callee.name == "HalvedAtImpact" and not surfaces:
        yield (
            "run.dt",
            (
                f"{part.label}: [run] dt is HalvedAtImpact, which halves nothing without "
                "[[contact]]: give the contact, or the step alone"
            ),
        )
    if part.calls("mass") and any("mass" in one.arguments for one in part.calls("scheme")):
        yield (
            "scheme.mass",
            (
                f"{part.label}: [scheme] mass is not read, as [mass] comes before it: leave one of "
                "the two out"
            ),
        )


def _without_slip(part: Part) -> Iterator[Finding]:
    """Yield friction of a body that cannot slide."""
    for body in (one for key in BODY_TABLES for one in part.calls(key)):
        if part.calls("friction") and body.callee.name in STRAIGHT:
            yield (
                "friction",
                (
                    f"{part.label}: [friction] has no effect, as {STRAIGHT[body.callee.name]} "
                    "moves along its normal only: leave it out"
                ),
            )


def _of_solvers(part: Part) -> Iterator[Finding]:
    """Yield methods for steps that the case does not have, and solvers that have failed before."""
    laws = [one.callee.name for one in part.calls("friction") if one.callee.name != "Frictionless"]
    rubs = laws[0] if laws else ""
    for table in ("solver", "escalation"):
        for one in (one for one in part.calls(table) if one.callee.name == "Condensed"):
            yield from _of_condensed(part.label, table, one.arguments, rubs)
    for one, other in combinations([*part.calls("solver"), *part.calls("escalation")], 2):
        if one == other:
            yield (
                "escalation",
                (
                    f"{part.label}: [[escalation]] names {other.callee.name} with the same keys as "
                    "the solver before it, which has failed by then: leave it out, or change a key"
                ),
            )


def _of_condensed(label: str, table: str, keys: Mapping[str, Node], rubs: str) -> Iterator[Finding]:
    """Yield keys of the condensed solver without effect.

    ``rubs`` is the law of friction, or empty.
    """
    if rubs and "method" in keys:
        yield (
            table,
            (
                f"{label}: [{table}] method is for contact without friction, and [friction] is "
                "given: give friction_method in its place, or leave it out"
            ),
        )
    for key in (one for one in ("friction_method", "rates") if one in keys and not rubs):
        yield (
            table,
            (
                f"{label}: [{table}] {key} is for contact with friction, and there is no "
                "[friction]: give the friction, or leave it out"
            ),
        )
    if "rates" in keys and rubs in WITHOUT_RATES:
        yield (
            table,
            (
                f"{label}: [{table}] rates is for friction that depends on the slip rate, and "
                f"{rubs} does not: leave it out"
            ),
        )


def _twice(part: Part) -> Iterator[Finding]:
    """Yield the same load, dashpots or excitation, word for word."""
    system = part.tables.get("system", {})
    lists = {f"system.{key}": system.get(key) for key in ("loads", "dashpots")}
    lists["excitation"] = part.tables.get("excitation")
    for key, given in lists.items():
        for one, other in combinations(given if isinstance(given, list) else (), 2):
            if one == other:
                yield (
                    key,
                    (
                        f"{part.label}: [[{key}]] has two tables that are alike, word for word: "
                        "leave one of them out, or give one of twice the size"
                    ),
                )


def _recorded_weight(part: Part) -> Iterator[Finding]:
    """Yield recorders that take off a weight which the body does not have."""
    loads = [one for one in walk_nodes(part.system.get("loads", ())) if isinstance(one, Call)]
    if part.calls("gravity") or any(one.callee.name == "BodyForce" for one in loads):
        return
    for one in part.calls("record"):
        if "gravity" in one.arguments:
            yield (
                "record",
                (
                    f"{part.label}: [[record]] {one.callee.name} has gravity, and the body has no "
                    "weight: give [gravity], or leave it out"
                ),
            )


def _start(parts: Sequence[Part]) -> Iterator[Finding]:
    """Yield initial values that a static equilibrium, or the stage before, takes away."""
    first, *later = parts
    weighted = "[gravity]" if "gravity" in first.nodes else ""
    at_rest = "the static stage" if first.static else weighted
    if at_rest and "initial_velocity" in first.system:
        yield (
            "system.initial_velocity",
            (
                f"{first.label}: [system] initial_velocity is lost, as {at_rest} lets the body "
                "begin at rest, in equilibrium: leave one of the two out"
            ),
        )
    for part in later:
        for key in (one for one in AT_START if one in part.system and one not in first.system):
            yield (
                f"system.{key}",
                (
                    f"{part.label}: system has {key}, and a stage begins where the stage before "
                    "has left the body: give it in the first stage, or leave it out"
                ),
            )


def _ground(path: Path, parts: Sequence[Part]) -> Iterator[Finding]:
    """Yield masses of held nodes that no ground motion and no weight accelerates."""
    given = any("base_inertia" in part.system for part in parts)
    if given and not any(part.calls("excitation") or part.calls("gravity") for part in parts):
        yield (
            "system.base_inertia",
            (
                f"{path}: [system] base_inertia is about the inertia load of a ground motion, and "
                "there is no [[excitation]]: leave it out"
            ),
        )


def _replaced(path: Path, tables: Mapping[str, Any]) -> Iterator[Finding]:
    """Yield tables of the case, and keys of its [system], that no stage takes over."""
    stages = tables["stage"]
    moving = [one for one in stages if one.get("type") == "dynamic"]
    for key in (one for one in WHOLE if one in tables):
        readers = moving if key in OF_MOTION else stages
        if readers and all(one.get(key) for one in readers):  # excitation = [] takes it away
            yield (
                key,
                (
                    f"{path}: [{key}] is read by no stage, as every [[stage]] that could read it "
                    "has its own: leave it out there or here"
                ),
            )
    own = tables.get("system")
    for key in own if isinstance(own, Mapping) else ():
        if all(key in one.get("system", {}) for one in stages):
            yield (
                f"system.{key}",
                (
                    f"{path}: [system] {key} is read by no stage, as every [[stage]] has its own: "
                    "leave it out there or here"
                ),
            )


def _released(path: Path, tables: Mapping[str, Any]) -> Iterator[Finding]:
    """Yield stages that release supports and have all those of the stage before."""
    stages = tables["stage"]
    systems = [{**tables.get("system", {}), **one.get("system", {})} for one in stages]
    held = [[one.get(key) for key in SUPPORTS] for one in systems]
    for before, own, stage in zip(held, held[1:], stages[1:], strict=False):
        if stage.get("release") is True and before == own:
            yield (
                "stage",
                (
                    f"{path}: [[stage]] '{stage.get('name')}' has release = true, and the supports "
                    "of the stage before it: leave it out, or change the supports"
                ),
            )
