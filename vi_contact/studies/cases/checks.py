"""Compare a run with the formulas that the tables [[check]] of its case name."""

from collections.abc import Sequence
from pathlib import Path

from ...engineering import checks
from ...engineering.checks.comparison import Check, Comparison
from .library import COPY, read_copy
from .parsing import Words, read
from .table_calls import Spot, build, callee


def comparisons(folder: str | Path) -> tuple[Comparison, ...]:
    """Return the comparisons of a run folder, one for each [[check]] of the case it keeps; InputError without a run."""
    from ...run.files.reading import read_run  # late: h5py

    folder = Path(folder)
    table = read_copy(folder).get("check", [])
    words = Words(folder, {Check: {name: callee(getattr(checks, name)) for name in checks.__all__}}, {}, (), {})
    made = build(read(table, Check | Sequence[Check], Spot(str(folder / COPY), "", "check"), words), {})
    each = made if isinstance(made, tuple) else (made,)
    history = read_run(folder).history if each else {}
    return tuple(one.compare(history) for one in each)
