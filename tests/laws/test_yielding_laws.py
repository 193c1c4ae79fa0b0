"""Materials that yield, at points: the return to the yield surface, tangents, energies, and paths
whose answers are known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from vi_contact import soil
from vi_contact.core.errors import InputError
from vi_contact.laws import J2, DruckerPrager, Iwan, MohrCoulomb
from vi_contact.laws.mandel import ROOT, find_principal, to_tensors, to_vectors
from vi_contact.laws.yielding import YieldingMaterial

pytestmark = pytest.mark.serial

GAMMA = np.logspace(-5.5, -1.5, 20)
CURVE = tuple((float(g), float(1.0 / (1.0 + g / 1e-3))) for g in GAMMA)
LAWS: dict[str, Any] = {
    "J2 with hardening": J2(200e9, 0.3, 7800.0, 250e6, isotropic=2e9, kinematic=5e9),
    "J2": J2(200e9, 0.3, 7800.0, 250e6),
    "cone": DruckerPrager(1e8, 0.3, 2000.0, 1e4, 30.0, 10.0),
    "cone without dilatancy": DruckerPrager(1e8, 0.3, 2000.0, 1e4, 30.0, 0.0),
    "compression cone": DruckerPrager(1e8, 0.3, 2000.0, 1e4, 30.0, 30.0, fit="compression"),
    "cone without friction": DruckerPrager(1e8, 0.3, 2000.0, 1e4, 0.0, 0.0),
    "Mohr-Coulomb": MohrCoulomb(1e8, 0.3, 2000.0, 1e4, 30.0, 10.0),
    "Mohr-Coulomb without dilatancy": MohrCoulomb(1e8, 0.3, 2000.0, 1e4, 30.0, 0.0),
    "Mohr-Coulomb, associated": MohrCoulomb(1e8, 0.2, 2000.0, 1e4, 25.0, 25.0),
    "Tresca": MohrCoulomb(1e8, 0.3, 2000.0, 1e4, 0.0, 0.0),
    "sand": MohrCoulomb(1e8, 0.3, 2000.0, 0.0, 35.0, 5.0),
    "Iwan": Iwan(2.08e8, 0.3, 2000.0, CURVE),
}
COMPONENTS = (4, 6)


def strain_of(law: Any) -> float:
    """A strain beyond the elastic ones of the law."""
    return 3e-3 if isinstance(law, J2) else 1e-3


def walk(law: Any, n: int, points: int = 400, steps: int = 6) -> Any:
    """Yield (strain increment, state before, state after, tangent) of random steps: compressed at
    first, then pulled too, so that faces, edges and tips are met."""
    rng = np.random.default_rng(3)
    state = law.start(np.zeros((points, n)))
    size = strain_of(law)
    for k in range(steps):
        de = size * rng.standard_normal((points, n))
        if k < 4:
            de[:, :3] -= 0.3 * size
        new, D = law.stress(de, state)
        yield de, state, new, D
        state = new


@pytest.mark.parametrize("n", COMPONENTS)
@pytest.mark.parametrize("name", LAWS)
def test_the_return_satisfies_the_equations_of_the_law(name: str, n: int) -> None:
    """f <= 0, the flow rule, multipliers and hardening, to round-off, computed beside the return;
    and a state that is a little wrong is told."""
    law = LAWS[name]
    yielded = 0
    for de, old, new, _ in walk(law, n):
        sizes = (float(np.abs(new["sigma"]).max()), strain_of(law))
        assert law.f(new).max() <= 1e-13 * sizes[0]
        assert law.residual(de, old, new, sizes).max() <= 1e-12
        wrong = {**new, "sigma": new["sigma"] * (1.0 + 1e-6)}
        assert law.residual(de, old, wrong, sizes).max() >= 1e-8
        yielded += np.count_nonzero(law.dissipation(de, old, new) > 0.0)
    assert yielded > 100 or name == "sand"


@pytest.mark.parametrize("n", COMPONENTS)
@pytest.mark.parametrize("name", LAWS)
def test_energies_add_up(name: str, n: int) -> None:
    """sigma : Δeps = ΔW + D + R with D >= 0 and R >= 0, each by its own formula."""
    law = LAWS[name]
    for de, old, new, _ in walk(law, n):
        size = float(np.abs(new["sigma"]).max()) * strain_of(law)
        lost = law.dissipation(de, old, new)
        rest = law.remainder(old, new)
        assert lost.min() >= 0.0 and rest.min() >= -1e-14 * size
        work = np.sum(new["sigma"] * de, axis=1)
        grown = law.stored(new) - law.stored(old)
        assert np.abs(work - grown - lost - rest).max() <= 1e-14 * size


@pytest.mark.parametrize("n", COMPONENTS)
@pytest.mark.parametrize("name", LAWS)
def test_tangents_are_the_derivatives_of_the_stress(name: str, n: int) -> None:
    """Central differences come closer by the square of their width, up to where they meet another
    face: the median of the points is judged, and 19 of 20 at the smaller width."""
    law = LAWS[name]
    size = strain_of(law)
    rng = np.random.default_rng(5)
    for de, old, _, D in walk(law, n, points=200, steps=3):
        way = size * rng.standard_normal(de.shape)
        exact = np.einsum("qij,qj->qi", D, way)
        errors = []
        for width in (1e-3, 1e-4):
            ahead, _ = law.stress(de + width * way, old, tangent=False)
            behind, _ = law.stress(de - width * way, old, tangent=False)
            found = (ahead["sigma"] - behind["sigma"]) / (2.0 * width)
            errors.append(np.abs(found - exact).max(axis=1) / (law.E * size))
        assert np.median(errors[1]) <= max(0.02 * np.median(errors[0]), 1e-11)
        assert np.quantile(errors[1], 0.9) <= 1e-5


def test_tangents_are_symmetric_where_the_flow_is_normal() -> None:
    for name in ("J2 with hardening", "Mohr-Coulomb, associated", "Tresca", "Iwan"):
        for _, _, _, D in walk(LAWS[name], 6):
            assert np.abs(D - D.swapaxes(1, 2)).max() <= 1e-9 * np.abs(D).max()


@pytest.mark.parametrize("name", LAWS)
def test_a_turned_strain_turns_the_stress(name: str) -> None:
    law = LAWS[name]
    rng = np.random.default_rng(7)
    Q, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    state = law.start(np.zeros((50, 6)))
    turned = law.start(np.zeros((50, 6)))
    for _ in range(4):
        de = strain_of(law) * rng.standard_normal((50, 6))
        state, _ = law.stress(de, state, tangent=False)
        turned, _ = law.stress(to_vectors(Q @ to_tensors(de) @ Q.T, 6), turned, tangent=False)
        expected = to_vectors(Q @ to_tensors(state["sigma"]) @ Q.T, 6)
        size = np.abs(expected).max()
        assert np.abs(turned["sigma"] - expected).max() <= 1e-10 * size


@pytest.mark.parametrize("name", LAWS)
def test_the_plane_is_a_part_of_space(name: str) -> None:
    law = LAWS[name]
    rng = np.random.default_rng(9)
    flat = law.start(np.zeros((50, 4)))
    deep = law.start(np.zeros((50, 6)))
    for _ in range(4):
        de = strain_of(law) * rng.standard_normal((50, 4))
        de[:, 2] = 0.0
        flat, _ = law.stress(de, flat, tangent=False)
        deep, _ = law.stress(np.hstack([de, np.zeros((50, 2))]), deep, tangent=False)
        size = np.abs(flat["sigma"]).max()
        assert np.abs(deep["sigma"][:, :4] - flat["sigma"]).max() <= 1e-11 * size


def test_units_of_stress_do_not_matter() -> None:
    """In MPa instead of Pa all stresses are a millionth, and yielding is the same."""
    strong = MohrCoulomb(1e8, 0.3, 2000.0, 1e4, 30.0, 10.0)
    weak = MohrCoulomb(1e2, 0.3, 2000.0, 1e-2, 30.0, 10.0)
    for one, other in zip(walk(strong, 6), walk(weak, 6), strict=True):
        size = np.abs(one[2]["sigma"]).max()
        assert np.abs(one[2]["sigma"] - 1e6 * other[2]["sigma"]).max() <= 1e-10 * size


@pytest.mark.parametrize("isotropic", [0.0, 3e9])
@pytest.mark.parametrize("kinematic", [0.0, 5e9])
def test_a_bar_is_pulled(isotropic: float, kinematic: float) -> None:
    """Uniaxial stress: sigma = Y + E_t (eps - Y/E), E_t = E H/(E + H) with H of both hardenings;
    pressed back it yields again at Y + H_i alpha below the back stress."""
    E, Y, H = 200e9, 250e6, isotropic + kinematic
    law = J2(E, 0.3, 7800.0, Y, isotropic=isotropic, kinematic=kinematic)
    state, _ = pull(law, 5e-3, 50)
    alpha = (5e-3 - Y / E) * E / (E + H)
    assert state["sigma"][0, 0] == pytest.approx(Y + H * alpha, rel=1e-9)
    assert state["alpha"][0] == pytest.approx(alpha, rel=1e-9)
    assert law.dissipation(np.zeros((1, 6)), law.start(np.zeros((1, 6))), state)[
        0
    ] == pytest.approx(Y * alpha, rel=1e-9)
    lower = Y + H * alpha - 2.0 * (Y + isotropic * alpha)
    turn = (Y + H * alpha - lower) / E
    back, _ = pull(law, -turn, 10, state)
    assert law.f(back)[0] == pytest.approx(0.0, abs=1e-6 * Y)
    assert back["sigma"][0, 0] == pytest.approx(lower, rel=1e-6)


def pull(law: Any, strain: float, steps: int, state: Any = None) -> tuple[Any, float]:
    """The state after a strain along x with free sides, in steps, and the strain of the sides."""
    state = law.start(np.zeros((1, 6))) if state is None else state
    sides = 0.0
    for _ in range(steps):
        de = np.zeros((1, 6))
        de[0, 0] = strain / steps
        de[0, 1:3] = -law.nu * strain / steps
        for _ in range(40):
            new, D = law.stress(de, state)
            off = new["sigma"][0, 1:3]
            if np.abs(off).max() <= 1e-9 * np.abs(new["sigma"]).max():
                break
            de[0, 1:3] -= np.linalg.solve(D[0, 1:3, 1:3], off)
        state = new
        sides += de[0, 1]
    return state, sides


@pytest.mark.parametrize(("compressed", "exact"), [(True, 3.0), (False, 1.0 / 3.0)])
def test_a_cylinder_is_pressed_in_a_cell(compressed: bool, exact: float) -> None:
    """Triaxial compression and extension of sand, on the edges of the pyramid: the axial stress is
    K_p or K_a times that of the cell, and the dilatancy that of psi."""
    law = MohrCoulomb(1e8, 0.3, 2000.0, 0.0, 30.0, 10.0)
    cell = 50e3
    state = law.start(np.full((1, 6), -cell) * np.r_[1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    strain = -2e-4 if compressed else 2e-4
    change = 0.0
    for _ in range(40):
        de = np.zeros((1, 6))
        de[0, 0] = strain
        for _ in range(40):
            new, D = law.stress(de, state)
            off = new["sigma"][0, 1:3] + cell
            if np.abs(off).max() <= 1e-9 * cell:
                break
            # the sides move alike, so their block may be singular
            de[0, 1:3] -= np.linalg.lstsq(D[0, 1:3, 1:3], off, rcond=None)[0]
        change = de[0, :3].sum() / strain
        state = new
    assert -state["sigma"][0, 0] / cell == pytest.approx(exact, rel=1e-7)
    s = np.sin(np.radians(10.0))
    dilatancy = -2.0 * s / (1.0 - s) if compressed else 2.0 * s / (1.0 + s)
    assert change == pytest.approx(dilatancy, rel=1e-5)


@pytest.mark.parametrize("law", [LAWS["cone"], LAWS["Mohr-Coulomb"]], ids=["cone", "pyramid"])
def test_a_plate_is_pressed_in_plane_strain(law: Any) -> None:
    """Both laws carry K_p sigma_3 + 2 c √K_p in plane strain, 184641.016 Pa, and dilate alike:
    the cone is made for that."""
    cell, strain = 50e3, -1e-3
    state = law.start(np.array([[-cell, -cell, -cell, 0.0]]))
    for _ in range(60):
        de = np.array([[0.0, strain, 0.0, 0.0]])
        for _ in range(40):
            new, D = law.stress(de, state)
            off = new["sigma"][0, 0] + cell
            if abs(off) <= 1e-11 * cell:
                break
            de[0, 0] -= off / D[0, 0, 0]
        state = new
    assert -state["sigma"][0, 1] == pytest.approx(184641.016151, rel=1e-8)
    s = np.sin(np.radians(10.0))
    assert (de[0, 0] + strain) / -strain == pytest.approx(2.0 * s / (1.0 - s), rel=1e-5)


def shear(law: Any, ends: tuple[float, ...], steps: int, n: int = 4) -> np.ndarray:
    """Shear stresses [Pa] on a way from end to end of engineering shear strains."""
    state = law.start(np.zeros((1, n)))
    found = [0.0]
    for start, end in zip((0.0, *ends[:-1]), ends, strict=True):
        for _ in range(steps):
            de = np.zeros((1, n))
            de[0, 3] = (end - start) / steps / ROOT
            state, _ = law.stress(de, state, tangent=False)
            found.append(state["sigma"][0, 3] / ROOT)
    return np.array(found)


@pytest.mark.parametrize("n", COMPONENTS)
@pytest.mark.parametrize("amplitude", [1e-5, 1e-4, 5e-3])
def test_masings_loops(amplitude: float, n: int) -> None:
    """The first branch is the polygon through the table, the loop closes, and its damping is
    Masing's 2/pi (2 ∫ tau/(tau_a a) - 1) of the polygon: ends to round-off in any number of steps,
    the area to the second order of the steps."""
    law = LAWS["Iwan"]
    gamma = np.concatenate([[0.0], GAMMA])
    tau = np.concatenate([[0.0], [law.shear_modulus * r * g for g, r in CURVE]])
    top = np.interp(amplitude, gamma, tau)
    below = gamma < amplitude
    places = np.append(gamma[below], amplitude)
    stresses = np.append(tau[below], top)
    area = np.sum(0.5 * np.diff(places) * (stresses[1:] + stresses[:-1]))
    damping = 2.0 / np.pi * (2.0 * area / (top * amplitude) - 1.0)

    ends = (amplitude, -amplitude, amplitude)
    for steps in (3, 300):
        found = shear(law, ends, steps, n)
        assert found[steps] == pytest.approx(top, rel=1e-12)
        assert found[2 * steps] == pytest.approx(-top, rel=1e-12)
        assert found[-1] == pytest.approx(top, rel=1e-12)
    loop = found[steps:]
    strains = np.concatenate(
        [
            np.linspace(amplitude, -amplitude, steps + 1),
            np.linspace(-amplitude, amplitude, steps + 1)[1:],
        ]
    )
    enclosed = np.sum(0.5 * np.diff(strains) * (loop[1:] + loop[:-1]))
    assert enclosed / (2.0 * np.pi * top * amplitude) == pytest.approx(damping, rel=1e-3)


@pytest.mark.long
def test_masing_damping_of_the_hyperbola() -> None:
    """A fine table of G/Gmax = 1/(1 + gamma/r) has the damping of the curve, .22414209 at 2 r."""
    r = 1e-3
    table = [(float(g), float(1.0 / (1.0 + g / r))) for g in np.geomspace(1e-3 * r, 4.0 * r, 300)]
    law = Iwan(2.08e8, 0.3, 2000.0, table)
    found = shear(law, (2.0 * r, -2.0 * r, 2.0 * r), 400)[400:]
    strains = np.concatenate(
        [np.linspace(2.0 * r, -2.0 * r, 401), np.linspace(-2.0 * r, 2.0 * r, 401)[1:]]
    )
    area = np.sum(0.5 * np.diff(strains) * (found[1:] + found[:-1]))
    assert area / (4.0 * np.pi * r * found[0]) == pytest.approx(0.22414209, rel=2e-3)


def test_a_stress_in_place_carries_iwans_elements_and_makes_no_energy() -> None:
    """A deviator at rest is no element's: soil is virgin about it, and the ledger still closes."""
    law = LAWS["Iwan"]
    rest = np.array([[-50e3, -100e3, -50e3, 5e3]])
    state = law.start(rest)
    assert law.f(state)[0] < 0.0
    rng = np.random.default_rng(1)
    for _ in range(5):
        de = 1e-4 * rng.standard_normal((1, 4))
        new, _ = law.stress(de, state, tangent=False)
        work = np.sum(new["sigma"] * de)
        rest_of_it = law.dissipation(de, state, new) + law.remainder(state, new)
        grown = law.stored(new) - law.stored(state)
        assert work == pytest.approx((grown + rest_of_it)[0], rel=1e-9)
        state = new


