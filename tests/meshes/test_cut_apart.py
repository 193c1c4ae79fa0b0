"""Meshes whose bodies share points, cut apart at all of them."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np
import pytest

from vi_contact.core.errors import InputError
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.cut_apart import CutApart, cut_apart
from vi_contact.meshes.extract import MeshArrays, arrays_from_script
from vi_contact.meshes.rows import number_parts

pytestmark = pytest.mark.serial


def coloured(masks: dict[str, Any], d: int = 2, n: int = 4, simplices: bool = False) -> MeshArrays:
    """A block of n cells a side; groups are where functions of the middles of cells are true."""
    block = BlockMesh(lengths=(1.0,) * d, divisions=(n,) * d, simplices=simplices)
    arrays = arrays_from_script(block)
    middles = arrays.points[arrays.cells].mean(axis=1)
    groups = {name: np.asarray(mask(*middles.T)) for name, mask in masks.items()}
    return MeshArrays(arrays.cell, arrays.points, arrays.cells, groups, arrays.facet_groups)


QUARTERS = {
    "a": lambda x, y, *z: (x < 0.5) & (y < 0.5),
    "b": lambda x, y, *z: (x > 0.5) & (y < 0.5),
    "c": lambda x, y, *z: (x < 0.5) & (y > 0.5),
    "d": lambda x, y, *z: (x > 0.5) & (y > 0.5),
}


def parts_of(arrays: MeshArrays) -> int:
    width = arrays.cells.shape[1] - 1
    first = np.repeat(arrays.cells[:, 0], width)
    return len(set(number_parts(len(arrays.points), first, arrays.cells[:, 1:].ravel())))


@pytest.mark.parametrize("simplices", [False, True])
@pytest.mark.parametrize("d", [2, 3])
def test_quarters_have_nodes_of_their_own(d: int, simplices: bool) -> None:
    """At the crossing, a line of points in space, four copies; on the arms two."""
    n = 4
    arrays = coloured(QUARTERS, d, n, simplices)
    cut = cut_apart(arrays)
    line = (n + 1) ** (d - 2)
    assert len(cut.points) == len(arrays.points) + (4 * n // 2 + 3) * line
    assert parts_of(cut) == 4
    np.testing.assert_array_equal(cut.points[cut.cells], arrays.points[arrays.cells])
    # the boundary keeps its facets, now of the bodies beside them
    for name, facets in arrays.facet_groups.items():
        assert len(cut.facet_groups[name]) == len(facets)
        assert set(facets.ravel()) <= set(arrays.facet_groups[name].ravel())


def test_what_is_kept_stays_together() -> None:
    cut = cut_apart(coloured(QUARTERS), keep=[("b", "a"), ("c", "d")])
    assert parts_of(cut) == 2
    whole = cut_apart(coloured(QUARTERS), keep=[("a", "b"), ("b", "d")])
    assert parts_of(whole) == 2


def test_cells_of_no_group_are_a_body() -> None:
    arrays = coloured({"a": QUARTERS["a"]})
    assert parts_of(cut_apart(arrays)) == 2


def test_a_body_that_meets_itself_at_a_point_is_parted_there() -> None:
    """Opposite quarters are one group: at the crossing it hangs together by no facet."""
    masks = {
        "ab": lambda x, y: (x < 0.5) == (y < 0.5),
        "rest": lambda x, y: (x < 0.5) != (y < 0.5),
    }
    assert parts_of(cut_apart(coloured(masks))) == 4


def test_inner_facets_of_groups_are_doubled() -> None:
    arrays = coloured(QUARTERS)
    on = np.flatnonzero(np.abs(arrays.points[:, 0] - 0.5) < 1e-12)
    order = on[np.argsort(arrays.points[on, 1])]
    joint = np.column_stack([order[:-1], order[1:]])
    arrays = MeshArrays(
        arrays.cell,
        arrays.points,
        arrays.cells,
        arrays.cell_groups,
        {**arrays.facet_groups, "joint": joint},
    )
    cut = cut_apart(arrays)
    assert len(cut.facet_groups["joint"]) == 2 * len(joint)
    np.testing.assert_allclose(cut.points[cut.facet_groups["joint"]][:, :, 0], 0.5)


def test_the_log_says_where(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO):
        cut_apart(coloured(QUARTERS), keep=[("a", "b")])
    assert "'a' and 'c' at 3 points, the first at (0, 0.5)" in caplog.text
    assert "'a' and 'd' at 1 point, the first at (0.5, 0.5)" in caplog.text
    assert "'a' and 'b'" not in caplog.text


def test_the_mesh_is_a_script() -> None:
    pytest.importorskip("gmsh")
    script = CutApart(BlockMesh(divisions=(2, 2)), bodies=("block",))
    with pytest.raises(InputError, match="the bodies share no point, so that nothing is there"):
        arrays_from_script(script)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"bodies": ["a", "e"]}, "mesh has no cell group 'e'; it has a, b, c, d"),
        ({"keep": [("a", "e")]}, "keep has .'a', 'e'.; give pairs of two of the bodies a, b, c, d"),
        ({"keep": ["ab"]}, "keep has 'ab'; give pairs"),
        ({"keep": 3}, "keep is 3; give pairs such as"),
    ],
)
def test_wrong_groups_are_refused(given: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        cut_apart(coloured(QUARTERS), **given)
    masks = {"a": QUARTERS["a"], "both": lambda x, y: y < 0.5}
    with pytest.raises(InputError, match="'a' and 'both' have common cells"):
        cut_apart(coloured(masks))
