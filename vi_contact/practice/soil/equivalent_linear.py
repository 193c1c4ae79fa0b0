"""Shake level ground whose layers soften and damp as they are sheared, equivalent-linearly.

Vertical shear waves in layers on rock, in the frequency domain; depth z from the top of a layer,
downwards:

    u = A exp(i (w t + k z)) + B exp(i (w t - k z)),    k = w sqrt(rho/G*),    G* = G (1 + 2 i xi)

Every layer has one G and one xi, those of its curves at ``ratio`` times the largest strain in its
middle, and the waves are computed again until neither changes by more than ``tolerance``, as in
SHAKE. Sources:
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
from ...core.arguments import check_arguments
from ...core.checks import instance, number, optional, quote, refuse, several, whole
from ...core.errors import InputError, ViContactError
from ...core.quantities import Positive, Unit
from ...laws.materials import LinearElastic, require_mass
from ..ground_motion.record import Record
from .curves import SoilCurves
from .soil_column import SoilColumn

T = TypeVar("T")
ROCK_DAMPING = 0.01
# its thickness [m], its material at small strains, its curves
Layer = tuple[float, LinearElastic, SoilCurves]


@dataclass(frozen=True)
class SiteResponse:
    """Hold the response of n layers to a record.

    Attributes:
        layers: thickness, material at small strains and curves of each, from the top.
        shear: (n,) shear modulus of each layer [Pa].
        damping: (n,) damping ratio of each layer.
        strain: (n,) largest shear strain in the middle of each layer.
        surface: the motion at the surface.
        iterations: how often the waves were computed.
    """

    layers: tuple[Layer, ...]
    shear: Array
    damping: Array
    strain: Array
    surface: Record
    iterations: int

    @check_arguments
    def column(
        self,
        *,
        frequency: Annotated[float, Positive, Unit("Hz")],
        height: Annotated[float, Positive, Unit("m")],
    ) -> SoilColumn:
        """Return the column for runs in time, with its base at y = 0.

        Poisson's ratio is that of the layers.

        Args:
            frequency: f at which the column is damped by beta = xi / (pi f) [Hz].
            height: most that an element has [m].
        """
        f = float(frequency)
        most = float(height)
        thick = np.array([thickness for thickness, _, _ in self.layers])
        parts = np.ceil(thick / most * (1.0 - 1e-9)).astype(int)
        heights_of_elements = np.repeat(thick / parts, parts)[::-1]  # from the base
        heights = np.concatenate([[0.0], np.cumsum(heights_of_elements)])

        def elements(of_layers: Array) -> Array:
            """Return values of the elements from the base, of those of the layers from the top."""
            return np.repeat(of_layers, parts)[::-1]

        nu = np.array([material.nu for _, material, _ in self.layers])
        rho = np.array([material.rho for _, material, _ in self.layers])
        return SoilColumn(
            heights=heights,
            lame=elements(2.0 * nu / (1.0 - 2.0 * nu) * self.shear),
            shear=elements(self.shear),
            rho=elements(rho),
            alpha=elements(np.zeros(len(thick))),
            beta=elements(self.damping / (np.pi * f)),
        )


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

    The record is followed by as long a quiet time.

    Args:
        layers: (thickness [m], material at small strains, curves) of each, from the top.
        record: the motion at the base.
        rock: the half-space below, whose *outcrop* the record is of. None where the record is of
            the base itself (*within*).
        rock_damping: damping ratio of the rock.
        ratio: of the effective to the largest strain, 0.65 or (M - 1)/10 for magnitude M.
        tolerance: largest relative change of G and xi that ends the iteration.
        frequency: None for xi at all frequencies; f [Hz] for G* = G (1 + 2 i xi w/(2 pi f)), the
            damping of ``column`` and DampingRatio.
        most: number of iterations after which it gives up.

    Returns:
        The response with the G and xi of the last iteration.

    Raises:
        InputError: an effective strain that ends beyond its curves.
        ViContactError: no convergence in so many iterations.
    """
    owner = "equivalent_linear"
    layers = _check_layers(owner, layers)
    instance(owner, "record", record, Record, "give a Record, such as read_record returns")
    _check_rock(owner, rock, rock_damping)
    optional(number, owner, "frequency", frequency, positive=True)
    number(owner, "ratio", ratio, positive=True)

    # The record and the impedance of the rock at all frequencies; slope is that of xi over w.
    n = next_fast_len(2 * record.acceleration.size)
    w = 2.0 * np.pi * np.fft.rfftfreq(n, record.dt)
    slope = np.ones_like(w) if frequency is None else w / (2.0 * np.pi * frequency)
    motion = np.fft.rfft(record.acceleration, n)
    below = None
    if rock is not None:
        below = np.sqrt(rock.rho * rock.shear_modulus * (1.0 + 2j * rock_damping * slope))
    stiff = np.array([material.shear_modulus for _, material, _ in layers])

    def soften(strain: Array) -> Array:
        """Return G/Gmax and xi (2, layers) at ``ratio`` times the largest strains."""
        values = []
        for (_, _, curves), largest_strain in zip(layers, strain, strict=True):
            values.append(curves.at(ratio * largest_strain))
        return np.array(values).T

    def run(values: Array) -> tuple[tuple[Any, Array], Array]:
        """Return the waves with these G/Gmax and xi: (surface, strains), and what these ask for."""
        reduction, damping = values
        top, sheared = _solve_waves(layers, stiff * reduction, damping, w, slope, below)
        strain = np.abs(np.fft.irfft(sheared * motion, n)).max(axis=1)
        return (top, strain), soften(strain)

    alone = SerialComm()
    start = soften(np.zeros(len(layers)))
    (top, strain), values, changes = iterate(owner, run, start, tolerance, most, alone)
    faults = []
    for place, ((_, _, curves), largest_strain) in enumerate(
        zip(layers, strain, strict=True), start=1
    ):
        faults.append(curves.beyond(ratio * largest_strain, f"in layer {place} from the top"))
    refuse(faults, alone)
    reduction, damping = values
    surface = np.fft.irfft(top * motion, n)[: record.acceleration.size]
    risen = record.changed(surface, f"at the surface of {len(layers)} equivalent-linear layers")
    return SiteResponse(layers, stiff * reduction, damping, strain, risen, len(changes))


