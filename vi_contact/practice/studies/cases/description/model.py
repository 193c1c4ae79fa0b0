"""Describe the model that a case file makes, before any step.

This is what ``run --check`` tells and model.json holds.
"""

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from .....core.algebra import Comm, largest, max_abs
from .....core.files import on_root, to_json, write_atomically
from .....core.problem import ContactProblem
from .....run.damping import NOT_COMPUTED, describe_damping, first_modes, first_open_period
from .....run.files.folder import MODEL
from .....run.joint_elements import joint_warning
from .....run.loose_bodies import judge_loose_bodies
from .....run.sampling import sampling_warning
from .....run.time_steps import StepPlan
from ..unread_choices import find_left_over
from ..vocabulary import Parts
from .bodies import describe_meshed_body, describe_waves, select_keys
from .conditions import describe_contact, describe_contact_point, describe_layer
from .doubts import ROUNDED, find_defects, find_warnings
from .loads import describe_body_loads, describe_gravity, describe_loads, sum_up
from .motions import (
    describe_design_spectrum,
    describe_excitations,
    describe_records,
    list_motions,
)
from .surroundings import describe_sides
from .water_and_joints import describe_reservoir

# unknowns: up to so many a run tells its periods, which take two seconds; more when it is checked
FEW = 10_000
DIGITS = 10  # of a number: those beyond depend on the number of ranks
RATIO_DIGITS = 4  # of the damping ratio of a mode, which is found less sharply than its period


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
        Tables and lists of tables; docs/reference/files.md says what is in them.

    Raises:
        InputError: as of a run.
    """
    parts = parts or case.parts(comm)
    problem = case.problem(comm, parts)
    plan = case.plan(parts)
    tags = parts.tags or {}
    has_mesh = case.body is None
    body = describe_meshed_body(problem, tags) if has_mesh else case.body.description
    run = {"dt": plan.dt(0), "t_end": plan.length, "steps": plan.steps}
    model: dict[str, Any] = {
        "title": case.tables.get("title") or case.path.stem,
        "dimension": problem.system.space.dimension,
        "unknowns": problem.system.space.unknowns,
        **{key: body[key] for key in ("degree", "integration", "section", "box") if key in body},
        "mass": body["mass"],
        "groups": [
            {"name": name, "kind": type(group).__name__.lower()} for name, group in tags.items()
        ],
        "bodies": [select_keys(part) for part in body["bodies"]],
        "supports": body["supports"],
        "layers": [] if case.layer is None else [describe_layer(case.layer)],
        "waves": [describe_waves(part, run["dt"]) for part in body["bodies"] if "c_s" in part],
        "run": run,
        "method": case.describe_method(problem),
        "outline": body["outline"],
        "reservoir": describe_reservoir(case, tags),
    }
    model |= _describe_contact(case, problem, tags, parts.tables)
    model |= _describe_actions(case, problem, tags, run["t_end"])
    model |= _describe_motions(case, parts)
    model |= _describe_modes(case, problem, most)
    model |= _describe_joint(problem, case, run["dt"], most)
    model["sides"] = describe_sides(model)
    model["constant_loads"] = sum_up(model)
    _add_findings(model, case, problem, plan)

    # Plain values, rounded: digits beyond depend on the number of ranks.
    text = to_json(model)
    return dict(json.loads(text, parse_float=lambda digits: float(f"{float(digits):.{DIGITS}g}")))


def _describe_contact(
    case: Any, problem: ContactProblem, tags: Any, tables: Sequence[int]
) -> dict[str, Any]:
    """Return the parts of the contact; collective.

    Args:
        case: the case.
        problem: its problem.
        tags: groups of the mesh.
        tables: how many parts of the surface each [[contact]] has.
    """
    if case.body is None:
        return {"contact": list(describe_contact(case, problem, tags, tables))}
    return {"contact": [describe_contact_point(case.body, problem)]}


def _describe_actions(
    case: Any, problem: ContactProblem, tags: Any, t_end: float
) -> dict[str, Any]:
    """Return gravity, loads with their resultants, and motions at the start; collective.

    Args:
        case: a ``Case``.
        problem: its problem.
        tags: groups of the mesh.
        t_end: when the run ends [s].
    """
    system = problem.system
    if case.body is None:
        loads = describe_loads(case, problem, tags, t_end=t_end)
    else:
        loads = describe_body_loads(case, t_end=t_end)
    comm = system.algebra.comm
    return {
        "gravity": describe_gravity(case, system.space.dimension),
        "loads": loads,
        "start": {
            "displacement": largest(comm, max_abs(system.u0)),
            "velocity": largest(comm, max_abs(system.v0)),
        },
    }


def _describe_motions(case: Any, parts: Parts) -> dict[str, Any]:
    """Return records and other excitations, and the design spectrum of the case."""
    design = case.sheet.design_spectrum
    motions = list_motions(case, parts.system)
    return {
        "records": describe_records(motions, design),
        "excitations": describe_excitations(motions),
        "design_spectrum": describe_design_spectrum(design),
        "waves_come_in": bool(parts.system.absolute),
    }


def _add_findings(
    model: dict[str, Any], case: Any, problem: ContactProblem, plan: StepPlan
) -> None:
    """Add to a model its defects, and what an engineer should look at; collective."""
    model["defects"] = list(find_defects(model))
    model["warnings"] = [*find_warnings(model), *find_left_over(case.path, case.tables)]
    size = model.get("joint", {}).get("lambda")
    if size is not None and size >= 1.0:
        model["warnings"].append(
            f"lambda of the joint is {size:.3g}: it may snap back inside a step, which then has "
            "several answers; take a smaller dt or, without mass at the contact, smaller elements"
        )
    of_joint = joint_warning(problem)
    if of_joint:
        model["warnings"].append(of_joint)
    for sentence, refused in judge_loose_bodies(problem) if problem.system.floating else ():
        model["defects" if refused else "warnings"].append(sentence)

    # A step that leaves out samples of a record is a defect already.
    dt = model["run"]["dt"]
    if not any(dt > record["dt"] * (1.0 + ROUNDED) for record in model["records"]):
        warning = sampling_warning(problem, max(step for step, _ in plan.parts))
        if warning:
            model["warnings"].append(warning)


def _describe_joint(problem: ContactProblem, case: Any, dt: float, most: int) -> dict[str, Any]:
    """Return the law of a joint and lambda of its steps, nothing without one; collective.

    Args:
        problem: of the case.
        case: a ``Case``.
        dt: length of its steps [s].
        most: unknowns beyond which lambda is left out.
    """
    if problem.joint is None:
        return {}
    size = None
    if problem.system.space.unknowns <= most:
        size = case.compute_lambda(problem, dt)
    is_finite = size is not None and math.isfinite(size)
    return {"joint": {"law": repr(problem.joint), "lambda": size if is_finite else None}}


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


def write_model(comm: Comm, model: Mapping[str, Any], folder: Path) -> None:
    """Write model.json into a folder that exists. Collective.

    Args:
        comm: the ranks.
        model: as of ``describe``.
        folder: of the run.
    """
    on_root(comm, lambda: write_atomically(folder / MODEL, to_json(model).encode()))
