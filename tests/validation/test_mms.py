"""V8.5: a manufactured wave without contact, from a body force in space and time and moving
boundaries.

u = (sin kx x cos ky y sin wt, cos kx x sin ky y cos wt) solves rho u'' = div sigma + b with the
body force below. Orders of P1/Q1: 1 in H1, 2 in L2; of the Zienkiewicz-Wood-Taylor step: 2 at phi =
½, 1 otherwise.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from fem_problems import (
    Errors,
    block,
    field,
    field_errors,
    linear,
    max_over_ranks,
    orders,
    plane_strain,
)
from mpi4py import MPI

from vi_contact.core.algebra import Array
from vi_contact.core.step import State
from vi_contact.core.system import SemiDiscreteSystem
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import BodyForce, Prescribed
from vi_contact.run.march import march
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed

KX, KY, W = 2.0, 3.0, 4.0
MATERIAL = plane_strain(shear=1.0, nu=0.25, rho=1.5)
SIDES = ("left", "right", "bottom", "top")


def wave(x: Array, t: float, derivative: int = 0) -> Array:
    """u or its first or second time derivative."""
    sine, cosine = (
        (np.sin(W * t), np.cos(W * t)),
        (np.cos(W * t), -np.sin(W * t)),
        (-np.sin(W * t), -np.cos(W * t)),
    )[derivative]
    first = np.sin(KX * x[:, 0]) * np.cos(KY * x[:, 1]) * sine
    second = np.cos(KX * x[:, 0]) * np.sin(KY * x[:, 1]) * cosine
    return W**derivative * np.column_stack([first, second])


def body_force(x: Array, t: float) -> Array:
    """b = rho u'' - div sigma(u)."""
    lame, shear, rho = MATERIAL.lame_lambda, MATERIAL.shear_modulus, MATERIAL.rho
    s, c = np.sin(W * t), np.cos(W * t)
    mixed = (lame + shear) * KX * KY
    first = ((lame + 2 * shear) * KX**2 + shear * KY**2 - rho * W**2) * s + mixed * c
    second = ((lame + 2 * shear) * KY**2 + shear * KX**2 - rho * W**2) * c + mixed * s
    return np.column_stack(
        [
            first * np.sin(KX * x[:, 0]) * np.cos(KY * x[:, 1]),
            second * np.cos(KX * x[:, 0]) * np.sin(KY * x[:, 1]),
        ]
    )


def test_body_force_solves_the_equation():
    """div sigma by differences of the stress, which are built from differences of u: 1e-6."""
    lame, shear, h, t = MATERIAL.lame_lambda, MATERIAL.shear_modulus, 1e-4, 0.37
    x = np.random.default_rng(0).random((5, 2))
    step = h * np.eye(2)

    def stress(x: Array) -> Array:
        gradient = np.stack([(wave(x + e, t) - wave(x - e, t)) / (2 * h) for e in step], axis=-1)
        trace = np.trace(gradient, axis1=1, axis2=2)[:, None, None]
        return lame * trace * np.eye(2) + shear * (gradient + gradient.transpose(0, 2, 1))

    divergence = sum(
        (stress(x + step[j])[:, :, j] - stress(x - step[j])[:, :, j]) / (2 * h) for j in range(2)
    )
    assert body_force(x, t) == pytest.approx(
        MATERIAL.rho * wave(x, t, 2) - divergence, rel=1e-5, abs=1e-5
    )


def discrete(n: int, *, simplices: bool = False) -> SemiDiscreteSystem:
    mesh, tags = block(MPI.COMM_WORLD, divisions=(n, n), simplices=simplices)
    motions = [lambda x, t, k=k: wave(x, t, k) for k in range(3)]
    return assemble(
        mesh,
        MATERIAL,
        prescribed=[Prescribed(tags[side], *motions) for side in SIDES],
        loads=BodyForce(body_force),
        initial_displacement=lambda x: wave(x, 0.0),
        initial_velocity=lambda x: wave(x, 0.0, 1),
    )


def final(system: SemiDiscreteSystem, *, dt: float, steps: int, phi: float = 0.5) -> State:
    """The last state."""
    *_, (state, _) = march(
        linear(system),
        scheme=ZienkiewiczWoodTaylor(phi=phi),
        solver=Condensed(),
        dt=dt,
        steps=steps,
    )
    return state


def errors(n: int, *, simplices: bool, steps: int) -> tuple[Errors, Errors]:
    """Of the solution and of the nodal interpolant of u, after t = 1/2."""
    system = discrete(n, simplices=simplices)
    state = final(system, dt=0.5 / steps, steps=steps)
    points, values = field(system, state.u, state.t)
    lame, shear = MATERIAL.lame_lambda, MATERIAL.shear_modulus

    def against(values: Array) -> Errors:
        return field_errors(
            points,
            values,
            (n, n),
            lambda x: wave(x, 0.5),
            lame=lame,
            shear=shear,
            simplices=simplices,
        )

    return against(values), against(wave(points, 0.5))


@pytest.mark.parametrize("simplices", [False, True])
def test_v8_5_orders_in_space(simplices):
    """n = 4, 8, 16 with dt = h/4: H1 order 1, L2 order 2, and the gradients as good as the
    interpolant's."""
    found, best = zip(
        *[errors(n, simplices=simplices, steps=2 * n) for n in (4, 8, 16)], strict=True
    )
    assert orders([error.h1 for error in found]) == pytest.approx([1.0, 1.0], abs=0.05)
    assert orders([error.energy for error in found]) == pytest.approx([1.0, 1.0], abs=0.05)
    assert orders([error.l2 for error in found]) == pytest.approx([2.0, 2.0], abs=0.1)
    assert found[-1].h1 < 1.01 * best[-1].h1


@cache
def fine() -> tuple[SemiDiscreteSystem, State]:
    system = discrete(4)
    return system, final(system, dt=0.5 / 640, steps=640)


@pytest.mark.serial  # long marches of few unknowns, nothing in them depends on ranks
@pytest.mark.parametrize("phi, order", [(0.5, 2.0), (0.75, 1.0), (1.0, 1.0)])
def test_v8_5_orders_in_time(phi, order):
    """On one mesh, against a fine midpoint solution of the same mesh: displacement and velocity
    alike."""
    system, exact = fine()
    steps = (20, 40, 80) if phi == 0.5 else (80, 160, 320)
    found = [final(system, dt=0.5 / n, steps=n, phi=phi) for n in steps]
    for name in "uv":
        distance = [
            max_over_ranks(MPI.COMM_WORLD, getattr(one, name) - getattr(exact, name))
            for one in found
        ]
        assert orders(distance) == pytest.approx([order, order], abs=0.1), name
