"""The building on a raft: two bodies of their own, volumes and faces as given, opposite sides of
the soil alike."""

import numpy as np
import pytest

from meshes.raft import RaftMesh
from vi_contact.core.errors import InputError
from vi_contact.meshes.extract import arrays_from_script

gmsh = pytest.importorskip("gmsh")
pytestmark = pytest.mark.serial
COARSE = RaftMesh(size=2.0, soil_size=3.0, far=9.0)


@pytest.fixture(scope="module")
def arrays():
    return arrays_from_script(COARSE)


def volumes(arrays, name):
    x = arrays.points[arrays.cells[arrays.cell_groups[name]]]
    return np.abs(np.linalg.det(x[:, 1:] - x[:, :1])).sum() / 6.0


def area(arrays, name):
    x = arrays.points[arrays.facet_groups[name]]
    return 0.5 * np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1).sum()


def test_two_bodies_fill_what_was_asked_for_without_a_common_node(arrays):
    """Volumes by hand: raft, walls between the slabs, three slabs; areas of the faces; the
    building's on top."""
    walls = (8.0 * 6.0 - 6.4 * 4.4) * 3 * (4.0 - 0.6)
    assert volumes(arrays, "building") == pytest.approx(
        12.0 * 9.0 * (1.5 + 3 * 0.6) + walls, rel=1e-12
    )
    assert volumes(arrays, "soil") == pytest.approx(42.0 * 36.0 * 12.0, rel=1e-12)
    own, others = (
        np.unique(arrays.cells[arrays.cell_groups[name]]) for name in ("building", "soil")
    )
    assert not np.isin(own, others).any() and len(own) + len(others) == len(arrays.points)
    assert arrays.points[own][:, 2].min() == 0.0 and arrays.points[others][:, 2].max() == 0.0
    areas = {
        "raft_bottom": 108.0,
        "roof": 108.0,
        "soil_foot": 18.0 * 15.0,
        "soil_surface": 42.0 * 36.0 - 18.0 * 15.0,
        "soil_bottom": 42.0 * 36.0,
        "soil_left": 36.0 * 12.0,
        "soil_right": 36.0 * 12.0,
        "soil_back": 42.0 * 12.0,
        "soil_front": 42.0 * 12.0,
    }
    assert {name: area(arrays, name) for name in arrays.facet_groups} == pytest.approx(
        areas, rel=1e-12
    )


@pytest.mark.parametrize(("one", "other", "axis"), [("left", "right", 0), ("back", "front", 1)])
def test_opposite_sides_of_the_soil_are_divided_alike(arrays, one, other, axis):
    """Every node of a side has its partner across the soil."""
    first, second = (
        arrays.points[np.unique(arrays.facet_groups[f"soil_{name}"])] for name in (one, other)
    )
    first[:, axis] += COARSE.soil[axis]
    apart = np.linalg.norm(first[:, None] - second[None], axis=2)
    assert len(first) == len(second) and apart.min(axis=1).max() < 1e-9


def test_the_faces_that_meet_do_not_match(arrays):
    """Different sizes on both sides: away from the corners hardly a node of the raft lies on one of
    the soil."""
    raft, soil = (
        arrays.points[np.unique(arrays.facet_groups[name])] for name in ("raft_bottom", "soil_foot")
    )
    apart = np.linalg.norm(raft[:, None] - soil[None], axis=2).min(axis=1)
    assert len(raft) > 40 and (apart < 1e-6).sum() <= 2


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"raft": (12.0, 9.0)}, "raft has shape"),
        ({"core": (4.0, 0.0, 6.0, 5.0)}, "the raft under all of it"),
        ({"wall": 3.0}, "room inside"),
        ({"storeys": (0.5,)}, "storeys higher than their slabs"),
        ({"storeys": ()}, "storeys higher"),
        ({"soil": (15.0, 36.0, 12.0)}, "two cells of 0.8 m"),
        ({"size": 0.0}, "above zero"),
        ({"size": 1e-3}, "ask for fewer"),
        ({"far": float("nan")}, "far"),
    ],
)
def test_what_is_no_building_is_refused_in_a_sentence(wrong, says):
    with pytest.raises(InputError, match=says):
        RaftMesh(**wrong)
