"""State the variational forms of a linear elastic body from its materials.

    sigma = lambda_eff tr(eps) I + 2 mu eps,   M = ∫ rho u·v
    K = ∫ sigma(u):eps(v),   C = alpha M + beta K

Orthotropic cells have sigma = C eps instead, KelvinVoigt damping adds its viscous stresses to C.
"""

from collections.abc import Sequence
from typing import Any
from weakref import WeakSet

import numpy as np
import ufl

from ...core.algebra import Array, largest
from ...core.errors import InputError
from ...core.system import SemiDiscreteSystem
from ...laws.materials import Damping, ElasticValues, LinearElastic, Section
from ...laws.orthotropic import VOIGT, Orthotropic
from .. import compat
from ..mesh.tagged_mesh import Cells
from .dashpots import Dashpots
from .dilatation import MeanDilatation
from .heterogeneous import Heterogeneous
from .space import FemSpace

Material = LinearElastic | Orthotropic | Heterogeneous
Materials = Material | Sequence[tuple[Cells, Material]]
FIELDS = ("lame", "shear", "rho", "alpha_rho", "beta", "lame_out")
KINDS = (LinearElastic, Orthotropic, Heterogeneous)


class ElasticForms:
    """Hold the variational forms of one body.

    Constants are cellwise: one compiled form serves all materials.

    Attributes:
        fields: lame, shear, rho, alpha_rho, lame_out times the section's thickness, and beta:
            functions of DG0, of DG1 where a material changes inside of cells. Lamé constants are
            NaN in orthotropic cells.
        damping: the law of C, as it was given.
        largest_ratio: the largest xi of the materials, on all ranks.
        damped: whether there is a C.
        densities: whether ``fields`` tell the mass and its damping, cell by cell.
        materials: (local cells, material) as they were given.
        dilatation: with ``selective``, the mean of tr eps over each cell, which takes its place in
            K, in C = beta K and in stresses (``dilatation``); None otherwise.
        tells_stress: whether ``stress`` is known.
        symmetric: whether all matrices are.
        notes: what comes from where.
        own_damping: whether the user gave a form of C.
    """

    boundaries: tuple[Dashpots, ...] = ()  # of the same system
    initial: Any = None  # InitialStrains
    densities = tells_stress = symmetric = True
    own_damping = False
    statics_only = False
    notes: tuple[str, ...] = ()

    def __init__(
        self,
        space: FemSpace,
        materials: list[tuple[Any, Material]],
        section: Section,
        damping: Damping,
        *,
        selective: bool = False,
    ) -> None:
        self.space = space
        self.section = section
        self.damping = damping
        self.materials = tuple(materials)
        space.forms = self
        self.dilatation = MeanDilatation(space.V) if selective else None
        self.u = ufl.TrialFunction(space.V)
        self.v = ufl.TestFunction(space.V)
        self._matrices: dict[str, WeakSet[Any]] = {name: WeakSet() for name in ("M", "C", "K")}

        # fields that are constant on cells, or linear in them where a material varies inside
        degree = int(any(isinstance(one, Heterogeneous) and one.varies for _, one in materials))
        cells = compat.lagrange(space.mesh, degree, continuous=False)
        self.fields = {name: compat.function(cells) for name in FIELDS} if materials else {}
        table = compat.cell_blocks(cells)
        dofs = [table[where] for where, _ in materials]
        values: list[Any] = [
            one.at(cells, where) if isinstance(one, Heterogeneous) else _constants(one)
            for where, one in materials
        ]

        # what the law of damping makes of them: a ratio may be zero in all cells of some ranks
        viscosities = getattr(damping, "viscosities", None)
        self.viscous = viscosities if viscosities and any(viscosities) else None  # [Pa s]
        damped = self.viscous is not None or any(
            np.any(one) for each in values for one in damping.coefficients(each)
        )
        self.damped = bool(largest(space.comm, damped))
        ratios = [_largest_ratio(one.xi, where) for one, where in zip(values, dofs, strict=True)]
        self.largest_ratio = float(largest(space.comm, max(ratios, default=0.0)))

        # fill the fields, times the thickness
        if not self.damped and materials:
            self.fields["alpha_rho"] = self.fields["beta"]  # zeros
        for where, one in zip(dofs, values, strict=True):
            constants = _fields(one, section, damping, space.dimension)
            for name, value in zip(FIELDS, constants, strict=True):
                value = section.thickness * value if name != "beta" else value
                self.fields[name].x.array[where] = value[where] if np.ndim(value) else value
        self._anisotropic: Any = None
        if any(isinstance(one, Orthotropic) for _, one in materials):
            self._anisotropic = _anisotropic(
                cells, degree, materials, self.fields, section, space.dimension
            )

    def cellwise(self, name: str) -> Array:
        """Return the means of a field over the local cells, (cells,)."""
        field = self.fields[name]
        return np.asarray(field.x.array[compat.cell_blocks(field.function_space)].mean(axis=1))

    def own(self, system: SemiDiscreteSystem) -> None:
        """Remember the matrices of a system as made of these materials.

        The forms are then those of its space.
        """
        self.space.forms = self
        for name, known in self._matrices.items():
            if getattr(system, name) is not None:
                known.add(getattr(system, name))

    def foreign(self, system: SemiDiscreteSystem, names: str) -> str:
        """Return the letters of ``names`` whose matrices are not of these materials.

        The matrices of a system were not made of these.
        """
        return "".join(
            name for name in names if getattr(system, name) not in (None, *self._matrices[name])
        )

    def stress(self, u: Any) -> Any:
        """Return sigma(u) (d, d) times the thickness, of a Function less that of initial strains.

        With these, or with selective integration: ``follow`` when its values or the time have
        changed since.
        """
        return self.stresses(u)[0]

    def stresses(self, u: Any) -> tuple[Any, Any]:
        """Return the stress and sigma_zz(u) times the thickness of a body in the plane.

        sigma_zz = 0 in plane stress and else.
        """
        eps = ufl.sym(ufl.grad(u))
        trace = self._trace(u)
        if self.initial is None or u is self.u:
            return self.hooke(eps, 0.0, trace)
        own, across = self.initial.parts
        return self.hooke(eps - own, -across, trace - ufl.tr(own))

    def hooke(self, eps: Any, across: Any, trace: Any) -> tuple[Any, Any]:
        """Return (sigma (d, d), sigma_zz) times the thickness of a strain.

        Given are the strain, that across the plane, and its trace.

        Args:
            eps: (d, d) strain.
            across: strain across the plane.
            trace: trace of the strain in the plane.
        """
        d = self.space.dimension
        fields = self.fields
        if self._anisotropic is None:
            sigma = fields["lame"] * trace * ufl.Identity(d) + 2 * fields["shear"] * eps
            sigma += fields["lame_out"] * across * ufl.Identity(d)
            return sigma, fields["lame_out"] * (trace + across) + 2 * fields["shear"] * across
        place = {pair: k for k, pair in enumerate(VOIGT[d])}
        strains = [eps[i, j] if i == j else 2 * eps[i, j] for i, j in place] + [across] * (d == 2)
        flat = ufl.dot(self._anisotropic, ufl.as_vector(strains))
        sigma = ufl.as_tensor(
            [[flat[place[min(i, j), max(i, j)]] for j in range(d)] for i in range(d)]
        )
        return sigma, flat[3] if d == 2 else 0.0 * trace

    def _trace(self, u: Any) -> Any:
        """Return tr eps or, of a Function, its mean over each cell.

        There is none in bilinear forms where ``dilatation`` adds it.
        """
        if self.dilatation is None:
            return ufl.tr(ufl.sym(ufl.grad(u)))
        return 0.0 if u is self.u else self.dilatation.of(u)

    def follow(self, u: Any, t: float | None = None) -> None:
        """Bring stresses of a Function up to its values, and initial strains up to a time.

        Collective.
        """
        if self.dilatation is not None:
            self.dilatation.update(u)
        if self.initial is not None and t is not None:
            self.initial.follow(t)

    def bilinear(self, name: str) -> Any:
        """Return the form of M, K, or C of the materials.

        It is in the trial function ``u`` and the test function ``v``.
        """
        u = self.u
        v = self.v
        fields = self.fields
        if name == "M":  # forms=… without a stress take the mass from here
            return fields["rho"] * ufl.inner(u, v) * ufl.dx
        stiffness = ufl.inner(self.stress(u), ufl.sym(ufl.grad(v)))
        if name == "K":
            return stiffness * ufl.dx
        form = fields["alpha_rho"] * ufl.inner(u, v) * ufl.dx + fields["beta"] * stiffness * ufl.dx
        return form + self._viscous_form() if self.viscous else form

    def against(self, name: str, r: Any, inside: Any) -> Any:
        """Return rᵀA of the cells inside, A = M, K or C, as a linear form.

        It is the bilinear form with r as test function. Call ``follow`` when the values of the
        Function r have changed since.

        Args:
            name: "M", "C" or "K".
            r: the Function that takes the place of the test function.
            inside: one in the cells that count, zero in others.
        """
        form = ufl.replace(self.bilinear(name), {self.u: self.v, self.v: inside * r})
        if self.dilatation is None or name == "M":
            return form
        modulus = self.fields["lame"] * (self.fields["beta"] if name == "C" else 1.0)
        return form + inside * modulus * self.dilatation.of(r) * ufl.div(self.v) * ufl.dx

    def _viscous_form(self) -> Any:
        """Return the form of the viscous stresses of KelvinVoigt."""
        lame, shear = (
            compat.constant(self.space.mesh, self.section.thickness * one)
            for one in self.viscous or ()
        )
        rate, strain = (ufl.sym(ufl.grad(one)) for one in (self.u, self.v))
        return (lame * ufl.tr(rate) * ufl.tr(strain) + 2 * shear * ufl.inner(rate, strain)) * ufl.dx

    def matrix(self, name: str) -> Any:
        """Assemble the full matrix M, K, or C of the materials (PETSc), before elimination."""
        matrix = compat.assemble_matrix(
            compat.compile_form(self.bilinear(name), self.space.quadrature_degree)
        )
        if self.dilatation is not None and name != "M":
            self.dilatation.add(
                matrix, self.fields["lame"], self.fields["beta"] if name == "C" else None
            )
        return matrix


