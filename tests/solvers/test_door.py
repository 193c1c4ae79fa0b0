"""What no step lets in: negative limits of friction and NaN, of every solver, scheme and
dimension."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

pytest.importorskip("dolfinx")

from mpi4py import MPI

import vi_contact as vc
from demos.parts.problems.boundary_elements import square_problem
from vi_contact import fem, meshes
from vi_contact.bem.contact import BoundaryContact
from vi_contact.bem.contact_run import march_contact
from vi_contact.bem.uzawa_space_time import SpaceTimeUzawa
from vi_contact.core.algebra import SerialMatrix
from vi_contact.core.errors import InputError, StepFailure
from vi_contact.core.problem import ContactProblem
from vi_contact.fem.matrices.petsc_algebra import PetscMatrix
from vi_contact.solvers import NSGS, FixedPoint, FrictionNewton, GivenForces

COMM = MPI.COMM_WORLD
NAN = math.nan


@dataclass(frozen=True)
class Own:
    """A law of a user's own: cohesion [Pa] and slope, those at points to the right of x, and only
    when it slides."""

    cohesion: float = 0.0
    slope_: float = 0.3
    x: float = -1.0
    points: Any = None
    rated: bool = False
    speed: float = 0.0

    def _there(self, value: float, sound: float) -> Any:
        bad = (self.points[:, 0] > self.x) & (not self.rated or self.speed > 0.0)
        return np.where(bad, value, sound)

    def limit(self, r_n: Any, weights: Any, scale: float) -> Any:
        return self._there(self.cohesion, 0.0) * weights * scale + self.slope(weights) * np.maximum(
            r_n, 0.0
        )

    def slope(self, weights: Any) -> Any:
        return self._there(self.slope_, 0.3)

    def at(self, speed: Any) -> Any:
        return replace(self, speed=float(np.max(speed, initial=0.0))) if self.rated else self


def body(d: int, **given: Any) -> Any:
    """A block that slides as it falls, and its contact surface."""
    mesh, tags = fem.build_mesh(
        meshes.BlockMesh(lengths=(2.0, 1.0, 1.0)[:d], divisions=(4, 2, 1)[:d]), COMM
    )
    soft = vc.LinearElastic(E=1.0e7, nu=0.3, rho=1000.0)
    system = fem.assemble(mesh, soft, initial_velocity=(1.0, -1.0, 0.2)[:d], **given)
    plane = vc.HalfSpace((0.0, 0.0, 0.0)[:d], (0.0, 1.0, 0.0)[:d])
    return system, fem.contact_surface(system, tags["bottom"], obstacle=plane)


def steps(problem: ContactProblem, **options: Any) -> list[Any]:
    problem = replace(problem, mass=vc.ConsistentMass())
    return list(vc.march(problem, steps=6, dt=4e-4, **{"scheme": vc.Trapezoidal(), **options}))


METHODS = {
    "newton": vc.Condensed(friction_method=FrictionNewton()),
    "nsgs": vc.Condensed(friction_method=NSGS()),
    "fixed point": vc.Condensed(friction_method=FixedPoint()),
    "given forces": vc.Condensed(friction_method=GivenForces()),
    "volume": vc.Volume(),
    "iterative": vc.Iterative(),
    "automatic": vc.Automatic(),
}
SCHEMES = {
    one.__name__: one
    for one in (vc.Trapezoidal, vc.MoreauJean, vc.ContactStabilisedNewmark, vc.Midpoint)
}


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("solver", METHODS)
def test_limits_of_friction_below_zero(solver, d):
    """At one point only, with its place and the time, of every solver: none begins to iterate."""
    system, surface = body(d)
    for wrong, said in (
        ({"slope_": -0.1}, "slope is -0.1"),
        ({"cohesion": -1e3}, r"limit\(0\) is -[\d.]+"),
        ({"slope_": NAN}, "slope is nan"),
        ({"cohesion": math.inf}, r"limit\(0\) is inf"),
    ):
        law = Own(x=1.2, points=surface.points, **wrong)
        with pytest.raises(InputError, match=rf"Own: {said} at \(1.5, 0.*and t = 0(.0004)? s"):
            steps(ContactProblem(system, surface, friction=law), solver=METHODS[solver])
    right = Own(points=surface.points)
    assert len(steps(ContactProblem(system, surface, friction=right), solver=METHODS[solver])) == 6


@pytest.mark.parametrize("solver", ["newton", "volume", "iterative"])
@pytest.mark.parametrize("scheme", SCHEMES)
def test_limits_of_friction_that_turn_negative_with_the_slip_rate(scheme, solver):
    """A law is asked again and again in a step, and looked at every time."""
    system, surface = body(2)
    law = Own(slope_=-0.1, points=surface.points, rated=True)
    with pytest.raises(
        InputError, match=r"Own: slope is -0.1 at .* and t = [\d.]+ s; a friction limit is zero or"
    ):
        steps(
            ContactProblem(system, surface, friction=law),
            scheme=SCHEMES[scheme](),
            solver=METHODS[solver],
        )


def test_a_limit_of_another_shape():
    """One number for all points is no array."""
    system, surface = body(2)
    law = Own(points=surface.points)
    object.__setattr__(law, "slope", lambda weights: 0.3)
    with pytest.raises(
        InputError, match=r"Own: slope is 0.3 at t = 0(.0004)? s; return \d+ real numbers"
    ):
        steps(ContactProblem(system, surface, friction=law))


def test_laws_of_the_package_refuse_when_they_are_made():
    """So that nothing has to be asked in a step."""
    for make in (
        lambda: vc.Coulomb(-0.1),
        lambda: vc.Coulomb([0.1, NAN]),
        lambda: vc.Tresca(-1.0),
        lambda: vc.Tresca(math.inf),
    ):
        with pytest.raises(InputError, match="zero or a positive finite number"):
            make()
    assert vc.Coulomb.never_negative and vc.Tresca.never_negative and vc.Frictionless.never_negative


def of_the_user(value: float) -> Any:
    """A history that is no number from the third step on."""

    def history(t: float) -> float:
        return value if t > 1e-3 else 1.0

    return history


@pytest.mark.parametrize("solver", ["newton", "volume", "iterative"])
@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("value", [NAN, math.inf])
@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # of numpy, for infinity times zero
def test_histories_that_are_no_number(value, d, solver):
    """Of an own history, with its name, its time and the step."""
    mesh, tags = fem.build_mesh(
        meshes.BlockMesh(lengths=(2.0, 1.0, 1.0)[:d], divisions=(4, 2, 1)[:d]), COMM
    )
    load = fem.Traction(tags["right"], (1e3, 0.0, 0.0)[:d], history=of_the_user(value))
    system = fem.assemble(mesh, vc.LinearElastic(E=1.0e7, nu=0.3, rho=1000.0), loads=load)
    surface = fem.contact_surface(system, tags["left"])
    problem = ContactProblem(system, surface)
    late = rf"of_the_user.*is {value:g} at t = 0.0012 s"
    said = rf"the load of step 3 at t = 0.0012 s contains NaN or infinite values.*{late}"
    with pytest.raises(StepFailure, match=said):
        steps(problem, solver=METHODS[solver])
    with pytest.raises(StepFailure, match=rf"of_the_user.*is {value:g} at t = 2 s"):
        vc.static_equilibrium(problem, t=2.0, solver=METHODS[solver])


class Shaking:
    """An excitation of a user's own."""

    direction, duration = (1.0, 0.0), math.inf

    def acceleration(self, t: float) -> float:
        return NAN if t > 1e-3 else 0.0

    def __call__(self, t: float) -> Any:
        return self.acceleration(t) * np.array(self.direction)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_an_excitation_that_is_no_number(scheme):
    """Its class is named, with the time at which the scheme asked."""
    system, surface = body(2)
    with pytest.raises(
        StepFailure, match=r"the load of step [34] .*, as Shaking is nan at t = 0.001\d* s"
    ):
        steps(ContactProblem(system, surface, excitation=Shaking()), scheme=SCHEMES[scheme]())


