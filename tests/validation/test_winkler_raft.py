"""V2.10: a stiff raft on Winkler's springs, in space: closed forms of pressure, settlement and
rotation, with uplift.

On springs of modulus k [Pa/m] under a rigid raft B x L the pressure is linear, and only pushes. A
load P at x = e:

    e <= B/6:  p = P/(B L) (1 + 12 e x/B²),  settlement P/(k B L),  rotation 12 P e/(k L B³)
    e >= B/6:  a triangle over the length a = 3 (B/2 - e), p_max = 2 P/(L a),  rotation p_max/(k a)

A load at a/4, b/4 from a corner along both sides leaves a triangle a x b of that corner closed,
p_max = 6 P/(a b). Springs stand at the nodes, so that on n cells p is the closed form to O(1/n²),
and for e <= B/6 the largest error is known: Σ w x² = (B³ L/12) (1 + 2/n²) stands for the moment of
inertia. The raft is a free block of finite elements that springs alone hold. Under its load as a
beam on two ends it would sag by (60/384) k B⁴/(E H³) = 1e-4 of its settlement; the springs oppose
the load where it acts, so that it bends by less than a hundredth of that while all of it is
pressed, and by a twentieth when it is lifted off.
"""

import numpy as np
import pytest
from mpi4py import MPI

from vi_contact import ContactProblem, LinearElastic, Touching, fem, static_equilibrium
from vi_contact.meshes.block import BlockMesh

B, L, H, K, P = 12.0, 9.0, 4.0, 2.0e7, 1.2e7  # m, Pa/m, N
RAFT = LinearElastic(E=1.0e13, nu=0.0, rho=1.0)
# of a beam with this load, over its settlement on springs
SAG = 60.0 / 384.0 * K * B**4 / (RAFT.E * H**3)


class Standing:
    """The equilibrium under P at (x, z) = load on n x m cells: x (k, 2), weights, pressures and
    displacements down."""

    def __init__(self, n, m, load):
        mesh, tags = fem.build_mesh(
            BlockMesh(lengths=(B, H, L), divisions=(n, 1, m), corner=(-0.5 * B, 0.0, -0.5 * L)),
            MPI.COMM_WORLD,
        )

        def pressed(points, t):
            tilted = (
                1.0 + 12.0 * load[0] * points[:, 0] / B**2 + 12.0 * load[1] * points[:, 2] / L**2
            )
            return np.outer(tilted, [0.0, -P / (B * L), 0.0])

        system = fem.assemble(mesh, RAFT, loads=fem.Traction(tags["top"], pressed))
        surface = fem.contact_surface(system, tags["bottom"], obstacle=Touching()).on_springs(K)
        state = static_equilibrium(ContactProblem(system, surface))
        down = surface.normal_values(state.u)
        points, self.weights, forces, self.down = map(
            surface.everywhere, (surface.points, surface.weights, state.r_n, down)
        )
        self.x, self.pressure = points[:, [0, 2]], forces / self.weights
        assert forces.sum() == pytest.approx(P, rel=1e-9)
        assert (forces @ self.x / P)[[0, 1]] == pytest.approx(load, abs=1e-9 * B)

    @property
    def plane(self):
        """Settlement of the middle, rotations along x and z: the plane through the
        displacements."""
        A = np.column_stack([np.ones(len(self.x)), self.x])
        found = np.linalg.lstsq(A, self.down, rcond=None)[0]
        assert np.abs(A @ found - self.down).max() < 0.2 * SAG * np.abs(self.down).max()
        return found


def test_v2_10_whole_raft_pressed_off_its_middle():
    """Both ways at once, inside the kern: the closed form on springs at nodes to what the raft
    bends."""
    n, m, load = 6, 4, (1.0, 0.6)
    found = Standing(n, m, load)
    whole = np.array([B**3 * L * (1.0 + 2.0 / n**2), L**3 * B * (1.0 + 2.0 / m**2)]) / 12.0
    turn = P * np.array(load) / whole
    assert found.pressure == pytest.approx(P / (B * L) + found.x @ turn, rel=0.02 * SAG)
    assert found.plane == pytest.approx([P / (K * B * L), *(turn / K)], rel=0.02 * SAG)
    assert found.down == pytest.approx(found.pressure / K, rel=1e-9)


@pytest.mark.parametrize("e", [2.0, 3.5])
def test_v2_10_raft_that_lifts_off(e):
    """At the edge of the kern and beyond: the triangle, its length and the rotation, with order 2
    in the springs."""
    a = 3.0 * (0.5 * B - e)
    largest = 2.0 * P / (L * a)
    errors = []
    for n in (12, 48):
        found = Standing(n, 1, (e, 0.0))
        exact = largest * np.maximum(1.0 - (0.5 * B - found.x[:, 0]) / a, 0.0)
        settlement, rotation, across = found.plane
        assert abs(across) < 1e-11 * rotation
        closed = 0.5 * B + settlement / rotation
        errors.append(
            [
                np.abs(found.pressure - exact).max() / largest,
                abs(rotation * K * a / largest - 1.0),
                abs(closed / a - 1.0),
            ]
        )
    assert np.all(errors[1] < np.array([3.3e-3, 6.6e-3, 4e-3]))
    # 16, but for where the end of contact lies between two nodes
    assert np.all(np.divide(*errors) > 5.0)


def test_v2_10_raft_that_stands_on_a_corner():
    """Off its middle both ways: a pyramid over the triangle of a corner, with about order 2 in the
    springs."""
    a, b = 8.0, 6.0
    largest, errors = 6.0 * P / (a * b), []
    for n in (8, 16):
        found = Standing(n, n, (0.5 * B - 0.25 * a, 0.5 * L - 0.25 * b))
        share = (0.5 * np.array([B, L]) - found.x) / [a, b]
        exact = largest * np.maximum(1.0 - share.sum(axis=1), 0.0)
        errors.append(np.abs(found.pressure - exact).max() / largest)
    assert errors[1] < 0.08 and errors[0] > 2.0 * errors[1]
