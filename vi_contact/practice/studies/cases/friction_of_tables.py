"""Give each table [[contact]] of a case its own coefficient of friction.

The ``mu`` of a [[contact]] is that of Coulomb's law on its points. A table without one has the law
of [friction].
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from ....core.algebra import total
from ....core.protocols import FrictionLaw, Frictionless
from ....core.surfaces import ContactSurface
from ....laws.friction import Coulomb
from .table_calls import Call


def list_laws(whole: FrictionLaw, contacts: Sequence[Call]) -> list[FrictionLaw]:
    """Return the law of friction of each table.

    Args:
        whole: that of [friction], ``Frictionless`` without.
        contacts: the tables [[contact]].

    Raises:
        InputError: a table has a coefficient beside [friction] of another law than Coulomb's, or
            beside values for each point.
    """
    laws: list[FrictionLaw] = []
    for contact in contacts:
        mu = contact.arguments.get("mu")
        if mu is not None:
            _refuse_other_law(whole, contact)
        laws.append(whole if mu is None else Coulomb(mu))
    return laws


def _refuse_other_law(whole: FrictionLaw, contact: Call) -> None:
    """Raise InputError unless [friction] is Coulomb's law with one number, or is not there."""
    one_number = isinstance(whole, Coulomb) and not isinstance(whole.mu, tuple)
    if not one_number and not isinstance(whole, Frictionless):
        raise contact.spot.make_table_error(
            f"has mu, which is Coulomb's, and [friction] is {type(whole).__name__}: give "
            '[friction] type = "Coulomb" with one mu, or leave the mu of the table out'
        )


def join_laws(
    whole: FrictionLaw,
    contacts: Sequence[Call],
    surface: ContactSurface,
    tables: Sequence[int],
) -> FrictionLaw:
    """Return the law of all contact points, with a value for each where tables differ. Collective.

    Args:
        whole: the law of [friction].
        contacts: the tables [[contact]].
        surface: the joined surface, whose conditions are those of one table after the other.
        tables: how many parts of it each table has.
    """
    if all("mu" not in contact.arguments for contact in contacts):
        return whole
    values = [find_mu(law) or 0.0 for law in list_laws(whole, contacts)]
    if len(set(values)) == 1:
        return Coulomb(values[0])
    return Coulomb(np.repeat(values, count_points(surface, tables)))


def count_points(surface: ContactSurface, tables: Sequence[int]) -> list[int]:
    """Return how many points of a joined surface each table has on all ranks. Collective.

    Args:
        surface: the joined surface.
        tables: how many parts of it each table has.
    """
    parts: Sequence[Any] = getattr(surface, "parts", ())
    counts = [round(total(surface.comm, len(part.slots))) for part in parts]
    ends = np.cumsum(np.array([0, *tables], dtype=int)).tolist()
    return [sum(counts[first:last]) for first, last in pairwise(ends)]


def find_mu(law: FrictionLaw) -> float | None:
    """Return the one coefficient of a law, zero without friction, None where there is no such."""
    if isinstance(law, Frictionless):
        return 0.0
    is_single = isinstance(law, Coulomb) and not isinstance(law.mu, tuple)
    return float(law.mu) if is_single else None  # type: ignore[attr-defined]
