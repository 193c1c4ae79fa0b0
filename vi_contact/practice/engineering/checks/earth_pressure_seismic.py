"""Expect what an earthquake adds to the pressure on a wall.

The theories are those of Mononobe and Okabe, Wood, Veletsos and Younan.

Mononobe and Okabe's wedge yields, and stands beside a run with elastic soil. Wood's, and Veletsos
and Younan's elastic layer of height H on rock is held by a rigid smooth wall that stays on it:
these are to be met by such a run.
"""

import math
from abc import abstractmethod
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Self

import numpy as np
from scipy.integrate import cumulative_trapezoid

from ....core.algebra import Array
from ....core.quantities import RATIO, Between, Positive, Unit
from .comparison import NO_JUDGEMENT, Formula, History, Length, Numbers, Poisson
from .earth_pressure_static import (
    WALL_ANSWERS,
    WALL_COLUMNS,
    YIELDED,
    CoulombWedge,
    EarthPressure,
)
from .model_facts import ModelFacts, tell_contradiction

# CHOSEN: share of the layer's lowest frequency below which inertia adds less than 5 %, by the
# factor 1/sqrt(1 - 0.3²) of an oscillator.
SLOW = 0.3
# CHOSEN: share of the wall that may open. At its top, where nothing presses the soil down, it
# always opens.
LIFTED = 0.05


def smooth_wall(nu: float, length: float, terms: int = 2000) -> tuple[float, float]:
    """Return Q/(rho a H²) and h/H of an elastic layer between rigid smooth walls.

    Q is the thrust under a steady acceleration a, and h its height above the rock.

    u = sum U_n(y) sin k x, v = sum V_n(y) cos k x, k = n pi/length, n odd, with u = v = 0 on the
    rock and free ground above: exact plane strain (Wood 1973). Q and its moment follow by
    equilibrium from the stresses on the rock.

    Args:
        nu: Poisson's ratio.
        length: distance of the walls over the height of the layer.
        terms: of the series.
    """
    n = 2.0 * np.arange(1, terms + 1) - 1.0
    k = n * math.pi / length

    # Beyond k = 300 the ratios of hyperbolic functions change no more, and the functions overflow.
    bounded = np.minimum(k, 300.0)
    sinh = np.sinh(bounded)
    cosh = np.cosh(bounded)

    # Stresses of every term on the rock, and what they leave to the walls.
    scale = -4.0 / (n * math.pi * k) / ((3.0 - 4.0 * nu) * cosh**2 + k**2 + (1.0 - 2.0 * nu) ** 2)
    shear = scale * ((1.0 - 2.0 * nu) * (2.0 * sinh * (cosh - nu) + 2.0 * k) + 2.0 * nu * k * cosh)
    vertical = scale * (k**2 + sinh**2 - 2.0 * nu * k * sinh - 4.0 * nu * (1.0 - nu) * (cosh - 1.0))
    thrust = 0.5 * length + float(np.sum(shear / k))
    return thrust, (0.25 * length + float(np.sum(vertical / k**2))) / thrust


@dataclass(frozen=True, kw_only=True)
class MononobeOkabe(CoulombWedge):
    """Expect the largest thrust of Coulomb's wedge under its weight and an earthquake.

    The thrust acts at H/3 in this theory, which applies as that of Coulomb's wedge does.

    Attributes:
        kh: acceleration towards the wall, over that of gravity; None: the peak of the run, the
            largest size of ``acceleration`` over g.
        kv: acceleration upwards, likewise.
        acceleration: column of the ground's acceleration; of a run whose base moves by itself that
            of a point of the free field.
    """

    formula: ClassVar[Formula] = Formula(
        text=(
            "N = K_AE cos δ (1-kv) (ρ g H²/2 + q H cos ι cos β/cos(β-ι)), K_AE(φ, δ, slope "
            "β, batter ι, ψ), tan ψ = kh/(1-kv)"
        ),
        source="Okabe 1924; Mononobe and Matsuo 1929",
        range=(
            "δ up to φ, passive up to φ/2; φ - slope - ψ from 0, passive φ + slope - ψ; "
            "ground up to φ; soil that yields"
        ),
        fields=(*CoulombWedge.formula.fields, "kh", "kv"),
        reads=WALL_COLUMNS,
        answers=WALL_ANSWERS,
        reading=YIELDED,
    )
    largest: ClassVar[bool] = True

    kh: Annotated[float, Between(0.0, 10.0), RATIO] | None = None
    kv: Annotated[float, Between(-0.9, 0.9), RATIO] = 0.0
    acceleration: str = "a_g_x"

    def settle(self, history: History, facts: ModelFacts) -> tuple[Self, list[str]]:
        """Return the check with kh and the friction of the wall, and sentences about them."""
        check, notes = super().settle(history, facts)
        shaken = history.get(self.acceleration, np.zeros(0))
        peak = float(np.abs(shaken).max(initial=0.0)) / self.gravity
        source = f"the peak of {self.acceleration} over g"
        if self.kh is not None:
            contradiction = tell_contradiction("kh", self.kh, peak, "", source) if peak else []
            return check, notes + contradiction
        if not peak:
            return check, notes
        return replace(check, kh=peak), [*notes, f"kh is that of the run: {source}"]

    def coefficient(self, psi: float = 0.0) -> tuple[float, str]:
        """Return K (1 - kv), and why it does not apply, or "".

        The earthquake turns gravity further than psi [rad].
        """
        if self.kh is None:
            why = f"{self.acceleration} is zero or not recorded: name the ground's acceleration"
            return math.nan, f"{why} by acceleration=, or give kh"
        K, why = super().coefficient(psi + math.atan(self.kh / (1.0 - self.kv)))
        return K * (1.0 - self.kv), why


