"""Overlaps of facets: round-off on plane sides, what polygons of one curve leave out on curved
ones, refused beyond."""

import numpy as np
import pytest
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.fem.contact.curves import curvatures, left_out
from vi_contact.meshes import BlockMesh, Blocks, TwoBlocks

COMM = MPI.COMM_WORLD
STEEL = vc.LinearElastic(E=210e9, nu=0.3, rho=7800.0)
A, B, C = 0.05, 0.10, 0.20  # radii of the bore, the seat and the rim [m]
TOO_LARGE = 50e-6  # by which the shaft is larger than the hole [m]


def ring(inner, outer, n, d=2):
    """A quarter of a ring of n times n cells."""

    def bend(x):
        plane = np.column_stack([x[:, 0] * np.cos(x[:, 1]), x[:, 0] * np.sin(x[:, 1])])
        return np.column_stack([plane, x[:, 2:]])

    lengths, divisions = [outer - inner, np.pi / 2], [n, n]
    if d == 3:
        lengths, divisions = [*lengths, 0.02], [*divisions, 2]
    return BlockMesh(
        lengths=tuple(lengths),
        divisions=tuple(divisions),
        corner=(inner, 0.0, 0.0)[:d],
        deform=bend,
    )


def press_fit(n, m, overlap=0.0, d=2, loads=()):
    """A shaft of n divisions in a hub of m, seats "shaft_right" and "hub_left"."""
    mesh, tags = fem.build_mesh(
        Blocks({"shaft": ring(A, B + overlap, n, d), "hub": ring(B, C, m, d)}), COMM
    )
    held = [
        fem.Prescribed(tags[f"{body}_{side}"], components=(c,))
        for body in ("shaft", "hub")
        for side, c in (("bottom", 1), ("top", 0), ("back", 2), ("front", 2))[: 2 * d - 2]
    ]
    system = fem.assemble(mesh, STEEL, prescribed=held, loads=loads(tags) if loads else ())
    return system, tags["shaft_right"], tags["hub_left"]


def lame():
    """Return the pressure of the press fit [Pa]: Lamé's rings in plane strain, by Timoshenko and
    Goodier, Theory of Elasticity (1970), article 28."""
    E, nu = STEEL.E, STEEL.nu
    k = (1.0 + nu) / E
    shaft = k * ((1.0 - 2.0 * nu) * B**3 + A**2 * B) / (B**2 - A**2)
    hub = k * ((1.0 - 2.0 * nu) * B**3 + C**2 * B) / (C**2 - B**2)
    return TOO_LARGE / (shaft + hub)


@pytest.mark.parametrize("matching", [None, fem.DualMortar()], ids=repr)
@pytest.mark.parametrize("overlap", [1e-3, 1e-5])
def test_plane_sides_may_not_overlap(matching, overlap):
    """The sides of blocks of four facets of 250 mm; touching and apart they go on as before."""
    block = BlockMesh(lengths=(1.0, 1.0), divisions=(4, 4))

    def surface(gap, divisions=4):
        upper = BlockMesh(lengths=(1.0, 1.0), divisions=(divisions, divisions))
        mesh, tags = fem.build_mesh(TwoBlocks(lower=block, upper=upper, gap=gap, angle=0.3), COMM)
        system = fem.assemble(mesh, STEEL, clamped=[tags["lower_bottom"], tags["upper_top"]])
        return fem.contact_pair(system, tags["upper_bottom"], tags["lower_top"], matching=matching)

    with pytest.raises(
        InputError,
        match=rf"{overlap:.3g} m behind 'upper_bottom' at .*quasi_static.*moving.*InitialStrain",
    ):
        surface(-overlap)
    assert surface(0.0).everywhere(surface(0.0).gap0).max() < 1e-12
    assert surface(overlap).gap0 == pytest.approx(np.full(surface(overlap).count, overlap))
    if matching is not None:
        assert surface(0.0, 7).everywhere(surface(0.0, 7).gap0).max() < 1e-12


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("n", [8, 16, 32])
def test_a_press_fit_that_is_drawn_with_its_overlap_is_refused(n, d):
    """Seats of a shaft and a hub that are meshed alike: no facet leaves out anything of the other,
    on any mesh."""
    if d == 3 and n > 8:
        n = 12
    system, one, two = press_fit(n, n, TOO_LARGE, d)
    for sides in ((one, two), (two, one)):
        with pytest.raises(
            InputError,
            match="the bodies overlap there, or .* make a press fit .* by fem.InitialStrain",
        ):
            fem.contact_pair(system, *sides, matching=fem.DualMortar())


