"""Nearly incompressible bodies of quadrilaterals and hexahedra: Cook's membrane free and against a
stop, patch test, rigid motions only without energy, damping, section forces and stresses of the
same forms, refusals and the warning."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fem_problems import BODIES, block, linear, max_over_ranks, nodal
from mpi4py import MPI

import vi_contact as vc
from demos.parts.problems.geometric_stiffness import initial_stress_matrix
from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.fem.petsc_algebra import PetscMatrix, as_petsc
from vi_contact.meshes.block import BlockMesh

COMM = MPI.COMM_WORLD
NEARLY = vc.LinearElastic(E=1.0, nu=0.4999, rho=1.0)
TIP, F = (48.0, 60.0), 1.0 / 16.0
# of the corner: Aitken's limits of 16, 32, 64 cells a side, of Q2 and P2 (± 0.02)
LIMIT = {0.3: 23.05, 0.4999: 19.42}


def cook(nu: float, n: int, simplices: bool = False, **data: Any) -> tuple[Any, Any, Any]:
    """(system, mesh groups, load) of Cook's membrane in plane strain, E = 1, a shear force of 1 on
    its right end."""

    def deform(x: np.ndarray) -> np.ndarray:
        return np.column_stack([48.0 * x[:, 0], 44.0 * x[:, 0] + x[:, 1] * (44.0 - 28.0 * x[:, 0])])

    mesh, tags = fem.build_mesh(
        BlockMesh(divisions=(n, n), simplices=simplices, deform=deform), COMM
    )
    load = fem.Traction(tags["right"], (0.0, F))
    material = vc.LinearElastic(E=1.0, nu=nu, rho=1.0)
    return fem.assemble(mesh, material, clamped=tags["left"], loads=load, **data), tags, load


def deflection(system: Any, state: Any) -> float:
    space = system.space
    return float(space.sample(state.u, space.find_nodes(np.array([TIP])), 0.0)[0, 1])


@pytest.mark.two_ranks
@pytest.mark.parametrize(
    ("nu", "integration", "low", "high"),
    [
        (0.3, "full", 0.94, 0.98),
        (0.3, "selective", 0.96, 0.99),
        (0.4999, "full", 0.2, 0.4),
        (0.4999, "selective", 0.96, 0.99),
    ],
)
def test_cooks_membrane(nu: float, integration: str, low: float, high: float) -> None:
    """16 cells a side: 0.962, 0.973, 0.298 and 0.972 of the converged deflection of the corner."""
    system, _, _ = cook(nu, 16, integration=integration)
    state = vc.static_equilibrium(linear(system), solver=vc.Condensed())
    assert low < deflection(system, state) / LIMIT[nu] < high


@pytest.mark.two_ranks
@pytest.mark.parametrize("nu", [0.3, 0.4999])
@pytest.mark.parametrize(
    "data",
    [{}, {"integration": "selective"}, {"degree": 2, "simplices": True}],
    ids=["Q1", "selective", "P2"],
)
def test_cooks_membrane_against_a_stop(nu: float, data: dict[str, Any]) -> None:
    """The corner is stopped half way: the force is (free deflection - gap) / (deflection under a
    unit force there)."""
    system, tags, _ = cook(nu, 8, **data)
    free = deflection(system, vc.static_equilibrium(linear(system), solver=vc.Condensed()))
    stop = fem.contact_surface(
        system,
        tags["top"],
        points=[TIP],
        obstacle=vc.HalfSpace((0.0, TIP[1] + 0.5 * free), (0.0, -1.0)),
    )
    state = vc.static_equilibrium(vc.ContactProblem(system, stop))
    unit = stop.reaction_load(np.ones(stop.count), system.rows)
    softness = system.algebra.dot(unit, system.algebra.factor(system.K).solve(unit))
    force = stop.comm.sum(np.array([state.r_n.sum()]))[0]
    assert force == pytest.approx(0.5 * free / softness, rel=1e-9)
    assert deflection(system, state) == pytest.approx(0.5 * free, rel=1e-12)


@pytest.mark.parametrize("d", [2, 3])
def test_patch_and_rank_on_distorted_cells(d: int) -> None:
    """A uniform strain leaves inner nodes without force, and only rigid motions have no energy."""

    def deform(x: np.ndarray) -> np.ndarray:
        return (
            x
            + 0.15 * np.sin(2.0 * np.pi * x) * np.roll(np.cos(2.0 * x), 1, axis=1)
            + 0.1 * x * x.sum(1)[:, None]
        )

    mesh, _ = block(COMM, lengths=(1.0,) * d, divisions=(4, 3, 3)[:d], deform=deform)
    system = fem.assemble(mesh, NEARLY, integration="selective")
    strain = np.array([[0.3, 0.7, -0.2], [0.1, -0.5, 0.4], [0.6, 0.2, 0.9]])[:d, :d]
    force = (system.K @ nodal(system, lambda x: x @ strain)).reshape(-1, d)
    inner = np.setdiff1d(
        np.arange(len(system.space.points)), system.space.facet_blocks(outer_facets(mesh))
    )
    assert max_over_ranks(COMM, force[inner].ravel()) < 1e-12 * max_over_ranks(COMM, force.ravel())
    one, _ = block(MPI.COMM_SELF, lengths=(1.0,) * d, divisions=(1,) * d, deform=deform)
    energies = np.linalg.eigvalsh(
        as_petsc(fem.assemble(one, NEARLY, integration="selective").K).mat[:, :]
    )
    rigid = d * (d + 1) // 2
    assert np.all(np.abs(energies[:rigid]) < 1e-12 * energies[-1])
    assert energies[rigid] > 1e-6 * energies[-1]


def outer_facets(mesh: Any) -> np.ndarray:
    """Return the outer facets of this rank."""
    mesh.topology.create_connectivity(mesh.topology.dim - 1, mesh.topology.dim)
    from dolfinx.mesh import exterior_facet_indices

    return np.asarray(exterior_facet_indices(mesh.topology))


@pytest.mark.parametrize("name", ["quadrilaterals", "hexahedra"])
def test_damping_and_stresses_are_of_the_same_forms(name: str) -> None:
    """C = beta K; the stress of a uniform strain, in the geometric stiffness, is that of full
    integration."""
    mesh, _ = block(COMM, **BODIES[name])
    full, selective = (
        fem.assemble(mesh, NEARLY, integration=one, damping=vc.Rayleigh(0.0, 0.25))
        for one in ("full", "selective")
    )
    x = nodal(full, lambda points: points * np.sin(3.0 * points[:, ::-1]))
    assert max_over_ranks(
        COMM, selective.C @ x - 0.25 * (selective.K @ x)
    ) < 1e-13 * max_over_ranks(COMM, x)
    assert max_over_ranks(COMM, selective.K @ x - full.K @ x) > 0.02 * max_over_ranks(
        COMM, selective.K @ x
    )
    stretched = full.space.points * np.array([1.0, -0.5, 0.3])[: full.space.dimension]
    forces = [
        PetscMatrix(initial_stress_matrix(one.space, stretched)) @ x for one in (full, selective)
    ]
    assert max_over_ranks(COMM, forces[0] - forces[1]) < 1e-11 * max_over_ranks(COMM, forces[0])


def test_section_forces_are_those_of_the_load() -> None:
    """Force through a cut across Cook's membrane and at its clamped end: the load, to round-off."""
    system, tags, load = cook(0.4999, 6, integration="selective")
    problem = linear(system)
    state = vc.static_equilibrium(problem, solver=vc.Condensed())
    row = fem.SectionForces({"a": ((24.0, 22.0), (24.0, 52.0))}, loads=load).start(problem, state)
    held = fem.Reactions("end", tags["left"], (0.0, 0.0), load).start(problem, state)
    assert abs(row["V_a"]) == pytest.approx(1.0, rel=1e-9)
    assert held["reaction_y_end"] == pytest.approx(-1.0, rel=1e-9)