ELASTIC = (
    f"{NO_JUDGEMENT}: the theory is that of elastic soil, and below 1 the run adds less than it, "
    "which is unsafe for a wall that does not give way"
)
LAYER_COLUMNS = ("t", "N_{part}", "height_{part}", "uplift_{part}", "{acceleration}")


@dataclass(frozen=True, kw_only=True)
class LayerCheck(EarthPressure):
    """Compare the largest thrust that is added to the first row's, its moment, or its height.

    Attributes:
        nu: Poisson's ratio of the layer.
        c_s: speed of shear waves in the layer.
        on_left: whether the soil is on the left of the wall, else it is on the right.
        acceleration: column of the ground's acceleration.
    """

    nu: Poisson
    c_s: Annotated[float, Positive, Unit("m/s")]
    on_left: bool = False
    acceleration: str = "a_g_x"

    @abstractmethod
    def find_added_thrust(self, t: Array, push: Array) -> tuple[float, float, str]:
        """Return the largest Q [N/m], its height [m], and why the theory does not apply, or "".

        ``push`` (n,) is the acceleration with which inertia presses the soil on the wall, at times
        t (n,) [m/s²]: that of the ground away from the wall.
        """

    def numbers(self, history: History) -> Numbers:
        """Return both numbers, why they cannot be compared, and the peak acceleration."""
        thrust = history[f"N_{self.part}"]
        height = history[f"height_{self.part}"]
        open_share = float(history[f"uplift_{self.part}"].max())
        push = history[self.acceleration] * (-1.0 if self.on_left else 1.0)
        peak = float(push.max())

        # What the earthquake adds to the first row: thrust and moment about the foot of the wall.
        row = int(np.argmax(thrust))
        moment = thrust * np.nan_to_num(height)
        added_thrust = float(thrust[row] - thrust[0])
        if len(push) < 3 or peak <= 0.0 or added_thrust <= 0.0:
            why = f"{self.acceleration} never presses the soil on the wall: check sign and side"
            return Numbers(math.nan, added_thrust / self.width, why)
        expected, arm, why = self.find_added_thrust(history["t"], push)
        if not why and open_share > LIFTED:
            why = f"up to {open_share:.0%} of the wall leaves the soil"
        inputs = {"a": (peak, "m/s²")}
        added = (thrust - thrust[0]) / self.width
        added_moment = float(moment[row] - moment[0]) / self.width
        if self.of == "height":
            return Numbers(arm, added_moment / float(added[row]), why, inputs)
        if self.of == "moment":
            return Numbers(expected * arm, added_moment, why, inputs, added)
        return Numbers(expected, float(added[row]), why, inputs, added)


