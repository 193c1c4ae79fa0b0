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
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

from ....core.errors import InputError
from .bodies import BODY_TABLES
from .stage_tables import OF_MOTION, WHOLE
from .table_calls import Call, Node, list_calls, walk_nodes

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
SUPPORTS = ("fixed", "prescribed", "tied", "dashpots")
AT_START = ("initial_displacement", "initial_velocity")
Finding = tuple[str, str]  # the key that is in vain, and the sentence


@dataclass(frozen=True)
class Part:
    """Hold a stage, or the whole of a case without stages.

    Attributes:
        label: how sentences begin.
        tables: its tables.
        nodes: the calls that they are.
        static: whether it is a static stage.
    """

    label: str
    tables: Mapping[str, Any]
    nodes: Mapping[str, Node]
    static: bool = False

    def list_calls(self, table: str) -> list[Call]:
        """Return the calls that a table, or an array of tables, makes itself; those in them not."""
        return list_calls(self.nodes.get(table, ()))

    @property
    def system(self) -> Mapping[str, Node]:
        """Return the arguments of [system]."""
        arguments: Mapping[str, Node] = (
            self.nodes["system"].arguments if "system" in self.nodes else {}
        )
        return arguments


def find_unread(path: Path, tables: Mapping[str, Any], parts: Sequence[Part]) -> Iterator[Finding]:
    """Yield all choices without effect.

    Args:
        path: of the case file.
        tables: of the file, with its stages.
        parts: the stages in their order, or the one whole case.

    Yields:
        The key that is in vain, and the sentence.
    """
    yield from _find_unused_materials(path, tables, parts)
    for part in parts:
        yield from _find_vain_ratios(part)
        yield from _find_vain_contact_laws(part)
        yield from _find_vain_water(part)
        yield from _find_vain_solvers(part)
        yield from _find_doubles(part)
        yield from _find_vain_recorders(part)
    yield from _find_lost_initial_values(parts)
    yield from _find_vain_inertia(path, parts)
    if "stage" in tables:
        yield from _find_replaced_tables(path, tables)
        yield from _find_vain_releases(path, tables)


def find_left_over(path: Path, tables: Mapping[str, Any]) -> Iterator[str]:
    """Yield a sentence for each table that waits for a motion in a case of static stages.

    These are no mistake, as one looks at the weight alone before the motion is added: they are
    told.
    """
    stages = tables.get("stage", ())
    if stages and all(stage.get("type") == "static" for stage in stages):
        for key in (*OF_MOTION, "sheet"):
            if key in tables:
                yield (
                    f"[{key}] of {path} is for motions and is not read, as every [[stage]] is "
                    "static"
                )


def refuse_unread(
    unread: Sequence[Finding], before: Sequence[Finding], settings: Sequence[str]
) -> None:
    """Raise InputError with the first finding that settings of other tables have not made.

    Args:
        unread: findings in the file with its settings.
        before: findings in the file without them; none where the file alone is no case.
        settings: the KEY=VALUE made after reading.
    """
    keys_before = {key for key, _ in before}
    keys_of_settings = [setting.partition("=")[0].strip() for setting in settings]
    tables_of_settings = {key.partition(".")[0] for key in keys_of_settings}
    for key, sentence in unread:
        table = key.partition(".")[0]
        if not settings or key in keys_before or table in tables_of_settings:
            raise InputError(sentence)


def _find_unused_materials(
    path: Path, tables: Mapping[str, Any], parts: Sequence[Part]
) -> Iterator[Finding]:
    """Yield materials that no stage's [system] names.

    They are for cells or for what is behind a boundary.
    """
    named = tables.get("material")
    for name in named if isinstance(named, Mapping) else ():
        if not any(_names_material(part, name) for part in parts):
            yield (
                f"material.{name}",
                (
                    f"{path}: [material.{name}] is of nothing, as [system] does not name it: give "
                    "its cell group in [system] material, or leave it out"
                ),
            )


def _names_material(part: Part, name: str) -> bool:
    """Tell whether [system] names a material: the same object is in both."""
    material = part.nodes["material"][name]
    return any(node is material for node in walk_nodes(part.nodes["system"]))


def _find_vain_ratios(part: Part) -> Iterator[Finding]:
    """Yield the law of damping ratios without a ratio, and ratios without the law."""
    law = part.system.get("damping")
    word = law.callee.name if isinstance(law, Call) else "NoDamping"
    material = part.system.get("material", ())
    used = {id(node) for node in walk_nodes(material) if isinstance(node, Call)}
    named = part.nodes.get("material", {})
    names = [name for name, node in named.items() if id(node) in used]
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