def test_gaps_slips_and_states_that_are_no_numbers():
    """Of an obstacle whose motion somebody set by hand, and of a scheme that leaves NaN in its
    guess."""
    system, surface = body(2)

    def late(shape: Any) -> Any:
        return lambda t: np.full(shape, NAN if t > 1e-3 else 0.0)

    moved = replace(surface, motion=late(surface.count))
    with pytest.raises(
        StepFailure, match="the gap of step 3 at t = 0.0012 s contains NaN or infinite .*everywhere"
    ):
        steps(ContactProblem(system, moved))
    slid = replace(surface, slide=late(surface.tangents.shape))
    with pytest.raises(StepFailure, match="the slip of step 3 at t = 0.0012 s contains NaN"):
        steps(ContactProblem(system, slid, friction=vc.Coulomb(0.3)))
    with pytest.raises(InputError, match=r"a moving obstacle: towards\(0.0012 s\) is"):
        steps(ContactProblem(system, surface.moving(towards=lambda t: NAN if t > 1e-3 else 0.0)))


@dataclass(frozen=True)
class Wild(vc.Trapezoidal):
    """A scheme of a user's own that guesses NaN at one place."""

    def stage(self, problem: Any, state: Any, dt: float) -> Any:
        stage = super().stage(problem, state, dt)
        guess = stage.guess.copy()
        guess[problem.system.space.ids == 3] = NAN
        return replace(stage, guess=guess)


