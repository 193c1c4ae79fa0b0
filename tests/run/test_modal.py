"""The lowest frequency against dense eigenvalues and the exact bar."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bar import bar
from chain import chain_system
from scipy.linalg import eigh

from vi_contact.core.errors import InputError
from vi_contact.run.modal import lowest_frequency

pytestmark = pytest.mark.serial


@pytest.mark.parametrize("lumped", [False, True])
@pytest.mark.parametrize("n", [1, 2, 10, 60])
def test_frequency_of_the_discrete_bar(n, lumped):
    """f1 = sqrt(lambda1)/(2 pi) of K phi = lambda M phi, scipy's dense eigenvalue, to 1e-10."""
    system = bar(n, clamped=True, lumped=lumped).system
    exact = np.sqrt(eigh(system.K.csr.toarray(), system.M.csr.toarray(), eigvals_only=True)[0]) / (
        2.0 * np.pi
    )
    assert lowest_frequency(system) == pytest.approx(exact, rel=1e-10)


def test_frequency_of_the_continuous_bar():
    """f1 = c/(4L) = 0.75 Hz; consistent mass from above and lumped from below, with error
    (pi/2n)²/24 each."""
    for n in (20, 40):
        error = (np.pi / (2 * n)) ** 2 / 24.0
        consistent = lowest_frequency(bar(n, clamped=True).system) / 0.75 - 1.0
        lumped = lowest_frequency(bar(n, clamped=True, lumped=True).system) / 0.75 - 1.0
        assert consistent == pytest.approx(error, rel=0.01)
        assert lumped == pytest.approx(-error, rel=0.01)


def test_contact_basis_does_not_matter():
    problem = bar(30, clamped=True)
    assert lowest_frequency(problem.equations) == pytest.approx(
        lowest_frequency(problem.system), rel=1e-12
    )


def test_units_do_not_matter():
    small, large = (
        chain_system(5, mass=1e-9, stiffness=1e-6),
        chain_system(5, mass=1.0, stiffness=1e3),
    )
    assert lowest_frequency(small) == pytest.approx(lowest_frequency(large), rel=1e-13)


def test_floating_body_and_hopeless_iterations_are_refused():
    with pytest.raises(InputError, match="fix a part"):
        lowest_frequency(bar(5).system)
    with pytest.raises(InputError, match="did not settle"):
        lowest_frequency(chain_system(20), max_iterations=1)
    broken = replace(chain_system(3), influence=np.full((3, 1), np.nan))
    with pytest.raises(InputError, match="did not settle"):
        lowest_frequency(broken)
