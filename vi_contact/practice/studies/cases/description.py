"""Describe the model that a case file makes, before any step.

This is what ``run --check`` tells and model.json holds.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, pairwise
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
from ...ground_motion.excitation import GroundMotion
from ...ground_motion.record import Record
from .bodies import Body
from .table_calls import Call, Group, build, nodes_in
from .unread_choices import left_over
from .vocabulary import Parts

ELEMENTS = (
    8.0  # of first order in a wave length: Kuhlemeyer and Lysmer (1973); the cautious take 10
)
STEPS = 20.0  # in a period
PASSAGE = 10.0  # steps in the time b/V of a layer (CHOSEN; the demos take 20)
COARSER = (
    1.2  # edges of side 2 over those of side 1: more points than a softer side can follow (CHOSEN)
)
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

    Keys: title, dimension, unknowns, degree, mass; groups (name, kind); bodies (name, cells, mass,
    material); supports (kind, groups, components); contact (name, points, size [m²], friction,
    nodes: a sentence, places, others: kind -> places, sides: name, h and G of both; of a body
    without mesh gap [m] in the place of a size); layers (width [m], speed [m/s], passage: their
    quotient [s]); periods, damping_ratios of their modes and rigid_motions with the contact closed
    where it touches at the start, and sticking where there is friction; periods_open, the first one
    with it open, where it touches; damping: in words, "none" without; waves (body, c_s, h: the
    longest edge over the degree, f_max = c_s / (8 h), dt_ratio = dt c_s / h); records (file, scale,
    dt, duration, pga, f_95: 95 % of its energy are below); run (dt, t_end, steps); outline (group,
    lines), on rank 0; defects and warnings: sentences.

    parts: those of the case, when they are known; most: unknowns beyond which periods are left out.
    The same on any number of ranks. InputError as of a run. Collective.
    """
    parts = parts or case.parts(comm)
    problem, plan, tags = case.problem(comm, parts), case.plan(parts), parts.tags or {}
    told = _meshed(problem, tags) if case.body is None else case.body.told
    bodies = told["bodies"]
    run = {"dt": plan.dt(0), "t_end": plan.length, "steps": plan.steps}
    model = {
        "title": case.tables.get("title") or case.path.stem,
        "dimension": problem.system.space.dimension,
        "unknowns": problem.system.space.unknowns,
        **({"degree": told["degree"]} if "degree" in told else {}),
        "mass": told["mass"],
        "groups": [
            {"name": name, "kind": type(one).__name__.lower()} for name, one in tags.items()
        ],
        "bodies": [
            {key: one[key] for key in ("name", "cells", "mass", "material") if key in one}
            for one in bodies
        ],
        "supports": told["supports"],
        "contact": list(
            _contact(case, problem, tags) if case.body is None else _point(case.body, problem)
        ),
        "layers": [] if case.layer is None else [_layer(case.layer)],
        "waves": [
            {
                "body": one["name"],
                "c_s": one["c_s"],
                "h": one["h"],
                "f_max": one["c_s"] / (ELEMENTS * one["h"]),
                "dt_ratio": run["dt"] * one["c_s"] / one["h"],
            }
            for one in bodies
            if "c_s" in one
        ],
        "records": _records(case, parts.system),
        "run": run,
        "outline": told["outline"],
    } | _modes(case, problem, most)
    model |= {
        "defects": list(_defects(model)),
        "warnings": [*_warnings(model), *left_over(case.path, case.tables)],
    }
    for sentence, refused in judge_loose_bodies(problem) if problem.system.floating else ():
        model["defects" if refused else "warnings"].append(sentence)
    # that is a defect
    if not any(run["dt"] > one["dt"] * (1.0 + ROUNDED) for one in model["records"]):
        model["warnings"] += filter(
            None, [sampling_warning(problem, max(dt for dt, _ in plan.parts))]
        )
    return dict(
        json.loads(to_json(model), parse_float=lambda text: float(f"{float(text):.{DIGITS}g}"))
    )


