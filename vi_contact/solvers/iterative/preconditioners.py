"""Precondition the free unknowns: w M⁻¹ w with a mask w, and M⁻¹ one of Jacobi, ICC(0), and GAMG.

ICC and Jacobi are made of the whole A, once. On several ranks each has the incomplete factor of its
own rows and one layer of its neighbours' (additive Schwarz). Their sum counts a row as often as
there are factors that hold it; to divide by the square root of that number on either side takes
this back, and M stays symmetric. Counted twice, the layer would be no gain.

An incomplete factor of a positive definite matrix need not be positive definite: flat tetrahedra,
or a stiff body on a soft one, are enough. Factors are then made of A with a larger diagonal
(Manteuffel, 1980, Math. Comput. 34, 473-497), since PETSc's own shifts know nothing of blocks.

GAMG is made of A with the held rows and columns replaced by their diagonal, or its coarse grids
would believe the contact open; the interpolation is kept, Galerkin products are renewed when over a
tenth of the set has moved since.
"""

from typing import Any

import numpy as np

from ...core.algebra import Array, EffectiveMatrix, Indices, Mask
from ...core.errors import InputError
from ...core.surfaces import ContactSurface
from ...laws.mass_transfer import rigid_motions
from ..petsc import PETSc
from ..volume.failures import read_last_line
from ..volume.options import OptionLayers, Options
from .layout import Layout, Nodewise
from .operator import Work

JACOBI = "jacobi"
ICC = "icc"
GAMG = "gamg"
KINDS = (JACOBI, ICC, GAMG)
# Courant numbers up to which Jacobi and ICC serve; CHOSEN: docs/guide/solvers.md has what was
# measured
SMALL = 0.5
LARGE = 30.0
DRIFT = 0.1  # of the contact set that may move before GAMG is renewed
RENEWALS = 4  # in a step, at most
FEW_LEVELS = 2  # of a multigrid: with fewer there is nothing for options of levels
DEPENDENT = 1e-8  # of a vector: what is left of one that depends on others
# of the diagonal, for factors that were not positive definite; CHOSEN: docs/guide/solvers.md
RAISED = 0.5
DEFAULTS: dict[str, Options] = {
    JACOBI: {"pc_type": "jacobi"},
    ICC: {"pc_type": "bjacobi", "sub_pc_type": "icc"},
    GAMG: {"pc_type": "gamg", "pc_gamg_threshold": 0.01, "pc_gamg_reuse_interpolation": True},
}
OVERLAP: Options = {"pc_type": "asm", "pc_asm_type": "basic"}  # of one layer


def compute_courant(A: EffectiveMatrix) -> float:
    """Return C; NaN when A does not know what inertia is in it. Collective.

    With A = m M + c C + k K the number

        C² = sum (A_ii - m M_ii) / sum m M_ii

    compares stiffness and inertia of the diagonal over all unknowns. On uniform meshes it is 0.7
    (hexahedra) to 1.0 times (tetrahedra) the Courant number c_p dt / h of the trapezoidal rule,
    infinite in statics, and needs no cells.
    """
    if A.inertia is None:
        return float("nan")
    factor, M = A.inertia
    diagonal = float(np.sum(A.matrix.diagonal()))
    mass = factor * float(np.sum(M.diagonal())) if factor else 0.0
    total, inertia = A.algebra.comm.sum(np.array([diagonal, mass]))
    return float(np.sqrt(max(total - inertia, 0.0) / inertia)) if inertia > 0.0 else float("inf")


def choose_kind(number: float, modes: bool) -> str:
    """Return the preconditioner for a Courant number.

    It is Jacobi up to 0.5, ICC up to 30 or where the number is not known, GAMG beyond. ``modes``
    says whether rigid motions are known, without which GAMG is no use.
    """
    if number <= SMALL:
        return JACOBI
    return GAMG if number > LARGE and modes else ICC


def defaults(kind: str, ranks: int) -> Options:
    """Return PETSc's options of a kind on so many ranks."""
    if kind == ICC and ranks > 1:
        return {**DEFAULTS[kind], **OVERLAP}
    return DEFAULTS[kind]


