"""Free-field sides of a body that yields inside: the ground along the sides is elastic."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from soil import strip

import vi_contact as vc
from vi_contact import fem, soil
from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.core.surfaces import empty_surface
from vi_contact.laws import J2

SHAKE = vc.Ricker(4.0, 4.0, direction=(1.0, 0.5))
GROUND = vc.LinearElastic(E=2e8, nu=0.3, rho=2000.0)
DT, STEPS, WIDTH, HEIGHT = 5e-3, 60, 8.0, 4.0


def is_between(first: float, last: float, x: Array) -> Array:
    """Which points (3, k) have first <= x <= last."""
    within: Array = (x[0] > first - 1e-9) & (x[0] < last + 1e-9)
    return within


def make_problem(comm: Any, strength: float | None, low: float = 3.0) -> vc.ContactProblem:
    """A layer between free-field sides, pushed on its surface; strength [Pa] of a part inside,
    from x = ``low`` on, None where all is linear."""
    mesh, tags = strip(comm, WIDTH, HEIGHT, (8, 4))
    push = fem.Traction(
        tags["top"], lambda x, t: np.outer(np.abs(x[:, 0] - 4.0) < 1.1, [0.0, -6e4 * (t < 0.1)])
    )
    material: Any = GROUND
    if strength is not None:
        soft = J2(GROUND.E, GROUND.nu, GROUND.rho, strength)
        parts = [("left", 0.0, low, GROUND), ("in", low, 5.0, soft), ("right", 5.0, WIDTH, GROUND)]
        material = []
        for name, first, last, law in parts:
            if first < last:
                cells = fem.Cells.where(name, mesh, partial(is_between, first, last))
                material.append((cells, law))
    system = fem.assemble(
        mesh,
        material,
        clamped=tags["bottom"],
        dashpots=[soil.FreeField(tags[name], base=SHAKE) for name in ("left", "right")],
        damping=vc.Rayleigh(0.4, 1e-3),
        loads=push,
    )
    return vc.ContactProblem(system, empty_surface(system.space.comm, 2), excitation=SHAKE)


def run(problem: vc.ContactProblem, steps: int = STEPS, state: Any = None) -> Any:
    """The run, with probes at a side, in the middle and between."""
    points = {"side": (0.0, HEIGHT), "between": (2.0, HEIGHT), "middle": (4.0, HEIGHT)}
    return vc.simulate(
        problem,
        scheme=vc.ZienkiewiczWoodTaylor(),
        dt=DT,
        steps=steps,
        state=state,
        record=[vc.Energy(), vc.Probe(points)],
        progress=False,
    )


def read_motion(found: Any) -> Array:
    """Displacements of the probes, one row each."""
    names = [name for name in sorted(found.history) if name.startswith("u_")]
    return np.array([found.history[name] for name in names])


def test_a_part_that_never_yields_is_not_there(comm: Any) -> None:
    """Its run is the linear one, with the same sides."""
    never = run(make_problem(comm, 1e12))
    linear = run(make_problem(comm, None))
    assert never.facts["worst_certificate"] <= 1e-9
    if comm.rank == 0:
        assert never.history["loss_plastic"][-1] == 0.0
        motion = read_motion(linear)
        assert np.abs(read_motion(never) - motion).max() <= 1e-10 * np.abs(motion).max()


def test_a_part_that_yields_between_the_sides(comm: Any) -> None:
    """Ledger and certificate are closed; one rank finds the same, and so does a restart."""
    found = run(make_problem(comm, 3e4))
    assert found.facts["worst_certificate"] <= 1e-9
    assert found.facts["energy_defect"] <= 1e-9
    half = run(make_problem(comm, 3e4), STEPS // 2)
    rest = run(make_problem(comm, 3e4), STEPS - STEPS // 2, half.state)
    alone = run(make_problem(MPI.COMM_SELF, 3e4))
    linear = run(make_problem(comm, None))
    if comm.rank == 0:
        assert found.history["loss_plastic"][-1] > 0.01 * found.history["work_input"][-1]
        motion = read_motion(found)
        size = np.abs(motion).max()
        assert np.abs(motion - read_motion(linear)).max() > 0.01 * size
        assert np.abs(read_motion(rest) - motion[:, STEPS // 2 :]).max() <= 1e-12 * size
        assert np.abs(read_motion(alone) - motion).max() <= 1e-10 * size


def test_a_side_beside_cells_that_yield_is_refused(comm: Any) -> None:
    with pytest.raises(InputError, match="side 'left' stands beside cells of J2"):
        make_problem(comm, 3e4, low=0.0)