@dataclass(frozen=True, kw_only=True)
class Wood(LayerCheck):
    """Expect the added thrust of a slow motion on a smooth wall, exact in plane strain.

    It applies below 0.3 of the layer's lowest frequency, c_s/(4 H); that of a motion is max a/(pi
    (max v - min v)).

    Attributes:
        length: distance to the next smooth rigid wall, such as a side of the model that holds u;
            None: far away.
    """

    formula: ClassVar[Formula] = Formula(
        text="ΔN = F(ν, L/H) ρ a H², exact in plane strain; a the peak towards the wall",
        source="Wood 1973, EERL 73-05",
        range=(
            "motions below 0.3 c_s/(4 H); a rigid smooth wall of which at most 5 % opens; "
            "elastic soil on rock"
        ),
        fields=("height", "rho", "nu", "c_s", "length"),
        reads=LAYER_COLUMNS,
        answers=WALL_ANSWERS,
        reading=ELASTIC,
    )

    length: Length | None = None

    def find_added_thrust(self, t: Array, push: Array) -> tuple[float, float, str]:
        """Return the largest Q [N/m], its height [m], and why the theory does not apply, or ""."""
        # A wall at 20 heights is far away.
        distance = 20.0 if self.length is None else self.length / self.height
        factor, arm = smooth_wall(self.nu, distance)

        # Frequencies [Hz]: of a harmonic motion with this peak and this range of velocity, and of
        # the layer.
        speed = 0.5 * float(np.ptp(cumulative_trapezoid(push, t, initial=0.0)))
        lowest = 0.25 * self.c_s / self.height
        why = ""
        if speed == 0.0:
            why = "the motion turns round in every row: its steps are too long to be a slow motion"
        else:
            frequency = float(np.abs(push).max()) / (2.0 * math.pi * speed)
            if frequency > SLOW * lowest:
                why = (
                    f"the motion has {frequency:.3g} Hz, above {SLOW:g} of the layer's "
                    f"{lowest:.3g} Hz"
                )
        thrust = factor * self.rho * push.max() * self.height**2
        return thrust, arm * self.height, why


@dataclass(frozen=True, kw_only=True)
class VeletsosYounan(LayerCheck):
    """Expect the added thrust under the whole motion.

    The theory leaves vertical stresses out; under slow motions it gives 3 to 6 % more than
    ``Wood``'s. In its formula w_n = n pi c_s/(2 H), n odd.

    Attributes:
        damping: xi of the soil, hysteretic.
    """

    formula: ClassVar[Formula] = Formula(
        text=(
            "ΔN = max Q(t), Q(ω) = κ ρ H² a(ω) Σ 16/(nπ)³ / √(1 - (ω/ω_n)²/(1+2iξ)), κ = "
            "2/√((1-ν)(2-ν))"
        ),
        source="Veletsos and Younan 1994",
        range="a rigid smooth wall of which at most 5 % opens; a long elastic layer on rock",
        fields=("height", "rho", "nu", "c_s", "damping"),
        reads=LAYER_COLUMNS,
        answers=WALL_ANSWERS,
        reading=ELASTIC,
    )

    damping: Annotated[float, Positive, RATIO] = 0.05

    def find_added_thrust(self, t: Array, push: Array) -> tuple[float, float, str]:
        """Return the largest Q [N/m] and its height [m]; the theory applies to any motion."""
        steps = len(t) - 1
        dt = float(t[-1] - t[0]) / steps
        lowest = 0.5 * math.pi * self.c_s / self.height  # w_1 [rad/s]

        # The motion at even times, with zeros behind it until all has died out.
        count = 2 * steps + math.ceil(min(8.0 / (self.damping * lowest * dt), 100.0 * steps))
        even_times = t[0] + dt * np.arange(steps + 1)
        motion = np.fft.rfft(np.interp(even_times, t, push), count)
        w = 2.0 * math.pi * np.fft.rfftfreq(count, dt) / lowest

        # The series over the odd modes n, of thrust over kappa rho H² and of moment over H times
        # that, at every frequency.
        thrust = 0.0 * motion
        moment = 0.0 * motion
        for n, sign in zip(range(1, 80, 2), 20 * (1.0, -1.0), strict=True):
            mode = motion / np.sqrt(1.0 - (w / n) ** 2 / (1.0 + 2j * self.damping))
            thrust = thrust + 16.0 / (n * math.pi) ** 3 * mode
            moment = moment + sign * 32.0 / (n * math.pi) ** 4 * mode

        # Back to time; the height is that of the instant of the largest thrust.
        thrust_in_time = np.fft.irfft(thrust, count)[: steps + 1]
        row = int(np.argmax(thrust_in_time))
        kappa = 2.0 / math.sqrt((1.0 - self.nu) * (2.0 - self.nu))
        arm = np.fft.irfft(moment, count)[row] / thrust_in_time[row]
        largest_thrust = kappa * self.rho * self.height**2 * thrust_in_time[row]
        return float(largest_thrust), self.height * float(arm), ""
