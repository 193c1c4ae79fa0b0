"""Make the soil of a model strain-compatible.

It is run again with the stiffness and damping that its strains ask for.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Generic, TypeVar

import numpy as np

from ...core.algebra import Array, largest
from ...core.arguments import checked
from ...core.checks import at, refuse
from ...core.errors import InputError
from ...core.quantities import RATIO, Positive, Remedy
from ...fem import compat
from ...fem.body.forms import KINDS, Materials, cell_constants
from ...fem.body.heterogeneous import Heterogeneous
from ...fem.mesh.communicators import MpiComm
from ...fem.mesh.group_checks import cells_of
from ...fem.mesh.tagged_mesh import Cells
from ...laws.materials import LinearElastic
from ...run.recorders import LargestStrain
from .curves import SoilCurves
from .equivalent_linear import iterated

T = TypeVar("T")
OWNER = "strain_compatible"


@dataclass(frozen=True)
class StrainCompatible(Generic[T]):
    """Hold what ``strain_compatible`` found.

    That is what the last ``run`` returned; the ``material`` it had, E and xi among it as Functions
    of DG0; its effective ``strain``, likewise; ``changes``: the largest one after every run.
    """

    solution: T
    material: Heterogeneous
    strain: Any
    changes: tuple[float, ...]


@checked
def strain_compatible(
    mesh: Any,
    material: Materials,
    curves: Annotated[Sequence[tuple[Cells, SoilCurves]], Remedy("give (cells, SoilCurves) pairs")],
    run: Annotated[
        Callable[[Heterogeneous, LargestStrain], T],
        Remedy("give a function of a material and a recorder"),
    ],
    *,
    ratio: Annotated[float, Positive, RATIO] = 0.65,
    tolerance: Annotated[float, Positive] = 0.01,
    most: Annotated[int, Positive] = 20,
) -> StrainCompatible[T]:
    """Run a model until G and xi of every cell are those of its effective strain. Collective.

    Args:
        mesh: the mesh of the body.
        material: as for ``assemble``, of small strains; of Heterogeneous ones cells take the
            middle.
        curves: (cells, curves) pairs; other cells keep the stiffness and the xi of their material.
        run: run(material, strain): assemble the body of this material with
            ``damping=DampingRatio(…)``, march with ``strain`` among the recorders, and return
            anything. All else is yours: contact, gravity first, free fields.
        ratio: of the effective to the largest strain.
        tolerance: of the largest relative change of G or xi in a cell.
        most: runs at most.

    Poisson's ratio is kept.

    Raises:
        InputError: cells named twice, Orthotropic ones, an effective strain that ends beyond its
            curves, with place.
        ViContactError: no end after so many runs.
    """
    comm = MpiComm(mesh.comm)
    pairs = [
        (cells_of(OWNER, "the cells of curves", cells, mesh).indices, one) for cells, one in curves
    ]
    named = np.concatenate([np.zeros(0, dtype=int), *(cells for cells, _ in pairs)])
    refuse(
        [
            f"{OWNER}: some cells have two curves: give one"
            if len(np.unique(named)) < len(named)
            else ""
        ],
        comm,
    )
    _refuse_lost_ratios(material, pairs, comm)
    space = compat.cell_space(mesh)
    place, (E, nu, rho, xi) = compat.cell_blocks(space)[:, 0], cell_constants(space, material)
    refuse(
        [f"{OWNER}: Orthotropic has several G: give a LinearElastic" if np.isnan(E).any() else ""],
        comm,
    )

    def field(values: Array) -> Any:
        found = compat.function(space)
        found.x.array[place[: len(values)]] = values  # of cells that this rank owns, or of all
        found.x.scatter_forward()
        return found

    def softened(strain: Array) -> Array:
        values = np.stack([np.ones_like(xi), xi])
        for cells, one in pairs:
            values[:, cells] = one.at(strain[cells])
        return values

    def once(values: Array) -> tuple[tuple[T, Heterogeneous, Any], Array]:
        body, strain = (
            Heterogeneous(field(E * values[0]), field(nu), field(rho), field(values[1])),
            LargestStrain(),
        )
        solution = run(body, strain)
        if not hasattr(strain, "values"):
            raise InputError(
                f"{OWNER}: run has not recorded its strain: give simulate record=(strain, …)"
            )
        effective = field(ratio * strain.values)
        return (solution, body, effective), softened(effective.x.array[place])

    found, _, changes = iterated(OWNER, once, softened(np.zeros(len(place))), tolerance, most, comm)
    strain = found[-1].x.array[place]
    middles = mesh.geometry.x[compat.geometry_dofmap(mesh)].mean(axis=1)[:, : mesh.geometry.dim]
    worst = [(one, cells[strain[cells].argmax()]) for cells, one in pairs if len(cells)]
    refuse([one.beyond(strain[cell], f"at {at(middles[cell])}") for one, cell in worst], comm)
    return StrainCompatible(*found, changes)


def _refuse_lost_ratios(
    material: Materials, pairs: Sequence[tuple[Any, SoilCurves]], comm: MpiComm
) -> None:
    """Raise InputError for a damping ratio of a material whose cells all have curves.

    The curves give it another one.
    """
    if isinstance(material, KINDS):
        return  # of a whole mesh: cells beside the curves keep its ratio
    named = np.concatenate([np.zeros(0, dtype=int), *(cells for cells, _ in pairs)])
    for cells, one in material:
        outside = len(np.setdiff1d(cells.indices, named))
        if not largest(comm, outside) and isinstance(one, LinearElastic) and one.xi:
            raise InputError(
                f"{OWNER}: the material of '{cells.name}' has the damping ratio xi = {one.xi:g}, "
                "and the curves of its cells give another one; leave xi out there"
            )
