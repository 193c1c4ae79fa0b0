"""Absorbing boundaries: dashpots at right angles and oblique (V8.1), compliant base (V8.2), and
what is refused."""

from __future__ import annotations

import logging
import math

import numpy as np
import pytest
from dashpot_reflection import dashpot_energy
from fem_problems import block, field, linear
from mpi4py import MPI
from soil import SOIL, burst, column_of, energies, history, strip
from wave_packet import energy_sent_back

import vi_contact as vc
from vi_contact import fem, soil
from vi_contact.core.errors import InputError
from vi_contact.practice.ground_motion.record import Record

HEIGHT, CELLS = 20.0, 80  # of 0.25 m
WAVES = {"S": (SOIL.c_s, (1.0, 0.0)), "P": (SOIL.c_p, (0.0, 1.0))}


def hit_column(comm, wave, factor=1.0, **data):
    """A column with dashpots below; its top is hit by a hump of one wavelength, 20 cells long."""
    speed, direction = WAVES[wave]
    mesh, tags = strip(comm, 0.25, HEIGHT, (1, CELLS))
    hump = burst(20 * HEIGHT / CELLS / speed)
    system = fem.assemble(
        mesh,
        SOIL,
        tied=fem.Tied(tags["left"], tags["right"]),
        dashpots=fem.Dashpots(tags["bottom"], normal=factor, tangential=factor),
        loads=fem.Traction(tags["top"], tuple(1e4 * np.array(direction)), history=hump),
        **data,
    )
    return linear(system), HEIGHT / CELLS / speed


@pytest.mark.parametrize("wave", WAVES)
@pytest.mark.promise("guide/soil.md", "1e-6 of the energy is left with 20 cells", bound="1e-4")
def test_waves_at_right_angles_leave(comm, wave):
    """V8.1: what is left of the energy after the passage is below 1e-4 at 20 points per
    wavelength."""
    problem, dt = hit_column(comm, wave)
    energy = energies(problem, dt=0.5 * dt, steps=2 * (CELLS + 60))
    assert energy[-1] < 1e-4 * energy.max()


