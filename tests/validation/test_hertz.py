"""V2.3: Hertz contact in the plane, against the closed form.

Two elastic half-planes without friction share one pressure, and the pressure bends each in proportion to
(1 - nu²)/E: steel on aluminium is the same problem as one body of modulus E* = 1/Σ (1 - nu_i²)/E_i against a rigid
parabola x²/2R. That is what is computed here: an elastic block with a flat side, on an obstacle that curves away.

The block is 30 a wide on either side and as deep, and nothing but contact holds it vertically; the load is a uniform
pressure on its top. What the finite block changes was measured: p0 by -0.15 %, -0.03 %, 0.01 % for 16, 30, 60 a.
The approach of a half-plane is logarithmic in its size: no test of it.
"""

from __future__ import annotations

import numpy as np
import pytest
from fem_problems import orders
from graded import Pressed, even_then_growing, growing, pressed_half
from mpi4py import MPI

from vi_contact.exact.hertz import HertzLine, contact_modulus
from vi_contact.materials import LinearElastic
from vi_contact.surfaces import AnalyticGap

COMM = MPI.COMM_WORLD
SETS = {  # modulus E*, radius, force per length, and the published a and p0
    "NAFEMS": (contact_modulus((2.1e11, 0.3), (7.0e10, 0.3)), 0.05, 3.5e7, 6.2146e-3, 3.58536e9),
    "unit": (contact_modulus((1.0, 0.3)), 1.0, 0.02, 0.152227, 0.083641),
}


def computed(name: str, *, per_a: float, simplices: bool = False) -> tuple[Pressed, HertzLine, float]:
    """(result, exact, h) on cells of a / ``per_a`` under the contact."""
    modulus, radius, force, _, _ = SETS[name]
    exact = HertzLine(force=force, modulus=modulus, radius=radius)
    a = exact.half_width
    h = a / per_a
    nu = 0.3
    result = pressed_half(
        COMM, even_then_growing(h, 1.5 * a, 30.0 * a), growing(h, 30.0 * a),
        material=LinearElastic(E=modulus * (1.0 - nu**2), nu=nu, rho=1.0),
        obstacle=AnalyticGap(lambda points: points[:, 0] ** 2 / (2.0 * radius)), force=force, simplices=simplices,
    )
    return result, exact, float(result.x[1])


def profile_error(result: Pressed, exact: HertzLine) -> float:
    """‖p - p_exact‖ / ‖p_exact‖ in L2, by the nodal weights."""
    p = exact.pressure(result.x)
    return float(np.sqrt(result.weights @ (result.pressure - p) ** 2 / (result.weights @ p**2)))


@pytest.mark.parametrize("name", list(SETS))
def test_v2_3_line_contact(name):
    """(i) steel cylinder on aluminium, (ii) unit data; 11.3 cells across a: p0 and p(a/2) to 0.2 % (asked: 2 %), P to
    1e-9, a to h. The edge of the contact is no node."""
    result, exact, h = computed(name, per_a=11.3)
    assert exact.half_width == pytest.approx(SETS[name][3], rel=1e-5)
    assert exact.peak == pytest.approx(SETS[name][4], rel=1e-5)
    assert result.pressure[0] == pytest.approx(exact.peak, rel=2e-3)
    assert np.interp(0.5 * exact.half_width, result.x, result.pressure) == pytest.approx(
        float(exact.pressure(0.5 * exact.half_width)), rel=2e-3
    )
    assert 2.0 * result.r_n.sum() == pytest.approx(exact.force, rel=1e-9)
    touching = result.x[result.r_n > 0.0]
    assert abs(touching[-1] - exact.half_width) < h
    assert np.array_equal(touching, result.x[: len(touching)])  # one patch


@pytest.mark.parametrize("simplices", [False, True], ids=["quadrilaterals", "triangles"])
def test_v2_3_pressure_converges_with_h(simplices):
    """L2 error of the pressure: 3.9, 2.0, 1.0 % of its norm at 10, 20, 40 cells across a, order 1 because of the root at
    the edge (2.6, 1.1, 0.4 % on triangles)."""
    errors = [profile_error(*computed("unit", per_a=n, simplices=simplices)[:2]) for n in (10.0, 20.0, 40.0)]
    assert errors[0] < 0.05 and errors[2] < 0.012
    assert np.all(orders(errors) > 0.9) and (simplices or np.all(orders(errors) < 1.1))


def test_v2_3_does_not_depend_on_units():
    """The two data sets are one problem: p / p0 at x / a agree to 1e-9, nine orders of magnitude apart in pressure."""
    one, unit = (computed(name, per_a=11.3)[:2] for name in ("NAFEMS", "unit"))
    shares = [result.pressure / exact.peak for result, exact in (one, unit)]
    assert np.abs(shares[0] - shares[1]).max() < 1e-9