@pytest.mark.two_ranks
@pytest.mark.parametrize(
    ("name", "data", "message"),
    [
        ("triangles", {"integration": "selective"}, "take degree=2"),
        ("tetrahedra", {"integration": "selective"}, "take degree=2"),
        ("bar", {"integration": "selective"}, "needs quadrilaterals or hexahedra"),
        ("quadrilaterals", {"integration": "reduced"}, "choose one of full, selective"),
        ("quadrilaterals", {"integration": None}, "choose one of full, selective"),
        (
            "quadrilaterals",
            {"integration": "selective", "section": vc.PlaneStress()},
            "nor plane stress locks",
        ),
        ("hexahedra", {"integration": "selective", "degree": 2}, "neither degree=2"),
        (
            "hexahedra",
            {"integration": "selective", "damping": vc.KelvinVoigt(1.0, 1.0)},
            "without KelvinVoigt",
        ),
    ],
)
def test_wrong_uses_are_refused(name: str, data: dict[str, Any], message: str) -> None:
    mesh, _ = block(COMM, **BODIES[name])
    with pytest.raises(InputError, match=message):
        fem.assemble(mesh, NEARLY, **data)


@pytest.mark.serial
def test_the_warning_names_the_remedy(caplog: pytest.LogCaptureFixture) -> None:
    mesh, _ = block(COMM, **BODIES["quadrilaterals"])
    fem.assemble(mesh, NEARLY, integration="selective")
    fem.assemble(mesh, NEARLY, degree=2)
    assert "locks" not in caplog.text
    fem.assemble(mesh, NEARLY)
    assert "integration='selective'" in caplog.text
