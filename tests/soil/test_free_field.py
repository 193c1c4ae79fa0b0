"""Free-field sides: without a structure they are not there (seismic practice, free-field column
with dashpots)."""

from __future__ import annotations

from collections import deque

import numpy as np
import pytest
from fem_problems import block, linear
from layered import SHAKE, STIFF, middles
from soil import SOIL, history, strip

import vi_contact as vc
from vi_contact import fem, soil
from vi_contact.core.errors import InputError

DT, STEPS = 2e-3, 150
UP = soil.upgoing(vc.Ricker(2.0, 4.0, direction=(1.0, 0.5)), dt=DT)
POINTS = [(x, y) for y in (0.0, 3.0, 8.0) for x in (0.0, 3.0, 6.0)]
SCHEMES = {"trapezoidal": vc.Trapezoidal(), "zwt": vc.ZienkiewiczWoodTaylor()}


def layered(comm, kind, *, simplices=False, n=1):
    """A wide strip of two layers with free-field sides on one of the three bases, and the same with
    tied sides."""
    mesh, tags = strip(comm, 6.0, 8.0, (4 * n, 8 * n), simplices=simplices)
    upper = middles(mesh)[:, 1] > 4.0
    soft, stiff = (
        fem.Cells(n, np.flatnonzero(m).astype(np.int32), mesh)
        for n, m in (("a", upper), ("b", ~upper))
    )
    ground = soil.base_motion(SHAKE)
    base = {
        "relative": SHAKE,
        "moved": ground,
        "compliant": fem.CompliantBase(tags["bottom"], motion=UP),
    }[kind]
    moved = fem.Prescribed(
        tags["bottom"], ground.displacement, ground.velocity, ground.acceleration
    )
    data = {
        "clamped": tags["bottom"] if kind == "relative" else (),
        "prescribed": moved if kind == "moved" else (),
        "damping": vc.Rayleigh(0.8, 1e-3),
        "section": vc.PlaneStrain(0.5),
    }
    foot = [base] if kind == "compliant" else []
    sides = [soil.FreeField(tags[name], base=base) for name in ("left", "right")]
    material = [(stiff, STIFF), (soft, SOIL)]
    free = fem.assemble(mesh, material, dashpots=[*sides, *foot], **data)
    tied = fem.assemble(
        mesh, material, dashpots=foot, tied=fem.Tied(tags["left"], tags["right"]), **data
    )
    shaken = {"excitation": SHAKE} if kind == "relative" else {}
    return linear(free, **shaken), linear(tied, **shaken)


@pytest.mark.long
@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("relative", "trapezoidal"),
        ("relative", "zwt"),
        ("moved", "trapezoidal"),
        ("compliant", "zwt"),
    ],
)
@pytest.mark.promise("guide/soil.md", "the error is 1e-14 with twelve schemes", bound="1e-10")
def test_level_ground_does_not_notice_them(comm, kind, name):
    """Both directions, two layers, damping, three bases: equal to tied sides to round-off."""
    scheme = SCHEMES[name]
    free, tied = (
        history(p, POINTS, dt=DT, steps=STEPS, scheme=scheme) for p in layered(comm, kind)
    )
    assert np.abs(free - tied).max() < 1e-10 * np.abs(tied).max()


@pytest.mark.serial
@pytest.mark.parametrize(
    "scheme", [vc.HHT(-0.1), vc.Newmark(0.3025, 0.6), vc.Houbolt(), vc.MoreauJean()]
)
def test_with_other_schemes(comm, scheme):
    free, tied = (
        history(p, POINTS, dt=DT, steps=40, scheme=scheme) for p in layered(comm, "relative")
    )
    assert np.abs(free - tied).max() < 1e-10 * np.abs(tied).max()


@pytest.mark.long
@pytest.mark.serial
@pytest.mark.promise(
    "guide/soil.md",
    "On triangles it is 1.6 % with 8 cells",
    bound="2 %, falling with order 1.5 or more",
)
def test_on_triangles_to_second_order(comm):
    """A side node has a share of its triangles that differs from node to node: only whole strips
    are columns there."""
    errors = []
    for n in (1, 2):
        pair = layered(comm, "relative", simplices=True, n=n)
        free, tied = (history(p, POINTS, dt=DT, steps=STEPS) for p in pair)
        errors.append(np.abs(free - tied).max() / np.abs(tied).max())
    assert errors[0] < 0.02 and errors[1] < 0.35 * errors[0]


@pytest.mark.serial
def test_waves_of_a_structure_leave(comm):
    """A pulse on the surface between the sides: most of its energy has left when the sides are
    absorbing."""
    mesh, tags = strip(comm, 6.0, 8.0, (12, 16))
    push = fem.Traction(
        tags["top"], lambda x, t: np.outer(np.abs(x[:, 0] - 3.0) < 1.0, [0.0, 1e4 * (t < 0.01)])
    )
    quiet = vc.Ricker(1e-12, 4.0)
    left = []
    for sides in (True, False):
        dashpots = [soil.FreeField(tags[n], base=quiet) for n in ("left", "right")] if sides else []
        tied = () if sides else fem.Tied(tags["left"], tags["right"])
        system = fem.assemble(
            mesh, SOIL, clamped=tags["bottom"], dashpots=dashpots, tied=tied, loads=push
        )
        ((state, _),) = deque(vc.march(linear(system), dt=DT, steps=60), maxlen=1)
        left.append(system.kinetic_energy(state.v) + system.strain_energy(state.u))
    assert left[0] < 0.1 * left[1]


def test_sides_that_cannot_be_are_refused(comm):
    """Not vertical, base not held, base held although compliant, in three dimensions."""
    mesh, tags = strip(comm, 6.0, 8.0, (4, 8))
    side = soil.FreeField(tags["left"], base=SHAKE)
    with pytest.raises(InputError, match="is not held"):
        fem.assemble(mesh, SOIL, dashpots=side)
    with pytest.raises(InputError, match="not one vertical line"):
        fem.assemble(
            mesh, SOIL, clamped=tags["bottom"], dashpots=soil.FreeField(tags["top"], base=SHAKE)
        )
    base = fem.CompliantBase(tags["bottom"], motion=UP)
    with pytest.raises(InputError, match="held, but its base is compliant"):
        fem.assemble(
            mesh, SOIL, clamped=tags["bottom"], dashpots=soil.FreeField(tags["left"], base=base)
        )
    mesh, tags = block(comm, lengths=(1.0, 1.0, 1.0), divisions=(1, 1, 1))
    with pytest.raises(
        InputError, match="FreeField is for plane bodies: tie the sides of this one"
    ):
        fem.assemble(
            mesh, SOIL, clamped=tags["bottom"], dashpots=soil.FreeField(tags["left"], base=SHAKE)
        )