def cell_constants(space: Any, material: Materials) -> Array:
    """Return E, nu, rho and xi of the local cells, (4, cells), NaN where Orthotropic has none; DG0.

    Collective.
    """
    place = compat.cell_blocks(space)[:, 0]
    found = np.empty((4, len(place)))
    for where, one in cell_materials(space.mesh, material):
        known = one.at(space, where) if isinstance(one, Heterogeneous) else _constants(one)
        for row, value in zip(found, (known.E, known.nu, known.rho, known.xi), strict=True):
            row[where] = value[place[where]] if np.ndim(value) else value
    return found


def _constants(material: LinearElastic | Orthotropic) -> Any:
    """Return the material, or values where it has no Lamé constants."""
    if isinstance(material, Orthotropic):
        return ElasticValues(np.nan, np.nan, material.rho, material.xi)
    return material


def _largest_ratio(xi: Any, dofs: Any) -> float:
    """Return the largest damping ratio of a material.

    Args:
        xi: a number, or values at all unknowns of the cellwise space.
        dofs: (cells, n) the unknowns of its cells.
    """
    if np.ndim(xi):
        return float(np.max(xi[np.ravel(dofs)], initial=0.0))
    return float(xi) if len(dofs) else 0.0


def _fields(one: Any, section: Section, damping: Damping, dimension: int) -> tuple[Any, ...]:
    """Return lame, shear, rho, alpha rho, beta and lame_out of a material (``FIELDS``).

    Args:
        one: the material, or values at all unknowns of the cellwise space.
        section: that of the body.
        damping: the law of C.
        dimension: d.
    """
    lame, shear = section.elastic_constants(one)
    alpha, beta = damping.coefficients(one)
    # sigma_zz = lambda tr(eps) in plane strain, 0 in plane stress: only von Mises stress needs it
    lame_out = lame if np.array_equal(lame, one.lame_lambda) and dimension == 2 else 0.0
    return lame, shear, one.rho, alpha * one.rho, beta, lame_out


