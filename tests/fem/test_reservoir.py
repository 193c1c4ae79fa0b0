"""Reservoirs before dams: periods and forces of joints.md's independent program, traps, ranks."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import vi_contact as vc
from vi_contact import fem, laws
from vi_contact.core.errors import InputError
from vi_contact.run.modal import lowest_frequency

GAMMA = 9806.65
UP = np.array([0.0, 1.0])
ALONG = np.array([1.0, 0.0])


def stand(
    comm: Any,
    size: tuple[float, float, float],
    cells: tuple[int, int],
    water: dict[str, Any] | None,
    **others: Any,
) -> Any:
    """A wall or dam (height, base, crest), its wet face on the left, or bent by ``slope``."""
    import dolfinx

    height, width, crest = size
    shape = dolfinx.mesh.CellType.quadrilateral
    mesh = dolfinx.mesh.create_rectangle(comm, [[0.0, 0.0], [width, height]], cells, shape)
    slope = others.pop("slope", 0.0)
    base = fem.Facets.where("base", mesh, lambda x: np.isclose(x[1], 0.0))
    face = fem.Facets.where("face", mesh, lambda x: np.isclose(x[0], 0.0))
    back = fem.Facets.where("back", mesh, lambda x: np.isclose(x[0], width))
    places = mesh.geometry.x
    share = places[:, 1] / height
    places[:, 0] *= 1.0 - (1.0 - crest / width) * share
    places[:, 0] += slope * places[:, 1]
    if water is not None:
        if "tail" in water:
            water = {**water, "tail_face": back}
        others["reservoir"] = fem.Reservoir(face=face, **water)
    if others.pop("held", True):
        others["prescribed"] = fem.Prescribed(base)
    stone = vc.LinearElastic(E=others.pop("E", 25e9), nu=0.2, rho=2400.0)
    return fem.assemble(mesh, stone, **others), base


def test_periods_of_a_dam_with_a_full_reservoir(comm: Any) -> None:
    """Dry 0.22622, Westergaard 0.2889, incompressible 0.2708 s, to the digits that are given."""
    wanted = {None: 0.22622, "added mass": 0.2889, "incompressible": 0.2708}
    for model, period in wanted.items():
        water = None if model is None else {"level": 100.0, "model": model}
        system, _ = stand(comm, (100.0, 80.0, 8.0), (12, 20), water, E=30e9, degree=2)
        assert 1.0 / lowest_frequency(system) == pytest.approx(period, rel=2e-3)


@pytest.mark.parametrize(
    ("model", "length", "force"),
    [
        ("added mass", None, 7.0 / 12.0),
        ("incompressible", None, 0.542754514),
        ("incompressible", 60.0, 0.589370826),  # a far wall that stands still, one depth away
    ],
)
def test_the_force_on_a_rigid_wall(
    comm: Any, model: str, length: float | None, force: float
) -> None:
    """F = 0.5428 rho a h² exact, 7/12 by Westergaard's formula; as load of an earthquake."""
    water = {"level": 60.0, "model": model, "length": length}
    wet, _ = stand(comm, (60.0, 20.0, 20.0), (4, 40), water, held=False)
    dry, _ = stand(comm, (60.0, 20.0, 20.0), (4, 40), None, held=False)
    rho = GAMMA / 9.80665
    pull = wet.inertia(ALONG) - dry.inertia(ALONG)
    total = float(comm.allreduce(pull.sum())) / (rho * 60.0**2)
    assert total == pytest.approx(force, rel=3e-3)


def test_water_has_no_weight_on_a_slope(comm: Any) -> None:
    """M r of a vertical acceleration, and so the weight, is that of the dry dam; M is symmetric."""
    for model in ("added mass", "incompressible"):
        water = {"level": 50.0, "model": model}
        size = (60.0, 40.0, 8.0)
        wet, _ = stand(comm, size, (4, 12), water, slope=0.2, damping=vc.Rayleigh(0.5, 0.0))
        dry, _ = stand(comm, size, (4, 12), None, slope=0.2, damping=vc.Rayleigh(0.5, 0.0))
        heavy = np.abs(dry.inertia(UP)).max(initial=0.0)
        assert np.abs(wet.inertia(UP) - dry.inertia(UP)).max(initial=0.0) <= 1e-9 * heavy
        generator = np.random.default_rng(1)
        u, v = generator.standard_normal((2, wet.rows))
        first = wet.algebra.dot(u, wet.M @ v)
        assert wet.algebra.dot(v, wet.M @ u) == pytest.approx(first, rel=1e-9)
        # a move into the water carries more mass; alpha M does not count it
        added = wet.algebra.dot(u, wet.M @ u) - dry.algebra.dot(u, dry.M @ u)
        assert added > 0.0
        assert np.abs(wet.C @ u - dry.C @ u).max(initial=0.0) <= 1e-12 * np.abs(dry.C @ u).max(
            initial=1.0
        )


def test_pressures_at_rest_add_up(comm: Any) -> None:
    """gamma h²/2 of water, K gamma' d²/2 of silt, less the tail water; nothing else is there."""
    water = {
        "level": 60.0,
        "model": "at rest",
        "silt": 12.0,
        "silt_weight": 8000.0,
        "silt_ratio": 0.4,
        "tail": 15.0,
    }
    wet, _ = stand(comm, (60.0, 20.0, 20.0), (4, 20), water, held=False)
    dry, _ = stand(comm, (60.0, 20.0, 20.0), (4, 20), None, held=False)
    push = comm.allreduce(wet.load.at_rest(0.0) @ wet.influence)
    wanted = GAMMA * (60.0**2 - 15.0**2) / 2.0 + 0.4 * 8000.0 * 12.0**2 / 2.0
    assert push[0] == pytest.approx(wanted, rel=1e-12)
    assert np.array_equal(wet.inertia(ALONG), dry.inertia(ALONG))


