"""State a body that turns and strains as far as it likes, on its undeformed mesh.

    p(u)·v = ∫ F S : grad v,    S = 2 dW/dC,    C = FᵀF,    F = 1 + grad u        (total Lagrangian)

A step from u0 to u1 has one internal force of both ends,

    p̄(u0, u1)·v = ∫ ½ (F0 + F1) S̄ : grad v,    S̄ = 2 ∫_0^1 dW/dC(C0 + s (C1 - C0)) ds

Because C1 - C0 = 2 sym(½ (F0 + F1)ᵀ (F1 - F0)), its work is that of the stored energy,

    (u1 - u0)·p̄ = ∫ ½ S̄ : (C1 - C0) = W(u1) - W(u0)

and because S̄ is symmetric, forces of the middle place have no moment: energy, momentum and spin
are kept by any length of step. For Saint-Venant and Kirchhoff's law S̄ is the mean of both
stresses. Other energies take Gauss's rule in s: an average of dW/dC has no 0/0 where little
strains, as the quotient of Gonzalez (1996) has, which loses all digits in stiff bodies.

Sources: Simo and Tarnow, Z. angew. Math. Phys. 43 (1992) 757-792; Gonzalez, Comput. Methods Appl.
Mech. Eng. 190 (2000) 1763-1783; the average along s: McLachlan, Quispel and Robidoux, Phil. Trans.
R. Soc. A 357 (1999) 1021-1045.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import ufl

from ...core.algebra import Array, Matrix, largest, max_abs
from ...core.checks import on_all
from ...core.errors import InputError
from ...core.system import SemiDiscreteSystem
from ...laws.hyperelastic import SaintVenantKirchhoff
from ...laws.materials import Damping, MassProportional, NoDamping, PlaneStress, Section
from .. import compat
from .forms import ElasticForms
from .hyperelastic import TURNING, Hyperelastic, find_energy
from .initial_strains import InitialStrain
from .internal_forms import InternalForms
from .rigid_motion import RigidMotion
from .space import FemSpace

GAUSS = 4  # points in s: what they leave of W(u1) - W(u0) is round-off for strains of 0.1 in a step
AT_REST = 1e-6  # relative; by which an energy may miss E, nu and zero stress at C = 1


class TwoEndForms(InternalForms):
    """Assemble p, p', W, and p̄ of both ends of a step (``core.internal.TwoEndForce``)."""

    def __init__(
        self, space: FemSpace, energy: Callable[[Any], Any], *, thickness: float, points: int
    ) -> None:
        """Compile the forms. Collective.

        Args:
            space: the body's unknowns.
            energy: C (3, 3) -> W [J/m³].
            thickness: of the section [m].
            points: of Gauss's rule in s.

        Raises:
            InputError: supports that move, and an energy that UFL cannot integrate.
        """
        d = space.dimension
        h = compat.constant(space.mesh, thickness)
        dx = _measure(space)
        one = ufl.Identity(d)

        def strain(F: Any) -> Any:
            return _extend(F.T * F, 1.0)

        def stress(C: Any) -> tuple[Any, Any]:
            """Return S (3, 3) at C, and C as the variable that S depends on."""
            C = ufl.variable(C)
            return 2.0 * ufl.sym(ufl.diff(energy(C), C)), C

        def force(F: Any, S: Any, v: Any) -> Any:
            return h * ufl.inner(_upright(F) * F * _restrict(S, d), ufl.grad(v)) * dx

        def internal(u: Any, v: Any) -> Any:
            F = one + ufl.grad(u)
            return force(F, stress(strain(F))[0], v)

        super().__init__(space, internal, lambda u: h * energy(strain(one + ufl.grad(u))) * dx)

        # p̄: the gradient in the middle, and the mean stress along the way from C0 to C1.
        self._u0 = compat.function(space.V)
        v = ufl.TestFunction(space.V)
        du = ufl.TrialFunction(space.V)
        F0 = one + ufl.grad(self._u0)
        F1 = one + ufl.grad(self._u)
        F = 0.5 * (F0 + F1)
        C0 = strain(F0)
        C1 = strain(F1)
        places, weights = np.polynomial.legendre.leggauss(points)
        S = 0.0 * ufl.Identity(3)
        for place, weight in zip(0.5 * (1.0 + places), 0.5 * weights, strict=True):
            S = S + float(weight) * stress(C0 + float(place) * (C1 - C0))[0]
        between = h * ufl.inner(_upright(F1) * F * _restrict(S, d), ufl.grad(v)) * dx

        # The change of p̄ with the middle place, but for one factor F1, for which F stands: what is
        # left is symmetric, and has no stiffness against turns of the middle place, as p̄ has none.
        middle, C = stress(0.5 * (C0 + C1))
        i, j, k, m = ufl.indices(4)
        slope = ufl.diff(middle, C)
        change = _extend(2.0 * ufl.sym(F.T * ufl.grad(du)), 0.0)
        dS = ufl.as_tensor(slope[i, j, k, m] * change[k, m], (i, j))
        turned = ufl.grad(du) * _restrict(S, d) + F * _restrict(dS, d)
        about = h * ufl.inner(turned, ufl.grad(v)) * dx
        self._between = on_all(space.comm, "p̄", lambda: space.compile_form(between))
        self._about = on_all(space.comm, "the derivative of p̄", lambda: space.compile_form(about))
        body = space.body_of_node
        bodies = 1 + int(largest(space.comm, body.max(initial=-1)))
        self._motion = RigidMotion(body, bodies, space.comm)

    def _put_both(self, u0: Array, u1: Array) -> None:
        """Write the free unknowns (n,) of both ends into the Functions. Collective."""
        self._put(u0)
        self._u0.x.array[:] = self._u.x.array
        self._put(u1)

    def between(self, u0: Array, u1: Array) -> Array:
        """Return p̄(u0, u1) (n,) [N]. Collective."""
        self._put_both(u0, u1)
        return self._assemble_force(self._between)

    def between_tangent(self, u0: Array, u1: Array) -> Matrix:
        """Return about how p̄ changes with ½ (u0 + u1), (n, n) [N/m], symmetric. Collective."""
        self._put_both(u0, u1)
        return self._assemble_tangent(self._about)

    def assemble_beside(self, form: Any) -> Matrix:
        """Return another bilinear form on the free unknowns (n, n). Collective."""
        compiled = on_all(self._space.comm, "a form", lambda: self._space.compile_form(form))
        return self._assemble_tangent(compiled)

    def turn_on(self, u0: Array, u1: Array) -> Array:
        """Return where u1 (n,) would be if bodies turned on their way from u0. Collective."""
        space = self._space
        u = space.expand(u0, 0.0)
        way = space.expand(u1, 0.0) - u
        return u0 + space.restrict(self._motion.turn_on(space.points + u, way))


