"""Describe the model that a case file makes, before any step.

This is what ``run --check`` tells and model.json holds.
"""

import json
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain, pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ...core.algebra import Array, Comm, largest, total
from ...core.files import on_root, to_json, write_atomically
from ...core.problem import ContactProblem
from ...core.step import AXES
from ...engineering.damping import NOT_COMPUTED, damping_in_words, first_modes, first_open_period
from ...fem.mesh import Cells, Facets
from ...fem.output.outline import cell_volumes, facets_with_cells, longest_edge, outline
from ...fem.space import space_of
from ...ground_motion.excitation import GroundMotion
from ...ground_motion.record import Record
from ...run.files.folder import MODEL
from ...run.loose_bodies import judge_loose_bodies
from ...run.sampling import sampling_warning
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
WORDS = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))


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
    for part in WORDS["part"]:
        rows = (
            model[part["key"]]
            if "key" in part
            else [model]
            if part.get("needs", "title") in model
            else []
        )
        rows = [row for row in rows if part.get("of") in {None: 0, **row}]
        rows = [row for row in rows if part.get("without") not in row]
        lines += [part["heading"]] if rows and "heading" in part else []
        lines += [
            part["text"].format(**{key: _word(one) for key, one in row.items()}) for row in rows
        ]
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
        return {**found, "damping_ratios": [], "damping": WORDS["by_curves"]}
    if problem.system.C is None and "periods" not in found and few:
        return found | {"damping_ratios": [], "damping": WORDS["undamped"]}
    unknown = WORDS["many"].format(unknown=NOT_COMPUTED, most=most)
    return {**found, "damping": damping_in_words(problem, unknown="" if few else unknown)}


def _defects(model: Mapping[str, Any]) -> Iterator[str]:
    """Yield why records do not fit to each other or to the time step, a sentence each."""
    for one, other in pairwise(model["records"]):
        for key, words in (("dt", "uneven"), ("duration", "unequal")):
            if abs(one[key] - other[key]) > ROUNDED * one[key]:
                yield WORDS[words].format(one=one, other=other)
    for one in model["records"]:
        if model["run"]["dt"] > one["dt"] * (1.0 + ROUNDED):
            yield WORDS["long"].format(one=one, run=model["run"])


def _warnings(model: Mapping[str, Any]) -> Iterator[str]:
    """Yield what an engineer should look at, a sentence each."""
    for one in sorted(model["records"], key=lambda one: float(one["f_95"]))[-1:]:
        coarse = (wave for wave in model["waves"] if one["f_95"] > wave["f_max"])
        yield from (WORDS["coarse"].format(wave=wave, one=one) for wave in coarse)
    for sides in (one["sides"] for one in model["contact"] if one["sides"]):
        if sides[1]["h"] > COARSER * sides[0]["h"] and sides[1]["G"] < sides[0]["G"]:
            yield WORDS["unlike"].format(one=sides[0], two=sides[1])
    for one in model["layers"]:
        if model["run"]["dt"] > one["passage"] / PASSAGE:
            yield WORDS["thin"].format(one=one, run=model["run"])
    if model["run"]["dt"] > next(iter(model.get("periods", ())), np.inf) / STEPS:
        yield WORDS["slow"].format(**model)
    elif model["run"]["dt"] > next(iter(model.get("periods_open", ())), np.inf) / STEPS:
        yield WORDS["slow_open"].format(**model)


def write_model(comm: Comm, model: Mapping[str, Any], folder: Path) -> None:
    """Write model.json into a folder that exists. Collective."""
    on_root(comm, lambda: write_atomically(folder / MODEL, to_json(model).encode()))
