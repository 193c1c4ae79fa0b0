"""Take loads as a user of UFL writes them: linear forms, their work on a displacement v."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
import ufl

from ...core.algebra import Array
from ...core.checks import function, on_all, optional, refuse
from ...core.errors import InputError
from .. import compat
from .form_checks import form_of
from .initial_strains import InitialStrain
from .loads import BodyForce, Traction
from .space import FemSpace

NAME = "LinearForm"


@dataclass(frozen=True)
class LinearForm:
    """Apply the load whose virtual work is L(v), as UFL with measures.

    It is v -> ufl.Form, such as ∫ f·v dx + ∫ g·v ds.

    f in N/m³ and g in Pa push along +v; what the form gives is multiplied by the section's
    thickness, as other loads are. The form may hold DOLFINx Functions and Constants of this mesh,
    gradients of v and Measures with the user's own MeshTags: LinearForm(lambda v: ufl.inner(g, v) *
    ds(3)).

    Args:
        form: called once, with a test function of the displacement's space.
        history: factor f(t) of the form, which is assembled once, as it is without one; t in
            seconds.
        update: function of the time alone that sets Constants and Functions of the form to their
            values at t, on every rank (``f.x.scatter_forward()`` where it writes to arrays). The
            form is then assembled anew at every time that a step asks for: one sweep over its cells
            or facets, where a history costs one vector update. Whether a restart goes on with the
            same update is looked at in the first steps only.

    Raises:
        InputError: history and update together; from ``assemble``, on all ranks: what is no linear
            form in v on this mesh; from ``assemble`` and in steps: NaN or infinite forces, an
            update that ends in an error.
    """

    form: Callable[[Any], Any]
    history: Callable[[float], float] | None = None
    update: Callable[[float], Any] | None = None
    # space -> (owned full,) forces [N] of a form that is assembled once
    _once: Any = field(default_factory=WeakKeyDictionary, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        function(
            NAME,
            "form",
            self.form,
            "give a function of the test function v that returns a UFL form",
        )
        for name in ("history", "update"):
            optional(
                function,
                NAME,
                name,
                getattr(self, name),
                "give a function of the time [s], or None",
            )
        if self.history is not None and self.update is not None:
            raise InputError(f"{NAME} has a history and an update; give one of the two only")

    @property
    def is_constant(self) -> bool:
        """Return whether one assembly serves all times."""
        return self.update is None

    def full(self, space: FemSpace, thickness: float) -> Callable[[float], Array]:
        """Return a function t [s] -> forces (owned full,) [N], less the history. Collective.

        Args:
            space: the body's unknowns.
            thickness: that of the section [m], a factor of the forces.

        Raises:
            InputError: on all ranks, what is no linear form in v on the mesh of the space.
        """
        if space in self._once:
            return lambda t: np.asarray(self._once[space])
        name = f"{NAME}: form"
        v = ufl.TestFunction(space.V)
        form = form_of(name, self.form, space, v)
        compiled = on_all(space.comm, name, lambda: space.compile_form(form))
        update = self.update

        def assemble_at(t: float) -> Array:
            if update is not None:
                on_all(space.comm, f"{NAME}: update({t:g})", lambda: update(t))
            vector = compat.assemble_vector(compiled)
            forces = thickness * vector.array_r
            vector.destroy()
            defect = (
                f"{NAME} gives NaN or infinite forces at t = {t:g} s: check its Functions, "
                "Constants and numbers"
            )
            refuse(["" if np.all(np.isfinite(forces)) else defect], space.comm)
            if update is None:
                forces = self._once.setdefault(space, forces)
            return np.asarray(forces)

        return assemble_at


LOADS = Traction, BodyForce, InitialStrain, LinearForm
AnyLoad = Traction | BodyForce | InitialStrain | LinearForm
Loads = AnyLoad | Sequence[AnyLoad]
