"""Assembly: masses, stiffnesses and damping against exact values in 1D, 2D and 3D; floating bodies;
static stages."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fem_problems import BODIES, CONCRETE, block, dense, field, linear, max_over_ranks, nodal
from mpi4py import MPI

from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.core.system import SemiDiscreteSystem
from vi_contact.fem import compat
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import BodyForce, Prescribed, Traction
from vi_contact.fem.mesh.tagged_mesh import Cells
from vi_contact.laws.materials import (
    LinearElastic,
    MassProportional,
    PlaneStrain,
    PlaneStress,
    Rayleigh,
)
from vi_contact.run.march import march
from vi_contact.run.static import static_equilibrium
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed

COMM = MPI.COMM_WORLD
bodies = pytest.mark.parametrize("name", BODIES)


def free_body(name: str, **data: Any) -> SemiDiscreteSystem:
    mesh, _ = block(COMM, **BODIES[name])
    return assemble(mesh, CONCRETE, **data)


def rotations(d: int) -> list:
    """Infinitesimal rotations x -> omega × x."""
    turns = []
    for i in range(d):
        for j in range(i + 1, d):
            W = np.zeros((d, d))
            W[i, j], W[j, i] = -1.0, 1.0
            turns.append(lambda x, W=W: x @ W.T)
    return turns


# Mass and stiffness
# --------------------------------------------------------------------------------------------------


@pytest.mark.two_ranks
@bodies
def test_rigid_modes_have_no_strain_energy(name):
    """K r = 0 for every translation and rotation, relative to the forces that single entries of K
    would make."""
    system = free_body(name)
    d = system.space.dimension
    modes = [nodal(system, lambda x, i=i: np.tile(np.eye(d)[i], (len(x), 1))) for i in range(d)]
    modes += [nodal(system, turn) for turn in rotations(d)]
    stiffest = max_over_ranks(COMM, system.K.diagonal())
    for mode in modes:
        assert max_over_ranks(COMM, system.K @ mode) < 1e-12 * stiffest * max_over_ranks(COMM, mode)
        assert abs(system.strain_energy(mode)) < 1e-12 * stiffest * max_over_ranks(COMM, mode) ** 2


@bodies
def test_mass_of_rigid_motions(name):
    """½ rᵀMr: the whole mass in translation, the exact moment of inertia in rotation (linear fields
    are exact)."""
    system = free_body(name)
    d = system.space.dimension
    lengths = np.array(BODIES[name]["lengths"])
    mass = CONCRETE.rho * lengths.prod()
    for i in range(d):
        assert 2.0 * system.kinetic_energy(system.influence[:, i]) == pytest.approx(mass, rel=1e-13)
    # ∫ rho x xᵀ, before turning
    second = mass * (np.diag(lengths**2) / 12.0 + np.outer(lengths, lengths) / 4.0)
    for turn in rotations(d):
        W = turn(np.eye(d)).T
        c, s = np.cos(BODIES[name].get("angle", 0.0)), np.sin(BODIES[name].get("angle", 0.0))
        R = np.eye(d)
        R[:2, :2] = [[c, -s], [s, c]]
        expected = np.trace(W @ R @ second @ R.T @ W.T)
        assert 2.0 * system.kinetic_energy(nodal(system, turn)) == pytest.approx(
            expected, rel=1e-12
        )


@pytest.mark.two_ranks
@pytest.mark.parametrize(
    "section, thickness", [(PlaneStress(0.2), 0.2), (PlaneStrain(3.0), 3.0), (None, 1.0)]
)
def test_thickness_multiplies_all_integrals(section, thickness):
    """M, K, C and loads of a section are its thickness times those of unit thickness; plane strain
    is the default."""
    mesh, tags = block(COMM, **BODIES["quadrilaterals"])
    unit = PlaneStress(1.0) if isinstance(section, PlaneStress) else PlaneStrain(1.0)
    data = {
        "loads": [Traction(tags["top"], (1.0, 2.0)), BodyForce((0.0, -3.0))],
        "damping": Rayleigh(0.3, 1e-3),
        "clamped": tags["bottom"],
    }
    thick, thin = (assemble(mesh, CONCRETE, section=one, **data) for one in (section, unit))
    for matrix in "MKC":
        a, b = (dense(COMM, system, getattr(system, matrix)) for system in (thick, thin))
        assert np.abs(a - thickness * b).max() < 1e-13 * np.abs(a).max()
    assert max_over_ranks(
        COMM, thick.load(0.0) - thickness * thin.load(0.0)
    ) < 1e-13 * max_over_ranks(COMM, thick.load(0.0))


@pytest.mark.parametrize("simplices", [False, True])
@pytest.mark.parametrize(
    "section, lengths",
    [("stress", (3.0, 0.5)), ("strain", (3.0, 0.5)), ("solid", (3.0, 0.5, 0.4)), ("bar", (3.0,))],
)
def test_uniaxial_bar(section, lengths, simplices):
    """u = sigma x / E', lateral contraction nu' y, rollers on the sides at zero (exact, it is
    linear).

    E' = E in plane stress and in 3D, E/(1 - nu²) in plane strain, lambda + 2 mu in 1D.
    """
    d = len(lengths)
    mesh, tags = block(COMM, lengths=lengths, divisions=(4, 2, 2)[:d], simplices=simplices)
    sections = {"stress": PlaneStress(0.2), "strain": PlaneStrain(0.7)}
    rollers = [
        Prescribed(tags[side], components=(i,))
        for i, side in enumerate(("left", "bottom", "back")[:d])
    ]
    sigma = 4.0e6
    end = Traction(tags["right"], tuple(sigma * np.eye(d)[0]))
    system = assemble(mesh, CONCRETE, section=sections.get(section), prescribed=rollers, loads=end)
    E, nu = CONCRETE.E, CONCRETE.nu
    modulus = {
        "strain": E / (1.0 - nu**2),
        "bar": CONCRETE.lame_lambda + 2.0 * CONCRETE.shear_modulus,
    }.get(section, E)
    contraction = {"strain": nu / (1.0 - nu), "bar": 0.0}.get(section, nu)
    u = system.algebra.factor(system.K).solve(system.load(0.0))
    points, values = field(system, u)
    strain = sigma / modulus * np.array([1.0, -contraction, -contraction])[:d]
    assert np.abs(values - points * strain).max() < 1e-12 * np.abs(values).max()


@pytest.mark.two_ranks
def test_two_materials_in_series():
    """Two halves of a bar share the stress; their elongations and masses add. Cells are chosen by
    position."""
    mesh, tags = block(COMM, lengths=(2.0, 1.0), divisions=(4, 3))
    soft, hard = (
        LinearElastic(E=1.0e9, nu=0.0, rho=1000.0),
        LinearElastic(E=4.0e9, nu=0.0, rho=3000.0),
    )
    middles = mesh.geometry.x[compat.geometry_dofmap(mesh)].mean(axis=1)[:, 0]
    halves = [
        (Cells("soft", np.flatnonzero(middles < 1.0).astype(np.int32), mesh), soft),
        (Cells("hard", np.flatnonzero(middles > 1.0).astype(np.int32), mesh), hard),
    ]
    whole = assemble(mesh, halves)
    assert 2.0 * whole.kinetic_energy(whole.influence[:, 0]) == pytest.approx(4000.0, rel=1e-13)
    system = assemble(
        mesh, halves, clamped=tags["left"], loads=Traction(tags["right"], (2.0e6, 0.0))
    )
    points, values = field(system, system.algebra.factor(system.K).solve(system.load(0.0)))
    x = points[:, 0]
    expected = np.where(x <= 1.0, 2.0e-3 * x, 2.0e-3 + 0.5e-3 * (x - 1.0))
    assert np.abs(values - np.column_stack([expected, 0.0 * x])).max() < 1e-12 * expected.max()
    with pytest.raises(InputError, match="6 cells have more than one material"):
        assemble(mesh, [*halves, halves[0]])
    with pytest.raises(InputError, match="6 cells have no material: give a"):
        assemble(mesh, halves[:1])


# Damping
# --------------------------------------------------------------------------------------------------


@pytest.mark.two_ranks
def test_rayleigh_damping():
    """C = alpha M + beta K."""
    system = free_body("triangles", damping=Rayleigh(alpha=0.7, beta=2.0e-3))
    x = nodal(system, lambda x: np.sin(5.0 * x) + x[:, ::-1] ** 2)
    expected = 0.7 * (system.M @ x) + 2.0e-3 * (system.K @ x)
    assert max_over_ranks(COMM, system.C @ x - expected) < 1e-13 * max_over_ranks(COMM, expected)


@pytest.mark.two_ranks
def test_mass_proportional_damping_is_a_force_per_volume():
    """c u' in the equation of motion (eq. 7): C = c/rho M; without damping there is no C at all."""
    system = free_body("hexahedra", damping=MassProportional(c=480.0))
    x = nodal(system, np.cos)
    expected = 480.0 / CONCRETE.rho * (system.M @ x)
    assert max_over_ranks(COMM, system.C @ x - expected) < 1e-13 * max_over_ranks(COMM, expected)
    assert free_body("hexahedra").C is None


