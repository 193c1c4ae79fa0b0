"""Shake level ground whose layers soften and damp as they are sheared.

Columns are equivalent-linear, as in SHAKE.

Vertical shear waves in layers on rock, in the frequency domain; depth z from the top of a layer,
downwards:

    u = A exp(i (w t + k z)) + B exp(i (w t - k z)),    k = w sqrt(rho/G*),    G* = G (1 + 2 i xi)

Every layer has one G and one xi, those of its curves at ``ratio`` times the largest strain in its
middle, and the waves are computed again until neither changes by more than ``tolerance``. Sources:
Schnabel, Lysmer and Seed, EERC 72-12 (1972); Idriss and Sun, SHAKE91 (1992); Kramer (1996), ch.
7.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len

from ...core.algebra import Array, Comm, SerialComm, largest
from ...core.arguments import checked
from ...core.checks import instance, number, optional, refuse, several, shown, whole
from ...core.errors import InputError, ViContactError
from ...core.quantities import Positive, Unit
from ...laws.materials import LinearElastic
from ..ground_motion.record import Record
from .curves import SoilCurves
from .soil_column import SoilColumn

T = TypeVar("T")
ROCK_DAMPING = 0.01
# its thickness [m], its material at small strains, its curves
Layer = tuple[float, LinearElastic, SoilCurves]


@dataclass(frozen=True)
class SiteResponse:
    """Hold what ``equivalent_linear`` found.

    From the top: ``shear`` [Pa] and ``damping`` of every layer, and its largest ``strain``, (n,);
    ``surface``: the motion at the surface; ``iterations``: how many it took.
    """

    layers: tuple[Layer, ...]
    shear: Array
    damping: Array
    strain: Array
    surface: Record
    iterations: int

    @checked
    def column(
        self,
        *,
        frequency: Annotated[float, Positive, Unit("Hz")],
        height: Annotated[float, Positive, Unit("m")],
    ) -> SoilColumn:
        """Return the column for runs in time.

        Its base is at y = 0. It is damped by beta = xi / (pi f) at this frequency. Its
        elements have at most this height, and Poisson's ratio is that of the layers.
        """
        f, most = float(frequency), float(height)
        thick = np.array([thickness for thickness, _, _ in self.layers])
        parts = np.ceil(thick / most * (1.0 - 1e-9)).astype(int)
        rows = zip(self.layers, self.shear, self.damping, strict=True)
        values = np.array(
            [
                (2.0 * one.nu / (1.0 - 2.0 * one.nu) * shear, shear, one.rho, 0.0, xi / (np.pi * f))
                for (_, one, _), shear, xi in rows
            ]
        )
        heights = np.concatenate([[0.0], np.cumsum(np.repeat(thick / parts, parts)[::-1])])
        return SoilColumn(heights, *np.repeat(values, parts, axis=0)[::-1].T)


def equivalent_linear(
    layers: Sequence[Layer],
    record: Record,
    *,
    rock: LinearElastic | None = None,
    rock_damping: float = ROCK_DAMPING,
    ratio: float = 0.65,
    tolerance: float = 0.01,
    frequency: float | None = None,
    most: int = 50,
) -> SiteResponse:
    """Return the response of layers to a record along the surface.

    layers: (thickness [m], material at small strains, curves) of each, from the top. rock: the
    half-space below, whose *outcrop* the record is of; None: the record is of the base itself
    (*within*). ratio: of the effective to the largest strain, 0.65 or (M - 1)/10 for magnitude M.
    tolerance: relative, of G and xi. frequency: None for xi at all frequencies; f [Hz] for G* = G
    (1 + 2 i xi w/(2 pi f)), the damping of ``column`` and DampingRatio. The record is followed by
    as long a quiet time. InputError where the effective strain ends beyond its curves;
    ViContactError without convergence in so many iterations.
    """
    owner = "equivalent_linear"
    remedy = "give (thickness, LinearElastic, SoilCurves) of each layer, from the top"
    layers = tuple(
        several(owner, "a layer", one, remedy) for one in several(owner, "layers", layers, remedy)
    )
    if not layers or any(len(one) != 3 for one in layers):
        raise InputError(f"{owner}: layers is {shown(layers)}; {remedy}")
    for thickness, material, curves in layers:
        number(owner, "the thickness [m]", thickness, positive=True)
        instance(owner, "the material", material, LinearElastic, remedy)
        instance(owner, "the curves", curves, SoilCurves, remedy)
        if material.xi:
            raise InputError(
                f"{owner}: the material of a layer has the damping ratio xi = {material.xi:g}, and "
                "the curves of the layer give its damping; leave xi out"
            )
    instance(owner, "record", record, Record, "give a Record, such as read_record returns")
    optional(instance, owner, "rock", rock, LinearElastic, "give a LinearElastic, or None")
    number(owner, "rock_damping", rock_damping, not_negative=True)
    if rock is None and rock_damping not in (0.0, ROCK_DAMPING):
        raise InputError(
            f"{owner}: rock_damping = {shown(rock_damping)} has no rock to damp; give rock too, or "
            "leave it out"
        )
    if rock is not None and rock.xi:
        raise InputError(
            f"{owner}: the rock has the damping ratio xi = {rock.xi:g}, which is not read here; "
            "give rock_damping, and leave xi out"
        )
    optional(number, owner, "frequency", frequency, positive=True)
    number(owner, "ratio", ratio, positive=True)
    n = next_fast_len(2 * record.acceleration.size)
    w = 2.0 * np.pi * np.fft.rfftfreq(n, record.dt)
    # of xi over the frequency
    slope = np.ones_like(w) if frequency is None else w / (2.0 * np.pi * frequency)
    motion = np.fft.rfft(record.acceleration, n)
    below = (
        None
        if rock is None
        else np.sqrt(rock.rho * rock.shear_modulus * (1.0 + 2j * rock_damping * slope))
    )
    stiff = np.array([material.shear_modulus for _, material, _ in layers])

    def softened(strain: Array) -> Array:
        return np.array(
            [curves.at(ratio * x) for (_, _, curves), x in zip(layers, strain, strict=True)]
        ).T

    def run(values: Array) -> tuple[tuple[Any, Array], Array]:
        top, sheared = _waves(layers, stiff * values[0], values[1], w, slope, below)
        strain = np.abs(np.fft.irfft(sheared * motion, n)).max(axis=1)
        return (top, strain), softened(strain)

    start, alone = softened(np.zeros(len(layers))), SerialComm()
    (top, strain), values, changes = iterated(owner, run, start, tolerance, most, alone)
    refuse(
        [
            layer[2].beyond(ratio * x, f"in layer {place} from the top")
            for place, (layer, x) in enumerate(zip(layers, strain, strict=True), start=1)
        ],
        alone,
    )
    surface = np.fft.irfft(top * motion, n)[: record.acceleration.size]
    risen = record.changed(surface, f"at the surface of {len(layers)} equivalent-linear layers")
    return SiteResponse(layers, stiff * values[0], values[1], strain, risen, len(changes))


def iterated(
    owner: str,
    run: Callable[[Array], tuple[T, Array]],
    values: Array,
    tolerance: float,
    most: int,
    comm: Comm,
) -> tuple[T, Array, tuple[float, ...]]:
    """Return (what the last run returned, the values it had, changes) of runs.

    It does so as soon as none of run(values) -> (…, new values) changes by more than the tolerance,
    relative to the new one. ViContactError after so many runs. Collective.
    """
    number(owner, "tolerance", tolerance, positive=True)
    changes: list[float] = []
    for _ in range(whole(owner, "most", most, least=1)):
        found, new = run(values)
        change = np.abs(new - values) / np.where(new > 0.0, new, np.inf)
        changes.append(largest(comm, change.max(initial=0.0)))
        if changes[-1] <= tolerance:
            return found, values, tuple(changes)
        values = new
    raise ViContactError(
        f"{owner}: after {most} runs G or damping still change by {100.0 * changes[-1]:.2g} %: the "
        "motion is too strong for this soil, or give a larger most"
    )


def _waves(
    layers: Sequence[Layer],
    shear: Array,
    xi: Array,
    w: Array,
    slope: Array,
    rock: NDArray[np.complex128] | None,
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Return the surface acceleration and the strains over the given acceleration.

    The strains are those in the middle of the layers, (n, frequencies).

    From the top down: B/A, and A over that of the layer below, of which none grows with depth or
    frequency. Below a base that moves as given any rock does.
    """
    thick, rho = np.array([[thickness, material.rho] for thickness, material, _ in layers]).T[
        :, :, None
    ]
    G = shear[:, None] * (1.0 + 2j * xi[:, None] * slope)
    k, z = w * np.sqrt(rho / G), np.sqrt(rho * G)
    a = z / np.vstack([z[1:], z[-1:] if rock is None else rock])
    fall = np.exp(-1j * k * thick)
    ratios, steps = [np.ones(len(w), dtype=complex)], []
    for down, e in zip(a, fall, strict=True):
        back = ratios[-1] * e**2
        up = 0.5 * (1.0 + down + (1.0 - down) * back)
        ratios.append(0.5 * (1.0 - down + (1.0 + down) * back) / up)
        steps.append(e / up)
    base = 1.0 + ratios.pop() if rock is None else 2.0  # an outcrop has twice the wave that goes up
    A = np.cumprod(np.array(steps)[::-1], axis=0)[::-1] / base
    rise = np.exp(0.5j * k * thick)
    with np.errstate(divide="ignore", invalid="ignore"):
        strain = -1j * k / w**2 * A * (rise - np.array(ratios[: len(layers)]) / rise)
    strain[:, w == 0.0] = 0.0
    return 2.0 * A[0], strain