@pytest.mark.long
def test_a_dam_that_cracks_in_an_earthquake(comm: Any) -> None:
    """Reservoir, joint with water and motion together: certified, and the ledger closes."""
    crack = {}
    for model in ("added mass", "acoustic", "at rest"):
        water = {"level": 36.0, "model": model}
        system, base = stand(
            comm,
            (40.0, 30.0, 6.0),
            (10, 12),
            water,
            held=False,
            damping=vc.Rayleigh(alpha=0.0, beta=2e-3),
        )
        system = laws.with_weight(system)
        surface = fem.contact_surface(system, base)
        joint = laws.Joint(
            mu=0.8,
            cohesion=3e5,
            tension=5e4,
            opening=1e-4,
            water=laws.JointWater(
                heel=(0.0, 0.0), toe=(30.0, 0.0), level=36.0, drain=3.0, quake="follows"
            ),
        )
        problem = vc.ContactProblem(
            system,
            surface,
            joint=joint,
            mass=vc.ConsistentMass(),
            excitation=vc.Harmonic(amplitude=4.0, frequency=2.0, direction=(1.0, 0.0)),
        )
        rest = vc.static_equilibrium(problem, tolerance=1e-7)
        run = vc.simulate(
            problem,
            scheme=vc.ZienkiewiczWoodTaylor(),
            solver=vc.Condensed(),
            dt=5e-3,
            t_end=0.6,
            state=rest,
            record=[vc.Energy(), vc.Contact(), vc.JointEnergy(), vc.Uplift()],
            progress=False,
        )
        history = run.history
        assert history["certificate"].max() < 1e-9
        assert np.abs(history["energy_defect"]).max() < 1e-8 * history["work_input"].max()
        crack[model] = history["crack_length"].max()
    assert 5.0 < crack["added mass"] < 25.0 and crack["at rest"] > 5.0
    assert 5.0 < crack["acoustic"] < 25.0


@pytest.mark.serial
def test_bad_reservoirs_are_refused_in_one_sentence(comm: Any) -> None:
    """By name and with a remedy."""
    size = (40.0, 30.0, 6.0)
    wrong: list[tuple[dict[str, Any], str]] = [
        ({"level": 41.0}, "above the top of 'face'"),
        ({"level": -1.0}, "below the foot of 'face'"),
        ({"level": float("nan")}, "the level"),
        ({"level": 30.0, "model": "wet"}, "'added mass' or 'incompressible' or 'acoustic'"),
        ({"level": 30.0, "tail": 31.0}, "exchange face and tail_face"),
        ({"level": 30.0, "silt": 3.0, "silt_ratio": -1.0}, "silt_ratio"),
        ({"level": 30.0, "silt": 31.0}, "the silt at 31 m is above the level 30 m"),
        ({"level": 30.0, "silt": -1.0}, "the silt at -1 m is below the foot of 'face'"),
    ]
    for water, words in wrong:
        with pytest.raises(InputError, match=words):
            stand(comm, size, (3, 4), water)
    system, base = stand(comm, size, (3, 4), None)
    with pytest.raises(InputError, match="belong together"):
        fem.Reservoir(face=base, level=30.0, tail=3.0)
    low = fem.Facets.where("low", base.mesh, lambda x: (x[0] > 0.5 * 30.0) & (x[1] < 11.0))
    face = fem.Facets.where("face", base.mesh, lambda x: np.isclose(x[0], 0.0))
    stone = vc.LinearElastic(E=25e9, nu=0.2, rho=2400.0)
    for model in ("at rest", "acoustic"):
        wet = fem.Reservoir(face=face, level=30.0, tail_face=low, tail=12.0, model=model)
        with pytest.raises(InputError, match="the tail water 12 m is above the top of 'low' at 10"):
            fem.assemble(base.mesh, stone, reservoir=wet)


@pytest.mark.serial
def test_water_before_bodies_that_are_absent_is_refused(comm: Any) -> None:
    """The level counts from what is there, and a face of nothing has no water."""
    import dolfinx

    mesh = dolfinx.mesh.create_rectangle(comm, [[0.0, 0.0], [2.0, 4.0]], [2, 4])
    face = fem.Facets.where("face", mesh, lambda x: np.isclose(x[0], 0.0))
    top = fem.Facets.where("top", mesh, lambda x: np.isclose(x[1], 4.0))
    base = fem.Facets.where("base", mesh, lambda x: np.isclose(x[1], 0.0))
    upper = fem.Cells.where("upper", mesh, lambda x: x[1] > 2.0 - 1e-6)
    stone = vc.LinearElastic(E=25e9, nu=0.2, rho=2400.0)

    def weigh(water: fem.Reservoir) -> float:
        system = fem.assemble(mesh, stone, clamped=base, absent=[upper], reservoir=water)
        return float(system.inertia(ALONG).sum())

    for model in ("at rest", "added mass", "incompressible"):
        with pytest.raises(InputError, match="the level 3 m is above the top of 'face' at 2 m"):
            weigh(fem.Reservoir(face=face, level=3.0, model=model))
        with pytest.raises(InputError, match="'top' is the face of bodies that are absent"):
            weigh(fem.Reservoir(face=top, level=4.0, model=model))
    assert weigh(fem.Reservoir(face, 2.0)) > weigh(fem.Reservoir(face, 2.0, model="at rest"))
