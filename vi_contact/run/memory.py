"""Say what a run takes of the memory.

This is the peak of every rank, and the bytes of matrices, factor and mesh.
"""

from collections.abc import Mapping
from resource import RUSAGE_SELF, getrusage
from typing import Any

from ..core.algebra import EffectiveMatrix, from_each, total
from ..core.problem import ContactProblem


def measure_memory(problem: ContactProblem, A: EffectiveMatrix | None) -> dict[str, Any]:
    """Return peak_bytes, the largest resident memory of every rank so far, and bytes. Collective.

    The bytes are, by name and of all ranks together, those of what says how many it has: the
    matrices of all bases, A, its factor, the mesh.
    """
    comm = problem.system.algebra.comm
    systems = (problem.system, problem.turned, problem.equations)
    owners: dict[str, list[Any]] = {
        "K": [system.K for system in systems],
        "M": [system.M for system in systems],
        "C": [system.C for system in systems],
        "A": [None if A is None else A.matrix],
        "factor": [A.factor if A is not None and A.factorised else None],
        "mesh": [problem.system.space],
    }
    sizes: dict[str, int] = {}
    for name, things in owners.items():
        distinct = {id(thing): thing for thing in things}  # bases may share a matrix
        size = total(comm, sum(getattr(thing, "bytes", 0) for thing in distinct.values()))
        if size:
            sizes[name] = round(size)
    peak = 1024 * getrusage(RUSAGE_SELF).ru_maxrss
    return {"peak_bytes": from_each(comm, peak), "bytes": sizes}


def describe_memory(memory: Mapping[str, Any]) -> str:
    """Return what ``measure_memory`` has returned in a line, in megabytes."""
    peaks = memory["peak_bytes"]
    sizes = "".join(f"; {name} {1e-6 * size:.3g}" for name, size in memory["bytes"].items())
    return (
        f"memory [MB]: at most {1e-6 * max(peaks):.4g} on a rank, {1e-6 * sum(peaks):.4g} on "
        f"all{sizes}"
    )
