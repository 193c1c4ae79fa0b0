"""What points of a body that yields tell: beside exact stresses, in fields, and in loops."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from yielding_cases import step_of, throw

import vi_contact as vc
from vi_contact import engineering, fem
from vi_contact.core.algebra import largest
from vi_contact.core.errors import InputError
from vi_contact.core.files import open_hdf5
from vi_contact.core.surfaces import empty_surface
from vi_contact.core.vtkhdf import open_series
from vi_contact.laws import J2, DruckerPrager, Iwan, MohrCoulomb
from vi_contact.laws.mandel import ROOT
from vi_contact.meshes.block import BlockMesh

LOOP = [(1e-5, 0.98), (1e-4, 0.85), (3e-4, 0.6), (1e-3, 0.3), (1e-2, 0.05)]


def stretch(comm: Any, law: Any, load: float, integration: str = "bbar") -> Any:
    """A problem and its equilibrium: a plate 2 m x 1 m between smooth plates, pulled along x."""
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(2.0, 1.0), divisions=(4, 2)), comm)
    system = fem.assemble(
        mesh,
        law,
        integration=integration,
        prescribed=[
            fem.Prescribed(tags["left"], components=(0,)),
            fem.Prescribed(tags["bottom"], components=(1,)),
            fem.Prescribed(tags["top"], components=(1,)),
        ],
        loads=fem.Traction(tags["right"], (load, 0.0)),
    )
    problem = vc.ContactProblem(system, empty_surface(system.space.comm, 2))
    return problem, vc.static_equilibrium(problem)


def test_points_of_a_plate_in_uniaxial_strain(comm: Any) -> None:
    """sigma_x = 300 MPa, eps = (e, 0, 0): q = |sigma_x - sigma_y|, and what stays with hardening
    by hand, a = (2 G e - yield)/(3 G + H)."""
    metal = J2(200e9, 0.3, 7800.0, 100e6, isotropic=20e9)
    problem, state = stretch(comm, metal, 300e6)
    K, G, H, Y = metal.bulk_modulus, metal.shear_modulus, 20e9, 100e6
    # q = 2 G e - 3 G a = Y + H a, and sigma_x = K e + 2/3 q
    share = 3.0 * G / (3.0 * G + H)
    e = (300e6 - 2.0 / 3.0 * Y * share) / (K + 4.0 / 3.0 * G * (1.0 - share))
    a = (2.0 * G * e - Y) / (3.0 * G + H)
    exact = {"equivalent_stress": Y + H * a, "plastic_strain": a, "mobilised_strength": 1.0}
    for name, value in exact.items():
        places, values = fem.at_points(problem, state, name)
        assert places.shape == (len(values), 2)
        assert np.allclose(values, value, rtol=1e-9)
        for continuous in (False, True):
            found = fem.as_function(problem, state, name, continuous=continuous)
            assert np.allclose(found.x.array, value, rtol=1e-9)
    _, sigma = fem.at_points(problem, state, "stress")
    assert np.allclose(sigma[:, 0, 0], 300e6, rtol=1e-9)
    assert np.allclose(sigma[:, 1, 1], 300e6 - (Y + H * a), rtol=1e-9)
    tensor = fem.as_function(problem, state, "stress", continuous=True).x.array.reshape(-1, 4)
    assert np.allclose(tensor[:, 0], 300e6, rtol=1e-9)
    assert np.abs(tensor[:, 1]).max(initial=0.0) <= 1e-6 * 300e6


@pytest.mark.serial
def test_the_strength_that_is_mobilised() -> None:
    """Shares of the limit at the same mean stress, by hand; 1 on the surface, and at a tip."""
    sigma = np.array([[-100e3, -300e3, -200e3, 0.0], [0.0, 0.0, 0.0, ROOT * 10e3]])
    clay = J2(1e7, 0.3, 2000.0, 400e3)
    soil = MohrCoulomb(1e7, 0.3, 2000.0, 20e3, 30.0, 0.0)
    found = clay.mobilised(clay.start(sigma))
    assert np.allclose(found, [np.sqrt(3.0) * 100e3 / 400e3, np.sqrt(3.0) * 10e3 / 400e3])
    found = soil.mobilised(soil.start(sigma))
    limits = np.array([2 * 20e3 * np.cos(np.pi / 6) + 0.5 * 400e3, 2 * 20e3 * np.cos(np.pi / 6)])
    assert np.allclose(found, np.array([200e3, 20e3]) / limits)
    cone = DruckerPrager(1e7, 0.3, 2000.0, 20e3, 30.0, 0.0)
    eta, strength, _ = cone.cone
    found = cone.mobilised(cone.start(sigma))
    assert np.allclose(found, [100e3 / (strength + 200e3 * eta), 10e3 / strength])
    assert np.allclose(soil.mobilised(soil.start(np.full((1, 4), soil.tip) * [1, 1, 1, 0])), 1.0)


def test_weaker_laws() -> None:
    """c and tan phi over F, psi at most the new phi; a law that does not say it is refused."""
    soil = MohrCoulomb(1e7, 0.3, 2000.0, 20e3, 30.0, 20.0).weaken(2.0)
    assert soil.cohesion == 10e3
    assert np.tan(np.radians(soil.phi)) == pytest.approx(0.5 * np.tan(np.pi / 6.0), rel=1e-14)
    assert soil.psi == soil.phi
    assert J2(1e7, 0.3, 2000.0, 400e3, isotropic=1e6).weaken(2.0).yield_stress == 200e3
    with pytest.raises(InputError, match="Iwan does not say"):
        Iwan(1e7, 0.3, 2000.0, LOOP).weaken(2.0)


@pytest.mark.long
@pytest.mark.two_ranks
def test_frames_have_what_points_tell(comm: Any, shared_tmp: Path) -> None:
    """XDMF and VTKHDF: the same means of cells, of as many as the body has, from the memory."""
    problem = throw(comm, n=2)
    dt = step_of("J2", 2)
    names = ("von_mises", "plastic_strain", "mobilised_strength")
    frames = {}
    for kind in (fem.XDMF(every=12), fem.VTKHDF(every=12)):
        out = shared_tmp / type(kind).__name__
        found = vc.simulate(problem, dt=dt, steps=12, out=out, fields=kind, progress=False)
        if isinstance(kind, fem.XDMF):
            with open_hdf5(out / "fields" / "frame_000012.h5") as file:
                frames["XDMF"] = {name: file[name][()] for name in names}
        else:
            with open_series(out / "fields.vtkhdf") as series:
                frames["VTKHDF"] = {name: series.read(name, 1) for name in names}
    for name in names:
        assert np.array_equal(frames["XDMF"][name], frames["VTKHDF"][name])
        point = "equivalent_stress" if name == "von_mises" else name
        _, values = fem.at_points(found.problem, found.state, point)
        most = largest(problem.surface.comm, values.max(initial=0.0))
        assert 0.0 < frames["XDMF"][name].max() <= most * (1.0 + 1e-12)
    assert frames["XDMF"]["plastic_strain"].max() > 1e-5


@pytest.mark.serial
def test_names_of_what_points_tell_are_taken_where_bodies_yield(comm: Any, tmp_path: Path) -> None:
    """A user's own plasticity may have the name where the body is elastic."""
    problem = throw(comm, n=2)
    own = {"plastic_strain": lambda state: fem.as_function(problem, state, "plastic_strain")}
    with pytest.raises(InputError, match="'plastic_strain', which frames have already"):
        vc.simulate(
            problem,
            dt=step_of("J2", 2),
            steps=1,
            out=tmp_path,
            fields=fem.XDMF(functions=own),
            progress=False,
        )


