"""Say what a run takes of the memory.

This is the peak of every rank, and the bytes of matrices, factor and mesh.
"""

from collections.abc import Mapping
from resource import RUSAGE_SELF, getrusage
from typing import Any

from ..core.algebra import EffectiveMatrix, from_each, total
from ..core.problem import ContactProblem


def memory(problem: ContactProblem, A: EffectiveMatrix | None) -> dict[str, Any]:
    """Return peak_bytes and the bytes of what tells them. Collective.

    Here peak_bytes is the largest resident memory of every rank so far. The bytes are, of all ranks
    together, those of what tells them: the matrices of all bases, A, its factor, the mesh.
    """
    comm, systems = problem.system.algebra.comm, (problem.system, problem.turned, problem.equations)
    owners: dict[str, list[Any]] = {
        name: [getattr(one, name) for one in systems] for name in ("K", "M", "C")
    }
    owners |= {
        "A": [A and A.matrix],
        "factor": [A.factor if A and A.factorised else None],
        "mesh": [systems[0].space],
    }
    known: dict[str, int] = {}
    for name, things in owners.items():
        found = total(
            comm, sum(getattr(one, "bytes", 0) for one in {id(one): one for one in things}.values())
        )
        if found:
            known[name] = round(found)
    return {"peak_bytes": from_each(comm, 1024 * getrusage(RUSAGE_SELF).ru_maxrss), "bytes": known}


def in_words(memory: Mapping[str, Any]) -> str:
    """Return the same in a line, in megabytes."""
    peaks = memory["peak_bytes"]
    known = "".join(f"; {name} {1e-6 * size:.3g}" for name, size in memory["bytes"].items())
    return (
        f"memory [MB]: at most {1e-6 * max(peaks):.4g} on a rank, {1e-6 * sum(peaks):.4g} on "
        f"all{known}"
    )
