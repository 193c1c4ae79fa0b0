"""Dataclasses made here are those of the standard library in all that anybody sees of them."""

import copy
import dataclasses
import inspect
import pickle

import pytest

from vi_contact.core import values
from vi_contact.core.values import field

pytestmark = pytest.mark.serial


def made(dataclass):
    @dataclass(frozen=True)
    class Pile:
        """Text."""

        a: int
        b: float = 2.0
        c: dict = field(default_factory=dict)
        _d: list = field(init=False, default_factory=list, compare=False, repr=False)

        def __post_init__(self):
            self._d.append(self.a)

    @dataclass(frozen=True)
    class Higher(Pile):
        e: int = 5

    @dataclass(frozen=True, eq=False)
    class Alone:
        a: int

    return Pile, Higher, Alone


def refusals(cls):
    """What everything that is refused says."""
    one, said = cls(1), []
    for wrong in (lambda: setattr(one, "a", 2), lambda: delattr(one, "a"), lambda: setattr(one, "new", 2),
                  lambda: cls(), lambda: cls(1, 2, 3, 4, 5, 6), lambda: cls(1, x=2)):
        with pytest.raises((dataclasses.FrozenInstanceError, TypeError)) as error:
            wrong()
        said.append((error.type, str(error.value)))
    return said


@pytest.mark.parametrize("i", range(3))
def test_same_as_the_standard_library(i):
    ours, theirs = made(values.dataclass)[i], made(dataclasses.dataclass)[i]
    assert str(inspect.signature(ours)) == str(inspect.signature(theirs))
    assert refusals(ours) == refusals(theirs)
    assert ours.__match_args__ == theirs.__match_args__ and repr(ours(1)) == repr(theirs(1))
    for cls in (ours, theirs):
        one = dataclasses.replace(cls(1), a=3)
        assert (one == cls(3), one == cls(4), copy.deepcopy(one) == one) == (i < 2, False, i < 2)
        assert i == 2 or one._d == [3] and dataclasses.asdict(one)["c"] == {}
        assert i == 2 or hash(cls(1, c=())) == hash(cls(1, c=())) != hash(cls(2, c=()))


@pytest.mark.parametrize("module", [values, dataclasses])
def test_plain_subclasses_have_attributes_of_their_own(module):
    other = type("Other", (made(module.dataclass)[0],), {})(1)
    other.new = 3
    del other.new
    with pytest.raises(dataclasses.FrozenInstanceError):
        other.a = 3


def test_users_may_inherit_and_pickle():
    from vi_contact.laws.friction import Coulomb

    assert pickle.loads(pickle.dumps(Coulomb(0.3))) == Coulomb(0.3)
    mine = dataclasses.dataclass(frozen=True)(type("Mine", (Coulomb,), {"__annotations__": {}}))
    assert mine(0.3).slope is not None and mine(0.3) != Coulomb(0.3)
