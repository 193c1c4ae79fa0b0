"""What is found of matrices that a user brings: asymmetry in any units, NaN, negative masses."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from chain import chain_system

from vi_contact.core.algebra import SerialComm, SerialMatrix
from vi_contact.core.matrix_checks import find_matrix_defects, measure_asymmetry

N = 40


def found(**matrices):
    given = {name: SerialMatrix(A) for name, A in ({"M": sp.identity(N)} | matrices).items()}
    return list(find_matrix_defects("mine", SerialComm(), np.arange(N), **given))


@pytest.fixture
def K():
    return chain_system(N).K.csr.tolil()


def test_one_entry_is_found_whatever_its_units(K):
    """A relative change of one entry by 1e-6, among unknowns in metres and in micrometres (or
    radians)."""
    units = sp.diags(np.where(np.arange(N) % 2, 1.0, 1e-6))
    K[7, 8] *= 1.0 + 1e-6
    for A in (K, units @ K @ units):
        assert 1e-9 < measure_asymmetry(SerialMatrix(A), SerialComm(), np.arange(N)) < 1e-5
        assert "M is not symmetric" in found(M=A)[0]


def test_round_off_is_no_asymmetry(K):
    noise = 1.0 + 1e-13 * np.random.default_rng(1).standard_normal(K.nnz)
    A = K.tocsr()
    A.data *= noise
    assert found(M=A, K=A) == []
    assert found(M=sp.csr_matrix((N, N)), K=sp.csr_matrix((N, N))) == []  # nothing is symmetric


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_what_is_not_finite(K, wrong):
    K[3, 3] = wrong
    assert found(K=K) == ["mine: K has NaN or infinite entries; give finite numbers"]


def test_negative_masses():
    masses = np.ones(N)
    masses[5] = -1e-3
    assert found(M=sp.diags(masses))[0].startswith("mine: M has a diagonal entry below zero")