def _find_vain_contact_laws(part: Part) -> Iterator[Finding]:
    """Yield laws of contact where there is none.

    It yields them too where there is none that they act on, or another before them.
    """
    surfaces = [call for key in ("contact", *BODY_TABLES) for call in part.list_calls(key)]
    yield from _find_friction_without_slip(part)
    yield from _find_replaced_friction(part)
    for table, happens in OF_CONTACT.items():
        laws = part.list_calls(table)
        # A law of masses of others may change all masses.
        changes_all = table == "mass" and bool(laws) and laws[0].callee.name not in MASSES
        if laws and not surfaces and not changes_all:
            yield (
                table,
                (
                    f"{part.label}: [{table}] has no effect, as nothing {happens} without "
                    "[[contact]]: give the contact, or leave it out"
                ),
            )
    on_springs = bool(surfaces) and all("springs" in call.arguments for call in surfaces)
    if part.list_calls("impact") and on_springs:
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
    if part.list_calls("mass") and any(
        "mass" in call.arguments for call in part.list_calls("scheme")
    ):
        yield (
            "scheme.mass",
            (
                f"{part.label}: [scheme] mass is not read, as [mass] comes before it: leave one of "
                "the two out"
            ),
        )


def _find_friction_without_slip(part: Part) -> Iterator[Finding]:
    """Yield friction of a body that cannot slide."""
    for body in (call for key in BODY_TABLES for call in part.list_calls(key)):
        if part.list_calls("friction") and body.callee.name in STRAIGHT:
            yield (
                "friction",
                (
                    f"{part.label}: [friction] has no effect, as {STRAIGHT[body.callee.name]} "
                    "moves along its normal only: leave it out"
                ),
            )


def _find_replaced_friction(part: Part) -> Iterator[Finding]:
    """Yield friction of which no contact has the coefficient."""
    contacts = part.list_calls("contact")
    all_have = bool(contacts) and all("mu" in contact.arguments for contact in contacts)
    if part.list_calls("friction") and all_have:
        yield (
            "friction",
            (
                f"{part.label}: [friction] has no effect, as every [[contact]] has a mu of its "
                "own: leave it out"
            ),
        )


def _find_friction(part: Part) -> str:
    """Return the word of the law of friction; "" without."""
    if any(contact.arguments.get("mu") is not None for contact in part.list_calls("contact")):
        return "Coulomb"
    laws = [call.callee.name for call in part.list_calls("friction")]
    return next((law for law in laws if law != "Frictionless"), "")


def _find_vain_water(part: Part) -> Iterator[Finding]:
    """Yield the efficiency of drains that are not there, and numbers of silt without silt."""
    for call in part.list_calls("contact"):
        for node in walk_nodes(call):
            is_water = isinstance(node, Call) and node.callee.name == "JointWater"
            if is_water and "efficiency" in node.arguments and "drain" not in node.arguments:
                yield (
                    "contact",
                    (
                        f"{part.label}: [contact.joint.water] efficiency is of drains, and there "
                        "are none: give drain, their distance from the heel, or leave efficiency "
                        "out"
                    ),
                )
    for call in part.list_calls("reservoir"):
        for name in ("silt_weight", "silt_ratio"):
            if name in call.arguments and "silt" not in call.arguments:
                yield (
                    "reservoir",
                    (
                        f"{part.label}: [reservoir] {name} is of silt, and there is none: give "
                        f"silt, the height of its top, or leave {name} out"
                    ),
                )


def _find_vain_solvers(part: Part) -> Iterator[Finding]:
    """Yield methods for steps that the case does not have, and solvers that have failed before."""
    friction = _find_friction(part)
    for table in ("solver", "escalation"):
        for call in part.list_calls(table):
            if call.callee.name == "Condensed":
                yield from _find_vain_keys_of_condensed(part.label, table, call.arguments, friction)
    for earlier, later in combinations(
        [*part.list_calls("solver"), *part.list_calls("escalation")], 2
    ):
        if earlier == later:
            yield (
                "escalation",
                (
                    f"{part.label}: [[escalation]] names {later.callee.name} with the same keys as "
                    "the solver before it, which has failed by then: leave it out, or change a key"
                ),
            )


