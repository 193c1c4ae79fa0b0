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
from ..volume.failures import last_line
from ..volume.options import OptionLayers, Options
from .layout import Layout, Nodewise
from .operator import Work

JACOBI, ICC, GAMG = "jacobi", "icc", "gamg"
KINDS = (JACOBI, ICC, GAMG)
SMALL, LARGE = 0.5, 30.0  # Courant numbers; CHOSEN: docs/guide/solvers.md has what was measured
DRIFT = 0.1  # of the contact set that may move before GAMG is renewed
RENEWALS = 4  # in a step, at most
FEW_LEVELS = 2  # of a multigrid: with fewer there is nothing for options of levels
# of the diagonal, for factors that were not positive definite; CHOSEN: docs/guide/solvers.md
RAISED = 0.5
DEFAULTS: dict[str, Options] = {
    JACOBI: {"pc_type": "jacobi"},
    ICC: {"pc_type": "bjacobi", "sub_pc_type": "icc"},
    GAMG: {"pc_type": "gamg", "pc_gamg_threshold": 0.01, "pc_gamg_reuse_interpolation": True},
}
OVERLAP: Options = {"pc_type": "asm", "pc_asm_type": "basic"}  # of one layer


def courant(A: EffectiveMatrix) -> float:
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


def chosen(number: float, modes: bool) -> str:
    """Return the preconditioner for a Courant number.

    It is Jacobi up to 0.5, ICC up to 30 or where it is not known, GAMG beyond. ``modes``: whether
    rigid motions are known, without which GAMG is no use.
    """
    if number <= SMALL:
        return JACOBI
    return GAMG if number > LARGE and modes else ICC


def defaults(kind: str, ranks: int) -> Options:
    """Return PETSc's options of a kind on so many ranks."""
    return {**DEFAULTS[kind], **OVERLAP} if kind == ICC and ranks > 1 else DEFAULTS[kind]


def shares(inverse: Any, template: Any) -> Array:
    """Return 1/sqrt(k) of every row.

    Here k is the number of a PETSc preconditioner's subdomains that hold it. Collective.
    """
    ones, count = template.duplicate(), template.duplicate()
    ones.set(1.0)
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
    """Apply w M⁻¹ w: the context of a PETSc shell preconditioner.

    ``inverse``: M⁻¹ as a PETSc preconditioner, without the shares of its subdomains, which are in
    w.
    """

    def __init__(self, inverse: Any, template: Any) -> None:
        self._inverse, self._r, self._z = inverse, template.duplicate(), template.duplicate()
        self._weights = self._shares = shares(inverse, template)

    @property
    def weights(self) -> Array:
        """Return w, 0 in rows that are held; set without the shares."""
        return self._weights

    @weights.setter
    def weights(self, weights: Array) -> None:
        self._weights = weights * self._shares

    def apply(self, _pc: Any, r: Any, z: Any) -> None:
        """Apply w M⁻¹ w to r: PETSc vectors."""
        np.multiply(self.weights, r.array_r, out=self._r.array)
        self._inverse.apply(self._r, z)
        z.array[:] *= self.weights

    def __call__(self, r: Array) -> Array:
        """Return w M⁻¹ w r."""
        self._r.array[:] = self.weights * r
        self._inverse.apply(self._r, self._z)
        return np.asarray(self.weights * self._z.array_r)


class Inverse:
    """Hold M⁻¹ as the PETSc preconditioner ``pc``.

    It is Jacobi or ICC, which do not depend on the contact set, made of the matrix with a diagonal
    larger by the factor 1 + ``raised``.
    """

    def __init__(self, matrix: Any, layers: OptionLayers, raised: float = 0.0) -> None:
        made_of = matrix
        if raised:
            made_of, diagonal = matrix.duplicate(copy=True), matrix.getDiagonal()
            made_of.setDiagonal(diagonal * (1.0 + raised))
        self.pc = made(made_of, layers)

    def begin(self) -> None:
        """Begin a step."""

    def follow(self, held: Indices) -> None:
        """Make M anew for the rows that are held, if it is time to. Collective.

        Closed conditions and sticking points hold them.
        """


class Multigrid(Inverse):
    """Hold GAMG, or what else the options say, of an AIJ matrix.

    It is renewed for the contact set.

    The interpolation is that of the whole A with its rigid modes, in which no set has left a
    trace.
    """

    def __init__(
        self, nodewise: Nodewise, surface: ContactSurface, layers: OptionLayers, work: Work
    ) -> None:
        self._nodewise, self._work, self._comm = nodewise, work, surface.comm
        self._matrix = nodewise.entries()
        if nodewise.A.space is not None:
            modes = rigid_modes(nodewise.A, surface, nodewise.layout, self._matrix.createVecLeft())
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
        """Make the Galerkin products anew when they are out of date.

        They are when more than a tenth of the held rows have changed since.
        """
        mask = np.zeros_like(self._built)
        mask[held] = True
        moved, size = self._comm.sum(
            np.array([np.sum(mask ^ self._built), np.sum(mask)], dtype=float)
        )
        if self._left and moved > DRIFT * size:
            self._left -= 1
            self._built = mask
            self._renew(held)

    def _renew(self, held: Indices) -> None:
        matrix = self._matrix
        self._nodewise.entries(matrix)
        diagonal = matrix.getDiagonal()
        rows = matrix.getOwnershipRange()[0] + held
        matrix.zeroRowsColumns(rows.astype(PETSc.IntType), diag=1.0)
        matrix.setDiagonal(diagonal)
        self.pc.setOperators(matrix)
        self.pc.setUp()
        self._work.renewals += 1


def made(matrix: Any, layers: OptionLayers) -> Any:
    """Return a PETSc preconditioner of a matrix, from the options.

    InputError when PETSc does not take them.
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
                # of none that is there
                layers.read.update(key for key in layers.own if key.startswith("mg_levels_"))
        except PETSc.Error as error:
            raise InputError(
                f"PETSc makes no preconditioner of the options under {layers.prefix} "
                f"({last_line(error)}): correct or drop them"
            ) from error
    return pc


def rigid_modes(
    A: EffectiveMatrix, surface: ContactSurface, layout: Layout, template: Any
) -> list[Any]:
    """Return orthonormal PETSc vectors of the rigid motions.

    They are in nodal frames, and relative at two bodies.
    """
    space, comm = A.space, A.algebra.comm
    d, points = int(space.dimension), np.asarray(space.coordinates)
    component = np.asarray(space.ids) % d
    low = -comm.max(-np.min(points, axis=0, initial=np.inf))
    high = comm.max(np.max(points, axis=0, initial=-np.inf))
    x = (points - 0.5 * (low + high)) / np.linalg.norm(high - low)
    modes = rigid_motions(np.eye(d)[component], x).T
    vectors = [template.duplicate() for _ in modes]
    for vector, mode in zip(vectors, modes, strict=True):
        unknowns = surface.in_frames(mode)  # T⁻¹ u
        if surface.coupling is not None:
            unknowns = 2.0 * unknowns - surface.coupling @ unknowns  # R⁻¹ = 2 - R
        vector.array[:] = layout.padded(unknowns)
    return orthonormal(vectors)


def orthonormal(vectors: list[Any]) -> list[Any]:
    """Return the vectors made orthonormal in place (Gram and Schmidt, twice).

    Those that vanish are left out.
    """
    kept: list[Any] = []
    for vector in vectors:
        before = vector.norm()
        for _ in range(2):
            for other in kept:
                vector.axpy(-vector.dot(other), other)
        size = vector.norm()
        if size > 1e-8 * before:
            vector.scale(1.0 / size)
            kept.append(vector)
    return kept
