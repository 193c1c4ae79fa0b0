"""Compute the work of a group of cells on virtual displacements.

This gives the resultants of nodal forces without making the forces.

The nodal forces that hold a group of cells in its motion are q = K u + C v + M a - f, all of these
cells alone, with a the absolute acceleration and f their loads. For a nodal field r, rᵀq is a
number, and as K, C, M are symmetric it is (K r)ᵀu + (C r)ᵀv + (M r)ᵀa - rᵀf: three sparse products
a step, however many cells there are.
"""

import logging
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
import scipy.sparse as sp
import ufl

from ...core.algebra import Array, Mask
from ...core.checks import array, instance, optional
from ...core.errors import InputError
from ...core.problem import ContactProblem
from ...core.step import Balance, Report, State
from .. import compat
from ..body.conditions import as_tuple
from ..body.initial_strains import InitialStrain
from ..body.linear_forms import LOADS, LinearForm, Loads
from ..body.loads import evaluate
from ..body.space import known_matrices, space_of
from ..contact.surface import moved_by_held
from ..mesh.group_checks import facets_of

log = logging.getLogger(__name__)

# (density, its load or None) -> (motions, owned components)
Beyond = Callable[[Array | float, Any], Array]
# (components of nodes that move, (owned, d) or (owned, 1); centre of their rotations (d,); mask of
# local cells of the group, ghosts too, None for all; what is taken away of inertia, its damping and
# loads, or None)
Rigid = tuple[Mask, Array, Mask | None, Beyond | None]


def check_actions(owner: str, loads: Any, gravity: Any) -> None:
    """Raise InputError unless these are loads, as for ``fem.assemble``, and an acceleration.

    Args:
        owner: who asks.
        loads: what was given.
        gravity: what was given [m/s²].
    """
    for load in as_tuple(loads):
        instance(owner, "loads", load, LOADS, "give the loads of fem.assemble")
    optional(array, owner, "gravity", gravity, (None,), unit="m/s²")


