"""Hold PETSc's options; refuse combinations that are known to give wrong answers.

There are three layers under one prefix, of which the later wins: the method's defaults,
``petsc_options`` of the settings, PETSc's own database (command line, PETSC_OPTIONS). SNES VI reads
its options again whenever the active set changes, so they stay in the database for as long as a
solve runs and are taken out afterwards: two solvers with one prefix do not meet.
"""

import ctypes
import logging
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from difflib import get_close_matches
from functools import cache
from typing import Any

from ...core import packages
from ...core.algebra import Comm
from ...core.errors import InputError
from ..petsc import PETSc
from .failures import read_last_line
from .option_names import KNOWN

log = logging.getLogger(__name__)
Options = Mapping[str, object | None]
DIRECT = ("lu", "cholesky")
EXACT = (*DIRECT, "redundant")  # by one application


class OptionLayers:
    """Hold defaults and the user's own options under a prefix.

    ``in_force`` puts them into PETSc's database.

    Attributes:
        prefix: of the options on the command line.
        own: the user's options.
        read: those of them that PETSc has read.
    """

    def __init__(
        self, prefix: str, defaults: Options, own: Options, read: set[str] | None = None
    ) -> None:
        """Take the layers of options.

        Args:
            prefix: of the options on the command line.
            defaults: the method's.
            own: the user's.
            read: those of the user's that PETSc has read so far, shared with other layers of one
                solver.
        """
        self.prefix = prefix
        self._defaults = defaults
        self.own = {key.lstrip("-"): value for key, value in own.items()}
        self.read: set[str] = set() if read is None else read

    def apply(self, solver: Any, check: "Callable[[Any, OptionLayers], None]") -> None:
        """Set up a SNES, TAO or PC object from the options.

        Raises:
            InputError: PETSc or ``check`` does not take them.
        """
        with self.in_force():
            try:
                solver.setFromOptions()
            except PETSc.Error as error:
                reason = read_last_line(error)
                raise InputError(
                    f"PETSc does not accept the options under {self.prefix} ({reason}): correct or "
                    "drop them"
                ) from error
            check(solver, self)

    @contextmanager
    def in_force(self) -> Iterator[None]:
        """Set what the database does not already hold, and take it out at the end."""
        database = PETSc.Options()
        values = {**self._defaults, **self.own}
        pc = database.getString(self.prefix + "pc_type", str(values.get("pc_type", "")))
        if pc not in DIRECT and "pc_factor_mat_solver_type" not in self.own:
            # the default is for our own direct solver
            values.pop("pc_factor_mat_solver_type", None)
        added = [key for key in values if not database.hasName(self.prefix + key)]
        for key in added:
            database.setValue(self.prefix + key, "" if values[key] is None else values[key])
        try:
            yield
        finally:
            self.read.update(
                key for key in self.own if key not in added or was_read(self.prefix + key)
            )
            for key in added:
                database.delValue(self.prefix + key)

    def refuse_unread(self, owner: str, comm: Comm) -> None:
        """Raise InputError, on all ranks, for an option of the user's that no rank has read.

        To be called when all has been read that ever will be: after a solve with at least one
        iteration. Collective.
        """
        for key in self._list_unread(comm) if self.own else ():
            raise InputError(
                f"{owner}: nothing reads '{key}' of petsc_options: {self._suggest(key)}"
            )
        self._tell_unread(owner, comm)

    def _list_unread(self, comm: Comm) -> list[str]:
        """Return the user's options that no rank has read. Collective.

        Some ranks may not read an option of blocks, as one without rows has none.
        """
        unread_here = [key for key in self.own if key not in self.read]
        of_ranks = comm.gather(unread_here)
        unread = None
        if of_ranks is not None:  # on the first rank
            unread = unread_here
            for keys in of_ranks:
                unread = [key for key in unread if key in keys]
        return list(comm.bcast(unread))

    def _tell_unread(self, owner: str, comm: Comm) -> None:
        """Warn, once, of options of the command line that this solver has not read.

        They may be for another one.
        """
        given = [name for name in PETSc.Options().getAll() if name.startswith(self.prefix)]
        unread = [name for name in given if not was_read(name) and name not in _TOLD]
        _TOLD.update(unread)
        for name in unread if comm.rank == 0 else ():
            remedy = self._suggest(name.removeprefix(self.prefix))
            log.warning("%s: nothing reads the PETSc option -%s: %s", owner, name, remedy)

    def excuse_known(self) -> None:
        """Count the user's options that PETSc has as read.

        This solver may have a use for them or not.
        """
        self.read.update(key for key in self.own if key.removeprefix(_find_part(key)) in KNOWN)

    def _suggest(self, key: str) -> str:
        """Return the end of a sentence about an option that nothing has read."""
        if key.startswith(self.prefix):
            return f"give it without its prefix, as '{key.removeprefix(self.prefix)}'"
        part = _find_part(key)
        near = get_close_matches(key.removeprefix(part), KNOWN, n=1, cutoff=0.6)
        if near and part + near[0] != key:
            return f"did you mean '{part}{near[0]}'? Correct it, or leave it out"
        return "what it is for is not part of this solver as it is set, so leave it out"

    def chosen(self, key: str) -> str:
        """Return the value of an option. To be called inside ``in_force``."""
        return str(PETSc.Options(self.prefix).getString(key, ""))


