"""Solve the static stage of a body that is not linear and that contact alone holds.

K is singular, as that of a wall that stands on the ground. The equilibrium is the limit of the
proximal-point iteration (``proximal``), each step of which is a nonlinear step of its own

    p(u_k + d) + P d = f - B_nᵀ r_n - B_tᵀ r_t,    contact conditions on u_k + d

with P the mass of every body on weak springs to where the step before has left it
(``rigid_bodies.make_body_springs``). What points of integration remember is that of the state at
the beginning of the stage in all steps, so that the way of the stage is one increment for them. An
answer is certified by the stage without springs.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ..core.algebra import Array, EffectiveMatrix, Matrix
from ..core.errors import StepFailure
from ..core.problem import ContactProblem
from ..core.stage import NonlinearForces
from ..core.step import Solver, StepProblem, StepResult
from ..core.verify import kkt_residual
from ..solvers.certified import NEAR
from ..solvers.nonlinear import NonlinearSolver
from ..solvers.passes import Certified, Passes, certify
from .loose_bodies import judge_loose_bodies
from .rigid_bodies import RigidBodies, make_body_springs

ITERATIONS = 60


@dataclass(frozen=True)
class SprungForces(NonlinearForces):
    """Hold the forces of a stage with springs to where it begins.

    Attributes:
        springs: P.
        centre: (n,) the increment at which they are free of force.
    """

    springs: Any
    centre: Array

    def find_rest(self, d: Array) -> Array:
        """Return what is left of the forces at an increment (n,), those of springs among them."""
        return super().find_rest(d) - self.springs @ (d - self.centre)

    def make_matrix(self, tangent: Matrix) -> EffectiveMatrix:
        """Return the matrix of the step with a tangent in the place of K."""
        return add_springs(super().make_matrix(tangent), self.system.algebra, self.springs)


def add_springs(A: EffectiveMatrix, algebra: Any, springs: Any) -> EffectiveMatrix:
    """Return A + P.

    Args:
        A: of the stage.
        algebra: how its matrices are combined.
        springs: P.
    """
    total = algebra.combine([(1.0, A.matrix), (1.0, springs)])
    return EffectiveMatrix(total, algebra, space=A.space, inertia=A.inertia)


class Settling:
    """Iterate by the proximal-point method for a body that is not linear."""

    def __init__(
        self,
        problem: ContactProblem,
        K: EffectiveMatrix,
        scale: float,
        solvers: Sequence[Solver],
        tolerance: float,
        *,
        advice: str,
    ) -> None:
        """Prepare the solver on K and weak springs. Collective.

        Args:
            problem: whose bodies contact alone holds.
            K: its reference stiffness, which is singular.
            scale: of reactions.
            solvers: of linear steps, and the methods to escalate to.
            tolerance: of the certificate, relative.
            advice: end of the sentence that refuses a stage.
        """
        self._problem = problem
        self._springs = make_body_springs(problem)
        self._bodies = RigidBodies(problem)
        self._tolerance = tolerance
        self._advice = advice
        A = add_springs(K, problem.static_load.algebra, self._springs)
        self._solver = NonlinearSolver(problem, A, scale, solvers, tolerance, advice=advice)

    def solve(self, step: StepProblem) -> Certified:
        """Return the certified answer of a stage, x = d. Collective.

        Raises:
            StepFailure: no answer is certified, as where loads carry a body off.
        """
        passes: Passes[Certified] = Passes(
            tolerance=self._tolerance, goal=NEAR * self._tolerance, patience=2
        )
        if certify(passes, self._go(step), ITERATIONS) and passes.best is not None:
            return passes.best
        loose = [sentence for sentence, _ in judge_loose_bodies(self._problem)]
        raise StepFailure(
            "the static stage of a body that is not linear and that contact alone holds was not "
            f"solved (the residual stayed at {passes.least:.1e}): "
            f"{'; '.join(loose) or self._advice}"
        )

    def _go(self, step: StepProblem) -> Iterator[Certified]:
        """Yield the answers of steps, each from where the one before has led."""
        forces: Any = step.forces
        spent = 0
        d = step.guess
        active = step.active
        while True:
            # Springs to d: a step like any other, with one more linear force.
            sprung = SprungForces(forces.system, forces.stage, self._springs, d)
            there = self._solver.solve(
                replace(
                    step,
                    A=self._solver.A,
                    b=sprung.find_rest(d),
                    guess=d,
                    active=active,
                    forces=sprung,
                )
            )
            spent += there.result.iterations
            result: StepResult = replace(there.result, iterations=spent)
            d = result.x
            active = result.active
            yield Certified(result, self._judge(step, forces, result), there.escalated)

    def _judge(self, step: StepProblem, forces: Any, result: StepResult) -> Any:
        """Return the certificate of the stage itself, with the balance of rigid bodies.

        Args:
            step: the stage.
            forces: of the stage.
            result: the answer.
        """
        reaction = step.surface.reaction_load(result.r_n, len(result.x), result.r_t)
        resultant = self._bodies.imbalance(forces.stage.load, reaction)
        certificate = kkt_residual(step, result, forces.find_rest(result.x))
        return replace(certificate, resultant=resultant)
