"""Check the parts of a contact problem: kinds of objects, sizes, and what was made for what.

Identity counts: a surface that ``fem`` made carries the space it was made on, and only systems of that space take it.
Sizes are compared on all ranks together, so that all of them raise the same sentence.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from .checks import array, instance, optional, provides, refuse
from .corners import refuse_rubbing
from .errors import InputError
from .surfaces import ContactSurface
from .system import SemiDiscreteSystem

EXCITATION = ("acceleration", "direction", "duration")


def check_parts(problem: Any) -> None:
    """Raise InputError, on all ranks, for parts of the wrong kind or size, or made for another system. Collective."""
    owner, system, surface, excitations = "ContactProblem", problem.system, problem.surface, problem.excitations
    instance(owner, "system", system, SemiDiscreteSystem, "give a system, such as fem.assemble returns")
    instance(owner, "surface", surface, ContactSurface, "give a contact surface, such as fem.contact_surface returns")
    provides(owner, "friction", problem.friction, ("limit", "slope", "at"), "give Coulomb(mu) or another friction law")
    optional(provides, owner, "impact", problem.impact, ("target", "apply"), "give Inelastic() or another law, or None")
    if problem.mass is not None:
        remedy = "give Redistributed() or ConsistentMass(), or None"
        provides(owner, "mass", problem.mass, ("apply",), remedy, lacks=("target",))
    for excitation in excitations:
        _check_excitation(excitation, system)
    if system.absolute and excitations:
        raise InputError("a compliant base is shaken by its own upgoing motion: leave the excitation of the problem "
                         "out, its inertia load is that of a rigid base")
    if surface.space is not None and surface.space is not system.space:
        raise InputError("ContactProblem: the contact surface was made for another system, whose unknowns are others: "
                         "make it for this one, fem.contact_surface(system, …)")
    if surface.comm.size != system.algebra.comm.size:
        raise InputError(f"ContactProblem: the surface is shared by {surface.comm.size} ranks and the system by "
                         f"{system.algebra.comm.size}: make both on the same ranks")
    refuse((*_of_system(system), *_of_surface(surface, system, surface.total)), surface.comm)
    if problem.frictional:
        refuse_rubbing(surface)


def _check_excitation(excitation: Any, system: SemiDiscreteSystem) -> None:
    remedy = "give Harmonic(…), GroundMotion(record) or another excitation, or a list of them"
    provides("ContactProblem", "excitation", excitation, EXCITATION, remedy)
    array("ContactProblem", "the direction of an excitation", excitation.direction, (None,))
    if len(excitation.direction) != system.influence.shape[1]:
        raise InputError(f"excitation direction {excitation.direction} has {len(excitation.direction)} components but "
                         f"the body has {system.influence.shape[1]}: give one component per dimension")


def _of_system(system: SemiDiscreteSystem) -> Iterator[str]:
    """What is wrong with the sizes of a system on this rank."""
    n = system.rows
    d = system.influence.shape[1]
    for name in ("M", "K", "C"):
        matrix = getattr(system, name)
        if matrix is not None and matrix.rows != n:
            yield f"the system has {n} unknowns in u0 but {matrix.rows} rows in {name}: give matrices of one system"
    shapes = {"v0": (n,), "influence": (n, d), "base_mass": (n, d), "massless": (n,), "tied": (n,)}
    values = {name: getattr(system, name) for name in shapes} | {"load.constant": system.load.constant}
    yield from _sizes("the system", values, shapes | {"load.constant": (n,)})
    for name in ("u0", "v0"):
        if not np.isfinite(np.sum(getattr(system, name))):
            yield f"the system's {name} contains NaN or infinite values: give finite initial values"


def _sizes(owner: str, values: dict[str, Any], shapes: dict[str, tuple[int, ...]]) -> Iterator[str]:
    for name, shape in shapes.items():
        if values[name] is not None and np.shape(values[name]) != shape:
            yield f"{owner} has {name} of shape {np.shape(values[name])}: give one of shape {shape}"


def _of_surface(surface: ContactSurface, system: SemiDiscreteSystem, total: int) -> Iterator[str]:
    """What is wrong with a surface on this rank, and with its places in the unknowns of the system."""
    m, d, n = surface.count, system.influence.shape[1], system.rows
    shapes: dict[str, tuple[int, ...]] = {"points": (m, d), "normals": (m, d), "tangents": (m, d - 1)}
    shapes |= dict.fromkeys(("gap0", "weights", "bilateral", "compliance", "owned", "slots"), (m,))
    yield from _sizes("the contact surface", {name: getattr(surface, name) for name in shapes}, shapes)
    for name, least, most in (("owned", 0, n), ("tangents", -1, n), ("slots", 0, total)):
        values = getattr(surface, name)
        if np.size(values) and not (least <= np.min(values) and np.max(values) < most):
            yield (f"the contact surface has {name} from {np.min(values)} to {np.max(values)}, outside {least} to "
                   f"{most - 1}: it was made for a system of another size")
    if np.any(np.diff(surface.slots) <= 0):
        yield "the contact surface has slots that do not ascend: number its conditions in the order of their rows"
    if np.isnan(np.sum(surface.gap0)):
        yield "the contact surface has NaN in gap0: check the obstacle's gap function"
    if not (np.all(surface.weights > 0.0) and np.all(surface.compliance >= 0.0)):
        yield "the contact surface has weights that are not above zero, or a compliance below: give lengths or areas"
