"""Describe the model that a case file makes, before any step.

This is what ``run --check`` tells and model.json holds.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ....core.algebra import Array, Comm, largest, total
from ....core.files import on_root, to_json, write_atomically
from ....core.problem import ContactProblem
from ....core.step import AXES
from ....fem.body.space import space_of
from ....fem.mesh.tagged_mesh import Cells, Facets
from ....fem.output.outline import cell_volumes, facets_with_cells, longest_edge, outline
from ....run.damping import NOT_COMPUTED, describe_damping, first_modes, first_open_period
from ....run.files.folder import MODEL
from ....run.loose_bodies import judge_loose_bodies
from ....run.sampling import sampling_warning
from ....run.time_steps import StepPlan
from ...ground_motion.excitation import GroundMotion
from ...ground_motion.record import Record
from .bodies import Body
from .table_calls import Call, Group, build, walk_nodes
from .unread_choices import find_left_over
from .vocabulary import Parts

# Of first order in a wave length: Kuhlemeyer and Lysmer (1973); the cautious take 10.
ELEMENTS = 8.0
STEPS = 20.0  # in a period
PASSAGE = 10.0  # steps in the time b/V of a layer (CHOSEN; the demos take 20)
# Edges of side 2 over those of side 1: more points than a softer side can follow (CHOSEN).
COARSER = 1.2
ENERGY = 0.95  # of a record, the integral of |A(f)|², below the frequency that is told
ROUNDED = 1e-9  # of a time step
# unknowns: up to so many a run tells its periods, which take two seconds; more when it is checked
FEW = 10_000
DIGITS = 10  # of a number: those beyond depend on the number of ranks
RATIO_DIGITS = 4  # of the damping ratio of a mode, which is found less sharply than its period


@dataclass(frozen=True)
class _Part:
    """Say a part of the description of a model.

    Attributes:
        text: filled in with the model, or with each entry of its list ``key``.
        key: a list of the model, None for the model itself.
        heading: the line before the first entry of the list.
        needs: a key without which the model, or an entry, is left out; "" for none.
        without: a key with which it is left out; "" for none.
    """

    text: str
    key: str | None = None
    heading: str = ""
    needs: str = ""
    without: str = ""

    def fits(self, entry: Mapping[str, Any]) -> bool:
        """Say whether the part is about such an entry."""
        return (not self.needs or self.needs in entry) and self.without not in entry


# What the description of a model says, line by line.
PARTS = (
    _Part(
        needs="degree",
        text="{title}\n{dimension}D, {unknowns} unknowns of degree {degree}, {mass:.4g} kg",
    ),
    _Part(without="degree", text="{title}\n{dimension}D, {unknowns} unknown, {mass:.4g} kg"),
    _Part(key="groups", heading="groups of the mesh:", text="  {name} ({kind})"),
    _Part(
        key="bodies",
        needs="cells",
        heading="bodies:",
        text="  {name}: {cells} cells, {mass:.4g} kg; {material}",
    ),
    _Part(
        key="bodies",
        without="cells",
        heading="bodies:",
        text="  {name}: {mass:.4g} kg, {material}",
    ),
    _Part(key="supports", heading="supports:", text="  {groups}: {kind} along {components}"),
    _Part(
        key="contact",
        needs="size",
        heading="contact:",
        text="  {name}: {points} points on {size:.4g} m²; {friction}",
    ),
    _Part(
        key="contact",
        needs="gap",
        heading="contact:",
        text="  {name}: one point, {gap:.4g} m before the wall; {friction}",
    ),
    _Part(
        key="layers",
        heading="layer before the obstacle:",
        text="  {width:.4g} m wide, passed in b/V = {passage:.4g} s at {speed:.4g} m/s",
    ),
    _Part(key="contact", needs="size", heading="contact nodes:", text="  {name}: {nodes}"),
    _Part(
        key="waves",
        heading="shear waves:",
        text=(
            "  {body}: {c_s:.4g} m/s; edges of {h:.3g} m, 8 edges in a wave length up to "
            "{f_max:.3g} Hz; a wave passes {dt_ratio:.3g} edges in a step"
        ),
    ),
    _Part(
        key="records",
        heading="records:",
        text=(
            "  {file}, scaled by {scale:g}: peak {pga:.3g} m/s², {duration:.4g} s in steps "
            "of {dt:.4g} s, 95 % of its energy below {f_95:.3g} Hz"
        ),
    ),
    _Part(
        needs="periods",
        text=(
            "natural periods, contact closed where it touches at the start: {periods} "
            "s\nrigid motions that are left: {rigid_motions}"
        ),
    ),
    _Part(text="damping: {damping}"),
    _Part(text="run: {run[steps]} steps of {run[dt]:.4g} s, {run[t_end]:.4g} s"),
)


def describe(
    case: Any, comm: Any, parts: Parts | None = None, *, most: int = 50_000
) -> dict[str, Any]:
    """Return what the model of a ``Case`` is, plain values in SI units; computes no step.

    The same on any number of ranks. Collective.

    Args:
        case: a ``Case``.
        comm: the ranks.
        parts: those of the case, when they are known.
        most: unknowns beyond which periods are left out.

    Returns:
        Tables and lists of tables; [..] are units.

        - title, dimension, unknowns, degree (of a body with elements), mass [kg];
        - groups: name, kind;
        - bodies: name, cells, mass [kg], material;
        - supports: kind, groups, components;
        - contact: name, points, size [m²], friction, nodes: a sentence, places, others: kind ->
          places, sides: name, h [m] and G [Pa] of both; of a body without mesh gap [m] in the place
          of a size;
        - layers: width [m], speed [m/s], passage: their quotient [s];
        - periods [s], damping_ratios of their modes and rigid_motions with the contact closed where
          it touches at the start, and sticking where there is friction; periods_open, the first one
          with it open, where it touches;
        - damping: in words, "none" without;
        - waves: body, c_s [m/s], h: the longest edge over the degree [m], f_max = c_s / (8 h) [Hz],
          dt_ratio = dt c_s / h;
        - records: file, scale, dt [s], duration [s], pga [m/s²], f_95 [Hz]: 95 % of its energy are
          below;
        - run: dt [s], t_end [s], steps;
        - outline: group, lines; on rank 0;
        - defects and warnings: sentences.

    Raises:
        InputError: as of a run.
    """
    parts = parts or case.parts(comm)
    problem = case.problem(comm, parts)
    plan = case.plan(parts)
    tags = parts.tags or {}
    if case.body is None:
        body = _describe_meshed_body(problem, tags)
        contact = list(_describe_contact(case, problem, tags))
    else:
        body = case.body.description
        contact = [_describe_contact_point(case.body, problem)]
    run = {"dt": plan.dt(0), "t_end": plan.length, "steps": plan.steps}
    degree = {"degree": body["degree"]} if "degree" in body else {}
    model = {
        "title": case.tables.get("title") or case.path.stem,
        "dimension": problem.system.space.dimension,
        "unknowns": problem.system.space.unknowns,
        **degree,
        "mass": body["mass"],
        "groups": [
            {"name": name, "kind": type(group).__name__.lower()} for name, group in tags.items()
        ],
        "bodies": [_select_keys(part) for part in body["bodies"]],
        "supports": body["supports"],
        "contact": contact,
        "layers": [] if case.layer is None else [_describe_layer(case.layer)],
        "waves": [_describe_waves(part, run["dt"]) for part in body["bodies"] if "c_s" in part],
        "records": _describe_records(case, parts.system),
        "run": run,
        "outline": body["outline"],
    } | _describe_modes(case, problem, most)

    _add_findings(model, case, problem, plan)

    # Plain values, rounded: digits beyond depend on the number of ranks.
    text = to_json(model)
    return dict(json.loads(text, parse_float=lambda digits: float(f"{float(digits):.{DIGITS}g}")))


def _add_findings(
    model: dict[str, Any], case: Any, problem: ContactProblem, plan: StepPlan
) -> None:
    """Add to a model its defects, and what an engineer should look at; collective."""
    model["defects"] = list(_find_defects(model))
    model["warnings"] = [*_find_warnings(model), *find_left_over(case.path, case.tables)]
    for sentence, refused in judge_loose_bodies(problem) if problem.system.floating else ():
        model["defects" if refused else "warnings"].append(sentence)

    # A step that leaves out samples of a record is a defect already.
    dt = model["run"]["dt"]
    if not any(dt > record["dt"] * (1.0 + ROUNDED) for record in model["records"]):
        warning = sampling_warning(problem, max(step for step, _ in plan.parts))
        if warning:
            model["warnings"].append(warning)


def _select_keys(part: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a body is, without the numbers of its waves."""
    keys = ("name", "cells", "mass", "material")
    return {key: part[key] for key in keys if key in part}


