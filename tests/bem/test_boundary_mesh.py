"""Boundary meshes: polygons, curves, loose segments; what they refuse."""

from __future__ import annotations

import numpy as np
import pytest

from demos.parts.problems.loose_segments import from_segments
from vi_contact.bem import BoundaryMesh, circle, polygon
from vi_contact.core.errors import InputError

pytestmark = pytest.mark.serial
SQUARE = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]


def test_a_square():
    """Normals point out, tau = (-n_2, n_1), sides are labelled, lengths and area add up."""
    mesh = polygon(SQUARE, 0.2)
    lengths = mesh.node_lengths(np.ones(len(mesh), bool))
    assert (
        len(mesh) == 20 and mesh.area == pytest.approx(1.0) and lengths.sum() == pytest.approx(4.0)
    )
    for side, normal in enumerate([(0, -1), (1, 0), (0, 1), (-1, 0)]):
        assert np.allclose(mesh.normals[mesh.labels == side], normal)
    assert np.allclose(mesh.tangents, np.stack([-mesh.normals[:, 1], mesh.normals[:, 0]], axis=1))
    bottom = mesh.elements_where(lambda x: x[:, 1] < -0.49)
    assert (bottom == (mesh.labels == 0)).all() and mesh.nodes_of(bottom).sum() == 6
    assert np.allclose(mesh.node_lengths(bottom)[:6], [0.1, 0.2, 0.2, 0.2, 0.2, 0.1])
    assert (
        np.allclose(mesh.node_normals(bottom)[:6], (0, -1))
        and (mesh.node_normals(bottom)[6:] == 0).all()
    )


def test_mass_integrates_products():
    """<u, psi> is exact for u = x (continuous) and psi = y on every element."""
    mesh = polygon([(0, 0), (2, 0), (1, 1.5)], (3, 2, 4))
    n = len(mesh)
    u = np.concatenate([mesh.points[:, 0], mesh.points[:, 1]])
    ends = mesh.points[mesh.elements]
    psi = np.stack([ends[:, :, 1], ends[:, :, 0]]).reshape(4 * n)
    x, w = np.polynomial.legendre.leggauss(2)
    places = ends[:, :1] + 0.5 * (x + 1.0)[:, None] * (ends[:, 1:] - ends[:, :1])
    exact = np.sum(2.0 * places[..., 0] * places[..., 1] * 0.5 * w * mesh.lengths[:, None])
    assert psi @ mesh.mass @ u == pytest.approx(exact, rel=1e-13)


def test_loose_segments_with_a_hole():
    """Facets in any order and direction: loops joined, outside counter-clockwise, hole clockwise,
    tags kept."""
    outer = polygon(SQUARE, 0.25)
    points = np.concatenate([outer.points, 0.4 * outer.points])
    segments = np.concatenate([outer.elements, outer.elements + len(outer)])
    tags = np.concatenate([outer.labels, outer.labels + 10])
    random = np.random.default_rng(3)
    order = random.permutation(len(segments))
    segments, tags = segments[order], tags[order]
    turned = random.random(len(segments)) < 0.5
    segments[turned] = segments[turned][:, ::-1]
    mesh = from_segments(np.column_stack([points, np.zeros(len(points))]), segments, labels=tags)
    assert mesh.area == pytest.approx(1.0 - 0.16) and mesh.loop_sizes == (16, 16)
    assert np.allclose(mesh.normals[mesh.labels == 3], (-1, 0)) and np.allclose(
        mesh.normals[mesh.labels == 13], (1, 0)
    )


def test_curves_and_outside():
    """Chords of a circle; the outside of a hole has its normals into the hole."""
    disk, hole = circle(0.5, 40), circle(0.5, 40, exterior=True)
    assert (
        disk.area
        == pytest.approx(-hole.area)
        == pytest.approx(10.0 * 0.5 * np.sin(2 * np.pi / 40) * 0.5 * 2)
    )
    assert ((disk.normals * disk.midpoints).sum(1) > 0).all() and (
        (hole.normals * hole.midpoints).sum(1) < 0
    ).all()
    assert np.allclose(disk.points[0], (0, -0.5))


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        (lambda: polygon(SQUARE[::-1], 0.5), "wrong orientation"),
        (lambda: polygon(SQUARE, 0.5, exterior=True), "wrong orientation"),
        (lambda: from_segments(SQUARE, [(0, 1), (1, 2), (2, 3)]), "open or branches at point 0"),
        (
            lambda: from_segments(SQUARE, [(0, 1), (1, 2), (2, 3), (3, 0), (0, 2)]),
            "branches at point 0",
        ),
        (lambda: BoundaryMesh(np.array([(0, 0), (2, 0), (0, 1), (2, 2.0)])), "cross"),
        (
            lambda: BoundaryMesh(np.array([(0, 0), (1, 0.0)])),
            "at least 3 points for each loop, and 2 for all",
        ),
        (lambda: BoundaryMesh(np.array([(0, 0), (1, 0), (1, 0), (0, 1.0)])), "no length"),
        (lambda: BoundaryMesh(np.array([(0, 0), (1, 0), (np.nan, 1.0)])), "finite"),
        (lambda: BoundaryMesh(np.array(SQUARE), labels=np.zeros(3, int)), "labels has shape"),
        (lambda: polygon([(0, 0), (1, 1), (1, 0), (0, 1)], 0.1), "crosses itself near .* cross"),
        (
            lambda: polygon([(0, 0), (1, 1), (1, 0), (0, 1)], (2, 1, 2, 1)),
            r"crosses or touches itself at \(0\.5, 0\.5\)",
        ),
        (lambda: polygon([(0, 0), (2, 0), (1, 0), (1, 1)], 0.5), "crosses or touches itself"),
        (lambda: polygon([(0, 0), (1, 0), (2, 0)], 0.5), "leaves no area"),
        (lambda: circle(-0.5, 20), "radius is -0.5"),
        (lambda: circle(1e300, 20), "leaves no area to compute with"),
        (lambda: circle(0.5, 10**9), "1e\\+09 elements"),
        (lambda: polygon(SQUARE, 1e-9), "4e\\+09 elements"),
        (
            lambda: from_segments(SQUARE, [(0, 1), (1, 9), (9, 0)]),
            "name the points 0 to 9, there are 4",
        ),
        (lambda: polygon(SQUARE, 0.5).nodes_of([0, 1]), "give a boolean mask"),
        (lambda: polygon(SQUARE, 0.0), "above zero"),
        (lambda: polygon(SQUARE, (1, 2, 3)), "of a side has shape"),
        (
            lambda: from_segments(SQUARE, [(0, 1), (1, 2), (2, 3), (3, 0)], labels=[1]),
            "labels has shape",
        ),
    ],
)
def test_what_is_refused(bad, message):
    with pytest.raises(InputError, match=message):
        bad()
