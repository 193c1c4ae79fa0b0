"""Expect what an earthquake adds to the pressure on a wall.

The theories are those of Mononobe and Okabe, Wood, Veletsos and Younan.

Mononobe and Okabe's wedge yields, and stands beside a run with elastic soil. Wood's, and Veletsos
and Younan's elastic layer of height H on rock is held by a rigid smooth wall that stays on it:
these are to be met by such a run.
"""

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from scipy.integrate import cumulative_trapezoid

from ....core.algebra import Array
from ....core.quantities import RATIO, Between, Positive, Unit
from .comparison import Formula, History, Length, Numbers, Poisson
from .earth_pressure_static import WALL_ANSWERS, WALL_COLUMNS, CoulombWedge, EarthPressure

# CHOSEN: share of the layer's lowest frequency below which inertia adds less than 5 %, 1/sqrt(1 -
# 0.3²)
SLOW = 0.3
# CHOSEN: share of the wall that may open, since soil that nothing presses down always does at its
# top
LIFTED = 0.05


def smooth_wall(nu: float, length: float, terms: int = 2000) -> tuple[float, float]:
    """Return Q/(rho a H²) and h/H of an elastic layer between smooth walls.

    The walls are rigid, at a distance ``length``/H.

    u = sum U_n(y) sin k x, v = sum V_n(y) cos k x, k = n pi/length, n odd, with u = v = 0 on the
    rock and free ground above: exact plane strain (Wood 1973). Q and its moment follow by
    equilibrium from the stresses on the rock.
    """
    n = 2.0 * np.arange(1, terms + 1) - 1.0
    k = n * math.pi / length
    # whose ratios change no more
    sinh, cosh = (np.sinh(np.minimum(k, 300.0)), np.cosh(np.minimum(k, 300.0)))
    scale = -4.0 / (n * math.pi * k) / ((3.0 - 4.0 * nu) * cosh**2 + k**2 + (1.0 - 2.0 * nu) ** 2)
    shear = scale * ((1.0 - 2.0 * nu) * (2.0 * sinh * (cosh - nu) + 2.0 * k) + 2.0 * nu * k * cosh)
    vertical = scale * (k**2 + sinh**2 - 2.0 * nu * k * sinh - 4.0 * nu * (1.0 - nu) * (cosh - 1.0))
    thrust = 0.5 * length + float(np.sum(shear / k))
    return thrust, (0.25 * length + float(np.sum(vertical / k**2))) / thrust


