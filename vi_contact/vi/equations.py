"""Evaluate F, its Jacobian and the energy on the unknowns that no condition holds."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from ufl.algorithms import expand_derivatives

from ..core.algebra import Array, Mask, largest, max_abs, total
from ..core.checks import describe_point, refuse
from ..fem import compat
from ..fem.body.form_checks import refuse_not_linear
from ..fem.matrices.petsc_algebra import PetscMatrix
from ..fem.mesh.communicators import MpiComm
from .forms import depends_on, differentiate, make_error, split_form
from .jacobian import FreeJacobian
from .rounding import OFF, measure_field

# Gauss's rule on (0, 1): places and weights
_places, _weights = np.polynomial.legendre.leggauss(4)
GAUSS = (0.5 * (1.0 + _places), 0.5 * _weights)


class Equations:
    """Evaluate F, its Jacobian J and the energy at the present u, for one answer after another.

    Vectors are of the unknowns of this rank that are ``free``: no Dirichlet condition holds them.
    The others are *held*. Their values go from those of the first guess to the prescribed ones
    along a straight line, of which the share ``left`` is still to come: 0.0 where the conditions
    are met.

    Attributes:
        constant: whether J is the same at every u, so that the problem is linear.
        version: of J on the free unknowns; it grows whenever an entry changes.
        given: the values of u before the first step (of a part of the change, see ``aim``), those
            of ghosts too.
        free: (n,) which owned unknowns no condition holds.
        owned: their number.
        size: of the field; known after ``restrict_bounds``.
    """

    def __init__(
        self, form: Any, u: Any, bcs: Sequence[Any], J: Any, energy: Any, comm: MpiComm
    ) -> None:
        """Check and compile the forms. Collective.

        Args:
            form: F(u; v), or (a, L); None with an energy.
            u: the Function to solve for.
            bcs: Dirichlet conditions.
            J: the Jacobian; None for the derivative of F.
            energy: the functional of u; None with a form.
            comm: the ranks of its mesh, for as long as the program lasts.

        Raises:
            InputError: forms or conditions do not fit u.
        """
        if energy is None:
            F, J = split_form(form, u, J)
        else:
            F, J = differentiate(energy, u)
        space = u.function_space
        self.u = u
        self.comm = comm
        self.owned = space.dofmap.index_map_bs * space.dofmap.index_map.size_local
        if not isinstance(bcs, list | tuple) or not all(compat.constrains(bc, space) for bc in bcs):
            raise make_error(
                "bcs is wrong: give a list of dirichletbc objects on the space of u or its "
                "components"
            )

        # Where conditions hold u; what they prescribe there is read in ``start``.
        self._conditions = tuple(bcs)
        self._held = np.zeros(len(u.x.array), dtype=bool)
        for bc in bcs:
            held, _ = compat.bc_values(bc, len(self._held))
            self._held[held] = True
        self.free: Mask = ~self._held[: self.owned]

        refuse_not_linear("vi.solve: F or J", F)
        refuse_not_linear("vi.solve: F or J", J)
        self._F = compat.compile_form(F)
        self._J = compat.compile_form(J)
        self._energy = None if energy is None else compat.compile_form(energy)
        self._residual = compat.function(space)
        self.constant = not depends_on(expand_derivatives(J), u)
        self._jacobian: FreeJacobian | None = None
        self.version = 0
        self.measure_work_from(None)
        self.start()

    def start(self) -> None:
        """Take the present u for the first guess, and read what the conditions prescribe."""
        self._first = np.array(self.u.x.array)
        self.given = self._first
        self._prescribed = np.zeros(len(self.given))
        for bc in self._conditions:
            held, values = compat.bc_values(bc, len(self.given))
            self._prescribed[held] = values
        self._values = self._prescribed
        # Coefficients may have changed since the last answer: J is assembled again.
        self._is_assembled = False

    @property
    def x(self) -> Array:
        """Return the free unknowns of u."""
        return np.array(self.u.x.array[: self.owned][self.free], dtype=float)

    @property
    def change(self) -> Array:
        """Return the prescribed values less those of the first guess, of ghosts too.

        They are zero at free unknowns.
        """
        return np.where(self._held, self._values - self.given, 0.0)

    def put(self, x: Array, left: float = 0.0) -> None:
        """Write the free unknowns (n,) into u, and the held ones. Collective.

        Args:
            x: (n,) values of the free unknowns.
            left: the share of their change that the held ones lack, from 0 (at their prescribed
                values) to 1 (as in the first guess).
        """
        values = self.u.x.array
        values[self._held] = self._values[self._held]
        if left:
            values[self._held] -= left * self.change[self._held]
        values[: self.owned][self.free] = x
        self.u.x.scatter_forward()

    def dot(self, x: Array, y: Array) -> float:
        """Return x·y over all ranks. Collective."""
        return total(self.comm, x @ y)

    def count(self, mask: Mask) -> int:
        """Return how many entries of a mask are True, over all ranks. Collective."""
        return round(total(self.comm, np.count_nonzero(mask)))

    def all(self, here: bool) -> bool:
        """Say whether something is true on every rank. Collective."""
        return not largest(self.comm, not here)

    def locate_unknowns(self) -> Array:
        """Return (n, 4) where the free unknowns are. Collective.

        The columns are coordinates as shares of the body's box, and the component as a share of
        their number.
        """
        space = self.u.function_space
        width = space.dofmap.index_map_bs
        x = space.tabulate_dof_coordinates()[: self.owned // width]
        low = -self.comm.max(-np.min(x, axis=0, initial=np.inf))
        high = self.comm.max(np.max(x, axis=0, initial=-np.inf))
        shares = np.repeat((x - low) / np.where(high > low, high - low, 1.0), width, axis=0)
        component = np.tile(np.arange(width) / width, len(x))
        return np.column_stack([shares, component])[self.free]

    def put_back(self) -> None:
        """Write the first guess into u, with the values that held unknowns had in it."""
        self.u.x.array[:] = self._first
        self.given = self._first
        self._values = self._prescribed

    def aim(self, share: float) -> None:
        """Take the present u for the first guess, and prescribe a part of the change.

        Prescribed values are then those of this share of the way from the very first guess.
        """
        self.given = np.array(self.u.x.array)
        way = self._prescribed - self._first
        self._values = self._prescribed if share == 1.0 else self._first + share * way

    def assemble_residual(self) -> Array:
        """Return F at u. Collective."""
        compat.assemble_into(self._F, self._residual)
        return np.array(self._residual.x.array[: self.owned][self.free])

    def evaluate_energy(self) -> float:
        """Return the energy at u, infinity where it is no number. Collective.

        Where F alone is given, it is the work of F since ``measure_work_from``.
        """
        energy = self._integrate_work()
        if self._energy is not None:
            energy = total(self.comm, compat.assemble_scalar(self._energy))
        return energy if np.isfinite(energy) else np.inf

    def measure_work_from(self, x: Array | None, energy: float = 0.0) -> None:
        """Measure the work of F from here on, where F alone is given.

        Args:
            x: (n,) free unknowns; None for a work of zero wherever F is a number.
            energy: the energy there.
        """
        self._origin = x
        self._energy_at_origin = energy

    def _integrate_work(self) -> float:
        """Return the energy at u by the work of F on the straight way to it. Collective.

            E(x) = E(x_0) + ∫_0^1 F(x_0 + s (x - x_0))·(x - x_0) ds

        It is a function of u where the Jacobian of F is symmetric, and zero where an energy is
        given. By Gauss's rule, whose points are inside: a way along which F is no number is too
        long.
        """
        if self._energy is not None:
            return 0.0
        x = self.x
        if self._origin is None:
            is_finite = self.all(bool(np.all(np.isfinite(self.assemble_residual()))))
            return 0.0 if is_finite else np.inf
        way = x - self._origin
        energy = self._energy_at_origin
        for place, weight in zip(*GAUSS, strict=True):
            self.put(self._origin + place * way)
            energy += weight * self.dot(self.assemble_residual(), way)
        self.put(x)
        return energy

    def linearise(self, left: float) -> tuple[PetscMatrix, Array]:
        """Return J at u on the free unknowns, and what F of these will gain (n,). Collective.

        F gains it, to first order, by the share ``left`` of the change of the held ones. J is the
        same object always, whose entries are then new.
        """
        if self._jacobian is None:
            self._jacobian = FreeJacobian(self._J, self.free, self.comm)
        # A constant Jacobian is assembled once for an answer, and often as it was before.
        if not self._is_assembled or not self.constant:
            self._jacobian.assemble()
            self.version += not self.constant or self._jacobian.has_changed()
            self._is_assembled = True
        gain = np.zeros(np.count_nonzero(self.free))
        if left:
            gain = self._jacobian.apply_whole(left * self.change[: self.owned])[self.free]
        return self._jacobian.part, gain

    def spread(self, values: Array) -> Any:
        """Return values (n,) of the free unknowns as a Function, zero elsewhere. Collective."""
        function = compat.function(self.u.function_space)
        function.x.array[: self.owned][self.free] = values
        function.x.scatter_forward()
        return function

    def close(self) -> None:
        """Free the matrices; collective."""
        if self._jacobian is not None:
            self._jacobian.close()
        self._jacobian = None

    def restrict_bounds(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Return the bounds of the free unknowns. Collective.

        What misses by rounding (``rounding``) contradicts nothing: a prescribed value that is
        beyond a bound stays as it is, and where lower is above upper the unknown is held at
        lower.

        Args:
            low: bounds of all owned unknowns from below.
            high: from above.

        Raises:
            InputError: on all ranks, where bounds contradict each other or the conditions.
        """
        # u as it would be with the conditions: what bounds are compared with, and what tells the
        # size of the field that rounding is relative to.
        u = np.where(self._held, self._values, self.given)[: self.owned]
        space = self.u.function_space
        self.size = measure_field(np.nan_to_num(u, nan=np.inf), low, high, self.comm)
        off = OFF * self.size

        # Masks of what is wrong at unknowns of this rank; the first defect of any rank is told.
        defects = (
            (~np.isfinite(u), "the first guess or bcs are NaN or infinite: correct them"),
            (
                np.isnan(low) | np.isnan(high),
                "a bound is not a number: give None where there is none",
            ),
            (low > high + off, "lower is above upper: give lower <= upper"),
            (
                (low == np.inf) | (high == -np.inf),
                "no number is allowed: give finite bounds, or None",
            ),
            (
                ~self.free & ((u < low - off) | (u > high + off)),
                "bcs prescribe a value beyond a bound: correct it",
            ),
        )

        def describe(i: int, words: str) -> str:
            node, component = divmod(i, space.dofmap.index_map_bs)
            place = describe_point(space.tabulate_dof_coordinates()[node])
            where = f"component {component} at {place}"
            return f"vi.solve: {where}, where u is {u[i]:g} in [{low[i]:g}, {high[i]:g}]: {words}"

        sentences = [
            describe(int(np.argmax(wrong)), words) for wrong, words in defects if np.any(wrong)
        ]
        refuse(sentences, self.comm)
        return low[self.free], np.maximum(low, high)[self.free]

    def moves(self, low: Array, high: Array) -> bool:
        """Say whether conditions or bounds change the first guess by more than rounding.

        It is asked after ``restrict_bounds``. Collective.
        """
        x = self.given[: self.owned][self.free]
        most = max(max_abs(self.change), max_abs(x - np.clip(x, low, high)))
        return largest(self.comm, most) > OFF * self.size