def test_loops_of_named_points(comm: Any) -> None:
    """In a run the recorder has the stress and the strain of the nearest point of integration."""
    problem = throw(comm, n=2)
    recorder = vc.StressStrain({"low": (0.05, 0.05), "high": (0.25, 0.9)})
    found = vc.simulate(problem, dt=step_of("J2", 2), steps=12, record=[recorder], progress=False)
    places, sigma = fem.at_points(found.problem, found.state, "stress")
    apart = np.linalg.norm(places - recorder.places["low"], axis=1)
    ranks = problem.surface.comm
    own = np.min(apart, initial=np.inf) <= 1e-12
    value = sigma[np.argmin(apart), 0, 1] if own else -np.inf
    expected = largest(ranks, value)
    if ranks.rank == 0:
        assert found.history["stress_xy_low"][-1] == pytest.approx(expected, rel=1e-12)
        assert found.history["strain_yy_low"][-1] < 0.0
        assert len(recorder.columns()) == 2 * 7


@pytest.mark.serial
def test_points_that_have_no_loops_are_refused(comm: Any) -> None:
    problem = throw(comm, n=2)
    dt = step_of("J2", 2)
    for points, sentence in (
        ({"a": (9.0, 9.0)}, "outside of the body"),
        ({"a": (0.1, 0.1, 0.1)}, "has 3 coordinates"),
    ):
        with pytest.raises(InputError, match=sentence):
            vc.simulate(problem, dt=dt, steps=1, record=[vc.StressStrain(points)], progress=False)
    with pytest.raises(InputError, match="points is empty"):
        vc.StressStrain({})
    with pytest.raises(InputError, match="at_points: 'strain' is not a quantity"):
        fem.at_points(problem, None, "strain")


