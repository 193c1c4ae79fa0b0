"""Describe the model that a case file makes, before any step.

This is what ``run --check`` tells and model.json holds.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .....core.algebra import Comm
from .....core.files import on_root, to_json, write_atomically
from .....core.problem import ContactProblem
from .....run.damping import NOT_COMPUTED, describe_damping, first_modes, first_open_period
from .....run.files.folder import MODEL
from .....run.loose_bodies import judge_loose_bodies
from .....run.sampling import sampling_warning
from .....run.time_steps import StepPlan
from ..unread_choices import find_left_over
from ..vocabulary import Parts
from .bodies import describe_meshed_body, describe_waves, select_keys
from .conditions import describe_contact, describe_contact_point, describe_layer
from .doubts import ROUNDED, find_defects, find_warnings
from .motions import describe_records

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
        body = describe_meshed_body(problem, tags)
        contact = list(describe_contact(case, problem, tags))
    else:
        body = case.body.description
        contact = [describe_contact_point(case.body, problem)]
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
        "bodies": [select_keys(part) for part in body["bodies"]],
        "supports": body["supports"],
        "contact": contact,
        "layers": [] if case.layer is None else [describe_layer(case.layer)],
        "waves": [describe_waves(part, run["dt"]) for part in body["bodies"] if "c_s" in part],
        "records": describe_records(case, parts.system),
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
    model["defects"] = list(find_defects(model))
    model["warnings"] = [*find_warnings(model), *find_left_over(case.path, case.tables)]
    for sentence, refused in judge_loose_bodies(problem) if problem.system.floating else ():
        model["defects" if refused else "warnings"].append(sentence)

    # A step that leaves out samples of a record is a defect already.
    dt = model["run"]["dt"]
    if not any(dt > record["dt"] * (1.0 + ROUNDED) for record in model["records"]):
        warning = sampling_warning(problem, max(step for step, _ in plan.parts))
        if warning:
            model["warnings"].append(warning)


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
