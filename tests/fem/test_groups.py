"""Groups of a user's own mesh, from MeshTags and from markers: contact on them, and every
refusal."""

from __future__ import annotations

import importlib
from itertools import product
from pathlib import Path
from typing import Any

import dolfinx.mesh
import numpy as np
import pytest
from dolfinx.io import XDMFFile
from fem_problems import BODIES, CONCRETE, block, field
from mesh_tools import refusal, size
from mpi4py import MPI
from own_meshes import OWN, at, own_mesh, tags_where

from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.fem import compat
from vi_contact.laws.excitation import Harmonic
from vi_contact.laws.mass import ConsistentMass
from vi_contact.practice.plots.deformed import read_frames
from vi_contact.run.recorders import Contact, Energy
from vi_contact.run.simulate import Solution, simulate
from vi_contact.run.static import static_equilibrium
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor

COMM = MPI.COMM_WORLD
cells = pytest.mark.parametrize("cell", OWN)


def beside_a_wall(mesh: Any, base: fem.Facets, face: fem.Facets) -> ContactProblem:
    """A body held at its base, x = 0, that shaking drives into a wall 10 µm from its face, x =
    2."""
    d = mesh.geometry.dim
    system = fem.assemble(
        mesh, CONCRETE, clamped=base, loads=fem.BodyForce(tuple(2e6 * np.eye(d)[0]))
    )
    wall = HalfSpace(point=tuple((2.0 + 1e-5) * np.eye(d)[0]), normal=tuple(-np.eye(d)[0]))
    surface = fem.contact_surface(system, face, obstacle=wall)
    shake = Harmonic(300.0, 300.0, direction=tuple(np.eye(d)[0] + 0.2 * np.eye(d)[-1]))
    return ContactProblem(system, surface, excitation=shake, mass=ConsistentMass())


def own_problem(comm: Any, cell: str, ghosts: str = "shared_facet") -> ContactProblem:
    mesh = own_mesh(comm, cell, ghosts)
    tags = tags_where(mesh, mesh.topology.dim - 1, base=at(0, 0.0), face=at(0, 2.0))
    return beside_a_wall(
        mesh, fem.Facets.where("base", mesh, at(0, 0.0)), fem.Facets.tagged("face", tags, 8, mesh)
    )


def shaken(problem: ContactProblem, out: Path | None = None) -> Solution:
    return simulate(
        problem,
        scheme=ZienkiewiczWoodTaylor(),
        dt=2e-4,
        steps=40,
        record=[Energy(), Contact()],
        out=out,
        fields=None if out is None else fem.XDMF(every=20),
        progress=False,
    )


@pytest.mark.parametrize("ghosts", ["none", "shared_facet"])
@cells
def test_a_mesh_of_dolfinx_on_all_ranks_is_the_one_on_one(cell, ghosts):
    """Static stage and impacts, any ghosts: points, pressures, ledger and contact set."""
    together, alone = own_problem(COMM, cell, ghosts), own_problem(MPI.COMM_SELF, cell)
    states = [static_equilibrium(one, tolerance=1e-9) for one in (together, alone)]
    pressures = [
        one.surface.everywhere(state.r_n)
        for one, state in zip((together, alone), states, strict=True)
    ]
    assert pressures[1].max() > 0.0
    assert np.abs(pressures[0] - pressures[1]).max() < 1e-9 * pressures[1].max()
    (points, u), (same, v) = (
        field(p.system, p.cartesian(s.u)) for p, s in zip((together, alone), states, strict=True)
    )
    assert np.array_equal(points, same) and np.abs(u - v).max() < 1e-9 * np.abs(v).max()
    spread, single = shaken(together).history, shaken(alone).history
    assert np.ptp(single["contact_active"]) > 0
    for name in ("contact_resultant", "energy_kinetic", "energy_strain"):
        assert np.abs(spread[name] - single[name]).max() < 1e-8 * np.abs(single[name]).max(), name


