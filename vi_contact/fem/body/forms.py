"""State the variational forms of a linear elastic body from its materials.

    sigma = lambda_eff tr(eps) I + 2 mu eps,   M = ∫ rho u·v
    K = ∫ sigma(u):eps(v),   C = alpha M + beta K

Orthotropic cells have sigma = C eps instead, KelvinVoigt damping adds its viscous stresses to C.
All integrals are multiplied by the thickness of the section, which the cellwise constants carry as
a factor. ``own_forms`` states a body by forms of the user's instead.
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
from ...laws.yielding import YieldingMaterial
from .. import compat
from ..mesh.tagged_mesh import Cells
from .dashpots import Dashpots
from .dilatation import MeanDilatation
from .heterogeneous import Heterogeneous
from .hyperelastic import TURNING, TurningMaterial
from .space import FemSpace

Material = LinearElastic | Orthotropic | Heterogeneous | YieldingMaterial | TurningMaterial
Materials = Material | Sequence[tuple[Cells, Material]]
FIELDS = ("lame", "shear", "rho", "alpha_rho", "beta", "lame_out")
KINDS = (LinearElastic, Orthotropic, Heterogeneous, YieldingMaterial, *TURNING)


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
        law_damps: whether the law of damping makes any of it.
        densities: whether ``fields`` tell the mass and its damping, cell by cell.
        materials: (local cells, material) as they were given.
        dilatation: with ``selective``, the mean of tr eps over each cell, which takes its place in
            K, in C = beta K and in stresses (``dilatation``); None otherwise.
        tells_stress: whether ``stress`` is known.
        symmetric: whether all matrices are.
        notes: what comes from where.
        integration: the word of ``fem.assemble``.
        own_damping: whether the user gave a form of C.
        nonlinear: what is not linear, in words.
        takes_companions: whether motions may be marched beside a body that is not linear; they are
            asked to be beside its linear cells.
    """

    boundaries: tuple[Dashpots, ...] = ()  # of the same system
    initial: Any = None  # InitialStrains
    internal: Any = None  # InternalForms of a body that is not linear
    densities = True
    integration = "full"
    tells_stress = True
    symmetric = True
    own_damping = False
    statics_only = False
    takes_companions = False
    nonlinear = "Forms: internal"  # what is not linear, in words, where ``internal`` is there
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
        """Fill the cellwise constants. Collective.

        Args:
            space: the body's unknowns.
            materials: pairs of local cells and a material, which cover every cell once; none where
                all forms are the user's own.
            section: that of the body.
            damping: the law of C.
            selective: whether tr eps is taken as its mean over each cell.
        """
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
        degree = 0
        if any(isinstance(given, Heterogeneous) and given.varies for _, given in materials):
            degree = 1
        cells = compat.lagrange(space.mesh, degree, continuous=False)
        self.fields = {name: compat.function(cells) for name in FIELDS} if materials else {}
        table = compat.cell_blocks(cells)
        dofs = [table[where] for where, _ in materials]
        values = [_evaluate(given, cells, where) for where, given in materials]

        # what the law of damping makes of them: a ratio may be zero in all cells of some ranks
        viscosities = getattr(damping, "viscosities", None)
        self.viscous = viscosities if viscosities and any(viscosities) else None  # [Pa s]
        damped = self.viscous is not None
        for constants in values:
            damped = damped or any(np.any(share) for share in damping.coefficients(constants))
        self.damped = bool(largest(space.comm, damped))
        self.law_damps = self.damped
        ratios = [
            _largest_ratio(constants.xi, where)
            for constants, where in zip(values, dofs, strict=True)
        ]
        self.largest_ratio = float(largest(space.comm, max(ratios, default=0.0)))

        # fill the fields, times the thickness
        if not self.damped and materials:
            self.fields["alpha_rho"] = self.fields["beta"]  # zeros
        for where, constants in zip(dofs, values, strict=True):
            columns = _compute_fields(constants, section, damping, space.dimension)
            for name, value in zip(FIELDS, columns, strict=True):
                if name != "beta":
                    value = section.thickness * value
                self.fields[name].x.array[where] = value[where] if np.ndim(value) else value
        self._anisotropic: Any = None
        if any(isinstance(given, Orthotropic) for _, given in materials):
            self._anisotropic = _make_anisotropic(
                cells, degree, materials, self.fields, section, space.dimension
            )

    @property
    def given_materials(self) -> list[tuple[Any, Any]]:
        """Return (local cells, material) as they were given; materials that yield among them."""
        return list(self.materials)

    def cellwise(self, name: str) -> Array:
        """Return the means of a field over the local cells, (cells,)."""
        field = self.fields[name]
        return np.asarray(field.x.array[compat.cell_blocks(field.function_space)].mean(axis=1))

    def own(self, system: SemiDiscreteSystem) -> None:
        """Remember the matrices of a system as made of these forms, and give them to its space."""
        self.space.forms = self
        for name, known in self._matrices.items():
            if getattr(system, name) is not None:
                known.add(getattr(system, name))

    def foreign(self, system: SemiDiscreteSystem, names: str) -> str:
        """Return the letters of ``names``, such as "MK", whose matrices are not of these forms.

        The user has exchanged these matrices since ``assemble`` made the system.
        """
        return "".join(
            name for name in names if getattr(system, name) not in (None, *self._matrices[name])
        )

    def stress(self, u: Any) -> Any:
        """Return sigma(u) (d, d) [Pa] times the thickness.

        Of a Function, the stress of initial strains is taken off. With these, or with selective
        integration, call ``follow`` when its values or the time have changed since.
        """
        return self.stresses(u)[0]

    def stresses(self, u: Any) -> tuple[Any, Any]:
        """Return sigma(u) (d, d) and sigma_zz(u) [Pa] times the thickness.

        sigma_zz is that of plane strain; it is 0 in plane stress, and for bodies that are not in
        the plane.
        """
        eps = ufl.sym(ufl.grad(u))
        trace = self._trace(u)
        if self.initial is None or u is self.u:
            return self.hooke(eps, 0.0, trace)
        own, across = self.initial.parts
        return self.hooke(eps - own, -across, trace - ufl.tr(own))

    def hooke(self, eps: Any, across: Any, trace: Any) -> tuple[Any, Any]:
        """Return sigma (d, d) and sigma_zz [Pa] times the thickness of a strain, by Hooke's law.

            sigma = (lambda tr eps + lambda_out eps_zz) I + 2 mu eps
            sigma_zz = lambda_out (tr eps + eps_zz) + 2 mu eps_zz

        with lambda_out = lambda in plane strain, else 0; where some cell is orthotropic, sigma = C
        eps in Voigt's order instead.

        Args:
            eps: (d, d) strain.
            across: eps_zz, strain across the plane.
            trace: trace of the strain in the plane.
        """
        d = self.space.dimension
        fields = self.fields
        if self._anisotropic is None:
            sigma = fields["lame"] * trace * ufl.Identity(d) + 2 * fields["shear"] * eps
            sigma += fields["lame_out"] * across * ufl.Identity(d)
            return sigma, fields["lame_out"] * (trace + across) + 2 * fields["shear"] * across
        # C times the vector of strains in Voigt's order (shears doubled), the last across the plane
        place = {pair: k for k, pair in enumerate(VOIGT[d])}
        strains = [eps[i, j] if i == j else 2 * eps[i, j] for i, j in place]
        if d == 2:
            strains.append(across)
        flat = ufl.dot(self._anisotropic, ufl.as_vector(strains))
        # back to a symmetric tensor, of which Voigt's order has the upper half
        rows = []
        for i in range(d):
            rows.append([flat[place[min(i, j), max(i, j)]] for j in range(d)])
        return ufl.as_tensor(rows), flat[3] if d == 2 else 0.0 * trace

    def _trace(self, u: Any) -> Any:
        """Return tr eps, with selective integration its mean over each cell.

        In the bilinear form it is 0 then: ``dilatation`` adds the volumetric part to the matrix.
        """
        if self.dilatation is None:
            return ufl.tr(ufl.sym(ufl.grad(u)))
        return 0.0 if u is self.u else self.dilatation.of(u)

    def follow(self, u: Any, t: float | None = None) -> None:
        """Bring stresses of a Function up to its values, and initial strains up to a time.

        Collective.

        Args:
            u: the Function.
            t: time [s], None to leave initial strains as they are.
        """
        if self.dilatation is not None:
            self.dilatation.update(u)
        if self.initial is not None and t is not None:
            self.initial.follow(t)

    def bilinear(self, name: str) -> Any:
        """Return the form of M, K, or C in the trial function ``u`` and the test function ``v``."""
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
        """Return rᵀA of the cells inside, A = M, K or C, as a linear form in the test function.

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
        """Return ∫ (lambda' tr eps(u') I + 2 mu' eps(u')):eps(v) of KelvinVoigt's viscosities."""
        lame, shear = (
            compat.constant(self.space.mesh, self.section.thickness * viscosity)
            for viscosity in self.viscous or ()
        )
        rate, strain = (ufl.sym(ufl.grad(function)) for function in (self.u, self.v))
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
    """Return E [Pa], nu, rho [kg/m³] and xi of the local cells, (4, cells). Collective.

    E and nu are NaN in orthotropic cells.

    Args:
        space: that of functions which are constant on cells (DG0).
        material: that of ``assemble``.
    """
    place = compat.cell_blocks(space)[:, 0]
    rows = np.empty((4, len(place)))
    for where, given in cell_materials(space.mesh, material):
        known = _evaluate(given, space, where)
        for row, value in zip(rows, (known.E, known.nu, known.rho, known.xi), strict=True):
            row[where] = value[place[where]] if np.ndim(value) else value
    return rows


