"""Materials given by functions and anisotropic ones: closed forms, patch tests, layered meshes, any
number of ranks."""

from __future__ import annotations

from math import log
from typing import Any

import numpy as np
import pytest
from fem_problems import BODIES, CONCRETE, block, dense, field, linear, max_over_ranks
from mesh_tools import refusal

pytest.importorskip("dolfinx")
import ufl

from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.fem import (
    BodyForce,
    Cells,
    Dashpots,
    Facets,
    Heterogeneous,
    Prescribed,
    Reactions,
    Traction,
    compat,
)
from vi_contact.fem.output.fields import VonMises
from vi_contact.laws import (
    KelvinVoigt,
    LinearElastic,
    Orthotropic,
    PlaneStrain,
    PlaneStress,
    Rayleigh,
    with_weight,
)
from vi_contact.practice.soil import FreeField
from vi_contact.run.modal import lowest_frequency
from vi_contact.run.static import static_equilibrium

SPRUCE = {
    "E1": 11.6e9,
    "E2": 0.90e9,
    "E3": 0.50e9,
    "nu12": 0.37,
    "nu13": 0.42,
    "nu23": 0.47,
    "G12": 0.75e9,
    "G13": 0.72e9,
    "G23": 0.039e9,
    "rho": 390.0,
}
SOFT = LinearElastic(E=5.0e8, nu=0.2, rho=1500.0)
SECTIONS = {"strain": PlaneStrain(0.7), "stress": PlaneStress(0.2), "solid": None}


def middles(mesh: Any) -> Any:
    return mesh.geometry.x[compat.geometry_dofmap(mesh)].mean(axis=1)


def halves(mesh: Any, height: float) -> tuple[Cells, Cells]:
    """Cells below and above a height (the last coordinate)."""
    above = middles(mesh)[:, mesh.geometry.dim - 1] > height
    return tuple(
        Cells(name, np.flatnonzero(one), mesh) for name, one in (("low", ~above), ("high", above))
    )


def same(comm: Any, one: Any, other: Any, tolerance: float = 1e-13) -> None:
    for matrix in "MKC":
        if getattr(one, matrix) is None:
            assert getattr(other, matrix) is None
            continue
        a, b = (dense(comm, system, getattr(system, matrix)) for system in (one, other))
        assert np.abs(a - b).max() <= tolerance * np.abs(b).max(), matrix


@pytest.mark.parametrize(
    "name, section",
    [
        ("quadrilaterals", "strain"),
        ("triangles", "stress"),
        ("hexahedra", "solid"),
    ],
)
def test_functions_constant_on_cells_are_pairs_of_cells_and_materials(
    comm: Any, name: str, section: str
) -> None:
    """M, K, C and the stresses, to round-off; numbers and functions may be mixed."""
    mesh, tags = block(comm, **BODIES[name])
    pairs = list(zip(halves(mesh, 0.7), (CONCRETE, SOFT), strict=True))
    functions = {}
    for constant in ("E", "nu", "rho"):
        functions[constant] = compat.function(compat.cell_space(mesh))
        for cells, material in pairs:
            functions[constant].x.array[cells.indices] = getattr(material, constant)
    data: dict[str, Any] = {
        "section": SECTIONS[section],
        "damping": Rayleigh(0.3, 1e-3),
        "clamped": tags["bottom"],
    }
    ours, theirs = (fem.assemble(mesh, one, **data) for one in (Heterogeneous(**functions), pairs))
    same(comm, ours, theirs)
    x = ours.space.points
    stresses = [VonMises(system.space.forms)(1e-3 * x**2) for system in (ours, theirs)]
    assert stresses[0] == pytest.approx(stresses[1], rel=1e-12)
    mixed = [(pairs[0][0], Heterogeneous(CONCRETE.E, functions["nu"], CONCRETE.rho)), pairs[1]]
    same(comm, fem.assemble(mesh, mixed, **data), theirs)


def test_linear_E_on_simplices_is_its_mean_on_every_cell(comm: Any) -> None:
    """P1 strains are constant, so that ∫ E over a cell is all that counts; by points, a P1
    Function, UFL."""
    mesh, tags = block(comm, **BODIES["triangles"])
    cellwise = compat.function(compat.cell_space(mesh))

    def E(x: Any) -> Any:
        return 1e9 * (1.0 + 0.3 * x[0] + 0.7 * x[1])

    cellwise.x.array[:] = E(middles(mesh).T)
    nodal = compat.function(fem.assemble(mesh, CONCRETE).space.V.sub(0).collapse()[0])
    nodal.interpolate(E)
    x = ufl.SpatialCoordinate(mesh)
    K = [
        fem.assemble(
            mesh, Heterogeneous(one, 0.25, 2000.0), clamped=tags["bottom"], section=PlaneStress(0.3)
        )
        for one in (cellwise, E, nodal, 1e9 * (1.0 + 0.3 * x[0] + 0.7 * x[1]))
    ]
    same(comm, K[1], K[0])
    for one in K[2:]:
        same(comm, one, K[0])


