"""Bodies, laws of contact, schemes and solvers meet: each four run certified with a closed ledger,
the same by all solvers, or are refused in a sentence before any step."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem, laws
from vi_contact.core.errors import InputError
from vi_contact.meshes import BlockMesh

pytestmark = pytest.mark.serial
E = 50e6  # Pa
NU = 0.3
RHO = 1900.0  # kg/m³
DT = 2e-3  # s
STEPS = 5  # it flies, lands and rubs
BODIES: dict[str, Any] = {
    "linear": vc.LinearElastic(E, NU, RHO),
    "yields": laws.J2(E, NU, RHO, yield_stress=2e4, isotropic=1e6),
    "turns": laws.NeoHookean(E, NU, RHO),
}
CONTACTS: dict[str, dict[str, Any]] = {
    "smooth": {},
    "Coulomb": {"friction": vc.Coulomb(0.5)},
    "Tresca": {"friction": vc.Tresca(1e3)},
    "Joint": {"joint": laws.Joint(mu=0.5, cohesion=5e3, tension=2e3, opening=1e-3)},
    "SlipWeakening": {"joint": laws.SlipWeakening(static=0.6, kinetic=0.3, distance=1e-3)},
    "RateAndState": {"joint": laws.RateAndState(a=0.01, b=0.015, mu0=0.6, V0=1e-6, dc=1e-4)},
}
SCHEMES: dict[str, Any] = {
    "default": None,
    "Trapezoidal": vc.Trapezoidal(),
    "Midpoint": vc.Midpoint(),
    "ContactStabilisedNewmark": vc.ContactStabilisedNewmark(),
    "ZienkiewiczWoodTaylor": vc.ZienkiewiczWoodTaylor(),
    "MoreauJean": vc.MoreauJean(),
    "SS22": vc.SS22(0.5, 0.5),
    "Newmark": vc.Newmark(0.3025, 0.6),
    "HHT": vc.HHT(-0.1),
    "GeneralisedAlpha": vc.GeneralisedAlpha.spectral_radius(0.8),
    "Houbolt": vc.Houbolt(),
    "EnergyMomentum": vc.EnergyMomentum(),
}
SOLVERS: dict[str, Any] = {
    "Condensed": vc.Condensed(),
    "Volume": vc.Volume(),
    "Iterative": vc.Iterative(),
}
# What must run, so that the table cannot be empty: bodies, and schemes that each must take.
TAKEN = {
    "linear": set(SCHEMES),
    "yields": {"default", "Midpoint", "ZienkiewiczWoodTaylor"},
    "turns": {"default", "EnergyMomentum"},
}
JOINTS = {
    "default",
    "Midpoint",
    "ZienkiewiczWoodTaylor",
    "SS22",
    "EnergyMomentum",
    "ContactStabilisedNewmark",
}


def throw_block(body: str, contact: str) -> vc.ContactProblem:
    """Return a block that flies obliquely on the ground."""
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(0.5, 1.0), divisions=(2, 3)), MPI.COMM_SELF)
    integration = {"integration": "bbar"} if body == "yields" else {}
    system = fem.assemble(
        mesh,
        BODIES[body],
        loads=fem.BodyForce((500.0, -9.81 * RHO)),
        initial_velocity=(0.3, -0.2),
        **integration,
    )
    ground = vc.HalfSpace(point=(0.0, -1e-3), normal=(0.0, 1.0))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=ground)
    return vc.ContactProblem(system, surface, mass=vc.ConsistentMass(), **CONTACTS[contact])


@pytest.mark.long
@pytest.mark.parametrize("contact", CONTACTS)
@pytest.mark.parametrize("body", BODIES)
def test_each_runs_or_is_refused(body: str, contact: str) -> None:
    problem = throw_block(body, contact)
    joins = "joint" in CONTACTS[contact]
    ran = set()
    for name, scheme in SCHEMES.items():
        ends: dict[str, Any] = {}
        for route, solver in SOLVERS.items():
            try:
                run = vc.simulate(
                    problem,
                    scheme=scheme,
                    solver=solver,
                    dt=DT,
                    steps=STEPS,
                    record=[vc.Energy()],
                    progress=False,
                )
            except InputError as error:
                assert len(str(error)) > 40  # a sentence, and no other kind of error
                continue
            assert run.facts["worst_certificate"] < 1e-9, (name, route)
            assert run.facts["energy_defect"] < 1e-9, (name, route)
            ends[route] = run.state.u
        if ends:
            ran.add(name)
            first = ends["Condensed"]  # takes whatever another solver takes
            for route, u in ends.items():
                assert np.abs(u - first).max() <= 1e-7 * np.abs(first).max(), (name, route)
    wanted = TAKEN[body]
    if joins:
        wanted = wanted & JOINTS if body == "linear" else set()
    assert ran >= wanted