def _find_vain_keys_of_condensed(
    label: str, table: str, keys: Mapping[str, Node], friction: str
) -> Iterator[Finding]:
    """Yield keys of the condensed solver without effect.

    Args:
        label: how sentences begin.
        table: "solver" or "escalation".
        keys: of the solver.
        friction: the law of friction; "" without.
    """
    if friction and "method" in keys:
        yield (
            table,
            (
                f"{label}: [{table}] method is for contact without friction, and [friction] is "
                "given: give friction_method in its place, or leave it out"
            ),
        )
    for key in ("friction_method", "rates"):
        if key in keys and not friction:
            yield (
                table,
                (
                    f"{label}: [{table}] {key} is for contact with friction, and there is no "
                    "[friction]: give the friction, or leave it out"
                ),
            )
    if "rates" in keys and friction in WITHOUT_RATES:
        yield (
            table,
            (
                f"{label}: [{table}] rates is for friction that depends on the slip rate, and "
                f"{friction} does not: leave it out"
            ),
        )


def _find_doubles(part: Part) -> Iterator[Finding]:
    """Yield the same load, dashpots or excitation, word for word."""
    system = part.tables.get("system", {})
    lists = {f"system.{key}": system.get(key) for key in ("loads", "dashpots")}
    lists["excitation"] = part.tables.get("excitation")
    for key, tables in lists.items():
        for first, second in combinations(tables if isinstance(tables, list) else (), 2):
            if first == second:
                yield (
                    key,
                    (
                        f"{part.label}: [[{key}]] has two tables that are alike, word for word: "
                        "leave one of them out, or give one of twice the size"
                    ),
                )


def _find_vain_recorders(part: Part) -> Iterator[Finding]:
    """Yield recorders that take off a weight which the body does not have."""
    loads = [node for node in walk_nodes(part.system.get("loads", ())) if isinstance(node, Call)]
    if part.list_calls("gravity") or any(load.callee.name == "BodyForce" for load in loads):
        return
    for recorder in part.list_calls("record"):
        if "gravity" in recorder.arguments:
            yield (
                "record",
                (
                    f"{part.label}: [[record]] {recorder.callee.name} has gravity, and the body "
                    "has no weight: give [gravity], or leave it out"
                ),
            )


def _find_lost_initial_values(parts: Sequence[Part]) -> Iterator[Finding]:
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
        for key in AT_START:
            if key in part.system and key not in first.system:
                yield (
                    f"system.{key}",
                    (
                        f"{part.label}: system has {key}, and a stage begins where the stage "
                        "before has left the body: give it in the first stage, or leave it out"
                    ),
                )


def _find_vain_inertia(path: Path, parts: Sequence[Part]) -> Iterator[Finding]:
    """Yield masses of held nodes that no ground motion and no weight accelerates."""
    has_inertia = any("base_inertia" in part.system for part in parts)
    accelerated = any(part.list_calls("excitation") or part.list_calls("gravity") for part in parts)
    if has_inertia and not accelerated:
        yield (
            "system.base_inertia",
            (
                f"{path}: [system] base_inertia is about the inertia load of a ground motion, and "
                "there is no [[excitation]]: leave it out"
            ),
        )


def _find_replaced_tables(path: Path, tables: Mapping[str, Any]) -> Iterator[Finding]:
    """Yield tables of the case, and keys of its [system], that no stage takes over."""
    stages = tables["stage"]
    moving = [stage for stage in stages if stage.get("type") == "dynamic"]
    for key in WHOLE:
        if key not in tables:
            continue
        readers = moving if key in OF_MOTION else stages
        if readers and all(stage.get(key) for stage in readers):  # excitation = [] takes it away
            yield (
                key,
                (
                    f"{path}: [{key}] is read by no stage, as every [[stage]] that could read it "
                    "has its own: leave it out there or here"
                ),
            )
    own = tables.get("system")
    for key in own if isinstance(own, Mapping) else ():
        if all(key in stage.get("system", {}) for stage in stages):
            yield (
                f"system.{key}",
                (
                    f"{path}: [system] {key} is read by no stage, as every [[stage]] has its own: "
                    "leave it out there or here"
                ),
            )


def _find_vain_releases(path: Path, tables: Mapping[str, Any]) -> Iterator[Finding]:
    """Yield stages that release supports and have all those of the stage before."""
    stages = tables["stage"]
    supports = [_list_supports(tables.get("system", {}) | own.get("system", {})) for own in stages]
    for (before, after), stage in zip(pairwise(supports), stages[1:], strict=True):
        if stage.get("release") is True and before == after:
            yield (
                "stage",
                (
                    f"{path}: [[stage]] '{stage.get('name')}' has release = true, and the supports "
                    "of the stage before it: leave it out, or change the supports"
                ),
            )


def _list_supports(system: Mapping[str, Any]) -> list[Any]:
    """Return what holds the body, of each kind."""
    return [system.get(key) for key in SUPPORTS]