def _check_layers(owner: str, layers: Sequence[Layer]) -> tuple[Layer, ...]:
    """Return the layers as tuples, or raise InputError for what is none."""
    remedy = "give (thickness, LinearElastic, SoilCurves) of each layer, from the top"
    checked_layers = tuple(
        several(owner, "a layer", layer, remedy)
        for layer in several(owner, "layers", layers, remedy)
    )
    if not checked_layers or any(len(layer) != 3 for layer in checked_layers):
        raise InputError(f"{owner}: layers is {quote(checked_layers)}; {remedy}")
    for thickness, material, curves in checked_layers:
        number(owner, "the thickness [m]", thickness, positive=True)
        instance(owner, "the material", material, LinearElastic, remedy)
        instance(owner, "the curves", curves, SoilCurves, remedy)
        require_mass(owner, "the material of a layer", material)
        if material.xi:
            raise InputError(
                f"{owner}: the material of a layer has the damping ratio xi = {material.xi:g}, and "
                "the curves of the layer give its damping; leave xi out"
            )
    return checked_layers


def _check_rock(owner: str, rock: LinearElastic | None, rock_damping: float) -> None:
    """Raise InputError for a rock that cannot be read, or a damping without rock."""
    optional(instance, owner, "rock", rock, LinearElastic, "give a LinearElastic, or None")
    number(owner, "rock_damping", rock_damping, not_negative=True)
    if rock is None and rock_damping not in (0.0, ROCK_DAMPING):
        raise InputError(
            f"{owner}: rock_damping = {quote(rock_damping)} has no rock to damp; give rock too, or "
            "leave it out"
        )
    if rock is None:
        return
    require_mass(owner, "the rock", rock)
    if rock.xi:
        raise InputError(
            f"{owner}: the rock has the damping ratio xi = {rock.xi:g}, which is not read here; "
            "give rock_damping, and leave xi out"
        )


