"""Give the data of Ahn (2012), section 8, with the readings of what the text leaves open.

The normal force is printed as r_N(0) = 100,000 and r_N(t) = 100,000/100t. Three readings, as |r_N|
>= 0:

    A    10⁵/(100 t) for t > 0
    B    10⁵/100^t
    C    10⁵/100^k at step k, t = k dt

Only C dies within a few steps, as the text's negligible loss by friction and its two Newton
iterations per step ask for. eps is printed as 102/5, read as 10⁻²/5 = 0.002; minus signs of the
initial data are lost: "moves downward".
"""

from collections.abc import Callable

from ..core.arguments import check_arguments
from ..core.checks import number
from .elements import Elements
from .tip import RegularisedFriction
from .values import Start

Force = Callable[[float], float]
FORCE = 1.0e5  # |r_N(0)| [N]
DT = 0.002
STEPS = 1000


@check_arguments
def published_mu(t: float, rate: float) -> float:
    """Return the coefficient mu = |slip rate|/100 [-] of Ahn (2012), section 8.

    Args:
        t: time [s], which is not used.
        rate: slip rate [m/s].

    Raises:
        InputError: the rate is no finite number.
    """
    return abs(number("published_mu", "the slip rate", rate, unit="m/s")) / 100.0


def published_start() -> Start:
    """Return the start u = -x/200 [m], v = -x [m/s] of Ahn (2012), section 8.

    theta = omega = 0 is CHOSEN, as the source does not state them.
    """
    return Start(u=lambda x: -x / 200.0, v=lambda x: -x)


def published_elements(count: int = 1000) -> Elements:
    """Return the elements of Ahn (2012), section 8, which are 1000.

    They have linear functions, exact integration and the cubic last rotation function.
    """
    return Elements(count, reduced_shear=False, published_end=True)


def published_friction(eps: float = 0.002) -> RegularisedFriction:
    """Return the friction of Ahn (2012), section 8, regularised with eps [m].

    Newton's method goes without safeguard until |F| <= 1e-10 N m.
    """
    return RegularisedFriction(eps, absolute=1e-10, safeguard=False)


def readings(dt: float = DT) -> dict[str, Force]:
    """Return the readings of |r_N|(t) [N] of Ahn (2012), section 8, by their letters.

    There is also "none", a free tip; dt > 0 [s] is the step of reading C.

    Raises:
        InputError: dt is not positive.
    """
    number("readings", "dt", dt, positive=True, unit="s")
    return {
        "none": lambda t: 0.0,
        "A": lambda t: FORCE / (100.0 * t) if t > 0.0 else FORCE,
        "B": lambda t: float(FORCE * 100.0**-t),
        "C": lambda t: float(FORCE * 100.0 ** -(t / dt)),
    }
