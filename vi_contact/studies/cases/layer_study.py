"""Let a particle hit a wall through a boundary layer, from the values of a case file's table [layer]."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.integrate import cumulative_trapezoid

from ...boundary_layer.layer import Layer
from ...boundary_layer.metric import Metric
from ...boundary_layer.particle import ParticleImpact, layer_for
from ...boundary_layer.trajectory import passage
from ...core.checks import check_word
from ...core.errors import InputError
from ...core.files import write_csv
from ...plots.studies import plot_particle

TABLE = "impacts.csv"
COLUMNS = ("k [N/m]", "c [N]", "e", "e_p", "t_c [s]", "t_f [s]", "x_min [m]")
NOTE = "e: Newton's; e_p: Poisson's with the boundary force; t_c, t_f: end of compression, of contact"


@dataclass(frozen=True)
class LayerStudy:
    """Send a particle of ``mass`` [kg] into the layer of ``width`` b [m] with ``speed`` [m/s].

    Every pair of ``k`` [N/m] and ``c`` [N] is run; a ``restitution`` finds one pair instead, with the greatest
    compression at ``deepest`` times b. start: where the force is complete [m] (default b); law_speed: V of the law
    [m/s] (default the particle's). metric: "dominant" (closed form), "full", "blended" or "flat".
    """

    mass: float = 1.0
    speed: float = 1.0
    width: float = 1.0
    start: float | None = None
    k: tuple[float, ...] = (1.0,)
    c: tuple[float, ...] = (0.0, 1.0)
    law_speed: float | None = None
    restitution: float | None = None
    deepest: float = 0.5
    metric: str = "dominant"
    impacts: tuple[ParticleImpact, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        check_word("metric", self.metric, [one.value for one in Metric])
        if self.restitution is not None:
            if not self.closed:
                raise InputError("restitution is for the closed form: leave metric and start out")
            layers = [layer_for(self.restitution, mass=self.mass, speed=self.speed, width=self.width,
                                deepest=self.deepest)]
        else:
            layers = [Layer(self.width, k=k, c=c, speed=self.law_speed, start=self.start)
                      for k in self.k for c in self.c]
        impacts = tuple(ParticleImpact(layer, self.mass, self.speed) for layer in layers)
        object.__setattr__(self, "impacts", impacts)

    @property
    def closed(self) -> bool:
        """Return whether the closed form holds."""
        return self.metric == "dominant" and self.start in (None, self.width)

    def run(self, folder: Path) -> str:
        """Write the table of all impacts into the folder; return it as text."""
        rows = [(one.layer.k, one.layer.c, *(_closed(one) if self.closed else _integrated(one, self.metric)))
                for one in self.impacts]
        write_csv(folder / TABLE, COLUMNS, rows)
        lines = ["{:>12} {:>12} {:>9} {:>9} {:>12} {:>12} {:>12}".format(*COLUMNS)]
        for k, c, e, poisson, *others in rows:
            lines.append(f"{k:12.6g} {c:12.6g} {e:9.6f} {poisson:9.6f}" + "".join(f" {one:12.6g}" for one in others))
        return "\n".join([*lines, NOTE])

    def draw(self, folder: Path) -> list[Path]:
        """Draw distance and velocity of all impacts. InputError where there is no closed form."""
        if not self.closed:
            raise InputError("the picture is of the closed form: leave metric and start out of the case")
        groups: dict[str, list[tuple[str, ParticleImpact]]] = {}
        for one in self.impacts:
            groups.setdefault(f"k = {one.layer.k:.4g} N/m", []).append((f"c = {one.layer.c:.4g} N", one))
        return [plot_particle(groups, folder / "particle.png")]


def _closed(impact: ParticleImpact) -> tuple[float, ...]:
    return impact.restitution, impact.poisson_covector, impact.compression_time, impact.duration, impact.deepest


def _integrated(impact: ParticleImpact, metric: str) -> tuple[float, ...]:
    """Return the same in any reading, from x = b, by integration in time."""
    layer = impact.layer
    motion = passage(layer, impact.mass, impact.speed, Metric(metric), rtol=1e-11, refine=100)
    contact = motion.contacts[0]
    force = layer.at(impact.speed).force(motion.rho, motion.v[:, 0])
    impulse = cumulative_trapezoid(force, motion.t, initial=0.0)
    pushed = float(np.interp(contact.turned, motion.t, impulse))
    poisson = (float(impulse[-1]) - pushed) / pushed
    return contact.restitution, poisson, contact.turned - contact.start, contact.duration, contact.deepest
