"""Read and run case files.

A case file is a contact problem and its run in TOML, table by table the calls of the Python
interface.

[mesh]            fem.build_mesh, fem.read_mesh        [scheme] [solver] [[escalation]]
[material.NAME]   LinearElastic, Orthotropic, MohrCoulomb, … [[record]] [fields]
[system]          fem.assemble                         [run]      the other arguments of simulate
[reservoir]       fem.Reservoir, of fem.assemble
[[contact]]       fem.contact_surface, .contact_pair   [gravity]  with_weight, static_equilibrium
[friction] [impact] [mass] [[excitation]]              [[check]]  to compare with engineering.checks
[[stage]]  what replaces these tables in stages that follow one another
[sheet]            whose the report is, which numbers decide in it, and its units
[beam] [particle]  bodies and their contact, in place of [mesh] and the tables that belong to it
[layer]            layer.contact_layer, in place of [friction], [impact] and [scheme]
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ....core.arguments import check_type
from ....core.errors import InputError
from ....core.files import on_root
from ....core.problem import ContactProblem
from ....core.protocols import Excitation, FrictionLaw, Frictionless, ImpactLaw, MassLaw
from ....core.state_checks import initial_state
from ....core.step import Recorder, Scheme, Solver, State
from ....core.surfaces import ContactSurface, empty_surface
from ....fem.body.assembly import assemble
from ....fem.body.heterogeneous import Heterogeneous
from ....fem.body.reservoir import Reservoir
from ....fem.contact.joined import joined_surfaces
from ....fem.mesh.communicators import MpiComm
from ....fem.mesh.tagged_mesh import Tags, build_mesh, read_mesh
from ....laws.hyperelastic import TurningLaw
from ....laws.mass import ConsistentMass
from ....laws.materials import LinearElastic
from ....laws.orthotropic import Orthotropic
from ....laws.yielding import YieldingMaterial
from ....meshes.gmsh_session import MeshScript
from ....run.cross_check import CrossChecked
from ....run.files.folder import lock_folder, refuse_files_of_others, run_folder
from ....run.files.writer import FieldWriter
from ....run.joint_uniqueness import joint_uniqueness
from ....run.method import with_defaults
from ....run.recorders import Contact, Energy, JointEnergy
from ....run.recorders.steps import Steps
from ....run.simulate import Solution, rehearse, simulate
from ....run.time_steps import StepPlan, plan_steps
from ....solvers.automatic import Automatic
from ...engineering.checks.comparison import Check
from ...sheet.choices import Sheet, refuse_unknown_numbers
from .bodies import (
    BeamBody,
    Body,
    LayerLaw,
    ParticleBody,
    find_body_table,
    refuse_mixed,
    refuse_ranks,
)
from .expressions import check_axes
from .friction_of_tables import join_laws, list_laws
from .joints_of_tables import join_joints
from .library import check_format, find_base_folder, keep_copy, refuse_case_of_others
from .old_keys import renew_keys
from .own_classes import check_packages
from .parsing import Words, read, read_arguments, suggest_nearest
from .sentences import in_words_of_case_files
from .stage_tables import Stage, split_stages
from .stages import Reached, run_stages
from .strain_compatible import CALL, iterate, with_known_damping
from .table_calls import (
    SUPPLIED,
    Call,
    Callee,
    Group,
    Node,
    Spot,
    build,
    list_calls,
    make_callee,
    needs_body,
    walk_nodes,
)
from .toml_file import read_toml, with_settings
from .unread_choices import Part, find_unread, refuse_unread
from .vocabulary import MeshFile, Parts, make_words, weight

if TYPE_CHECKING:
    from ....layer import ContactLayer

# in the order in which they are read: type of what a table makes, or the one call it is
TABLES: dict[str, Any] = {
    "title": str,
    "mesh": MeshScript | MeshFile,
    "beam": BeamBody,
    "particle": ParticleBody,
    "material": Mapping[
        str, LinearElastic | Orthotropic | Heterogeneous | YieldingMaterial | TurningLaw
    ],
    "system": make_callee(assemble, keys={"clamped": "fixed"}, supplied=(*SUPPLIED, "reservoir")),
    "reservoir": make_callee(Reservoir),
    "strain_compatible": CALL,
    "contact": ContactSurface | Sequence[ContactSurface],
    "layer": LayerLaw,
    "gravity": make_callee(weight, name="with_weight"),
    "friction": FrictionLaw,
    "impact": ImpactLaw,
    "mass": MassLaw,
    "excitation": Excitation | Sequence[Excitation],
    "scheme": Scheme,
    "solver": Solver,
    "escalation": Solver | Sequence[Solver],
    "run": replace(
        make_callee(
            simulate, only=("dt", "t_end", "steps", "tolerance", "checkpoint_every", "out")
        ),
        function=dict,
    ),
    "record": Recorder | Sequence[Recorder],
    "fields": FieldWriter,
    "check": Check | Sequence[Check],
    "sheet": make_callee(Sheet),
}


@dataclass(frozen=True)
class Case:
    """Hold a case file that has been read and checked; nothing is computed yet.

    Attributes:
        path: of the file.
        tables: its content, with the settings.
        settings: the KEY=VALUE made after reading.
        nodes: the calls that its tables are; those of the last stage, if there are stages.
        allowed: the packages whose classes it may name.
        ready: mesh and groups, when they are.
        stages: of [[stage]]. All but ``run`` and ``check`` is about the last one then.
    """

    path: Path
    tables: Mapping[str, Any]
    settings: tuple[str, ...]
    nodes: Mapping[str, Node] = field(repr=False)
    allowed: tuple[str, ...] = ()
    ready: tuple[Any, Tags] | None = field(default=None, repr=False)
    stages: tuple[Stage, ...] = ()

    @property
    def out(self) -> Path | None:
        """Return the run folder of [run], if it names one."""
        run = self.nodes["run"]
        out = run.arguments.get("out") if isinstance(run, Call) else None
        return None if isinstance(out, Call) else out

    def excitations(self, **context: Any) -> tuple[Excitation, ...]:
        """Return what shakes the body; record files are read here."""
        return self._build_tables("excitation", **context)

    @in_words_of_case_files()
    def check(self) -> None:
        """Make everything that needs no mesh.

        A wrong value or record file is then told at once, by InputError.
        """
        for stage in self.stages[:-1]:
            stage.case.check()
        need_mesh = ("title", "mesh", "system", "reservoir", "contact", "gravity")
        for table, node in self.nodes.items():
            if table not in need_mesh and not needs_body(node):
                self._build_table(table)
        self.list_friction()
        run = self.nodes["run"]
        if not needs_body(run):
            self._check_steps(self._build_table("run"))
        elif "steps" in run.arguments:  # the time step is known with the body only
            self._check_steps({"dt": 1.0, "steps": run.arguments["steps"]})
        if self.body is not None:
            self._build_body_problem(self.body)

    def _check_steps(self, arguments: Mapping[str, Any]) -> None:
        """Raise InputError for arguments of [run] that make no steps."""
        # Without steps and t_end it lasts as long as the excitation: any number of steps will do.
        has_end = "steps" in arguments or "t_end" in arguments
        steps = arguments.get("steps") if has_end else 1
        try:
            plan_steps(arguments["dt"], steps, arguments.get("t_end"))
        except InputError as error:
            raise InputError(f"{self.path}: [run] {error}") from None

    @in_words_of_case_files()
    def problem(self, comm: Any, parts: Parts | None = None) -> ContactProblem:
        """Return the contact problem; ``parts``: those of ``parts``, when they are known.

        Collective.
        """
        return self._build_problem(parts or self.parts(comm))

    def plan(self, parts: Parts) -> StepPlan:
        """Return the base steps of the run."""
        arguments = self._build_run(parts)
        return plan_steps(arguments["dt"], arguments.get("steps"), arguments.get("t_end"))

    def _build_run(self, parts: Parts) -> dict[str, Any]:
        """Return what [run] gives.

        Without ``steps`` and ``t_end`` it lasts as long as the excitation.
        """
        arguments: dict[str, Any] = self._build_table("run", system=parts.system)
        if "steps" in arguments or "t_end" in arguments:
            return arguments
        return arguments | {"t_end": self._find_duration(parts)}

    @in_words_of_case_files()
    def columns(self, comm: Any, parts: Parts | None = None) -> frozenset[str]:
        """Return the columns that a run writes into history.csv; computes no step.

        ``parts`` as above. Collective.
        """
        parts = parts or self.parts(comm)
        problem = self._build_problem(parts)
        recorders = self._build_recorders(parts)
        if recorders is None:
            of_joint = () if problem.joint is None else (JointEnergy(),)
            recorders = (Energy(), Contact(), *of_joint)
        problem, _ = with_defaults(problem, self._build_scheme())
        state = initial_state(problem)
        return frozenset(
            name
            for recorder in (Steps(), *recorders)
            for name, value in recorder.start(problem, state).items()
            if np.ndim(value) == 0
        )

    def check_sheet(self, comm: Any, parts: Parts) -> None:
        """Raise InputError for numbers of [sheet] that a run does not have. Collective."""
        if self.sheet.numbers is None:
            return
        try:
            refuse_unknown_numbers(self.sheet, self.columns(comm, parts))
        except InputError as error:
            raise self.nodes["sheet"].spot.make_table_error(f"{error}") from error

    def _build_recorders(self, parts: Parts) -> tuple[Recorder, ...] | None:
        """Return the recorders of [[record]]; None for those of ``simulate``."""
        return self._build_tables("record", tags=parts.tags) if "record" in self.nodes else None

    @in_words_of_case_files()
    def run(
        self,
        comm: Any,
        *,
        out: str | Path | None = None,
        restart: bool | str | Path = False,
        progress: bool = True,
        changed: bool = False,
        wall_time: str | None = None,
        reached: Reached | None = None,
    ) -> Solution:
        """Compute the whole run; collective.

        Without ``steps`` and ``t_end`` it lasts as long as the excitation. A problem with weight
        starts from its static equilibrium. The folder gets a copy of the case, ``case.toml``.
        Stages run one after the other.

        Args:
            comm: the ranks.
            out: the run folder, by default the one of [run], if any.
            restart: as of ``simulate``.
            progress: whether to print a progress line.
            changed: as of ``simulate``.
            wall_time: as of ``simulate``.
            reached: what the first stages have left, if they have run already.

        Returns:
            The solution, of the last stage.

        Raises:
            InputError: and others, as ``simulate``.
        """
        self.check()
        folder = self.out if out is None else Path(out)
        # before any work; ``simulate`` looks once more, with the folder's lock
        if folder is not None:
            on_root(MpiComm(comm), partial(self.refuse_files_of_others, folder))
        case = self
        parts = None
        if self.sheet.numbers is not None:
            if self.body is None:  # one mesh for all that follows
                meshed = self.meshed(comm) if reached is None else reached.meshed
                case = replace(self, ready=meshed)
            parts = case.parts(comm)
            self.check_sheet(comm, parts)
        if "strain_compatible" in self.nodes:
            return iterate(
                case, comm, folder, restart=restart, progress=progress, wall_time=wall_time
            )
        if self.stages:
            return run_stages(
                case,
                comm,
                folder,
                restart=restart,
                reached=reached,
                progress=progress,
                changed=changed,
                wall_time=wall_time,
            )
        parts = parts or case.parts(comm)
        with self.call(parts, folder) as call:
            self.keep_model(comm, parts, folder)
            return simulate(
                **call, restart=restart, progress=progress, changed=changed, wall_time=wall_time
            )

    def refuse_files_of_others(self, folder: Path) -> None:
        """Raise InputError for files that the run would replace and that no run has made."""
        refuse_files_of_others(folder)
        refuse_case_of_others(self.path, folder)

    def keep_model(self, comm: Any, parts: Parts, folder: Path | None) -> None:
        """Write into the folder of a run, if it has one, what its model is. Collective.

        Args:
            comm: the ranks.
            parts: as of ``parts``.
            folder: of the run; None: without.
        """
        if folder is not None:
            from .description.model import FEW, describe, write_model  # late: it reads cases

            write_model(parts.system.algebra.comm, describe(self, comm, parts, most=FEW), folder)

    @contextmanager
    def call(
        self, parts: Parts, folder: Path | None, state: State | None = None
    ) -> Iterator[dict[str, Any]]:
        """Lock the run folder, keep a copy of the case there, and yield the call of ``simulate``.

        Collective.

        Args:
            parts: as of ``parts``, of this case or of one with the same body.
            folder: of the run; None: without.
            state: the first one, at rest, when it is known.

        Yields:
            The arguments of ``simulate``.

        Raises:
            InputError: for a case with [strain_compatible], and as ``simulate``.
        """
        if "strain_compatible" in self.nodes:
            raise InputError(
                f"{self.path}: [strain_compatible] is for single runs: leave it out of stages and "
                "studies"
            )
        arguments = self._build_call(parts, folder, state)
        ranks = parts.system.algebra.comm
        with lock_folder(ranks, None if folder is None else run_folder(ranks, folder)):
            if folder is not None:
                keep_copy(self.path, self.settings, folder, ranks)
            yield arguments

    def _build_call(self, parts: Parts, folder: Path | None, state: State | None) -> dict[str, Any]:
        """Return the call of ``simulate``; its weight is brought to rest. Collective.

        Args:
            parts: as of ``call``.
            folder: of the run; None: without.
            state: the first one, when it is known.
        """
        problem = self._build_problem(parts)
        arguments = self._build_run(parts)
        arguments.pop("out", None)
        solver = self._build_table("solver")
        if state is None and parts.weighted:
            from ....run.static import static_equilibrium  # late: other runs need none of it

            static_solver = solver.primary if isinstance(solver, CrossChecked) else solver
            state = static_equilibrium(problem, solver=static_solver, state=parts.begins)
        return arguments | {
            "problem": problem,
            "scheme": self._build_scheme(),
            "solver": solver,
            "state": state,
            "out": folder,
            "record": self._build_recorders(parts),
            "escalation": self._build_tables("escalation"),
            "fields": self._build_table("fields"),
            "cross_check": solver if isinstance(solver, CrossChecked) else None,
        }

    def rehearse(
        self, parts: Parts, folder: Path, *, state: State | None = None, at_rest: bool = True
    ) -> None:
        """Do what a run does before its first step, and write nothing of it. Collective.

        Args:
            parts: as of ``call``.
            folder: which the run would have.
            state: the first one, when it is known.
            at_rest: whether a problem with weight is brought to its equilibrium, as a run does;
                False begins in the displacements at the start, which costs no factor.

        Raises:
            InputError: whatever the run refuses before its first step.
        """
        if not at_rest:
            parts = replace(parts, weighted=False)
        rehearse(**self._build_call(parts, folder, state))

    def describe_method(self, problem: ContactProblem) -> dict[str, str]:
        """Return scheme, mass and solver with which a problem of the case is marched, in words."""
        problem, scheme = with_defaults(problem, self._build_scheme())
        solver = self._build_table("solver") or Automatic()
        solvers = (solver, *self._build_tables("escalation"))
        return {
            "scheme": repr(scheme),
            "mass": repr(problem.mass),
            "solver": ", then ".join(map(repr, solvers)),
        }

    def compute_lambda(self, problem: ContactProblem, dt: float) -> float:
        """Return lambda of the joint of a problem of the case (``run.joint_uniqueness``).

        Args:
            problem: with a joint.
            dt: length of its steps [s].
        """
        return joint_uniqueness(problem, dt, scheme=self._build_scheme())

    def _build_table(self, table: str, **context: Any) -> Any:
        """Return what a table makes; None where there is none."""
        return build(self.nodes[table], context) if table in self.nodes else None

    def _build_tables(self, table: str, **context: Any) -> tuple[Any, ...]:
        """Return what a table, or an array of tables, makes, as a tuple."""
        value = self._build_table(table, **context)
        if value is None:
            return ()
        return value if isinstance(value, tuple) else (value,)

    @cached_property
    def body(self) -> Body | None:
        """Return the body of a case without a mesh; None of one with."""
        table = find_body_table(self.nodes)
        body: Body | None = self._build_table(table) if table else None
        return body

    @cached_property
    def sheet(self) -> Sheet:
        """Return what [sheet] says of the report."""
        return self._build_table("sheet") or Sheet()

    @cached_property
    def layer(self) -> "ContactLayer | None":
        """Return the law of the layer before the obstacle, if there is one."""
        layer: ContactLayer | None = self._build_table("layer")
        return layer

    def _build_scheme(self) -> Scheme | None:
        """Return the scheme: that of the layer, or of [scheme]; None for that of ``simulate``."""
        if self.layer is not None:
            from ....layer import BoundaryLayer  # late: other runs need none of it

            return BoundaryLayer(law=self.layer)
        scheme: Scheme | None = self._build_table("scheme")
        return scheme

    def _build_friction(self) -> FrictionLaw:
        """Return the law of [friction], unless the body cannot slide."""
        slides = self.body is None or self.body.slides
        friction: FrictionLaw | None = self._build_table("friction") if slides else None
        return friction or Frictionless()

    def list_friction(self) -> list[FrictionLaw]:
        """Return the law of friction of each [[contact]].

        Raises:
            InputError: the mu of a table does not go with [friction].
        """
        return list_laws(self._build_friction(), list_calls(self.nodes.get("contact", ())))

    def _build_body_problem(self, body: Body) -> ContactProblem:
        """Return the problem of a body without a mesh, before its excitations."""
        try:
            return body.make(self._build_friction())
        except InputError as error:
            raise self.nodes[find_body_table(self.nodes)].spot.make_table_error(
                f"{error}"
            ) from error

    @in_words_of_case_files()
    def parts(self, comm: Any) -> Parts:
        """Return what the problem is made of; collective."""
        if self.body is not None:
            refuse_ranks(self.path, find_body_table(self.nodes), comm.size)
            problem = self._build_body_problem(self.body)
            parts = Parts(problem.system, problem.surface, Tags(), mass=problem.mass)
        else:
            parts = self._build_meshed_parts(comm)
        if self.layer is None:
            return parts
        surface = self.layer.set_back(parts.surface)
        return replace(parts, surface=surface, mass=ConsistentMass())

    def _build_meshed_parts(self, comm: Any) -> Parts:
        """Return the parts of a body with a mesh; collective."""
        mesh, tags = self.meshed(comm)
        context: dict[str, Any] = {"mesh": mesh, "tags": tags}

        # Sides of the ground need the excitations; these may themselves need the system.
        excitation_is_known = "excitation" not in self.nodes or not needs_body(
            self.nodes["excitation"]
        )
        if excitation_is_known:
            context["excitations"] = self.excitations()

        # The body, its weight, and the contact conditions.
        call = self.nodes["system"]
        if "strain_compatible" in self.nodes:
            call = with_known_damping(call)
        context["reservoir"] = self._build_table("reservoir", **context)
        system = build(call, context)
        if "gravity" in self.nodes:
            system = self._build_table("gravity", system=system, tags=tags)
        no_surface = empty_surface(system.algebra.comm, system.space.dimension)
        contacts = self._build_tables("contact", system=system, tags=tags)
        # Contact of bodies that are absent has no conditions.
        surfaces = tuple(one for one in contacts if one.total) or (no_surface,)
        surface = joined_surfaces(*surfaces) if len(surfaces) > 1 else surfaces[0]

        # Motions that rise through the base are no inertia load as well.
        calls = [node for node in walk_nodes(self.nodes["system"]) if isinstance(node, Call)]
        rising = any(
            node.callee.name == "upgoing" and "motion" not in node.arguments for node in calls
        )
        tables = tuple(len(getattr(one, "parts", ())) for one in contacts)
        return Parts(system, surface, tags, "gravity" in self.nodes, moved=rising, tables=tables)

    def meshed(self, comm: Any) -> tuple[Any, Tags]:
        """Return the mesh and its groups, all those that the tables name among them.

        Raises:
            InputError: for a group that the mesh does not have, and an expression of a coordinate
                beyond its dimension, in any stage.
        """
        if self.ready is not None:
            return self.ready
        script = self._build_table("mesh")
        if isinstance(script, MeshFile):
            mesh, tags = read_mesh(script.path, comm)
        else:
            mesh, tags = build_mesh(script, comm)
        for case in [stage.case for stage in self.stages] or [self]:
            for table, node in case.nodes.items():
                for inner in walk_nodes(node):
                    check_axes(inner, mesh.geometry.dim, f"{self.path}: [{table}]")
                    if isinstance(inner, Group):
                        inner.build({"tags": tags})
        return mesh, tags

    def _build_problem(self, parts: Parts) -> ContactProblem:
        """Return the contact problem of these parts, with its laws and excitations."""
        contacts = list_calls(self.nodes.get("contact", ()))
        friction = self._build_friction()
        joint = join_joints(friction, contacts, parts.surface, parts.tables)
        if joint is None:
            friction = join_laws(friction, contacts, parts.surface, parts.tables)
        return ContactProblem(
            parts.system,
            parts.surface,
            friction=friction if joint is None else Frictionless(),
            joint=joint,
            impact=self._build_table("impact"),
            mass=self._build_table("mass") or parts.mass,
            excitation=() if parts.moved else self.excitations(system=parts.system),
        )

    def _find_duration(self, parts: Parts) -> float:
        """Return the time until the last excitation ends [s]."""
        durations = [one.duration for one in self.excitations(system=parts.system)]
        longest = max(durations, default=math.inf)
        if not math.isfinite(longest):
            raise InputError(
                f"{self.path}: [run] has neither steps nor t_end, and the excitation has no end: "
                "give one"
            )
        return longest


def read_case(path: str | Path, settings: Sequence[str] = (), *, allow: Sequence[str] = ()) -> Case:
    """Read and check a case file.

    Groups are looked up by ``run``.

    Args:
        path: of the file.
        settings: texts KEY=VALUE that replace values of it.
        allow: packages that you trust: the case may name their classes as "package.module:Name",
            which runs code of these packages.

    Raises:
        InputError: one sentence with file, table, key and remedy, for no TOML (with the line), a
            table, type or key that nobody knows (with the nearest known), a missing key, a value of
            the wrong kind, and a choice that nothing reads.
    """
    check_type("read_case", "path", path, str | Path)
    path = Path(path)
    tables, settings = renew_keys(path, read_toml(path), settings)
    case = _read_tables(path, with_settings(tables, settings), settings, allow)
    unread = _collect_unread(case)
    if unread:
        before = _collect_unread_without_settings(path, tables, allow) if settings else []
        refuse_unread(unread, before, settings)
    return case


def _read_tables(
    path: Path, tables: Mapping[str, Any], settings: Sequence[str], allow: Sequence[str]
) -> Case:
    """Return the case of tables that have their settings."""
    # Tables that nobody knows, that are missing, or that do not go together.
    allowed = check_packages(allow)
    words = make_words(find_base_folder(path), allowed)
    check_format(path, tables)
    known_tables = ("format", *TABLES, "stage")
    for name in tables:
        if name not in known_tables:
            raise InputError(
                f"{path}: the table [{name}] is unknown: {suggest_nearest(name, known_tables)}"
            )
    body = find_body_table(tables)
    if "mesh" not in tables and not body:
        raise InputError(
            f"{path}: the table [mesh] is missing: give the mesh of the body, or [beam] or "
            "[particle] in its place"
        )
    refuse_mixed(path, tables)
    if body:
        _refuse_groups(_read_nodes(tables, str(path), words), body)

    # The nodes of each stage, or those of the whole case.
    whole = Case(path, tables, tuple(settings), {}, allowed)
    stages = tuple(
        replace(stage, case=replace(whole, nodes=_read_nodes(stage.tables, stage.label, words)))
        for stage in split_stages(path, tables)
    )
    nodes = stages[-1].case.nodes if stages else _read_nodes(tables, str(path), words)
    return replace(whole, nodes=nodes, stages=stages)


def _refuse_groups(nodes: Mapping[str, Node], body: str) -> None:
    """Raise InputError for a group of a mesh, in the case of a body that has none."""
    for node in nodes.values():
        for inner in walk_nodes(node):
            if isinstance(inner, Group):
                raise inner.spot.make_error(
                    f"is '{inner.name}', and [{body}] has no mesh with groups: leave it out"
                )


def _collect_unread(case: Case) -> list[tuple[str, str]]:
    """Return the choices of a case that nothing reads: key and sentence of each."""
    if case.stages:
        parts = [
            Part(stage.label, stage.tables, stage.case.nodes, stage.static) for stage in case.stages
        ]
    else:
        parts = [Part(str(case.path), case.tables, case.nodes)]
    return list(find_unread(case.path, case.tables, parts))


def _collect_unread_without_settings(
    path: Path, tables: Mapping[str, Any], allow: Sequence[str]
) -> list[tuple[str, str]]:
    """Return the choices of the file alone that nothing reads.

    The list is empty where the file is no case without the settings that complete it.
    """
    try:
        return _collect_unread(_read_tables(path, tables, (), allow))
    except InputError:
        return []


def _read_nodes(tables: Mapping[str, Any], source: str, words: Words) -> dict[str, Node]:
    """Return the nodes of the tables of a case or stage, in the order in which they are read.

    [run], and [system] of a body with a mesh, are there even if the file leaves them out.
    """
    defaults: dict[str, Any] = {"run": {}}
    if not find_body_table(tables):
        defaults["system"] = {}
    whole = defaults | dict(tables)
    return {
        name: _read_node(name, whole, Spot(source, "", name), words)
        for name in TABLES
        if name in whole
    }


def _read_node(name: str, tables: Mapping[str, Any], spot: Spot, words: Words) -> Node:
    """Return the node of one table; what later tables name is noted in the words."""
    value = tables[name]
    hint = TABLES[name]
    if isinstance(hint, Callee):
        if not isinstance(value, dict):
            raise spot.make_error("is not a table: write its keys below it")
        if name == "system":
            _refuse_reservoir(value, spot)
            value = _add_materials(value, tables.get("material", {}))
        return read_arguments(value, hint, spot, words)
    if name == "material" and isinstance(value, dict) and not _holds_tables(value):
        raise spot.make_table_error(
            "has the keys of one material and no name: write [material.NAME], with a name of your "
            "own"
        )
    node = read(value, hint, spot, words)
    if name == "contact":
        words.named[name] = _collect_groups_of_contact(node)
    if name == "material" and isinstance(node, dict):
        words.named[LinearElastic] = node  # before the system names them
    return node


def _refuse_reservoir(system: Mapping[str, Any], spot: Spot) -> None:
    """Raise InputError for a reservoir in [system], which has a table of its own."""
    if "reservoir" in system:
        raise spot.make_table_error(
            "has the key 'reservoir', which is a table of its own: write [reservoir] with its keys"
        )


def _holds_tables(table: Mapping[str, Any]) -> bool:
    """Tell whether all values of a table are tables."""
    return all(isinstance(value, dict) for value in table.values())


def _add_materials(system: dict[str, Any], named: Iterable[str]) -> dict[str, Any]:
    """Return [system] with the materials of these names, where it does not name its own.

    One is for the whole body, of several each for the cell group of its name.
    """
    if "material" in system:
        return system
    names = list(named)
    if not names:
        return system
    materials: Any = names[0] if len(names) == 1 else [[name, name] for name in names]
    return {"material": materials} | system


def _collect_groups_of_contact(node: Node) -> dict[str, Node]:
    """Return name of a [[contact]] -> its group of facets, the first one of a pair."""
    groups: dict[str, Node] = {}
    for call in walk_nodes(node):
        if isinstance(call, Call) and "name" in call.arguments:
            keys = call.arguments
            # joints that are found have no group
            facets = keys.get("facets", keys.get("facets1"))
            if facets is not None:
                groups[keys["name"]] = facets
    return groups