def _evaluate(material: Material, space: Any, cells: Any) -> Any:
    """Return the constants of a material, numbers or values at all unknowns of a cellwise space.

    Orthotropic materials have NaN for Lamé's constants. Collective.

    Args:
        material: the material.
        space: the cellwise space.
        cells: local cells of the material.
    """
    if isinstance(material, Heterogeneous):
        return material.at(space, cells)
    if isinstance(material, Orthotropic):
        return ElasticValues(np.nan, np.nan, material.rho, material.xi)
    return material


def _largest_ratio(xi: Any, dofs: Any) -> float:
    """Return the largest damping ratio of a material on this rank.

    Args:
        xi: a number, or values at all unknowns of the cellwise space.
        dofs: (cells, n) the unknowns of its cells.
    """
    if np.ndim(xi):
        return float(np.max(xi[np.ravel(dofs)], initial=0.0))
    return float(xi) if len(dofs) else 0.0


def _compute_fields(
    constants: Any, section: Section, damping: Damping, dimension: int
) -> tuple[Any, ...]:
    """Return lame, shear, rho, alpha rho, beta and lame_out of a material, in order of ``FIELDS``.

    Args:
        constants: of the material, numbers or values at all unknowns of the cellwise space.
        section: that of the body.
        damping: the law of C.
        dimension: d.
    """
    lame, shear = section.elastic_constants(constants)
    alpha, beta = damping.coefficients(constants)
    # sigma_zz = lambda tr(eps) in plane strain, where the section leaves lambda as it is; it is 0
    # in plane stress. Only von Mises stress and initial strains need it.
    lame_out = 0.0
    if dimension == 2 and np.array_equal(lame, constants.lame_lambda):
        lame_out = lame
    return lame, shear, constants.rho, alpha * constants.rho, beta, lame_out


