"""Reactions and section forces of bodies that yield, beside equilibrium and stresses by hand."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.algebra import largest
from vi_contact.core.errors import InputError
from vi_contact.core.surfaces import empty_surface
from vi_contact.laws import J2, LinearElastic, MohrCoulomb, Rayleigh
from vi_contact.meshes.block import BlockMesh

MASS = 2000.0 * 1.0 * 2.0  # kg/m, of the column
STEEL = J2(200e9, 0.3, 7800.0, 250e6, isotropic=2e9, kinematic=4e9)
SOIL = MohrCoulomb(50e6, 0.3, 2000.0, cohesion=20e3, phi=30.0, psi=30.0)
DOWN = (0.0, -9.80665)


def free(system: Any) -> vc.ContactProblem:
    """A problem without contact."""
    return vc.ContactProblem(system, empty_surface(system.space.comm, 2))


@pytest.mark.two_ranks
@pytest.mark.parametrize("degree", [1, 2])
def test_a_bent_wall_that_yields(comm: Any, degree: int) -> None:
    """A clamped steel wall under a push at its top, past the yield moment of an elastic section:
    N, V, M and the foot by equilibrium of what is above, whatever the stresses are."""
    b, h = 0.5, 2.0
    push, weight = 1.1 * 250e6 * b / (4.0 * h), 7.8e6  # Pa, N/m³
    mesh, tags = fem.build_mesh(
        BlockMesh(lengths=(b, h), divisions=(2, 8), simplices=degree == 2), comm
    )
    loads = [fem.Traction(tags["top"], (push, 0.0)), fem.BodyForce((0.0, -weight))]
    system = fem.assemble(
        mesh,
        STEEL,
        degree=degree,
        integration="bbar" if degree == 1 else "full",
        clamped=tags["bottom"],
        loads=loads,
    )
    problem = free(system)
    state = vc.static_equilibrium(problem)
    _, strain = fem.at_points(problem, state, "plastic_strain")
    assert largest(system.space.comm, float(np.max(strain, initial=0.0))) > 3e-5
    levels = {"foot": 0.0, "half": 1.0}
    cuts = {label: ((0.0, y), (b, y)) for label, y in levels.items()}
    row = vc.SectionForces(cuts, loads=loads).start(problem, state)
    for label, y in levels.items():
        assert row[f"V_{label}"] == pytest.approx(push * b, rel=1e-8)
        assert row[f"N_{label}"] == pytest.approx(-weight * b * (h - y), rel=1e-8)
        assert row[f"M_{label}"] == pytest.approx(-push * b * (h - y), rel=1e-8)
    row = vc.Reactions("foot", tags["bottom"], (0.5 * b, 0.0), loads=loads).start(problem, state)
    assert row["reaction_x_foot"] == pytest.approx(-push * b, rel=1e-8)
    assert row["reaction_y_foot"] == pytest.approx(weight * b * h, rel=1e-8)
    assert row["reaction_M_foot"] == pytest.approx(push * b * h, rel=1e-8)


def test_smooth_plates_carry_the_stress_of_the_law(comm: Any) -> None:
    """A plate 2 m long in uniaxial strain, pulled past yield by 300 MPa: the plates above and below
    feel sigma_y = sigma_x - (Y + H a), a = (2 G e - Y)/(3 G + H) by hand. K u has other forces."""
    metal = J2(200e9, 0.3, 7800.0, 100e6, isotropic=20e9)
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(2.0, 1.0), divisions=(4, 2)), comm)
    sides = [("left", 0), ("bottom", 1), ("top", 1)]
    held = [fem.Prescribed(tags[name], components=(axis,)) for name, axis in sides]
    pull = fem.Traction(tags["right"], (300e6, 0.0))
    problem = free(fem.assemble(mesh, metal, integration="bbar", prescribed=held, loads=pull))
    state = vc.static_equilibrium(problem)
    K, G, H, Y = metal.bulk_modulus, metal.shear_modulus, 20e9, 100e6
    share = 3.0 * G / (3.0 * G + H)
    e = (300e6 - 2.0 / 3.0 * Y * share) / (K + 4.0 / 3.0 * G * (1.0 - share))
    sigma = 300e6 - (Y + H * (2.0 * G * e - Y) / (3.0 * G + H))
    row = vc.Reactions("top", tags["top"], (1.0, 1.0)).start(problem, state)
    assert row["reaction_y_top"] == pytest.approx(2.0 * sigma, rel=1e-9)
    elastic = 300e6 * metal.nu / (1.0 - metal.nu)
    assert abs(sigma - elastic) > 0.1 * elastic


@pytest.mark.parametrize(
    "scheme", [vc.Midpoint(), vc.ZienkiewiczWoodTaylor(), vc.Trapezoidal(), vc.HHT(-0.05)]
)
def test_a_column_that_is_pushed_until_it_yields(comm: Any, scheme: Any) -> None:
    """What acts on the column beside its weight is its foot, which brings it its momentum:
    ∑ R_x dt = Δ ∫ rho v, with damping of the elastic K. A cut on the foot is the foot."""
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0, 2.0), divisions=(2, 4)), comm)
    system = vc.with_weight(
        fem.assemble(
            mesh, SOIL, integration="bbar", clamped=tags["bottom"], damping=Rayleigh(0.0, 2e-4)
        )
    )
    problem = vc.ContactProblem(
        system, empty_surface(system.space.comm, 2), mass=vc.ConsistentMass()
    )
    start = vc.static_equilibrium(problem)
    start = replace(start, v=1.5 * system.influence[:, 0])
    record = [
        vc.Reactions("foot", tags["bottom"], (0.5, 0.0), gravity=DOWN),
        vc.SectionForces({"foot": ((0.0, 0.0), (1.0, 0.0))}, gravity=DOWN),
        vc.Energy(),
        vc.BodyMotion("body"),
    ]
    dt = 2e-3
    solution = vc.simulate(
        problem, dt=dt, steps=100, scheme=scheme, state=start, record=record, progress=False
    )
    h = solution.history
    assert h["loss_plastic"][-1] > 0.0
    size = MASS * 9.80665
    assert h["reaction_y_foot"][0] == pytest.approx(size, rel=1e-9)
    for one, other in (("reaction_x_foot", "V_foot"), ("reaction_y_foot", "N_foot")):
        assert np.abs(h[one] + h[other]).max() <= 1e-9 * size
    assert np.abs(h["reaction_M_foot"] + h["M_foot"]).max() <= 1e-9 * size
    assert np.abs(h["reaction_x_foot"]).max() > 0.3 * size
    if isinstance(scheme, vc.HHT):  # its equation of motion is not that of a mean velocity
        return
    brought = dt * np.cumsum(h["reaction_x_foot"][1:])
    gained = h["momentum_x_body"][1:] - h["momentum_x_body"][0]
    assert np.abs(brought - gained).max() <= 1e-9 * np.abs(gained).max()


def test_lifts_hold_what_is_there(comm: Any) -> None:
    """An elastic column between smooth walls in two lifts: a cut through the lower one carries what
    is there, and the wall beside it nu/(1 - nu) of the stress above; a cut through absent bodies is
    refused."""
    rise, weight = 2.0, 2000.0 * 9.80665
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0, 2 * rise), divisions=(1, 8)), comm)
    upper = fem.Cells.where("upper", mesh, lambda x: x[1] > rise - 1e-6)
    walls = [fem.Prescribed(tags[side], components=(0,)) for side in ("left", "right")]

    def stand(absent: Any) -> vc.ContactProblem:
        material = LinearElastic(50e6, 0.3, 2000.0)
        system = fem.assemble(
            mesh, material, clamped=tags["bottom"], prescribed=walls, absent=absent
        )
        return free(vc.with_weight(system))

    record = vc.SectionForces({"low": ((0.0, 1.0), (1.0, 1.0))}, gravity=DOWN)
    side = vc.Reactions("left", tags["left"], (0.0, 0.0), gravity=DOWN)
    problem = stand([upper])
    state = vc.static_equilibrium(problem)
    for height in (rise, 2 * rise):
        assert record.start(problem, state)["N_low"] == pytest.approx(
            -weight * (height - 1.0), rel=1e-9
        )
        if height == rise:
            problem, first = fem.place(problem, state, stand([]))
            state = vc.static_equilibrium(problem, state=first)
    assert side.start(problem, state)["reaction_x_left"] == pytest.approx(
        0.3 / 0.7 * 0.5 * weight * (2 * rise) ** 2, rel=1e-9
    )
    absent = vc.SectionForces({"up": ((0.0, 3.0), (1.0, 3.0))}, gravity=DOWN)
    with pytest.raises(InputError, match="absent"):
        absent.start(stand([upper]), vc.static_equilibrium(stand([upper])))