@pytest.mark.serial
def test_the_damping_of_a_loop() -> None:
    """An elastic-plastic loop of Y = 1 at twice its yield strain has D = 2/pi (1 - 1/2) = 1/pi, and
    the ledger of a body with a constant loss has loss/(4 pi stored)."""
    x = np.concatenate([np.linspace(a, b, 401) for a, b in ((0, 2), (2, -2), (-2, 2), (2, -2))])
    y = np.zeros_like(x)
    for k in range(1, len(x)):
        y[k] = np.clip(y[k - 1] + x[k] - x[k - 1], -1.0, 1.0)
    found = engineering.loop_damping({"x": x, "y": y}, "x", "y")
    assert found.damping[-1] == pytest.approx(1.0 / np.pi, rel=1e-9)
    assert found.amplitude[-1] == 2.0 and found.stiffness[-1] == 0.5
    t = np.linspace(0.0, 2.0, 2001)
    ledger = {"t": t, "energy_strain": np.sin(np.pi * t) ** 2, "loss_plastic": 0.5 * t}
    energy = engineering.energy_damping(ledger, 1.0)
    assert energy.damping == pytest.approx([0.5 / (4.0 * np.pi)] * 2, rel=1e-5)
    with pytest.raises(InputError, match="no whole period"):
        engineering.energy_damping(ledger, 3.0)
    with pytest.raises(InputError, match="no whole cycle"):
        engineering.loop_damping({"x": t, "y": t}, "x", "y")


@pytest.mark.serial
@pytest.mark.parametrize(("amplitude", "exact"), [(0.5, 0.08557360), (2.0, 0.22414209)])
def test_masings_damping_of_a_hyperbola(amplitude: float, exact: float) -> None:
    """Iwan's elements for tau = G gamma/(1 + gamma/r), sheared to and fro: the damping of the loop
    is D = (2/pi) (2 ∫ tau/(tau_a a) - 1) of the hyperbola, but for the polygon of 60 points."""
    r = 1e-3
    strains = r * np.geomspace(1e-3, 10.0, 60)
    soil = Iwan(2.6e7, 0.3, 2000.0, list(zip(strains, 1.0 / (1.0 + strains / r), strict=True)))
    ends = amplitude * r * np.array([0.0, 1.0, -1.0, 1.0])
    ways = [np.linspace(a, b, 401)[1:] for a, b in zip(ends[:-1], ends[1:], strict=True)]
    gamma = np.concatenate([[0.0], *ways, ways[1]])
    state: Any = soil.start(np.zeros((1, 4)))
    tau = [0.0]
    for change in np.diff(gamma):
        state, _ = soil.stress(np.array([[0.0, 0.0, 0.0, change / ROOT]]), state, tangent=False)
        tau.append(float(state["sigma"][0, 3]) / ROOT)
    found = engineering.loop_damping({"x": gamma, "y": np.array(tau)}, "x", "y")
    assert found.damping[-1] == pytest.approx(exact, rel=0.02)
    assert found.amplitude[-1] == pytest.approx(amplitude * r, rel=1e-12)
    assert found.stiffness[-1] == pytest.approx(1e7 / (1.0 + amplitude), rel=0.01)


@pytest.mark.long
@pytest.mark.serial
def test_strains_and_stresses_are_computed_once_a_displacement(
    comm: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The march, the ledger, the certificate and frames ask for the same stresses."""
    from vi_contact.fem.body.strain_points import StrainPoints
    from vi_contact.fem.body.yielding import YieldingForce

    asked: dict[str, list[bytes]] = {"strain": [], "stress": []}
    strain, follow = StrainPoints._compute_strain, YieldingForce._follow

    def count_strain(self: Any, u: Any) -> Any:
        asked["strain"].append(u.tobytes())
        return strain(self, u)

    def count_stress(self: Any, way: Any) -> Any:
        asked["stress"].append(way.tobytes())
        return follow(self, way)

    monkeypatch.setattr(StrainPoints, "_compute_strain", count_strain)
    monkeypatch.setattr(YieldingForce, "_follow", count_stress)
    problem = throw(comm, n=2)
    vc.simulate(
        problem,
        dt=step_of("J2", 2),
        steps=30,
        record=[vc.Energy(), vc.StressStrain({"a": (0.05, 0.05)})],
        progress=False,
    )
    for calls in asked.values():
        assert len(calls) > 60
        assert len(set(calls)) >= len(calls) - 3
