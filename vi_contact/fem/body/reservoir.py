"""Put a reservoir before a wet face: its pressure at rest, silt, and the mass of its water.

At rest p = gamma (level - y) acts on the face and on the floor. A face that moves with the
acceleration a is pressed by more, and this is a mass M_w beside that of the body:

- "added mass": p = 7/8 rho sqrt(h (h - y)) a·n, with h the depth and y the height above the floor.
  H. M. Westergaard, Trans. ASCE 98 (1933) 418-433; on any slope J. S.-H. Kuo,
  Fluid-structure interactions: added mass computations for incompressible fluid,
  UCB/EERC-82/09 (1982).
- "incompressible": the exact pressure of incompressible water before this face, by Laplace's
  equation (``water_pressure``). A rigid wall then feels 0.5428 rho a h², Westergaard's formula
  gives 7/12 = 0.5833.
- "acoustic": compressible water, whose waves leave at the far end and through the bottom. It has
  unknowns of its own beside those of the body (``acoustic_water``, ``water_unknowns``).

The water moves with the ground sideways, and does not weigh: a horizontal acceleration r of the
ground is a load -(M + M_w) r, a vertical one -M r, and so is the weight. Damping by alpha M does
not count M_w.
"""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import ufl

from ...core.algebra import largest
from ...core.arguments import check_fields
from ...core.checks import instance, optional, quote
from ...core.errors import InputError
from ...core.quantities import RATIO, Between, Finite, NotNegative, Positive, Unit
from ...core.units import STANDARD_GRAVITY, WATER_WEIGHT
from .. import compat
from ..mesh.group_checks import facets_of
from ..mesh.tagged_mesh import Facets
from .acoustic_water import OVERTONES, WaterData, count_modes
from .loads import Pressure
from .space import FemSpace
from .water_pressure import find_compliance
from .water_unknowns import AcousticWater
from .wet_face import ALIKE, WetFace

MODELS = ("added mass", "incompressible", "acoustic", "at rest")
FAR_ENDS = ("open", "closed")
WESTERGAARD = 0.875
QUADRATURE = 8  # degree, for the root of the depth
FAR = 5.0  # of the depth: distance of the far end
MOST_MODES = 1000  # unknowns whose mass matrix is dense
SPEED_OF_SOUND = 1440.0  # of water [m/s]
OF_ACOUSTIC = {"speed": SPEED_OF_SOUND, "reflection": 1.0, "far_end": "open", "highest": None}