@cells
def test_tags_and_markers_name_what_gmsh_names(cell):
    """On meshes of build_mesh: the same measures, cells and facets, and the same contact
    surface."""
    kinds = {
        "interval": "bar",
        "triangle": "triangles",
        "quadrilateral": "quadrilaterals",
        "tetrahedron": "tetrahedra",
        "hexahedron": "hexahedra",
    }
    mesh, tags = block(COMM, **(BODIES[kinds[cell]] | {"angle": 0.0}))
    dim = mesh.topology.dim
    own = tags_where(mesh, dim - 1, left=at(0, 0.0), right=at(0, 2.0))
    halves = tags_where(mesh, dim, near=lambda x: x[0] < 1.3, rest=lambda x: x[0] > -1.0)
    for side, value, marker in (("left", 7, at(0, 0.0)), ("right", 8, at(0, 2.0))):
        tagged, marked = (
            fem.Facets.tagged(side, own, value, mesh),
            fem.Facets.where(side, mesh, marker),
        )
        assert np.array_equal(tagged.indices, tags[side].indices)
        assert not np.setdiff1d(marked.indices, tagged.indices).size
        assert size(marked) == pytest.approx(size(tags[side]), rel=1e-13)
    some, marked = (
        fem.Cells.tagged("some", halves, 7, mesh),
        fem.Cells.where("some", mesh, lambda x: x[0] < 1.3),
    )
    assert np.array_equal(some.indices, marked.indices)
    everything = size(some) + size(fem.Cells.tagged("others", halves, 8, mesh))
    assert everything == pytest.approx(np.prod(BODIES[kinds[cell]]["lengths"]), rel=1e-13)
    system = fem.assemble(mesh, CONCRETE, clamped=tags["left"])
    marked = fem.Facets.where("right", mesh, at(0, 2.0))
    surfaces = [fem.contact_surface(system, one) for one in (tags["right"], marked)]
    for name in ("points", "normals", "weights", "nodes"):
        first, second = (one.everywhere(getattr(one, name)) for one in surfaces)
        assert np.array_equal(first, second), name


@pytest.mark.long
@pytest.mark.two_ranks
@pytest.mark.parametrize("ghosts", ["none", "shared_facet"])
def test_parts_and_refinements_of_meshes(ghosts, shared_tmp):
    """A submesh, a refined mesh, one read from XDMF: contact and fields in numbers that start from
    0 without gaps."""
    whole = own_mesh(COMM, "triangle", ghosts, times=2)
    near = fem.Cells.where("near", whole, lambda x: x[1] < 0.8)
    part = dolfinx.mesh.create_submesh(whole, 2, near.indices)[0]
    plane = own_mesh(COMM, "triangle", ghosts)
    plane.topology.create_entities(1)
    fine = dolfinx.mesh.refine(plane)
    fine = fine[0] if isinstance(fine, tuple) else fine
    with XDMFFile(COMM, str(shared_tmp / "mesh.xdmf"), "w") as file:
        file.write_mesh(plane)
    with XDMFFile(COMM, str(shared_tmp / "mesh.xdmf"), "r") as file:
        read = file.read_mesh(ghost_mode=getattr(dolfinx.mesh.GhostMode, ghosts))
    for name, mesh, height in (("part", part, 0.75), ("fine", fine, 1.5), ("read", read, 1.5)):
        numbers = np.unique(np.concatenate(COMM.allgather(fem.node_numbers(mesh))))
        assert np.array_equal(numbers, np.arange(mesh.geometry.index_map().size_global))
        problem = beside_a_wall(
            mesh,
            fem.Facets.where("base", mesh, at(0, 0.0)),
            fem.Facets.where("face", mesh, at(0, 2.0)),
        )
        assert problem.surface.everywhere(problem.surface.weights).sum() == pytest.approx(
            height, rel=1e-13
        )
        run = shaken(problem, shared_tmp / name)
        assert run.history["contact_active"].max() > 0
        if COMM.rank == 0:
            frames = read_frames(shared_tmp / name)
            x, connected = frames.points[:, :2], frames.cells
            a, b = x[connected[:, 1]] - x[connected[:, 0]], x[connected[:, 2]] - x[connected[:, 0]]
            area = 0.5 * np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
            assert (
                area.sum() == pytest.approx(2.0 * height, rel=1e-12)
                and area.min() > 0.9 * area.max()
            )