@pytest.mark.parametrize("n, m", [(8, 11), (11, 8), (8, 16), (24, 7), (7, 24), (16, 17)])
def test_polygons_of_one_curve_touch(n, m):
    """Seats of the same radius with unlike divisions: their polygons overlap by up to h²/(8R) and
    count as touching."""
    system, one, two = press_fit(n, m)
    for sides in ((one, two), (two, one)):
        surface = fem.contact_pair(system, *sides, matching=fem.DualMortar())
        gap = surface.everywhere(surface.gap0)
        assert gap.min() >= 0.0 and gap.max() < 2.0 * B * (np.pi / 2 / min(n, m)) ** 2 / 8.0


@pytest.mark.parametrize("n, m", [(8, 11), (24, 7), (7, 24)])
def test_a_larger_overlap_of_unlike_polygons_is_refused(n, m):
    """Five times what the coarser polygon leaves out of the circle."""
    overlap = 5.0 * B * (np.pi / 2 / min(n, m)) ** 2 / 8.0
    system, one, two = press_fit(n, m, overlap)
    with pytest.raises(InputError, match="the bodies overlap there"):
        fem.contact_pair(system, one, two, matching=fem.DualMortar())


def test_curved_sides_in_space_touch():
    """Rings of one radius with unlike divisions, in space; their overlap is refused beyond five
    times h²/(8R)."""
    system, one, two = press_fit(7, 9, 0.0, 3)
    surface = fem.contact_pair(system, one, two, matching=fem.DualMortar())
    assert surface.total == 8 * 3
    system, one, two = press_fit(7, 9, 5.0 * B * (np.pi / 14) ** 2 / 8.0, 3)
    with pytest.raises(InputError, match="the bodies overlap there"):
        fem.contact_pair(system, one, two, matching=fem.DualMortar())


def test_both_remedies_give_the_pressure_of_the_press_fit():
    """The strain of the shaft in one static step, and the overlap as a motion of the seat.

    Lamé to 2e-4 on 16 divisions."""
    exact = lame()
    assert exact == pytest.approx(34.615e6, rel=1e-4)
    swelling = TOO_LARGE / B

    def strain(tags):
        return fem.InitialStrain(((swelling, 0.0), (0.0, swelling)), cells=tags["shaft"])

    system, one, two = press_fit(16, 16, loads=strain)
    surface = fem.contact_pair(system, one, two, matching=fem.DualMortar())
    state = vc.static_equilibrium(vc.ContactProblem(system, surface))
    assert surface.everywhere(state.r_n / surface.weights) == pytest.approx(
        np.full(17, exact), rel=3e-4
    )
    system, one, two = press_fit(16, 16)
    surface = fem.contact_pair(system, one, two, matching=fem.DualMortar()).moving(
        towards=lambda t: TOO_LARGE * t
    )
    (state,) = list(vc.quasi_static(vc.ContactProblem(system, surface), [1.0]))
    assert surface.everywhere(state.r_n / surface.weights) == pytest.approx(
        np.full(17, exact), rel=2e-3
    )


@pytest.mark.serial
def test_the_curvature_of_a_circle_and_a_sphere():
    """H is 1/R along a circle's polygon, also of unequal facets, and q is the square of a chord
    over R."""
    angle = np.linspace(0.0, 1.0, 21) ** 1.2
    x = 2.0 * np.column_stack([np.cos(angle), np.sin(angle)])
    facets = np.column_stack([np.arange(20), np.arange(1, 21)])
    corners = x[facets]
    along = corners[:, 1] - corners[:, 0]
    normals = np.column_stack([along[:, 1], -along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
    H = curvatures(corners, facets, normals)
    middle = np.full((20, 1, 2), 0.5)
    sagitta = 0.5 * left_out(H, middle, corners)[:, 0]
    exact = np.linalg.norm(along, axis=1) ** 2 / 16.0
    assert sagitta[1:-1] == pytest.approx(exact[1:-1], rel=0.1)
    assert np.all(
        (sagitta[[0, -1]] > 0.5 * exact[[0, -1]]) & (sagitta[[0, -1]] < 2.0 * exact[[0, -1]])
    )
