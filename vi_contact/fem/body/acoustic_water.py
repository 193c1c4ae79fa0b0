"""Let compressible water move before a wet face (in the plane), as a body of its own unknowns.

The water obeys p''/c² = div grad p with p = 0 at the level, and sends waves out through boundaries:

    dp/dn = -p'/c  at the far end,    dp/dn = -q p',  q = (1 - alpha)/((1 + alpha) c)  on the bottom

with n out of the water: a wave that meets the bottom at right angles comes back alpha times as
large. G. Fenves and A. K. Chopra, Earthq. Eng. Struct. Dyn. 12 (1984) 663-680.

**Unknowns.** A velocity potential (G. C. Everstine, J. Sound Vib. 79 (1981) 157-160) has a coupling
in C that is skew, so that A of a step has no symmetric factor; pressures make M and K unsymmetric.
Here the water is written in volumes [m³] instead, which are displacements. Into the share of node j
come

    w = Sᵀ u + z + E b,     S: ∫ psi_j u·n of the face, z: what is compressed, b: what flows out

and with Kp = ∫ grad·grad, Mp = ∫ psi psi/c² and the widths s of the outlets the energies are

    kinetic ½ rho w'ᵀ Kp⁻¹ w',   of compression ½ rho zᵀ Mp⁻¹ z,   loss rho Σ s b'²/q a second

with E = diag(s). Their equations of motion are those above: p = rho Kp⁻¹ w''. M, C and K are
**symmetric and positive**. So the water is a body like others: every scheme marches it, A of a step
is symmetric positive definite, its condensation to the contact is too, certificates hold, energies
of the run count the water, and its loss is damping.

**Fewer unknowns.** z = Mp Phi D y with the modes Phi of Kp, Mp up to a frequency, but Kp⁻¹ is kept
whole: the modes beyond are not left out, they are incompressible. With no mode at all, or for
c -> infinity, it is ``water_pressure``. y and b are scaled to metres.

Nothing holds b at rest. Springs, with a relaxation rate of 1e-9 c/h, give it one answer; in static
stages they are as stiff as the water (``FemSpace.hold_outlets``).
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.linalg import eigh
from scipy.sparse.linalg import eigsh, splu

from ...core.algebra import Array
from .water_pressure import assemble_grid

CELLS_OF_WAVE = 10.0  # columns of cells along the shortest wave
CELLS = 0.1  # of the depth: the widest column
OVERTONES = 8.0  # highest frequency of the modes over the lowest one, c/4h
SLACK = 1e-9  # of c/h: relaxation rate of the outlets
DENSE = 300  # nodes: up to here all modes are found at once
SPARE = 12  # modes beyond those that are expected


@dataclass(frozen=True)
class WaterData:
    """Say which water it is.

    Attributes:
        density: rho [kg/m³].
        speed: c [m/s].
        reflection: alpha of the bottom, 1 for one that is rigid.
        open_end: whether waves leave at the far end; else it stands still.
        length: its distance [m].
        highest: frequency of the last mode [Hz].
        thickness: of the section [m].
    """

    density: float
    speed: float
    reflection: float
    open_end: bool
    length: float
    highest: float
    thickness: float


@dataclass(frozen=True, eq=False)
class WaterEquations:
    """Hold the equations of the water: k face volumes s = Sᵀ u and w unknowns of its own.

    Attributes:
        of_face: rho Kp⁻¹ at the nodes of the face (k, k) [kg/m⁶].
        coupling: rho Kp⁻¹ between face and unknowns (k, w) [kg/m⁴].
        mass: (w, w) [kg].
        damping: (w,) [N s/m], those of the outlets.
        stiffness: (w,) [N/m].
        modes: number of modes, the first unknowns.
        at_end: (w,) share of the loss of each outlet that goes out at the far end.
    """

    of_face: Array
    coupling: Array
    mass: Array
    damping: Array
    stiffness: Array
    modes: int
    at_end: Array

    @property
    def count(self) -> int:
        """Return the number of unknowns, w."""
        return len(self.stiffness)

    @property
    def frequencies(self) -> Array:
        """Return the frequencies [Hz] of the modes, of a reservoir whose walls stand still."""
        mass = np.diag(self.mass)[: self.modes]
        return np.sqrt(self.stiffness[: self.modes] / mass) / (2.0 * np.pi)


def find_water(x: Array, y: Array, side: float, data: WaterData) -> WaterEquations:
    """Return the equations of the water before a face.

    Args:
        x: of the nodes of the face (k + 1,) [m].
        y: their heights [m], ascending from the bottom to the level, where p = 0.
        side: 1 where the water lies towards x > 0, else -1.
        data: of the water.
    """
    layers = len(y)
    depth = float(y[-1] - y[0])
    highest = data.highest

    # Columns of nodes: those of the face, moved away, until the far end stands upright.
    cells = count_columns(depth, data.length, highest, data.speed)
    far = x[0] + side * data.length
    columns = x[None, :] + np.linspace(0.0, 1.0, cells + 1)[:, None] * (far - x)[None, :]
    heights = np.broadcast_to(y, columns.shape)
    stiffness, mass = assemble_grid(columns.ravel(), heights.ravel(), cells + 1, layers)
    kept = np.arange(columns.size).reshape(columns.shape)[:, :-1].ravel()  # p = 0 at the level
    Kp = sp.csc_matrix(data.thickness * stiffness[kept][:, kept])
    Mp = sp.csc_matrix(data.thickness / data.speed**2 * mass[kept][:, kept])
    solve = splu(Kp).solve

    # Modes, and outlets: widths s of nodes, and s q of both boundaries.
    expected = count_modes(depth * data.length, highest, data.speed)
    squares, shapes = _find_modes(Kp, Mp, (2.0 * np.pi * highest) ** 2, expected)
    of_end, of_bottom = _measure_outlets(columns, y, data)
    leaks = of_end + of_bottom
    outlets = np.flatnonzero(leaks)
    widths = _measure_widths(columns, y, data.thickness)[outlets]

    # Unknowns in metres: a mode has the mass rho t h² of its amplitude, an outlet its width.
    scale = depth * np.sqrt(data.thickness * squares)
    shapes = shapes * scale
    volumes = np.zeros((len(kept), len(outlets)))
    volumes[outlets, np.arange(len(outlets))] = widths
    answers = np.hstack([shapes / squares, solve(volumes)])  # Kp⁻¹ of Mp Phi D and of E

    # The kinetic energy ½ rho w'ᵀ Kp⁻¹ w' in these unknowns.
    face = np.zeros((len(kept), layers - 1))
    face[: layers - 1] = np.eye(layers - 1)  # the face is the first column of nodes
    of_face = solve(face)[: layers - 1]
    modes = len(squares)
    inner = np.zeros((answers.shape[1], answers.shape[1]))
    inner[:modes, :modes] = np.diag(scale**2 / squares)
    inner[:, modes:] = answers.T @ volumes
    inner[modes:, :modes] = inner[:modes, modes:].T
    damping = np.zeros(answers.shape[1])
    damping[modes:] = data.density * widths**2 / leaks[outlets]
    springs = SLACK * data.speed / depth * damping
    springs[:modes] = data.density * scale**2
    at_end = np.zeros(answers.shape[1])
    at_end[modes:] = of_end[outlets] / leaks[outlets]
    return WaterEquations(
        of_face=0.5 * data.density * (of_face + of_face.T),
        coupling=data.density * answers[: layers - 1],
        mass=0.5 * data.density * (inner + inner.T),
        damping=damping,
        stiffness=springs,
        modes=modes,
        at_end=at_end,
    )


def count_columns(depth: float, length: float, highest: float, speed: float) -> int:
    """Return how many columns of cells the water has.

    Args:
        depth: of the water [m].
        length: distance of the far end [m].
        highest: frequency of the last mode [Hz].
        speed: c [m/s].
    """
    widest = min(CELLS * depth, speed / (CELLS_OF_WAVE * highest))
    return max(1, int(np.ceil(length / widest)))


def count_modes(area: float, highest: float, speed: float) -> float:
    """Return about how many modes there are up to a frequency, by Weyl's law.

    Args:
        area: of the water [m²].
        highest: the frequency [Hz].
        speed: c [m/s].
    """
    return float(np.pi * area * (highest / speed) ** 2)


def _find_modes(
    Kp: sp.csc_matrix, Mp: sp.csc_matrix, most: float, expected: float
) -> tuple[Array, Array]:
    """Return squares of angular frequencies (m,) up to ``most``, and modes with Phiᵀ Mp Phi = 1.

    About so many are ``expected``.

    Each mode begins with a value above zero at its largest entry, so that a restart finds the same.
    """
    n = Kp.shape[0]
    wanted = SPARE + int(expected)
    while True:
        if n <= DENSE or wanted >= n // 2:
            squares, shapes = eigh(Kp.toarray(), Mp.toarray())
        else:
            squares, shapes = eigsh(Kp, wanted, Mp, sigma=0.0, v0=np.ones(n))
        if len(squares) == n or squares.max() > most:
            break
        wanted *= 2
    order = np.argsort(squares)
    chosen = order[squares[order] <= most]
    shapes = shapes[:, chosen]
    largest = shapes[np.argmax(np.abs(shapes), axis=0), np.arange(len(chosen))]
    return squares[chosen], shapes * np.where(largest < 0.0, -1.0, 1.0)


def _measure_outlets(columns: Array, y: Array, data: WaterData) -> tuple[Array, Array]:
    """Return s q of all nodes below the level, of the far end and of the bottom [m s].

    Args:
        columns: x of the nodes, a row for each column of nodes [m].
        y: heights of a column [m].
        data: of the water.
    """
    of_end = np.zeros((len(columns), len(y) - 1))
    of_bottom = np.zeros_like(of_end)
    if data.open_end:
        of_end[-1] = data.thickness / data.speed * _share(np.diff(y))[:-1]
    leak = (1.0 - data.reflection) / ((1.0 + data.reflection) * data.speed)
    of_bottom[:, 0] = data.thickness * leak * _share(np.abs(np.diff(columns[:, 0])))
    return of_end.ravel(), of_bottom.ravel()


def _measure_widths(columns: Array, y: Array, thickness: float) -> Array:
    """Return the area s [m²] of the boundary about each node below the level.

    Args:
        columns: as in ``_measure_outlets``.
        y: the like.
        thickness: of the section [m].
    """
    area = np.zeros((len(columns), len(y) - 1))
    area[-1] = _share(np.diff(y))[:-1]
    area[:, 0] += _share(np.abs(np.diff(columns[:, 0])))
    return thickness * area.ravel()


def _share(lengths: Array) -> Array:
    """Return the length of the nodes of a line, half of the cells beside each [m]."""
    halves = np.zeros(len(lengths) + 1)
    halves[:-1] += 0.5 * lengths
    halves[1:] += 0.5 * lengths
    return halves
