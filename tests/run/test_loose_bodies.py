"""Bodies that nothing holds and nothing touches: refused where meshes were not merged, warned of
elsewhere."""

from __future__ import annotations

import logging
from typing import Any

import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.algebra import SerialComm
from vi_contact.core.surfaces import empty_surface
from vi_contact.meshes import BlockMesh, TwoBlocks

COMM = MPI.COMM_WORLD
LOWER = BlockMesh(lengths=(1.0, 1.0), divisions=(4, 4))


def stacked(
    *, gap: float = 0.0, contact: bool = False, clamp_both: bool = False
) -> vc.ContactProblem:
    """Two blocks one on the other whose meshes share no node; the ground in front of the lower
    one's left side."""
    mesh, tags = fem.build_mesh(TwoBlocks(lower=LOWER, upper=LOWER, gap=gap), COMM)
    material = vc.LinearElastic(E=1e9, nu=0.2, rho=2000.0)
    clamped = [tags["lower_bottom"]] + [tags["upper_top"]] * clamp_both
    system = fem.assemble(mesh, material, clamped=clamped)
    if contact:
        surface = fem.contact_pair(system, tags["upper_bottom"], tags["lower_top"])
    else:
        ground = vc.HalfSpace(point=(0.0, 0.0), normal=(1.0, 0.0))
        surface = fem.contact_surface(system, tags["lower_left"], obstacle=ground)
    return vc.ContactProblem(system, surface)


def run(problem: vc.ContactProblem) -> Any:
    return vc.simulate(problem, dt=1e-3, steps=2, record=[vc.Contact()], progress=False)


def test_meshes_that_are_not_merged_are_refused() -> None:
    """The 25 nodes of the upper block are around (0.5, 1.5) m, and 5 of them lie at nodes of the
    lower one."""
    with pytest.raises(
        vc.InputError,
        match=r"nothing holds the body of 25 nodes around \(0.5, 1.5\), and no contact "
        r"touches it: 5 of its nodes lie where another body has one",
    ):
        run(stacked())


def test_a_contact_as_the_sentence_offers_it_is_taken() -> None:
    assert run(stacked(contact=True)).facts["status"] == "finished"


def test_a_body_that_is_held_is_taken() -> None:
    assert run(stacked(clamp_both=True)).facts["status"] == "finished"


def test_a_body_that_flies_is_warned_of(caplog: pytest.LogCaptureFixture) -> None:
    """Its nodes lie at no other's, so that it may be meant."""
    with caplog.at_level(logging.WARNING):
        assert run(stacked(gap=0.1)).facts["status"] == "finished"
    if COMM.rank == 0:
        assert "no contact touches it: it moves freely" in caplog.text


@pytest.mark.serial
def test_a_free_mass_is_a_body_of_one_node(caplog: pytest.LogCaptureFixture) -> None:
    """1 kg at the origin that a spring does not hold and that faces nothing."""
    system = vc.system_from_arrays([1.0], None, [[0.0]], coordinates=[[0.0]])
    with caplog.at_level(logging.WARNING):
        list(vc.march(vc.ContactProblem(system, empty_surface(SerialComm(), 1)), dt=1e-3, steps=1))
    assert "nothing holds the body of one node around" in caplog.text
