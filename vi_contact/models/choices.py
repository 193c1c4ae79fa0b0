"""The words by which commands name time schemes and solvers."""

from __future__ import annotations

from dataclasses import dataclass

from ..core.protocols import ImpactLaw, MassLaw
from ..core.step import Scheme, Solver
from ..laws.impact import Inelastic, NoImpact
from ..laws.mass import ConsistentMass
from ..schemes.contact_stabilised import ContactStabilisedNewmark
from ..schemes.generalised_alpha import GeneralisedAlpha
from ..schemes.hht import HHT
from ..schemes.houbolt import Houbolt
from ..schemes.midpoint import Midpoint
from ..schemes.moreau_jean import MoreauJean
from ..schemes.newmark import Newmark
from ..schemes.ss22 import SS22
from ..schemes.trapezoidal import Trapezoidal
from ..schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from ..solvers.condensed import Condensed
from ..solvers.normal.hildreth import Hildreth
from ..solvers.normal.projected_cg import ProjectedCG
from ..solvers.volume.one_factorisation import OneFactorisation
from ..solvers.volume.route import Volume
from ..solvers.volume.snes import ReducedNewton, SemismoothNewton
from ..solvers.volume.tao import TaoTron


@dataclass(frozen=True)
class SchemeChoice:
    """A scheme, the mass matrix it runs on, and the impact law it comes with when the user names none."""

    scheme: Scheme
    mass: MassLaw
    impact: ImpactLaw


def _massless(scheme: Scheme) -> SchemeChoice:
    """A scheme on its own choice of mass, without impact law."""
    return SchemeChoice(scheme, scheme.mass, NoImpact())


def _with_seed_rule(scheme: Scheme) -> SchemeChoice:
    """Consistent mass and seed 000's inelastic rule."""
    return SchemeChoice(scheme, ConsistentMass(), Inelastic())


SCHEMES: dict[str, SchemeChoice] = {
    "zwt": _with_seed_rule(ZienkiewiczWoodTaylor(phi=0.5)),
    "zienkiewicz-wood-taylor": _with_seed_rule(ZienkiewiczWoodTaylor(phi=0.5)),
    "ss22": _with_seed_rule(SS22()),
    "trapezoidal": _massless(Trapezoidal()),
    "newmark": _massless(Newmark()),
    "hht": _massless(HHT(-0.1)),
    "generalised-alpha": _massless(GeneralisedAlpha.spectral_radius(0.8)),
    "houbolt": _massless(Houbolt()),
    "contact-stabilised": _massless(ContactStabilisedNewmark()),
    "kane": _massless(ContactStabilisedNewmark(projected=False)),
    "moreau-jean": _massless(MoreauJean()),
    "midpoint": _massless(Midpoint()),
    "newmark-consistent": _with_seed_rule(Newmark()),  # gains energy in contact: only by this name, and with a warning
}
SOLVERS: dict[str, Solver] = {
    "condensed": Condensed(),
    "hildreth": Condensed(Hildreth()),
    "projected-cg": Condensed(ProjectedCG()),
    "volume": Volume(method=OneFactorisation()),
    "volume-reference": Volume(method=ReducedNewton()),  # factorises every reduced matrix anew: shares only A and b
    "semismooth": Volume(method=SemismoothNewton()),
    "tron": Volume(method=TaoTron()),
}
