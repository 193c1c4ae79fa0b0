"""What a solution, a problem and a state say of themselves: short, and safe to show in a
notebook."""

from __future__ import annotations

from base64 import b64decode
from dataclasses import replace
from html.parser import HTMLParser
from typing import Any

import numpy as np
import pytest
from chain import chain_problem
from fem_problems import WALL_DT, shaken_wall

import vi_contact as vc

SHAKE = vc.Harmonic(30.0, 3.0, direction=(1.0,))
NASTY = '</table><script>alert(1)</script>&"'


class Strict(HTMLParser):
    """Every element is closed in its order; the texts and the pictures that are there."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.seen: set[str] = set()
        self.texts: list[str] = []
        self.images: list[str] = []
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.seen.add(tag)
        if tag == "img":
            self.images += [value for name, value in attrs if name == "src"]
        else:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts.append(data)


class Nasty(vc.Midpoint):
    """A scheme with a name that is no HTML."""

    def __repr__(self) -> str:
        return NASTY


@pytest.mark.serial
def test_html_is_a_table_and_a_picture_of_its_own() -> None:
    """It parses, names are escaped, and nothing refers to another place."""
    solution = vc.simulate(
        chain_problem(3, excitation=SHAKE), scheme=Nasty(), dt=1e-3, steps=5, progress=False
    )
    page = Strict(text := solution._repr_html_())
    assert page.seen == {"table", "tr", "th", "td", "img"}
    assert NASTY in page.texts and "worst certificate" in page.texts and "http" not in text
    (image,) = page.images
    kind, _, data = image.partition(",")
    assert kind == "data:image/png;base64" and b64decode(data, validate=True).startswith(b"\x89PNG")


@pytest.mark.serial
def test_a_solution_shows_its_summary() -> None:
    solution = vc.simulate(
        chain_problem(3, excitation=SHAKE), scheme=vc.Midpoint(), dt=1e-3, steps=5, progress=False
    )
    assert repr(solution) == solution.summary() and repr(solution).startswith(
        "run finished: 5 steps of 0.001 s, t = 0"
    )
    assert "\n  worst certificate          " in repr(
        solution
    ) and "\n    contact work             " in repr(solution)


def test_problems_and_states_are_told_in_a_few_lines(comm: Any) -> None:
    """Unknowns, conditions and laws, on every rank and without arrays."""
    problem = replace(shaken_wall(comm), friction=vc.Coulomb(tuple([0.3] * 6)))
    told = repr(problem)
    assert "array" not in told and len(told.splitlines()) == 7 and len(told) < 600
    for word in (
        "ContactProblem with 6 contact conditions",
        "60 unknowns in 2D, undamped, supported",
        "impact: Inelas",
        "friction: Coulomb(",
        "mass: ConsistentMass()",
        "excitation: Harmonic(",
        "FemSurface(",
    ):
        assert word in told
    state = vc.simulate(problem, dt=WALL_DT, steps=2, progress=False).state
    assert repr(state).startswith(f"State(t={state.t} s, k=2, ") and "array" not in repr(state)
    assert repr(replace(problem, mass=None)).count("mass: 'that of the time scheme'") == 1
    assert (
        repr(problem.surface.on_springs(1e9)).count(
            f"{problem.surface.count} on springs, 0 bilateral)"
        )
        == 1
    )


@pytest.mark.serial
def test_a_run_without_steps_tells_its_state() -> None:
    """Three springs of 1 kN/m pulled by 6 N stretch by 18 mm: the last mass is stopped by a wall at
    10 mm, the first moves by 10/3 mm away from one that was 100 mm beside it."""
    problem = chain_problem(3, gap=0.01, left_gap=0.1, constant=6.0)
    rest = vc.static_equilibrium(problem)
    solution = vc.simulate(
        problem, scheme=vc.Midpoint(), state=rest, dt=1.0, steps=0, progress=False
    )
    assert solution.facts["closed_points"] == 1
    assert solution.facts["largest_opening"] == pytest.approx(0.1 + 0.01 / 3.0, rel=1e-12)
    assert solution.facts["worst_certificate"] == rest.certificate
    assert rest.certificate is not None and rest.certificate < 1e-9
    told = solution.summary()
    assert told.startswith("state at t = 0 s, without a step, on 1 rank\n")
    for line in ("closed points              1 of 2", "largest opening            1.033e-01 m"):
        assert line in told
    assert "0 steps" not in told and "ledger" not in told


@pytest.mark.serial
def test_a_state_that_nobody_solved_for_has_no_certificate() -> None:
    solution = vc.simulate(chain_problem(3), scheme=vc.Midpoint(), dt=1.0, steps=0, progress=False)
    assert "certificate" not in solution.summary()


@pytest.mark.serial
def test_steps_and_certificates_are_tables() -> None:
    """They parse, show the largest residual, and have no colour of their own."""
    problem = chain_problem(3, excitation=SHAKE)
    _, report = next(vc.march(problem, scheme=vc.Midpoint(), dt=1e-3, steps=2))
    for shown in (report, report.certificate):
        page = Strict(text := shown._repr_html_())
        assert page.seen == {"table", "tr", "th", "td"}
        assert f"{report.certificate.worst:.2e}" in page.texts and "  cone" in page.texts
        assert "#" not in text and "rgb" not in text and "http" not in text


def test_an_answer_between_bounds_is_a_table(comm: Any) -> None:
    """A string of eight elements that lies on a floor at three points: docs of ``vi``."""
    dolfinx = pytest.importorskip("dolfinx")
    ufl = pytest.importorskip("ufl")
    from vi_contact import vi
    from vi_contact.fem import compat

    line = dolfinx.mesh.create_interval(comm, 8, [0.0, 1.0])
    V = compat.lagrange(line, 1)
    own = dolfinx.fem
    ends = own.dirichletbc(
        0.0, own.locate_dofs_geometrical(V, lambda x: np.isclose(x[0] % 1.0, 0.0)), V
    )
    u, v = own.Function(V), ufl.TestFunction(V)
    answer = vi.solve((u.dx(0) * v.dx(0) + 8.0 * v) * ufl.dx, u, lower=-0.5, bcs=[ends])
    page = Strict(replace(answer, reason=NASTY)._repr_html_())
    assert page.seen == {"table", "tr", "th", "td"}
    assert "3 on the lower, 0 on the upper" in page.texts and NASTY in page.texts
