"""Make the soil of a model strain-compatible: run it with what its strains ask for, until it is."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Generic, TypeVar

import numpy as np

from ...core.algebra import Array, largest
from ...core.arguments import check_arguments
from ...core.checks import describe_point, refuse
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
from .equivalent_linear import iterate

T = TypeVar("T")
OWNER = "strain_compatible"


@dataclass(frozen=True)
class StrainCompatible(Generic[T]):
    """Hold the last run of ``strain_compatible``.

    Attributes:
        solution: what the run returned.
        material: of the run; E and xi among it are Functions of DG0.
        strain: the effective strain, a Function of DG0.
        changes: the largest change of G or xi after every run.
    """

    solution: T
    material: Heterogeneous
    strain: Any
    changes: tuple[float, ...]


@check_arguments
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

    Poisson's ratio is kept.

    Args:
        mesh: the mesh of the body.
        material: as for ``assemble``, of small strains; of Heterogeneous ones cells take the
            middle.
        curves: (cells, curves) pairs; other cells keep the stiffness and the xi of their material.
        run: a function run(material, strain) that assembles the body of this material with
            ``damping=DampingRatio(…)``, marches with ``strain`` among the recorders, and returns
            anything. All else is yours: contact, gravity first, free fields.
        ratio: of the effective to the largest strain.
        tolerance: of the largest relative change of G or xi in a cell.
        most: runs at most.

    Returns:
        What the last run returned, with its material and its strain.

    Raises:
        InputError: cells named twice; Orthotropic cells; an effective strain that ends beyond its
            curves, with its place.
        ViContactError: no end after so many runs.
    """
    comm = MpiComm(mesh.comm)
    pairs = []
    for group, own_curves in curves:
        indices = cells_of(OWNER, "the cells of curves", group, mesh).indices
        pairs.append((indices, own_curves))
    _refuse_two_curves(pairs, comm)
    _refuse_lost_ratios(material, pairs, comm)
    space = compat.cell_space(mesh)
    place = compat.cell_blocks(space)[:, 0]
    E, nu, rho, xi = cell_constants(space, material)
    fault = f"{OWNER}: Orthotropic has several G: give a LinearElastic"
    refuse([fault if np.isnan(E).any() else ""], comm)

    def field(values: Array) -> Any:
        """Return the values of cells, those that this rank owns or all, as a Function."""
        function = compat.function(space)
        function.x.array[place[: len(values)]] = values
        function.x.scatter_forward()
        return function

    def soften(strain: Array) -> Array:
        """Return E over that of small strains, and xi (2, cells), at effective strains."""
        values = np.stack([np.ones_like(xi), xi])
        for cells, own_curves in pairs:
            values[:, cells] = own_curves.at(strain[cells])
        return values

    def run_once(values: Array) -> tuple[tuple[T, Heterogeneous, Any], Array]:
        """Run with these values; return the run, and the values that its strains ask for."""
        reduction, damping = values
        body = Heterogeneous(field(E * reduction), field(nu), field(rho), field(damping))
        strain = LargestStrain()
        solution = run(body, strain)
        if not hasattr(strain, "values"):
            raise InputError(
                f"{OWNER}: run has not recorded its strain: give simulate record=(strain, …)"
            )
        effective = field(ratio * strain.values)
        return (solution, body, effective), soften(effective.x.array[place])

    start = soften(np.zeros(len(place)))
    last, _, changes = iterate(OWNER, run_once, start, tolerance, most, comm)
    solution, body, effective = last
    _refuse_strains_beyond_curves(mesh, effective.x.array[place], pairs, comm)
    return StrainCompatible(solution, body, effective, changes)


def _refuse_two_curves(pairs: Sequence[tuple[Any, SoilCurves]], comm: MpiComm) -> None:
    """Raise InputError for cells of two pairs. Collective."""
    named = _list_cells_with_curves(pairs)
    doubled = len(np.unique(named)) < len(named)
    refuse([f"{OWNER}: some cells have two curves: give one" if doubled else ""], comm)


def _refuse_strains_beyond_curves(
    mesh: Any, strain: Array, pairs: Sequence[tuple[Any, SoilCurves]], comm: MpiComm
) -> None:
    """Raise InputError unless the cell of largest strain of every pair is within its curves.

    Args:
        mesh: the mesh of the body.
        strain: the effective strain of all cells on this rank.
        pairs: numbers of cells, and their curves.
        comm: the ranks. Collective.
    """
    middles = mesh.geometry.x[compat.geometry_dofmap(mesh)].mean(axis=1)[:, : mesh.geometry.dim]
    faults = []
    for cells, own_curves in pairs:
        if len(cells):
            worst = cells[strain[cells].argmax()]
            faults.append(own_curves.beyond(strain[worst], f"at {describe_point(middles[worst])}"))
    refuse(faults, comm)


def _list_cells_with_curves(pairs: Sequence[tuple[Any, SoilCurves]]) -> Any:
    """Return the numbers of all cells of the pairs on this rank, as often as they are named."""
    return np.concatenate([np.zeros(0, dtype=int), *(cells for cells, _ in pairs)])


def _refuse_lost_ratios(
    material: Materials, pairs: Sequence[tuple[Any, SoilCurves]], comm: MpiComm
) -> None:
    """Raise InputError for a damping ratio of a material whose cells all have curves.

    The curves give it another one.
    """
    if isinstance(material, KINDS):
        return  # of a whole mesh: cells beside the curves keep its ratio
    named = _list_cells_with_curves(pairs)
    for cells, own_material in material:
        outside = largest(comm, len(np.setdiff1d(cells.indices, named)))
        if not outside and isinstance(own_material, LinearElastic) and own_material.xi:
            raise InputError(
                f"{OWNER}: the material of '{cells.name}' has the damping ratio xi = "
                f"{own_material.xi:g}, and the curves of its cells give another one; leave xi out "
                "there"
            )
