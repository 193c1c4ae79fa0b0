"""Record the energy ledger of a run."""

import logging
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ...core.internal import remembers
from ...core.ledger import Energies, compute_energies, energy_balance
from ...core.problem import ContactProblem
from ...core.step import Columns, Report, Row, State

log = logging.getLogger(__name__)

# CHOSEN: of the largest energy or input work so far; by so much may friction have given before it
# is told
GIVEN = 0.01


class Energy:
    """Record the energy ledger of the run in joules. Works and losses are sums since the start.

        W_input + E(0) = E(t) + D_damping + D_contact + D_friction + D_impact + D_algorithmic
                         - defect

        E = ½ vᵀMv + ½ uᵀKu   of the free unknowns, and with initial strains
        E = ½ vᵀMv + ½ uᵀKu - f_0·u + ½ ∫ eps_0 : C eps_0

    with f_0·u = ∫ C eps_0 : eps(u), so that the latter is ½ ∫ (eps - eps_0) : C (eps - eps_0) if
    supports are at zero. Rates of initial strains do work too. E has no energy that moved supports
    store by themselves: their pull -K U is a load. D_impact = ½ v⁻ᵀMv⁻ - ½ v⁺ᵀMv⁺ with its sign.
    W_input is the work of loads, inertia loads -M r a_g and prescribed motions. The defect is the
    summed work of the residual of the equation of motion; ``summary.json`` has its size over the
    largest energy or work. A body that yields has D_plastic >= 0 too, and E counts what hardening
    stores. Each step costs three products, and damping and impacts cost one more
    each. Friction never gives energy. Where D_friction falls below zero by a hundredth of the
    largest energy or work, the log warns once that the time scheme has made it.
    """

    _COLUMNS: ClassVar[Columns] = {
        "energy_kinetic": ("J", "kinetic energy after the impact law, ½ vᵀMv"),
        "energy_strain": ("J", "strain energy ½ uᵀKu"),
        "work_input": ("J", "work of loads, ground motion and prescribed motions since the start"),
        "loss_damping": ("J", "work of viscous damping since the start"),
        "loss_contact": ("J", "work done on the ground by the contact reactions since the start"),
        "loss_friction": ("J", "work of friction since the start"),
        "loss_impact": ("J", "kinetic energy taken by the impact law since the start, signed"),
        "loss_algorithmic": ("J", "numerical dissipation of the time scheme since the start"),
        "energy_defect": ("J", "what the ledger cannot explain since the start"),
    }
    _PLASTIC: ClassVar[Columns] = {
        "loss_plastic": ("J", "work dissipated where materials yield since the start"),
    }

    def columns(self) -> Columns:
        """Name energy_kinetic, energy_strain, work_input, loss_*, energy_defect."""
        return {**self._COLUMNS, **self._PLASTIC} if self._yields else self._COLUMNS

    def start(
        self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None
    ) -> Row:
        """Return the initial energies.

        Works and losses are zero, or those of the run that is continued.

        Args:
            problem: what is marched.
            state: the first state.
            resumed: the last row of the run that is continued, None for a new run.
        """
        self._problem = problem
        self._yields = remembers(problem.system.internal)
        standing = problem.standing_at(state)
        self._now = compute_energies(standing.equations, state.u, state.v)
        self._largest = abs(self._now.total)
        self._told = False
        self._stored = self._compute_stored(state)
        sums = tuple(self.columns())[2:]
        self._sums = dict.fromkeys(sums, 0.0)
        if resumed is not None:
            self._sums = {term: float(resumed[term]) for term in sums}
        return self._row()

    def _row(self) -> Row:
        """Return the energies now, and works and losses so far."""
        return {
            "energy_kinetic": self._now.kinetic,
            "energy_strain": self._now.strain + self._stored,
            **self._sums,
        }

    def _compute_stored(self, state: State) -> float:
        """Return what initial strains add to ½ uᵀKu [J], -f_0·u + ½ ∫ eps_0 : C eps_0."""
        initial = getattr(getattr(self._problem.system.space, "forms", None), "initial", None)
        if initial is None:
            return 0.0
        return float(initial.energy(self._problem.cartesian(state.u), state.t))

    def row(self, report: Report) -> Row:
        """Return the row of the step that ``report`` tells of."""
        problem = report.problem
        system = problem.equations
        new = report.new
        end = new if new.v is report.v_minus else new.with_velocity(report.v_minus)
        with np.errstate(over="ignore", invalid="ignore"):  # the session refuses overflow
            # The step without its impact: from the energies before it to those of v⁻.
            free = compute_energies(
                system, new.u, report.v_minus, momentum=report.momentum, elastic=report.elastic
            )
            step = energy_balance(
                problem, report.old, end, report.balance, before=self._now, after=free
            )
            # The impact law changes velocities, and so the kinetic energy alone.
            self._now = free
            if new.v is not report.v_minus:
                momentum = system.M @ new.v
                kinetic = 0.5 * system.algebra.dot(new.v, momentum)
                self._now = Energies(momentum, free.elastic, kinetic, free.strain)

        # Rates of initial strains do the work by which the energy they store has grown.
        before = self._stored
        self._stored = self._compute_stored(new)
        losses = {
            "work_input": step.input + (self._stored - before),
            "loss_damping": step.damping,
            "loss_contact": step.contact,
            "loss_friction": step.friction,
            "loss_impact": free.kinetic - self._now.kinetic,
            "loss_algorithmic": step.algorithmic,
            "energy_defect": step.defect,
            "loss_plastic": step.plastic,
        }
        for term in self._sums:
            self._sums[term] += losses[term]
        self._tell_gain(new.t)
        return self._row()

    def _tell_gain(self, t: float) -> None:
        """Warn once where friction has given energy, which a joint that springs back may do."""
        self._largest = max(self._largest, abs(self._now.total), abs(self._sums["work_input"]))
        given = -self._sums["loss_friction"]
        if self._told or self._problem.joint is not None or not given > GIVEN * self._largest:
            return
        self._told = True
        if self._problem.system.algebra.comm.rank == 0:
            log.warning(
                "friction has given %.3g J up to t = %.6g s, %.2g %% of the largest energy or work "
                "so far, and friction can only take energy: the slip turns round within time "
                "steps, and what follows may be made by the scheme. Take a smaller dt, or a scheme "
                "whose friction cannot give energy, such as MoreauJean(theta=1.0) or Midpoint()",
                given,
                t,
                100.0 * given / self._largest,
            )