def test_tension_is_cut_off_at_the_tip() -> None:
    """Pulled apart, soil keeps c/tan phi in all directions, whatever its dilatancy."""
    for name in (
        "cone",
        "cone without dilatancy",
        "Mohr-Coulomb",
        "Mohr-Coulomb without dilatancy",
    ):
        law = LAWS[name]
        tip = 1e4 / np.tan(np.radians(30.0))
        de = np.array([[1e-2, 1e-2, 0.9e-2, 1e-4]])
        state, _ = law.stress(de, law.start(np.zeros((1, 4))), tangent=False)
        values, _ = find_principal(state["sigma"])
        assert values[0] == pytest.approx(tip, rel=1e-9)


def test_the_compression_cone_carries_too_much_in_plane_strain() -> None:
    """eta and strength of the fits at 30 degrees, psi = phi: 3 tan/√(9 + 12 tan²) and its like."""
    t = np.tan(np.radians(30.0))
    plane = DruckerPrager(1e8, 0.3, 2000.0, 1e4, 30.0, 30.0).cone
    assert plane[0] == pytest.approx(3.0 * t / np.sqrt(9.0 + 12.0 * t**2), rel=1e-12)
    assert plane[1] == pytest.approx(3e4 / np.sqrt(9.0 + 12.0 * t**2), rel=1e-12)
    outer = DruckerPrager(1e8, 0.3, 2000.0, 1e4, 30.0, 30.0, fit="compression").cone
    assert outer[0] == pytest.approx(3.0 / (np.sqrt(3.0) * 2.5), rel=1e-12)


