"""What a restart compares: other matrices, loads, laws and plans are refused by name; ranks and
round-off are not."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from marched_chain import chain, rubbing_box, run, run_wall, wall

from vi_contact.core.errors import InputError
from vi_contact.core.problem import ContactProblem
from vi_contact.core.protocols import Frictionless
from vi_contact.fem.contact.points import contact_points
from vi_contact.fem.matrices.own_matrices import system_from_arrays
from vi_contact.laws.excitation import Harmonic, Tabulated
from vi_contact.laws.friction import Coulomb, ExponentialDecay, SlipRateCoulomb
from vi_contact.laws.impact import Elastic
from vi_contact.laws.joint import Joint
from vi_contact.laws.joint_values import Prestress
from vi_contact.laws.joints_by_part import JointsByPart
from vi_contact.run.files.checkpoint import compute_checksum
from vi_contact.run.files.identity import find_differences, identify, write_as_text
from vi_contact.run.simulate import simulate
from vi_contact.schemes.hht import HHT
from vi_contact.schemes.ss22 import SS22
from vi_contact.schemes.trapezoidal import Trapezoidal
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.normal.hildreth import Hildreth

serial = pytest.mark.serial


def tabulated(peak: float) -> Tabulated:
    """A record of 5000 samples, one of which can be another."""
    values = np.sin(np.arange(5000.0))
    values[2345] = peak
    return Tabulated(np.linspace(0.0, 20.0, 5000).tolist(), values.tolist(), direction=(1.0,))


OTHERS: dict[str, tuple[dict[str, Any], str]] = {
    "stiffness": ({"problem": chain(stiffness=1.0001e3)}, "another stiffness"),
    "mass": ({"problem": chain(mass=2.0001)}, "another mass matrix"),
    "damping": ({"problem": chain(damping=1.01e-4)}, "another damping"),
    "undamped": ({"problem": chain(damping=0.0)}, "another damping"),
    "load": ({"problem": chain(constant=1e-3)}, "another load"),
    "excitation": (
        {"problem": chain(excitation=Harmonic(3.0, 2.001, direction=(1.0,)))},
        "another excitation",
    ),
    "none": ({"problem": chain(excitation=())}, "another excitation"),
    "gap": ({"problem": chain(gap=1.001e-3)}, "another contact surface or obstacle"),
    "impact": (
        {"problem": chain(impact=Elastic())},
        r"impact law = Inelastic\(.*\) but this one has Newton",
    ),
    "dt": ({"dt": 5.001e-3}, "dt = 0.005 but this one has 0.005001"),
    "scheme": (
        {"scheme": ZienkiewiczWoodTaylor(phi=0.51)},
        r"scheme = Z.*phi=0.5\) but this one has .*phi=0.51",
    ),
}


@pytest.fixture(scope="module")
def left(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that was left after 60 steps."""
    folder = tmp_path_factory.mktemp("left")
    run(folder, 60)
    return folder


@serial
@pytest.mark.parametrize("name", OTHERS)
def test_another_problem_is_refused_by_name(left: Path, name: str) -> None:
    """One sentence that says what differs; asked for by name, the run goes on as the other one."""
    arguments, words = OTHERS[name]
    with pytest.raises(
        InputError, match=rf"is of a run with {words}.*: restart the same run, .*\(changed=True\)"
    ):
        run(None, 80, restart=left, **arguments)
    goes_on = run(None, 80, restart=left, changed=True, **arguments)
    # after another dt steps are counted anew
    assert len(goes_on.history["t"]) == (81 if name != "dt" else 141)


@serial
def test_another_size_is_never_allowed(left: Path) -> None:
    """Another number of unknowns or contact points fits nothing."""
    with pytest.raises(
        InputError,
        match="contact points = 2 but this one has 1: restart the same run, or start a new",
    ):
        run(None, 80, restart=left, changed=True, problem=chain(left_gap=None))