def compute_shares(inverse: Any, template: Any) -> Array:
    """Return 1/sqrt(k) of every row: k subdomains of a PETSc preconditioner hold it. Collective.

    Subdomains are counted by an application to ones, with copies in the place of their factors.
    """
    ones = template.duplicate()
    ones.set(1.0)
    count = template.duplicate()
    count.set(1.0)
    if inverse.getType() == "asm":
        parts = [(solver, solver.getPC()) for solver in inverse.getASMSubKSP()]
        for solver, factor in parts:
            copies = PETSc.PC().create(factor.comm)
            copies.setOperators(*factor.getOperators())
            copies.setType("none")
            solver.setPC(copies)
        inverse.apply(ones, count)
        for solver, factor in parts:
            solver.setPC(factor)
    return np.asarray(1.0 / np.sqrt(count.array_r))


class Masked:
    """Apply w M⁻¹ w: the context of a PETSc shell preconditioner."""

    def __init__(self, inverse: Any, template: Any) -> None:
        """Take M⁻¹ without the shares of its subdomains, which go into w.

        Args:
            inverse: a PETSc preconditioner.
            template: a PETSc vector of its size.
        """
        self._inverse = inverse
        self._r = template.duplicate()
        self._z = template.duplicate()
        self._shares = compute_shares(inverse, template)
        self._weights = self._shares

    @property
    def weights(self) -> Array:
        """Return w, 0 in rows that are held. What is set has no shares, and gets them."""
        return self._weights

    @weights.setter
    def weights(self, weights: Array) -> None:
        self._weights = weights * self._shares

    def apply(self, _pc: Any, r: Any, z: Any) -> None:
        """Apply w M⁻¹ w, as PETSc calls a shell preconditioner.

        Args:
            _pc: PETSc's preconditioner, whose context this object is.
            r: the PETSc vector to which it is applied.
            z: the PETSc vector that gets the result.
        """
        np.multiply(self.weights, r.array_r, out=self._r.array)
        self._inverse.apply(self._r, z)
        z.array[:] *= self.weights

    def __call__(self, r: Array) -> Array:
        """Return w M⁻¹ w r."""
        self._r.array[:] = self.weights * r
        self._inverse.apply(self._r, self._z)
        return np.asarray(self.weights * self._z.array_r)


class Inverse:
    """Hold M⁻¹: Jacobi or ICC, which do not depend on the contact set.

    Attributes:
        pc: the PETSc preconditioner.
    """

    def __init__(self, matrix: Any, layers: OptionLayers, raised: float = 0.0) -> None:
        """Make it. Collective.

        Args:
            matrix: A.
            layers: PETSc's options.
            raised: share by which the diagonal is made larger before.

        Raises:
            InputError: PETSc does not take the options.
        """
        if raised:
            diagonal = matrix.getDiagonal()
            matrix = matrix.duplicate(copy=True)
            matrix.setDiagonal(diagonal * (1.0 + raised))
        self.pc = make_preconditioner(matrix, layers)

    def begin(self) -> None:
        """Begin a step."""

    def follow(self, held: Indices) -> None:
        """Make M anew for the rows that closed conditions and sticking points hold. Collective.

        Jacobi and ICC have no need to.
        """