@cache
def _options_used() -> Any:
    """Return PetscOptionsUsed of the library that petsc4py has loaded, but does not offer."""
    call = ctypes.CDLL(PETSc.__file__).PetscOptionsUsed
    call.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p]
    call.restype = ctypes.c_int
    return call


def was_read(name: str) -> bool:
    """Say whether PETSc has read an option, of this whole name, since it came into the database.

    Ranks may have different answers.
    """
    was_used = ctypes.c_int(0)  # PetscBool is an int, and one byte since PETSc 3.24
    _options_used()(None, name.encode(), ctypes.byref(was_used))
    return was_used.value != 0


def refuse(combination: str, reason: str, remedy: str) -> None:
    """Raise InputError for a combination of options.

    Args:
        combination: what was chosen.
        reason: why it is refused.
        remedy: what to choose.
    """
    raise InputError(f"{combination} is refused because {reason}: {remedy}")


_TOLD: set[str] = set()  # options of the command line that a warning has named
NOT_EXACT = "one application of it does not solve the system"
# Linear solvers for symmetric matrices alone.
SYMMETRIC_KSP = (
    "cg",
    "pipecg",
    "groppcg",
    "cgne",
    "cr",
    "minres",
    "symmlq",
    "nash",
    "stcg",
    "gltr",
    "chebyshev",
)
# Where options of a part begin: those of blocks, of levels of a multigrid.
PARTS = ("sub_", "mg_coarse_sub_", "mg_coarse_", "mg_levels_", "esteig_")
# Newton's method on the inequality. Line search: bt throttles changes of the active set, 16 to 50
# iterations instead of 5 to 7. Tolerances: ScaledStep.verdict decides; a user who sets one of these
# options stops earlier, relative to |b|.
NEWTON: Options = {
    "snes_linesearch_type": "none",
    "snes_vi_zero_tolerance": 0.0,
    "snes_max_it": 100,
    "snes_rtol": 0.0,
    "snes_atol": 0.0,
    "snes_stol": 0.0,
}
# A direct solver; icntl_20 = 0, as distributed right-hand sides crash.
MUMPS: Options = {
    "ksp_type": "preonly",
    "pc_factor_mat_solver_type": "mumps",
    "mat_mumps_icntl_20": 0,
}
# TAO's trust region method on the bounds; ScaledStep.verdict decides here too.
TRON: Options = {
    "tao_gatol": 0.0,
    "tao_grtol": 0.0,
    "tao_gttol": 0.0,
    "tao_steptol": 0.0,
    "tao_max_it": 200,
    "sub_pc_type": "icc",
}
# Preconditioners that cannot work on the reduced systems -> the reason.
REDUCED_PC = {
    "gamg": (
        "it is built on the whole displacement field, and the reduced matrix has lost its "
        "blocks and rigid modes (PETSc 3.18 stops with error 60 as soon as the active set "
        "changes)"
    ),
    "mg": (
        "it is built on the whole displacement field, and the reduced matrix has lost its "
        "blocks and rigid modes, so its grid transfers no longer fit"
    ),
    "fieldsplit": (
        "its field numbers belong to the whole field and select wrong rows of the reduced matrix"
    ),
}


def _find_part(key: str) -> str:
    """Return how the name of an option begins that is for blocks or levels; else an empty text."""
    return next((part for part in PARTS if key.startswith(part)), "")


EXCHANGE = ("umfpack", "superlu")  # solvers that exchange rows


