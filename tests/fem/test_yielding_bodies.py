"""Bodies of finite elements that yield: matrices, forces and tangents, and what is refused."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np
import pytest

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.algebra import largest, max_abs
from vi_contact.core.errors import InputError
from vi_contact.laws import J2, DruckerPrager, Iwan, LinearElastic, MohrCoulomb, Orthotropic
from vi_contact.laws.mandel import ROOT
from vi_contact.laws.yielding import YieldingMaterial
from vi_contact.meshes.block import BlockMesh

METAL = J2(2e9, 0.3, 2000.0, 1e6)
ELASTIC = LinearElastic(2e9, 0.3, 2000.0)
SOIL = MohrCoulomb(50e6, 0.3, 1900.0, cohesion=10e3, phi=30.0, psi=10.0)
BODIES = {
    "triangles": (2, True, 1),
    "triangles of degree 2": (2, True, 2),
    "quadrilaterals": (2, False, 1),
    "quadrilaterals of degree 2": (2, False, 2),
    "tetrahedra": (3, True, 1),
    "tetrahedra of degree 2": (3, True, 2),
    "hexahedra": (3, False, 1),
}


def block(comm: Any, kind: str = "quadrilaterals") -> tuple[Any, Any, int]:
    """A turned box of a kind of cells, its tags and the degree."""
    d, simplices, degree = BODIES[kind]
    spec = BlockMesh(
        lengths=(2.0, 1.5, 1.2)[:d], divisions=(4, 3, 2)[:d], simplices=simplices, angle=0.3
    )
    mesh, tags = fem.build_mesh(spec, comm)
    return mesh, tags, degree


def wave(system: Any, size: float) -> np.ndarray:
    """A smooth displacement [m], in other directions at every component."""
    x = system.space.coordinates
    component = system.space.ids % system.space.dimension
    return size * np.sin(3.0 * x[:, 0] + 2.0 * x[:, 1] + component)


def apart(system: Any, found: np.ndarray, wanted: np.ndarray) -> float:
    """The largest difference of two vectors of all ranks, over the largest entry."""
    comm = system.algebra.comm
    return largest(comm, max_abs(found - wanted)) / largest(comm, max_abs(wanted))


@pytest.mark.parametrize("kind", BODIES)
def test_where_nothing_yields_the_body_is_linear(comm: Any, kind: str) -> None:
    """K, C, p, p' and W of B at points of integration are those of the forms of UFL."""
    mesh, tags, degree = block(comm, kind)
    given: dict[str, Any] = {
        "degree": degree,
        "clamped": tags["bottom"],
        "damping": vc.Rayleigh(0.3, 0.01),
        "section": vc.PlaneStrain(0.7) if mesh.geometry.dim == 2 else None,
    }
    system = fem.assemble(mesh, METAL, **given)
    linear = fem.assemble(mesh, ELASTIC, **given)
    u = wave(system, 1e-9)
    force = linear.K @ u
    internal: Any = system.internal
    assert apart(system, system.K @ u, force) <= 1e-13
    assert apart(system, system.C @ u, linear.C @ u) <= 1e-13
    assert apart(system, internal.force(u), force) <= 1e-13
    assert apart(system, internal.tangent(u) @ u, force) <= 1e-13
    assert internal.energy(u) == pytest.approx(0.5 * system.algebra.dot(u, force), rel=1e-13)
    assert internal.dissipation(u) == 0.0


@pytest.mark.parametrize("kind", ["triangles of degree 2", "quadrilaterals", "hexahedra"])
def test_tangents_are_derivatives_of_the_force(comm: Any, kind: str) -> None:
    mesh, tags, degree = block(comm, kind)
    integration = "full" if degree == 2 else "bbar"
    system = fem.assemble(
        mesh, METAL, degree=degree, integration=integration, clamped=tags["bottom"]
    )
    internal: Any = system.internal
    u = wave(system, 1e-3)
    way = wave(system, 1.0)[::-1].copy()
    assert internal.dissipation(u) > 0.0 and internal.residual(u) <= 1e-12
    exact = internal.tangent(u) @ way
    errors = []
    for width in (1e-6, 1e-7):
        found = (internal.force(u + width * way) - internal.force(u - width * way)) / (2 * width)
        errors.append(apart(system, found, exact))
    assert errors[1] <= 1e-6 and errors[1] <= 0.2 * errors[0] + 1e-8


