"""What was made for what: groups and their mesh, surfaces and their system, states and their
problem, motions and the steps they were computed with, outputs and the matrices they go by. Refused
on every rank, with one sentence."""

from __future__ import annotations

import json
import logging
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from chain import chain_problem
from fem_problems import block
from mpi4py import MPI

import vi_contact as vc
from demos.parts.problems.geometric_stiffness import geometric_stiffness
from vi_contact import fem, soil
from vi_contact.core.algebra import Array, SerialMatrix
from vi_contact.core.errors import InputError, StepFailure

COMM = MPI.COMM_WORLD
STEEL = vc.LinearElastic(E=2.0e9, nu=0.3, rho=2000.0)
SHAKE = vc.Ricker(1.0, 5.0)
DT = 2e-3


def body(divisions: tuple[int, int] = (4, 4)) -> tuple[Any, Any]:
    return block(COMM, lengths=(1.0, 1.0), divisions=divisions)


def test_numbers_of_no_facet_are_refused_on_all_ranks() -> None:
    """One rank only has them; the others hear of it too. PETSc would end the process."""
    mesh, _ = body()
    for wrong in (10**6, -1):
        mine = np.array([wrong if COMM.rank == COMM.size - 1 else 0])
        for kind in (fem.Facets, fem.Cells):
            with pytest.raises(
                InputError,
                match=f"{kind.__name__}: 'a' has numbers from .* give numbers of this mesh",
            ):
                kind("a", mine, mesh)
    # a rank may have none, whatever their type
    here = np.array([0]) if COMM.rank == 0 else np.zeros(0)
    assert fem.Facets("a", np.tile(here, 2), mesh).indices.dtype == np.int32


def test_other_displacements_on_the_same_facets() -> None:
    """Also where they meet on the facets of one rank only; at edges the later condition counts, as
    it always did."""
    mesh, tags = body()
    bottom, left = tags["bottom"], tags["left"]
    moved = fem.Prescribed(bottom, (1.0, 0.0))
    shared = fem.Facets("shared", bottom.indices if COMM.rank == 0 else bottom.indices[:0], mesh)
    for conditions in (
        {"clamped": bottom, "prescribed": moved},
        {"prescribed": [moved, fem.Prescribed(bottom)]},
    ):
        with pytest.raises(
            InputError, match="'bottom' and 'bottom' share facets on which different displacements"
        ):
            fem.assemble(mesh, STEEL, **conditions)
    if COMM.allreduce(len(shared.indices)):
        with pytest.raises(InputError, match="'shared' and 'bottom' share facets"):
            fem.assemble(mesh, STEEL, clamped=shared, prescribed=moved)
    across = [
        fem.Prescribed(bottom, (1.0, 0.0), components=(0,)),
        fem.Prescribed(bottom, (0.0, 2.0), components=(1,)),
    ]
    for right in (
        across,
        [moved, replace(moved)],
        [fem.Prescribed(left), moved],
        fem.Prescribed(bottom, (0.0, 0.0)),
    ):
        fem.assemble(
            mesh,
            STEEL,
            clamped=bottom if isinstance(right, fem.Prescribed) else (),
            prescribed=right,
        )


def test_a_surface_belongs_to_the_systems_of_its_space() -> None:
    """It follows loads, weight, stiffness and initial values, and no other clamp: there its
    unknowns are others."""
    mesh, tags = body()
    system, other = (fem.assemble(mesh, STEEL, clamped=tags[name]) for name in ("bottom", "left"))
    surface = fem.contact_surface(system, tags["right"])
    for same in (
        vc.with_weight(system),
        system.with_load((system.u0, np.sin)),
        replace(system, v0=system.v0 + 1.0),
    ):
        vc.ContactProblem(same, surface.bilateral_everywhere().on_springs(1e9))
    with pytest.raises(InputError, match="contact surface was made for another system"):
        vc.ContactProblem(other, surface)