def test_a_bar_of_linear_modulus_against_its_closed_form(comm: Any) -> None:
    """E' = E0 (1 + x/L) pulled by s: u(L) = s L ln 2 / E0', second order; 16 layers of constant
    modulus likewise."""
    length, pull, nu = 2.0, 3.0e6, 0.2
    E, modulus = lambda x: 1e9 * (1.0 + x[0] / length), (1 - nu) / ((1 + nu) * (1 - 2 * nu)) * 1e9
    exact, errors = pull * length * log(2.0) / modulus, []
    for n in (8, 16):
        mesh, tags = block(comm, lengths=(length,), divisions=(n,))
        layers = [
            (
                Cells(
                    f"layer {k}",
                    np.flatnonzero(np.rint(middles(mesh)[:, 0] * n / length - 0.5) == k),
                    mesh,
                ),
                LinearElastic(1e9 * (1.0 + (k + 0.5) / n), nu, 1.0),
            )
            for k in range(n)
        ]
        ends = []
        for material in (Heterogeneous(E, nu, 1.0), layers):
            system = fem.assemble(
                mesh, material, clamped=tags["left"], loads=Traction(tags["right"], (pull,))
            )
            u = field(system, static_equilibrium(linear(system)).u)[1]
            ends.append(np.abs(u).max())
        assert ends[0] == pytest.approx(ends[1], rel=1e-12)
        errors.append(abs(ends[0] / exact - 1.0))
    assert errors[0] < 2e-3 and 3.8 < errors[0] / errors[1] < 4.2


@pytest.mark.two_ranks
def test_a_column_of_quadrilaterals_under_its_own_weight(comm: Any) -> None:
    """nu = 0, E = E0 (1 + y/H), rho = r (1 + y/H): u_y(H) = -∫ g m(y) / E dy with m the mass above;
    u is no polynomial.

    m(y) = r H ((1 + 1)² - (1 + y/H)²)/2, so that u_y(H) = -g r H²/(2 E0) (4 ln 2 - 3/2).
    """
    H, errors = 3.0, []

    def grows(x: Any) -> Any:
        return 1.0 + x[1] / H

    for n in (6, 12):
        mesh, tags = block(comm, lengths=(1.0, H), divisions=(2, n))
        material = Heterogeneous(lambda x: 1e8 * grows(x), 0.0, lambda x: 2e3 * grows(x))
        base = [
            Prescribed(tags["bottom"], components=(1,)),
            Prescribed(tags["left"], components=(0,)),
        ]
        system = with_weight(fem.assemble(mesh, material, prescribed=base), acceleration=10.0)
        exact = 10.0 * 2e3 * H**2 / 2e8 * (4.0 * log(2.0) - 1.5)
        errors.append(
            abs(np.abs(field(system, static_equilibrium(linear(system)).u)[1]).max() / exact - 1.0)
        )
    assert errors[0] < 1.2e-2 and 3.8 < errors[0] / errors[1] < 4.2


# Orthotropic cells
# --------------------------------------------------------------------------------------------------


def compliance(rotation: Any) -> Any:
    """S (3, 3, 3, 3) of SPRUCE in x, y, z, from its engineering constants alone."""
    s, n = np.zeros((3, 3, 3, 3)), SPRUCE
    S = np.array(
        [
            [1 / n["E1"], -n["nu12"] / n["E1"], -n["nu13"] / n["E1"]],
            [0, 1 / n["E2"], -n["nu23"] / n["E2"]],
            [0, 0, 1 / n["E3"]],
        ]
    )
    S = np.triu(S) + np.triu(S, 1).T
    for i in range(3):
        for j in range(3):
            s[i, i, j, j] = S[i, j]
    for (i, j), G in (((0, 1), n["G12"]), ((0, 2), n["G13"]), ((1, 2), n["G23"])):
        for a, b in ((i, j), (j, i)):
            s[i, j, a, b] = s[j, i, a, b] = 0.25 / G
    return np.einsum("ip,jq,kr,ls,pqrs->ijkl", *[rotation] * 4, s)