@pytest.mark.serial
def test_tangents_of_soil_are_symmetric_parts(comm: Any) -> None:
    """psi < phi: the matrix that leads the iterations is the symmetric part of the derivative."""
    mesh, tags, _ = block(comm)
    system = fem.assemble(mesh, SOIL, integration="bbar", clamped=tags["bottom"])
    internal: Any = system.internal
    u = wave(system, 5e-3)
    K = internal.tangent(u)
    v, w = wave(system, 1.0), np.cos(np.arange(len(u)))
    assert v @ (K @ w) == pytest.approx(w @ (K @ v), rel=1e-12)
    exact = (internal.force(u + 1e-8 * v) - internal.force(u - 1e-8 * v)) / 2e-8
    assert v @ (K @ v) == pytest.approx(v @ exact, rel=1e-4)


def test_the_mean_dilatation_leaves_what_keeps_its_volume(comm: Any) -> None:
    """A body squeezed to the same volume is as soft with bbar as its shear modulus says, where the
    full integration of first-order cells is stiffer; uniform strains are the same with both."""
    mesh, _, _ = block(comm)
    stiff = YieldingMaterial(2e9, 0.4999, 2000.0)
    full = fem.assemble(mesh, stiff)
    bbar = fem.assemble(mesh, stiff, integration="bbar")
    x = full.space.coordinates
    component = full.space.ids % 2
    even = np.where(component == 0, 1e-6 * x[:, 0], 2e-6 * x[:, 1])
    assert apart(full, bbar.K @ even, full.K @ even) <= 1e-12
    # u = (x², -2 x y) keeps the volume
    bent = np.where(component == 0, x[:, 0] ** 2, -2.0 * x[:, 0] * x[:, 1])
    energies = [system.algebra.dot(bent, system.K @ bent) for system in (full, bbar)]
    assert energies[1] < 0.1 * energies[0]


def test_stresses_stand_in_the_memory(comm: Any) -> None:
    """Cells of two materials, of which one never yields: names, shapes, numbers and places."""
    mesh, tags, _ = block(comm)
    cells = mesh.topology.index_map(2).size_local
    soft = fem.Cells.where("soft", mesh, lambda x: x[0] * np.cos(0.3) + x[1] * np.sin(0.3) < 1.01)
    hard = fem.Cells.where("hard", mesh, lambda x: x[0] * np.cos(0.3) + x[1] * np.sin(0.3) > 0.99)
    system = fem.assemble(
        mesh, [(soft, METAL), (hard, ELASTIC)], integration="bbar", clamped=tags["bottom"]
    )
    internal: Any = system.internal
    memory = internal.remember(wave(system, 2e-3))
    assert set(memory) == {
        "material_0_sigma",
        "material_0_alpha",
        "material_0_beta",
        "material_1_sigma",
    }
    counts = [memory[f"material_{k}_sigma"].shape[0] for k in (0, 1)]
    assert sum(counts) == cells
    assert len(internal.find_cells("material_0_sigma")) == counts[0]
    strong = np.abs(memory["material_1_sigma"]).max(initial=0.0)
    assert largest(system.algebra.comm, strong) > 1.5e6
    assert internal.fits(memory) and not internal.fits({})
    size = internal.bytes_per_point
    assert size < 2000.0


@pytest.mark.serial
def test_a_stress_at_the_start(comm: Any) -> None:
    """It is in the order xx, yy, zz, xy, and its forces are those of that stress."""
    mesh, tags, _ = block(comm)
    system = fem.assemble(
        mesh,
        SOIL,
        integration="bbar",
        initial_stress=lambda x: np.tile([-50e3, -60e3, -40e3, 5e3], (len(x), 1)),
    )
    internal: Any = system.internal
    u = np.zeros(system.rows)
    sigma = internal.remember(u)["material_0_sigma"]
    assert np.allclose(sigma[..., :3], [-50e3, -60e3, -40e3], rtol=1e-14)
    assert np.allclose(sigma[..., 3], ROOT * 5e3, rtol=1e-14)
    p = internal.force(u)
    x = system.space.coordinates
    component = system.space.ids % 2
    stretch = np.where(component == 1, x[:, 1], 0.0)
    assert p @ stretch == pytest.approx(-60e3 * 3.0, rel=1e-12)
    shear = np.where(component == 0, x[:, 1], 0.0)
    assert p @ shear == pytest.approx(5e3 * 3.0, rel=1e-12)


