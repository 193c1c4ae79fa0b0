"""Tractions and body forces: resultants, exact integration, time dependence; wrong data told on all
ranks."""

from __future__ import annotations

from math import sin
from typing import Any

import numpy as np
import pytest
from fem_problems import BODIES, CONCRETE, block, linear, max_over_ranks, nodal, resultant
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.core.system import Load
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import BodyForce, Prescribed, TangentialTraction, Traction
from vi_contact.run.march import march
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed

COMM = MPI.COMM_WORLD
bodies = pytest.mark.parametrize("name", BODIES)


@bodies
def test_traction_resultant(name):
    """A constant traction sums to value times area."""
    d = len(BODIES[name]["lengths"])
    area = np.prod(BODIES[name]["lengths"][1:])
    value = np.array([3.0, -2.0, 5.0])[:d]
    mesh, tags = block(COMM, **BODIES[name])
    system = assemble(mesh, CONCRETE, loads=Traction(tags["right"], tuple(value)))
    assert resultant(system, system.load(0.0)) == pytest.approx(area * value, rel=1e-13)


@pytest.mark.parametrize("simplices", [False, True])
def test_traction_that_varies_is_integrated_exactly(simplices):
    """Hydrostatic pressure 7 y on the left side of a square of side 2: resultant 14, moment about
    the base 7 · 8/3."""
    mesh, tags = block(COMM, lengths=(2.0, 2.0), divisions=(3, 5), simplices=simplices)
    load = Traction(tags["left"], lambda x, t: np.column_stack([7.0 * x[:, 1], 0.0 * x[:, 1]]))
    system = assemble(mesh, CONCRETE, loads=load)
    force = system.load(0.0)
    assert resultant(system, force) == pytest.approx([14.0, 0.0], abs=1e-12)
    moment = system.algebra.dot(force, nodal(system, lambda x: x[:, ::-1] * [1.0, 0.0]))
    assert moment == pytest.approx(7.0 * 8.0 / 3.0, rel=1e-12)


@pytest.mark.parametrize("kind", [Traction, BodyForce])
def test_constant_history_and_function_of_time_are_one_load(kind):
    """(value, f(t)) = callable(x, t) at all times; a tuple is the value at all times. Several loads
    add up."""
    mesh, tags = block(COMM, **BODIES["triangles"])
    where = {"facets": tags["top"]} if kind is Traction else {}
    value = np.array([4.0, -9.0])

    def load(**given: Any) -> Load:
        return assemble(mesh, CONCRETE, loads=kind(**where, **given)).load

    constant = load(value=tuple(value))
    still = constant(0.3)
    assert max_over_ranks(COMM, still - constant(7.0)) == 0.0
    separable = load(value=tuple(value), history=sin)
    general = load(value=lambda x, t: sin(t) * np.tile(value, (len(x), 1)))
    shaped = load(value=lambda x, t: np.tile(value, (len(x), 1)), history=sin)
    for t in (0.0, 0.3, 1.1):
        for one in (separable, general, shaped):
            assert max_over_ranks(COMM, one(t) - sin(t) * still) < 1e-13 * max_over_ranks(
                COMM, still
            )
    both = assemble(
        mesh, CONCRETE, loads=[kind(**where, value=tuple(value)), kind(**where, value=(1.0, 0.0))]
    )
    assert resultant(both, both.load(0.0)) == pytest.approx(
        resultant(both, still) * (value + [1.0, 0.0]) / value, rel=1e-13
    )


@bodies
def test_weight(name):
    """BodyForce((0, -rho g)) sums to the weight."""
    d = len(BODIES[name]["lengths"])
    g = 9.80665 * np.eye(d)[-1]
    mesh, _ = block(COMM, **BODIES[name])
    system = assemble(mesh, CONCRETE, loads=BodyForce(tuple(-CONCRETE.rho * g)))
    weight = CONCRETE.rho * np.prod(BODIES[name]["lengths"])
    assert resultant(system, system.load(0.0)) == pytest.approx(-weight * g, abs=1e-12 * weight)


@pytest.mark.parametrize(
    "name, side", [("triangles", "right"), ("tetrahedra", "right"), ("quadrilaterals", "top")]
)
def test_tangential_traction_keeps_its_part_along_the_facet(name, side):
    """S_T = C_T of eq. 6: of a traction on a turned side only the part along the side acts."""
    mesh, tags = block(COMM, **BODIES[name])
    d, angle = len(BODIES[name]["lengths"]), BODIES[name].get("angle", 0.0)
    n = (
        np.array([np.cos(angle), np.sin(angle), 0.0])
        if side == "right"
        else np.array([0.0, 1.0, 0.0])
    )
    area = np.prod(np.delete(BODIES[name]["lengths"], 0 if side == "right" else 1))
    value = np.array([3.0, 8.0, -2.0])
    system = assemble(mesh, CONCRETE, loads=TangentialTraction(tags[side], tuple(value[:d])))
    expected = area * (value[:d] - (value[:d] @ n[:d]) * n[:d])
    assert resultant(system, system.load(0.0)) == pytest.approx(expected, abs=1e-12)
    normal = assemble(mesh, CONCRETE, loads=TangentialTraction(tags[side], tuple(5.0 * n[:d])))
    assert max_over_ranks(COMM, normal.load(0.0)) < 1e-14


