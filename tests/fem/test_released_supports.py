"""Supports of the gravity stage that the dynamic stage does without: their reactions go on as forces."""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np
import pytest
from soil import SOIL, strip

import vi_contact as vc
from vi_contact import fem, soil
from vi_contact.core.errors import InputError
from vi_contact.core.surfaces import empty_surface

DT = 4e-3
WEIGHT = fem.BodyForce((0.0, -2000.0 * 9.81))


def stages(comm: Any, *, motion: Any = None, friction: Any = None, **other: Any) -> tuple[Any, Any, Any, Any]:
    """(static problem, its state, dynamic problem, points): soil beside a rigid wall, on clamps; then on dashpots."""
    mesh, tags = strip(comm, 6.0, 4.0, (6, 4))
    rollers = fem.Prescribed(tags["left"], components=(0,))
    before = fem.assemble(mesh, SOIL, clamped=tags["bottom"], prescribed=rollers, loads=WEIGHT)
    base = fem.CompliantBase(tags["bottom"], motion=motion or (lambda t: np.zeros(2)))
    sides = soil.FreeField(tags["left"], base=base)
    after = fem.assemble(mesh, SOIL, dashpots=[base, sides], **({"loads": WEIGHT} | other))
    settings = {} if friction is None else {"friction": friction}
    wall = [(6.0, y) for y in (1.0, 2.0, 3.0, 4.0)]
    static, dynamic = (
        vc.ContactProblem(s, fem.contact_surface(s, tags["right"], points=wall), **settings) for s in (before, after)
    )
    state = vc.static_equilibrium(static, solver=vc.Condensed())
    return static, state, dynamic, [(0.0, 4.0), (3.0, 4.0), (6.0, 2.0)]


@pytest.mark.parametrize("friction", [None, pytest.param(vc.Coulomb(0.3), marks=pytest.mark.slow)])
def test_nothing_moves_after_the_release(comm, friction):
    """One second without motion: still to 1e-12 of the static displacement, contact forces too."""
    static, state, dynamic, points = stages(comm, friction=friction)
    r_n = static.surface.everywhere(state.r_n)
    assert r_n.min() > 0.0
    problem, start = fem.release(static, state, dynamic)
    nodes = static.system.space.find_nodes(np.array(points))
    before = static.system.space.sample(static.cartesian(state.u), nodes, 0.0)
    ((new, _),) = deque(vc.march(problem, dt=DT, steps=250, state=start), maxlen=1)
    after = problem.system.space.sample(problem.cartesian(new.u), nodes, new.t)
    assert np.abs(after - before).max() < 1e-12 * np.abs(before).max()
    assert np.abs(static.surface.everywhere(new.r_n) - r_n).max() < 1e-10 * r_n.max()


@pytest.mark.serial
def test_without_the_reactions_it_falls(comm):
    """The same start without the forces: the dashpots let the soil sink, at 0.1 s by more than it had settled."""
    static, state, dynamic, points = stages(comm)
    _, start = fem.release(static, state, dynamic)
    space = dynamic.system.space
    nodes = space.find_nodes(np.array(points))
    before = space.sample(dynamic.cartesian(start.u), nodes, 0.0)[1, 1]
    ((new, _),) = deque(vc.march(dynamic, dt=DT, steps=25, state=start), maxlen=1)
    after = space.sample(dynamic.cartesian(new.u), nodes, new.t)[1, 1]
    assert before < 0.0 and after < 2.0 * before


@pytest.mark.serial
def test_motion_on_top_of_gravity(comm):
    """While all points stay closed, the response is the one without gravity on bilateral points."""
    up = soil.upgoing(vc.Ricker(0.05, 8.0), dt=1e-3)
    static, state, dynamic, points = stages(comm, motion=up)
    problem, start = fem.release(static, state, dynamic)
    rows = [(s.u - start.u, s.active) for s, _ in vc.march(problem, dt=DT, steps=60, state=start)]
    assert np.all([active for _, active in rows])
    _, _, light, _ = stages(comm, motion=up, loads=())
    held = vc.ContactProblem(light.system, light.surface.bilateral_everywhere())
    alone = np.array([s.u for s, _ in vc.march(held, dt=DT, steps=60)])
    moved = np.array([u for u, _ in rows])
    assert np.abs(moved - alone).max() < 1e-9 * np.abs(alone).max()


@pytest.mark.serial
def test_what_does_not_fit_is_refused(comm):
    """Other loads, other contact points, another mesh, a support elsewhere."""
    static, state, dynamic, _ = stages(comm, loads=fem.BodyForce((0.0, -1e4)))
    with pytest.raises(InputError, match="are missing where no support was released"):
        fem.release(static, state, dynamic)
    static, state, dynamic, _ = stages(comm)
    fewer = vc.ContactProblem(dynamic.system, empty_surface(dynamic.system.algebra.comm, 2))
    with pytest.raises(InputError, match="other contact points"):
        fem.release(static, state, fewer)
    _, _, elsewhere, _ = stages(comm)
    with pytest.raises(InputError, match="on one mesh"):
        fem.release(static, state, elsewhere)
