"""Examine a case before it runs: describe its model, and rehearse the run up to its first step."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from ....core.algebra import Comm
from .case import Case
from .description.model import describe
from .sentences import in_words_of_case_files
from .stages import rehearse_stages
from .strain_compatible import refuse_unfit
from .vocabulary import Parts

MOST = 50_000  # unknowns beyond which no periods and no equilibria are computed


def examine(case: Case, comm: Any, folder: Path) -> tuple[dict[str, Any], Comm]:
    """Return what the model of a case is, once all that a run does before its first step is done.

    Collective.

    Args:
        case: the case.
        comm: the ranks.
        folder: which the run would have; it is made, and no file is left there.

    Returns:
        The model as of ``describe``, and the ranks that share it.

    Raises:
        InputError: whatever the run refuses before its first step.
    """
    if case.body is None:
        case = replace(case, ready=case.meshed(comm))  # one mesh for all that follows
    parts = case.parts(comm)
    model = describe(case, comm, parts, most=MOST)
    if not model["defects"]:
        _rehearse(case, comm, parts, folder)
    return model, parts.system.algebra.comm


@in_words_of_case_files()
def _rehearse(case: Case, comm: Any, parts: Parts, folder: Path) -> None:
    """Do what a run does before its first step; collective.

    Args:
        case: the case.
        comm: the ranks.
        parts: of its last stage.
        folder: which the run would have.
    """
    case.check_sheet(comm, parts)
    few = parts.system.space.unknowns <= MOST  # type: ignore[attr-defined]
    if "strain_compatible" in case.nodes:
        refuse_unfit(case)
    if case.stages:
        rehearse_stages(case, comm, folder, solve=few)
    else:
        case.rehearse(parts, folder, at_rest=few)
