"""Parts of a contact by name, group or box: thrust and its height, pressures at the ends, sliding
and what is left."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.meshes.block import BlockMesh
from vi_contact.practice.studies import read_case

G, RHO = 9.80665, 2000.0
B, H, N = 4.0, 6.0, 12  # [m], and cells over the height
SOIL = vc.LinearElastic(E=5e7, nu=0.3, rho=RHO)
K0 = SOIL.nu / (1.0 - SOIL.nu)


def box_of_soil(comm: Any) -> tuple[Any, Any, Any]:
    """(problem, its rest, groups): soil on a smooth rigid floor between a roller and a smooth rigid
    wall."""
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(B, H), divisions=(4, N)), comm)
    system = vc.with_weight(
        fem.assemble(mesh, SOIL, prescribed=fem.Prescribed(tags["left"], components=(0,)))
    )
    floor = fem.contact_surface(
        system, tags["bottom"], obstacle=vc.HalfSpace((0.0, 0.0), (0.0, 1.0))
    )
    wall = fem.contact_surface(system, tags["right"], obstacle=vc.HalfSpace((B, 0.0), (-1.0, 0.0)))
    problem = vc.ContactProblem(system, fem.joined_surfaces(floor, wall))
    return problem, vc.static_equilibrium(problem, solver=vc.Condensed()), tags


def row(problem: Any, state: Any, *parts: Any, **named: Any) -> dict[str, Any]:
    return dict(vc.Resultants(*parts, **named).start(problem, state))


@pytest.mark.two_ranks
def test_thrust_of_soil_at_rest(comm: Any) -> None:
    """V2.13: K0 rho g H²/2 at H/3, on cells of height h at H/3 + h²/(6 H); pressures at the ends
    those of the cells there. The floor carries the weight; the corner is in both."""
    problem, rest, tags = box_of_soil(comm)
    h, thrust = H / N, 0.5 * K0 * RHO * G * H**2
    for where in ({"part": tags["right"]}, {"where": lambda x, n: n[:, 0] > 0.5}):
        found = row(problem, rest, "wall", **where)
        assert found["N_wall"] == pytest.approx(thrust, rel=1e-9)
        assert found["height_wall"] == pytest.approx(H / 3.0 + h**2 / (6.0 * H), rel=1e-9)
        assert found["level_wall"] == pytest.approx(1.0 / 3.0 + h**2 / (6.0 * H**2), rel=1e-9)
        assert found["pressure_low_wall"] == pytest.approx(K0 * RHO * G * (H - 0.5 * h), rel=1e-9)
        assert found["pressure_high_wall"] == pytest.approx(K0 * RHO * G * 0.5 * h, rel=1e-9)
        assert "margin_wall" not in found
    floor = row(problem, rest, "floor", part=tags["bottom"])
    assert floor["N_floor"] == pytest.approx(RHO * G * H * B, rel=1e-9)
    assert abs(floor["e_floor"]) < 1e-9 * B and np.isnan(floor["level_floor"])
    upper = row(problem, rest, "upper", part=((B, 0.5 * H), (0.0, 2.0 * H)))
    above = row(problem, rest, "upper", where=lambda x, n: x[:, 1] > 0.5 * (H - h))
    assert upper == above and 0.2 * thrust < upper["N_upper"] < 0.3 * thrust


@pytest.mark.parametrize(("toe", "ends"), [(-0.1, ("toe", "heel")), (B, ("heel", "toe"))])
def test_toe_and_heel_on_either_side(comm: Any, toe: float, ends: tuple[str, str]) -> None:
    """The columns keep their names and numbers, and their meanings say which end is the toe."""
    problem, rest, tags = box_of_soil(comm)
    recorder = vc.Resultants("floor", part=tags["bottom"], toe=(toe, 0.0))
    plain = vc.Resultants("floor", part=tags["bottom"])
    assert recorder.start(problem, rest) == pytest.approx(
        plain.start(problem, rest), nan_ok=True, rel=1e-15
    )
    for column, end in zip(("pressure_low_floor", "pressure_high_floor"), ends, strict=True):
        assert recorder.columns()[column] == (
            "Pa",
            f"contact pressure at the {end}, part floor",
        )
        assert "longest coordinate" in plain.columns()[column][1]
    middle = vc.Resultants("floor", part=tags["bottom"], toe=(0.5 * B, 0.0))
    with pytest.raises(InputError, match="part 'floor': its toe is as near to one end"):
        middle.start(problem, rest)


def test_parts_that_meet_at_a_node_both_have_it(comm: Any) -> None:
    """Boxes add up to the whole where their faces lie between nodes; one more node of thrust K0 rho
    g h y otherwise."""
    problem, rest, tags = box_of_soil(comm)
    h, whole = H / N, row(problem, rest, "wall", part=tags["right"])["N_wall"]
    for shift, twice in ((0.25 * h, 0.0), (0.0, K0 * RHO * G * h * 0.5 * H)):
        boxes = ((0.0, 0.1 * h), (9.0, 0.5 * H + shift)), ((0.0, 0.5 * H + shift), (9.0, 9.0))
        low, high = (row(problem, rest, "a", part=box, normal=(1.0, 0.0))["N_a"] for box in boxes)
        end = row(problem, rest, "a", part=((B, 0.0), (9.0, 0.1 * h)), normal=(1.0, 0.0))["N_a"]
        assert low + high + end == pytest.approx(whole + twice, rel=1e-9)


MU, WIDTH, TALL, SPRINGS = 0.6, 6.0, 2.0, 1e6
DOWN, ACROSS = 1e4, 2e4  # tractions on the right side and the left one [Pa]


def test_trapezoid_under_an_eccentric_load(comm: Any) -> None:
    """A stiff block on springs with loads on both sides: N, e and p = N/B +- N e B/(2 I), where I =
    B³/12 + B h²/6 of springs at nodes h apart; the friction left is 1 - H/(mu N)."""
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(WIDTH, TALL), divisions=(12, 4)), comm)
    stiff = vc.LinearElastic(E=1e13, nu=0.2, rho=RHO)
    loads = [fem.Traction(tags["right"], (0.0, -DOWN)), fem.Traction(tags["left"], (ACROSS, 0.0))]
    system = vc.with_weight(fem.assemble(mesh, stiff, loads=loads))
    surface = fem.contact_surface(
        system, tags["bottom"], obstacle=vc.HalfSpace((0.0, 0.0), (0.0, 1.0))
    )
    problem = vc.ContactProblem(system, surface.on_springs(SPRINGS), friction=vc.Coulomb(MU))
    rest = vc.static_equilibrium(problem, solver=vc.Condensed())
    found = row(problem, rest, "foot", part=tags["bottom"])
    down, across, weight = DOWN * TALL, ACROSS * TALL, RHO * G * WIDTH * TALL
    normal, e = weight + down, (0.5 * down * WIDTH + 0.5 * across * TALL) / (weight + down)
    assert 0.0 < e < WIDTH / 6.0 and found["uplift_foot"] == 0.0
    assert found["N_foot"] == pytest.approx(normal, rel=1e-6) and found["e_foot"] == pytest.approx(
        e, rel=1e-5
    )
    inertia = WIDTH**3 / 12.0 + WIDTH * (WIDTH / 12) ** 2 / 6.0
    for end, sign in (("low", -1.0), ("high", 1.0)):
        pressure = normal / WIDTH + sign * normal * e * 0.5 * WIDTH / inertia
        assert found[f"pressure_{end}_foot"] == pytest.approx(pressure, rel=1e-5), end
    assert found["margin_foot"] == pytest.approx(1.0 - across / (MU * normal), rel=1e-5)
    assert abs(found["sliding_foot"]) < 1e-9


@pytest.mark.long
@pytest.mark.serial
def test_a_block_slides_until_its_speed_is_gone(comm: Any) -> None:
    """v²/(2 mu g) along the floor, nothing left of the friction on the way, all of it
    afterwards."""
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(2.0, 1.0), divisions=(4, 2)), comm)
    stiff = vc.LinearElastic(E=1e9, nu=0.2, rho=RHO)
    system = vc.with_weight(fem.assemble(mesh, stiff, damping=vc.Rayleigh(0.0, 2e-3)))
    surface = fem.contact_surface(
        system, tags["bottom"], obstacle=vc.HalfSpace((0.0, 0.0), (0.0, 1.0))
    )
    problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(0.5))
    rest = vc.static_equilibrium(problem, solver=vc.Condensed())
    speed = 0.5
    thrown = fem.assemble(mesh, stiff, initial_velocity=(speed, 0.0))
    start = rest.with_velocity(vc.ContactProblem(thrown, surface_of(thrown, tags)).equations.v0)
    foot = vc.Resultants("foot", part=tags["bottom"])
    run = vc.simulate(problem, dt=1e-3, t_end=0.2, state=start, record=[foot], progress=False)
    slid = run.history["sliding_foot"][-1] - run.history["sliding_foot"][0]
    assert abs(slid) == pytest.approx(speed**2 / (2.0 * 0.5 * G), rel=0.01)
    assert (
        np.nanmax(np.abs(run.history["margin_foot"][10:80]))
        < 0.05
        < 0.5
        < run.history["margin_foot"][-20:].mean()
    )


def surface_of(system: Any, tags: Any) -> Any:
    return fem.contact_surface(
        system, tags["bottom"], obstacle=vc.HalfSpace((0.0, 0.0), (0.0, 1.0))
    )


CASE = """
[mesh]
type = "BlockMesh"
lengths = [4.0, 6.0]
divisions = [4, 12]

