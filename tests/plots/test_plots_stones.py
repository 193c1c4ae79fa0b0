"""Pictures of joints and of mechanisms: what they show is what was found."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")
pytest.importorskip("matplotlib")

from mpi4py import MPI
from pictures import is_drawn

import vi_contact as vc
from vi_contact import fem, meshes, plots
from vi_contact.core.errors import InputError
from vi_contact.practice.plots import stones

pytestmark = pytest.mark.serial


def joints_of(mesh: Any) -> fem.Joints:
    built, tags = fem.build_mesh(mesh, MPI.COMM_SELF)
    return fem.find_joints(built, tags=tags)


def test_joints_are_drawn_with_their_numbers(tmp_path: Path) -> None:
    joints = joints_of(meshes.MasonryMesh(stones=2, courses=2, ground=0.2))
    assert is_drawn(plots.plot_joints(joints, tmp_path / "joints.png"))
    (axis,) = stones._draw_in_plane(joints).axes
    assert [text.get_text() for text in axis.texts] == [str(n + 1) for n in range(len(joints))]
    lines = [line.get_xydata() for line in axis.lines]
    np.testing.assert_allclose(lines, [joint.ends for joint in joints])
    assert axis.get_xlabel() == "x [m]"
    # one polygon a body, that of its outline
    (bodies,) = axis.collections
    assert len(bodies.get_paths()) == len(joints.names)


def test_joints_in_space_are_drawn(tmp_path: Path) -> None:
    joints = joints_of(
        meshes.BricksMesh(
            counts=(2, 2, 1), lengths=(0.1,) * 3, gaps=(0.0,) * 3, divisions=(1, 1, 1)
        )
    )
    assert len(joints.corners)
    assert is_drawn(plots.plot_joints(joints, tmp_path / "joints.png"))


def test_a_mechanism_is_drawn_where_it_moves(tmp_path: Path) -> None:
    """A stack that topples turns about its right foot; sides of joints stay on blocks."""
    mesh = meshes.BricksMesh(counts=(1, 3), gaps=(0.0, 0.0), table=0.1, overhang=0.1)
    joints = joints_of(mesh)
    limit = vc.rigid_limit_load(vc.rigid_blocks(joints, fixed=["ground"]), mu=0.9)
    assert is_drawn(plots.plot_mechanism(limit, tmp_path / "mechanism.png"))
    foot = np.array([[[0.1, 0.0], [0.1, 0.0]]])
    moved = stones._move(limit, foot, np.array([0]), 0.1)
    np.testing.assert_allclose(moved, foot, atol=1e-12)
    top = np.array([[[0.0, 0.6], [0.1, 0.6]]])
    assert np.all(stones._move(limit, top, np.array([2]), 0.1)[:, :, 0] > top[:, :, 0])
    ground = np.array([[[0.0, 0.0], [0.1, 0.0]]])
    np.testing.assert_array_equal(stones._move(limit, ground, np.array([-1]), 0.1), ground)
    ((_, _, opens), (_, _, slides)) = stones._sort_joints(limit)
    assert len(opens) == 1
    assert not len(slides)


def test_what_cannot_be_drawn_is_refused(tmp_path: Path) -> None:
    mesh = meshes.BricksMesh(counts=(1, 1), table=0.1)
    blocks = vc.rigid_blocks(joints_of(mesh), fixed=["ground"])
    without = vc.rigid_limit_load(blocks, mu=0.3, live=(0.0, -1.0))
    with pytest.raises(InputError, match="there is no mechanism"):
        plots.plot_mechanism(without, tmp_path / "a.png")
    with pytest.raises(InputError, match="give fem.find_joints"):
        plots.plot_joints([], tmp_path / "a.png")
    limit = vc.rigid_limit_load(blocks, mu=0.3)
    with pytest.raises(InputError, match="size is 0.0; give a finite number above zero"):
        plots.plot_mechanism(limit, tmp_path / "a.png", size=0.0)