def test_a_stress_outside_of_the_surface_is_refused(comm: Any) -> None:
    mesh, _, _ = block(comm)
    with pytest.raises(
        InputError, match="outside of the yield surface of MohrCoulomb at .* points"
    ):
        fem.assemble(
            mesh,
            SOIL,
            integration="bbar",
            initial_stress=lambda x: np.tile([-50e3, -500e3, -50e3, 0.0], (len(x), 1)),
        )
    with pytest.raises(InputError, match="return finite numbers of shape"):
        fem.assemble(mesh, SOIL, integration="bbar", initial_stress=lambda x: x)


REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "plane stress": ({"section": vc.PlaneStress()}, "is for plane strain"),
    "selective": ({"integration": "selective"}, "give integration='bbar'"),
    "degree 2 and bbar": ({"integration": "bbar", "degree": 2}, "degree=2 does not lock"),
}


@pytest.mark.serial
@pytest.mark.parametrize("name", REFUSED)
def test_what_does_not_go_with_yielding_is_refused(comm: Any, name: str) -> None:
    mesh, _, _ = block(comm)
    more, sentence = REFUSED[name]
    with pytest.raises(InputError, match=sentence):
        fem.assemble(mesh, SOIL, **more)


@pytest.mark.serial
def test_more_that_is_refused(comm: Any) -> None:
    mesh, tags, _ = block(comm)
    triangles, _, _ = block(comm, "triangles")
    with pytest.raises(InputError, match="needs quadrilaterals or hexahedra"):
        fem.assemble(triangles, SOIL, integration="bbar")
    with pytest.raises(InputError, match="'bbar' is for materials that yield"):
        fem.assemble(mesh, ELASTIC, integration="bbar")
    with pytest.raises(InputError, match="initial_stress is for materials that yield"):
        fem.assemble(mesh, ELASTIC, initial_stress=lambda x: x)
    moved = fem.Prescribed(tags["bottom"], displacement=lambda x, t: t * x)
    with pytest.raises(InputError, match="supports that move"):
        fem.assemble(mesh, SOIL, integration="bbar", prescribed=moved)
    wood = Orthotropic(
        E1=1e9, E2=1e9, E3=1e9, nu12=0.2, nu13=0.2, nu23=0.2, G12=4e8, G13=4e8, G23=4e8, rho=500.0
    )
    left = fem.Cells.where("left", mesh, lambda x: x[0] * np.cos(0.3) + x[1] * np.sin(0.3) < 1.01)
    right = fem.Cells.where("right", mesh, lambda x: x[0] * np.cos(0.3) + x[1] * np.sin(0.3) > 0.99)
    with pytest.raises(InputError, match="does not go with Orthotropic"):
        fem.assemble(mesh, [(left, SOIL), (right, wood)])
    line, ends = fem.build_mesh(BlockMesh(lengths=(1.0,), divisions=(4,)), comm)
    with pytest.raises(InputError, match="is for plane strain"):
        fem.assemble(line, METAL)
    swelling = fem.InitialStrain(1e-3)
    with pytest.raises(InputError, match="InitialStrain does not go"):
        fem.assemble(mesh, SOIL, integration="bbar", loads=swelling)


@pytest.mark.serial
@pytest.mark.parametrize(
    ("kind", "integration", "warned"),
    [
        ("triangles", "full", "degree=2"),
        ("quadrilaterals", "full", "bbar"),
        ("quadrilaterals", "bbar", ""),
        ("triangles of degree 2", "full", ""),
    ],
)
def test_cells_that_lock_are_told(
    comm: Any, caplog: Any, kind: str, integration: str, warned: str
) -> None:
    mesh, _, degree = block(comm, kind)
    with caplog.at_level(logging.WARNING):
        fem.assemble(mesh, SOIL, degree=degree, integration=integration)
    told = [record.getMessage() for record in caplog.records if "lock" in record.getMessage()]
    assert bool(told) == bool(warned) and all(warned in sentence for sentence in told)


@pytest.mark.serial
def test_the_fit_of_a_cone_is_named(comm: Any) -> None:
    mesh, _, _ = block(comm)
    cone = DruckerPrager(50e6, 0.3, 1900.0, 10e3, 30.0, 10.0)
    system = fem.assemble(mesh, cone, integration="bbar")
    assert any("plane strain" in note for note in system.notes)


@pytest.mark.serial
def test_iwan_has_the_stiffness_of_its_table(comm: Any) -> None:
    mesh, tags, _ = block(comm)
    law = Iwan(2.6e8, 0.3, 2000.0, [(1e-4, 0.9), (1e-3, 0.5)])
    system = fem.assemble(mesh, law, integration="bbar", clamped=tags["bottom"])
    internal: Any = system.internal
    u = wave(system, 1e-9)
    assert apart(system, internal.force(u), system.K @ u) <= 1e-12