@dataclass(frozen=True, kw_only=True)
class MononobeOkabe(CoulombWedge):
    """Expect the largest thrust of Coulomb's wedge.

    Weight and earthquake act together; the thrust acts at H/3 in this theory.

    kh, kv: accelerations towards the wall and upwards, of gravity. It applies as Coulomb's wedge
    does.
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
    )
    largest: ClassVar[bool] = True

    kh: Annotated[float, Between(0.0, 10.0), RATIO]
    kv: Annotated[float, Between(-0.9, 0.9), RATIO] = 0.0

    def coefficient(self, psi: float = 0.0) -> tuple[float, str]:
        """Return K (1 - kv) under gravity turned by psi [rad] and the earthquake, and why none."""
        found, why = super().coefficient(psi + math.atan(self.kh / (1.0 - self.kv)))
        return found * (1.0 - self.kv), why


LAYER_COLUMNS = ("t", "N_{part}", "height_{part}", "uplift_{part}", "{acceleration}")


@dataclass(frozen=True, kw_only=True)
class _Layer(EarthPressure):
    """Compare the largest thrust that is added to the first row's.

    Else compare the height of what is added.

    nu, c_s: Poisson's ratio and speed of shear waves [m/s] of the layer; on_left: of the wall, else
    on its right; acceleration: column of the ground's.
    """

    nu: Poisson
    c_s: Annotated[float, Positive, Unit("m/s")]
    on_left: bool = False
    acceleration: str = "a_g_x"

    @abstractmethod
    def added(self, t: Array, push: Array) -> tuple[float, float, str]:
        """Return the largest Q [N/m], its height [m], or why there is none.

        ``push`` is the acceleration towards the wall.
        """

    def numbers(self, history: History) -> Numbers:
        thrust, height, opened = (
            history[f"{name}_{self.part}"] for name in ("N", "height", "uplift")
        )
        push = history[self.acceleration] * (-1.0 if self.on_left else 1.0)
        row, moment, peak = (
            int(np.argmax(thrust)),
            thrust * np.nan_to_num(height),
            float(push.max()),
        )
        more, left = float(thrust[row] - thrust[0]), float(opened.max())
        if len(push) < 3 or peak <= 0.0 or more <= 0.0:
            return (
                math.nan,
                more,
                f"{self.acceleration} never presses the soil on the wall: check sign and side",
                {},
            )
        most, arm, why = self.added(history["t"], push)
        why = why or (f"up to {left:.0%} of the wall leaves the soil" if left > LIFTED else "")
        if self.of == "height":
            return arm, float(moment[row] - moment[0]) / more, why, {"a": (peak, "m/s²")}
        return most, more / self.width, why, {"a": (peak, "m/s²")}


@dataclass(frozen=True, kw_only=True)
class Wood(_Layer):
    """Expect the added thrust of a slow motion on a smooth wall, exact in plane strain.

    length: distance to the next smooth rigid wall [m], such as a side of the model that holds u;
    None: far away. It applies below 0.3 of the layer's lowest frequency, c_s/(4 H); that of a
    motion is max a/(pi (max v - min v)).
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
    )

    length: Length | None = None

    def added(self, t: Array, push: Array) -> tuple[float, float, str]:
        """Return the largest Q [N/m], its height [m], and why there is none."""
        factor, arm = smooth_wall(
            self.nu, 20.0 if self.length is None else self.length / self.height
        )
        speed, lowest = (
            0.5 * float(np.ptp(cumulative_trapezoid(push, t, initial=0.0))),
            0.25 * self.c_s / self.height,
        )
        own = float(np.abs(push).max()) / (2.0 * math.pi * speed)
        why = f"the motion has {own:.3g} Hz, above {SLOW:g} of the layer's {lowest:.3g} Hz"
        return (
            factor * self.rho * push.max() * self.height**2,
            arm * self.height,
            why if own > SLOW * lowest else "",
        )


@dataclass(frozen=True, kw_only=True)
class VeletsosYounan(_Layer):
    """Expect the added thrust under the whole motion.

    The theory leaves vertical stresses out.

    damping: xi of the soil, hysteretic; w_n = n pi c_s/(2 H), n odd. Slow ones give 3 to 6 % more
    than ``Wood``'s.
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
    )

    damping: Annotated[float, Positive, RATIO] = 0.05

    def added(self, t: Array, push: Array) -> tuple[float, float, str]:
        """Return the largest Q [N/m], its height [m], and why there is none."""
        steps, lowest = len(t) - 1, 0.5 * math.pi * self.c_s / self.height
        dt = float(t[-1] - t[0]) / steps
        # until all has died out
        count = 2 * steps + math.ceil(min(8.0 / (self.damping * lowest * dt), 100.0 * steps))
        motion = np.fft.rfft(np.interp(t[0] + dt * np.arange(steps + 1), t, push), count)
        w, thrust, moment = (
            2.0 * math.pi * np.fft.rfftfreq(count, dt) / lowest,
            0.0 * motion,
            0.0 * motion,
        )
        for n, sign in zip(range(1, 80, 2), 20 * (1.0, -1.0), strict=True):
            mode = motion / np.sqrt(1.0 - (w / n) ** 2 / (1.0 + 2j * self.damping))
            thrust, moment = (
                thrust + 16.0 / (n * math.pi) ** 3 * mode,
                moment + sign * 32.0 / (n * math.pi) ** 4 * mode,
            )
        each = np.fft.irfft(thrust, count)[: steps + 1]
        row, kappa = int(np.argmax(each)), 2.0 / math.sqrt((1.0 - self.nu) * (2.0 - self.nu))
        arm, most = (
            np.fft.irfft(moment, count)[row] / each[row],
            kappa * self.rho * self.height**2 * each[row],
        )
        return float(most), self.height * float(arm), ""