@serial
def test_what_may_differ(left: Path, tmp_path: Path) -> None:
    """Round-off of matrices, loads and dt, and the solver."""
    tiny = 1.0 + 1e-13
    problem = chain(stiffness=1e3 * tiny, mass=2.0 * tiny, damping=1e-4 / tiny, gap=1e-3 * tiny)
    again = run(
        None, 80, restart=left, problem=problem, dt=5e-3 * tiny, solver=Condensed(Hildreth())
    )
    assert np.allclose(
        again.history["u_x_12"], run(None, 80).history["u_x_12"], rtol=1e-6, atol=1e-12
    )


@serial
def test_one_sample_of_a_record() -> None:
    """One of 5000 samples is another."""
    one, two = (
        identify(chain(excitation=tabulated(peak)), SS22(), 5e-3, start=0.0, end=20.0)
        for peak in (0.3, 0.4)
    )
    assert find_differences(one, two) == {
        "excitation": "another excitation"
    } and not find_differences(one, one)


@dataclass(frozen=True)
class Push:
    """An excitation of one's own that has no end."""

    size: float = 1.0
    until: float = np.inf
    direction: tuple[float, ...] = (1.0,)
    duration = np.inf

    def acceleration(self, t: float) -> float:
        return self.size if t < self.until else 0.0

    def __call__(self, t: float) -> np.ndarray:
        return self.acceleration(t) * np.array(self.direction)


@serial
def test_infinite_numbers_of_an_excitation_are_no_difference(tmp_path: Path) -> None:
    run(tmp_path, 20, problem=chain(excitation=Push()))
    run(tmp_path, 30, problem=chain(excitation=Push()), restart=True)
    with pytest.raises(InputError, match="another excitation"):
        run(tmp_path, 40, problem=chain(excitation=Push(1.01)), restart=True)


@serial
def test_texts_of_laws() -> None:
    """No addresses, no types of numpy 2; numbers are compared with room for round-off, words are
    not."""

    class Own:
        """Has the repr that Python gives it."""

    assert "0x" not in write_as_text(Own()) and write_as_text(Own()) == write_as_text(Own())

    @dataclass
    class Law:
        """Stands for a law."""

        text: str

        def __repr__(self) -> str:
            return self.text

    ours: dict[str, Any] = {
        "law": write_as_text(Law("Law(mu=np.float64(0.30000000000000004), many=(1e-3, inf))"))
    }
    assert not find_differences(ours, {"law": "Law(mu=0.3, many=(0.001, inf))"})
    for other in (
        "Law(mu=0.31, many=(0.001, inf))",
        "Law(mu=0.3, many=(0.001, nan))",
        "Law(mu=0.3, many=(0.001,))",
    ):
        assert find_differences(ours, {"law": other})
    assert find_differences({"numbers": [(1.0, 2.0)]}, {"numbers": "none"})


def crafted(folder: Path, change: Callable[[dict[str, Any]], None]) -> None:
    """Changes the arrays of the checkpoint, and writes it with the checksum that they have then."""
    path = folder / "checkpoint.npz"
    with np.load(path) as stored:
        arrays = {name: stored[name] for name in stored.files if name != "checksum"}
    change(arrays)
    buffer = io.BytesIO()
    np.savez(buffer, checksum=np.array(compute_checksum(arrays)), **arrays)
    path.write_bytes(buffer.getvalue())


CRAFTED: dict[str, Callable[[dict[str, Any]], Any]] = {
    "short": lambda arrays: arrays.update(u=arrays["u"][:-1]),
    "long": lambda arrays: arrays.update(r_n=np.zeros(7)),
    "flat": lambda arrays: arrays.update(u=arrays["u"][:, None]),
    "missing": lambda arrays: arrays.pop("v"),
    "without reactions": lambda arrays: arrays.pop("r_n"),
    "short memory": lambda arrays: arrays.update(
        {name: arrays[name][:-1] for name in arrays if "memory_" in name}
    ),
    "nan": lambda arrays: arrays["u"].__setitem__(2, np.nan),
    "integers": lambda arrays: arrays.update(u=arrays["u"].astype(int)),
    "texts": lambda arrays: arrays.update(u=arrays["u"].astype(str)),
    "complex": lambda arrays: arrays.update(v=arrays["v"] * 1j),
    "turned": lambda arrays: arrays.update(v=arrays["v"].astype(">f8")),
    "objects": lambda arrays: arrays.update(u=np.array([None] * 5)),
    "numbers for masks": lambda arrays: arrays.update(active=np.array([0.0, 1.0])),
    "no about": lambda arrays: arrays.pop("about"),
    "a list": lambda arrays: arrays.update(about=np.array("[]")),
    "no vectors": lambda arrays: _about(arrays, vectors=["v"]),
    "unhashable": lambda arrays: _about(arrays, vectors=[["u"]]),
    "negative": lambda arrays: _about(arrays, base=-3),
    "no time": lambda arrays: _about(arrays, t=None),
    "huge": lambda arrays: _about(arrays, k=1e300),
}


