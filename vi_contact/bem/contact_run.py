"""March through contact on a condensed boundary; answer with histories, resultants, works."""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ..core.algebra import Array, Mask
from ..core.arguments import checked
from ..core.certificate import Certificate
from ..core.errors import StepFailure
from ..core.quantities import Positive, Remedy
from ..core.step import StepProblem, StepResult
from ..core.verify import kkt_residual
from ..solvers.certified import TOLERANCE
from ..solvers.condensed import Condensed
from ..solvers.door import refuse_nan
from ..solvers.normal.lemke import Lemke
from .contact import BoundaryContact
from .poincare_steklov import work

log = logging.getLogger(__name__)


@checked
def march_contact(
    contact: Annotated[BoundaryContact, Remedy("give a BoundaryContact")],
    *,
    solver: Annotated[
        Condensed | None, Remedy("give Condensed() with any of its methods, or None")
    ] = None,
    tolerance: Annotated[float, Positive] = TOLERANCE,
) -> "ContactRun":
    """March through all steps of the compliance.

    ``solver`` is Condensed with any of its methods, by default ActiveSet, or Lemke where the
    compliance is not symmetric.

    Raises StepFailure when a step's certificate exceeds ``tolerance``, with step, time and
    residuals.
    """
    default = Condensed() if contact.symmetric else Condensed(Lemke())
    if not contact.symmetric and not contact.p_matrix.holds:
        log.warning(
            f"boundary elements: W[0] {contact.p_matrix.sentence}; other runs may be as right as "
            "this one"
        )
    prepared = (solver or default).prepare(contact.matrix, contact.surface, 1.0)

    def solved(step: StepProblem) -> StepResult:
        result = prepared.solve(step)
        certificate = kkt_residual(step, result)
        if not certificate.worst <= tolerance:
            raise StepFailure(
                f"boundary element step {step.k} at t = {step.t:.6g} s stayed above the "
                f"certificate tolerance {tolerance:g} ({certificate}): try Condensed() with "
                "another method"
            )
        return result

    return run_steps(contact, solved)


@dataclass(frozen=True)
class ContactRun:
    """Hold the histories of c conditions at m contact nodes over all steps.

    times: (steps,) ends of the steps [s]; r_n: (steps, c), r_t: (steps, c) reactions [N/m] on the
    support during each step, normal and along the tangent; gap: (steps, c) at the ends [m]; slip:
    (steps, c) in each step [m]; displacement: (steps, 2m) of the contact nodes at the ends and
    forces: (steps, 2m) on the body [N/m] in the order of CondensedCompliance; active: (steps, c).
    certificates: of each step; iterations: (steps,) of the method in a step, or one per window of a
    method for many steps; history: what such a method logs.
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
        """Return the worst residual of any step."""
        return max(certificate.worst for certificate in self.certificates)

    @property
    def resultant(self) -> Array:
        """Return (steps, 2) force of the support on the body [N/m]."""
        return np.asarray(self.forces.reshape(len(self.times), 2, -1).sum(axis=2))

    @property
    def impulse(self) -> Array:
        """Return (steps, 2) the impulse of that force up to each time [N s/m]."""
        return np.cumsum(self.resultant, axis=0) * self.contact.compliance.dt

    @property
    def pressure(self) -> Array:
        """Return (steps, c) normal traction r_n / length [Pa]."""
        return self.r_n / self.contact.surface.weights

    @property
    def shear(self) -> Array:
        """Return (steps, c) tangential traction r_t / length [Pa] of the body on the support."""
        return self.r_t / self.contact.surface.weights

    @property
    def work(self) -> Array:
        """Return (steps,) work of all contact forces on the body up to each time [J/m]."""
        return work(self.forces, self.displacement)

    @property
    def friction_loss(self) -> Array:
        """Return (steps,) energy that friction has taken [J/m].

        It is sum r_t slip, never negative in a step.
        """
        return np.cumsum((self.r_t * self.slip).sum(axis=1))


def run_steps(
    contact: BoundaryContact,
    solved: Callable[[StepProblem], StepResult],
    *,
    iterations: Array | None = None,
    history: tuple[float, ...] = (),
) -> ContactRun:
    """Take all steps, each answered by ``solved``, into a run with certificates."""
    surface = contact.surface
    nothing = np.zeros((surface.count, 1))
    x, active = np.zeros(int(contact.free.sum())), surface.gap(0.0) <= 0.0
    loads = np.zeros_like(contact.v_free)
    pairs: list[tuple[StepProblem, StepResult]] = []
    for k in range(len(loads)):
        step = contact.step(k, loads, x, active)
        refuse_nan(step)
        result = solved(step)
        loads[k] = contact.load(result.r_n, result.r_t)
        x, active = result.x, result.active
        pairs.append((step, result))
    slip = [
        nothing if step.slip0 is None else surface.tangential_values(result.x) - step.slip0
        for step, result in pairs
    ]
    forces = contact.cartesian(loads)
    return ContactRun(
        contact,
        np.array([step.t for step, _ in pairs]),
        np.array([result.r_n for _, result in pairs]),
        np.array([nothing if result.r_t is None else result.r_t for _, result in pairs])[:, :, 0],
        np.array([step.bound - surface.normal_values(result.x) for step, result in pairs]),
        np.array(slip)[:, :, 0],
        contact.compliance.displacement(forces),
        forces,
        np.array([result.active for _, result in pairs]),
        tuple(kkt_residual(*pair) for pair in pairs),
        np.array([result.iterations for _, result in pairs]) if iterations is None else iterations,
        history,
    )