@pytest.mark.serial  # ranks change nothing of it: the column above shows that
@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_mistuned_dashpots_reflect(comm, factor):
    """V8.1: R = (1 - a)/(1 + a), 1/3 and -1/3: size and sign of the velocity that comes back,
    energy R²."""
    problem, dt = hit_column(comm, "S", factor)
    steps = CELLS + 50
    v = history(problem, [(0.0, 0.5 * HEIGHT)], derivative=1, dt=dt, steps=steps)[:, 0, 0]
    first, later = v[: CELLS // 2 + 35], v[CELLS + 20 :]
    back = later[np.argmax(np.abs(later))] / first[np.argmax(np.abs(first))]
    assert math.isclose(back, (1.0 - factor) / (1.0 + factor), rel_tol=0.02)
    energy = energies(problem, dt=dt, steps=steps)
    assert math.isclose(energy[-1] / energy[CELLS // 2], 1.0 / 9.0, rel_tol=0.01)


@pytest.mark.serial
def test_other_material_and_thickness(comm):
    """A half-space four times as heavy below is like dashpots with a = 4; the section's thickness
    changes nothing."""
    mesh, tags = strip(comm, 0.25, HEIGHT, (1, CELLS))
    heavy = vc.LinearElastic(E=4.0 * SOIL.E, nu=SOIL.nu, rho=4.0 * SOIL.rho)
    found = []
    for section in (vc.PlaneStrain(), vc.PlaneStrain(0.3)):
        for dashpots in (
            fem.Dashpots(tags["bottom"], heavy),
            fem.Dashpots(tags["bottom"], normal=4.0, tangential=4.0),
        ):
            system = fem.assemble(mesh, SOIL, section=section, dashpots=dashpots)
            resistance = [r @ (system.C @ r) for r in system.influence.T]
            found.append(system.space.comm.sum(np.array(resistance)) / section.thickness)
    for total in found:  # rho c times the width
        np.testing.assert_allclose(
            total, 0.25 * 4.0 * SOIL.rho * np.array([SOIL.c_s, SOIL.c_p]), rtol=1e-12
        )


@pytest.mark.parametrize("scheme", [vc.Trapezoidal(), vc.ZienkiewiczWoodTaylor()])
def test_the_loss_is_in_the_ledger(comm, scheme):
    """V9.7 with dashpots: what left is damping loss, the defect is round-off."""
    problem, dt = hit_column(comm, "P", 2.0)
    run = vc.simulate(
        problem, scheme=scheme, dt=dt, steps=CELLS + 50, record=[vc.Energy()], progress=False
    )
    loss, given = run.history["loss_damping"][-1], run.history["work_input"][-1]
    assert 0.85 * given < loss < given
    assert abs(run.history["energy_defect"][-1]) < 1e-10 * given


CASES = [("P", 60, 2.2), ("S", 60, 1.5)]


@pytest.mark.slow
@pytest.mark.serial  # ranks change nothing of it: the columns above show that
@pytest.mark.parametrize("wave, angle, length", CASES)
def test_oblique_waves(comm, wave, angle, length):
    """V8.1: a packet on a periodic strip, 10 cells per wavelength: within 20 % of the table, and of
    its own mean."""
    material = vc.LinearElastic(E=1.0, nu=0.25, rho=1.0)
    slope = math.radians(angle)
    share, theory = energy_sent_back(comm, material, wave, slope, length=length, cells=10)
    assert share == pytest.approx(dashpot_energy(material, slope, wave=wave), rel=0.2)
    assert share == pytest.approx(theory, rel=0.15)


def soil_on_compliant_base(comm, motion, **data):
    """30 m of soil on the same soil, tied sides."""
    mesh, tags = strip(comm, 0.5, 30.0, (1, 60))
    base = fem.CompliantBase(tags["bottom"], motion=motion)
    return fem.assemble(
        mesh, SOIL, tied=fem.Tied(tags["left"], tags["right"]), dashpots=base, **data
    )


@pytest.mark.slow
@pytest.mark.parametrize("wave", WAVES)
def test_compliant_base(comm, wave):
    """V8.2: the surface moves with 2 v_up(t - H/c), the base with v_up(t) + v_up(t - 2H/c); then
    silence. 1 %."""
    speed, direction = WAVES[wave]
    # 30 cells in the wavelength of the peak
    shake = vc.Ricker(1.0, speed / 15.0, direction=direction)
    up = soil.upgoing(shake, dt=1e-4)
    problem, crossing = linear(soil_on_compliant_base(comm, up)), 30.0 / speed
    # where the lead of consistent mass and the lag of the trapezoidal rule are equal
    dt = 0.7 * 0.5 / speed
    steps = math.ceil((shake.duration + 2.2 * crossing) / dt)
    top, foot = history(
        problem, [(0.0, 30.0), (0.0, 0.0)], derivative=1, dt=dt, steps=steps
    ).transpose(1, 0, 2)
    t = dt * np.arange(1, steps + 1)
    wanted = np.array([2.0 * up(s - crossing) for s in t])
    peak = np.abs(wanted).max()
    assert np.abs(top - wanted).max() < 0.01 * peak
    assert np.abs(foot - np.array([up(s) + up(s - 2.0 * crossing) for s in t])).max() < 0.01 * peak
    # the echo, 1e-6 of the energy
    assert np.abs(top[t > shake.duration + 1.2 * crossing]).max() < 2e-3 * peak


SIDES = (("left", "right"), ("bottom", "top"), ("back", "front"))  # of a box: x, y, z
P, S = SOIL.rho * SOIL.c_p, SOIL.rho * SOIL.c_s  # impedances [Pa s/m]


def resistance(system):
    """Rᵀ C R [N s/m] of a body that moves as a whole."""
    R = system.influence
    return system.space.comm.sum(np.array([[r @ (system.C @ q) for q in R.T] for r in R.T]))


@pytest.mark.parametrize("simplices", [False, True])
@pytest.mark.parametrize("angle", [0.0, 0.4])
def test_faces_of_a_box_have_their_impedance(comm, simplices, angle):
    """Together rho c_P A along the normals and rho c_S A along the faces, exactly, however the box
    is turned."""
    mesh, tags = block(
        comm, lengths=(2.0, 1.0, 3.0), divisions=(2, 2, 3), simplices=simplices, angle=angle
    )
    axes = np.array(
        [[np.cos(angle), np.sin(angle), 0.0], [-np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]]
    )
    wanted = np.zeros((3, 3))
    for name, axis, area in (
        ("left", 0, 3.0),
        ("bottom", 1, 6.0),
        ("front", 2, 2.0),
        ("right", 0, 3.0),
    ):
        one = fem.assemble(mesh, SOIL, dashpots=fem.Dashpots(tags[name]))
        exact = area * (S * np.eye(3) + (P - S) * np.outer(axes[axis], axes[axis]))
        np.testing.assert_allclose(resistance(one), exact, rtol=0.0, atol=1e-12 * exact.max())
        wanted += exact
    every = fem.assemble(
        mesh, SOIL, dashpots=[fem.Dashpots(tags[n]) for n in ("left", "bottom", "front", "right")]
    )
    np.testing.assert_allclose(resistance(every), wanted, rtol=0.0, atol=1e-12 * wanted.max())


def test_nodes_on_edges_and_corners_have_the_dashpots_of_all_their_faces(comm):
    """A quarter of the area of every cell face round a node, P along its normal, S along it: one
    face, two, three."""
    # cells of 1 m x 0.5 m x 1 m
    mesh, tags = block(comm, lengths=(2.0, 1.0, 3.0), divisions=(2, 2, 3))
    quarter = {"left": (0, 0.125), "bottom": (1, 0.25), "back": (2, 0.125)}
    system = fem.assemble(mesh, SOIL, dashpots=[fem.Dashpots(tags[name]) for name in quarter])
    for c, rigid in enumerate(system.influence.T):
        points, force = field(system, system.C @ rigid)
        for point, cells in (
            ((0.0, 0.0, 0.0), {"left": 1, "bottom": 1, "back": 1}),
            ((0.0, 0.0, 1.0), {"left": 2, "bottom": 2}),
            ((1.0, 0.0, 0.0), {"bottom": 2, "back": 2}),
            ((0.0, 0.5, 0.0), {"left": 2, "back": 2}),
            ((1.0, 0.0, 1.0), {"bottom": 4}),
            ((1.0, 0.5, 1.0), {}),
            ((2.0, 1.0, 3.0), {}),
        ):
            found = force[np.abs(points - point).max(axis=1) < 1e-9][0, c]
            shares = [
                count * quarter[name][1] * (P if quarter[name][0] == c else S)
                for name, count in cells.items()
            ]
            assert abs(found - sum(shares)) < 1e-12 * P


@pytest.mark.two_ranks
@pytest.mark.parametrize("simplices", [False, True])
def test_a_curved_face_has_its_impedance_in_the_limit(comm, simplices):
    """A patch of a sphere, whose facets of hexahedra are not plane: the integral over the sphere,
    of second order."""

    def bulging(x):  # from y = 1 on to y = 2, where the points are 2 m from the origin
        rays = np.column_stack([x[:, 0], np.ones(len(x)), x[:, 2]])
        return rays * (1.0 + (x[:, 1] - 1.0) * (2.0 / np.linalg.norm(rays, axis=1) - 1.0))[:, None]

    s, w = np.polynomial.legendre.leggauss(20)
    a, b = np.meshgrid(0.5 * s, 0.5 * s)
    rays = np.stack([a, np.ones_like(a), b], axis=-1)
    weights = 4.0 * np.outer(w, w) / 4.0 / np.linalg.norm(rays, axis=-1) ** 3
    normals = rays / np.linalg.norm(rays, axis=-1)[..., None]
    exact = S * weights.sum() * np.eye(3) + (P - S) * np.einsum(
        "ij,ijk,ijl->kl", weights, normals, normals
    )
    errors = []
    for n in (2, 4):
        mesh, tags = block(
            comm,
            lengths=(1.0, 1.0, 1.0),
            corner=(-0.5, 1.0, -0.5),
            divisions=(n, 1, n),
            simplices=simplices,
            deform=bulging,
        )
        errors.append(
            np.abs(
                resistance(fem.assemble(mesh, SOIL, dashpots=fem.Dashpots(tags["top"]))) - exact
            ).max()
        )
    assert errors[0] < 0.05 * exact.max() and errors[1] < 0.3 * errors[0]


@pytest.mark.serial  # ranks change nothing of it: the compliant base of a box shows that
@pytest.mark.parametrize(
    "wave, axis, moves, solver",
    [
        ("P", 1, 1, vc.Condensed()),
        ("S", 0, 1, vc.Condensed()),
        ("S", 2, 0, vc.Iterative()),
    ],
)
def test_waves_at_right_angles_leave_a_box(comm, wave, axis, moves, solver):
    """V8.1: P and both S waves, along every axis, sides tied both ways: what is left of the energy
    falls with the fourth power of h, as the square of the mesh's reflection, which is that of its
    error of dispersion."""
    speed, left = WAVES[wave][0], []
    for cells in (50, 100):
        h = HEIGHT / cells
        lengths, divisions = (
            tuple(one if c == axis else other for c in range(3))
            for one, other in ((HEIGHT, h), (cells, 1))
        )
        mesh, tags = block(comm, lengths=lengths, divisions=divisions)
        tied = [fem.Tied(tags[one], tags[two]) for c, (one, two) in enumerate(SIDES) if c != axis]
        push = fem.Traction(
            tags[SIDES[axis][1]], tuple(1e4 * np.eye(3)[moves]), history=burst(5.0 / speed)
        )
        system = fem.assemble(
            mesh, SOIL, tied=tied, loads=push, dashpots=fem.Dashpots(tags[SIDES[axis][0]])
        )
        steps = round(1.5 * cells) * 2
        energy = energies(linear(system), dt=0.5 * h / speed, steps=steps, solver=solver)
        left.append(energy[-1] / energy.max())
    assert left[0] < 6e-5 and left[1] < 0.2 * left[0]


@pytest.mark.slow
@pytest.mark.parametrize(
    "simplices, solver",
    [
        (False, vc.Condensed()),
        pytest.param(True, vc.Iterative(tolerance=1e-12), marks=pytest.mark.serial),
    ],
)
@pytest.mark.promise("guide/soil.md", "to the last digits, in all three components")
def test_compliant_base_of_a_box(comm, simplices, solver):
    """V8.2 in three components at once, P impedance for the vertical one: the discrete column to
    round-off, and the outcrop's motion at the surface (1 %)."""
    mesh, tags = block(comm, lengths=(1.0, 15.0, 0.5), divisions=(1, 30, 1), simplices=simplices)
    waves = [
        vc.Ricker(1.0, c / length, direction=tuple(e))
        for c, length, e in zip(
            (SOIL.c_s, SOIL.c_p, SOIL.c_s), (30.0, 15.0, 40.0), np.eye(3), strict=True
        )
    ]
    up = soil.upgoing(waves, dt=1e-4)
    assert np.array_equal(up(0.03), sum(soil.upgoing(one, dt=1e-4)(0.03) for one in waves))
    system = fem.assemble(
        mesh,
        SOIL,
        tied=[fem.Tied(tags[one], tags[two]) for one, two in (SIDES[0], SIDES[2])],
        dashpots=fem.CompliantBase(tags["bottom"], motion=up),
    )
    dt = 0.7 * 0.5 / SOIL.c_p
    run = {"dt": dt, "steps": math.ceil(0.35 / dt)}
    heights = np.linspace(0.0, 15.0, 31)
    found = history(
        linear(system), [(0.0, y, 0.0) for y in heights], derivative=1, solver=solver, **run
    )
    for plane in ([0, 1], [2, 1]):
        column = column_of(SOIL, heights).on_dashpots(S, P, lambda t, c=plane: up(t)[c])
        exact = np.array([state.v for state, _ in vc.march(column, **run)]).reshape(-1, 31, 2)
        assert (
            np.abs(found[..., plane] - exact).max()
            < (1e-9 if simplices else 1e-11) * np.abs(exact).max()
        )
    t = dt * np.arange(1, run["steps"] + 1)
    for c, speed in enumerate((SOIL.c_s, SOIL.c_p, SOIL.c_s)):
        outcrop = 2.0 * np.array([up(s - 15.0 / speed)[c] for s in t])
        assert np.abs(found[:, -1, c] - outcrop).max() < 0.01 * np.abs(outcrop).max()


@pytest.mark.slow
def test_contact_between_dashpots(comm):
    """Contact nodes on edges that have dashpots too: a box falls on a plane between absorbing
    sides. What leaves is in the ledger, the forces are as symmetric as the box, both routes and one
    rank alone find the same."""
    plane, found = vc.HalfSpace((0.0, -1e-4, 0.0), (0.0, 1.0, 0.0)), []
    condensed, iterative = vc.Condensed(), vc.Iterative(tolerance=1e-12)
    for ranks, solver in ((comm, condensed), (comm, iterative), (MPI.COMM_SELF, condensed)):
        mesh, tags = block(ranks, lengths=(2.0, 2.0, 2.0), divisions=(4, 4, 4))
        sides = [fem.Dashpots(tags[name]) for pair in (SIDES[0], SIDES[2]) for name in pair]
        system = fem.assemble(mesh, SOIL, dashpots=sides, initial_velocity=(0.0, -0.5, 0.0))
        surface = fem.contact_surface(system, tags["bottom"], obstacle=plane)
        problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(0.3))
        run = vc.simulate(
            problem,
            dt=1e-4,
            steps=40,
            solver=solver,
            record=[vc.Energy(), vc.Contact()],
            progress=False,
        )
        h, force = run.history, np.abs(run.history["contact_force_y"]).max()
        assert h["contact_max_slip"][-1] > 0.0 and run.facts["worst_certificate"] < 1e-10
        assert h["loss_damping"][-1] > 0.1 * h["energy_kinetic"][0]
        assert np.abs(h["energy_defect"]).max() < 1e-10 * h["energy_kinetic"][0]
        assert max(np.abs(h[f"friction_force_{c}"]).max() for c in "xz") < 1e-9 * force
        found.append(
            (h["contact_force_y"] / force, h["contact_max_slip"] / h["contact_max_slip"][-1])
        )
    assert np.abs(np.array(found) - found[0]).max() < 1e-8


@pytest.mark.two_ranks
def test_the_base_says_what_it_expects(comm, caplog):
    """In the log, and in the summary of a run; a second shaking is refused."""
    with caplog.at_level(logging.INFO, logger="vi_contact.fem.body.dashpots"):
        system = soil_on_compliant_base(comm, soil.upgoing(vc.Ricker(1.0, 10.0), dt=1e-3))
    assert comm.rank or "expects the upgoing motion, half the velocity of an outcrop" in caplog.text
    run = vc.simulate(linear(system), dt=1e-3, steps=2, progress=False)
    assert "CompliantBase on 'bottom' expects the upgoing motion" in run.facts["boundaries"][0]
    with pytest.raises(InputError, match="leave out the excitation of the problem"):
        linear(system, excitation=vc.Ricker(1.0, 10.0))
    with pytest.raises(InputError, match="return 2 finite velocities"):
        soil_on_compliant_base(comm, lambda t: np.array([np.nan, 0.0])).load(0.0)


@pytest.mark.two_ranks
def test_held_and_dashed_is_refused(comm):
    """One component of one boundary is held or damped, never both; corners of rollers may touch
    dashpots."""
    mesh, tags = strip(comm, 2.0, 2.0, (2, 2))
    rollers = [fem.Prescribed(tags[side], components=(1,)) for side in ("left", "right")]
    system = fem.assemble(mesh, SOIL, prescribed=rollers, dashpots=fem.Dashpots(tags["bottom"]))
    assert system.C is not None
    floor = fem.Prescribed(tags["bottom"], components=(1,))
    with pytest.raises(InputError, match="a component is either prescribed or damped"):
        fem.assemble(mesh, SOIL, prescribed=floor, dashpots=fem.Dashpots(tags["bottom"]))
    fem.assemble(mesh, SOIL, prescribed=floor, dashpots=fem.Dashpots(tags["bottom"], normal=0.0))
    with pytest.raises(InputError, match="a component is either prescribed or damped"):
        fem.assemble(
            mesh, SOIL, clamped=tags["bottom"], dashpots=fem.Dashpots(tags["bottom"], normal=0.0)
        )
    with pytest.raises(InputError, match="resist nothing"):
        fem.assemble(mesh, SOIL, dashpots=fem.Dashpots(tags["bottom"], normal=0.0, tangential=0.0))
    with pytest.raises(InputError, match="Dashpots: normal is -1"):
        fem.Dashpots(tags["bottom"], normal=-1.0)


@pytest.mark.two_ranks
def test_what_does_not_fit_a_box_is_refused(comm):
    """A motion of two components, several motions that disagree or none at all, a side that is held
    and damped."""
    mesh, tags = block(comm, lengths=(1.0, 1.0, 1.0), divisions=(1, 1, 1))
    plane, space = vc.Ricker(1.0, 10.0), vc.Ricker(1.0, 10.0, direction=(0.0, 1.0, 0.0))
    with pytest.raises(
        InputError, match=r"CompliantBase: motion\(0\) is \[0. 0.\]: return 3 finite velocities"
    ):
        fem.assemble(
            mesh,
            SOIL,
            dashpots=fem.CompliantBase(tags["bottom"], motion=soil.upgoing(plane, dt=1e-3)),
        )
    for waves in ([], [plane, space]):
        with pytest.raises(InputError, match="directions of the same number of components"):
            soil.upgoing(waves, dt=1e-3)
    rollers = fem.Prescribed(tags["front"], components=(2,))
    with pytest.raises(
        InputError, match="'front' has dashpots in a direction that is prescribed on 'front'"
    ):
        fem.assemble(mesh, SOIL, prescribed=rollers, dashpots=fem.Dashpots(tags["front"]))
    beside = fem.assemble(mesh, SOIL, prescribed=rollers, dashpots=fem.Dashpots(tags["left"]))
    assert beside.C is not None
    for side in ("left", "right"):
        with pytest.raises(
            InputError, match=f"'{side}' is tied and has dashpots, which would brake"
        ):
            fem.assemble(
                mesh,
                SOIL,
                tied=fem.Tied(tags["left"], tags["right"]),
                dashpots=fem.Dashpots(tags[side]),
            )
    record = Record(dt=0.01, acceleration=np.zeros(5))
    with pytest.raises(InputError, match="a record in a list has no direction"):
        soil.upgoing([record, record])
    with pytest.raises(InputError, match="upgoing: motion is"):
        soil.upgoing("north.at2", dt=1e-3)
