"""Loads and the semi-discrete system, on a bar and on a chain."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from bar import thrown
from chain import chain_system

from vi_contact.core.algebra import SerialMatrix
from vi_contact.core.system import Load

pytestmark = pytest.mark.serial


def rotation(n: int, angle: float) -> SerialMatrix:
    """Turns unknowns 0 and 1 into each other."""
    T = sp.eye(n).tolil()
    c, s = np.cos(angle), np.sin(angle)
    T[:2, :2] = [[c, -s], [s, c]]
    return SerialMatrix(T)


def load() -> Load:
    return Load(
        np.array([1.0, 2.0, 3.0]),
        separable=(
            (np.array([0.0, 1.0, 0.0]), lambda t: 10.0 * t),
            (np.array([1.0, 0.0, 0.0]), np.cos),
        ),
        general=(lambda t: np.array([0.0, 0.0, t**2]),),
    )


def test_load_is_the_sum_of_its_parts():
    f = load()
    np.testing.assert_allclose(f(0.5), [1.0 + np.cos(0.5), 7.0, 3.25], rtol=1e-15)
    # f(0.5) has left the constant part alone
    np.testing.assert_allclose(f(0.0), [2.0, 2.0, 3.0], rtol=1e-15)


def test_load_turns_with_the_basis():
    T = rotation(3, 0.3)
    np.testing.assert_allclose(load().in_basis(T)(0.7), T.transpose_apply(load()(0.7)), rtol=1e-14)


def test_energies_of_a_thrown_bar():
    """V1.1: kinetic energy ½ rho L v0² = 500; a rigid translation strains nothing."""
    system = thrown().equations
    assert system.kinetic_energy(system.v0) == pytest.approx(500.0, rel=1e-12)
    assert system.strain_energy(np.where(np.arange(101) == 0, -1.0, 1.0)) == pytest.approx(
        0.0, abs=1e-10
    )
    assert system.rows == 101


def test_strain_energy_of_a_linear_field():
    """½ E L eps² with eps = 0.01."""
    system = thrown().system
    assert system.strain_energy(0.01 * np.linspace(0.0, 10.0, 101)) == pytest.approx(
        0.5 * 900 * 10 * 1e-4, rel=1e-12
    )


def test_energy_and_work_do_not_depend_on_the_basis():
    system = chain_system(
        4, damping=0.1, u0=[1.0, 2.0, 3.0, 5.0], v0=[-1.0, 0.5, 0.0, 2.0], constant=3.0
    )
    T = rotation(4, 1.1)
    turned = system.in_basis(T)
    np.testing.assert_allclose(T @ turned.u0, system.u0, rtol=1e-14)
    np.testing.assert_allclose(T @ (turned.C @ turned.v0), system.C @ system.v0, atol=1e-10)
    assert turned.kinetic_energy(turned.v0) == pytest.approx(
        system.kinetic_energy(system.v0), rel=1e-14
    )
    assert turned.strain_energy(turned.u0) == pytest.approx(
        system.strain_energy(system.u0), rel=1e-13
    )
    assert turned.load(0.0) @ turned.v0 == pytest.approx(system.load(0.0) @ system.v0, rel=1e-14)
    np.testing.assert_allclose(T @ turned.influence[:, 0], system.influence[:, 0], rtol=1e-14)


def test_added_loads_leave_the_original_alone():
    system = chain_system(3, constant=1.0)
    more = system.with_load((np.ones(3), lambda t: t))
    np.testing.assert_array_equal(more.load(2.0), [2.0, 2.0, 3.0])
    np.testing.assert_array_equal(system.load(2.0), [0.0, 0.0, 1.0])


def test_what_is_kept_is_made_once_and_belongs_to_one_system():
    system, made = chain_system(3), []

    def make() -> object:
        made.append(object())
        return made[-1]

    assert system.make_once("factor", make) is system.make_once("factor", make)
    assert len(made) == 1
    assert system.with_load().make_once("factor", make) is made[1]
