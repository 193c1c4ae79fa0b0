"""Judge one step: how far an answer is from solving it; ``core.verify`` computes that."""

from dataclasses import dataclass, fields

from .html import make_table


@dataclass(frozen=True)
class Certificate:
    """Hold the dimensionless residuals of one step, each 0 for an exact solution.

    Attributes:
        equilibrium: |A x - b + B_nᵀ r_n|_max over the largest of |b|, |A x|, |K u| and
            1e-5 |A_ii| |x|. In a step of a scheme x is an increment and b what is left of the
            forces at the guess (``core.stage``), of which K u is the internal one; so the residual
            is M a + C v + K u - f + Bᵀ r in the forces of the step themselves. The last term
            matters on fine meshes only, where the parts of A x cancel: it keeps the rounding errors
            of the residual itself (1e-16 |A||x|) below the tolerance; what passes at 1e-9 is then
            at most 1e-14 |A||x|. Bodies that turn are displaced by their own size: of them the
            last term is 1e-6 |A_ii| |x|, which is ten times their rounding.
        penetration: max(-gap, 0) / x_ref.
        tension: max(-r_n, 0) / r_ref.
        complementarity: max |gap| / x_ref over active and bilateral conditions, max |r_n| / r_ref
            over the others: the set that the impact law will see is certified too.
        cone: max(|r_t| - limit(r_n), 0) / t_ref; 0 without friction.
        dissipation: max (limit |slip| - r_t·slip) / (t_ref s_ref), the maximum dissipation that
            Coulomb's and Tresca's law ask for: it is 0 where the slip or the limit is, or where
            r_t lies along the slip on the edge of the cone, and without friction.
        resultant: of static stages, the largest |w·(b - B_nᵀ r_n - B_tᵀ r_t)| over max |w| times
            the sum of |b| and |Bᵀr| on a body, for its rigid motions w that no prescribed
            displacement holds: nodal residuals may be small and add up.
        law: with a joint, the largest difference between its strength at the answer and the
            strength that the step was solved with, over the largest strength (``core.joints``); 0
            without one. A step solved with a wrong strength passes all residuals above.
        material: of bodies that yield, the largest residual of the laws at points of integration at
            the end of the step: the yield function above zero over the largest stress, and the flow
            rule over the largest elastic strain, computed beside the return to the yield surface
            and not by it (``laws.yielding``).

    The references are maxima over all unknowns, so that a wide gap blunts no residual:
    x_ref = max(|x|, |guess|), r_ref = max(|b|, |K u|, |r_n|), t_ref = max(limit, |r_t|,
    1e-10 r_ref) and s_ref = max(|slip|, 1e-5 x_ref): a step slides a small part of the way and rubs
    with a small part of the inertia.
    """

    equilibrium: float
    penetration: float
    tension: float
    complementarity: float
    cone: float = 0.0
    dissipation: float = 0.0
    resultant: float = 0.0
    law: float = 0.0
    material: float = 0.0

    @property
    def worst(self) -> float:
        """Return the largest residual; NaN counts as infinite."""
        values = vars(self).values()
        return max(values) if sum(values) >= 0.0 else float("inf")

    def list_rows(self) -> list[tuple[str, str]]:
        """Return (name, residual) of the largest one and of all, for tables."""
        rows = [("certificate, largest residual", f"{self.worst:.2e}")]
        for field in fields(self):
            residual = getattr(self, field.name) + 0.0  # no minus before a zero
            rows.append((f"  {field.name}", f"{residual:.2e}"))
        return rows

    def _repr_html_(self) -> str:
        """Return a table for a notebook, which calls this by its name."""
        return make_table(self.list_rows())