SOIL: dict[str, Any] = {"E": 1e8, "nu": 0.3, "rho": 2000.0}


@pytest.mark.parametrize("law", [MohrCoulomb, DruckerPrager])
@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"cohesion": 0.0, "phi": 0.0, "psi": 0.0}, "both zero"),
        ({"cohesion": 1e3, "phi": 20.0, "psi": 25.0}, "more than phi"),
        ({"cohesion": 1e3, "phi": 0.5, "psi": 0.0}, "in degrees and not in radians"),
        ({"cohesion": 1e3, "phi": 90.0, "psi": 0.0}, "degrees from 0 to less than 90"),
        ({"cohesion": -1.0, "phi": 30.0, "psi": 0.0}, "cohesion"),
    ],
)
def test_strengths_that_are_none_are_refused(
    law: Any, values: dict[str, float], sentence: str
) -> None:
    with pytest.raises(InputError, match=sentence):
        law(**SOIL, **values)


def test_published_curves_are_tables() -> None:
    """Those of Seed and Idriss are; Vucetic and Dobry's of sand falls at its end, and is told."""
    curves = soil.SoilCurves.seed_idriss()
    law = Iwan(**SOIL, curve=list(zip(curves.strain, curves.reduction, strict=True)))
    assert len(law.elements[0]) > 5
    curves = soil.SoilCurves.vucetic_dobry(0.0)
    table = list(zip(curves.strain, curves.reduction, strict=True))
    with pytest.raises(InputError, match="beyond gamma = 0.00316; leave out what is beyond"):
        Iwan(**SOIL, curve=table)
    assert Iwan(**SOIL, curve=table[:-1])


