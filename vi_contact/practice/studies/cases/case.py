"""Read and run case files.

A case file is a contact problem and its run in TOML, table by table the calls of the Python
interface.

[mesh]            fem.build_mesh, fem.read_mesh        [scheme] [solver] [[escalation]]
[material.NAME]   LinearElastic, Orthotropic           [[record]] [fields]
[system]          fem.assemble                         [run]      the other arguments of simulate
[[contact]]       fem.contact_surface, .contact_pair   [gravity]  with_weight, static_equilibrium
[friction] [impact] [mass] [[excitation]]              [[check]]  to compare with engineering.checks
[[stage]]  what replaces these tables in stages that follow one another
[beam] [particle]  bodies and their contact, in place of [mesh] and the tables that belong to it
[layer]            layer.contact_layer, in place of [friction], [impact] and [scheme]
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ....core.arguments import check
from ....core.errors import InputError
from ....core.files import on_root
from ....core.problem import ContactProblem
from ....core.protocols import Excitation, FrictionLaw, Frictionless, ImpactLaw, MassLaw
from ....core.state_checks import initial_state
from ....core.step import Recorder, Scheme, Solver, State
from ....core.surfaces import ContactSurface, empty_surface
from ....fem.body.assembly import assemble
from ....fem.body.heterogeneous import Heterogeneous
from ....fem.contact.joined import joined_surfaces
from ....fem.mesh.communicators import MpiComm
from ....fem.mesh.tagged_mesh import Tags, build_mesh, read_mesh
from ....laws.mass import ConsistentMass
from ....laws.materials import LinearElastic
from ....laws.orthotropic import Orthotropic
from ....meshes.gmsh_session import MeshScript
from ....run.cross_check import CrossChecked
from ....run.files.folder import lock_folder, refuse_files_of_others, run_folder
from ....run.files.writer import FieldWriter
from ....run.method import with_defaults
from ....run.recorders import Contact, Energy
from ....run.recorders.steps import Steps
from ....run.simulate import Solution, simulate
from ....run.time_steps import StepPlan, plan_steps
from ...engineering.checks.comparison import Check
from .bodies import BeamBody, Body, LayerLaw, ParticleBody, own_body, refuse_mixed, refuse_ranks
from .expressions import check_axes
from .library import base_folder, check_format, keep_copy, refuse_case_of_others
from .own_classes import packages
from .parsing import Words, arguments, nearest, read
from .stage_tables import Stage, split
from .stages import Reached, run_stages
from .strain_compatible import CALL, iterate, with_known_damping
from .table_calls import Call, Callee, Group, Node, Spot, build, callee, needs_body, nodes_in
from .toml_file import read_toml, with_settings
from .unread_choices import Part, findings, refuse_unread
from .vocabulary import MeshFile, Parts, weight, words

if TYPE_CHECKING:
    from ....layer import ContactLayer

# in the order in which they are read: type of what a table makes, or the one call it is
TABLES: dict[str, Any] = {
    "title": str,
    "mesh": MeshScript | MeshFile,
    "beam": BeamBody,
    "particle": ParticleBody,
    "material": Mapping[str, LinearElastic | Orthotropic | Heterogeneous],
    "system": callee(assemble),
    "strain_compatible": CALL,
    "contact": ContactSurface | Sequence[ContactSurface],
    "layer": LayerLaw,
    "gravity": callee(weight, name="with_weight"),
    "friction": FrictionLaw,
    "impact": ImpactLaw,
    "mass": MassLaw,
    "excitation": Excitation | Sequence[Excitation],
    "scheme": Scheme,
    "solver": Solver,
    "escalation": Solver | Sequence[Solver],
    "run": replace(
        callee(simulate, only=("dt", "t_end", "steps", "tolerance", "checkpoint_every", "out")),
        function=dict,
    ),
    "record": Recorder | Sequence[Recorder],
    "fields": FieldWriter,
    "check": Check | Sequence[Check],
}


@dataclass(frozen=True)
class Case:
    """Hold a case file that has been read and checked; nothing is computed yet.

    path: of the file; tables: its content, with the settings; settings: the KEY=VALUE made after
    reading; nodes: the calls that its tables are; allowed: the packages whose classes it may name;
    ready: mesh and groups, when they are; stages: of [[stage]]; nodes, and what all but ``run`` and
    ``check`` do, are those of the last one then.
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
        return self._plain("out")

    def _plain(self, key: str) -> Any:
        """Return a value of [run]; None where it is left out, or made of other things."""
        run = self.nodes["run"]
        found = run.arguments.get(key) if isinstance(run, Call) else None
        return None if isinstance(found, Call) else found

    def excitations(self, **context: Any) -> tuple[Excitation, ...]:
        """Return what shakes the body; record files are read here."""
        return self._several("excitation", **context)

    def check(self) -> None:
        """Make everything that needs no mesh.

        A wrong value or record file is then told at once, by InputError.
        """
        for stage in self.stages[:-1]:
            stage.case.check()
        for table, node in self.nodes.items():
            if table not in ("title", "mesh", "system", "contact", "gravity") and not needs_body(
                node
            ):
                self._made(table)
        if not needs_body(self.nodes["run"]):
            own = self._made("run")
            # else as long as the excitation
            steps = own.get("steps") if "steps" in own or "t_end" in own else 1
            try:
                plan_steps(own["dt"], steps, own.get("t_end"))
            except InputError as error:
                raise InputError(f"{self.path}: [run] {error}") from None
        if self.body is not None:
            self._own_problem(self.body)

    def problem(self, comm: Any, parts: Parts | None = None) -> ContactProblem:
        """Return the contact problem; ``parts``: those of ``parts``, when they are known.

        Collective.
        """
        return self._problem(parts or self.parts(comm))

    def plan(self, parts: Parts) -> StepPlan:
        """Return the base steps of the run."""
        own = self._timed(parts)
        return plan_steps(own["dt"], own.get("steps"), own.get("t_end"))

    def _timed(self, parts: Parts) -> dict[str, Any]:
        """Return what [run] gives.

        Without ``steps`` and ``t_end`` it lasts as long as the excitation.
        """
        own: dict[str, Any] = self._made("run", system=parts.system)
        return own if "steps" in own or "t_end" in own else own | {"t_end": self._duration(parts)}

    def columns(self, comm: Any, parts: Parts | None = None) -> frozenset[str]:
        """Return the columns that a run writes into history.csv; computes no step.

        ``parts`` as above. Collective.
        """
        parts = parts or self.parts(comm)
        problem = self._problem(parts)
        own = self._recorders(parts)
        recorders = [Steps(), *((Energy(), Contact()) if own is None else own)]
        problem, _ = with_defaults(problem, self._scheme())
        state = initial_state(problem)
        return frozenset(
            name
            for one in recorders
            for name, value in one.start(problem, state).items()
            if np.ndim(value) == 0
        )

    def _recorders(self, parts: Parts) -> tuple[Recorder, ...] | None:
        """Return the recorders of [[record]]; None for those of ``simulate``."""
        return self._several("record", tags=parts.tags) if "record" in self.nodes else None

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

        ``out``: the run folder, by default the one of [run], if any.

        Without ``steps`` and ``t_end`` it lasts as long as the excitation. A problem with weight
        starts from its static equilibrium. The folder gets a copy of the case, ``case.toml``.
        Stages run one after the other, but for those that are ``reached`` already. Raises as
        ``simulate``.
        """
        self.check()
        folder = self.out if out is None else Path(out)
        # before any work; ``simulate`` looks once more, with the folder's lock
        if folder is not None:
            on_root(MpiComm(comm), partial(self._refuse_files_of_others, folder))
        if "strain_compatible" in self.nodes:
            return iterate(
                self, comm, folder, restart=restart, progress=progress, wall_time=wall_time
            )
        if self.stages:
            return run_stages(
                self,
                comm,
                folder,
                restart=restart,
                reached=reached,
                progress=progress,
                changed=changed,
                wall_time=wall_time,
            )
        parts = self.parts(comm)
        with self.call(parts, folder) as call:
            self.keep_model(comm, parts, folder)
            return simulate(
                **call, restart=restart, progress=progress, changed=changed, wall_time=wall_time
            )

    def _refuse_files_of_others(self, folder: Path) -> None:
        """InputError for what the run would replace in a folder, and which no run has made."""
        refuse_files_of_others(folder)
        refuse_case_of_others(self.path, folder)

    def keep_model(self, comm: Any, parts: Parts, folder: Path | None) -> None:
        """Write into the folder of a run, if it has one, what its model is. Collective."""
        if folder is not None:
            from .description import FEW, describe, write_model  # late: it reads cases

            write_model(parts.system.algebra.comm, describe(self, comm, parts, most=FEW), folder)

    @contextmanager
    def call(
        self, parts: Parts, folder: Path | None, state: State | None = None
    ) -> Iterator[dict[str, Any]]:
        """Hold the run folder, with a copy of the case.

        With it comes what the run gives to ``simulate``. Collective.

        parts: as of ``parts``, of this case or of one with the same body; state: at rest, when it
        is known.
        """
        if "strain_compatible" in self.nodes:
            raise InputError(
                f"{self.path}: [strain_compatible] is for single runs: leave it out of stages and "
                "studies"
            )
        problem = self._problem(parts)
        own = {name: value for name, value in self._timed(parts).items() if name != "out"}
        solver = self._made("solver")
        if state is None and parts.weighted:
            from ....run.static import static_equilibrium  # late: other runs need none of it

            first = solver.primary if isinstance(solver, CrossChecked) else solver
            state = static_equilibrium(problem, solver=first)
        ranks = problem.system.algebra.comm
        with lock_folder(ranks, None if folder is None else run_folder(ranks, folder)):
            if folder is not None:
                keep_copy(self.path, self.settings, folder, ranks)
            yield own | {
                "problem": problem,
                "scheme": self._scheme(),
                "solver": solver,
                "state": state,
                "out": folder,
                "record": self._recorders(parts),
                "escalation": self._several("escalation"),
                "fields": self._made("fields"),
                "cross_check": solver if isinstance(solver, CrossChecked) else None,
            }

    def _made(self, table: str, **context: Any) -> Any:
        """Return what a table makes; None where there is none."""
        return build(self.nodes[table], context) if table in self.nodes else None

    def _several(self, table: str, **context: Any) -> tuple[Any, ...]:
        """Return what a table, or an array of tables, makes, as a tuple."""
        made = self._made(table, **context)
        return made if isinstance(made, tuple) else () if made is None else (made,)

    @cached_property
    def body(self) -> Body | None:
        """Return the body of a case without a mesh; None of one with."""
        made: Body | None = self._made(own_body(self.nodes)) if own_body(self.nodes) else None
        return made

    @cached_property
    def layer(self) -> "ContactLayer | None":
        """Return the law of the layer before the obstacle, if there is one."""
        made: ContactLayer | None = self._made("layer")
        return made

    def _scheme(self) -> Scheme | None:
        """Return the scheme: that of the layer, or of [scheme]; None for that of ``simulate``."""
        if self.layer is not None:
            from ....layer import BoundaryLayer  # late: other runs need none of it

            return BoundaryLayer(law=self.layer)
        made: Scheme | None = self._made("scheme")
        return made

    def _friction(self) -> FrictionLaw:
        """Return the law of [friction], unless the body cannot slide."""
        slides = self.body is None or self.body.slides
        made: FrictionLaw | None = self._made("friction") if slides else None
        return made or Frictionless()

    def _own_problem(self, body: Body) -> ContactProblem:
        """Return the problem of a body without a mesh, before its excitations."""
        try:
            return body.make(self._friction())
        except InputError as error:
            raise self.nodes[own_body(self.nodes)].spot.inside(f"{error}") from error

    def parts(self, comm: Any) -> Parts:
        """Return what the problem is made of; collective."""
        if self.body is not None:
            refuse_ranks(self.path, own_body(self.nodes), comm.size)
            own = self._own_problem(self.body)
            parts = Parts(own.system, own.surface, Tags(), mass=own.mass)
        else:
            parts = self._meshed_parts(comm)
        if self.layer is None:
            return parts
        surface = self.layer.set_back(parts.surface)
        return replace(parts, surface=surface, mass=ConsistentMass())

    def _meshed_parts(self, comm: Any) -> Parts:
        """Return the parts of a body with a mesh; collective."""
        mesh, tags = self.meshed(comm)
        # else they need the system
        early = "excitation" not in self.nodes or not needs_body(self.nodes["excitation"])
        shaking = {"excitations": self.excitations()} if early else {}
        body = (
            with_known_damping(self.nodes["system"])
            if "strain_compatible" in self.nodes
            else self.nodes["system"]
        )
        system = build(body, {"mesh": mesh, "tags": tags, **shaking})
        system = (
            self._made("gravity", system=system, tags=tags) if "gravity" in self.nodes else system
        )
        none = empty_surface(system.algebra.comm, system.space.dimension)
        surfaces = self._several("contact", system=system, tags=tags) or (none,)
        surface = joined_surfaces(*surfaces) if len(surfaces) > 1 else surfaces[0]
        calls = [one for one in nodes_in(self.nodes["system"]) if isinstance(one, Call)]
        rising = any(
            one.callee.name == "upgoing" and "motion" not in one.arguments for one in calls
        )
        return Parts(system, surface, tags, "gravity" in self.nodes, moved=rising)

    def meshed(self, comm: Any) -> tuple[Any, Tags]:
        """Return the mesh and its groups, all those that the tables name among them."""
        if self.ready is not None:
            return self.ready
        script = self._made("mesh")
        mesh, tags = (
            read_mesh(script.path, comm)
            if isinstance(script, MeshFile)
            else build_mesh(script, comm)
        )
        for case in [stage.case for stage in self.stages] or [self]:
            for table, one in (
                (table, one) for table, node in case.nodes.items() for one in nodes_in(node)
            ):
                check_axes(one, mesh.geometry.dim, f"{self.path}: [{table}]")
                if isinstance(one, Group):
                    one.build({"tags": tags})
        return mesh, tags

    def _problem(self, parts: Parts) -> ContactProblem:
        return ContactProblem(
            parts.system,
            parts.surface,
            friction=self._friction(),
            impact=self._made("impact"),
            mass=self._made("mass") or parts.mass,
            excitation=() if parts.moved else self.excitations(system=parts.system),
        )

    def _duration(self, parts: Parts) -> float:
        """Return the time until the last excitation ends [s]."""
        longest = max(
            (one.duration for one in self.excitations(system=parts.system)), default=math.inf
        )
        if not math.isfinite(longest):
            raise InputError(
                f"{self.path}: [run] has neither steps nor t_end, and the excitation has no end: "
                "give one"
            )
        return longest


def read_case(path: str | Path, settings: Sequence[str] = (), *, allow: Sequence[str] = ()) -> Case:
    """Read and check a case file.

    ``settings`` are texts KEY=VALUE that replace values of it. ``allow`` names packages that you
    trust: the case may name their classes as "package.module:Name", which runs code of these
    packages.

    Raises InputError, one sentence with file, table, key and remedy: no TOML (with the line), a
    table, type or key that nobody knows (with the nearest known), a missing key, a value of the
    wrong kind. Groups are looked up by ``run``.
    """
    check("read_case", "path", path, str | Path)
    path = Path(path)
    file = read_toml(path)
    case = _read(path, with_settings(file, settings), settings, allow)
    found = _unread(case)
    if found:
        refuse_unread(found, _unread_in(path, file, allow) if settings else [], settings)
    return case


def _read(
    path: Path, tables: Mapping[str, Any], settings: Sequence[str], allow: Sequence[str]
) -> Case:
    """Return the case of tables that have their settings."""
    allowed = packages(allow)
    known = words(base_folder(path), allowed)
    check_format(path, tables)
    for name in tables:
        if name not in ("format", *TABLES, "stage"):
            raise InputError(
                f"{path}: the table [{name}] is unknown: "
                f"{nearest(name, ('format', *TABLES, 'stage'))}"
            )
    if "mesh" not in tables and not own_body(tables):
        raise InputError(
            f"{path}: the table [mesh] is missing: give the mesh of the body, or [beam] or "
            "[particle] in its place"
        )
    refuse_mixed(path, tables)
    whole = Case(path, tables, tuple(settings), {}, allowed)
    own = _nodes(tables, str(path), known) if own_body(tables) else {}
    for one in (one for node in own.values() for one in nodes_in(node) if isinstance(one, Group)):
        raise one.spot.wrong(
            f"is '{one.name}', and [{own_body(tables)}] has no mesh with groups: leave it out"
        )
    stages = tuple(
        replace(one, case=replace(whole, nodes=_nodes(one.tables, one.label, known)))
        for one in split(path, tables)
    )
    return replace(
        whole,
        nodes=stages[-1].case.nodes if stages else _nodes(tables, str(path), known),
        stages=stages,
    )


def _unread(case: Case) -> list[tuple[str, str]]:
    """Return the choices of a case that nothing reads: key and sentence of each."""
    if case.stages:
        parts = [Part(one.label, one.tables, one.case.nodes, one.static) for one in case.stages]
    else:
        parts = [Part(str(case.path), case.tables, case.nodes)]
    return list(findings(case.path, case.tables, parts))


def _unread_in(
    path: Path, tables: Mapping[str, Any], allow: Sequence[str]
) -> list[tuple[str, str]]:
    """Return the same of a file alone.

    There are none where it is no case without the settings that complete it.
    """
    try:
        return _unread(_read(path, tables, (), allow))
    except InputError:
        return []


def _nodes(tables: Mapping[str, Any], source: str, known: Words) -> dict[str, Node]:
    given = {"run": {}} | ({} if own_body(tables) else {"system": {}}) | dict(tables)
    return {
        name: _node(name, given, Spot(source, "", name), known) for name in TABLES if name in given
    }


def _node(name: str, tables: Mapping[str, Any], spot: Spot, known: Words) -> Node:
    value, asked = tables[name], TABLES[name]
    if isinstance(asked, Callee):
        if not isinstance(value, dict):
            raise spot.wrong("is not a table: write its keys below it")
        materials = (
            list(tables.get("material", {})) if name == "system" and "material" not in value else []
        )
        # those that [system] does not name: one for the whole body, or each for its cell group
        if materials:
            value = {
                "material": materials[0]
                if len(materials) == 1
                else [[one, one] for one in materials]
            } | value
        return arguments(value, asked, spot, known)
    if (
        name == "material"
        and isinstance(value, dict)
        and not all(isinstance(one, dict) for one in value.values())
    ):
        raise spot.inside(
            "has the keys of one material and no name: write [material.NAME], with a name of your "
            "own"
        )
    node = read(value, asked, spot, known)
    if name == "contact":
        given = (
            one.arguments
            for one in nodes_in(node)
            if isinstance(one, Call) and "name" in one.arguments
        )
        known.named[name] = {one["name"]: one.get("facets", one.get("facets1")) for one in given}
    if name == "material" and isinstance(node, dict):
        known.named[LinearElastic] = node  # before the system names them
    return node