@pytest.mark.two_ranks
def test_a_model_of_gmsh_as_dolfinx_reads_it():
    """Groups from the tags that DOLFINx's own reader returns."""
    gmsh = pytest.importorskip("gmsh")
    reader = importlib.import_module(
        "dolfinx.io.gmsh" if compat.VERSION >= (0, 10) else "dolfinx.io.gmshio"
    )
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        if COMM.rank == 0:
            gmsh.model.occ.addRectangle(0.0, 0.0, 0.0, 2.0, 1.5)
            gmsh.model.occ.synchronize()
            gmsh.model.addPhysicalGroup(2, [1], 1)
            for side, value in ((4, 7), (2, 8)):
                gmsh.model.addPhysicalGroup(1, [side], value)
            gmsh.model.mesh.generate(2)
        mesh, _, tags = reader.model_to_mesh(gmsh.model, COMM, 0, gdim=2)[:3]
    finally:
        gmsh.finalize()
    base, face = (
        fem.Facets.tagged(name, tags, value, mesh) for name, value in (("base", 7), ("face", 8))
    )
    problem = beside_a_wall(mesh, base, face)
    state = static_equilibrium(problem, tolerance=1e-9)
    assert (
        size(base)
        == pytest.approx(1.5)
        == problem.surface.everywhere(problem.surface.weights).sum()
    )
    assert problem.surface.everywhere(state.r_n).max() > 0.0


def checkered(comm: Any, ghosts: str, owned: bool) -> tuple[Any, Any, Any]:
    """A mesh of 10 by 8 squares of two triangles, and its dark and light squares as a chessboard
    has them."""
    mesh = own_mesh(comm, "triangle", ghosts, times=2)
    dofs = compat.geometry_dofmap(mesh)[: mesh.topology.index_map(2).size_local if owned else None]
    square = (
        np.floor(mesh.geometry.x[dofs].mean(axis=1)[:, :2] / (0.2, 0.1875))
        .astype(np.int32)
        .sum(axis=1)
        % 2
    )
    tags = dolfinx.mesh.meshtags(
        mesh, 2, np.arange(len(dofs), dtype=np.int32), square.astype(np.int32)
    )
    return mesh, fem.Cells.tagged("dark", tags, 0, mesh), fem.Cells.tagged("light", tags, 1, mesh)


@pytest.mark.long
@pytest.mark.parametrize("degree", [1, 2])
def test_the_later_pair_of_initial_values_counts_where_cells_meet(degree):
    """A chessboard, of which some nodes touch light cells on other ranks only; with tags of ghosts
    and without."""
    for (ghosts, owned), later in product(
        (("none", True), ("shared_facet", True), ("shared_facet", False)), (0, 1)
    ):
        mesh, *squares = checkered(COMM, ghosts, owned)
        pairs = [(squares[1 - later], (1.0, 0.0)), (squares[later], lambda x: 0.0 * x + (0.0, 3.0))]
        system = fem.assemble(mesh, CONCRETE, degree=degree, initial_velocity=pairs)
        points, v = field(system, system.v0)
        place = points / (0.2, 0.1875)
        low, high = np.floor(place - 1e-6).astype(int), np.floor(place + 1e-6).astype(int)
        # the later ones, among the up to four squares about a point
        touches = np.zeros(len(points), dtype=bool)
        for i, j in product((low[:, 0], high[:, 0]), (low[:, 1], high[:, 1])):
            touches |= (i >= 0) & (i < 10) & (j >= 0) & (j < 8) & ((i + j) % 2 == later)
        assert 0 < touches.sum() < len(touches)
        assert np.array_equal(v, np.where(touches[:, None], (0.0, 3.0), (1.0, 0.0)))


