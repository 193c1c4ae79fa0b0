"""Compute resultants of nodal forces as the work of a group of cells on virtual displacements.

The nodal forces that hold a group of cells in its motion are q = K u + C v + M a - f, all of these
cells alone, with a the absolute acceleration and f their loads. For a nodal field r, rᵀq is a
number, and as K, C, M are symmetric it is (K r)ᵀu + (C r)ᵀv + (M r)ᵀa - rᵀf: three sparse products
a step, however many cells there are. With a unit translation or rotation as r it is a resultant.

Where materials yield, the stress is not K u. Then ∑ w (B r):sigma over the points of integration of
the group is in the place of (K r)ᵀu, with the stress that a state remembers; in a step it is that
of both ends, with the weights that the equation of motion has there.
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
from ...core.internal import remembers
from ...core.problem import ContactProblem
from ...core.step import Balance, Report, State
from .. import compat
from ..body.conditions import as_tuple
from ..body.initial_strains import InitialStrain
from ..body.linear_forms import LOADS, LinearForm, Loads
from ..body.loads import evaluate
from ..body.space import space_of, warn_of_other_matrices
from ..contact.surface import make_obstacle_motion
from ..mesh.group_checks import facets_of

log = logging.getLogger(__name__)

# (density, its load or None) -> (motions, owned components): what parts of cells beyond a cut have
# of inertia, its damping and loads (``cut_cells.work_beyond``)
Beyond = Callable[[Array | float, Any], Array]
# a part of the body that moves rigidly: (components of nodes that move, (owned, d) or (owned, 1);
# centre of their rotations (d,) [m]; mask of local cells of the group that holds them, ghosts too,
# None for all; what is taken away of these cells, or None)
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

    ``take`` states the pairs, and assembles the rows K r, C r, M r and those of loads; ``at_rest``
    and ``of_step`` multiply them with a state and with a step.
    """

    def __init__(
        self, owner: str, problem: ContactProblem, loads: Loads, gravity: Sequence[float] | None
    ) -> None:
        """Compile the forms. Collective.

        Args:
            owner: what is recorded, for messages.
            problem: its system is made by ``fem.assemble``.
            loads: those given to ``fem.assemble``: what acts on cells of the group belongs to their
                balance.
            gravity: acceleration (d,) [m/s²] of ``with_weight``, which acts on the mass of the
                cells.

        Raises:
            InputError: another system, loads on another mesh, a gravity of another dimension, and
                a body that is neither linear nor of materials that yield.
        """
        self._yields = remembers(problem.system.internal)
        if not self._yields:
            problem.system.refuse_nonlinear(
                owner, "leave them out, and integrate the stress of the body yourself"
            )
        space = space_of("NodalWork", problem.system)
        warn_of_other_matrices("reactions and section forces", problem.system, "MCK")
        self._problem = problem
        self.space = space
        # initial strains are known to the forms of the body
        self._loads: Any = [load for load in as_tuple(loads) if not isinstance(load, InitialStrain)]
        for load in self._loads:
            facets = getattr(load, "facets", None)
            if facets is not None:
                facets_of("NodalWork", "the facets of loads", facets, space.mesh)
        self._gravity = self._read_gravity(gravity)

        # linear forms with a Function r and an indicator of the group: their products with nodal u,
        # v, a, initial strains and loads are rᵀK u, rᵀC v, rᵀM a, -rᵀf_0 and rᵀf
        self._r = compat.function(space.V)
        self._inside = compat.function(compat.cell_space(space.mesh))
        self._forms: list[Any] = []
        linear = not self._yields
        for name in ("K", "C", "M"):
            form = None
            if name == "M" or (name == "C" and space.forms.damped) or (name == "K" and linear):
                form = space.compile_form(space.forms.against(name, self._r, self._inside))
            self._forms.append(form)
        self._initial = [] if space.forms.initial is None else [space.forms.initial]
        for strains in self._initial:
            self._forms.append(space.compile_form(strains.against(self._r, self._inside)))
        g = ufl.TestFunction(space.V)
        mesh = space.mesh
        h = space.forms.section.thickness
        self._load_forms: list[Any] = []
        for load in self._loads:
            form = None
            if not isinstance(load, LinearForm):
                work = h * self._inside * ufl.inner(self._r, load.acting(g, mesh))
                form = space.compile_form(work * load.measure(mesh))
            self._load_forms.append(form)
        # a LinearForm has nodal forces instead, here by the number of the load
        self._nodal = {
            k: load.full(space, h)
            for k, load in enumerate(self._loads)
            if isinstance(load, LinearForm)
        }
        self._tell_constant_loads(owner)

    def _read_gravity(self, gravity: Sequence[float] | None) -> Array:
        """Return the acceleration (d,) [m/s²], zero where none is given.

        Raises:
            InputError: another dimension, or a system whose mass nobody said.
        """
        dimension = self.space.dimension
        acceleration = np.zeros(dimension)
        if gravity is not None:
            acceleration = np.asarray(gravity, dtype=float)
        if acceleration.shape != (dimension,):
            raise InputError(
                f"gravity has {acceleration.size} components: give {dimension} numbers"
            )
        if acceleration.any():
            self._problem.system.refuse_statics_only("gravity=")
        return acceleration

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
        """Take the rigid motions of each part as r, one after the other. Collective.

        Raises:
            InputError: a cut whose cells have a LinearForm, or through cells whose density is
                unknown.
        """
        space = self.space
        self._check_parts(parts)
        # of each row of works one for every motion, and how far held nodes move obstacles then
        forms = [*self._forms, *self._load_forms]
        rows: list[list[Any]] = [[] for _ in forms]
        surface = self._problem.surface
        conditions = getattr(surface, "parts", ())
        move_obstacles = None
        if conditions:
            traced = surface.traces is not None
            move_obstacles = make_obstacle_motion(space, conditions, traced=traced)
        self._direct: list[tuple[Array, Array]] = []
        densities = self._densities()
        for where, centre, cells, beyond in parts:
            # the forms integrate over whole cells: what is beyond a cut is taken away from them, of
            # C, M and loads in the order of ``forms`` (nothing of K and initial strains)
            self._inside.x.array[:] = 1.0 if cells is None else cells
            less = [beyond and beyond(*density) for density in densities]
            C, M, *loads = less
            less = [None, C, M, *(None for _ in self._initial), *loads]
            # contact forces on held nodes do not reach their cells
            straight = space.held & where & (cells is None or space.hierarchy is not None)
            for k, motion in enumerate(rigid_motions(space.points, centre)):
                if move_obstacles is not None:
                    self._direct.append(move_obstacles(np.where(straight, motion, 0.0)))
                moved = np.where(where, motion, 0.0).ravel()
                # what follows held nodes through ties takes its forces to them
                self._r.x.array[: motion.size] = (
                    space.elimination.lift(moved) if cells is None else moved
                )
                self._r.x.scatter_forward()
                space.forms.follow(self._r)
                if self._yields:
                    strain = space.forms.find_stress_row(self._r.x.array, self._inside.x.array)
                    rows[0].append(sp.csr_matrix(strain.ravel()))
                for n, (own, form, away) in enumerate(zip(rows, forms, less, strict=True)):
                    if form is not None:
                        row = self._find_row(form, damping=n == 1)
                        own.append(sp.csr_matrix(row if away is None else row - away[k]))
                    elif n - len(self._forms) in self._nodal:
                        own.append(sp.csr_matrix(self._r.x.array[: motion.size]))
        self._count = len(rows[2])  # all bodies have a mass
        self._matrices: list[Any] = [sp.vstack(own).tocsr() if own else None for own in rows]
        self._still: dict[int, Array] = {}

    def _check_parts(self, parts: Sequence[Rigid]) -> None:
        """Raise InputError for parts whose loads or inertia are unknown."""
        if self._nodal and any(
            cells is not None or beyond is not None for _, _, cells, beyond in parts
        ):
            raise InputError(
                "section forces: the part of a LinearForm on the cells of a cut is unknown; give "
                "these loads as Traction and BodyForce, or record Reactions"
            )
        if not self.space.forms.densities and any(beyond for *_, beyond in parts):
            raise InputError(
                "a section goes through elements, and with forms=… the mass of their parts is "
                "unknown: let it run along element sides, or give a material for the density in "
                "place of mass="
            )

    def _find_row(self, form: Any, *, damping: bool) -> Array:
        """Return the row (owned nodes d,) of a form on the motion at hand. Collective.

        Where materials yield, damping has the part of the elastic K beside its form.
        """
        row = np.array(compat.assemble_vector(form).array_r)
        if self._yields and damping:
            row += self.space.forms.find_damping_row(self._r.x.array, self._inside.x.array)
        return row

    def _densities(self) -> list[Any]:
        """Return (density, its load) of the damping and inertia of mass, then of all loads.

        They are of each local cell, [kg/(s m³)] and [kg/m³] times the thickness; of loads it is the
        thickness [m]. None stands for what the body's forms do not tell.
        """
        ours = self.space.forms
        densities: list[Any] = [
            (ours.cellwise(name), None) if ours.densities else None for name in ("alpha_rho", "rho")
        ]
        return densities + [(ours.section.thickness, load) for load in self._loads]

    def at_rest(self, state: State) -> Array:
        """Return the works (count,) [N, N m] of a state without acceleration. Collective.

        Such is a static one, or the start of a run.
        """
        problem = self._problem
        space = self.space
        t = state.t
        motion = [
            space.expand(problem.cartesian(x), t, k) for k, x in enumerate((state.u, state.v))
        ]
        # gravity g acts on the mass as the acceleration -g
        motion.append(np.zeros_like(motion[0]) - self._gravity)
        if self._yields:
            motion[0] = self._find_stress(state)
        return self._sum(motion, lambda function: function(t), state)

    def of_step(self, report: Report) -> Array:
        """Return the works (count,) [N, N m] in a step's equation of motion. Collective.

        This is ``Report.balance``, with absolute accelerations. Loads, prescribed and ground motion
        are taken between the ends of the step where the balance has its u.
        """
        problem = self._problem
        space = self.space
        balance = report.balance
        late = self._weigh_end(report)
        t0 = report.old.t
        t1 = report.new.t

        def between(value: Callable[[float], Any]) -> Any:
            if late == 1.0:
                return value(t1)
            return (1.0 - late) * value(t0) + late * value(t1)

        motion = []
        for k, x in enumerate((balance.u, balance.v, balance.a)):
            free = problem.cartesian(x)
            if space.moves:
                motion.append(between(partial(space.expand, free, derivative=k)))
            else:
                motion.append(space.expand(free, t1, k))
        motion[2] = motion[2] + between(problem.ground_acceleration) - self._gravity
        if self._yields:
            stress = self._find_stress(report.new)
            motion[0] = (1.0 - late) * self._find_stress(report.old) + late * stress
        return self._sum(motion, between, balance)

    def _find_stress(self, state: State) -> Array:
        """Return sigma (points, n) [Pa] of a body that yields in a state. Collective."""
        u = self._problem.cartesian(state.u)
        internal: Any = self._problem.system.internal
        stress: Array = internal.go_on(state.memory, u).stress(u)
        return stress

    def _weigh_end(self, report: Report) -> float:
        """Return w of u = (1 - w) u_old + w u_new in the balance. Collective.

        By least squares w = (u - u_old)·(u_new - u_old) / |u_new - u_old|², between 0 and 1; it is
        1 where nothing moved.
        """
        way = report.new.u - report.old.u
        here = report.balance.u - report.old.u
        both, square = self.space.comm.sum(np.array([here @ way, way @ way]))
        return float(min(max(both / square, 0.0), 1.0)) if square > 0.0 else 1.0

    def _sum(
        self, motion: Sequence[Array], evaluate_at: Callable[..., Any], contact: State | Balance
    ) -> Array:
        """Return the works (count,) of all ranks, less contact forces on held nodes. Collective.

        Args:
            motion: nodal u, v, a (owned, d); where materials yield sigma (points, n) for u.
            evaluate_at: takes a function of time, and returns its value in the step.
            contact: a state or balance with the contact forces.
        """
        # contact forces on held nodes, whose motion r moves the obstacles of conditions, reach no
        # cell of theirs
        total = np.zeros(self._count)
        r_t = 0.0 if contact.r_t is None else contact.r_t
        for k, (towards, along) in enumerate(self._direct):
            total[k] = towards @ contact.r_n - np.sum(along * r_t)
        # (K r)ᵀu + (C r)ᵀv + (M r)ᵀa - rᵀf_0 - rᵀf
        factors = [*motion, *(evaluate_at(strains.follow) for strains in self._initial)]
        for matrix, x in zip(self._matrices, factors, strict=False):
            if matrix is not None:
                total += matrix @ x.ravel()
        for k, load in enumerate(self._loads):
            total -= self._load_work(k, load, evaluate_at)
        return self.space.comm.sum(total)

    def _load_work(
        self, k: int, load: Any, evaluate_at: Callable[[Callable[[float], Any]], Any]
    ) -> Array:
        """Return rᵀf on this rank, (count,); what does not change with time is evaluated once.

        Args:
            k: the number of the load.
            load: the load.
            evaluate_at: takes a function of time, and returns its value in the step.
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
            return np.asarray(evaluate_at(work))
        if k not in self._still:
            self._still[k] = work(0.0)
        if load.history is None:
            return self._still[k]
        return np.asarray(evaluate_at(load.history) * self._still[k])


def rigid_motions(points: Array, centre: Array) -> Array:
    """Return the unit translations and rotations of points, (motions, k, d).

    Args:
        points: (k, d) [m].
        centre: (d,) of the rotations [m]; on a line there are none.
    """
    d = points.shape[1]
    arms = points - centre
    shifts = [np.tile(axis, (len(points), 1)) for axis in np.eye(d)]
    turns = []
    if d == 2:
        turns = [np.column_stack([-arms[:, 1], arms[:, 0]])]
    if d == 3:
        turns = [np.cross(axis, arms) for axis in np.eye(3)]
    return np.array([*shifts, *turns])
