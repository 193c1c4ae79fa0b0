"""Units of a report: small numbers take a smaller one where the usual one is left as it is."""

from __future__ import annotations

import numpy as np
import pytest

from vi_contact.practice.units.report_units import ReportUnits, write_quantity

pytestmark = pytest.mark.serial


@pytest.mark.parametrize(
    ("value", "unit", "quantity", "wanted"),
    [
        (30e9, "Pa", "modulus", "30 GPa"),
        (97e6, "Pa", "modulus", "97 MPa"),
        (100.0, "Pa", "modulus", "100 Pa"),
        (1e-2, "Pa", "modulus", "0.01 Pa"),  # none is smaller
        (999.0, "kg", "", "999 kg"),
        (1000.0, "kg", "", "1 t"),
        (-2.0, "N", "", "-0.002 kN"),
        (-0.5, "N", "", "-0.5 N"),
        (0.5, "N m", "moment", "0.5 N m"),
        (2e-7, "m", "", "0.2 µm"),
        (3e-4, "rad", "", "300 µrad"),
        (3e-6, "rad", "", "3 µrad"),
        (0.0, "Pa", "modulus", "0 GPa"),
        (np.nan, "N", "", "- kN"),
    ],
)
def test_small_numbers_take_smaller_units(
    value: float, unit: str, quantity: str, wanted: str
) -> None:
    assert str(write_quantity(value, unit, ReportUnits(), quantity=quantity)) == wanted


def test_a_unit_that_the_sheet_chooses_is_kept() -> None:
    """And in plane strain the size is that of a metre: 1.5 N on 3 m are 0.5 N/m."""
    chosen = ReportUnits(modulus="MPa", force="MN")
    assert str(write_quantity(100.0, "Pa", chosen, quantity="modulus")) == "0.0001 MPa"
    assert str(write_quantity(100.0, "N", chosen)) == "0.0001 MN"
    assert str(write_quantity(1.5, "N", ReportUnits(), slice_thickness=3.0)) == "0.5 N/m"