def test_a_state_belongs_to_its_problem() -> None:
    """Sizes differ on one rank only; all ranks refuse."""
    mesh, tags = body()
    system = fem.assemble(mesh, STEEL, clamped=tags["bottom"])
    problem = vc.ContactProblem(system, fem.contact_surface(system, tags["right"]))
    state = next(vc.march(problem, dt=DT, steps=1))[0]
    short = replace(state, v=state.v[:-1]) if COMM.rank == COMM.size - 1 else state
    for wrong, words in (
        (short, "has v of shape"),
        (replace(state, active=state.active[:-1]), "has active of shape"),
    ):
        with pytest.raises(InputError, match=words):
            vc.march(problem, dt=DT, steps=1, state=wrong)
        with pytest.raises(InputError, match=words):
            vc.simulate(problem, dt=DT, steps=1, state=wrong, progress=False)


@pytest.mark.serial
def test_a_start_inside_the_obstacle() -> None:
    """Refused, but for what a scheme leaves there that stops velocities: it may go on from states
    of its own runs."""
    problem = chain_problem(3, gap=0.1, v0=[1.0, 1.0, 1.0])
    scheme = vc.MoreauJean()
    for state, report in vc.march(problem, scheme=scheme, dt=1e-2, steps=30):
        gap = 0.1 - state.u[2]
        if report.new.active.any():
            break
    assert gap < 0.0
    vc.march(problem, scheme=scheme, dt=1e-2, steps=1, state=state)
    metre = replace(state, k=0, u=state.u + 1.0)
    for wrong, other in ((state, vc.ZienkiewiczWoodTaylor()), (metre, scheme), (metre, None)):
        with pytest.raises(InputError, match=r"the state is .* m inside the obstacle at \(3\)"):
            vc.march(problem, scheme=other, dt=1e-2, steps=1, state=wrong)
    sprung = replace(problem, surface=problem.surface.on_springs(1e6))
    vc.march(sprung, dt=1e-2, steps=1, state=metre, scheme=vc.Midpoint())


@pytest.mark.slow
def test_motions_beside_a_run_are_marched_with_its_scheme_and_steps() -> None:
    """base_motion, as prescribed motion and as an obstacle that goes along, and FreeField, also
    behind other loads: two runs of one problem with other schemes or steps, at once, are those of
    two problems, to the last bit."""
    mesh, tags = body()

    def problems() -> list[vc.ContactProblem]:
        ground = soil.base_motion(SHAKE)
        moved = fem.Prescribed(
            tags["bottom"], ground.displacement, ground.velocity, ground.acceleration
        )
        sides = [soil.FreeField(tags[side], base=ground) for side in ("left", "right")]
        system = fem.assemble(mesh, STEEL, prescribed=moved, dashpots=sides)
        system = vc.with_weight(system).with_load((np.zeros_like(system.u0), np.sin))
        alone = fem.assemble(mesh, STEEL, clamped=tags["bottom"])
        carried = ground.carrying(fem.contact_surface(alone, tags["top"]), alone)
        return [
            vc.ContactProblem(system, fem.contact_surface(system, tags["top"])),
            vc.ContactProblem(alone, fem.joined_surfaces(carried)),
        ]

    def runs(one: vc.ContactProblem, other: vc.ContactProblem) -> list[Array]:
        marches = (
            vc.march(one, scheme=vc.HHT(), dt=DT, steps=6),
            vc.march(other, scheme=vc.Newmark(), dt=2 * DT, steps=6),
        )
        return [np.array([state.u for state, _ in pair]) for pair in zip(*marches, strict=True)]

    for one, other in zip(problems(), problems(), strict=True):
        assert {beside.name for beside in (*one.system.companions, *one.surface.companions)} >= {
            "base_motion"
        }
        np.testing.assert_array_equal(runs(one, one), runs(one, other))
        with pytest.raises(InputError, match="needs its time steps beforehand"):
            vc.march(one, scheme=vc.HHT(), dt=vc.HalvedAtImpact(DT), steps=1)