def _measure(space: FemSpace) -> Any:
    """Return the measure of the cells, by the rule of points of bodies that turn."""
    degree = space.quadrature_degree or 2 * space.degree
    return ufl.dx(metadata={"quadrature_degree": degree})


def _restrict(S: Any, d: int) -> Any:
    """Return the part (d, d) of a tensor (3, 3) in the plane of the body."""
    rows = []
    for i in range(d):
        rows.append([S[i, j] for j in range(d)])
    return ufl.as_tensor(rows)


def _extend(C: Any, across: float) -> Any:
    """Return a tensor (d, d) in the plane as one (3, 3), with a diagonal entry across it."""
    d = C.ufl_shape[0]
    rows: list[list[Any]] = []
    for i in range(3):
        rows.append([C[i, j] if max(i, j) < d else across * float(i == j) for j in range(3)])
    return ufl.as_tensor(rows)


def _upright(F: Any) -> Any:
    """Return 1, and NaN where the body is inside out, det F <= 0.

    C does not see it. The loop goes a part of the way where forces are no numbers, or refuses the
    step, which is then made in halves where the plan of time steps has such.
    """
    return 1.0 + ufl.ln(ufl.conditional(ufl.gt(ufl.det(F), 0.0), 1.0, -1.0))


class TurningForms(ElasticForms):
    """Hold the forms of a body whose materials have an energy W(C).

    M and the reference stiffness are those of the linear body at small strain.
    """

    def __init__(
        self,
        space: FemSpace,
        materials: list[tuple[Any, Any]],
        section: Section,
        damping: Damping,
    ) -> None:
        """Compile the forms. Collective.

        Args:
            space: the body's unknowns.
            materials: pairs of local cells and a material.
            section: that of the body.
            damping: the law of C.

        Raises:
            InputError: materials that do not turn beside others that do, plane stress, damping
                that resists rotation, sides that move together.
        """
        refuse_with_turning([given for _, given in materials], section, damping, space)
        super().__init__(space, materials, section, damping)
        energies = [find_energy(given, space.mesh) for _, given in materials]
        parts = _mark_cells(space, materials)
        self._parts = parts
        self._materials = [given for _, given in materials]
        self._own_energy = any(isinstance(given, Hyperelastic) for given in self._materials)

        def energy(C: Any) -> Any:
            return sum(part * density(C) for part, density in zip(parts, energies, strict=True))

        self._density = energy if len(energies) > 1 else energies[0]
        quadratic = all(isinstance(given, SaintVenantKirchhoff) for _, given in materials)
        self.internal = TwoEndForms(
            space,
            self._density,
            thickness=section.thickness,
            points=1 if quadratic else GAUSS,
        )

    def own(self, system: SemiDiscreteSystem) -> None:
        """Remember the matrices of a system, and check the energy by them. Collective."""
        super().own(system)
        if self._own_energy:
            self._check_rest(self._assemble_hooke())

    def _assemble_hooke(self) -> Matrix:
        """Return the stiffness at small strain, by the points of the energy. Collective.

        In cells that are no parallelograms other points give another one.
        """
        space = self.space
        u = ufl.TrialFunction(space.V)
        v = ufl.TestFunction(space.V)
        lame = 0.0
        shear = 0.0
        for part, given in zip(self._parts, self._materials, strict=True):
            lame = lame + part * compat.constant(space.mesh, given.lame_lambda)
            shear = shear + part * compat.constant(space.mesh, given.shear_modulus)
        density = lame * ufl.div(u) * ufl.div(v)
        density += 2.0 * shear * ufl.inner(ufl.sym(ufl.grad(u)), ufl.sym(ufl.grad(v)))
        return self.internal.assemble_beside(self.section.thickness * density * _measure(space))

    def _check_rest(self, K: Matrix) -> None:
        """Raise InputError unless force and stiffness at rest are zero and K. Collective.

        Args:
            K: the stiffness at small strain, by the points of the energy.
        """
        space = self.space
        rest = np.zeros(len(space.ids))
        off = self.internal.tangent(rest).diagonal() - K.diagonal()
        stiff = largest(space.comm, max_abs(K.diagonal()))
        wrong = largest(space.comm, max_abs(off))
        force = largest(space.comm, max_abs(self.internal.force(rest))) / space.size
        if not max(wrong, force) <= AT_REST * stiff:
            raise InputError(
                "assemble: the energy of a Hyperelastic material has at C = 1 not the E and nu "
                f"that are given beside it, as its stiffness is off by {wrong / stiff:.2g} and its "
                f"stress by {force / stiff:.2g} of it: correct one of them"
            )

    def stresses(self, u: Any) -> tuple[Any, Any]:
        """Return Cauchy's stress F S Fᵀ / J and its part across the plane, times the thickness.

        Of the trial function they are those at small strain.
        """
        if u is self.u:
            return super().stresses(u)
        d = self.space.dimension
        F = ufl.Identity(d) + ufl.grad(u)
        C = ufl.variable(_extend(F.T * F, 1.0))
        S = 2.0 * ufl.sym(ufl.diff(self._density(C), C))
        h = self.section.thickness / ufl.det(F)
        across = h * S[2, 2] if d == 2 else 0.0
        return h * F * _restrict(S, d) * F.T, across