def _describe_waves(part: Mapping[str, Any], dt: float) -> dict[str, Any]:
    """Return the shear waves of a body, and which of them its elements and a step can follow."""
    c_s = part["c_s"]
    h = part["h"]
    return {
        "body": part["name"],
        "c_s": c_s,
        "h": h,
        "f_max": c_s / (ELEMENTS * h),
        "dt_ratio": dt * c_s / h,
    }


def _describe_meshed_body(problem: ContactProblem, tags: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is told of bodies with a mesh, as ``Body.description`` has it of others."""
    space = space_of("describe", problem.system)
    volumes = cell_volumes(space.mesh)
    materials = space.forms.materials
    bodies = [_describe_body(space, tags, volumes, *material) for material in materials]
    return {
        "degree": space.degree,
        "mass": sum(body["mass"] for body in bodies),
        "bodies": bodies,
        "supports": list(_describe_supports(space)),
        "outline": outline(space, tags, [cells for cells, _ in materials]),
    }


def put_in_words(model: Mapping[str, Any]) -> str:
    """Return what ``describe`` found, as lines of text."""
    lines = []
    for part in PARTS:
        entries = [model] if part.key is None else model[part.key]
        entries = [entry for entry in entries if part.fits(entry)]
        if entries and part.heading:
            lines.append(part.heading)
        for entry in entries:
            words = {key: _put_in_word(value) for key, value in entry.items()}
            lines.append(part.text.format(**words))
    return "\n".join([*lines, *(f"warning: {warning}" for warning in model["warnings"])])


def _put_in_word(value: Any) -> Any:
    """Return lists and materials as texts, all else as it is."""
    if isinstance(value, Mapping) and "type" in value:
        value = [f"{key} {number:.4g}" for key, number in value.items() if key != "type"]
    if not isinstance(value, list):
        return value
    entries = [f"{entry:.4g}" if isinstance(entry, float) else str(entry) for entry in value]
    return ", ".join(entries)


def _describe_body(
    space: Any, tags: Mapping[str, Any], volumes: Array, cells: Any, material: Any
) -> dict[str, Any]:
    """Return what is made of one material; collective.

    It is known by the name of its cell group, and has its slowest waves and longest edge.

    Args:
        space: of the body.
        tags: groups of the mesh.
        volumes: (owned cells,) [m³], in the plane per metre.
        cells: of the material, ghosts among them.
        material: the material.
    """
    names = [
        name
        for name, group in tags.items()
        if isinstance(group, Cells)
        and not largest(space.comm, not np.array_equal(group.indices, cells))
    ]
    owned = cells[cells < len(volumes)]
    density, shear = (space.forms.cellwise(field)[owned] for field in ("rho", "shear"))

    # The slowest shear waves of an orthotropic material are those of its smallest shear modulus; in
    # the plane those of the modulus in this plane, across the axis that is nearest to z.
    if hasattr(material, "G12"):
        G = (material.G23, material.G13, material.G12)  # in the planes across axes 1, 2, 3
        z = int(np.argmax(np.abs(np.asarray(material.axes)[2]))) if np.ndim(material.axes) else 2
        shear = density / material.rho * (G[z] if space.dimension == 2 else min(G))

    numbers = {
        key: value for key, value in vars(material).items() if isinstance(value, int | float)
    }
    if not numbers.get("xi", 1.0):  # a material without damping has no ratio to tell
        numbers.pop("xi")
    return {
        "name": (names or ["body"])[0],
        "cells": round(total(space.comm, len(owned))),
        "mass": total(space.comm, volumes[owned] @ density),
        "material": {"type": type(material).__name__} | numbers,
        "c_s": -largest(space.comm, np.max(-np.sqrt(shear / density), initial=-np.inf)),
        "h": largest(space.comm, longest_edge(space.mesh, owned)) / space.degree,
    }


def _describe_supports(space: Any) -> Iterator[dict[str, Any]]:
    """Yield what holds the bodies, moves them, absorbs or lets in waves.

    Ties of sides to each other are among it.
    """
    for support in space.prescribed:
        kind = "fixed" if support.components is None else "roller, fixed"
        if support.moves:
            kind = "moved"
        yield _describe_support(space, kind, [support.name], support.components)
    for boundary in space.forms.boundaries:
        yield _describe_support(space, type(boundary).__name__, [boundary.facets.name], None)
    for tie in space.ties:
        yield _describe_support(space, "tied", [tie.first.name, tie.second.name], tie.components)


def _describe_support(
    space: Any, kind: str, groups: list[str], components: Sequence[int] | None
) -> dict[str, Any]:
    """Return a support, with the names of its components; None stands for all."""
    axes = range(space.dimension) if components is None else components
    return {"kind": kind, "groups": groups, "components": [AXES[axis] for axis in axes]}


def _describe_contact(
    case: Any, problem: ContactProblem, tags: Mapping[str, Any]
) -> Iterator[dict[str, Any]]:
    """Yield the parts of the contact, one for each table; collective.

    Each goes by its name, or by those of its groups.
    """
    surface = problem.surface
    tables = case.nodes.get("contact", ())
    nodes = tables if isinstance(tables, tuple) else (tables,)

    # The points of the whole surface, on all ranks, are those of one table after the other.
    whole = surface.whole()
    parts = getattr(surface, "parts", ())
    ends = np.cumsum([0, *(round(total(surface.comm, len(part.slots))) for part in parts)])
    for number, (node, (a, b)) in enumerate(zip(nodes, pairwise(ends), strict=True)):
        groups = [inner.name for inner in walk_nodes(node) if isinstance(inner, Group)]
        census = surface.censuses[number] if len(surface.censuses) == len(parts) else None
        yield {
            "name": node.arguments.get("name") or " on ".join(groups),
            "points": int(b - a),
            "size": float(whole.weights[a:b].sum()),
            "friction": repr(problem.friction),
            "nodes": "" if census is None else census.in_words(),
            "places": whole.points[a:b],
            "others": {} if census is None else census.places,
            "sides": _describe_sides(problem.system.space, tags, groups, whole.points[a:b]),
        }


def _describe_contact_point(body: Body, problem: ContactProblem) -> dict[str, Any]:
    """Return the contact point of a body without a mesh, at which pressures are forces."""
    return {
        "name": body.point,
        "points": 1,
        "gap": float(problem.surface.gap0[0]),
        "friction": repr(problem.friction),
        "nodes": "",
        "places": problem.surface.whole().points,
        "others": {},
        "sides": [],
    }


def _describe_layer(law: Any) -> dict[str, float]:
    """Return what there is to tell of a layer; its speed is V, at which restitution is wanted."""
    width = law.layer.width
    speed = law.layer.v
    return {"width": width, "speed": speed, "passage": width / speed}


def _describe_sides(
    space: Any, tags: Mapping[str, Any], names: Sequence[str], points: Array
) -> list[dict[str, Any]]:
    """Return (name, mean edge h [m], shear modulus G [Pa]) of both sides of a pair.

    They are those of their facets that are no further from the box of the contact points than an
    edge; there are none where a table has no two groups of facets.
    """
    sides = [tags[name] for name in names if isinstance(tags.get(name), Facets)]
    if len(sides) != 2 or len(names) != 2 or not len(points):
        return []
    descriptions: list[dict[str, Any]] = []
    for side in sides:
        middles, edges, cells = facets_with_cells(space.mesh, side.indices)
        slack = largest(space.comm, edges.max(initial=0.0))
        near = np.all(
            (middles >= points.min(axis=0) - slack) & (middles <= points.max(axis=0) + slack),
            axis=1,
        )
        shear = space.forms.cellwise("shear")[cells[near]]
        count, h, G = space.comm.sum(np.array([near.sum(), edges[near].sum(), shear.sum()]))
        facets = max(count, 1.0)
        descriptions.append({"name": side.name, "h": h / facets, "G": G / facets})
    return descriptions


def _describe_records(case: Any, system: Any) -> list[dict[str, Any]]:
    """Return the records of the excitations, each once.

    Those of motions that come up through the base alone are among them.
    """
    system_nodes = walk_nodes(case.nodes.get("system", ()))
    calls = [node for node in system_nodes if isinstance(node, Call)]
    motions = list(case.excitations(system=system))
    for call in calls:
        if call.callee.name == "upgoing":
            rising = build(call.arguments.get("motion", ()), {"system": system})
            motions += rising if isinstance(rising, tuple) else (rising,)

    descriptions: list[dict[str, Any]] = []
    for motion in motions:
        shaking = GroundMotion(motion) if isinstance(motion, Record) else motion
        if isinstance(shaking, GroundMotion):
            description = _describe_record(shaking)
            if description not in descriptions:
                descriptions.append(description)
    return descriptions


def _describe_record(motion: GroundMotion) -> dict[str, Any]:
    """Return a record and the frequency [Hz] below which ENERGY of its energy is.

    A synthetic one is named by its seed.
    """
    record = motion.record
    power = np.cumsum(np.abs(np.fft.rfft(record.acceleration)) ** 2)
    frequencies = np.fft.rfftfreq(record.acceleration.size, record.dt)
    highest = frequencies[np.searchsorted(power, ENERGY * power[-1])]
    return {
        "file": Path(record.source).name or f"synthetic, {record.title.rpartition(', ')[2]}",
        "scale": motion.scale,
        "dt": record.dt,
        "duration": record.duration,
        "f_95": float(highest),
        "pga": float(np.abs(motion.scale * record.acceleration).max()),
    }


def _describe_modes(case: Any, problem: ContactProblem, most: int) -> dict[str, Any]:
    """Return natural periods [s] and the damping of a problem.

    It may have up to ``most`` unknowns. Collective.
    """
    few = problem.system.space.unknowns <= most
    modes: dict[str, Any] = {}
    if few and problem.system.space.unknowns > 1:  # a particle has no periods
        closed = first_modes(problem)
        modes = {"periods": list(closed.periods), "rigid_motions": closed.rigid_motions}
        opened = first_open_period(problem)
        if opened is not None:
            modes["periods_open"] = [opened]
        modes["damping_ratios"] = [float(f"{ratio:.{RATIO_DIGITS}g}") for ratio in closed.ratios]
    if "strain_compatible" in case.nodes:  # the system has the damping of other cells only
        words = "that of the curves of [strain_compatible], which the run finds"
        return {**modes, "damping_ratios": [], "damping": words}
    if problem.system.C is None and "periods" not in modes and few:
        return {**modes, "damping_ratios": [], "damping": "none"}
    unknown = "" if few else f"{NOT_COMPUTED}, as the model has more than {most} unknowns"
    return {**modes, "damping": describe_damping(problem, unknown=unknown)}


def _find_defects(model: Mapping[str, Any]) -> Iterator[str]:
    """Yield why records do not fit to each other or to the time step, a sentence each."""
    dt = model["run"]["dt"]
    for first, second in pairwise(model["records"]):
        files = f"'{first['file']}' and '{second['file']}'"
        if abs(first["dt"] - second["dt"]) > ROUNDED * first["dt"]:
            yield (
                f"{files} have samples every {first['dt']:g} and "
                f"{second['dt']:g} s: bring them to one step with record = "
                f'{{path = "FILE", resample_dt = {first["dt"]:g}}}'
            )
        if abs(first["duration"] - second["duration"]) > ROUNDED * first["duration"]:
            yield (
                f"{files} last {first['duration']:g} and "
                f"{second['duration']:g} s: trim or pad one of them in its table of processing"
            )
    for record in model["records"]:
        if dt > record["dt"] * (1.0 + ROUNDED):
            yield (
                f"the time step of {dt:g} s leaves out samples of '{record['file']}', which has "
                f"one every {record['dt']:g} s: shorten [run] dt, or give the record resample_dt "
                f"= {dt:g}"
            )


def _find_warnings(model: Mapping[str, Any]) -> Iterator[str]:
    """Yield what an engineer should look at, a sentence each."""
    yield from _find_coarse_meshes(model)
    yield from _find_long_steps(model)


def _find_coarse_meshes(model: Mapping[str, Any]) -> Iterator[str]:
    """Tell of elements that are too long."""
    # Elements too long for the shear waves of the record with the highest frequencies.
    for record in sorted(model["records"], key=lambda record: float(record["f_95"]))[-1:]:
        for wave in model["waves"]:
            if record["f_95"] > wave["f_max"]:
                yield (
                    f"'{wave['body']}' carries shear waves up to {wave['f_max']:.3g} Hz and "
                    f"'{record['file']}' has 95 % of its energy below {record['f_95']:.3g} Hz: "
                    "give smaller elements, or filter the record"
                )

    # A softer side of a contact with longer edges cannot follow the points of the other side.
    for contact in model["contact"]:
        if not contact["sides"]:
            continue
        first, second = contact["sides"]
        if second["h"] > COARSER * first["h"] and second["G"] < first["G"]:
            yield (
                f"'{first['name']}', side 1 of its contact, has edges of {first['h']:.3g} m, and "
                f"'{second['name']}', the softer side, has edges of {second['h']:.3g} m: points "
                f"open there and pressures zigzag, so mesh '{second['name']}' as finely, or "
                "exchange facets1 and facets2"
            )


def _find_long_steps(model: Mapping[str, Any]) -> Iterator[str]:
    """Tell of time steps that are too long."""
    # Time steps too long for the passage of a layer.
    for layer in model["layers"]:
        if model["run"]["dt"] > layer["passage"] / PASSAGE:
            yield (
                f"the time step of {model['run']['dt']:.3g} s is longer than a tenth of the time "
                f"in which a body passes the layer, b/V = {layer['passage']:.3g} s: shorten [run] "
                "dt, or widen the layer"
            )

    # Time steps too long for the first period, of the model with the contact closed or open.
    dt = model["run"]["dt"]
    closed = next(iter(model.get("periods", ())), np.inf)
    lifted = next(iter(model.get("periods_open", ())), np.inf)
    if dt > closed / STEPS:
        yield (
            f"the time step of {dt:.3g} s is longer than a twentieth of the first natural period, "
            f"{closed:.3g} s: the computed periods become too long, so shorten [run] dt"
        )
    elif dt > lifted / STEPS:
        yield (
            f"the time step of {dt:.3g} s is longer than a twentieth of the first natural period "
            f"with the contact open, {lifted:.3g} s: what moves after it has lifted off is "
            "computed too slowly, so shorten [run] dt"
        )


def write_model(comm: Comm, model: Mapping[str, Any], folder: Path) -> None:
    """Write model.json into a folder that exists. Collective.

    Args:
        comm: the ranks.
        model: as of ``describe``.
        folder: of the run.
    """
    on_root(comm, lambda: write_atomically(folder / MODEL, to_json(model).encode()))
