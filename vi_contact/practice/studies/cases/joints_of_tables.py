"""Give each table [[contact]] of a case its own joint.

The ``joint`` of a [[contact]] stands in the place of its friction. A table without one keeps
Coulomb's law, as a joint that has nothing to lose.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ....core.errors import InputError
from ....core.joint_laws import JointLaw
from ....core.problem import on_points
from ....core.protocols import FrictionLaw
from ....core.surfaces import ContactSurface
from ....laws.joint import Joint
from ....laws.joints_by_part import JointsByPart
from .friction_of_tables import count_points, find_mu, list_laws
from .sentences import write_for_case_files
from .table_calls import Call, build


def join_joints(
    whole: FrictionLaw,
    contacts: Sequence[Call],
    surface: ContactSurface,
    tables: Sequence[int],
) -> JointLaw | None:
    """Return the law of the joints of all contact points; None without any. Collective.

    Args:
        whole: the law of [friction].
        contacts: the tables [[contact]].
        surface: the joined surface, whose conditions are those of one table after the other.
        tables: how many parts of it each table has.

    Raises:
        InputError: a table has mu beside joint, or another one friction that is not Coulomb's.
    """
    if all("joint" not in contact.arguments for contact in contacts):
        return None
    laws: dict[str, Any] = {}
    for number, (contact, rubbing) in enumerate(
        zip(contacts, list_laws(whole, contacts), strict=True), start=1
    ):
        laws[f"{number}"] = _find_law(contact, rubbing)
    if len(contacts) == 1:
        _refuse_at_points(laws["1"], contacts[0], surface)
        return laws["1"]
    part = np.repeat(np.arange(len(contacts)), count_points(surface, tables))
    return JointsByPart(laws, part)


def _refuse_at_points(law: JointLaw, contact: Call, surface: ContactSurface) -> None:
    """Raise InputError, with its table, for values that are wrong at the points. Collective.

    Args:
        law: of the table.
        contact: the table.
        surface: whose points they are.
    """
    try:
        on_points(law, surface)
    except InputError as error:
        table = contact.arguments["joint"].spot
        raise table.make_table_error(write_for_case_files(str(error))) from error


def _find_law(contact: Call, rubbing: FrictionLaw) -> Any:
    """Return the joint of a table, or its friction as a joint.

    Args:
        contact: the table.
        rubbing: its law of friction.
    """
    joint = contact.arguments.get("joint")
    if joint is not None:
        if "mu" in contact.arguments:
            raise contact.spot.make_table_error(
                "has mu beside joint: give mu as a key of the joint, and leave the other out"
            )
        return build(joint, {})
    mu = find_mu(rubbing)
    if mu is None:
        raise contact.spot.make_table_error(
            f"has no joint while another one has, and [friction] is {type(rubbing).__name__}: give "
            'the table a joint, or [friction] type = "Coulomb" with one mu'
        )
    return Joint(mu=mu)