@pytest.mark.two_ranks
@pytest.mark.parametrize(
    "name, section",
    [
        ("quadrilaterals", "strain"),
        ("triangles", "stress"),
        ("quadrilaterals", "stress"),
        ("tetrahedra", "solid"),
    ],
)
def test_orthotropic_patch_test(comm: Any, name: str, section: str) -> None:
    """Constant stresses on the sides strain the body by its compliance, in axes turned against the
    mesh: to 1e-10; and their von Mises stress is that of the stresses, with sigma_zz of plane
    strain."""
    spec = {key: value for key, value in BODIES[name].items() if key != "angle"}
    mesh, tags = block(comm, **spec)
    d, angle = mesh.geometry.dim, 0.5
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    if d == 3:  # about another axis too
        turn = turn @ np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
    S, sigma = compliance(turn), np.zeros((3, 3))
    sigma[:d, :d] = 1e5 * np.array([[3.0, 1.0, -0.5], [1.0, -2.0, 0.7], [-0.5, 0.7, 1.5]])[:d, :d]
    if section == "strain":
        sigma[2, 2] = -np.einsum("ij,ij", S[2, 2], sigma) / S[2, 2, 2, 2]
    strain = np.einsum("ijkl,kl->ij", S, sigma)[:d, :d]
    sides = {
        "left": -np.eye(3)[0],
        "right": np.eye(3)[0],
        "top": np.eye(3)[1],
        "bottom": -np.eye(3)[1],
        "front": np.eye(3)[2],
        "back": -np.eye(3)[2],
    }
    loads = [
        Traction(tags[side], tuple((sigma @ n)[:d]))
        for side, n in sides.items()
        if side in tags and side != "bottom"
    ]
    material = Orthotropic(**SPRUCE, axes=turn.tolist())
    foot = Prescribed(tags["bottom"], displacement=lambda x, t: x @ strain)
    system = fem.assemble(mesh, material, section=SECTIONS[section], prescribed=foot, loads=loads)
    u = static_equilibrium(linear(system)).u
    points, values = field(system, u)
    assert np.abs(values - points @ strain).max() < 1e-10 * np.abs(values).max()
    deviator = sigma - np.trace(sigma) / 3 * np.eye(3)
    stress = VonMises(system.space.forms)(system.space.expand(u, 0.0))
    assert stress == pytest.approx(np.sqrt(1.5 * np.sum(deviator**2)), rel=1e-10)


@pytest.mark.two_ranks
def test_equal_moduli_beside_isotropic_cells_are_isotropic(comm: Any) -> None:
    """Cells of both kinds in one body, with damping: M, K, C of the isotropic material."""
    mesh, tags = block(comm, **BODIES["quadrilaterals"])
    like = {
        **{f"E{i}": CONCRETE.E for i in "123"},
        **{f"nu{ij}": CONCRETE.nu for ij in ("12", "13", "23")},
        **{f"G{ij}": CONCRETE.shear_modulus for ij in ("12", "13", "23")},
        "rho": CONCRETE.rho,
    }
    pairs = list(zip(halves(mesh, 0.7), (CONCRETE, Orthotropic(**like, axes=0.4)), strict=True))
    for section in (PlaneStrain(0.5), PlaneStress(0.2)):
        data: dict[str, Any] = {
            "section": section,
            "damping": Rayleigh(0.3, 1e-3),
            "clamped": tags["bottom"],
        }
        ours, theirs = (fem.assemble(mesh, one, **data) for one in (pairs, CONCRETE))
        same(comm, ours, theirs)
        x = ours.space.points
        stresses = [VonMises(one.space.forms)(1e-3 * x**2) for one in (ours, theirs)]
        assert stresses[0] == pytest.approx(stresses[1], rel=1e-12)


# Viscous stresses
# --------------------------------------------------------------------------------------------------


@pytest.mark.two_ranks
def test_damping_ratio_of_the_first_mode_of_a_rod(comm: Any) -> None:
    """A rod without lateral strain: xi = ½ w eta/modulus, eta = bulk + 4/3 shear; the mode decays
    so, from C itself."""
    mesh, tags = block(comm, lengths=(2.0,), divisions=(24,))
    damping = KelvinVoigt(shear=3.0e5, bulk=4.0e5)
    system = fem.assemble(mesh, CONCRETE, clamped=tags["left"], damping=damping)
    x, w = system.space.coordinates[:, 0], 2.0 * np.pi * lowest_frequency(system)
    mode, dot = np.sin(0.25 * np.pi * x), system.algebra.dot
    ratio = dot(mode, system.C @ mode) / (2.0 * w * dot(mode, system.M @ mode))
    modulus = CONCRETE.lame_lambda + 2.0 * CONCRETE.shear_modulus
    assert ratio == pytest.approx(0.5 * w * (4.0e5 + 4.0e5) / modulus, rel=1e-9)
    assert w == pytest.approx(0.25 * np.pi * np.sqrt(modulus / CONCRETE.rho), rel=5e-4)


