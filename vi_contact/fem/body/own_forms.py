"""Take the variational forms of a body from the user, in the place of a material's."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import ufl

from ...core.errors import InputError
from ...laws.materials import Damping, PlaneStrain, Rayleigh, Section
from .. import compat
from .form_checks import form_of, is_symmetric, matrix_of, refuse_masses, refuse_stress, takes
from .forms import ElasticForms, Material
from .internal_forms import InternalForms, find_reference
from .space import FemSpace

Bilinear = Callable[[Any, Any], Any]
ROLES = {"K": "stiffness", "C": "damping", "M": "mass"}


@dataclass(frozen=True, kw_only=True)
class Forms:
    """State a body by weak forms.

    They are functions (u, v) -> UFL form, u the trial and v the test function.

        M_ij = mass(phi_j, phi_i),   K_ij = stiffness(phi_j, phi_i),   C_ij = damping(phi_j, phi_i)

    With E, a stiffness, a prestress, … in Functions, Constants and expressions of the user's own.
    The forms are integrated as they are, ``ufl.dx`` and other measures included: where a section
    has a thickness other than 1 m it belongs into them, for contact weights, loads and dashpots are
    multiplied by that of the section. What they hold must keep its values while the system is used:
    reactions and section forces integrate them again.

    Args:
        stiffness: the form of K [N/m]. One that is not symmetric has no energy, and is for Volume()
            and Lemke().
        mass: the form of M [kg], symmetric and positive; None: the density of ``assemble(…,
            material)``, and without a material a system for static stages alone.
        damping: the form of C [N s/m]; None: that of ``assemble(…, damping=)``, Rayleigh on these M
            and K, or KelvinVoigt; both add up.
        stress: u -> stress tensor [Pa], (d, d), or in the plane (3, 3) with sigma_zz; von Mises
            stresses and stresses as Functions need it.
        internal: the internal force p(u)·v of a body that is not linear, a form that is linear in v
            alone, in the place of the stiffness. Here u is a Function. Steps then go through the
            nonlinear loop (``solvers.nonlinear``); ``stiffness``, by default the derivative of p at
            u = 0, is the reference whose factor it takes between tangents.
        energy: W(u) [J] with p = dW/du, for the energy ledger; given with ``internal``.

    Raises:
        InputError: not functions of two arguments (stress: of one); ``assemble`` refuses forms that
            are not bilinear in u and v or on another mesh, masses that are not positive, and
            entries that are not finite.
    """

    stiffness: Bilinear | None = None
    mass: Bilinear | None = None
    damping: Bilinear | None = None
    stress: Callable[[Any], Any] | None = None
    internal: Bilinear | None = None
    energy: Callable[[Any], Any] | None = None

    def __post_init__(self) -> None:
        if (self.internal is None) != (self.energy is None):
            raise InputError(
                "Forms: internal and energy belong together: give the internal force (u, v) and "
                "the stored energy (u), or none of the two"
            )
        if self.stiffness is None and self.internal is None:
            raise InputError("Forms: give stiffness=, the form of K, or internal= and energy=")
        allowed = {
            "stiffness": "uv",
            "mass": "uv",
            "damping": "uv",
            "stress": "u",
            "internal": "uv",
            "energy": "u",
        }
        for name, arguments in allowed.items():
            if getattr(self, name) is not None:
                takes(name, getattr(self, name), *arguments)


class OwnForms(ElasticForms):
    """Hold the user's forms of one body.

    ``fields`` are those of the material beside them, empty where there is none.
    """

    def __init__(
        self,
        space: FemSpace,
        given: Forms,
        materials: list[tuple[Any, Material]],
        section: Section,
        damping: Damping,
    ) -> None:
        """Assemble and check the matrices at once. Collective.

        Args:
            space: the body's unknowns.
            given: the user's forms.
            materials: pairs of local cells and a material, none where the forms need none.
            section: that of the body.
            damping: a law whose C is added to that of the forms.

        Raises:
            InputError: as for ``Forms``.
        """
        super().__init__(space, materials, section, damping)
        self._given = given
        self.statics_only = given.mass is None and not materials
        self.tells_stress = given.stress is not None
        self.own_damping = given.damping is not None
        self.densities = bool(materials) and given.mass is None and given.damping is None

        # C = alpha M + beta K + viscous stresses + the user's own, of which any may be missing
        rayleigh = damping if isinstance(damping, Rayleigh) else Rayleigh(0.0, 0.0)
        shares = {"M": rayleigh.alpha, "K": rayleigh.beta}
        self.law_damps = any(shares.values()) or self.viscous is not None
        self.damped = self.law_damps or given.damping is not None
        if given.stress is not None:
            refuse_stress(given.stress, space)
        if given.internal is not None and given.energy is not None:
            self.internal = InternalForms(space, given.internal, given.energy)
        self._forms = {
            "K": self._read_form("K"),
            "M": self._read_form("M") or self._weigh_by_density(),
        }
        dampers = [
            compat.constant(space.mesh, share) * self._forms[name]
            for name, share in shares.items()
            if share
        ]
        if self.viscous:
            dampers.append(self._viscous_form())
        if given.damping is not None:
            dampers.append(self._read_form("C"))
        if dampers:
            self._forms["C"] = sum(dampers[1:], dampers[0])
        self._full = {
            name: matrix_of(ROLES[name], space, partial(space.compile_form, form))
            for name, form in self._forms.items()
        }
        refuse_masses(self._full["M"], space)
        self.symmetric = all(is_symmetric(matrix, space) for matrix in self._full.values())
        self.notes = self._describe(bool(materials))

    def _read_form(self, name: str) -> Any:
        """Return the form that was given for M, C or K, or None. Collective."""
        call = getattr(self._given, ROLES[name])
        if name == "K" and call is None:
            assert self._given.internal is not None  # one of the two is there
            call = find_reference(self.space, self._given.internal)
        if call is None:
            return None
        return form_of(f"Forms: {ROLES[name]}", call, self.space, self.u, self.v)

    def _weigh_by_density(self) -> Any:
        """Return the form of M by the density of the material; of one where there is none.

        Static stages weigh motions of a body that nothing holds by it: any density will do.
        """
        if self.statics_only:
            return ufl.inner(self.u, self.v) * ufl.dx
        return super().bilinear("M")

    def _describe(self, material: bool) -> tuple[str, ...]:
        """Return sentences on what comes from where; ``material``: whether there is one beside."""
        if self.statics_only:
            mass = "nothing, for static stages alone"
        elif self._given.mass is None:
            mass = "the density of the material"
        else:
            mass = "a form"
        stress = "a" if self.tells_stress else "no"
        waves = "the material beside them" if material else "no material"
        notes = [
            f"the body is stated by forms: its mass by {mass}, its stress by {stress} form, wave "
            f"speeds at boundaries by {waves}"
        ]
        if not self.symmetric:
            notes.append(
                "its matrices are not symmetric: for Volume() and Condensed(Lemke()), and ½ uᵀKu "
                "is no energy"
            )
        if (
            self.tells_stress
            and isinstance(self.section, PlaneStrain)
            and self._stress(self.u).ufl_shape == (2, 2)
        ):
            notes.append("von Mises stresses take sigma_zz as zero: give a stress of shape (3, 3)")
        return tuple(notes)

    def stresses(self, u: Any) -> tuple[Any, Any]:
        """Return the stress and sigma_zz(u) times the thickness."""
        sigma = self._stress(u)
        d = self.space.dimension
        h = self.section.thickness
        across = h * sigma[2, 2] if d == 2 and sigma.ufl_shape == (3, 3) else 0.0
        # of a tensor (3, 3) in the plane the corner is that of the plane
        rows = []
        for i in range(d):
            rows.append([sigma[i, j] for j in range(d)])
        return h * ufl.as_tensor(rows), across

    def hooke(self, eps: Any, across: Any, trace: Any) -> tuple[Any, Any]:
        """Raise InputError: the forms do not tell the C of a material.

        Args:
            eps: strain.
            across: strain across the plane.
            trace: trace of the strain.
        """
        raise InputError(
            "InitialStrain needs the C of a material; give a LinearForm, and stress= less C eps_0"
        )

    def _stress(self, u: Any) -> Any:
        if self._given.stress is None:
            raise InputError("forms=… of the system have no stress: give fem.Forms(…, stress=)")
        return self._given.stress(u)

    def bilinear(self, name: str) -> Any:
        """Return the form of M, K or C."""
        return self._forms[name]

    def matrix(self, name: str) -> Any:
        """Hand out a matrix that was assembled and checked, once."""
        return self._full.pop(name)
