"""Hold PETSc's options: one prefix, three layers; refuse combinations that are known to give wrong answers.

Layers, the later wins: the method's defaults, ``petsc_options`` of the settings, PETSc's own database (command line,
PETSC_OPTIONS). SNES VI reads its options again whenever the active set changes, so they stay in the database for
as long as a solve runs and are taken out afterwards: two solvers with one prefix do not meet."""

import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from petsc4py import PETSc

from ...core.errors import InputError
from .failures import last_line

Options = Mapping[str, object | None]
DIRECT = ("lu", "cholesky")


class OptionLayers:
    """Hold defaults and the user's own options under a prefix; ``in_force`` puts them into PETSc's database."""

    def __init__(self, prefix: str, defaults: Options, own: Options) -> None:
        self.prefix = prefix
        self._defaults, self._own = defaults, {key.lstrip("-"): value for key, value in own.items()}

    def apply(self, solver: Any, check: "Callable[[Any, OptionLayers], None]") -> None:
        """Set up a SNES, TAO or PC object from the options; InputError when PETSc or ``check`` does not take them."""
        with self.in_force():
            try:
                solver.setFromOptions()
            except PETSc.Error as error:
                raise InputError(f"PETSc does not accept the options under {self.prefix} ({last_line(error)}): correct "
                                 "or drop them") from error
            check(solver, self)

    @contextmanager
    def in_force(self) -> Iterator[None]:
        """Set what the database does not already hold, and take it out at the end."""
        database = PETSc.Options()
        values = {**self._defaults, **self._own}
        pc = database.getString(self.prefix + "pc_type", str(values.get("pc_type", "")))
        if pc not in DIRECT and "pc_factor_mat_solver_type" not in self._own:
            values.pop("pc_factor_mat_solver_type", None)  # the default is for our own direct solver
        added = [key for key in values if not database.hasName(self.prefix + key)]
        for key in added:
            database.setValue(self.prefix + key, "" if values[key] is None else values[key])
        try:
            yield
        finally:
            for key in added:
                database.delValue(self.prefix + key)

    def chosen(self, key: str) -> str:
        """Return the value in force; call inside ``in_force``."""
        return str(PETSc.Options(self.prefix).getString(key, ""))


def refuse(combination: str, reason: str, remedy: str) -> None:
    """Raise InputError of an unsound choice."""
    raise InputError(f"{combination} is refused because {reason}: {remedy}")


NOT_EXACT = "one application of it does not solve the system"
TABLES = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
REDUCED_PC = TABLES["reduced_pc"]


def check_reduced(snes: Any, layers: OptionLayers) -> None:
    """Refuse what does not work on the reduced systems of VINEWTONRSLS."""
    _check_type(snes, "vinewtonrsls", layers)
    pc, ksp = snes.ksp.pc.getType(), snes.ksp.getType()
    if pc in REDUCED_PC:
        refuse(f"pc_type {pc} with vinewtonrsls", REDUCED_PC[pc], "use cholesky with MUMPS, hypre or bjacobi")
    if ksp == "preonly" and pc not in DIRECT:
        refuse(f"ksp_type preonly with pc_type {pc}", NOT_EXACT, "use ksp_type cg")
    _check_line_search(layers)


def check_semismooth(snes: Any, layers: OptionLayers) -> None:
    """Refuse what needs a symmetric matrix: the Jacobian D_a + D_b A of VINEWTONSSLS is not."""
    _check_unsymmetric(snes, layers, "vinewtonssls", "vinewtonssls", "the semismooth Jacobian")


def check_friction(snes: Any, layers: OptionLayers) -> None:
    """Refuse what needs a symmetric matrix, and what fails on the reduced systems of VINEWTONRSLS, with friction."""
    pc = snes.ksp.pc.getType()
    if pc in REDUCED_PC:
        refuse(f"pc_type {pc} with friction", REDUCED_PC[pc], "use lu with MUMPS")
    _check_unsymmetric(snes, layers, "vinewtonrsls", "friction", "the system with friction")


def _check_unsymmetric(snes: Any, layers: OptionLayers, wanted: str, what: str, matrix: str) -> None:
    _check_type(snes, wanted, layers)
    pc, ksp = snes.ksp.pc.getType(), snes.ksp.getType()
    for kind, name, symmetric in (("pc", pc, ("cholesky", "icc")), ("ksp", ksp, TABLES["symmetric_ksp"])):
        if name in symmetric:
            refuse(f"{kind}_type {name} with {what}", f"{matrix} is not symmetric", "use lu with preonly")
    if ksp == "preonly" and pc != "lu":
        refuse(f"ksp_type preonly with pc_type {pc}", NOT_EXACT, "use lu or gmres")
    _check_line_search(layers)


def _check_type(snes: Any, wanted: str, layers: OptionLayers) -> None:
    if snes.getType() != wanted:
        refuse(f"option {layers.prefix}snes_type {snes.getType()}", f"the method was set up for {wanted}",
               "choose the method by Volume(method=...)")


def _check_line_search(layers: OptionLayers) -> None:
    kind = layers.chosen("snes_linesearch_type")
    if kind in ("cp", "bisection") and PETSc.Sys.getVersion() < (3, 23, 0):
        refuse(f"snes_linesearch_type {kind}", "PETSc before 3.23 ignores the bounds in its slope", "use none or bt")