def iterate(
    owner: str,
    run: Callable[[Array], tuple[T, Array]],
    values: Array,
    tolerance: float,
    most: int,
    comm: Comm,
) -> tuple[T, Array, tuple[float, ...]]:
    """Run again and again with new values until they no longer change. Collective.

    Args:
        owner: who asks, for messages.
        run: takes values and returns (anything, new values).
        values: to begin with.
        tolerance: largest change of a value, relative to the new one, that ends the runs.
        most: number of runs after which it gives up.
        comm: the ranks, each with values of its own.

    Returns:
        What the last run returned, the values it had, and the largest change after every run.

    Raises:
        ViContactError: the values still change after so many runs.
    """
    number(owner, "tolerance", tolerance, positive=True)
    changes: list[float] = []
    for _ in range(whole(owner, "most", most, least=1)):
        answer, new = run(values)
        change = np.abs(new - values) / np.where(new > 0.0, new, np.inf)
        changes.append(largest(comm, change.max(initial=0.0)))
        if changes[-1] <= tolerance:
            return answer, values, tuple(changes)
        values = new
    raise ViContactError(
        f"{owner}: after {most} runs G or damping still change by {100.0 * changes[-1]:.2g} %: the "
        "motion is too strong for this soil, or give a larger most"
    )


def _solve_waves(
    layers: Sequence[Layer],
    shear: Array,
    xi: Array,
    w: Array,
    slope: Array,
    rock: NDArray[np.complex128] | None,
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Return what n layers make of a unit acceleration at each frequency.

    Args:
        layers: from the top.
        shear: (n,), shear modulus of each [Pa].
        xi: (n,), damping ratio of each.
        w: (m,), circular frequencies [rad/s].
        slope: (m,), of xi over the frequency.
        rock: (m,), impedance of the rock below [Pa s/m]; None for a base that moves as given,
            below which any rock does.

    Returns:
        The acceleration of the surface (m,), and the strains in the middle of the layers (n, m).
    """
    thick = np.array([thickness for thickness, _, _ in layers])[:, None]
    rho = np.array([material.rho for _, material, _ in layers])[:, None]
    G = shear[:, None] * (1.0 + 2j * xi[:, None] * slope)
    k = w * np.sqrt(rho / G)
    z = np.sqrt(rho * G)

    # From the top down: B/A of each layer, and A over that of the layer below. None of them grows
    # with depth or frequency, so that nothing overflows.
    impedance_ratios = z / np.vstack([z[1:], z[-1:] if rock is None else rock])
    fall = np.exp(-1j * k * thick)
    ratios = [np.ones(len(w), dtype=complex)]
    steps = []
    for impedance_ratio, e in zip(impedance_ratios, fall, strict=True):
        back = ratios[-1] * e**2
        up = 0.5 * (1.0 + impedance_ratio + (1.0 - impedance_ratio) * back)
        ratios.append(0.5 * (1.0 - impedance_ratio + (1.0 + impedance_ratio) * back) / up)
        steps.append(e / up)

    # The given acceleration is A + B of the base, or 2 A of an outcrop.
    last_ratio = ratios.pop()
    base = 1.0 + last_ratio if rock is None else 2.0
    A = np.cumprod(np.array(steps)[::-1], axis=0)[::-1] / base
    rise = np.exp(0.5j * k * thick)
    with np.errstate(divide="ignore", invalid="ignore"):
        strain = -1j * k / w**2 * A * (rise - np.array(ratios) / rise)
    strain[:, w == 0.0] = 0.0
    return 2.0 * A[0], strain