# Static and gravity stages
# --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "sides, floating",
    [
        ({}, True),
        ({"bottom": None}, False),
        ({"left": (0,)}, True),  # slides along y
        ({"left": (0,), "bottom": (1,)}, False),
        ({"left": (0,), "right": (0,)}, True),
        ({"left": (0, 1)}, False),
        ({"bottom": (0,), "left": (1,)}, True),  # turns about their common corner
        ({"bottom": (0,), "left": (1,), "top": (1,)}, False),
    ],
)
def test_floating_in_the_plane(sides, floating):
    """Whether some rigid motion is left by the prescribed components, at any scale."""
    for size in (1.0, 1e-6, 1e5):
        mesh, tags = block(COMM, lengths=(2.0 * size, size), divisions=(2, 3))
        system = assemble(
            mesh, CONCRETE, prescribed=[Prescribed(tags[s], components=c) for s, c in sides.items()]
        )
        assert system.floating is floating


@pytest.mark.parametrize(
    "sides, floating",
    [
        ({"left": (0,), "bottom": (1,)}, True),  # slides along z
        ({"left": (0,), "bottom": (1,), "back": (2,)}, False),
        ({"bottom": (1,)}, True),
        ({"bottom": (0, 1)}, True),
        ({"bottom": (0, 2), "left": (1, 2)}, True),  # turns about their common edge
        ({"back": None}, False),
    ],
)
def test_floating_in_space(sides, floating):
    mesh, tags = block(COMM, lengths=(2.0, 1.0, 3.0), divisions=(1, 2, 2))
    system = assemble(
        mesh, CONCRETE, prescribed=[Prescribed(tags[s], components=c) for s, c in sides.items()]
    )
    assert system.floating is floating