@pytest.mark.two_ranks
@pytest.mark.parametrize("name", ["triangles", "hexahedra"])
def test_one_retardation_time_is_rayleigh_damping(comm: Any, name: str) -> None:
    mesh, _ = block(comm, **BODIES[name])
    section = PlaneStrain(0.4) if name == "triangles" else None
    tau, G = 2e-3, CONCRETE.shear_modulus
    viscous = KelvinVoigt(tau * G, tau * (CONCRETE.lame_lambda + 2.0 / 3.0 * G))
    ours, theirs = (
        fem.assemble(mesh, CONCRETE, section=section, damping=one)
        for one in (viscous, Rayleigh(0.0, tau))
    )
    same(comm, ours, theirs)


# Quadrature, outputs and bad input
# ------------------------------------------------------------------------------------


@pytest.mark.two_ranks
def test_quadrature_degree(comm: Any) -> None:
    """Exact from degree 2 on for rectangles (0 is not); facets too: a traction that is linear needs
    degree 2."""
    mesh, tags = block(comm, **BODIES["quadrilaterals"])
    load = Traction(tags["top"], lambda x, t: np.column_stack([x[:, 0], 0.0 * x[:, 0]]))
    exact, fine, coarse = (
        fem.assemble(
            mesh, CONCRETE, loads=load, dashpots=Dashpots(tags["left"]), quadrature_degree=degree
        )
        for degree in (None, 3, 1)
    )
    same(comm, fine, exact)
    assert max_over_ranks(comm, fine.load(0.0) - exact.load(0.0)) < 1e-13 * max_over_ranks(
        comm, exact.load(0.0)
    )
    one = np.abs(dense(comm, coarse, coarse.K) - dense(comm, exact, exact.K)).max()
    assert one > 1e-2 * np.abs(dense(comm, exact, exact.K)).max()
    assert max_over_ranks(comm, coarse.load(0.0) - exact.load(0.0)) > 1e-3 * max_over_ranks(
        comm, exact.load(0.0)
    )
    with pytest.raises(InputError, match="quadrature_degree is 1.5; give a whole number"):
        fem.assemble(mesh, CONCRETE, quadrature_degree=1.5)


def test_reactions_of_orthotropic_and_graded_bodies_carry_their_weight(comm: Any) -> None:
    mesh, tags = block(comm, **BODIES["quadrilaterals"])
    low, high = halves(mesh, 0.7)
    graded = Heterogeneous(1e9, 0.2, lambda x: 2000.0 + 100.0 * x[0])
    body = fem.assemble(
        mesh,
        [(low, Orthotropic(**SPRUCE)), (high, graded)],
        clamped=tags["bottom"],
        damping=KelvinVoigt(1e4),
        loads=BodyForce((1.0, 0.0)),
    )
    problem = linear(with_weight(body))
    reactions = Reactions(
        "base", tags["bottom"], (0.0, 0.0), loads=BodyForce((1.0, 0.0)), gravity=(0.0, -9.80665)
    )
    row = reactions.start(problem, static_equilibrium(problem))
    volumes = [
        comm.allreduce(
            float(
                compat.assemble_vector(
                    compat.compile_form(ufl.TestFunction(compat.cell_space(mesh)) * ufl.dx)
                )
                .array_r[one.indices[one.indices < owned]]
                .sum()
            )
        )
        for one in (low, high)
        for owned in (mesh.topology.index_map(2).size_local,)
    ]
    mass = SPRUCE["rho"] * volumes[0] + 2100.0 * volumes[1]  # the mean over 0 <= x <= 2
    assert row["reaction_y_base"] == pytest.approx(9.80665 * mass, rel=1e-10)
    assert row["reaction_x_base"] == pytest.approx(-3.0, rel=1e-9)