def _meshed(problem: ContactProblem, tags: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is told of bodies with a mesh, as ``Body.told`` has it of others."""
    space = space_of("describe", problem.system)
    volumes = cell_volumes(space.mesh)
    bodies = [_body(space, tags, volumes, *one) for one in space.forms.materials]
    return {
        "degree": space.degree,
        "mass": sum(one["mass"] for one in bodies),
        "bodies": bodies,
        "supports": list(_supports(space)),
        "outline": outline(space, tags, [cells for cells, _ in space.forms.materials]),
    }


def in_words(model: Mapping[str, Any]) -> str:
    """Return what ``describe`` found, as lines of text."""
    lines = []
    for part in PARTS:
        entries = [model] if part.key is None else model[part.key]
        entries = [entry for entry in entries if part.fits(entry)]
        if entries and part.heading:
            lines.append(part.heading)
        for entry in entries:
            words = {key: _word(value) for key, value in entry.items()}
            lines.append(part.text.format(**words))
    return "\n".join([*lines, *(f"warning: {one}" for one in model["warnings"])])


def _word(value: Any) -> Any:
    """Return lists and materials as texts, all else as it is."""
    if isinstance(value, Mapping) and "type" in value:
        value = [f"{key} {one:.4g}" for key, one in value.items() if key != "type"]
    return (
        ", ".join(f"{one:.4g}" if isinstance(one, float) else str(one) for one in value)
        if isinstance(value, list)
        else value
    )


def _body(
    space: Any, tags: Mapping[str, Any], volumes: Array, cells: Any, material: Any
) -> dict[str, Any]:
    """Return what is made of one material.

    It is known by the name of its cell group, and has its slowest waves and longest edge.
    """
    names = [
        name
        for name, one in tags.items()
        if isinstance(one, Cells)
        and not largest(space.comm, not np.array_equal(one.indices, cells))
    ]
    own = cells[cells < len(volumes)]
    density, shear = (space.forms.cellwise(field)[own] for field in ("rho", "shear"))
    if hasattr(material, "G12"):
        G = material.G23, material.G13, material.G12  # in the planes across axes 1, 2, 3
        z = int(np.argmax(np.abs(np.asarray(material.axes)[2]))) if np.ndim(material.axes) else 2
        shear = density / material.rho * (G[z] if space.dimension == 2 else min(G))
    numbers = {key: one for key, one in vars(material).items() if isinstance(one, int | float)}
    if not numbers.get("xi", 1.0):  # a material without damping has no ratio to tell
        numbers.pop("xi")
    return {
        "name": (names or ["body"])[0],
        "cells": round(total(space.comm, len(own))),
        "mass": total(space.comm, volumes[own] @ density),
        "material": {"type": type(material).__name__} | numbers,
        "c_s": -largest(space.comm, np.max(-np.sqrt(shear / density), initial=-np.inf)),
        "h": largest(space.comm, longest_edge(space.mesh, own)) / space.degree,
    }


def _supports(space: Any) -> Iterator[dict[str, Any]]:
    """Yield what holds the bodies, moves them, absorbs or lets in waves.

    Ties of sides to each other are among it.
    """
    held = [
        (
            "moved" if one.moves else "clamped" if one.components is None else "held",
            [one.name],
            one.components,
        )
        for one in space.prescribed
    ]
    absorbing = [(type(one).__name__, [one.facets.name], None) for one in space.forms.boundaries]
    tied = [("tied", [one.first.name, one.second.name], one.components) for one in space.ties]
    for kind, groups, components in (*held, *absorbing, *tied):
        chosen = range(space.dimension) if components is None else components
        yield {"kind": kind, "groups": groups, "components": [AXES[one] for one in chosen]}


def _contact(
    case: Any, problem: ContactProblem, tags: Mapping[str, Any]
) -> Iterator[dict[str, Any]]:
    """Yield the parts of the contact, one for each table.

    Each goes by its name, or by those of its groups.
    """
    surface, tables = problem.surface, case.nodes.get("contact", ())
    nodes = tables if isinstance(tables, tuple) else (tables,)
    grouped = [[one for one in nodes_in(node) if isinstance(one, Group)] for node in nodes]
    names = [
        node.arguments.get("name") or " on ".join(one.name for one in groups)
        for node, groups in zip(nodes, grouped, strict=True)
    ]
    whole, parts = surface.whole(), getattr(surface, "parts", ())
    ends = np.cumsum([0, *(round(total(surface.comm, len(part.slots))) for part in parts)])
    for number, (name, groups, (a, b)) in enumerate(
        zip(names, grouped, pairwise(ends), strict=True)
    ):
        census = surface.censuses[number] if len(surface.censuses) == len(parts) else None
        yield {
            "name": name,
            "points": int(b - a),
            "size": float(whole.weights[a:b].sum()),
            "friction": repr(problem.friction),
            "nodes": "" if census is None else census.in_words(),
            "places": whole.points[a:b],
            "others": {} if census is None else census.places,
            "sides": _sides(
                problem.system.space, tags, [one.name for one in groups], whole.points[a:b]
            ),
        }


def _point(body: Body, problem: ContactProblem) -> Iterator[dict[str, Any]]:
    """Yield the contact point of a body without a mesh, at which pressures are forces."""
    yield {
        "name": body.point,
        "points": 1,
        "gap": float(problem.surface.gap0[0]),
        "friction": repr(problem.friction),
        "nodes": "",
        "places": problem.surface.whole().points,
        "others": {},
        "sides": [],
    }


def _layer(law: Any) -> dict[str, float]:
    """Return what there is to tell of a layer; its speed is V, at which restitution is wanted."""
    width, speed = law.layer.width, law.layer.v
    return {"width": width, "speed": speed, "passage": width / speed}


def _sides(
    space: Any, tags: Mapping[str, Any], names: Sequence[str], points: Array
) -> list[dict[str, Any]]:
    """Return (name, mean edge h [m], shear modulus G [Pa]) of both sides of a pair.

    They are those of their facets that are no further from the box of the contact points than an
    edge; there are none where a table has no two groups of facets.
    """
    sides = [tags[name] for name in names if isinstance(tags.get(name), Facets)]
    if len(sides) != 2 or len(names) != 2 or not len(points):
        return []
    found: list[dict[str, Any]] = []
    for side in sides:
        middles, edges, cells = facets_with_cells(space.mesh, side.indices)
        slack = largest(space.comm, edges.max(initial=0.0))
        near = np.all(
            (middles >= points.min(axis=0) - slack) & (middles <= points.max(axis=0) + slack),
            axis=1,
        )
        shear = space.forms.cellwise("shear")[cells[near]]
        count, h, G = space.comm.sum(np.array([near.sum(), edges[near].sum(), shear.sum()]))
        found.append({"name": side.name, "h": h / max(count, 1.0), "G": G / max(count, 1.0)})
    return found


def _records(case: Any, system: Any) -> list[dict[str, Any]]:
    """Return the records of the excitations, each once.

    Those of motions that come up through the base alone are among them.
    """
    calls = (
        one
        for one in nodes_in(case.nodes.get("system", ()))
        if isinstance(one, Call) and one.callee.name == "upgoing"
    )
    rising = (build(one.arguments.get("motion", ()), {"system": system}) for one in calls)
    motions = chain(
        case.excitations(system=system),
        *(one if isinstance(one, tuple) else (one,) for one in rising),
    )
    shaking = (GroundMotion(one) if isinstance(one, Record) else one for one in motions)
    told = [_record(one) for one in shaking if isinstance(one, GroundMotion)]
    return [one for number, one in enumerate(told) if one not in told[:number]]


def _record(motion: GroundMotion) -> dict[str, Any]:
    """Return a record and the frequency [Hz] below which ENERGY of its energy is.

    A synthetic one is named by its seed.
    """
    record = motion.record
    power = np.cumsum(np.abs(np.fft.rfft(record.acceleration)) ** 2)
    highest = np.fft.rfftfreq(record.acceleration.size, record.dt)[
        np.searchsorted(power, ENERGY * power[-1])
    ]
    return {
        "file": Path(record.source).name or f"synthetic, {record.title.rpartition(', ')[2]}",
        "scale": motion.scale,
        "dt": record.dt,
        "duration": record.duration,
        "f_95": float(highest),
        "pga": float(np.abs(motion.scale * record.acceleration).max()),
    }


def _modes(case: Any, problem: ContactProblem, most: int) -> dict[str, Any]:
    """Return natural periods [s] and the damping of a problem.

    It may have up to ``most`` unknowns. Collective.
    """
    few = problem.system.space.unknowns <= most
    found: dict[str, Any] = {}
    if few and problem.system.space.unknowns > 1:  # a particle has no periods
        modes = first_modes(problem)
        found = {"periods": list(modes.periods), "rigid_motions": modes.rigid_motions}
        opened = first_open_period(problem)
        found |= {} if opened is None else {"periods_open": [opened]}
        found["damping_ratios"] = [float(f"{one:.{RATIO_DIGITS}g}") for one in modes.ratios]
    if "strain_compatible" in case.nodes:  # the system has the damping of other cells only
        words = "that of the curves of [strain_compatible], which the run finds"
        return {**found, "damping_ratios": [], "damping": words}
    if problem.system.C is None and "periods" not in found and few:
        return {**found, "damping_ratios": [], "damping": "none"}
    unknown = "" if few else f"{NOT_COMPUTED}, as the model has more than {most} unknowns"
    return {**found, "damping": describe_damping(problem, unknown=unknown)}


def _defects(model: Mapping[str, Any]) -> Iterator[str]:
    """Yield why records do not fit to each other or to the time step, a sentence each."""
    dt = model["run"]["dt"]
    for one, other in pairwise(model["records"]):
        if abs(one["dt"] - other["dt"]) > ROUNDED * one["dt"]:
            yield (
                f"'{one['file']}' and '{other['file']}' have samples every {one['dt']:g} and "
                f"{other['dt']:g} s: bring them to one step with record = "
                f'{{path = "FILE", resample_dt = {one["dt"]:g}}}'
            )
        if abs(one["duration"] - other["duration"]) > ROUNDED * one["duration"]:
            yield (
                f"'{one['file']}' and '{other['file']}' last {one['duration']:g} and "
                f"{other['duration']:g} s: trim or pad one of them in its table of processing"
            )
    for record in model["records"]:
        if dt > record["dt"] * (1.0 + ROUNDED):
            yield (
                f"the time step of {dt:g} s leaves out samples of '{record['file']}', which has "
                f"one every {record['dt']:g} s: shorten [run] dt, or give the record resample_dt "
                f"= {dt:g}"
            )


def _warnings(model: Mapping[str, Any]) -> Iterator[str]:
    """Yield what an engineer should look at, a sentence each."""
    yield from _coarse_meshes(model)
    yield from _long_steps(model)


def _coarse_meshes(model: Mapping[str, Any]) -> Iterator[str]:
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
        one, two = contact["sides"]
        if two["h"] > COARSER * one["h"] and two["G"] < one["G"]:
            yield (
                f"'{one['name']}', side 1 of its contact, has edges of {one['h']:.3g} m, and "
                f"'{two['name']}', the softer side, has edges of {two['h']:.3g} m: points open "
                f"there and pressures zigzag, so mesh '{two['name']}' as finely, or exchange "
                "facets1 and facets2"
            )


def _long_steps(model: Mapping[str, Any]) -> Iterator[str]:
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
    """Write model.json into a folder that exists. Collective."""
    on_root(comm, lambda: write_atomically(folder / MODEL, to_json(model).encode()))