[material.soil]
E = 5e7
nu = 0.3
rho = 2000

[system]
prescribed = [{facets = "left", components = [0]}]

[gravity]

[[contact]]
name = "floor"
facets = "bottom"
obstacle = {type = "HalfSpace", point = [0.0, 0.0], normal = [0.0, 1.0]}

[[contact]]
name = "stem"
facets = "right"
obstacle = {type = "HalfSpace", point = [4.0, 0.0], normal = [-1.0, 0.0]}

[run]
dt = 1.0
steps = 0

[[record]]
type = "Resultants"
part = "stem"

[[record]]
type = "Resultants"
part = "bottom"

[[record]]
type = "Resultants"
name = "upper"
part = [[0.0, 3.0], [4.0, 6.0]]
"""


@pytest.mark.two_ranks
def test_parts_in_a_case_file(shared_tmp: Path) -> None:
    """part = "NAME": a contact table, else a boundary group; or the corners of a box."""
    file = shared_tmp / "soil.toml"
    if MPI.COMM_WORLD.rank == 0:
        file.write_text(CASE, encoding="utf-8")
    MPI.COMM_WORLD.Barrier()
    found = read_case(file).run(MPI.COMM_WORLD, progress=False).history
    problem, rest, tags = box_of_soil(MPI.COMM_WORLD)
    rows = row(problem, rest, "stem", part=tags["right"]) | row(problem, rest, part=tags["bottom"])
    rows |= row(problem, rest, "upper", part=((0.0, 3.0), (4.0, 6.0)))
    for name, value in rows.items():
        size = RHO * G * H * B if name.startswith(("N", "T", "M", "force", "pressure")) else 1.0
        assert found[name][0] == pytest.approx(value, abs=1e-9 * size, rel=1e-9, nan_ok=True), name
    with pytest.raises(InputError, match=r"part is 'stam', but the mesh has no group 'stam'"):
        read_case(file, ["record.1.part=stam"]).run(MPI.COMM_WORLD, progress=False)


@pytest.mark.serial
def test_bad_parts_are_refused() -> None:
    """One sentence each, before a run."""
    problem, rest, tags = box_of_soil(MPI.COMM_SELF)
    for given, said in (
        ({"name": "a", "part": ((9.0, 9.0), (10.0, 10.0))}, "part 'a' has no contact points"),
        ({"name": "a", "part": tags["top"]}, "part 'a': its group has no whole facet in contact"),
        ({"name": "a", "part": (1.0, 2.0)}, "part 'a': part, a box, has shape"),
        (
            {"name": "a", "part": tags["right"], "where": lambda x, n: n[:, 0] > 0},
            "has both part and where",
        ),
        ({}, "part name ''"),
    ):
        with pytest.raises(InputError, match=said):
            row(problem, rest, **given)
