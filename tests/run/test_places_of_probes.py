"""Where probes take their values from: a cell's interpolation, a node, or the node next to it."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np
import pytest
from fem_problems import CONCRETE, block, linear, max_over_ranks

import vi_contact as vc
from vi_contact import fem, meshes
from vi_contact.core.errors import InputError

NONE = np.zeros(0)
INNER = {1: (1.234,), 2: (1.234, 0.567), 3: (1.234, 0.567, 0.891)}


def row_of(problem: Any, field: Any, probe: vc.Probe) -> Any:
    """The row of a state whose displacements are a field at the nodes."""
    u = problem.system.space.restrict(field(problem.system.space.points))
    return probe.start(problem, vc.State(0.0, 0, u, 2.0 * u, NONE, np.zeros(0, dtype=bool)))


def polynomial(d: int, degree: int) -> Any:
    """A field that elements of this degree hold exactly: of quadrilaterals with the product xy."""

    def field(x: Any) -> Any:
        mixed = np.prod(x, axis=1) if degree < 0 else x[:, 0] ** abs(degree)
        return np.column_stack([0.1 * mixed + x @ np.arange(1.0, d + 1.0) for _ in range(d)])

    return field


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("simplices", [True, False])
@pytest.mark.parametrize("d", [1, 2, 3])
def test_values_inside_cells_are_those_of_the_elements(
    comm: Any, d: int, simplices: bool, degree: int
) -> None:
    """P1, Q1, P2 and Q2 give a polynomial that they hold at any point; nodes themselves, and sides
    that cells and ranks share, too."""
    mesh, _ = block(comm, lengths=(2.0, 1.5, 1.2)[:d], divisions=(5, 4, 3)[:d], simplices=simplices)
    problem = linear(fem.assemble(mesh, CONCRETE, degree=degree))
    bilinear = not simplices and degree == 1 and d > 1
    field = polynomial(d, -1 if bilinear else degree)
    on_side = list(INNER[d])
    on_side[0] = 0.8  # a side of cells of 0.4
    places = {"inner": INNER[d], "side": tuple(on_side), "node": (0.4, 0.375, 0.4)[:d]}
    probe = vc.Probe(places, velocity=True)
    row = row_of(problem, field, probe)
    assert set(probe.distances.values()) == {0.0}
    for label, point in places.items():
        exact = field(np.array([point]))[0]
        found = np.array([[row[f"{q}_{axis}_{label}"] for axis in "xyz"[:d]] for q in "uv"])
        assert np.allclose(found, [exact, 2.0 * exact], rtol=1e-10, atol=0.0)


def test_turned_and_curved_cells(comm: Any) -> None:
    """Quadrilaterals without parallel sides: a linear field is exact, also near slanted sides."""

    def deform(x: Any) -> Any:
        return x + 0.1 * np.column_stack([x[:, 1] * x[:, 0], x[:, 0] ** 2])

    mesh, _ = block(comm, lengths=(2.0, 1.5), divisions=(5, 4), deform=deform)
    problem = linear(fem.assemble(mesh, CONCRETE))
    places = {f"p{k}": (0.31 + 0.17 * k, 0.2 + 0.13 * k) for k in range(8)}
    row = row_of(problem, polynomial(2, 1), vc.Probe(places))
    for label, point in places.items():
        exact = polynomial(2, 1)(np.array([point]))[0]
        assert (row[f"u_x_{label}"], row[f"u_y_{label}"]) == pytest.approx(exact, rel=1e-8)


def test_nearest_takes_the_node_and_tells_the_distance(
    comm: Any, caplog: pytest.LogCaptureFixture
) -> None:
    mesh, _ = block(comm, lengths=(2.0, 2.0), divisions=(4, 4))
    problem = linear(fem.assemble(mesh, CONCRETE))
    field = polynomial(2, 1)
    probe = vc.Probe({"a": (1.03, 1.46), "b": (0.5, 0.0)}, nearest=True)
    row = row_of(problem, field, probe)
    assert row["u_x_a"] == pytest.approx(field(np.array([[1.0, 1.5]]))[0, 0], rel=1e-12)
    assert probe.distances == {"a": pytest.approx(0.05), "b": 0.0}
    meaning = "displacement along x at point a, at the node 0.05 m from it"
    assert probe.columns()["u_x_a"] == ("m", meaning)

    # Outside of the mesh, but near: the node, with a warning; far from it: refused.
    with caplog.at_level(logging.WARNING):
        row = row_of(problem, field, vc.Probe({"out": (2.03, 1.04)}))
    assert row["u_x_out"] == pytest.approx(field(np.array([[2.0, 1.0]]))[0, 0], rel=1e-12)
    told = "probe 'out' at (2.03, 1.04) takes the node that is 0.05 m from it, as it is in no cell"
    assert (told in caplog.text) == (comm.rank == 0)
    with pytest.raises(InputError, match="away from the nearest node"):
        row_of(problem, field, vc.Probe({"far": (3.0, 1.0)}))
    with pytest.raises(InputError, match="Probe: nearest"):
        vc.Probe({"a": (0.0, 0.0)}, nearest=1)  # type: ignore[arg-type]


def test_a_rotation_is_not_cut_off(comm: Any) -> None:
    """A probe at the middle of a cell of a turning body moves with the middle, not with a node."""
    mesh, _ = block(comm, lengths=(1.0, 1.0), divisions=(3, 3), simplices=True)
    problem = linear(fem.assemble(mesh, CONCRETE))

    def field(x: Any) -> Any:
        return np.column_stack([-(x[:, 1] - 0.5), x[:, 0] - 0.5])

    row = row_of(problem, field, vc.Probe({"c": (0.5, 0.5)}))
    assert max_over_ranks(comm, np.array(list(row.values()))) < 1e-12


@pytest.mark.parametrize("nearest", [False, True])
def test_where_bodies_touch_a_cell_group_tells_whose_point_it_is(comm: Any, nearest: bool) -> None:
    """Two blocks of which the upper one moves by a metre: at a node and inside a side."""
    halves = meshes.BlockMesh(lengths=(2.0, 1.0), divisions=(4, 2))
    mesh, tags = fem.build_mesh(meshes.TwoBlocks(lower=halves, upper=halves), comm)
    problem = linear(fem.assemble(mesh, CONCRETE))
    space = problem.system.space
    upper = np.isin(space.nodes, space.find_nodes_of_cells(tags["upper"].indices))
    u = space.restrict(np.column_stack([np.zeros(len(upper)), upper]))
    state = vc.State(0.0, 0, u, 0.0 * u, NONE, np.zeros(0, dtype=bool))
    for body, moved in (("lower", 0.0), ("upper", 1.0)):
        points = {"node": (0.5, 1.0), "side": (0.6, 1.0)}
        probe = vc.Probe(points, nearest=nearest, cells=tags[body])
        row = probe.start(problem, state)
        assert row["u_y_node"] == pytest.approx(moved, abs=1e-12)
        assert row["u_y_side"] == pytest.approx(moved, abs=1e-12)


def test_what_is_no_cell_group_is_refused() -> None:
    with pytest.raises(InputError, match="Probe: cells is 'soil'.*give a cell group"):
        vc.Probe({"top": (0.0, 1.0)}, cells="soil")
