"""A time step that is too long for what acts is told, wherever the motion stands: half a period
sees nothing at all."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from fem_problems import block, plane_strain

import vi_contact as vc
from vi_contact import fem, soil
from vi_contact.practice.ground_motion import Record
from vi_contact.run.sampling import sampling_warning

pytestmark = pytest.mark.serial
SHAKE = vc.Harmonic(1.0, 2.0)  # half a period is 0.25 s
RECORD = Record(np.sin(np.arange(50.0)), 0.01)


@dataclass(frozen=True)
class Engine:
    """A motion of the user's that knows its frequency."""

    frequency: float = 2.0

    def __call__(self, *given: Any) -> Any:
        value = float(np.sin(2.0 * np.pi * self.frequency * given[-1]))
        return value if len(given) == 1 else np.full(given[0].shape, value)


def body(
    comm: Any,
    load: Any = None,
    value: Any = None,
    motion: Any = None,
    moving: Any = None,
    **more: Any,
) -> vc.ContactProblem:
    mesh, tags = block(comm, lengths=(2.0, 1.0), divisions=(2, 2))
    loads = [fem.Traction(tags["left"], value or (1.0, 0.0), history=load)] if load or value else []
    held = {"clamped": tags["top"]} if motion is None else {"prescribed": motion(tags)}
    system = fem.assemble(mesh, plane_strain(1.0e6, 0.3, 2000.0), loads=loads, **held)
    surface = fem.contact_surface(system, tags["bottom"])
    return vc.ContactProblem(system, surface if moving is None else surface.moving(moving), **more)


def prescribed(shake: Any) -> Any:
    base = soil.base_motion(shake)
    return lambda tags: fem.Prescribed(
        tags["top"], base.displacement, base.velocity, base.acceleration
    )


PLACES = {
    "excitation": {"excitation": SHAKE},
    "two": {"excitation": (replace(SHAKE, frequency=0.01), SHAKE)},
    "history": {"load": SHAKE.acceleration},
    "history in a closure": {"load": (lambda one: lambda t: 3.0 * one.acceleration(t))(SHAKE)},
    "own history": {"load": Engine()},
    "base": {"motion": prescribed(SHAKE)},
    "moving": {"moving": Engine()},
    "traction": {"value": Engine()},
}


def lengthy(comm: Any, name: str, dt: float) -> str | None:
    return sampling_warning(body(comm, **PLACES[name]), dt)


@pytest.mark.parametrize("name", PLACES)
def test_a_multiple_of_half_a_period_sees_nothing(comm: Any, name: str) -> None:
    for halves in (1, 2, 3):
        said = lengthy(comm, name, 0.25 * halves)
        assert (
            said is not None
            and f"is {halves} times half the period of" in said
            and "0.25 s, so that" in said
        )
        assert said.endswith("take a dt of at most 0.025 s, a twentieth of the period")
    said = lengthy(comm, name, 0.2)
    assert said is not None and "has only 2.5 steps in the period of 0.5 s" in said
    assert lengthy(comm, name, 0.125) is None and lengthy(comm, name, 0.025) is None


MOTIONS: list[Any] = [
    (vc.Ricker(1.0, 2.0), 0.125),
    (vc.HalfSine(1.0, 0.4), 0.2),
    (vc.FullSine(1.0, 0.4), 0.1),
    (vc.Rectangular(1.0, 0.4), 0.4),
    (vc.Tabulated((0.0, 0.1, 0.2, 0.3), (0.0, 1.0, -1.0, 0.0)), 0.1),
    (vc.GroundMotion(RECORD), 0.01),
]


@pytest.mark.parametrize(("motion", "longest"), MOTIONS, ids=lambda one: type(one).__name__)
@pytest.mark.parametrize("place", ["excitation", "load", "base"])
def test_every_motion_has_its_longest_step(
    comm: Any, motion: Any, longest: float, place: str
) -> None:
    acting = {
        "excitation": {"excitation": motion},
        "load": {"load": motion.acceleration},
        "base": {"motion": prescribed(motion)},
    }[place]
    problem = body(comm, **acting)
    assert sampling_warning(problem, longest) is None
    said = sampling_warning(problem, 1.01 * longest)
    assert said is not None and f"{1.01 * longest:g} s" in said


def test_an_upgoing_wave(comm: Any) -> None:
    mesh, tags = block(comm, lengths=(2.0, 1.0), divisions=(2, 1))
    material = plane_strain(1.0e6, 0.3, 2000.0)
    base = fem.CompliantBase(tags["top"], material, motion=soil.upgoing(SHAKE, dt=0.01))
    system = fem.assemble(mesh, material, dashpots=base)
    problem = vc.ContactProblem(system, fem.contact_surface(system, tags["bottom"]))
    said = sampling_warning(problem, 0.5)
    assert said is not None and "2 times half the period of Harmonic of 2 Hz" in said
    assert sampling_warning(problem, 0.025) is None


def test_it_stands_in_the_summary(comm: Any) -> None:
    facts = vc.simulate(body(comm, excitation=SHAKE), dt=0.5, steps=2, progress=False).facts
    assert "2 times half the period of Harmonic of 2 Hz, 0.25 s" in facts["sampling"]


def test_nothing_is_said_of_what_is_not_known(comm: Any) -> None:
    assert sampling_warning(body(comm, load=lambda t: np.sin(t)), 100.0) is None
