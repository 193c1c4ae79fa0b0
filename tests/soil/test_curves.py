"""Curves of G/Gmax and damping: published tables and Darendeli's formulas, and what they refuse
(V8.8)."""

from __future__ import annotations

import numpy as np
import pytest

from vi_contact.core.errors import InputError
from vi_contact.practice.soil import SoilCurves

pytestmark = pytest.mark.serial
# (PI, OCR, p [Pa], f [Hz], N) -> G/Gmax and damping at 1e-6, 1e-5, … 1e-2, of pystrata 0.5.4
DARENDELI = {
    (0, 1, 101.3e3, 2, 5): (
        [0.995452402, 0.963474042, 0.760686456, 0.276952474, 0.044120609],
        [0.010008902, 0.013387182, 0.041385595, 0.140379290, 0.210033073],
    ),
    (30, 2, 200e3, 2, 5): (
        [0.998118413, 0.984597159, 0.885096591, 0.481390907, 0.100602637],
        [0.011604725, 0.012913078, 0.025020331, 0.094294992, 0.194378622],
    ),
    (100, 8, 400e3, 1, 10): (
        [0.999479170, 0.995694259, 0.965357435, 0.770535889, 0.288078200],
        [0.012366137, 0.012689258, 0.015855920, 0.042356542, 0.139375512],
    ),
}


@pytest.mark.parametrize("case", DARENDELI)
def test_darendeli(case):
    index, ocr, stress, f, cycles = case
    found = SoilCurves.darendeli(
        mean_stress=stress, plasticity=index, ocr=ocr, frequency=f, cycles=cycles
    )
    for ours, theirs in zip(found.at(np.logspace(-6, -2, 5)), DARENDELI[case], strict=True):
        assert np.abs(ours / theirs - 1.0).max() < 1e-7


def test_darendeli_at_the_reference_strain():
    """One atmosphere, sand: half of Gmax at 0.0352 %, but for straight lines between ten strains a
    decade."""
    assert abs(SoilCurves.darendeli(mean_stress=101325.0).at(np.array(0.0352e-2))[0] - 0.5) < 1e-3


def test_published_tables():
    reduction, damping = SoilCurves.seed_idriss().at(np.array([1e-4, 1e-3]))
    assert reduction.tolist() == [0.74, 0.29] and damping.tolist() == [0.055, 0.155]
    assert SoilCurves.seed_idriss("upper").at(np.array(1e-4))[0] == 0.84
    reduction, damping = SoilCurves.vucetic_dobry(30).at(np.array([1e-4, 1e-2]))
    assert np.allclose(reduction, [0.9, 0.17], rtol=1e-12) and np.allclose(
        damping, [0.038, 0.169], rtol=1e-12
    )
    between = SoilCurves.vucetic_dobry(40).at(np.array(1e-4))
    assert np.allclose(between, [0.925, 0.0335], rtol=1e-12)


def test_between_the_rows_and_beyond_them():
    """Straight over the logarithm; small strains are the first row; larger ones than the last are
    told."""
    own = SoilCurves([1e-5, 1e-3], [1.0, 0.5], [0.01, 0.11])
    reduction, damping = own.at(np.array([0.0, 1e-7, 1e-4, 1e-2]))
    assert np.allclose(reduction, [1.0, 1.0, 0.75, 0.5], rtol=1e-12)
    assert np.allclose(damping, [0.01, 0.01, 0.06, 0.11], rtol=1e-12)
    assert own.beyond(1e-3, "here") == "" and "is 0.2 % here, and 'own curves' ends at 0.1 %" in (
        own.beyond(2e-3, "here")
    )
    stiff = SoilCurves.linear(0.02)
    assert (
        stiff.at(np.array([0.0, 1e-2]))[0].tolist() == [1.0, 1.0]
        and stiff.beyond(1.0, "here") == ""
    )


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: SoilCurves([1e-4, 1e-3], [0.7, 0.5], [0.05, 0.1]), "begin at smaller strains"),
        (lambda: SoilCurves([1e-5, 1e-3], [1.0, 0.0], [0.05, 0.1]), "stays above zero"),
        (lambda: SoilCurves([1e-5, 1e-3], [0.96, 0.98], [0.05, 0.1]), "falls from 1"),
        (lambda: SoilCurves([1e-3, 1e-5], [1.0, 0.5], [0.05, 0.1]), "rising"),
        (lambda: SoilCurves([1e-5, 1e-3], [1.0, 0.5], [1.0, 10.0]), "not per cent"),
        (lambda: SoilCurves([1e-5, 1e-3], [1.0, 0.5], [0.01]), r"give numbers of shape \(2,\)"),
        (lambda: SoilCurves.vucetic_dobry(250), "end at 200 %"),
        (lambda: SoilCurves.vucetic_dobry(-1), "zero or a positive"),
        (lambda: SoilCurves.seed_idriss("lower"), "mean, upper"),
        (lambda: SoilCurves.darendeli(mean_stress=0.0), "mean_stress"),
        (lambda: SoilCurves.darendeli(mean_stress=1e5, ocr=0.5), "give 1 or more"),
        (lambda: SoilCurves.linear(0.7), "1/2"),
    ],
)
def test_other_tables_are_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()