def _anisotropic(
    cells: Any,
    degree: int,
    materials: list[tuple[Any, Material]],
    fields: dict[str, Any],
    section: Section,
    d: int,
) -> Any:
    """Return the matrix of all cells times the thickness, as a function.

    See ``Orthotropic.matrix``.

    Args:
        cells: the cellwise space.
        degree: its degree, 0 or 1.
        materials: pairs of local cells and a material.
        fields: Lamé constants times the thickness, at the unknowns of ``cells``.
        section: that of the body.
        d: dimension.
    """
    if d == 1:
        raise InputError(
            "Orthotropic is for bodies in the plane or in space: give a LinearElastic here"
        )
    n = len(VOIGT[d])
    trace = np.array([float(i == j) for i, j in VOIGT[d]])
    rows = n + (d == 2)  # the last one is that of the strain and the stress across the plane
    found = compat.function(compat.lagrange(cells.mesh, degree, (rows, rows), continuous=False))
    values = found.x.array.reshape(len(fields["lame"].x.array), rows, rows)
    for where, one in materials:
        dofs = np.ravel(compat.cell_blocks(cells)[where])
        if isinstance(one, Orthotropic):
            told = section.thickness * one.matrix(section, d)
            corner = section.thickness * one.stiffness[2, 2, 2, 2]
            whole = told[:n]
            across = told[n:]
        else:
            lame, shear, out = (
                fields[name].x.array[dofs][:, None, None] for name in ("lame", "shear", "lame_out")
            )
            whole = lame * np.outer(trace, trace) + shear * np.diag(1.0 + trace)
            across = out * trace
            corner = out + 2.0 * shear
        values[dofs, :n, :n] = whole
        values[dofs, n:, :n] = across
        values[dofs, :n, n:] = across.swapaxes(-1, -2)
        values[dofs, n:, n:] = corner
    return found


