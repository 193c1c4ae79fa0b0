"""The contract: the problem as schemes see it, effective matrix, certificate values."""

from __future__ import annotations

import numpy as np
import pytest
from bar import bar
from chain import chain_problem

from vi_contact.core.algebra import EffectiveMatrix, SerialAlgebra, SerialMatrix
from vi_contact.core.certificate import Certificate
from vi_contact.core.errors import InputError, StepFailure, ViContactError
from vi_contact.core.protocols import Frictionless
from vi_contact.laws.excitation import Harmonic

pytestmark = pytest.mark.serial


def test_equations_are_in_the_contact_direction():
    """u = T û with the foot's direction -1: û_0 = -u_0 is what the wall bounds."""
    problem = bar(4, u0=lambda x: 1.0 + x, gravity=2.0)
    np.testing.assert_array_equal(problem.equations.u0[:2], [-1.0, 3.5])
    np.testing.assert_array_equal(problem.cartesian(problem.equations.u0), problem.system.u0)
    np.testing.assert_array_equal(problem.surface.normal_values(problem.equations.u0), [-1.0])
    # weight of half an element, towards the wall
    assert problem.equations.load(0.0)[0] == pytest.approx(2.0 * 2.5 / 2)


def test_base_motion_loads_the_body_with_its_inertia():
    """f = -M r a_g(t), several excitations add up; the static stage knows nothing of them."""
    shaken = [Harmonic(3.0, 0.25, direction=(1.0,)), Harmonic(1.0, 0.125, direction=(-2.0,))]
    problem = chain_problem(3, mass=2.0, excitation=shaken, constant=5.0)
    a_g = 3.0 - 2.0 * np.sin(np.pi / 4)  # at t = 1
    np.testing.assert_allclose(problem.ground_acceleration(1.0), [a_g], rtol=1e-14)
    np.testing.assert_allclose(
        problem.equations.load(1.0), np.array([0.0, 0.0, 5.0]) - 2.0 * a_g, rtol=1e-14
    )
    np.testing.assert_array_equal(problem.static_load.load(1.0), [0.0, 0.0, 5.0])
    assert len(chain_problem(3, excitation=shaken[0]).excitations) == 1
    assert not chain_problem(3).ground_acceleration(1.0).any()


def test_excitation_of_another_dimension_is_refused():
    with pytest.raises(
        InputError, match=r"has 2 components but the body has 1: give one component per dimension"
    ):
        chain_problem(3, excitation=Harmonic(1.0, 1.0, direction=(1.0, 0.0)))


def test_without_a_friction_law_contact_is_frictionless():
    assert chain_problem(3).friction == Frictionless()


def test_effective_matrix_is_factorised_once():
    A = EffectiveMatrix(SerialMatrix(np.diag([2.0, 4.0])), SerialAlgebra())
    assert A.factor is A.factor
    np.testing.assert_array_equal(A @ A.factor.solve(np.array([1.0, 8.0])), [1.0, 8.0])


def test_certificate_is_as_bad_as_its_worst_residual():
    assert Certificate(1e-3, 2e-3, 4e-3, 3e-3).worst == 4e-3
    for place in range(4):
        values = [0.0] * 4
        values[place] = float("nan")
        assert Certificate(*values).worst == float("inf")


def test_errors_have_one_base():
    assert issubclass(InputError, ViContactError) and issubclass(InputError, ValueError)
    assert issubclass(StepFailure, ViContactError) and issubclass(StepFailure, RuntimeError)
