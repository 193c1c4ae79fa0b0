"""Nodes at which bodies hang together by a point or a line: refused, told from the tips of cracks,
or meant."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

import vi_contact as vc
from tests.support.merged import Merged
from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.meshes import BlockMesh, CutOpen, TwoBlocks
from vi_contact.meshes.extract import add_arrays, arrays_of
from vi_contact.practice.studies import read_case

COMM = MPI.COMM_WORLD
ROCK = vc.LinearElastic(E=1e9, nu=0.2, rho=2000.0)
shapes = pytest.mark.parametrize("simplices", [False, True], ids=["tensor", "simplices"])


def stacked(d, simplices=False):
    one = BlockMesh(lengths=(2.0, 1.0, 1.0)[:d], divisions=(4, 2, 2)[:d], simplices=simplices)
    return TwoBlocks(lower=one, upper=one)


def rim(x):
    """Two ends of the interface of two blocks: points in the plane, lines in space."""
    return np.isclose(x[1], 1.0) & (np.isclose(x[0], 0.0) | np.isclose(x[0], 2.0))


def problem_on(mesh, **data):
    mesh, tags = fem.build_mesh(mesh, COMM)
    clamped = tags[data.pop("clamped", "lower_bottom")]
    return tags, fem.assemble(mesh, ROCK, clamped=clamped, **data)


@shapes
@pytest.mark.parametrize("d", [2, 3])
def test_the_rim_of_a_contact_between_two_bodies_is_refused(d, simplices):
    """Both blocks are drawn between the same points: 2 in the plane, 6 in space, are in both
    bodies."""
    tags, system = problem_on(Merged(stacked(d, simplices), rim))
    one, two = tags["upper_bottom"], tags["lower_top"]
    count = {2: r"2 nodes, at \(0, 1\) and \(2, 1\)", 3: r"6 nodes, the first at \(0, 1, 0\)"}[d]
    with pytest.raises(
        InputError, match=f"contact_pair: 'upper_bottom' and 'lower_top' share {count}.*hinges=True"
    ):
        fem.contact_pair(system, one, two)
    with pytest.raises(InputError, match=f"'lower_top' and 'upper_bottom' share {count[:7]}"):
        fem.contact_pair(system, two, one, matching=fem.DualMortar())
    surface = fem.contact_pair(system, one, two, hinges=True)
    (census,) = surface.censuses
    assert surface.total == {2: 3, 3: 9}[d]
    assert len(census.places["shared by both sides"]) == {2: 2, 3: 6}[d]


def test_one_shared_corner_is_enough():
    tags, system = problem_on(Merged(stacked(2), lambda x: rim(x) & (x[0] < 1.0)))
    with pytest.raises(
        InputError,
        match=r"'upper_bottom' and 'lower_top' share a node, at \(0, 1\), where bodies would",
    ):
        fem.contact_pair(system, tags["upper_bottom"], tags["lower_top"])


def test_a_boundary_on_an_obstacle_may_be_glued_to_another_body_too():
    tags, system = problem_on(Merged(stacked(2), rim))
    with pytest.raises(
        InputError,
        match=r"contact_surface: 'upper_bottom' shares 2 nodes with another body, at \(0, 1\)",
    ):
        fem.contact_surface(system, tags["upper_bottom"])
    (census,) = fem.contact_surface(system, tags["upper_bottom"], hinges=True).censuses
    assert census.places["shared with another body"].tolist() == [[0.0, 1.0], [2.0, 1.0]]


def test_a_node_that_only_one_side_shares_is_refused():
    """A side of the upper block faces an obstacle; the lower block hangs on its corner."""
    tags, system = problem_on(Merged(stacked(2), rim))
    with pytest.raises(
        InputError, match=r"'upper_left' shares a node with another body, at \(0, 1\)"
    ):
        fem.contact_surface(system, tags["upper_left"])
    with pytest.raises(
        InputError, match=r"'upper_left' shares a node with another body, at \(0, 1\)"
    ):
        fem.contact_pair(system, tags["upper_left"], tags["upper_right"])


def test_a_rim_that_is_clamped_glues_nothing():
    mesh = Merged(stacked(2), rim)
    mesh, tags = fem.build_mesh(mesh, COMM)
    ends = fem.Facets.where("ends", mesh, lambda x: np.isclose(x[0], 0.0) | np.isclose(x[0], 2.0))
    system = fem.assemble(mesh, ROCK, clamped=ends)
    assert fem.contact_pair(system, tags["upper_bottom"], tags["lower_top"]).total == 3


@pytest.mark.parametrize("d", [2, 3])
def test_the_edge_of_a_weld_is_no_hinge(d):
    """The left half of the interface is one: the material goes on round the end of what may part.

    In space it does so along a line."""
    whole = Merged(stacked(d), lambda x: np.isclose(x[1], 1.0) & (x[0] < 1.01))
    mesh, tags = fem.build_mesh(whole, COMM)
    right = [
        fem.Facets(f"{name}_right", right_half(mesh, tags[name]), mesh)
        for name in ("upper_bottom", "lower_top")
    ]
    system = fem.assemble(mesh, ROCK, clamped=tags["lower_bottom"])
    surface = fem.contact_pair(system, *right)
    (census,) = surface.censuses
    assert np.all(census.places["shared by both sides"][:, 0] == 1.0)
    assert surface.total == {2: 2, 3: 6}[d]


def right_half(mesh, group):
    import dolfinx

    mesh.topology.create_connectivity(mesh.topology.dim - 1, mesh.topology.dim)
    middles = dolfinx.mesh.compute_midpoints(mesh, mesh.topology.dim - 1, group.indices)
    return group.indices[middles[:, 0] > 1.0]


class Inner:
    """A block with an inner boundary: the facets at height y whose middles satisfy ``where``."""

    def __init__(self, d: int, where: Any) -> None:
        self.block, self.where = (
            BlockMesh(lengths=(2.0, 2.0, 1.0)[:d], divisions=(8, 4, 4)[:d]),
            where,
        )

    def build(self, gmsh: Any) -> None:
        arrays = arrays_of(self.block)
        from vi_contact.meshes.rows import cell_sides

        sides = np.unique(cell_sides(arrays.cells, arrays.cell)[0], axis=0)
        at_height = np.isclose(arrays.points[sides][:, :, 1], 1.0).all(axis=1)
        chosen = at_height & self.where(arrays.points[sides].mean(axis=1))
        add_arrays(
            gmsh, replace(arrays, facet_groups=arrays.facet_groups | {"crack": sides[chosen]})
        )


@pytest.mark.parametrize("d", [2, 3])
def test_cracks_end_at_tips_and_fronts(d):
    """A crack inside a body, from x = 0.5 to 1.5 (in space to z = 0.5): all its ends are shared and
    none is a hinge."""
    mesh = CutOpen(
        Inner(d, lambda x: (np.abs(x[:, 0] - 1.0) < 0.5) & (x[:, -1] < 0.5 if d == 3 else True)),
        "crack",
        towards=(0.0, 1.0, 0.0)[:d],
    )
    mesh, tags = fem.build_mesh(mesh, COMM)
    surface = fem.contact_pair(fem.assemble(mesh, ROCK), tags["crack_1"], tags["crack_2"])
    (census,) = surface.censuses
    shared = census.places["shared by both sides"]
    assert len(shared) == {2: 2, 3: 9}[d]
    assert surface.total == {2: 3, 3: 6}[d]


def test_the_mouth_of_a_crack_that_was_left_closed_is_refused():
    """A crack through a body whose end points at the outside are still one node each, as meshers
    leave them."""
    mesh, tags = fem.build_mesh(
        Merged(stacked(2), lambda x: np.isclose(x[1], 1.0) & (x[0] > 1.99)), COMM
    )
    system = fem.assemble(mesh, ROCK, clamped=tags["lower_bottom"])
    with pytest.raises(InputError, match=r"share a node, at \(2, 1\)"):
        fem.contact_pair(system, tags["upper_bottom"], tags["lower_top"])


RIM = """
[mesh]
type = "GeoFile"
path = "rim.geo"
[material.block]
E = "25 GPa"
nu = 0.2
rho = 2400.0
[material.soil]
E = "150 MPa"
nu = 0.3
rho = 1900.0
[system]
fixed = "rock"
[gravity]
[[contact]]
name = "base"
type = "contact_pair"
facets1 = "base"
facets2 = "ground"
[[stage]]
name = "s"
type = "static"
"""
RIM_GEO = """
h = 1.0;
Point(1) = {0,0,0,h}; Point(2) = {2,0,0,h}; Point(3) = {2,1,0,h}; Point(4) = {0,1,0,h};
Line(1) = {1,2}; Line(2) = {2,3}; Line(3) = {3,4}; Line(4) = {4,1};
Curve Loop(1) = {1:4}; Plane Surface(1) = {1};
Point(12) = {-3,0,0,h}; Point(13) = {-3,-3,0,1}; Point(14) = {5,-3,0,1}; Point(15) = {5,0,0,h};
Line(11) = {1,12}; Line(12) = {12,13}; Line(13) = {13,14};
Line(14) = {14,15}; Line(15) = {15,2}; Line(16) = {2,1};
Curve Loop(2) = {11:16}; Plane Surface(2) = {2};
Transfinite Curve {1,16} = 9;
Physical Surface("block") = {1}; Physical Surface("soil") = {2};
Physical Curve("base") = {1}; Physical Curve("ground") = {16}; Physical Curve("rock") = {13};
"""


@pytest.mark.long
@pytest.mark.serial
def test_case_files_are_refused_and_may_mean_hinges(tmp_path):
    """The two corner points that a block and its ground are drawn between; hinges = true in the
    table means them."""
    (tmp_path / "rim.geo").write_text(RIM_GEO)
    case = tmp_path / "rim.toml"
    case.write_text(RIM)
    with pytest.raises(
        InputError,
        match=r"'base' and 'ground' share 2 nodes, at \(0, 0\) and \(2, 0\).*hinges = true where",
    ):
        read_case(case).problem(MPI.COMM_SELF)
    case.write_text(RIM.replace('facets2 = "ground"', 'facets2 = "ground"\nhinges = true'))
    assert read_case(case).problem(MPI.COMM_SELF).surface.total == 7
