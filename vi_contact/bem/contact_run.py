"""March through contact on a condensed boundary; answer with histories, resultants, works."""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ..core.algebra import Array, Mask
from ..core.arguments import check_arguments
from ..core.certificate import Certificate
from ..core.quantities import Positive, Remedy
from ..core.step import StepProblem
from ..solvers.certified import TOLERANCE, CertifiedSolver
from ..solvers.condensed import Condensed
from ..solvers.normal.lemke import Lemke
from ..solvers.passes import Certified
from .contact import BoundaryContact
from .poincare_steklov import work

log = logging.getLogger(__name__)


@check_arguments
def march_contact(
    contact: Annotated[BoundaryContact, Remedy("give a BoundaryContact")],
    *,
    solver: Annotated[
        Condensed | None, Remedy("give Condensed() with any of its methods, or None")
    ] = None,
    tolerance: Annotated[float, Positive] = TOLERANCE,
) -> "ContactRun":
    """March through all steps of the compliance.

    Args:
        contact: the condensed body and its support.
        solver: Condensed with any of its methods. None takes ActiveSet, or Lemke where the
            compliance is not symmetric.
        tolerance: largest residual that the certificate of a step may have.

    Returns:
        The histories, with the certificate of every step.

    Raises:
        StepFailure: a step whose certificate exceeds the tolerance, with step, time and residuals.
    """
    default = Condensed() if contact.symmetric else Condensed(Lemke())
    if not contact.symmetric and not contact.p_matrix.holds:
        log.warning(
            f"boundary elements: W[0] {contact.p_matrix.sentence}; other runs may be as right as "
            "this one"
        )
    certified = CertifiedSolver(
        None,
        contact.matrix,
        1.0,
        [solver or default],
        tolerance,
        surface=contact.surface,
        advice="try Condensed() with another method",
    )
    return run_steps(contact, certified.solve)


@dataclass(frozen=True)
class ContactRun:
    """Hold the histories of c conditions at m contact nodes over all steps.

    Attributes:
        contact: the condensed body and its support.
        times: (steps,) ends of the steps [s].
        r_n: (steps, c) normal reactions on the support during each step [N/m].
        r_t: (steps, c) tangential reactions on the support during each step [N/m].
        gap: (steps, c) at the ends of the steps [m].
        slip: (steps, c) in each step [m].
        displacement: (steps, 2m) of the contact nodes at the ends of the steps [m], in the order
            of CondensedCompliance.
        forces: (steps, 2m) on the body during each step [N/m], in the same order.
        active: (steps, c) whether a condition is closed.
        certificates: of each step.
        iterations: (steps,) of the method in a step; of a method for many steps at once, one for
            each window.
        history: what such a method logs.
    """

    contact: BoundaryContact
    times: Array
    r_n: Array
    r_t: Array
    gap: Array
    slip: Array
    displacement: Array
    forces: Array
    active: Mask
    certificates: tuple[Certificate, ...]
    iterations: Array
    history: tuple[float, ...] = ()

    @property
    def worst(self) -> float:
        """Return the largest residual of all steps, a pure number."""
        return max(certificate.worst for certificate in self.certificates)

    @property
    def resultant(self) -> Array:
        """Return the force (steps, 2) of the support on the body [N/m]."""
        return np.asarray(self.forces.reshape(len(self.times), 2, -1).sum(axis=2))

    @property
    def impulse(self) -> Array:
        """Return the impulse (steps, 2) of that force up to each time [N s/m]."""
        return np.cumsum(self.resultant, axis=0) * self.contact.compliance.dt

    @property
    def pressure(self) -> Array:
        """Return the normal traction (steps, c), r_n / length [Pa]."""
        return self.r_n / self.contact.surface.weights

    @property
    def shear(self) -> Array:
        """Return the tangential traction (steps, c) on the support, r_t / length [Pa]."""
        return self.r_t / self.contact.surface.weights

    @property
    def work(self) -> Array:
        """Return the work (steps,) of all contact forces on the body up to each time [J/m]."""
        return work(self.forces, self.displacement)

    @property
    def friction_loss(self) -> Array:
        """Return the energy (steps,) that friction has taken up to each time [J/m].

        It is the sum of r_t slip, which is never negative in a step.
        """
        return np.cumsum((self.r_t * self.slip).sum(axis=1))


def run_steps(
    contact: BoundaryContact,
    answer: Callable[[StepProblem], Certified],
    *,
    iterations: Array | None = None,
    history: tuple[float, ...] = (),
) -> ContactRun:
    """Take all steps into a run with certificates.

    Args:
        contact: the condensed body and its support.
        answer: gives the certified answer of a step.
        iterations: of each step or window; None takes those of the results.
        history: what a method for many steps logs.
    """
    surface = contact.surface
    x = np.zeros(int(contact.free.sum()))
    active = surface.gap(0.0) <= 0.0
    loads = np.zeros_like(contact.v_free)
    times = []
    answers: list[Certified] = []
    gap = []
    slip = []
    r_t = []
    nothing = np.zeros((surface.count, 1))  # without friction nothing rubs or is said to slide
    for k in range(len(loads)):
        step = contact.step(k, loads, x, active)
        certified = answer(step)
        result = certified.result
        loads[k] = contact.load(result.r_n, result.r_t)
        x = result.x
        active = result.active
        times.append(step.t)
        answers.append(certified)
        gap.append(step.bound - surface.normal_values(x))
        origin = step.slip0
        slip.append(nothing if origin is None else surface.tangential_values(x) - origin)
        r_t.append(nothing if result.r_t is None else result.r_t)
    results = [certified.result for certified in answers]
    if iterations is None:
        iterations = np.array([result.iterations for result in results])
    forces = contact.cartesian(loads)
    return ContactRun(
        contact=contact,
        times=np.array(times),
        r_n=np.array([result.r_n for result in results]),
        r_t=np.array(r_t)[:, :, 0],
        gap=np.array(gap),
        slip=np.array(slip)[:, :, 0],
        displacement=contact.compliance.displacement(forces),
        forces=forces,
        active=np.array([result.active for result in results]),
        certificates=tuple(certified.certificate for certified in answers),
        iterations=iterations,
        history=history,
    )
