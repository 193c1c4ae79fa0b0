"""Fit fragility curves.

They give the probability that a demand passes its limit, over the intensity of the motion.

The capacity of a record is the intensity at which its demand first passes the limit (Vamvatsikos
and Cornell, Earthquake Engng Struct. Dyn. 31, 2002). Its runs tell between which two levels a < b
it lies: a = 0 where already the lowest passes, b infinite where none does. Capacities are taken as
lognormal with median theta and dispersion beta, and records as independent:

    P(passed | x) = Phi(ln(x/theta)/beta),
    L(theta, beta) = prod_i [Phi(ln(b_i/theta)/beta) - Phi(ln(a_i/theta)/beta)]

theta and beta make L largest; ln L is concave in 1/beta and ln(theta)/beta (Burridge, J. R. Stat.
Soc. B 43, 1981), so there is one such place. Intervals come from the second derivatives of ln L
there: 95 % for many records, too narrow for fewer than ten.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize
from scipy.special import log_ndtr, ndtr

from ....core.algebra import Array
from ....core.arguments import check_arguments
from ....core.errors import InputError
from .measures import Demand, read_demand

NORMAL = 1.959963984540054  # 95 % of the normal distribution lie within so many standard deviations
SAME = 1e-9  # of two intensities: they are those of records that were scaled to one
# of 1/beta, over that of the levels: below it the records do not tell how far capacities lie apart
LEAST = 0.01


def read_limit(text: str) -> tuple[Demand, float]:
    """Return demand and limit of a text "COLUMN:WAY=VALUE", the value in the unit of the column.

    It is passed by a demand at the value or above, for the way "min" at it or below.

    Raises:
        InputError: for other texts.
    """
    name, _, number = text.partition("=")
    try:
        value = float(number)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(
            f"limit '{text}': give COLUMN:WAY=VALUE with a number in the unit of the column, such "
            "as contact_max_slip:max=0.05"
        )
    return read_demand(name), value


def bracket_capacities(rows: Sequence[Mapping[str, Any]], text: str, level: str) -> Array:
    """Return the intensities between which each record first passes a limit.

    Of a record count the runs below its first failed one; one without any is left out.

    Args:
        rows: of ida.csv.
        text: the limit, "COLUMN:WAY=VALUE".
        level: the column of the intensity.

    Returns:
        (records, 2): the highest intensity that does not pass, or 0, and the lowest that does, or
        infinity.
    """
    demand, limit = read_limit(text)
    brackets: dict[str, tuple[float, float]] = {}
    ended = set()  # records whose bracket is known, or of which a run has failed
    known = [row for row in rows if row[level] is not None]
    for row in sorted(known, key=lambda row: float(row[level])):
        record = row["record"]
        value = row[demand.name]
        if record in ended or row["status"] != "finished" or not math.isfinite(value):
            ended.add(record)
        elif value <= limit if demand.way == "min" else value >= limit:
            below, _ = brackets.get(record, (0.0, math.inf))
            brackets[record] = (below, row[level])
            ended.add(record)
        else:
            brackets[record] = (row[level], math.inf)
    return np.array(list(brackets.values())).reshape(-1, 2)


@dataclass(frozen=True)
class Fragility:
    """Hold a fitted curve.

    Attributes:
        theta: median, in the unit of the intensity.
        beta: dispersion [-].
        covariance: (2, 2) of the logarithms of both.
        brackets: (records, 2) intensities that it was fitted to.
    """

    theta: float
    beta: float
    covariance: Array
    brackets: Array

    @property
    def intervals(self) -> Array:
        """Return (low, high) of theta and of beta, (2, 2): 95 % intervals."""
        size = NORMAL * np.sqrt(np.diag(self.covariance))
        return np.array([[self.theta], [self.beta]]) * np.exp(np.outer(size, [-1.0, 1.0]))

    def probability(self, intensities: Array) -> Array:
        """Return P(passed), (3, n): the lower 95 % bound, the curve itself, and the upper bound."""
        z = np.log(intensities / self.theta) / self.beta
        slopes = np.stack([np.full_like(z, 1.0 / self.beta), z])  # of -z by ln theta and ln beta
        size = NORMAL * np.sqrt(np.einsum("pi,pq,qi->i", slopes, self.covariance, slopes))
        return np.asarray(ndtr(z + np.outer([-1.0, 0.0, 1.0], size)))


@check_arguments
def fragility_curve(brackets: Array) -> Fragility:
    """Return the fragility of brackets, by maximum likelihood.

    Args:
        brackets: (records, 2) intensities between which each record first passes the limit: the
            lower one 0 where already the lowest run passes, the upper one infinite where none does.

    Raises:
        InputError: where they do not tell median and dispersion.
    """
    brackets = np.asarray(brackets, dtype=float)
    if brackets.ndim != 2 or brackets.shape[1] != 2:
        raise InputError(
            f"fragility_curve: brackets has shape {brackets.shape}; give two intensities for each "
            "record"
        )

    # Where one intensity lies in all brackets, every dispersion down to zero fits.
    low = np.max(brackets[:, 0], initial=0.0)
    high = np.min(brackets[:, 1], initial=math.inf)
    if low <= high * (1.0 + SAME):
        raise InputError(
            f"{np.isfinite(brackets[:, 1]).sum()} of {len(brackets)} records pass the limit, maybe "
            f"all at one intensity from {low:g} to {high:g}: give other or closer levels, or more "
            "records"
        )

    # Logarithms, shifted and scaled so that the unknowns p are of the size of one.
    with np.errstate(divide="ignore"):
        x = np.log(brackets)
    levels = x[np.isfinite(x)]
    centre = np.mean(levels)
    spread = np.std(levels)
    x = (x - centre) / spread

    # The largest likelihood over p = (1/beta, ln(theta)/beta), in which -ln L is convex.
    p = minimize(
        lambda p: _negate(_compute_likelihood(p, x)),
        [1.0, 0.0],
        jac=True,
        method="L-BFGS-B",
        bounds=[(LEAST, None), (None, None)],
    ).x
    if p[0] <= LEAST:
        raise InputError(
            f"the capacities of {len(brackets)} records have a spread that cannot be fitted: give "
            "more levels, or more records"
        )
    for _ in range(3):  # of Newton, from digits that are enough to all of them
        _, slope, bend = _compute_likelihood(p, x)
        p = p - np.linalg.solve(bend, slope)

    # Back to theta and beta, and the covariance of their logarithms by the inverse of -d²lnL/dp².
    beta = spread / p[0]
    median = spread * p[1] / p[0]  # ln theta - centre
    derivatives = np.array([[-median, spread], [-1.0, 0.0]]) / p[0]  # of ln theta, ln beta by p
    covariance = derivatives @ np.linalg.inv(-bend) @ derivatives.T
    return Fragility(float(np.exp(centre + median)), float(beta), covariance, brackets)


def _negate(likelihood: tuple[float, Array, Array]) -> list[Any]:
    """Return -ln L and its first derivatives, which the minimisation takes."""
    value, slope, _ = likelihood
    return [-value, -slope]


def _compute_likelihood(p: Array, x: Array) -> tuple[float, Array, Array]:
    """Return ln L at p = (1/beta, ln(theta)/beta), and its first and second derivatives.

    Args:
        p: (2,).
        x: (records, 2) brackets of ln capacity, infinite where they are open.
    """
    # z = (x - ln theta) / beta is linear in p, with the derivatives ``sides``; open ends stay.
    known = np.isfinite(x)
    sides = np.stack([np.where(known, x, 0.0), -np.ones_like(x)], axis=-1)
    z = np.where(known, sides @ p, x)

    # ln[Phi(b) - Phi(a)] = ln Phi(b) + ln(1 - Phi(a)/Phi(b)). For a > 0 both are turned round, to
    # the tail that has digits: Phi(b) - Phi(a) = Phi(-a) - Phi(-b).
    a, b = log_ndtr(np.where(z[:, :1] > 0.0, -z[:, ::-1], z).T)
    logs = b + np.log(-np.expm1(a - b))

    # Derivatives by z are -+ phi(z)/[Phi(b) - Phi(a)], and phi' = -z phi.
    weights = [-1.0, 1.0] * np.exp(-0.5 * z**2 - 0.5 * math.log(2.0 * math.pi) - logs[:, None])
    slopes = np.einsum("ie,iep->ip", weights, sides)
    bends = np.einsum("ie,iep,ieq->pq", np.where(known, z, 0.0) * weights, sides, sides)
    return float(logs.sum()), slopes.sum(axis=0), -bends - slopes.T @ slopes
