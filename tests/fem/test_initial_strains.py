"""Initial strains (V8.10): free bodies expand without stress; held ones press; warmed bars send
waves; dislocations."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import ufl
from fem_problems import CONCRETE, block, linear, max_over_ranks
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.core.step import State
from vi_contact.fem.body.initial_strains import InitialStrains
from vi_contact.fem.output.fields import VonMises
from vi_contact.laws.materials import LinearElastic, PlaneStress
from vi_contact.laws.orthotropic import Orthotropic
from vi_contact.run.recorders import Contact, Energy
from vi_contact.run.simulate import simulate
from vi_contact.run.static import quasi_static, static_equilibrium
from vi_contact.schemes.midpoint import Midpoint
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.volume.route import Volume

COMM = MPI.COMM_WORLD
E, NU, WARM = 2.0e10, 0.2, 3.0e-4  # WARM: alpha (T - T_0), 30 K of concrete
WOOD = Orthotropic(
    E1=1.1e10,
    E2=0.9e9,
    E3=0.5e9,
    nu12=0.3,
    nu13=0.35,
    nu23=0.4,
    G12=0.7e9,
    G13=0.6e9,
    G23=0.1e9,
    rho=450.0,
    axes=0.4,
)


def followed(
    d: int, exact: Any, load: Any, *, material: Any = CONCRETE, **options: Any
) -> tuple[Any, State, float]:
    """(problem, state, largest error of u over the largest u) of a block whose left side moves as
    it would free."""
    simplices = options.pop("simplices", False)
    mesh, tags = block(
        COMM, lengths=(2.0, 1.0, 1.5)[:d], divisions=(3, 2, 1)[:d], simplices=simplices
    )
    side = fem.Prescribed(tags["left"], displacement=lambda x, t: exact(x))
    system = fem.assemble(mesh, material, prescribed=side, loads=load, **options)
    problem = linear(system)
    state = static_equilibrium(problem, solver=Condensed())
    u = exact(system.space.points)
    error = max_over_ranks(COMM, system.space.expand(state.u, 0.0) - u)
    return problem, state, error / max_over_ranks(COMM, u)


def stress(problem: ContactProblem, state: State) -> Array:
    """The stress tensors [Pa] of this rank."""
    return np.asarray(fem.as_function(problem, state, "stress").x.array)


@pytest.mark.parametrize(
    ("d", "options"),
    [
        (1, {}),
        (2, {}),
        (2, {"degree": 2, "simplices": True}),
        (2, {"section": PlaneStress(0.2)}),
        (3, {}),
        (2, {"integration": "selective"}),
        (2, {"material": WOOD, "section": PlaneStress(0.2)}),
    ],
    ids=["bar", "Q1", "P2", "panel", "hexahedra", "selective", "wood"],
)
def test_uniform_warming_leaves_a_free_body_without_stress(d, options):
    """u = alpha dT x, (1 + nu) times that in plane strain, where sigma_zz = -E alpha dT alone
    remains, and (1 + nu)/(1 - nu) times in a bar, which is held sideways twice."""
    plane = d == 2 and not isinstance(options.get("section"), PlaneStress)
    share = 1.0 + NU if plane else (1.0 + NU) / (1.0 - NU) if d == 1 else 1.0
    problem, state, error = followed(
        d, lambda x: share * WARM * x, fem.InitialStrain(WARM), **options
    )
    assert error < 1e-11
    assert max_over_ranks(COMM, stress(problem, state)) < 1e-9 * E * WARM
    mises = VonMises(problem.system.space.forms)(problem.system.space.expand(state.u, 0.0))
    assert max_over_ranks(COMM, mises - (E * WARM if plane else 0.0)) < 1e-9 * E * WARM


@pytest.mark.serial
@pytest.mark.parametrize(
    ("d", "simplices"), [(2, False), (2, True), (3, True)], ids=["Q2", "P2", "P2 in space"]
)
def test_warming_linear_in_space_bends_a_free_body_without_stress(d, simplices):
    """T - T_0 ~ 1 + x: u = e (x + (x² - y² - z²)/2, (1 + x) y, (1 + x) z), which degree 2 holds."""
    share = WARM * (1.0 + NU if d == 2 else 1.0)

    def exact(x: Array) -> Array:
        along = x[:, :1] + 0.5 * (x[:, :1] ** 2 - np.sum(x[:, 1:] ** 2, axis=1, keepdims=True))
        return share * np.hstack([along, (1.0 + x[:, :1]) * x[:, 1:]])

    load = fem.InitialStrain(lambda x, t: WARM * (1.0 + x[:, 0]))
    problem, state, error = followed(d, exact, load, degree=2, simplices=simplices)
    assert error < 1e-10
    assert max_over_ranks(COMM, stress(problem, state)) < 1e-8 * E * WARM


@pytest.mark.two_ranks
def test_tensors_and_parts_of_a_body():
    """Any uniform gradient, also across the plane; a dislocation: slip b across a layer of cells
    moves the rest."""
    gradient = WARM * np.array([[1.0, 3.0], [-0.5, -2.0]])
    problem, state, error = followed(2, lambda x: x @ gradient.T, fem.InitialStrain(gradient))
    sizes = [error, max_over_ranks(COMM, stress(problem, state)) / (E * WARM)]
    # sigma_xx = 0 again where the plane contracts as a bar that is pulled along z
    across = np.diag([0.0, 0.0, WARM])
    problem, state, error = followed(2, lambda x: NU * WARM * x, fem.InitialStrain(across))
    sizes += [error, max_over_ranks(COMM, stress(problem, state)) / (E * WARM)]
    # in plane strain wood takes sigma_zz = -E3 alpha dT, and contracts by nu_i3 / E_i of it
    Q = WOOD._rotation[:2, :2]
    gradient = (
        WARM
        * Q
        @ np.diag([1.0 + WOOD.nu13 * WOOD.E3 / WOOD.E1, 1.0 + WOOD.nu23 * WOOD.E3 / WOOD.E2])
        @ Q.T
    )
    problem, state, error = followed(
        2, lambda x: x @ gradient, fem.InitialStrain(WARM), material=WOOD
    )
    sizes += [error, max_over_ranks(COMM, stress(problem, state)) / (E * WARM)]
    mises = VonMises(problem.system.space.forms)(problem.system.space.expand(state.u, 0.0))
    sizes.append(max_over_ranks(COMM, mises / (WOOD.E3 * WARM) - 1.0))
    assert max(sizes) < 1e-9


def layer(h: float, d: int = 2) -> tuple[Any, Any, Any]:
    """(mesh, groups, cells between x = 1 and x = 1 + h) of a bar or block 2 m long."""
    mesh, tags = block(COMM, lengths=(2.0, 1.0)[:d], divisions=(round(2.0 / h), 2)[:d])
    eps = 1e-6
    return (
        mesh,
        tags,
        fem.Cells.where("slip", mesh, lambda x: (x[0] > 1.0 - eps) & (x[0] < 1.0 + h + eps)),
    )


@pytest.mark.parametrize("h", [0.5, 0.125])
@pytest.mark.promise("guide/bring_your_own.md", "leaves the stress -E b/L to round-off")
def test_a_dislocation_moves_half_a_body_or_strains_one_that_is_held(h):
    """A jump b = (opening, slip): beyond the layer u = b and no stress; between held ends -(M b_x,
    mu b_y) / L, which no longer knows the layer."""
    b = np.array([2e-4, 5e-4])
    mesh, tags, cells = layer(h)
    load = fem.InitialStrain(np.outer(b, [1.0, 0.0]) / h, cells=cells)
    free = linear(fem.assemble(mesh, CONCRETE, clamped=tags["left"], loads=load))
    state = static_equilibrium(free, solver=Condensed())
    u, x = free.system.space.expand(state.u, 0.0), free.system.space.points[:, :1]
    assert max_over_ranks(COMM, u - b * np.clip((x - 1.0) / h, 0.0, 1.0)) < 1e-10 * b[1]
    assert max_over_ranks(COMM, stress(free, state)) < 1e-8 * E * b[1]
    level = (
        fem.Prescribed(tags["top"], components=(1,)),
        fem.Prescribed(tags["bottom"], components=(1,)),
    )
    held = linear(
        fem.assemble(
            mesh,
            LinearElastic(E, 0.0, 2400.0),
            clamped=[tags["left"], tags["right"]],
            prescribed=level,
            loads=fem.InitialStrain(np.diag([b[0], 0.0]) / h, cells=cells),
        )
    )
    found = stress(held, static_equilibrium(held, solver=Condensed())).reshape(-1, 4)[:, 0]
    assert max_over_ranks(COMM, found + E * b[0] / 2.0) < 1e-8 * E * b[0]


def between_walls(gap: float, history: Any = None) -> ContactProblem:
    """A block 1 m high on frictionless ground below a ceiling, warmed; its sides are free."""
    mesh, tags = block(COMM, lengths=(2.0, 1.0), divisions=(4, 3))
    load = fem.InitialStrain(WARM, history=history)
    system = fem.assemble(
        mesh,
        CONCRETE,
        loads=load,
        prescribed=[
            fem.Prescribed(tags["bottom"], components=(1,)),
            fem.Prescribed(tags["left"], components=(0,)),
        ],
    )
    ceiling = HalfSpace(point=(0.0, 1.0 + gap), normal=(0.0, -1.0))
    return ContactProblem(system, fem.contact_surface(system, tags["top"], obstacle=ceiling))


@pytest.mark.promise("guide/bring_your_own.md", "Both routes give E/(1 - nu²)")
def test_warming_closes_a_gap_and_presses_by_both_routes():
    """Plane strain, free sides: p = E / (1 - nu²) ((1 + nu) alpha dT - g / H), nothing before the
    gap is closed."""
    free, times, answers = (1.0 + NU) * WARM, [0.2, 0.6, 1.0], []
    for solver in (Condensed(), Volume()):
        problem = between_walls(0.4 * free, lambda t: t)
        answers.append(
            [
                problem.surface.everywhere(state.r_n / problem.surface.weights)
                for state in quasi_static(problem, times, solver=solver)
            ]
        )
    expected = [max(0.0, E / (1.0 - NU**2) * (t - 0.4) * free) for t in times]
    for found in answers:
        for p, exact in zip(found, expected, strict=True):
            assert p == pytest.approx(np.full(len(p), exact), abs=1e-10 * E * WARM)


def warmed_bar(n: int, gap: float) -> ContactProblem:
    """A bar of n cells, its left end held, the right one a gap before a wall, warmed all at once at
    t = 0."""
    mesh, tags = block(COMM, lengths=(2.0,), divisions=(n,))
    system = fem.assemble(
        mesh, LinearElastic(E, 0.0, 2400.0), clamped=tags["left"], loads=fem.InitialStrain(WARM)
    )
    wall = HalfSpace(point=(2.0 + gap,), normal=(-1.0,))
    return ContactProblem(system, fem.contact_surface(system, tags["right"], obstacle=wall))


@pytest.mark.long
@pytest.mark.serial
@pytest.mark.promise(
    "guide/bring_your_own.md",
    "is 0.02 % too small in the middle of the push",
    bound="0.4 and 4.5 %, on 40 cells",
)
def test_sudden_warming_sends_waves_of_its_stress():
    """By characteristics, g = alpha dT L, T = L/c: the tip moves by c alpha dT until T, is held by
    E alpha dT until 2T, and leaves; the support pushes by E alpha dT until T and pulls as much from
    then on. The ledger holds the strain energy ½ E (alpha dT)² L from the start, and no work."""
    n, length, c = 40, 2.0, np.sqrt(E / 2400.0)
    crossing, gap, unit = length / c, WARM * length, E * WARM
    runs = []
    for solver, end in ((Condensed(), 2.9), (Volume(), 1.3)):
        problem = warmed_bar(n, gap)
        foot = fem.Facets.where("foot", problem.system.space.mesh, lambda x: x[0] < 1e-9)
        held = vc.Reactions("support", foot, (0.0,))
        runs.append(
            simulate(
                problem,
                scheme=Midpoint(),
                solver=solver,
                dt=0.5 * crossing / n,
                t_end=end * crossing,
                record=[Energy(), Contact(), held],
            ).history
        )
    h = runs[0]
    t, push, pull = h["t"] / crossing, -h["contact_force_x"] / unit, h["reaction_x_support"] / unit
    impulse = float(np.sum(0.5 * (push[1:] + push[:-1]) * np.diff(t)))
    # 1.5 % here, 1.0 % and 0.6 % on 100 and 200 cells
    assert impulse == pytest.approx(1.0, abs=0.045)
    middle = [
        np.mean(one[(t > a + 0.2) & (t < a + 0.8)])
        for one, a in ((push, 1.0), (pull, 0.0), (pull, 1.0))
    ]
    assert middle == pytest.approx([1.0, 1.0, -1.0], abs=0.004)  # 0.12 %
    stored = 0.5 * E * WARM**2 * length
    assert h["energy_strain"][0] == pytest.approx(stored, rel=1e-12)
    assert np.max(np.abs(h["work_input"])) < 1e-9 * stored
    assert np.max(np.abs(h["energy_defect"])) < 1e-9 * stored
    other = runs[1]["contact_force_x"]
    assert np.max(np.abs(other - h["contact_force_x"][: len(other)])) < 1e-10 * unit


def test_histories_work_on_a_body_that_is_held():
    """A block between rigid ends, warmed by s(t) = t: N = -E alpha dT s h where a cut follows
    element sides and where it goes through elements, the same reactions, and all the work of the
    source is stored."""
    mesh, tags = block(COMM, lengths=(2.0, 1.0), divisions=(4, 3))
    level = [fem.Prescribed(tags[name], components=(1,)) for name in ("top", "bottom")]
    load = [fem.InitialStrain(np.diag([WARM, 0.0]), history=lambda t: t)]
    system = fem.assemble(
        mesh,
        LinearElastic(E, 0.0, 2400.0),
        clamped=[tags["left"], tags["right"]],
        loads=load,
        prescribed=level,
    )
    cuts = {"on": ((1.0, 0.0), (1.0, 1.0)), "through": ((1.2, 0.0), (1.2, 1.0))}
    record = [
        vc.SectionForces(cuts, loads=load),
        vc.Reactions("left", tags["left"], (0.0, 0.0)),
        Energy(),
    ]
    h = simulate(
        linear(system), scheme=Midpoint(), solver=Condensed(), dt=0.25, t_end=1.0, record=record
    ).history
    late = [h[name][-1] / (E * WARM) for name in ("N_on", "N_through", "reaction_x_left")]
    # forces are those of mid-step, s = 7/8
    assert late == pytest.approx([-0.875, -0.875, 0.875], abs=1e-9)
    energy = [h[name][-1] / (E * WARM**2) for name in ("energy_strain", "work_input")]
    assert energy == pytest.approx([1.0, 1.0], abs=1e-9)


def test_outputs_know_the_strain_of_their_time(shared_tmp: Path):
    """A free panel warmed by t has no stress at any time; a frame gives the stresses of the state
    that it stored."""
    mesh, tags = block(COMM, lengths=(1.0, 1.0), divisions=(2, 2))
    rollers = [
        fem.Prescribed(tags["left"], components=(0,)),
        fem.Prescribed(tags["bottom"], components=(1,)),
    ]
    system = fem.assemble(
        mesh,
        CONCRETE,
        section=PlaneStress(),
        prescribed=rollers,
        loads=fem.InitialStrain(lambda x, t: WARM * t * np.ones(len(x))),
    )
    problem = linear(system)
    for state in quasi_static(problem, [1.0, 3.0], solver=Condensed()):
        assert max_over_ranks(COMM, stress(problem, state)) < 1e-9 * E * WARM
    out = shared_tmp / "run"
    solution = simulate(
        problem,
        scheme=Midpoint(),
        solver=Condensed(),
        dt=1e-4,
        t_end=2e-4,
        out=out,
        fields=fem.XDMF(every=1),
    )
    ended = np.asarray(solution.function("stress").x.array)
    stored = np.asarray(fem.read_function(problem, out, "stress", t=2e-4).x.array)
    assert max_over_ranks(COMM, stored - ended) < 1e-12 * E * WARM * 2e-4
    assert max_over_ranks(COMM, ended) > 0.01 * E * WARM * 2e-4  # the waves of a sudden rate
    with h5py.File(out / "fields" / "frame_000002.h5") as file:
        highest = float(np.max(file["von_mises"]))
    mises = VonMises(system.space.forms)
    u = fem.read_function(problem, out, "u", t=2e-4)
    found = mises(u.x.array[: system.space.points.size].reshape(-1, 2), 2e-4)
    assert max_over_ranks(COMM, found) == pytest.approx(highest, rel=1e-12)


@pytest.mark.two_ranks
def test_forms_of_the_user_and_wrong_values_are_refused():
    mesh, _ = block(COMM, lengths=(1.0, 1.0), divisions=(2, 2))
    for value, text in (
        ((1.0, 2.0, 3.0), "shape"),
        (np.full((2, 2), np.nan), "finite"),
        ("warm", "real numbers"),
    ):
        with pytest.raises(InputError, match=text):
            fem.assemble(mesh, CONCRETE, loads=fem.InitialStrain(value))
    for value in (lambda x, t: np.zeros((len(x), 5)), lambda x, t: np.nan * x[:, 0]):
        with pytest.raises(InputError, match="InitialStrain"):
            fem.assemble(mesh, CONCRETE, loads=fem.InitialStrain(value)).load(0.0)
    own = fem.Forms(stiffness=lambda u, v: ufl.inner(ufl.grad(u), ufl.grad(v)) * ufl.dx)
    with pytest.raises(InputError, match="needs the C of a material"):
        fem.assemble(mesh, CONCRETE, forms=own, loads=fem.InitialStrain(WARM))


@pytest.mark.serial
@pytest.mark.parametrize("d", [1, 2, 3])
def test_only_numbers_and_tensors_of_the_body_are_taken(d: int) -> None:
    """Shapes that would be broadcast are refused, of numbers and of functions, before anything is
    solved; on all ranks alike, where one has the points of a function and another none."""
    mesh, tags = block(COMM, lengths=(2.0, 1.0, 1.5)[:d], divisions=(3, 2, 1)[:d])
    takes = [(), (d, d), *([(3, 3)] if d == 2 else [])]
    corner = fem.Cells.where("corner", mesh, lambda x: x[0] < 0.67)
    for shape in [
        (),
        (1,),
        (2,),
        (0, 0),
        (1, 1),
        (1, 2),
        (2, 1),
        (2, 2),
        (3, 1),
        (3, 3),
        (1, 1, 1),
        (2, 2, 2),
    ]:
        strain = np.full(shape, WARM)
        if shape == (3, 3):
            strain[2, :2] = strain[:2, 2] = 0.0  # shear across the plane is refused, see below
        given: list[Any] = [
            strain,
            lambda x, t, strain=strain: np.broadcast_to(strain, (len(x), *strain.shape)),
        ]
        for number, value in enumerate(given):
            if shape in takes:
                fem.assemble(mesh, CONCRETE, loads=fem.InitialStrain(value, cells=corner))
                continue
            with pytest.raises(
                InputError, match=r"InitialStrain.*: value .*d, d\) or in the plane \(.*3, 3\)"
            ):
                fem.assemble(mesh, CONCRETE, loads=fem.InitialStrain(value, cells=corner))
            if number == 0:
                with pytest.raises(
                    InputError, match=r"give a number, a tensor \(d, d\) or in the plane"
                ):
                    fem.InitialStrain(value, cells=corner)
    for value in (
        lambda x, t: WARM,
        lambda x, t: None,
        lambda x, t: np.full((1, len(x)), WARM),
        lambda x, t: np.full(len(x), True),
        lambda x, t: np.full(len(x), 1j),
        lambda x, t: ["warm"] * len(x),
        lambda x, t: np.where(x[:, 0] > 1.5, np.nan, WARM),
    ):
        with pytest.raises(InputError, match="InitialStrain at t = 0 s: value (has shape|is)"):
            fem.assemble(mesh, CONCRETE, clamped=tags["left"], loads=fem.InitialStrain(value))
    with pytest.raises(
        InputError, match=r"value is \[\[1.0\], \[1.0, 2.0\]\]; give a number, a tensor"
    ):
        fem.InitialStrain([[1.0], [1.0, 2.0]])


@pytest.mark.two_ranks
def test_a_function_with_a_history_is_that_of_the_start() -> None:
    """The load takes value(x, 0) s(t), as other loads do, and so must stresses: a panel that is
    free has none."""
    mesh, tags = block(COMM, lengths=(1.0, 1.0), divisions=(2, 2))
    rollers = [
        fem.Prescribed(tags["left"], components=(0,)),
        fem.Prescribed(tags["bottom"], components=(1,)),
    ]
    load = fem.InitialStrain(
        lambda x, t: WARM * (1.0 + t) * np.ones(len(x)), history=lambda t: 2.0 * t
    )
    problem = linear(
        fem.assemble(mesh, CONCRETE, section=PlaneStress(), prescribed=rollers, loads=load)
    )
    for state in quasi_static(problem, [1.0, 3.0], solver=Condensed()):
        assert max_over_ranks(COMM, stress(problem, state)) < 1e-9 * E * WARM
        assert max_over_ranks(COMM, state.u) == pytest.approx(2.0 * state.t * WARM, rel=1e-10)


@pytest.mark.two_ranks
def test_energies_are_those_of_free_unknowns_where_a_support_moves() -> None:
    """A bar of 4 cells stretched by what warming asks has no stress, and ½ uᵀKu - f_0·u + ½ ∫ eps_0
    : C eps_0 of its free nodes: strains WARM in three cells and -3 WARM in the last, 6 + 2 times ½
    E WARM² / 2 of one cell."""
    mesh, tags = block(COMM, lengths=(2.0,), divisions=(4,))
    moved = fem.Prescribed(tags["right"], displacement=lambda x, t: np.full(x.shape, 2.0 * WARM))
    bar = LinearElastic(E, 0.0, 2400.0)
    problem = linear(
        fem.assemble(
            mesh, bar, clamped=tags["left"], prescribed=moved, loads=fem.InitialStrain(WARM)
        )
    )
    state = static_equilibrium(problem, solver=Condensed())
    assert max_over_ranks(COMM, stress(problem, state)) < 1e-9 * E * WARM
    assert Energy().start(problem, state)["energy_strain"] == pytest.approx(
        4.0 * E * WARM**2, rel=1e-10
    )


@pytest.mark.two_ranks
def test_a_strain_that_never_changes_is_integrated_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its ledger is that of the same strain with a history of 1, which is integrated in every
    step."""
    sweeps, forces = [], InitialStrains.forces
    monkeypatch.setattr(
        InitialStrains, "forces", lambda *a, **k: sweeps.append(1) or forces(*a, **k)
    )
    runs = []
    for history in (None, lambda t: 1.0):
        mesh, tags = block(COMM, lengths=(2.0, 1.0), divisions=(4, 2))
        load = fem.InitialStrain(WARM, history=history)
        problem = linear(fem.assemble(mesh, CONCRETE, clamped=tags["left"], loads=load))
        found = simulate(
            problem, scheme=Midpoint(), solver=Condensed(), dt=1e-4, t_end=1e-3, record=[Energy()]
        ).history
        runs.append((len(sweeps), found))
        sweeps.clear()
    (few, one), (many, other) = runs
    assert (few, many) == (2, 12)  # at assembly, and in the first row or in all 11
    scale = float(np.max(one["energy_strain"]))
    for name in ("energy_strain", "work_input", "energy_defect"):
        assert np.max(np.abs(one[name] - other[name])) < 1e-11 * scale


@pytest.mark.serial
def test_shear_across_the_plane_is_refused():
    """A body in the plane does not move across it: half of the strain's energy was missing without
    a word."""
    for place in ((0, 2), (2, 1)):
        strain = np.zeros((3, 3))
        strain[place] = 1e-4
        with pytest.raises(InputError, match="shears across the plane"):
            followed(2, lambda x: 0.0 * x, fem.InitialStrain(strain))