def _mark_cells(space: FemSpace, materials: list[tuple[Any, Any]]) -> list[Any]:
    """Return for each material a Function that is one in its cells and zero in others."""
    cells = compat.cell_space(space.mesh)
    places = compat.cell_blocks(cells)[:, 0]
    parts = []
    for where, _ in materials:
        part = compat.function(cells)
        part.x.array[places[where]] = 1.0
        parts.append(part)
    return parts


def refuse_with_turning(
    materials: list[Any], section: Section, damping: Damping, space: FemSpace
) -> None:
    """Raise InputError for what does not go with bodies that turn.

    Args:
        materials: of all cells.
        section: that of the body.
        damping: the law of C.
        space: the body's unknowns.
    """
    others = [given for given in materials if not isinstance(given, TURNING)]
    if others:
        raise InputError(
            f"assemble: {type(others[0]).__name__} knows small rotations only, and other cells of "
            "the system turn: give SaintVenantKirchhoff there too, which is the same at small "
            "strain"
        )
    if isinstance(section, PlaneStress):
        raise InputError(
            "assemble: PlaneStress does not go with materials of bodies that turn, as the strain "
            "across the panel would have to be solved for: give PlaneStrain(thickness)"
        )
    if not isinstance(damping, NoDamping | MassProportional):
        raise InputError(
            f"assemble: {damping} resists the rotation of a body that turns, for its C is that of "
            "the undeformed place, or brakes rigid motions: leave damping out, or give "
            "MassProportional(c), the drag of a medium at rest"
        )
    if space.ties:
        raise InputError(
            "assemble: Tied sides keep their distance along fixed axes, which a body that turns "
            "does not: leave tied= out, or give a LinearElastic material"
        )


def refuse_beside_turning(dashpots: Sequence[Any], loads: Sequence[Any]) -> None:
    """Raise InputError for boundaries and loads that are of the undeformed place alone.

    Args:
        dashpots: absorbing boundaries.
        loads: of the body.
    """
    if dashpots:
        raise InputError(
            f"assemble: {type(dashpots[0]).__name__} absorbs waves along the normals of the "
            "undeformed body, and would resist its rotation: leave dashpots= out, or give a "
            "LinearElastic material"
        )
    if any(isinstance(load, InitialStrain) for load in loads):
        raise InputError(
            "assemble: InitialStrain is a load of the undeformed place, which does not turn with "
            "the body: give fem.Hyperelastic an energy with its least value at the strain"
        )
