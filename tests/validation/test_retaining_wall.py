"""An L-shaped retaining wall whose contact boundary goes round three corners: one group or one for
each side (V2.8)."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem
from vi_contact.fem.mesh.tagged_mesh import Facets
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.cut import Welded
from vi_contact.meshes.two_blocks import Blocks
from vi_contact.practice.ground_motion import read_record

pytestmark = pytest.mark.serial
SHARED = Path(__file__).resolve().parents[3] / "shared" / "ground_motions"
RECORDS = Path(os.environ.get("VI_CONTACT_GROUND_MOTIONS", SHARED))
SOFT = vc.LinearElastic(E=1e8, nu=0.2, rho=2400.0)  # a wave takes a step and more for a cell
SIDES = {
    "base": ("foot_bottom", "heel_bottom"),
    "end": ("heel_right",),
    "heel": ("heel_top",),
    "stem": ("stem_right",),
}
# lowest corner, width and height [m]; the ground lies below, to the right and on the heel
WALLS = {
    "foot": (0.0, 0.0, 0.5, 0.5),
    "heel": (0.5, 0.0, 2.5, 0.5),
    "stem": (0.0, 0.5, 0.5, 3.5),
}


def wall(n: int = 4) -> tuple[Any, dict[str, Facets]]:
    """(the wall under its weight, its sides) with n cells to a metre."""
    blocks = Blocks({
        name: BlockMesh(lengths=(w, h), divisions=(round(n * w), round(n * h)), corner=(x, y))
        for name, (x, y, w, h) in WALLS.items()
    })  # fmt: skip
    mesh, tags = fem.build_mesh(
        Welded(Welded(blocks, "foot_right", "heel_left"), "foot_top", "stem_bottom"), MPI.COMM_WORLD
    )
    system = vc.with_weight(fem.assemble(mesh, SOFT))
    sides = {
        name: Facets(name, np.unique(np.concatenate([tags[part].indices for part in parts])), mesh)
        for name, parts in SIDES.items()
    }
    return system, sides


def surface(system: Any, sides: dict[str, Facets], kind: str) -> Any:
    """Ground and backfill that fit the wall, rigid: contact on all four sides."""
    if kind == "four groups":
        made = fem.joined_surfaces(*(fem.contact_surface(system, side) for side in sides.values()))
    else:
        mesh = sides["base"].mesh
        one = Facets(
            "wall", np.unique(np.concatenate([side.indices for side in sides.values()])), mesh
        )
        made = fem.contact_surface(
            system, one, feature_angle=np.pi if kind == "mean normals" else np.pi / 6
        )
    return made.with_frictionless_corners()


def run(kind: str, shaking: Any, dt: float, t_end: float) -> dict[str, Any]:
    """Histories of thrust, friction work and uplift, and the last displacements, from rest under
    the weight."""
    system, sides = wall()
    problem = vc.ContactProblem(
        system, surface(system, sides, kind), friction=vc.Coulomb(0.3), excitation=shaking
    )
    state = vc.static_equilibrium(problem, solver=vc.Condensed())
    found = vc.simulate(
        problem, dt=dt, t_end=t_end, state=state, record=[vc.Energy(), vc.Contact()], progress=False
    )
    columns = {"force": "contact_force_x", "work": "loss_friction", "uplift": "contact_uplift"}
    histories = {name: found.history[column] for name, column in columns.items()}
    return histories | {"u": problem.cartesian(found.state.u)}


def compare(one: dict[str, Any], other: dict[str, Any]) -> dict[str, float]:
    """Largest difference of each over the largest value."""
    return {
        name: float(np.abs(one[name] - other[name]).max() / np.abs(other[name]).max())
        for name in one
    }


def test_one_group_is_four() -> None:
    """The same motion to 1e-8 with contact, friction and uplift; that of mean normals at the
    corners is another one."""
    shaking = vc.Harmonic(4.0, 2.5, direction=(1.0, 0.3))
    one, four, mean = (
        run(kind, shaking, 4e-3, 0.3) for kind in ("one group", "four groups", "mean normals")
    )
    assert max(compare(one, four).values()) < 1e-8
    assert compare(mean, four)["force"] > 0.1 and four["work"][-1] > 0.0
    assert len(np.unique(four["uplift"])) > 5


def test_el_centro() -> None:
    """0.75 s of the record about its peak."""
    path = RECORDS / "elcentro_1940_ns_peknold.at2"
    if not path.is_file():
        pytest.skip("the record is not beside the checkout")
    record = read_record(path, "g")
    strong = replace(record, acceleration=record.acceleration[80:])
    one, four = (
        run(kind, vc.GroundMotion(strong), 5e-3, 0.75) for kind in ("one group", "four groups")
    )
    assert max(compare(one, four).values()) < 1e-8
    assert four["force"].min() < -2e5 and four["work"][-1] > 0.0
