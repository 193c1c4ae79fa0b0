"""Take from the model of a run what formulas need of its friction and its bodies."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ....core.errors import InputError
from ....core.own_files import is_own
from ....run.files.folder import MODEL

# CHOSEN: share by which a number that is given may differ from that of the run before it is told.
SLACK = 0.03


@dataclass(frozen=True)
class ModelFacts:
    """Hold what the model of a run says of its contact and its bodies.

    Attributes:
        friction: name of a contact -> its one coefficient, None where its law has no such.
        masses: name of a body -> its mass [kg], of a plane model that of its thickness.
        densities: name of a body -> its density [kg/m³]; those with one number only.
    """

    friction: Mapping[str, float | None] = field(default_factory=dict)
    masses: Mapping[str, float] = field(default_factory=dict)
    densities: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def read(cls, folder: Path) -> "ModelFacts":
        """Return what model.json of a run folder says; nothing where there is none.

        Raises:
            InputError: the file is damaged.
        """
        from ....run.files.reading import read_object  # late: h5py, which formulas do not need

        if not is_own(folder / MODEL):
            return cls()
        try:
            model = read_object(folder / MODEL)
            friction = {
                str(part["name"]): _read_number(part.get("mu")) for part in model["contact"]
            }
            masses = {str(body["name"]): float(body["mass"]) for body in model["bodies"]}
            densities = {
                str(body["name"]): float(body["material"]["rho"])
                for body in model["bodies"]
                if isinstance(body["material"], Mapping) and "rho" in body["material"]
            }
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise InputError(
                f"'{folder / MODEL}' is damaged ({str(error)[:200]}): restore it, or delete it"
            ) from error
        return cls(friction, masses, densities)

    def find_mu(self, part: str) -> float | None:
        """Return the coefficient of friction of a part of the contact; None if it is not known.

        The part is a contact of this name, or those of a group of this name; other parts may be of
        any contact. The coefficient is known where all of these contacts have the same one.
        """
        owners = find_owners(list(self.friction), part) or list(self.friction)
        values = {self.friction[name] for name in owners}
        return values.pop() if len(values) == 1 else None


def find_owners(names: Sequence[str], part: str) -> list[str]:
    """Return which contacts a part is: the one of this name, else those of a group of this name.

    Args:
        names: of all contacts; a contact of two groups is called "one on other".
        part: a name.
    """
    return [name for name in names if part == name] or [
        name for name in names if part in name.split(" on ")
    ]


def _read_number(value: object) -> float | None:
    """Return a number of a file, None for none.

    Raises:
        TypeError: it is something else.
    """
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError(f"mu is {value!r}")
    return float(value)


def tell_contradiction(name: str, given: float, of_run: float, unit: str, source: str) -> list[str]:
    """Return a sentence where a number that is given is not that of the run; else nothing.

    Args:
        name: of the number.
        given: in the check.
        of_run: in the run.
        unit: of both.
        source: what of the run says so, in words.
    """
    if abs(given - of_run) <= SLACK * max(abs(given), abs(of_run)):
        return []
    return [f"you gave {name} = {given:.4g}{unit}, the run had {of_run:.4g}{unit}: {source}"]