class Multigrid(Inverse):
    """Hold GAMG, or what else the options say, of an AIJ matrix, and renew it for the contact set.

    The interpolation is that of the whole A with its rigid modes, in which no set has left a
    trace.
    """

    def __init__(
        self, nodewise: Nodewise, surface: ContactSurface, layers: OptionLayers, work: Work
    ) -> None:
        """Make it. Collective.

        Args:
            nodewise: makes matrices of A.
            surface: the contact surface, whose frames rigid modes are in.
            layers: PETSc's options.
            work: where renewals are counted.
        """
        self._nodewise = nodewise
        self._work = work
        self._comm = surface.comm
        self._matrix = nodewise.entries()
        if nodewise.A.space is not None:
            modes = make_rigid_modes(
                nodewise.A, surface, nodewise.layout, self._matrix.createVecLeft()
            )
            self._matrix.setNearNullSpace(
                PETSc.NullSpace().create(vectors=modes, comm=self._matrix.comm)
            )
        super().__init__(self._matrix, layers)
        self._built: Mask = np.zeros(nodewise.layout.size, dtype=bool)
        self._left = RENEWALS

    def begin(self) -> None:
        """Begin a step: it has its own number of renewals."""
        self._left = RENEWALS

    def follow(self, held: Indices) -> None:
        """Make the Galerkin products anew where a tenth of the held rows have changed since.

        Collective.
        """
        mask = np.zeros_like(self._built)
        mask[held] = True
        local = np.array([np.sum(mask ^ self._built), np.sum(mask)], dtype=float)
        moved, size = self._comm.sum(local)
        if self._left and moved > DRIFT * size:
            self._left -= 1
            self._built = mask
            self._renew(held)

    def _renew(self, held: Indices) -> None:
        """Make M of A whose held rows and columns are replaced by their diagonal."""
        matrix = self._matrix
        self._nodewise.entries(matrix)
        diagonal = matrix.getDiagonal()
        rows = matrix.getOwnershipRange()[0] + held
        matrix.zeroRowsColumns(rows.astype(PETSc.IntType), diag=1.0)
        matrix.setDiagonal(diagonal)
        self.pc.setOperators(matrix)
        self.pc.setUp()
        self._work.renewals += 1


def make_preconditioner(matrix: Any, layers: OptionLayers) -> Any:
    """Return a PETSc preconditioner of a matrix, as the options say. Collective.

    Raises:
        InputError: PETSc does not take them.
    """
    pc = PETSc.PC().create(matrix.comm)
    pc.setOptionsPrefix(layers.prefix)
    pc.setOperators(matrix)
    with layers.in_force():
        try:
            pc.setFromOptions()
            pc.setUp()
            pc.setUpOnBlocks()
            if layers.own:  # parts of it read their options when they are first applied
                ones, image = matrix.createVecs()
                ones.set(1.0)
                pc.apply(ones, image)
            if pc.getType() in ("gamg", "mg") and pc.getMGLevels() < FEW_LEVELS:
                # There are no levels that could read their options.
                layers.read.update(key for key in layers.own if key.startswith("mg_levels_"))
        except PETSc.Error as error:
            raise InputError(
                f"PETSc makes no preconditioner of the options under {layers.prefix} "
                f"({read_last_line(error)}): correct or drop them"
            ) from error
    return pc


def make_rigid_modes(
    A: EffectiveMatrix, surface: ContactSurface, layout: Layout, template: Any
) -> list[Any]:
    """Return orthonormal PETSc vectors of the rigid motions. Collective.

    Args:
        A: the matrix, whose space knows the nodes.
        surface: the contact surface: unknowns are in its nodal frames, and relative at two bodies.
        layout: of padded vectors.
        template: a PETSc vector of their size.
    """
    space = A.space
    comm = A.algebra.comm
    d = int(space.dimension)
    points = np.asarray(space.coordinates)
    component = np.asarray(space.ids) % d

    # Motions of a body of size one about its middle.
    low = -comm.max(-np.min(points, axis=0, initial=np.inf))
    high = comm.max(np.max(points, axis=0, initial=-np.inf))
    x = (points - 0.5 * (low + high)) / np.linalg.norm(high - low)
    modes = rigid_motions(np.eye(d)[component], x).T

    # The unknowns of these motions.
    vectors = [template.duplicate() for _ in modes]
    for vector, mode in zip(vectors, modes, strict=True):
        unknowns = surface.in_frames(mode)  # T⁻¹ u
        if surface.coupling is not None:
            unknowns = 2.0 * unknowns - surface.coupling @ unknowns  # R⁻¹ = 2 - R
        vector.array[:] = layout.pad(unknowns)
    return orthonormalise(vectors)


def orthonormalise(vectors: list[Any]) -> list[Any]:
    """Make vectors orthonormal in place (Gram and Schmidt, twice), and return those that are left.

    One that depends on the others is left out.
    """
    basis: list[Any] = []
    for vector in vectors:
        before = vector.norm()
        for _ in range(2):
            for other in basis:
                vector.axpy(-vector.dot(other), other)
        size = vector.norm()
        if size > DEPENDENT * before:
            vector.scale(1.0 / size)
            basis.append(vector)
    return basis
