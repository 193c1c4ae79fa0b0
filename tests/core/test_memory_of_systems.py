"""What is made once of a system, a surface or a problem: never that of another argument.

Every case makes something, uses it, changes an argument by a public method, uses it again, and
compares with objects that nobody has used."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

pytest.importorskip("dolfinx")

from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem, meshes
from vi_contact.core.system import OTHERS, Load

COMM = MPI.COMM_WORLD


def body(**given: Any) -> tuple[Any, Any, Any]:
    """A soft block over an oblique plane: system, mesh tags and surface, in nodal frames of their
    own."""
    mesh, tags = fem.build_mesh(meshes.BlockMesh(lengths=(2.0, 1.0), divisions=(4, 2)), COMM)
    soft = vc.LinearElastic(E=1.0e7, nu=0.3, rho=1000.0)
    system = fem.assemble(
        mesh,
        soft,
        damping=vc.Rayleigh(1.0, 1e-4),
        clamped=tags["top"],
        initial_velocity=(1.0, -1.0),
        **given,
    )
    return system, tags, oblique(system, tags["bottom"])


def oblique(system: Any, facets: Any, tilt: float = 0.2) -> Any:
    return fem.contact_surface(system, facets, obstacle=vc.HalfSpace((0.0, -1e-3), (tilt, 1.0)))


def level(
    system: Any,
    facets: Any,
    point: tuple[float, float] = (0.0, -1e-4),
    normal: tuple[float, float] = (0.0, 1.0),
) -> Any:
    """A surface along the axes: no turned matrices."""
    return fem.contact_surface(system, facets, obstacle=vc.HalfSpace(point, normal))


SCHEMES = {
    "trapezoidal": {"scheme": vc.Trapezoidal()},
    "stabilised": {"scheme": vc.ContactStabilisedNewmark()},
    "impact": {"scheme": vc.ZienkiewiczWoodTaylor(phi=0.5)},
}


def used(problem: vc.ContactProblem, kind: str) -> Any:
    """Displacements after some steps, and a static stage of the same problem."""
    mass = vc.ConsistentMass()
    problem = replace(problem, mass=mass, impact=vc.Inelastic() if kind == "impact" else None)
    *_, (state, _) = vc.march(problem, steps=12, dt=4e-4, **SCHEMES[kind])
    return np.concatenate(
        [problem.cartesian(state.u), problem.cartesian(vc.static_equilibrium(problem).u)]
    )


def downwards(problem: vc.ContactProblem, size: float) -> vc.ContactProblem:
    """The same under another load, by ``loaded``."""
    system = problem.system
    force = system.M @ (system.influence @ np.array([0.0, -size]))
    return replace(problem, system=system.loaded(Load(force)))


SHAKING = vc.Harmonic(amplitude=20.0, frequency=40.0, direction=(1.0, 0.0))
Change = Callable[[vc.ContactProblem, Any], vc.ContactProblem]
CHANGES: dict[str, Change] = {
    "loaded": lambda p, tags: downwards(p, 300.0),
    "loaded twice": lambda p, tags: downwards(downwards(p, 300.0), 100.0),
    "with_load": lambda p, tags: replace(
        p,
        system=p.system.with_load(
            (p.system.M @ (p.system.influence @ np.array([0.0, -300.0])), lambda t: 1.0 + t)
        ),
    ),
    "with_weight": lambda p, tags: replace(p, system=vc.with_weight(p.system)),
    "changed": lambda p, tags: replace(
        p, system=p.system.changed(K=p.system.algebra.combine([(2.0, p.system.K)]))
    ),
    "v0": lambda p, tags: replace(p, system=p.system.changed(v0=0.5 * p.system.v0)),
    "moving": lambda p, tags: replace(p, surface=p.surface.moving(towards=lambda t: 0.02 * t)),
    "on_springs": lambda p, tags: replace(p, surface=p.surface.on_springs(1e8)),
    "bilateral": lambda p, tags: replace(p, surface=p.surface.bilateral_everywhere()),
    "gap": lambda p, tags: replace(p, surface=replace(p.surface, gap0=0.5 * p.surface.gap0)),
    "other plane": lambda p, tags: replace(p, surface=oblique(p.system, tags["bottom"], 0.3)),
    "level plane": lambda p, tags: replace(p, surface=level(p.system, tags["bottom"])),
    "other facets": lambda p, tags: replace(
        p, surface=level(p.system, tags["right"], (2.0001, 0.0), (-1.0, 0.0))
    ),
    "friction": lambda p, tags: replace(p, friction=vc.Coulomb(0.3)),
    "excitation": lambda p, tags: replace(p, excitation=SHAKING),
}


LEVEL = ("loaded", "on_springs", "other plane", "other facets", "friction", "excitation")
STARTS = [(oblique, name) for name in CHANGES] + [(level, name) for name in LEVEL]
EVERY = ("loaded", "changed", "other plane")  # load, matrices and frames: with each scheme


@pytest.mark.parametrize(
    ("start", "name", "kind"),
    [
        (start, name, kind)
        for number, (start, name) in enumerate(STARTS)
        for turn, kind in enumerate(SCHEMES)
        if turn == number % len(SCHEMES) or (start is oblique and name in EVERY)
    ],
)
def test_another_argument_is_another_answer(start, name, kind):
    """Used before or not, the changed problem gives the same digits; the old one does too when it
    is used again."""
    system, tags, _ = body()
    problem = vc.ContactProblem(system, start(system, tags["bottom"]))
    before = used(problem, kind)
    found = used(CHANGES[name](problem, tags), kind)
    again = used(problem, kind)
    other, other_tags, _ = body()
    fresh = vc.ContactProblem(other, start(other, other_tags["bottom"]))
    wanted = used(CHANGES[name](fresh, other_tags), kind)
    assert np.array_equal(found, wanted)
    assert np.array_equal(again, before)
    assert COMM.allreduce(int(not np.array_equal(found, before)))  # the change is one


def test_matrices_are_turned_once_for_all_loads():
    """The memory that systems of several loads share is of their matrices."""
    system, _, surface = body()
    problem = vc.ContactProblem(system, surface)
    other = downwards(problem, 300.0)
    assert other.turned.K is problem.turned.K and other.turned.load is not problem.turned.load
    assert problem.turned.load(0.0) @ problem.turned.load(0.0) == 0.0
    expected = surface.basis.transpose_apply(other.system.load(0.0))
    assert np.array_equal(other.turned.load(0.0), expected)


def test_factors_are_kept_by_what_they_are_of():
    """Objects beside the matrices are a part of the key; the last few are kept."""
    system, _, _ = body()
    made: list[Any] = []

    def of(*objects: Any) -> Any:
        def make() -> Any:
            made.append(objects)
            return len(made)

        return system.make_once("factor", make, *objects)

    one, two = np.zeros(1), np.zeros(1)
    assert of(one) == 1 and of(two) == 2 and of(one) == 1 and of() == 3 and of(one, two) == 4
    several = [np.zeros(1) for _ in range(OTHERS)]
    assert [of(each) for each in several] == [of(each) for each in several]
    assert of(one) == 5 + OTHERS


def test_a_function_of_the_user_s_that_changed_between_runs():
    """Loads of the last times are not those of the next run."""
    strength = [1.0]
    system, _, surface = body()
    force = system.M @ (system.influence @ np.array([0.0, -300.0]))
    problem = vc.ContactProblem(system.with_load((force, lambda t: strength[0])), surface)
    runs = []
    for strength[0] in (1.0, 2.0):
        *_, (state, _) = vc.march(problem, steps=1, dt=4e-4)
        runs.append(state.u)
    other, _, face = body()
    fresh = vc.ContactProblem(other.with_load((force, lambda t: 2.0)), face)
    *_, (state, _) = vc.march(fresh, steps=1, dt=4e-4)
    assert np.array_equal(runs[1], state.u) and COMM.allreduce(
        int(not np.array_equal(runs[0], runs[1]))
    )


@pytest.mark.parametrize(
    "name", ["gap0", "weights", "bilateral", "compliance", "normals", "points"]
)
def test_arrays_of_a_surface_are_its_own(name):
    """Whoever made a surface may go on writing to the arrays, and nobody writes to those of the
    surface."""
    _, _, surface = body()
    mine = np.array(getattr(surface, name))
    made = replace(surface, **{name: mine})
    kept = mine.copy()
    mine[...] = 7
    assert np.array_equal(getattr(made, name), kept)
    with pytest.raises(ValueError, match="read-only"):
        getattr(made, name)[...] = 7


@pytest.mark.serial
@pytest.mark.parametrize("name", ["K", "M", "coordinates", "v0", "load"])
def test_arrays_given_to_a_system_are_its_own(name):
    """Matrices and vectors of numpy and scipy: what their owner does to them later is not seen."""
    given = {
        "K": sp.csr_matrix(
            sp.diags([np.full(6, 2e4), np.full(5, -1e4), np.full(5, -1e4)], [0, 1, -1])
        ),
        "M": sp.csr_matrix(sp.identity(6)),
        "coordinates": np.linspace(0.0, 1.0, 6)[:, None],
        "v0": np.ones(6),
        "load": np.full(6, 10.0),
    }

    def last(system: Any) -> Any:
        surface = vc.contact_points(system, [5], [1.0], gap0=1e-3)
        problem = vc.ContactProblem(system, surface, mass=vc.ConsistentMass())
        *_, (state, _) = vc.march(problem, steps=20, dt=1e-3)
        return state.u

    def system() -> Any:
        rest = {key: value for key, value in given.items() if key not in ("M", "K")}
        return vc.system_from_arrays(given["M"], None, given["K"], **rest)

    wanted, kept = last(system()), system()
    (given[name].data if name in ("K", "M") else given[name])[...] *= 2.0
    assert np.array_equal(last(kept), wanted)
    assert name == "coordinates" or not np.array_equal(last(system()), wanted)