def only_there(x: Array, t: float) -> Array:
    """NaN at one corner of the body: on one rank only, when there are several."""
    return np.where(
        (x > 1.9).all(axis=1)[:, None] if x.shape[1] > 1 else x > 1.9, np.nan, 1.0
    ) * np.ones_like(x)


def fails_there(x: Array, t: float) -> Array:
    """A function of a user with a mistake that shows at one corner of the body only."""
    if (x > 1.9).all(axis=1).any():
        raise ZeroDivisionError("no such place")
    return np.zeros_like(x)


def test_nan_and_shapes_are_refused_on_all_ranks():
    """Every kind of data, constant and callable; a callable is wrong on one rank only."""
    mesh, tags = block(COMM, lengths=(2.0, 2.0), divisions=(4, 4))
    nan = float("nan")
    cases = [
        ("Traction contains NaN", {"loads": Traction(tags["top"], (0.0, nan))}),
        ("Traction contains NaN", {"loads": Traction(tags["top"], only_there, history=sin)}),
        ("TangentialTraction contains NaN", {"loads": TangentialTraction(tags["top"], (0.0, nan))}),
        (
            "BodyForce contains NaN or infinite values at t = 0 s",
            {"loads": BodyForce((0.0, float("inf")))},
        ),
        (
            "initial displacement contains NaN",
            {"initial_displacement": lambda x: only_there(x, 0.0)},
        ),
        ("initial velocity contains NaN", {"initial_velocity": (nan, 0.0)}),
        (
            r"Traction at t = 0 s ended in ZeroDivisionError: no such place \(test_loads.py, line "
            r"\d+\): correct",
            {"loads": Traction(tags["top"], fails_there, history=sin)},
        ),
        (
            "initial velocity at t = 0 s ended in Zero",
            {"initial_velocity": lambda x: fails_there(x, 0.0)},
        ),
        (
            r"BodyForce returned shape \(\d+, 3\) .* return 2 components",
            {"loads": BodyForce((0.0, 0.0, 1.0))},
        ),
        (r"initial velocity returned shape \(\d+,\)", {"initial_velocity": lambda x: x[:, 0]}),
        (
            "prescribed component 2 does not exist: give numbers from 0 to 1",
            {"prescribed": Prescribed(tags["top"], components=(2,))},
        ),
    ]
    for sentence, data in cases:
        with pytest.raises(InputError, match=sentence):
            assemble(mesh, CONCRETE, **data)


def test_nan_that_comes_with_time():
    """A load or motion that turns NaN during the run stops all ranks with its name and time."""
    mesh, tags = block(COMM, lengths=(2.0, 2.0), divisions=(4, 4))

    def late(x: Array, t: float) -> Array:
        return only_there(x, t) if t > 0.0025 else np.zeros_like(x)

    for sentence, data in (
        (
            "Traction contains NaN or infinite values at t = 0.0035 s",
            {"loads": Traction(tags["top"], late)},
        ),
        ("BodyForce contains NaN or infinite values at t = 0.0035 s", {"loads": BodyForce(late)}),
        ("prescribed motion on 'top' contains NaN", {"prescribed": Prescribed(tags["top"], late)}),
        (
            "prescribed motion on 'top' at t = .* ended in Zero",
            {"prescribed": Prescribed(tags["top"], fails_there)},
        ),
    ):
        problem = linear(assemble(mesh, CONCRETE, clamped=tags["bottom"], **data))
        with pytest.raises(InputError, match=sentence):
            for _ in march(
                problem, scheme=ZienkiewiczWoodTaylor(), solver=Condensed(), dt=1e-3, steps=9
            ):
                pass


def test_loads_on_facets_between_two_cells_are_refused(comm: Any) -> None:
    """On a line that is drawn inside a body: no integral of the boundary sees it. On the same mesh
    a load on all of the boundary is taken, on any number of ranks."""
    import dolfinx

    mesh = dolfinx.mesh.create_rectangle(comm, [[0.0, 0.0], [2.0, 1.0]], [8, 4])
    mesh.topology.create_entities(1)
    mesh.topology.create_connectivity(1, 2)
    middle = dolfinx.mesh.locate_entities(mesh, 1, lambda x: np.isclose(x[0], 1.0))
    around = fem.Facets.where("around", mesh, lambda x: np.ones(x.shape[1], dtype=bool))
    inner = fem.Facets("inner", np.sort(middle), mesh)
    base = fem.Facets.where("base", mesh, lambda x: np.isclose(x[1], 0.0))
    stone = vc.LinearElastic(E=1e9, nu=0.2, rho=2000.0)
    wet = fem.Reservoir(face=around, floor=inner, level=1.0, model="at rest")
    for given in (
        {"loads": fem.Pressure(inner, 1e4)},
        {"loads": [fem.Traction(around, (0.0, 1.0)), fem.Traction(inner, (1.0, 0.0))]},
        {"reservoir": wet},
    ):
        with pytest.raises(InputError, match="'inner' acts on facets between two cells"):
            fem.assemble(mesh, stone, clamped=base, **given)
    system = fem.assemble(mesh, stone, loads=fem.Traction(around, (0.0, 1.0)))
    pull = comm.allreduce(system.load.at_rest(0.0) @ system.influence)
    assert pull == pytest.approx([0.0, 6.0], rel=1e-12, abs=1e-12)