def choose_direct(kind: str, ranks: int, *, exchanges: bool = False) -> Options:
    """Return the options of a direct solver that this PETSc was built with.

    It is MUMPS, or else a solver for one rank, of which every rank has a copy; the log says which.
    SuperLU_DIST is never taken: it ends the process where a row is zero.

    Args:
        kind: "cholesky" or "lu".
        ranks: their number.
        exchanges: whether rows have to be exchanged, as beside zeros on the diagonal, which PETSc's
            own solver does not do.

    Raises:
        InputError: rows have to be exchanged, and no solver does.
    """
    if packages.petsc_has("mumps"):
        return {**MUMPS, "pc_type": kind}
    own = {"ksp_type": "preonly", "pc_type": kind, "pc_factor_mat_solver_type": "petsc"}
    if exchanges:
        solvers = [name for name in EXCHANGE if packages.petsc_has(name)]
        if not solvers:
            raise InputError(
                "Volume() with friction needs a direct solver that exchanges rows, and this PETSc "
                "has none (MUMPS, SuiteSparse or SuperLU): take Condensed() or Iterative()"
            )
        own["pc_factor_mat_solver_type"] = solvers[0]
    else:
        own["pc_factor_mat_ordering_type"] = "nd"
    log.info(
        "Volume: %s of '%s' factorises, as this PETSc has no MUMPS",
        kind,
        own["pc_factor_mat_solver_type"],
    )
    if ranks == 1:
        return own
    copies = {f"redundant_{key}": value for key, value in own.items()}
    return {"ksp_type": "preonly", "pc_type": "redundant", **copies}


def check_reduced(snes: Any, layers: OptionLayers) -> None:
    """Refuse what does not work on the reduced systems of VINEWTONRSLS."""
    _check_type(snes, "vinewtonrsls", layers)
    pc = snes.ksp.pc.getType()
    ksp = snes.ksp.getType()
    if pc in REDUCED_PC:
        refuse(
            f"pc_type {pc} with vinewtonrsls",
            REDUCED_PC[pc],
            "use cholesky with MUMPS, hypre or bjacobi",
        )
    if ksp == "preonly" and pc not in EXACT:
        refuse(f"ksp_type preonly with pc_type {pc}", NOT_EXACT, "use ksp_type cg")
    _check_line_search(layers)


def check_semismooth(snes: Any, layers: OptionLayers) -> None:
    """Refuse what needs a symmetric matrix: the Jacobian D_a + D_b A of VINEWTONSSLS is not."""
    _check_unsymmetric(snes, layers, "vinewtonssls", "vinewtonssls", "the semismooth Jacobian")


def check_friction(snes: Any, layers: OptionLayers) -> None:
    """Refuse what needs a symmetric matrix, and what fails on reduced systems of VINEWTONRSLS."""
    pc = snes.ksp.pc.getType()
    if pc in REDUCED_PC:
        refuse(f"pc_type {pc} with friction", REDUCED_PC[pc], "use lu with MUMPS")
    _check_unsymmetric(snes, layers, "vinewtonrsls", "friction", "the system with friction")


def _check_unsymmetric(
    snes: Any, layers: OptionLayers, wanted: str, what: str, matrix: str
) -> None:
    """Refuse what needs a symmetric matrix.

    Args:
        snes: the solver, set up by the options.
        layers: the options.
        wanted: its type.
        what: for which it is, in messages.
        matrix: its name, in messages.
    """
    _check_type(snes, wanted, layers)
    pc = snes.ksp.pc.getType()
    ksp = snes.ksp.getType()
    for kind, name, symmetric in (
        ("pc", pc, ("cholesky", "icc")),
        ("ksp", ksp, SYMMETRIC_KSP),
    ):
        if name in symmetric:
            refuse(
                f"{kind}_type {name} with {what}",
                f"{matrix} is not symmetric",
                "use lu with preonly",
            )
    if ksp == "preonly" and pc not in ("lu", "redundant"):
        refuse(f"ksp_type preonly with pc_type {pc}", NOT_EXACT, "use lu or gmres")
    _check_line_search(layers)


def _check_type(snes: Any, wanted: str, layers: OptionLayers) -> None:
    """Refuse another type than the method's."""
    if snes.getType() != wanted:
        refuse(
            f"option {layers.prefix}snes_type {snes.getType()}",
            f"the method was set up for {wanted}",
            "choose the method by Volume(method=...)",
        )


def _check_line_search(layers: OptionLayers) -> None:
    """Refuse line searches that ignore the bounds."""
    kind = layers.chosen("snes_linesearch_type")
    if kind in ("cp", "bisection") and PETSc.Sys.getVersion() < (3, 23, 0):
        refuse(
            f"snes_linesearch_type {kind}",
            "PETSc before 3.23 ignores the bounds in its slope",
            "use none or bt",
        )