def cell_materials(mesh: Any, material: Materials) -> list[tuple[Any, Material]]:
    """Return (local cells, material) pairs that cover every local cell once.

    Raises:
        InputError: cells with none or two.
    """
    cell_map = mesh.topology.index_map(mesh.topology.dim)
    count = cell_map.size_local + cell_map.num_ghosts
    if isinstance(material, KINDS):
        return [(np.arange(count), material)]
    covered = np.zeros(count, dtype=np.int64)
    for cells, _ in material:
        covered[cells.indices] += 1
    own = covered[: cell_map.size_local]
    counts = [np.sum(np.asarray(cells.indices) < cell_map.size_local) for cells, _ in material]
    missing, twice, *counts = mesh.comm.allreduce(
        np.array([np.sum(own == 0), np.sum(own > 1), *counts])
    )
    for (cells, _), count in zip(material, counts, strict=True):
        if not count:
            raise InputError(
                f"the cell group '{cells.name}' of a material has no cells: correct the group, or "
                "leave its (cells, material) pair out"
            )
    if twice:
        raise InputError(
            f"{twice} cells have more than one material: give cell groups that do not overlap"
        )
    if missing:
        raise InputError(
            f"{missing} cells have no material: give a (cells, material) pair for every cell group "
            "of the mesh"
        )
    return [(cells.indices, one) for cells, one in material]
