"""Who gets which cell: equal shares in compact pieces, neighbours as ghosts, the same every
time."""

import numpy as np
import pytest

from vi_contact.meshes.partition import destinations, halve
from vi_contact.meshes.rows import are_among, number_alike

pytestmark = pytest.mark.serial


def strip(n):
    """n unit squares side by side."""
    points = np.array([(x, y) for x in range(n + 1) for y in (0.0, 1.0)])
    return points, np.array([(2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1) for i in range(n)])


@pytest.mark.parametrize("n", [1, 2, 3, 5, 8])
def test_shares_differ_by_one_point_per_halving_at_most(n):
    owner = halve(np.random.default_rng(3).random((1000, 3)), n)
    shares = np.bincount(owner, minlength=n)
    assert shares.sum() == 1000
    assert np.abs(shares - 1000 / n).max() <= np.ceil(np.log2(n))


def test_halves_are_cut_across_the_longest_side():
    x = np.array([(3.0, 0.0), (0.0, 1.0), (2.0, 1.0), (1.0, 0.0)])
    assert halve(x, 2).tolist() == [1, 0, 1, 0]
    assert halve(x, 4).tolist() == [3, 0, 2, 1]
    assert halve(x[:, ::-1], 2).tolist() == [1, 0, 1, 0]


def test_there_may_be_more_ranks_than_points():
    owner = halve(np.array([[0.0], [1.0]]), 5)
    assert len(set(owner)) == 2 and owner.min() >= 0 and owner.max() < 5


def test_a_cell_goes_to_its_owner_first_and_as_a_ghost_to_the_owners_of_its_neighbours():
    ranks, offsets = destinations(*strip(6), "quadrilateral", 3)
    assert [list(part) for part in np.split(ranks, offsets[1:-1])] == [
        [0],
        [0, 1],
        [1, 0],
        [1, 2],
        [2, 1],
        [2],
    ]
    assert ranks.dtype == offsets.dtype == np.int32


def test_a_cell_between_two_others_is_a_ghost_of_both_once():
    ranks, offsets = destinations(*strip(3), "quadrilateral", 3)
    assert [list(part) for part in np.split(ranks, offsets[1:-1])] == [[0, 1], [1, 0, 2], [2, 1]]


def test_one_rank_has_no_ghosts():
    ranks, offsets = destinations(*strip(4), "quadrilateral", 1)
    assert ranks.tolist() == [0] * 4 and offsets.tolist() == [0, 1, 2, 3, 4]


def test_rows_are_alike_whatever_the_order_of_their_members():
    one, other, none = number_alike(
        np.array([[1, 2, 3], [4, 5, 6], [-1, -1, 7]]),
        np.array([[6, 4, 5], [3, 1, 4]]),
        np.empty((0, 3), dtype=int),
    )
    assert one[1] == other[0]
    assert len({*one, *other}) == 4
    assert are_among(one, other).tolist() == [False, True, False]
    assert are_among(other, none).tolist() == [False, False]
    assert are_among(none, one).tolist() == []
