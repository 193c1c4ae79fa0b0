"""The serial algebra against dense numpy."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from vi_contact.core.algebra import SerialAlgebra, SerialComm, SerialMatrix

pytestmark = pytest.mark.serial
rng = np.random.default_rng(1)
A = rng.normal(size=(7, 7))
B = rng.normal(size=(7, 7))
SPD = A @ A.T + np.eye(7)
x = rng.normal(size=7)


def test_matrix_products_and_diagonal():
    matrix = SerialMatrix(sp.csc_matrix(A))
    assert matrix.rows == 7
    np.testing.assert_allclose(matrix @ x, A @ x, rtol=1e-14)
    np.testing.assert_allclose(matrix.transpose_apply(x), A.T @ x, rtol=1e-14)
    np.testing.assert_array_equal(matrix.diagonal(), np.diag(A))


def test_combinations_and_congruence():
    algebra = SerialAlgebra()
    combined = algebra.combine([(2.0, SerialMatrix(A)), (-0.5, SerialMatrix(B))])
    np.testing.assert_allclose(combined @ x, 2.0 * A @ x - 0.5 * B @ x, rtol=1e-13)
    turned = algebra.congruence(SerialMatrix(B), SerialMatrix(SPD))
    np.testing.assert_allclose(turned @ x, B.T @ (SPD @ (B @ x)), rtol=1e-12)


def test_factor_solves_for_any_right_hand_side():
    factor = SerialAlgebra().factor(SerialMatrix(SPD))
    np.testing.assert_allclose(SPD @ factor.solve(x), x, atol=1e-12)


def test_unit_columns_go_to_their_slots():
    """Column slots[k] is A⁻¹ e_owned[k], whatever the order of the slots."""
    owned, slots = np.array([5, 0, 3]), np.array([2, 0, 1])
    factor = SerialAlgebra().factor(SerialMatrix(SPD))
    columns = factor.solve_units(owned, slots, 3)
    assert np.array_equal(factor.solve_units(owned, slots, 3, owned), columns[owned])
    np.testing.assert_allclose(columns[:, slots], np.linalg.inv(SPD)[:, owned], atol=1e-12)


def test_no_unit_columns_at_all():
    none = np.zeros(0, dtype=np.int64)
    assert SerialAlgebra().factor(SerialMatrix(SPD)).solve_units(none, none, 0).shape == (7, 0)


def test_one_process_reduces_to_itself():
    comm, algebra = SerialComm(), SerialAlgebra()
    assert (comm.rank, comm.size) == (0, 1)
    assert comm.gather("mine") == ["mine"] and comm.bcast("mine") == "mine"
    np.testing.assert_array_equal(comm.sum(x), x)
    np.testing.assert_array_equal(comm.max(x), x)
    assert algebra.dot(x, x) == pytest.approx(float(np.sum(x**2)), rel=1e-14)


def test_a_matrix_of_another_algebra_is_refused():
    with pytest.raises(TypeError, match="ndarray"):
        SerialAlgebra().factor(np.eye(2))
