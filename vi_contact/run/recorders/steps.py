"""Record what every run records: time, step, iterations, certificate and ground acceleration."""

from collections.abc import Mapping

from ...core.problem import ContactProblem
from ...core.step import AXES, Columns, Report, Row, State
from .columns import expand_axes

# Column -> (unit, meaning). One with {axis} in its name is recorded once for each axis.
_STEPS_COLUMNS: Columns = {
    "t": ("s", "time at the end of the step"),
    "k": ("-", "number of the step"),
    "iterations": ("-", "iterations of the solver in this step"),
    "certificate": ("-", "worst dimensionless residual of the inequality problem of this step"),
    "escalated": ("-", "1 when the step needed another solver than the first, else 0"),
    "a_g_{axis}": ("m/s²", "ground acceleration along {axis} at time t"),
}


class Steps:
    """Record the columns of every run.

    They are time, step, iterations, certificate, escalation and ground acceleration.
    """

    _axes = AXES  # those of the problem, once it is started

    def columns(self) -> Columns:
        """Name t, k, iterations, certificate, escalated, a_g_x, and so on."""
        return expand_axes(_STEPS_COLUMNS, self._axes)

    def _row(
        self, state: State, iterations: int = 0, certificate: float = 0.0, escalated: bool = False
    ) -> Row:
        """Return the row of a state.

        Args:
            state: at the end of the step.
            iterations: of the solver in this step.
            certificate: the worst residual of the step, without unit.
            escalated: whether another solver than the first was needed.
        """
        ground = self._problem.ground_acceleration(state.t).tolist()
        values = (state.t, state.k, int(iterations), certificate, int(escalated), *ground)
        return dict(zip(self._names, values, strict=True))

    def start(
        self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None
    ) -> Row:
        """Return the initial row: no iterations and no certificate were needed, so zeros.

        Args:
            problem: what is marched.
            state: the first state.
            resumed: the last row of the run that is continued, None for a new run.
        """
        self._problem = problem
        self._axes = AXES[: problem.system.influence.shape[1]]
        self._names = tuple(self.columns())
        return self._row(state)

    def row(self, report: Report) -> Row:
        """Return the row of the step that ``report`` tells of."""
        return self._row(
            report.new, report.result.iterations, report.certificate.worst, report.escalated
        )
