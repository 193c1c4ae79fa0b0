"""Traction and slip per point of static states, and shares of friction in summaries, against closed
forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from column import rubbing_mass
from fem_problems import block

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.errors import InputError

MU, PRESSURE, G = 0.4, 3.0e5, 1.0e9 / 2.4


def sheared(comm: Any, share: float, **spec: Any) -> Any:
    """A block that is pressed on a rough plane by PRESSURE, then sheared by ``share`` of its
    friction; all of it in a uniform stress, as nothing keeps it from widening (nu = 0)."""
    mesh, tags = block(comm, lengths=(2.0, 1.0), divisions=(6, 3), **spec)
    material = vc.LinearElastic(E=2.0 * G, nu=0.0, rho=2000.0)
    angle = spec.get("angle", 0.0)
    normal = np.array([-np.sin(angle), np.cos(angle)])
    along = np.array([normal[1], -normal[0]])
    shear = share * MU * PRESSURE

    def loads(t: float) -> float:
        return min(t, 1.0)

    # sigma = t (along normal + normal along) - p normal normal acts on the three free sides
    stress = shear * (np.outer(along, normal) + np.outer(normal, along))
    tractions = [
        fem.Traction(tags["top"], tuple(-PRESSURE * normal)),
        *(
            fem.Traction(tags[side], tuple(stress @ outward), history=loads)
            for side, outward in (("top", normal), ("right", along), ("left", -along))
        ),
    ]
    system = fem.assemble(mesh, material, loads=tractions)
    plane = vc.HalfSpace(point=(0.0, 0.0), normal=tuple(normal))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=plane)
    return vc.ContactProblem(system, surface, friction=vc.Coulomb(MU)), along, normal, shear


@pytest.mark.parametrize("angle", [0.0, 0.5])
def test_uniform_stress_gives_uniform_tractions(comm: Any, angle: float) -> None:
    """p = PRESSURE and t = share mu p at every point, along the plane; nothing slips, and the
    friction is used by its share. The slope of the plane turns the vectors alone."""
    problem, along, normal, shear = sheared(comm, 0.6, angle=angle)
    pressed, moved = list(vc.quasi_static(problem, [0.0, 1.0]))
    found = vc.contact_values(problem, moved, since=pressed)
    assert found.points.shape == (7, 2)
    assert np.allclose(found.normals, -normal)
    assert np.allclose(found.pressure, PRESSURE, rtol=1e-9)
    assert np.allclose(found.traction, shear * along, atol=1e-7 * shear)
    assert np.allclose(found.limit, MU * PRESSURE, rtol=1e-9)
    assert np.allclose(found.used, 0.6, rtol=1e-7)
    assert np.abs(found.slip).max() < 1e-15
    assert found.active.all() and np.abs(found.gap).max() < 1e-15
    assert float(found.weights.sum()) == pytest.approx(2.0)


def test_a_spring_beyond_its_friction_tells_slip_and_traction() -> None:
    """Mass on a spring: K (u0 - s) = mu N, so that it slips by s towards rest, and T = mu N."""
    problem = rubbing_mass(u0=0.0, friction=vc.Coulomb(1.0))
    pulls = [0.0, 0.5, 3.0]
    problem = vc.ContactProblem(
        problem.system.with_load((np.array([1.0, 0.0]), lambda t: pulls[round(t)])),
        problem.surface,
        friction=vc.Coulomb(1.0),
    )
    still, stuck, slid = vc.quasi_static(problem, [0.0, 1.0, 2.0], solver=vc.Condensed())
    found = vc.contact_values(problem, stuck)
    assert found.slip.tolist() == [[0.0, 0.0]]
    assert found.used == pytest.approx([0.5], rel=1e-12)
    found = vc.contact_values(problem, slid, since=stuck)
    weight = found.weights[0]
    assert np.allclose(found.slip, [[2.0e-4, 0.0]], rtol=1e-12)  # (3 N - mu N) / K
    assert np.allclose(weight * found.traction, [[1.0, 0.0]], rtol=1e-12)
    assert found.used == pytest.approx([1.0], rel=1e-12)
    other = vc.ContactProblem(problem.system, problem.surface)
    assert vc.contact_values(other, still).traction.tolist() == [[0.0, 0.0]]


def test_a_state_of_another_problem_is_refused(comm: Any) -> None:
    problem, *_ = sheared(comm, 0.5)
    alone = rubbing_mass(u0=0.0, friction=vc.Coulomb(1.0))
    with pytest.raises(InputError, match="contact_values"):
        vc.contact_values(problem, vc.static_equilibrium(alone, solver=vc.Condensed()))
    with pytest.raises(InputError, match="contact_values"):
        vc.contact_values(alone, None)  # type: ignore[arg-type]


@pytest.mark.long
def test_summary_tells_how_much_of_the_friction_is_used(comm: Any) -> None:
    """A block on a plane that is pushed by 0.6 mu N sticks as a whole, by 1.5 mu N slides as a
    whole: T/(mu N) and the share of slipping points, in history, facts and summary."""
    for share, used, slipping in ((0.6, 0.6, 0.0), (1.5, 1.0, 1.0)):
        mesh, tags = block(comm, lengths=(2.0, 0.5), divisions=(4, 1))
        material = vc.LinearElastic(E=1.0e9, nu=0.0, rho=2000.0)
        weight = 2000.0 * 9.81
        push = share * MU * weight
        loads = [fem.BodyForce((0.0, -weight)), fem.BodyForce((push, 0.0), history=lambda t: 1.0)]
        system = fem.assemble(mesh, material, loads=loads, damping=vc.Rayleigh(200.0, 1e-4))
        plane = vc.HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
        surface = fem.contact_surface(system, tags["bottom"], obstacle=plane)
        problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(MU))
        run = vc.simulate(problem, dt=1e-3, steps=200, progress=False)
        history = run.history
        assert history["contact_slipping"][0] == 0.0
        assert history["contact_slipping"][-1] == slipping
        assert history["friction_used"][-1] == pytest.approx(used, rel=1e-3)
        assert run.facts["friction_used"]["end"] == history["friction_used"][-1]
        assert run.facts["slipping"]["end"] == slipping
        words = " ".join(run.summary().split())
        assert f"T/(mu N) {history['friction_used'].max():.3f} at most" in words
        most = history["contact_slipping"][1:].max()
        assert f"points that slip {most:.3f} at most, {slipping:.3f} at the end" in words