@pytest.mark.two_ranks
@pytest.mark.parametrize(
    "wrong, words",
    [
        ({"E": -1.0}, "Young's modulus E .* is -1.0; give"),
        ({"nu": 0.5}, "Poisson's ratio nu is 0.5; give values between -1 and 0.5"),
        ({"rho": "light"}, "the mass density rho .* is 'light'"),
    ],
)
def test_numbers_of_no_material_are_refused(wrong: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        Heterogeneous(**{"E": 1e9, "nu": 0.2, "rho": 1e3, **wrong})


def test_functions_of_no_material_are_refused_with_their_place(comm: Any) -> None:
    mesh, tags = block(comm, **BODIES["quadrilaterals"])
    for values, words in (
        ({"E": lambda x: 1e9 * (1.999 - x[0])}, r"Young's modulus E \[Pa\] is -1e\+06 at \(2, "),
        (
            {"nu": lambda x: 0.3 * x[0]},
            "Poisson's ratio nu is .* at .*give values between -1 and 0.5",
        ),
        ({"rho": lambda x: 0.0 * x[0]}, r"the mass density rho .* is 0 at"),
        ({"E": lambda x: x[7]}, "Heterogeneous: Young's modulus .* ended in IndexError"),
        ({"E": lambda x: np.nan * x[0]}, "is nan at"),
        (
            {"E": lambda x: 1e9 * (1.0 + x[:, 0])},
            r"E \[Pa\] has values of shape \(3,\) at \d+ points; give a function",
        ),
        ({"xi": lambda x: 0.1}, r"damping ratio xi has values of shape \(\) at"),
        ({"rho": lambda x: 1e3 + x[:1].T}, r"density rho .* has values of shape \(\d+, 1\) at"),
    ):
        with pytest.raises(InputError, match=words):
            fem.assemble(mesh, Heterogeneous(**{"E": 1e9, "nu": 0.2, "rho": 1e3, **values}))
    other, _ = block(comm, **BODIES["triangles"])
    away = compat.function(compat.cell_space(other))
    with pytest.raises(InputError, match="Young.s modulus .* is of another mesh"):
        fem.assemble(mesh, Heterogeneous(away, 0.2, 1e3))
    with pytest.raises(InputError, match="rho .* is of another mesh"):
        fem.assemble(mesh, Heterogeneous(1e9, 0.2, 1e3 + ufl.SpatialCoordinate(other)[0]))
    for E, words in (
        (1e9 * (1.0 + 0.5j) * ufl.SpatialCoordinate(mesh)[0], "ended in "),  # the compiler says no
        (lambda x: 1e9 * (1.0 + 0.5j * x[0]), "complex128"),
        (ufl.as_ufl(1e9 + 1e9j), "ended in TypeError"),
    ):
        said = refusal(comm, lambda: fem.assemble(mesh, Heterogeneous(E, 0.2, 1e3)))  # noqa: B023
        assert said.startswith("Heterogeneous: Young's modulus E [Pa] ") and words in said
    same(
        comm,
        fem.assemble(mesh, Heterogeneous(ufl.as_ufl(1e9), 0.2, 1e3)),
        fem.assemble(mesh, LinearElastic(1e9, 0.2, 1e3)),
    )
    with pytest.raises(InputError, match="has values of shape \\(2,\\)"):
        Heterogeneous(compat.function(compat.vector_space(mesh)), 0.2, 1e3)
    with pytest.raises(InputError, match="give a LinearElastic, Orthotropic or Heterogeneous"):
        fem.assemble(mesh, "concrete")
    with pytest.raises(InputError, match="does not go with PlaneStress, where the strain across"):
        fem.assemble(mesh, CONCRETE, section=PlaneStress(), damping=KelvinVoigt(1.0))
    assert not isinstance(tags["left"], Cells)


def test_waves_of_orthotropic_cells_have_no_one_speed(comm: Any) -> None:
    """Dashpots and free fields ask for a material; with one they are those of it."""
    mesh, tags = block(comm, **BODIES["quadrilaterals"])
    wood = Orthotropic(**SPRUCE)
    with pytest.raises(InputError, match="dashpots on 'left' stand beside orthotropic cells"):
        fem.assemble(mesh, wood, dashpots=Dashpots(tags["left"]))
    ours = fem.assemble(mesh, wood, dashpots=Dashpots(tags["left"], material=SOFT))
    theirs = fem.assemble(mesh, SOFT, dashpots=Dashpots(tags["left"]))
    a, b = (dense(comm, system, system.C) for system in (ours, theirs))
    assert np.abs(a - b).max() < 1e-13 * np.abs(b).max()
    side: Facets = tags["left"]
    with pytest.raises(InputError, match="free-field side 'left' stands beside orthotropic cells"):
        fem.assemble(
            mesh, wood, clamped=tags["bottom"], dashpots=FreeField(side, base=(), material=SOFT)
        )
    with pytest.raises(InputError, match="its column is of Rayleigh damping only"):
        fem.assemble(
            mesh,
            SOFT,
            clamped=tags["bottom"],
            damping=KelvinVoigt(1.0),
            dashpots=FreeField(side, base=()),
        )