def test_static_stage_is_the_start_of_an_equilibrium():
    """A clamped block under its weight, without contact: the dynamic stage that continues stays
    still."""
    mesh, tags = block(COMM, lengths=(1.0, 2.0), divisions=(3, 5))
    weight = BodyForce((0.0, -CONCRETE.rho * 9.80665))
    problem = linear(
        assemble(mesh, CONCRETE, clamped=tags["bottom"], loads=weight, damping=Rayleigh(0.1, 1e-4))
    )
    start = static_equilibrium(problem, solver=Condensed())
    sag = max_over_ranks(COMM, start.u)
    for state, _ in march(
        problem, scheme=ZienkiewiczWoodTaylor(), solver=Condensed(), dt=1e-3, steps=20, state=start
    ):
        assert max_over_ranks(COMM, state.u - start.u) < 1e-12 * sag
        assert max_over_ranks(COMM, state.v) * 1e-3 < 1e-12 * sag


def test_assemble_stays_a_function() -> None:
    """``fem.assemble`` is the function also after its module was imported: they must not share a
    name."""
    assert callable(fem.assemble)
    assert all(callable(getattr(fem, name)) for name in fem.__all__)


@pytest.mark.serial
def test_nearly_incompressible_materials_are_told(
    comm: Any, caplog: pytest.LogCaptureFixture
) -> None:
    """They lock first-order cells but in plane stress."""
    mesh, tags = block(comm)
    nearly = LinearElastic(E=1.0, nu=0.4999, rho=1.0)
    assemble(mesh, nearly, section=PlaneStress(), clamped=tags["bottom"])
    assert not caplog.records
    assemble(mesh, nearly, clamped=tags["bottom"])
    assert "Poisson's ratio 0.4999 locks first-order cells" in caplog.text
