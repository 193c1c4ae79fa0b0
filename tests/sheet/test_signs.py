"""Page 1 says which way its numbers are positive."""

from __future__ import annotations

import numpy as np

import vi_contact as vc
from vi_contact.practice.sheet.deciding import measure_column
from vi_contact.practice.sheet.rules import Measure
from vi_contact.practice.sheet.signs import explain_signs

T = np.arange(3.0)
PLANE = {"t": T, "uplift_base": T, "theta_base": T}
SPACE = {"t": T, "uplift_base": T, "theta_x_base": T}


def explain(columns: dict[str, str], history: dict[str, np.ndarray]) -> list[str]:
    """The notes for columns -> meanings."""
    history = history | dict.fromkeys(columns, T)
    deciding = [measure_column(name, name, Measure.PEAK, history) for name in columns]
    meanings = {name: ("N", meaning) for name, meaning in columns.items()}
    return explain_signs(deciding, meanings, history)


def test_signs_come_from_the_meanings() -> None:
    """A part is in compression, a section in tension; what has no sign has no note."""
    part = "normal force -F·n, compression positive, part base"
    section = "bending moment, positive with tension at b, section root"
    (note,) = explain({"N_base": part, "M_root": section}, PLANE)
    assert note.startswith("Positive means: compression for N_base; tension at b for M_root.")
    assert explain({"opening_base": "largest gap, part base"}, PLANE) == []


def test_the_centre_of_a_moment_is_told() -> None:
    """Of parts, in the plane and in space; sections have their middle."""
    meaning = "moment on the body about the centre, anticlockwise positive, part base"
    for name, history in (("M_base", PLANE), ("M_x_base", SPACE)):
        signs, centre = explain({name: meaning}, history)
        assert f"anticlockwise for {name}" in signs
        assert "the middle of the part at the level of its lowest point" in centre


def test_forces_along_the_contact_have_a_way_in_the_plane_only() -> None:
    """In space they are sizes."""
    shear = {"T_base": "tangential force F·t on the body, part base", "sliding_base": "mean, part"}
    (note,) = explain(shear, PLANE)
    assert "to the right on level ground" in note and "for T_base and sliding_base" in note
    assert explain(shear, SPACE) == []


def push(part_normal: tuple[float, float], way: tuple[float, float]) -> float:
    """The sliding that is recorded of a point that a force moves along its contact."""
    force = np.asarray(way) + 2.0 * np.asarray(part_normal)
    system = vc.system_from_arrays(
        np.ones(2), None, 1e-6 * np.eye(2), coordinates=[[0.0, 0.0]], load=force
    )
    surface = vc.contact_points(system, [0], part_normal)
    problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(0.1), mass=vc.ConsistentMass())
    part = vc.Resultants("base", where=lambda x, n: np.ones(len(x), dtype=bool))
    run = vc.simulate(problem, dt=0.01, steps=10, record=[part], progress=False)
    return float(run.history["sliding_base"][-1])


def test_the_way_is_the_recorded_one() -> None:
    """On level ground to the right is positive; up on a face with its support on the right."""
    assert push((0.0, -1.0), (1.0, 0.0)) > 0.0
    assert push((0.0, -1.0), (-1.0, 0.0)) < 0.0
    assert push((1.0, 0.0), (0.0, 1.0)) > 0.0
    assert push((-1.0, 0.0), (0.0, 1.0)) < 0.0
