"""Hold both statements of Ahn (2012), section 8, against every reading of its normal force.

    1   "oscillating of the beam at the right end depends on the magnitude of contact forces; larger
        contact forces causes more oscillations"
    2   "In our numerical results, energy loss for friction seems to be negligible as compared to
        the viscosity damping"

Statement 1 is asked of runs whose force is a hundredth, a tenth, the whole and ten times that of
the reading. A run oscillates as often as its tip turns and then moves by more than eps: below eps,
the slip at which the regularised friction saturates, a tip that sticks chatters from step to step.
Statement 2 is asked of the whole force.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass

from vi_contact.beam import (
    BeamRun,
    BeamStepper,
    RegularisedFriction,
    TimoshenkoBeam,
    published_elements,
    published_mu,
    published_start,
    readings,
    run_beam,
)
from vi_contact.beam.published import DT, STEPS, Force
from vi_contact.core.algebra import Array

EPS = 0.002  # of the friction, and the least swing that counts [m]
FACTORS = (0.01, 0.1, 1.0, 10.0)  # of the normal force of a reading
VISCOSITIES = (0.001, 2.0)  # a2 of the source [s]
NEGLIGIBLE = 0.1  # friction below this share of the viscous loss


@dataclass(frozen=True)
class Row:
    """Hold what a reading makes of both statements at one viscosity a2 [s].

    turning_points, swings: how often the tip turns in 2 s at the forces FACTORS, all and those of
    more than EPS. peak_contact_force [N], friction_loss, viscous_loss [J], ratio of these: at the
    force of the reading itself.
    """

    reading: str
    a2: float
    turning_points: tuple[int, ...]
    swings: tuple[int, ...]
    peak_contact_force: float
    friction_loss: float
    viscous_loss: float

    @property
    def ratio(self) -> float:
        """Return the friction loss over the viscous loss."""
        return self.friction_loss / self.viscous_loss

    @property
    def statement_1(self) -> bool:
        """Say whether a tenfold force never gives fewer swings.

        The largest has to give more than the smallest.
        """
        return list(self.swings) == sorted(self.swings) and self.swings[-1] > self.swings[0]

    @property
    def statement_2(self) -> bool:
        """Say whether friction takes less than NEGLIGIBLE of what viscosity takes."""
        return self.ratio < NEGLIGIBLE

    def told(self) -> dict[str, object]:
        """Return the row as a dictionary of plain values."""
        verdicts = {name: getattr(self, name) for name in ("ratio", "statement_1", "statement_2")}
        return asdict(self) | verdicts | {"factors": FACTORS}

    def line(self) -> str:
        """Return the row of a table in Markdown, under HEAD."""
        cells = (
            self.reading,
            f"{self.a2:g}",
            ", ".join(map(str, self.turning_points)),
            ", ".join(map(str, self.swings)),
            f"{self.peak_contact_force:g}",
            f"{self.friction_loss:.4f}",
            f"{self.viscous_loss:.4f}",
            f"{self.ratio:.3f}",
            str(self.statement_1).lower(),
            str(self.statement_2).lower(),
        )
        return f"| {' | '.join(cells)} |"


HEAD = (
    "| reading | a2 [s] | turning points, force x 0.01, 0.1, 1, 10 | swings above eps, same forces "
    "| peak contact force [N] | friction loss [J] | viscous loss [J] | ratio | statement 1 | "
    "statement 2 |\n"
    "|" + "---|" * 10
)


def turning_points(u: Array, least: float = 0.0) -> int:
    """Return how often u (n,) turns.

    It does so where it moved by more than ``least`` before and does so after.
    """
    count = 0
    way = 0
    low = float(u[0])
    high = float(u[0])
    for value in map(float, u[1:]):
        low, high = min(low, value), max(high, value)
        turned = value < high - least and way >= 0, value > low + least and way <= 0
        if any(turned):
            count = count + (way != 0)
            way = 1 if turned[1] else -1
            low = value
            high = value
    return count


def rubbed(
    a2: float, force: Force, factor: float = 1.0, *, count: int = 1000, dt: float = DT
) -> BeamRun:
    """Run the source's beam for 2 s under ``factor`` times a normal force.

    There are ``count`` elements and steps of dt [s].
    """
    stepper = BeamStepper(
        TimoshenkoBeam(viscosity=a2),
        published_elements(count),
        dt,
        normal_force=lambda t: factor * force(t),
        mu=published_mu,
        friction=RegularisedFriction(EPS, absolute=1e-10),
    )
    return run_beam(stepper, published_start(), steps=round(STEPS * DT / dt))


def row(
    reading: str,
    a2: float,
    *,
    count: int = 1000,
    dt: float = DT,
    factors: Sequence[float] = FACTORS,
) -> Row:
    """Return the row of a reading "A", "B" or "C" at a viscosity a2 [s].

    It comes from a run for each factor; 1 is one of them.
    """
    runs = {
        factor: rubbed(a2, readings(dt)[reading], factor, count=count, dt=dt).history
        for factor in factors
    }
    tips = [run["u_tip"] for run in runs.values()]
    whole = runs[1.0]
    return Row(
        reading,
        a2,
        tuple(turning_points(tip) for tip in tips),
        tuple(turning_points(tip, EPS) for tip in tips),
        float(whole["normal_force"].max()),
        float(whole["loss_friction"][-1]),
        float(whole["loss_damping"][-1]),
    )