class NodalWork:
    """Compute rᵀ(K u + C v + M a - f) for any number of pairs (r, group of cells).

    Args:
        owner: what is recorded, for messages.
        problem: its system is made by ``fem.assemble``; InputError otherwise.
        loads: those given to ``fem.assemble``: what acts on cells of the group belongs to their
            balance.
        gravity: acceleration (d,) [m/s²] of ``with_weight``, which acts on the mass of the cells.
    """

    def __init__(
        self, owner: str, problem: ContactProblem, loads: Loads, gravity: Sequence[float] | None
    ) -> None:
        space = space_of("NodalWork", problem.system)
        known_matrices("reactions and section forces", problem.system, "MCK")
        self._problem = problem
        self.space = space
        # known to the body
        self._loads: Any = [one for one in as_tuple(loads) if not isinstance(one, InitialStrain)]
        for facets in (getattr(load, "facets", None) for load in self._loads):
            if facets is not None:
                facets_of("NodalWork", "the facets of loads", facets, space.mesh)
        self._gravity = (
            np.zeros(space.dimension) if gravity is None else np.asarray(gravity, dtype=float)
        )
        if self._gravity.shape != (space.dimension,):
            raise InputError(
                f"gravity has {self._gravity.size} components: give {space.dimension} numbers"
            )
        if self._gravity.any():
            problem.system.refuse_statics_only("gravity=")
        self._r = compat.function(space.V)
        self._inside = compat.function(compat.cell_space(space.mesh))
        self._forms = [
            space.compiled(space.forms.against(name, self._r, self._inside))
            if name != "C" or space.forms.damped
            else None
            for name in ("K", "C", "M")
        ]
        self._initial = [] if space.forms.initial is None else [space.forms.initial]
        self._forms += [space.compiled(one.against(self._r, self._inside)) for one in self._initial]
        g = ufl.TestFunction(space.V)
        mesh = space.mesh
        h = space.forms.section.thickness
        self._load_forms = [  # their products with nodal values of the loads are rᵀf
            None
            if isinstance(load, LinearForm)
            else space.compiled(
                h * self._inside * ufl.inner(self._r, load.acting(g, mesh)) * load.measure(mesh)
            )
            for load in self._loads
        ]
        self._nodal = {
            k: one.full(space, h)
            for k, one in enumerate(self._loads)
            if isinstance(one, LinearForm)
        }
        self._tell_constant_loads(owner)

    def _tell_constant_loads(self, owner: str) -> None:
        """Warn when the system has constant loads and none were given. Collective.

        Who forgets the weight measures reactions that do not carry it.
        """
        system = self._problem.system
        space = self.space
        theirs = space.comm.sum(system.influence.T @ system.load.constant)
        if (
            theirs.any()
            and not (self._loads or self._gravity.any() or self._initial)
            and space.comm.rank == 0
        ):
            text = ", ".join(f"{x:.4g}" for x in theirs)
            log.warning(
                "%s: the system has constant loads of (%s) N in all, and none were given here: if "
                "they act on these elements, give the loads of fem.assemble or the gravity of "
                "with_weight",
                owner,
                text,
            )

    def take(self, parts: Sequence[Rigid]) -> None:
        """Take the rigid motions of each part as r, one after the other. Collective."""
        if self._nodal and any(
            cells is not None or beyond is not None for _, _, cells, beyond in parts
        ):
            raise InputError(
                "section forces: the part of a LinearForm on the cells of a cut is unknown; give "
                "these loads as Traction and BodyForce, or record Reactions"
            )
        forms = [*self._forms, *self._load_forms]
        ours = self.space.forms
        if not ours.densities and any(beyond for *_, beyond in parts):
            raise InputError(
                "a section goes through elements, and with forms=… the mass of their parts is "
                "unknown: let it run along element sides, or give a material for the density in "
                "place of mass="
            )
        densities = [
            (ours.cellwise(name), None) if ours.densities else None for name in ("alpha_rho", "rho")
        ]
        densities += [(ours.section.thickness, load) for load in self._loads]
        rows: list[list[Any]] = [[] for _ in forms]
        moved = (
            [moved_by_held(self.space, made)]
            if (made := getattr(self._problem.surface, "parts", ()))
            else []
        )
        # how far each motion of held nodes moves obstacles
        self._direct: list[tuple[Array, Array]] = []
        for where, centre, cells, beyond in parts:
            self._inside.x.array[:] = 1.0 if cells is None else cells
            less = [beyond and beyond(*density) for density in densities]  # type: ignore[misc]
            less[2:2] = [None for _ in self._initial]
            straight = self.space.held & where & (cells is None or self.space.hierarchy is not None)
            for k, motion in enumerate(rigid_motions(self.space.points, centre)):
                self._direct += [one(np.where(straight, motion, 0.0)) for one in moved]
                self._r.x.array[: motion.size] = np.where(where, motion, 0.0).ravel()
                self._r.x.scatter_forward()
                self.space.forms.follow(self._r)
                for n, (own, form, away) in enumerate(zip(rows, forms, [None, *less], strict=True)):
                    if form is not None:
                        row = compat.assemble_vector(form).array_r
                        own.append(sp.csr_matrix(row if away is None else row - away[k]))
                    elif n - len(self._forms) in self._nodal:
                        own.append(sp.csr_matrix(self._r.x.array[: motion.size]))
        self._count = len(rows[0])
        self._matrices: list[Any] = [sp.vstack(own).tocsr() if own else None for own in rows]
        self._still: dict[int, Array] = {}

    def at_rest(self, state: State) -> Array:
        """Return the work of a state without acceleration, (count,).

        It is a static one, or the start of a run.
        """
        problem = self._problem
        space = self.space
        t = state.t
        motion = [
            space.expand(problem.cartesian(x), t, k) for k, x in enumerate((state.u, state.v))
        ]
        return self._sum(
            [*motion, np.zeros_like(motion[0]) - self._gravity], lambda one: one(t), state
        )

    def of_step(self, report: Report) -> Array:
        """Return the work in a step's equation of motion (``Report.balance``), (count,).

        It takes absolute accelerations.

        Loads, prescribed and ground motion are taken between the ends of the step where the balance
        has its u.
        """
        problem = self._problem
        space = self.space
        balance = report.balance
        late = self._place(report)
        t0 = report.old.t
        t1 = report.new.t

        def between(value: Callable[[float], Any]) -> Any:
            return value(t1) if late == 1.0 else (1.0 - late) * value(t0) + late * value(t1)

        motion = []
        for k, x in enumerate((balance.u, balance.v, balance.a)):
            free = problem.cartesian(x)
            motion.append(
                between(partial(space.expand, free, derivative=k))
                if space.moves
                else space.expand(free, t1, k)
            )
        motion[2] = motion[2] + between(problem.ground_acceleration) - self._gravity
        return self._sum(motion, between, balance)

    def _place(self, report: Report) -> float:
        """Return w of u = (1 - w) u_old + w u_new; the end where nothing moved."""
        way = report.new.u - report.old.u
        here = report.balance.u - report.old.u
        both, square = self.space.comm.sum(np.array([here @ way, way @ way]))
        return float(min(max(both / square, 0.0), 1.0)) if square > 0.0 else 1.0

    def _sum(
        self, motion: Sequence[Array], at: Callable[..., Any], contact: State | Balance
    ) -> Array:
        """Return the numbers for nodal u, v, a (owned, d), less contact forces on held ones.

        ``at`` evaluates functions.

        Args:
            motion: nodal u, v, a (owned, d).
            at: evaluates a function of time at that of the step.
            contact: a state or balance with the contact forces.
        """
        total = np.zeros(self._count)
        r_t = 0.0 if contact.r_t is None else contact.r_t
        for k, (towards, along) in enumerate(self._direct):
            total[k] = towards @ contact.r_n - np.sum(along * r_t)
        for matrix, x in zip(
            self._matrices, [*motion, *(at(one.follow) for one in self._initial)], strict=False
        ):
            if matrix is not None:
                total += matrix @ x.ravel()
        for k, load in enumerate(self._loads):
            total -= self._of_load(k, load, at)
        return self.space.comm.sum(total)

    def _of_load(self, k: int, load: Any, at: Callable[[Callable[[float], Any]], Any]) -> Array:
        """Return rᵀf on this rank, (count,); what does not change with time is evaluated once.

        Args:
            k: the number of the load.
            load: the load.
            at: evaluates a function of time at that of the step.
        """

        def work(t: float) -> Array:
            if isinstance(load, LinearForm):
                values = self._nodal[k](t)
            else:
                values = evaluate(
                    type(load).__name__, load.value, self.space.points, t, self.space.comm
                )
            return np.asarray(self._matrices[len(self._forms) + k] @ values.ravel())

        if load.history is None and not load.is_constant:
            return np.asarray(at(work))
        if k not in self._still:
            self._still[k] = work(0.0)
        return (
            self._still[k]
            if load.history is None
            else np.asarray(at(load.history) * self._still[k])
        )


def rigid_motions(points: Array, centre: Array) -> Array:
    """Return (motions, k, d) unit translations and rotations of points (k, d).

    The rotations are about a centre of the points; on a line there are none.
    """
    d = points.shape[1]
    arms = points - centre
    shifts = [np.tile(axis, (len(points), 1)) for axis in np.eye(d)]
    turns = [np.column_stack([-arms[:, 1], arms[:, 0]])] if d == 2 else []
    return np.array([*shifts, *turns, *(np.cross(axis, arms) for axis in np.eye(3) if d == 3)])