def _make_anisotropic(
    cells: Any,
    degree: int,
    materials: list[tuple[Any, Material]],
    fields: dict[str, Any],
    section: Section,
    d: int,
) -> Any:
    """Return C in Voigt's order times the thickness, as a Function of matrices.

    In the plane it has a row and a column more, of strain and stress across it. Isotropic cells
    have C = lambda 1 1ᵀ + mu diag(2, …, 1, …); for others see ``Orthotropic.matrix``.

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
    rows = n + 1 if d == 2 else n
    matrices = compat.function(compat.lagrange(cells.mesh, degree, (rows, rows), continuous=False))
    values = matrices.x.array.reshape(len(fields["lame"].x.array), rows, rows)
    for where, material in materials:
        dofs = np.ravel(compat.cell_blocks(cells)[where])
        if isinstance(material, Orthotropic):
            known = section.thickness * material.matrix(section, d)
            corner = section.thickness * material.stiffness[2, 2, 2, 2]
            whole = known[:n]
            across = known[n:]
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
    return matrices


def cell_materials(mesh: Any, material: Materials) -> list[tuple[Any, Material]]:
    """Return (local cells, material) pairs that cover every local cell once.

    Raises:
        InputError: cells with none or two.
    """
    cell_map = mesh.topology.index_map(mesh.topology.dim)
    count = cell_map.size_local + cell_map.num_ghosts
    if isinstance(material, KINDS):
        return [(np.arange(count), material)]
    # how often each cell is named, and of each group how many cells are owned
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
    return [(cells.indices, given) for cells, given in material]