def _about(arrays: dict[str, Any], **changes: Any) -> None:
    arrays["about"] = np.array(json.dumps(json.loads(str(arrays["about"])) | changes))


PLAIN: dict[str, Any] = {"scheme": HHT(), "problem": chain(impact=None)}


@pytest.fixture(scope="module")
def old(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run with a scheme that keeps something in mind."""
    folder = tmp_path_factory.mktemp("old")
    run(folder, 20, **PLAIN)
    assert run(None, 21, restart=folder, **PLAIN).state.k == 21
    return folder


@serial
@pytest.mark.parametrize("name", CRAFTED)
def test_crafted_checkpoints_are_told(old: Path, tmp_path: Path, name: str) -> None:
    """What nobody has written: one sentence, also where no checksum gives it away."""
    (tmp_path / "checkpoint.npz").write_bytes((old / "checkpoint.npz").read_bytes())
    crafted(tmp_path, CRAFTED[name])
    with pytest.raises(
        InputError, match=r"the checkpoint '.*' is damaged \(.*\): start a new run$"
    ):
        run(None, 25, restart=tmp_path, **PLAIN)


@serial
@pytest.mark.parametrize(
    ("number", "sentence"),
    [(1, r"is of version 0\.2, .*: start a new run; report and plot"), (99, "has format 99")],
)
def test_states_of_other_versions_are_told(
    old: Path, tmp_path: Path, number: int, sentence: str
) -> None:
    """The folder of version 0.2 is read, and its states are not gone on from."""
    (tmp_path / "checkpoint.npz").write_bytes((old / "checkpoint.npz").read_bytes())
    crafted(tmp_path, lambda arrays: _about(arrays, format=number))
    with pytest.raises(InputError, match=sentence):
        run(None, 25, restart=tmp_path, **PLAIN)


@serial
def test_checksum_sees_everything() -> None:
    """Names, types, shapes and values."""
    one = {"a": np.arange(4.0), "b": np.array("text")}
    others = [
        {"c": one["a"], "b": one["b"]},
        one | {"a": one["a"].astype(int)},
        one | {"a": one["a"].reshape(2, 2)},
        one | {"a": np.array([0.0, 1.0, 2.0, np.nextafter(3.0, 4.0)])},
    ]
    assert len({compute_checksum(found) for found in (one, *others)}) == 5 and compute_checksum(
        one
    ) == compute_checksum(dict(one))


# Any number of ranks
# --------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_other_ranks_are_the_same_problem(comm: Any) -> None:
    """All numbers agree with those of one rank, far below what counts as a difference."""
    pytest.importorskip("dolfinx")
    from mpi4py import MPI

    def numbers(problem: ContactProblem) -> dict[str, Any]:
        return identify(problem, ZienkiewiczWoodTaylor(), 1e-3, start=0.0, end=0.5)

    def rough(ranks: Any) -> ContactProblem:
        box = rubbing_box(ranks, None)
        mu = 0.3 + 0.01 * np.arange(box.surface.total)
        return replace(box, friction=SlipRateCoulomb(ExponentialDecay(mu, 0.2, 1.0)))

    def bound(ranks: Any) -> ContactProblem:
        box = rubbing_box(ranks, None)
        parts = np.arange(box.surface.total) % 3 // 2
        both = {"a": Joint(mu=lambda x: 0.3 + x[:, 0] ** 2), "b": Joint(tension=2.0, opening=1e-3)}
        return replace(box, impact=None, friction=Frictionless(), joint=JointsByPart(both, parts))

    for make in (
        wall,
        lambda ranks: replace(rubbing_box(ranks, None), friction=Coulomb(0.3)),
        rough,
        bound,
    ):
        spread, alone = numbers(make(comm)), numbers(make(MPI.COMM_SELF))
        assert not find_differences(spread, alone) and spread.keys() == alone.keys()
        for name, own in alone.items():
            for (a, size), (b, _) in (
                zip(own, spread[name], strict=True) if isinstance(own, list) else ()
            ):
                assert abs(a - b) <= 1e-11 * size, name


@pytest.mark.long
def test_another_material_is_refused_on_all_ranks(comm: Any, shared_tmp: Path) -> None:
    """Other Young's modulus, other friction, and a law of one's own whose text says nothing."""
    pytest.importorskip("dolfinx")
    from fem_problems import shaken_wall

    run_wall(comm, shared_tmp, 6)
    with pytest.raises(InputError, match="is of a run with another stiffness"):
        run_wall(
            comm,
            shared_tmp,
            9,
            problem=shaken_wall(comm, angle=0.3, gap=1e-7, nu=0.2001),
            restart=True,
        )
    box = rubbing_box(comm, None)
    laws = [SlipRateCoulomb(lambda speed, mu=mu: mu + 0.0 * speed) for mu in (0.3, 0.31)]
    settings: dict[str, Any] = {
        "scheme": Trapezoidal(),
        "dt": 1e-3,
        "steps": 2,
        "out": shared_tmp / "box",
    }
    simulate(replace(box, friction=laws[0]), **settings)
    with pytest.raises(InputError, match="is of a run with another friction: restart"):
        simulate(replace(box, friction=laws[1]), restart=True, **settings)
    with pytest.raises(
        InputError, match=r"friction law = SlipRateCoulomb.* but this one has Coulomb\(mu=0.3\)"
    ):
        simulate(replace(box, friction=Coulomb(0.3)), restart=True, **settings)


POINTS = 1010  # more than numpy writes out
JOINTS: dict[str, tuple[Any, ...]] = {  # values of mu, of dc [m] and of sigma0 [Pa], and the part
    "part": (0.6, 1e-3, 1e5, 600),
    "mu": (0.61, 1e-3, 1e5, 500),
    "what the strength is lost over": (0.6, 1.01e-3, 1e5, 500),
    "prestress": (0.6, 1e-3, 1.01e5, 500),
}


def joint_facts(mu: float, opening: float, normal: float, first: int) -> dict[str, Any]:
    """What identifies a chain of masses with a joint of two laws, whose values are functions."""
    row = np.arange(float(POINTS))
    system = system_from_arrays(
        np.ones(POINTS), None, sp.eye(POINTS, format="csr"), coordinates=row[:, None]
    )
    surface = contact_points(system, np.arange(POINTS), [[-1.0]] * POINTS)
    loses = Joint(
        tension=lambda x: 2.0 + x[:, 0] / POINTS,
        cohesion=3.0,
        opening=lambda x: opening + 0.0 * x[:, 0],
        prestress=Prestress(normal=lambda x: normal + 0.0 * x[:, 0]),
    )
    rubs = Joint(mu=lambda x: mu + 0.0 * x[:, 0])
    part = np.where(row < first, 0, 1)
    joint = JointsByPart({"loses": loses, "rubs": rubs}, part)
    problem = ContactProblem(system, surface, joint=joint)
    return identify(problem, ZienkiewiczWoodTaylor(), 1e-3, start=0.0, end=1.0)


@pytest.mark.long
@serial
@pytest.mark.parametrize("name", JOINTS)
def test_joints_of_parts_are_told_by_their_values(name: str) -> None:
    """Functions and long tables, whose text is the same, count by what they give the points."""
    same = (0.6, 1e-3, 1e5, 500)
    facts = joint_facts(*same)
    assert find_differences(facts, joint_facts(*same)) == {}
    other = joint_facts(*JOINTS[name])
    assert find_differences(facts, other) == {
        "strength of the joint": "another strength of the joint"
    }