@dataclass(frozen=True)
class Reservoir:
    """Put water before a face by the equations of the module.

    Args:
        face: the wet face of the body.
        level: height of the water level [m], on the last axis of the mesh.
        model: "added mass", "incompressible", "acoustic", or "at rest" for the pressure at rest
            alone.
        floor: bottom of the reservoir, which the water presses too; None: it has none.
        tail_face: face of the tail water, at rest; given with ``tail``.
        tail: height of the tail water [m].
        silt: height of the silt before the face [m]; None: no silt.
        silt_weight: weight of the silt under water, gamma' [N/m³].
        silt_ratio: K, its horizontal pressure over the vertical one.
        gamma: weight of the water [N/m³].
        length: distance of the far end from the foot of the face [m], of "incompressible" and
            "acoustic" water; 5 times the depth when None.
        speed: c of "acoustic" water [m/s].
        reflection: alpha of the bottom of "acoustic" water, from 0 for one that takes all of a wave
            at right angles to 1 for a rigid one.
        far_end: of "acoustic" water, "open" to waves that leave, or "closed" by a wall at rest.
        highest: frequency [Hz] up to which "acoustic" water is compressible; 8 c/4h when None.
    """

    face: Facets
    level: Annotated[float, Finite, Unit("m"), "the level"]
    model: str = "added mass"
    floor: Facets | None = None
    tail_face: Facets | None = None
    tail: Annotated[float | None, Finite, Unit("m"), "the tail water"] = None
    silt: Annotated[float | None, Finite, Unit("m"), "the silt"] = None
    silt_weight: Annotated[float, NotNegative, Unit("N/m³"), "silt_weight"] = 9000.0
    silt_ratio: Annotated[float, NotNegative, RATIO, "silt_ratio"] = 0.5
    gamma: Annotated[float, Positive, Unit("N/m³"), "gamma"] = WATER_WEIGHT
    length: Annotated[float | None, Positive, Unit("m"), "the length"] = None
    speed: Annotated[float, Positive, Unit("m/s"), "the speed of sound"] = SPEED_OF_SOUND
    reflection: Annotated[float, Between(0.0, 1.0), RATIO, "the reflection of the bottom"] = 1.0
    far_end: str = "open"
    highest: Annotated[float | None, Positive, Unit("Hz"), "the highest frequency"] = None

    def __post_init__(self) -> None:
        check_fields(self)
        facets_of("Reservoir", "face", self.face)
        for name in ("floor", "tail_face"):
            optional(facets_of, "Reservoir", name, getattr(self, name))
        if self.model not in MODELS:
            raise InputError(
                f"Reservoir: model is {quote(self.model)}; give {' or '.join(map(quote, MODELS))}"
            )
        if self.far_end not in FAR_ENDS:
            raise InputError(
                f"Reservoir: far_end is {quote(self.far_end)}; give "
                f"{' or '.join(map(quote, FAR_ENDS))}"
            )
        self._refuse_unread()
        if (self.tail is None) != (self.tail_face is None):
            raise InputError(
                "Reservoir: tail and tail_face belong together: give the level of the tail water "
                "and its face, or none of the two"
            )
        if self.tail is not None and self.tail > self.level:
            raise InputError(
                f"Reservoir: the tail water at {self.tail:g} m is above the level {self.level:g} "
                "m: exchange face and tail_face"
            )

    def _refuse_unread(self) -> None:
        """Raise InputError for what the model does not read."""
        given = [name for name, usual in OF_ACOUSTIC.items() if getattr(self, name) != usual]
        if given and self.model != "acoustic":
            raise InputError(
                f"Reservoir: {given[0]} is for compressible water, and the model is "
                f"{quote(self.model)}: give model 'acoustic', or leave {given[0]} out"
            )
        if self.length is not None and self.model in ("added mass", "at rest"):
            raise InputError(
                f"Reservoir: length is for 'incompressible' and 'acoustic' water, and the model is "
                f"{quote(self.model)}: leave it out"
            )

    def make_loads(self) -> list[Pressure]:
        """Return the pressures at rest: of water, of silt and of the tail water."""
        loads = [Pressure(self.face, self._press_at(self.level, self.gamma))]
        if self.floor is not None:
            loads.append(Pressure(self.floor, self._press_at(self.level, self.gamma)))
        if self.silt is not None:
            weight = self.silt_ratio * self.silt_weight
            loads.append(Pressure(self.face, self._press_at(self.silt, weight)))
        if self.tail_face is not None and self.tail is not None:
            loads.append(Pressure(self.tail_face, self._press_at(self.tail, self.gamma)))
        return loads

    def name_loads(self) -> list[str]:
        """Return what the loads of ``make_loads`` are, such as "silt on 'face'"."""
        names = [f"water on '{self.face.name}'"]
        if self.floor is not None:
            names.append(f"water on '{self.floor.name}'")
        if self.silt is not None:
            names.append(f"silt on '{self.face.name}'")
        if self.tail_face is not None:
            names.append(f"tail water on '{self.tail_face.name}'")
        return names

    def _press_at(self, level: float, weight: float) -> Any:
        """Return the function (points, t) -> weight max(level - y, 0) [Pa]."""
        return lambda points, t: weight * np.maximum(level - points[:, -1], 0.0)

    def assemble_mass(self, space: FemSpace, thickness: float) -> Any:
        """Return M_w of all components (PETSc), None for water at rest. Collective.

        Args:
            space: the body's unknowns.
            thickness: of the section [m].

        Raises:
            InputError: a level above the face or below it, and faces that the model does not take.
        """
        bottom, top = self._find_ends(space)
        if self.model in ("at rest", "acoustic"):
            return None
        if self.model == "added mass":
            return self._assemble_westergaard(space, bottom, thickness)
        return self._assemble_exact(space, thickness)

    @property
    def density(self) -> float:
        """Return rho of the water [kg/m³]."""
        return self.gamma / STANDARD_GRAVITY

    def _find_ends(self, space: FemSpace) -> tuple[float, float]:
        """Return the lowest and the highest height [m] of nodes of the face. Collective.

        Raises:
            InputError: a level above the face or below it.
        """
        heights = space.points[space.facet_blocks(self.face.indices), -1]
        bottom = -largest(space.comm, np.max(-heights, initial=-np.inf))
        top = largest(space.comm, np.max(heights, initial=-np.inf))
        if self.level > top + ALIKE * (top - bottom):
            raise InputError(
                f"Reservoir: the level {self.level:g} m is above the top of '{self.face.name}' at "
                f"{top:g} m: water that flows over is not modelled, so give a lower level"
            )
        if self.level <= bottom:
            raise InputError(
                f"Reservoir: the level {self.level:g} m is below the foot of '{self.face.name}' at "
                f"{bottom:g} m: give a higher level, or leave the reservoir out"
            )
        return bottom, top

    def _assemble_westergaard(self, space: FemSpace, bottom: float, thickness: float) -> Any:
        """Return ∫ 7/8 rho sqrt(h (h - y)) (u·n)(v·n). Collective."""
        mesh = space.mesh
        u = ufl.TrialFunction(space.V)
        v = ufl.TestFunction(space.V)
        n = ufl.FacetNormal(mesh)
        below = ufl.max_value(self.level - ufl.SpatialCoordinate(mesh)[mesh.geometry.dim - 1], 0.0)
        mass = WESTERGAARD * self.density * ufl.sqrt((self.level - bottom) * below)
        measure = compat.measure(mesh, mesh.topology.dim - 1, self.face.indices)
        measure = measure(metadata={"quadrature_degree": QUADRATURE})
        form = thickness * mass * ufl.dot(u, n) * ufl.dot(v, n) * measure
        return compat.assemble_matrix(space.compile_form(form))

    def _assemble_exact(self, space: FemSpace, thickness: float) -> Any:
        """Return rho S G Sᵀ, with S the forces of nodal pressures and G of ``water_pressure``.

        Collective.
        """
        wet = self._find_wet_face(space, thickness)
        G = np.zeros((wet.nodes, wet.nodes))
        G[np.ix_(wet.below, wet.below)] = find_compliance(
            wet.x, wet.y, wet.side, self._find_length(wet)
        )[:-1, :-1]
        # S has the thickness on both sides, and the water has it once
        return wet.spread(space, self.density / thickness * G)

    def _find_wet_face(self, space: FemSpace, thickness: float) -> WetFace:
        """Return the wet face of "incompressible" and "acoustic" water. Collective."""
        if space.dimension != 2:
            raise InputError(
                f"Reservoir: model {quote(self.model)} is for the plane: give 'added mass' in space"
            )
        return WetFace(space, self.face, self.level, thickness)

    def _find_length(self, wet: WetFace) -> float:
        """Return the distance of the far end [m], which lies beyond all of the face."""
        length = self.length or FAR * wet.depth
        reach = float(np.max(wet.side * (wet.x - wet.x[0])))
        if length <= reach:
            raise InputError(
                f"Reservoir: the length {length:g} m ends within '{self.face.name}', which reaches "
                f"{reach:g} m over the water: give a larger one"
            )
        return length

    def make_water(self, space: FemSpace, thickness: float) -> AcousticWater:
        """Return compressible water, whose unknowns are added to those of the body. Collective.

        Args:
            space: the body's unknowns.
            thickness: of the section [m].

        Raises:
            InputError: bodies that come and go by stages, and what ``assemble_mass`` refuses.
        """
        if space.absent is not None:
            raise InputError(
                "Reservoir: model 'acoustic' does not go with bodies that come and go by stages: "
                "give 'incompressible' or 'added mass'"
            )
        self._find_ends(space)
        wet = self._find_wet_face(space, thickness)
        length = self._find_length(wet)
        highest = self.highest or OVERTONES * self.speed / (4.0 * wet.depth)
        modes = count_modes(wet.depth * length, highest, self.speed)
        if modes > MOST_MODES:
            raise InputError(
                f"Reservoir: water that is compressible up to {highest:g} Hz over {length:g} m has "
                f"about {modes:.0f} modes, and {MOST_MODES} is the most: give a lower highest, or "
                "a smaller length"
            )
        data = WaterData(
            density=self.density,
            speed=self.speed,
            reflection=self.reflection,
            open_end=self.far_end == "open",
            length=length,
            highest=highest,
            thickness=thickness,
        )
        return AcousticWater(space, wet, data)


def add_water(reservoir: Reservoir, space: FemSpace, thickness: float) -> None:
    """Give the unknowns of a body those of compressible water, if there is some. Collective.

    Args:
        reservoir: the reservoir.
        space: the body's unknowns, which are changed.
        thickness: of the section [m].
    """
    if reservoir.model == "acoustic":
        space.water = reservoir.make_water(space, thickness)


def list_pressures(reservoir: Any) -> list[Pressure]:
    """Return the pressures at rest of a reservoir; none without one.

    Raises:
        InputError: it is no ``Reservoir``.
    """
    if reservoir is None:
        return []
    remedy = "give fem.Reservoir(…), or leave it out"
    instance("assemble", "reservoir", reservoir, Reservoir, remedy)
    pressures: list[Pressure] = reservoir.make_loads()
    return pressures
