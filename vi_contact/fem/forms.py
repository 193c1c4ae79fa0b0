"""State the variational forms of a linear elastic body from its materials.

    sigma = lambda_eff tr(eps) I + 2 mu eps,   M = ∫ rho u·v,   K = ∫ sigma(u):eps(v),   C = alpha M + beta K
"""

from collections.abc import Sequence
from typing import Any
from weakref import WeakSet

import numpy as np
import ufl

from ..core.errors import InputError
from ..core.system import SemiDiscreteSystem
from ..laws.materials import Damping, LinearElastic, Section
from . import compat
from .dashpots import Dashpots
from .dilatation import MeanDilatation
from .mesh import Cells
from .space import FemSpace

Materials = LinearElastic | Sequence[tuple[Cells, LinearElastic]]


class ElasticForms:
    """Hold the variational forms of one body; constants are cellwise: one compiled form serves all materials.

    ``selective``: tr eps is its mean over each cell, in K, in C = beta K and in stresses (``fem.dilatation``).
    """

    boundaries: tuple[Dashpots, ...] = ()  # of the same system

    def __init__(
        self, space: FemSpace, materials: list[tuple[Any, LinearElastic]], section: Section, damping: Damping,
        *, selective: bool = False,
    ) -> None:
        self.space, self.section = space, section
        self.dilatation = MeanDilatation(space.V) if selective else None
        cells = compat.cell_space(space.mesh)
        names = ("lame", "shear", "rho", "alpha_rho", "beta", "lame_out")
        self.damped = any(any(damping.coefficients(material)) for _, material in materials)
        self.fields = {name: compat.function(cells) for name in names}
        if not self.damped:
            self.fields["alpha_rho"] = self.fields["beta"]  # zeros
        for indices, material in materials:
            lame, shear = section.elastic_constants(material)
            alpha, beta = damping.coefficients(material)
            # sigma_zz = lambda tr(eps) in plane strain, 0 in plane stress: only von Mises stress needs it
            lame_out = lame if lame == material.lame_lambda and space.dimension == 2 else 0.0
            values = (lame, shear, material.rho, alpha * material.rho, beta, lame_out)
            for name, value in zip(names, values, strict=True):
                self.fields[name].x.array[indices] = section.thickness * value if name != "beta" else value
        self._matrices: dict[str, WeakSet[Any]] = {name: WeakSet() for name in ("M", "C", "K")}

    def own(self, system: SemiDiscreteSystem) -> None:
        """Remember the matrices of a system as made of these materials; the forms are then those of its space."""
        self.space.forms = self
        for name, known in self._matrices.items():
            if getattr(system, name) is not None:
                known.add(getattr(system, name))

    def foreign(self, system: SemiDiscreteSystem, names: str) -> str:
        """Return the letters of ``names`` whose matrices in a system were not made of these materials."""
        return "".join(name for name in names if getattr(system, name) not in (None, *self._matrices[name]))

    def stress(self, u: Any) -> Any:
        """Return sigma(u) times the thickness; ``follow`` when values of the Function u have changed since."""
        trace = ufl.div(u) if self.dilatation is None else self.dilatation.of(u)
        return self.fields["lame"] * trace * ufl.Identity(self.space.dimension) + self._deviatoric(u)

    def _deviatoric(self, u: Any) -> Any:
        return 2 * self.fields["shear"] * ufl.sym(ufl.grad(u))

    def follow(self, u: Any) -> None:
        """Bring stresses of a Function up to its values. Collective."""
        if self.dilatation is not None:
            self.dilatation.update(u)

    def matrix(self, name: str) -> Any:
        """Assemble the full matrix M, K, or C of the materials (PETSc), before elimination."""
        u, v = ufl.TrialFunction(self.space.V), ufl.TestFunction(self.space.V)
        stress = self.stress if self.dilatation is None else self._deviatoric
        fields, inertia, stiffness = self.fields, ufl.inner(u, v), ufl.inner(stress(u), ufl.sym(ufl.grad(v)))
        form = {
            "M": fields["rho"] * inertia * ufl.dx, "K": stiffness * ufl.dx,
            "C": fields["alpha_rho"] * inertia * ufl.dx + fields["beta"] * stiffness * ufl.dx,
        }[name]
        matrix = compat.assemble_matrix(compat.compile_form(form))
        if self.dilatation is not None and name != "M":
            self.dilatation.add(matrix, fields["lame"], fields["beta"] if name == "C" else None)
        return matrix


def cell_materials(mesh: Any, material: Materials) -> list[tuple[Any, LinearElastic]]:
    """Return (local cells, material) pairs that cover every local cell once; InputError for cells with none or two."""
    cell_map = mesh.topology.index_map(mesh.topology.dim)
    count = cell_map.size_local + cell_map.num_ghosts
    if isinstance(material, LinearElastic):
        return [(np.arange(count), material)]
    covered = np.zeros(count, dtype=np.int64)
    for cells, _ in material:
        covered[cells.indices] += 1
    own = covered[: cell_map.size_local]
    missing, twice = mesh.comm.allreduce(np.array([np.sum(own == 0), np.sum(own > 1)]))
    if twice:
        raise InputError(f"{twice} cells have more than one material: cell groups with a material must not overlap")
    if missing:
        raise InputError(
            f"{missing} cells have no material: give a (cells, material) pair for every cell group of the mesh"
        )
    return [(cells.indices, one) for cells, one in material]