def test_softening_is_refused() -> None:
    for name in ("isotropic", "kinematic"):
        with pytest.raises(InputError, match="depend on the mesh"):
            J2(200e9, 0.3, 7800.0, 250e6, **{name: -1e6})


def test_a_fit_that_is_none_is_refused() -> None:
    with pytest.raises(InputError, match="plane strain"):
        DruckerPrager(**SOIL, cohesion=1e3, phi=30.0, psi=0.0, fit="inner")


@pytest.mark.parametrize(
    ("curve", "sentence"),
    [
        ([(1e-4, 0.9), (1e-3, 0.95)], "rises"),
        ([(1e-3, 0.9), (1e-4, 0.5)], "do not increase"),
        ([(0.0, 1.0), (1e-4, 0.5)], "leave the strain zero out"),
        ([(1e-4, 1.2)], "between 0 and 1"),
        ([(1e-4, 0.9), (1e-3, 0.01)], "bends upwards, or falls"),
        ([1e-4, 0.9], "pairs"),
    ],
)
def test_tables_that_are_no_backbone_are_refused(curve: Any, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        Iwan(**SOIL, curve=curve)


def test_a_law_without_yielding_is_elastic() -> None:
    law = YieldingMaterial(1e8, 0.3, 2000.0)
    de = 1e-3 * np.random.default_rng(0).standard_normal((20, 6))
    state, D = law.stress(de, law.start(np.zeros((20, 6))))
    assert np.array_equal(state["sigma"], de @ law.stiffness(6)) and D is not None
    assert np.abs(law.elastic_strain(state["sigma"]) - de).max() <= 1e-15
    assert np.array_equal(law.dissipation(de, law.start(np.zeros((20, 6))), state), np.zeros(20))


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("Mohr-Coulomb", MohrCoulomb(1e8, 0.3, 2000.0, 1e4, 30.0, 0.0)),
        ("cone", DruckerPrager(1e8, 0.3, 2000.0, 1e4, 30.0, 0.0)),
        ("J2 with hardening", J2(200e9, 0.3, 7800.0, 250e6, isotropic=2.2e9, kinematic=5e9)),
        ("J2 with hardening", J2(200e9, 0.3, 7800.0, 250e6, isotropic=2e9, kinematic=5.5e9)),
    ],
)
def test_a_wrong_return_is_told(right: str, wrong: Any) -> None:
    """Dropped dilatancy, and hardening times 1.1, by the residual of the law that was meant."""
    law = LAWS[right]
    worst = 0.0
    for de, old, new, _ in walk(wrong, 6):
        sizes = (float(np.abs(new["sigma"]).max()), strain_of(law))
        worst = max(worst, float(law.residual(de, old, new, sizes).max()))
    assert worst >= 1e-4