def test_the_guess_of_a_scheme():
    """The place is told, as one number is wrong only."""
    system, surface = body(2)
    with pytest.raises(
        StepFailure,
        match=r"the guess of step 1 at t = 0.0004 s contains NaN or infinite values at \(",
    ):
        steps(ContactProblem(system, surface), scheme=Wild())


@pytest.mark.parametrize("name", ["M", "K"])
@pytest.mark.parametrize("solver", ["newton", "volume", "iterative"])
def test_matrices_with_entries_that_are_no_numbers(solver, name):
    """An entry off the diagonal of a matrix that somebody put in: named, with its place, before a
    solver has it."""
    system, surface = body(2)
    mat = getattr(system, name).mat.copy()
    first, last = mat.getOwnershipRange()
    if COMM.rank == COMM.size - 1:
        mat.setValue(last - 1, last - 2 if last - 2 >= first else last - 1, NAN)
    mat.assemble()
    other = system.changed(**{name: PetscMatrix(mat)})
    with pytest.raises(
        InputError, match=rf"the matrix of the steps \({name}\) has NaN or infinite entries at \("
    ):
        steps(ContactProblem(other, surface), scheme=vc.MoreauJean(), solver=METHODS[solver])
    if name == "K":
        with pytest.raises(InputError, match=r"the matrix of the steps \(K\) has NaN"):
            vc.static_equilibrium(ContactProblem(other, surface), solver=METHODS[solver])


@pytest.mark.serial
def test_matrices_of_arrays():
    """The same without finite elements: scipy would solve with NaN."""
    K = sp.csr_matrix(sp.diags([np.full(6, 2.0), -np.ones(5), -np.ones(5)], [0, 1, -1]))
    points = np.linspace(0.0, 1.0, 6)[:, None]
    system = vc.system_from_arrays(np.ones(6), None, K, coordinates=points, v0=np.ones(6))
    K[2, 3] = NAN
    other = system.changed(K=SerialMatrix(K))
    problem = ContactProblem(other, vc.contact_points(system, [5], [1.0]))
    with pytest.raises(
        InputError, match=r"the matrix of the steps \(K\) has NaN or infinite entries at \(0.4\)"
    ):
        steps(problem)


@pytest.mark.serial
def test_boundary_elements():
    """Negative limits, and compliances that are no numbers, in both ways to march."""
    material = vc.LinearElastic.from_wave_speeds(1.0, 0.5, 1.0)
    contact = BoundaryContact(square_problem(3, material, dt=0.2, steps=4).condensed())
    points = contact.surface.points
    for law in (Own(slope_=-0.1, points=points), Own(cohesion=NAN, points=points)):
        wrong = replace(contact, friction=law)
        for go in (march_contact, SpaceTimeUzawa().solve):
            with pytest.raises(
                InputError, match="a friction limit is zero or a positive finite number"
            ):
                go(wrong)
    u_free = contact.compliance.u_free.copy()
    u_free[2, 0] = NAN
    with pytest.raises(InputError, match=r"CondensedCompliance: u_free is nan at \(2, 0\)"):
        replace(contact.compliance, u_free=u_free)