@pytest.mark.slow
def test_outputs_say_when_the_matrices_are_not_of_their_materials(
    caplog: pytest.LogCaptureFixture, shared_tmp: Path
) -> None:
    """Twice the stiffness: stresses and reactions go by the material of fem.assemble, and say so on
    rank 0."""
    mesh, tags = body()
    system = fem.assemble(mesh, STEEL, clamped=tags["bottom"], loads=fem.BodyForce((0.0, -1.0)))
    surface = fem.contact_surface(system, tags["right"])
    problem = vc.ContactProblem(system, surface)
    stiffer = replace(system, K=system.algebra.combine([(2.0, system.K)]))
    state = next(vc.march(problem, dt=DT, steps=1))[0]
    record = [fem.Reactions("base", tags["bottom"], (0.0, 0.0), gravity=(0.0, 1.0))]
    leaning = geometric_stiffness(problem, state)
    words = "K of the system is not the one that fem.assemble made"
    for one, told in ((system, 0), (leaning, 0), (vc.with_weight(system), 0), (stiffer, 1)):
        caplog.clear()
        with caplog.at_level(logging.WARNING):
            vc.simulate(
                vc.ContactProblem(one, surface),
                dt=DT,
                steps=1,
                record=record,
                out=shared_tmp / "run",
                progress=False,
                fields=fem.XDMF(),
            )
        found = [text for text in caplog.messages if "reactions" in text and words in text]
        assert len(found) == (told if COMM.rank == 0 else 0)
        assert (shared_tmp / "run" / "run.log").read_text().count(
            f"XDMF, von_mises: {words}"
        ) == told


@pytest.mark.serial
def test_row_sums_that_are_no_masses() -> None:
    """A consistent mass of elements of order two has row sums below zero: lumped, it would
    explode."""
    problem = chain_problem(4)
    M = sp.diags([-0.55, 1.0, -0.55], [-1, 0, 1], shape=(4, 4))
    system = replace(problem.system, M=SerialMatrix(M))
    with pytest.raises(
        InputError,
        match=r"cannot lump negative row sums of M and 2 unknowns have them: .*lumping=0",
    ):
        vc.march(replace(problem, system=system, mass=vc.Redistributed()), dt=1e-2, steps=1)


@pytest.mark.serial
def test_numbers_beyond_those_of_the_machine(tmp_path: Path) -> None:
    """A run that overflows fails: its ledger would be NaN with the status of a run that went
    well."""
    problem = chain_problem(
        3, gap=inf, excitation=vc.Harmonic(1e300, 1.0, phase=1.0, direction=(1.0,))
    )
    with pytest.raises(StepFailure, match="step 1 at t = 0.01 s: energy_kinetic is inf, too large"):
        vc.simulate(problem, dt=1e-2, steps=3, out=tmp_path, progress=False)
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["status"] == "failed" and "check the sizes and units" in summary["reason"]


@pytest.mark.serial
def test_what_a_users_function_returns_is_looked_at() -> None:
    """Loads, motions and obstacles of one's own: real numbers of the right shape."""
    mesh, tags = body()

    def texts(x: Array, t: float) -> Any:
        return np.full(x.shape, "a")

    for field in (texts, lambda x, t: 1j * x, lambda x, t: None):
        with pytest.raises(InputError, match=r"BodyForce returned .*return real numbers"):
            next(
                vc.march(
                    vc.ContactProblem(*_touching(mesh, tags, fem.BodyForce(field))), dt=DT, steps=1
                )
            )


def _touching(mesh: Any, tags: Any, load: Any) -> tuple[Any, Any]:
    system = fem.assemble(mesh, STEEL, clamped=tags["bottom"], loads=load)
    return system, fem.contact_surface(system, tags["right"])
