"""Pressures of nodes of a contact boundary without a condition: the order of convergence of the
contact pressure."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

import dolfinx
import ufl
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem
from vi_contact.fem import compat
from vi_contact.meshes import BlockMesh, TwoBlocks

COMM = MPI.COMM_WORLD
E, A, B = 1e9, 1e-3, 1e-3


def lowering(x: Any, t: float) -> Any:
    """u = (0, -(A + B x) y): with nu = 0 the pressure at y = 0 is E (A + B x), and there is no
    shear."""
    return np.column_stack([0.0 * x[:, 0], -(A + B * x[:, 0]) * x[:, 1]])


def error(n: int) -> float:
    """The error of the pressure in L2, on a base that is held at both ends."""
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0, 1.0), divisions=(n, n)), COMM)
    sides = [fem.Prescribed(tags[name], lowering) for name in ("left", "right", "top")]
    load = fem.BodyForce((0.5 * E * B, 0.0))
    system = fem.assemble(
        mesh, vc.LinearElastic(E=E, nu=0.0, rho=1.0), prescribed=sides, loads=load
    )
    surface = fem.contact_surface(
        system, tags["bottom"], obstacle=vc.HalfSpace((0.0, 0.0), (0.0, 1.0))
    )
    problem = vc.ContactProblem(system, surface)
    pressure = fem.as_function(problem, vc.static_equilibrium(problem), "contact_pressure")
    x = ufl.SpatialCoordinate(mesh)
    ds = compat.measure(mesh, 1, tags["bottom"].indices)
    squares = dolfinx.fem.assemble_scalar(
        dolfinx.fem.form((pressure - E * (A + B * x[0])) ** 2 * ds)
    )
    return float(np.sqrt(COMM.allreduce(squares, op=MPI.SUM)))


def test_order_of_the_contact_pressure_beside_held_nodes():
    """At both ends the neighbour's value is off by E B h, on one facet: sqrt(2 h / 3) E B h. Zero
    there has order ½."""
    found = [error(n) for n in (4, 8, 16)]
    exact = [np.sqrt(2.0 / 3.0 / n) * E * B / n for n in (4, 8, 16)]
    assert found == pytest.approx(exact, rel=1e-6)


def test_nodes_beyond_the_edge_of_the_other_side_have_the_pressure_of_their_neighbours():
    """Uniform pressure on ground that is side 1, with the ends of the block a tenth of a facet
    beyond nodes."""
    lower = BlockMesh(lengths=(2.0, 0.5), divisions=(20, 5))
    upper = BlockMesh(lengths=(1.02, 1.0), divisions=(23, 6))
    mesh, tags = fem.build_mesh(TwoBlocks(lower=lower, upper=upper, offset=(0.49,)), COMM)
    stiff, soft = (vc.LinearElastic(E=one, nu=0.0, rho=1.0) for one in (1e16, 1e8))
    system = fem.assemble(
        mesh,
        [(tags["lower"], stiff), (tags["upper"], soft)],
        clamped=tags["lower_bottom"],
        prescribed=fem.Prescribed(tags["upper_top"], components=(0,)),
        loads=fem.Traction(tags["upper_top"], (0.0, -1e6)),
    )
    surface = fem.contact_pair(
        system, tags["lower_top"], tags["upper_bottom"], matching=fem.DualMortar()
    )
    problem = vc.ContactProblem(system, surface)
    pressure = fem.as_function(problem, vc.static_equilibrium(problem), "contact_pressure")
    x = pressure.function_space.tabulate_dof_coordinates()
    on_ground = np.abs(x[:, 1] - 0.5) < 1e-9
    inside = on_ground & (x[:, 0] > 0.35) & (x[:, 0] < 1.65) & (pressure.x.array != 0.0)
    values = np.concatenate(COMM.allgather(pressure.x.array[inside]))
    places = np.unique(np.round(np.concatenate(COMM.allgather(x[inside, 0])), 9))
    assert values == pytest.approx(np.full(len(values), 1e6), rel=1e-5)
    assert places == pytest.approx(np.linspace(0.4, 1.6, 13))