def test_bodies_are_counted_without_ghosts():
    """One block on many ranks, whose parts share nodes and no cells, is one body; two strips of it
    are two, or refused where the parts leave nodes to ranks without their cells."""
    mesh = own_mesh(COMM, "quadrilateral", "none", times=2)
    system = fem.assemble(mesh, CONCRETE)
    assert system.space.comm.max(np.max(system.space.bodies, initial=0)) == 0
    apart = fem.Cells.where("apart", mesh, lambda x: (x[1] < 0.7) | (x[1] > 0.9))
    strips = dolfinx.mesh.create_submesh(mesh, 2, apart.indices)[0]
    mine = np.arange(strips.geometry.index_map().size_local)
    if COMM.allreduce(len(np.setdiff1d(mine, compat.geometry_dofmap(strips)))):
        said = refusal(COMM, lambda: fem.assemble(strips, CONCRETE))
        assert (
            "belong to ranks that have none of their cells, as create_submesh may leave them"
            in said
        )
    else:
        space = fem.assemble(strips, CONCRETE).space
        assert space.comm.max(np.max(space.body_of_node, initial=0)) == 1


@pytest.mark.two_ranks
def test_what_is_refused():
    """One sentence on all ranks for each."""
    mesh, other = own_mesh(COMM, "triangle"), own_mesh(COMM, "triangle")
    tags, whole = (
        tags_where(mesh, 1, base=at(0, 0.0)),
        tags_where(mesh, 2, all=lambda x: x[0] > -1.0),
    )
    said = refusal(COMM, lambda: fem.Facets.tagged("base", tags, 9, mesh))
    assert said == "Facets.tagged: no facets have the value 9 of 'base'; give one of 7"
    said = refusal(COMM, lambda: fem.Facets.tagged("base", tags, 7, other))
    assert (
        said
        == "Facets.tagged: the tags of 'base' are those of another mesh; give tags of this mesh"
    )
    said = refusal(COMM, lambda: fem.Facets.tagged("base", whole, 7, mesh))
    assert said == (
        "Facets.tagged: the tags of 'base' are of dimension 2 and facets of this mesh have "
        "dimension 1; give the tags of its facets"
    )
    assert "cells of this mesh have dimension 2" in refusal(
        COMM, lambda: fem.Cells.tagged("all", tags, 7, mesh)
    )
    assert "give DOLFINx MeshTags" in refusal(
        COMM, lambda: fem.Facets.tagged("base", {"base": 7}, 7, mesh)
    )
    assert "whole number" in refusal(COMM, lambda: fem.Facets.tagged("base", tags, "7", mesh))
    assert "give the DOLFINx mesh" in refusal(
        COMM, lambda: fem.Facets.tagged("base", tags, 7, "mesh")
    )
    said = refusal(COMM, lambda: fem.Facets.where("base", mesh, at(0, 5.0)))
    assert said.startswith(
        "Facets.where: the marker of 'base' marks no facets of the boundary; mark all vertices"
    )
    assert "marks no cells" in refusal(COMM, lambda: fem.Cells.where("all", mesh, at(0, 0.0)))
    assert "ZeroDivisionError" in refusal(
        COMM, lambda: fem.Facets.where("base", mesh, lambda x: 1 / 0)
    )
    assert "boolean mask of shape" in refusal(
        COMM, lambda: fem.Facets.where("base", mesh, lambda x: x[0])
    )
    assert "give a function of x" in refusal(COMM, lambda: fem.Facets.where("base", mesh, 3.0))
    said = refusal(COMM, lambda: fem.assemble(mesh, CONCRETE, clamped=tags))
    assert "give fem.Facets.tagged(name, tags, value, mesh) with the value" in said
    said = refusal(
        COMM,
        lambda: fem.assemble(other, CONCRETE, clamped=fem.Facets.tagged("base", tags, 7, mesh)),
    )
    assert "'base' of another mesh" in said


def test_a_marker_that_fails_on_one_rank_is_told_on_all():
    mesh = own_mesh(COMM, "triangle")

    def marker(x: Any) -> Any:
        if COMM.rank == COMM.size - 1:
            raise ValueError("only here")
        return x[0] < 1.0

    with pytest.raises(InputError, match="only here"):
        fem.Cells.where("some", mesh, marker)
