"""Solve the three problems with this project, as its guides say."""

from typing import Any

import dolfinx
import numpy as np
import problems
from mpi4py import MPI
from problems import BAR, SIGNORINI, THROWN

import vi_contact as vc
from vi_contact import fem

# Names are imported when they are first asked for, and the time of a row is without imports.
IMPORTED = (
    *(vc.LinearElastic, vc.PlaneStrain, vc.HalfSpace, vc.ContactProblem, vc.Condensed),
    *(vc.ContactStabilisedNewmark, vc.Energy, vc.Contact),
    *(vc.simulate, vc.static_equilibrium),
    *(fem.Facets, fem.Traction, fem.Prescribed, fem.BodyForce),
    *(fem.assemble, fem.contact_surface, fem.as_function),
)

TITLE = "vi_contact"
INSTALL = {"system": []}
WAYS = {
    "signorini": {
        "best": (
            "static_equilibrium with the solver Condensed(): the unknowns of the contact "
            "alone, by active sets"
        ),
        "default": "static_equilibrium, no option",
    },
    "thrown": {
        "best": (
            "simulate, no option (the default): trapezoidal rule, mass redistributed, as the "
            "guide advises here"
        ),
        "never "
        "gains": "ContactStabilisedNewmark, which the guide names for energy that must never grow",
    },
    "bar": {
        "best": (
            "simulate, no option (the default): trapezoidal rule, mass redistributed, as the "
            "guide advises here"
        ),
        "never "
        "gains": "ContactStabilisedNewmark, which the guide names for energy that must never grow",
    },
}
STOPS = {
    "signorini": {"best": "certificate below 1e-9", "default": "certificate below 1e-9"},
    "thrown": {"best": "certificate below 1e-9", "never gains": "certificate below 1e-9"},
    "bar": {"best": "certificate below 1e-9", "never gains": "certificate below 1e-9"},
}


def version() -> str:
    """Return the versions of this package and of DOLFINx below it."""
    return f"{vc.__version__}, DOLFINx {dolfinx.__version__}"


def signorini(n: int, way: str) -> dict[str, Any]:
    """Solve the static square; the best way condenses it to the contact points."""
    mesh = dolfinx.mesh.create_unit_square(MPI.COMM_WORLD, n, n)
    foot = fem.Facets.where("foot", mesh, lambda x: np.isclose(x[1], 0.0))
    top = fem.Facets.where("top", mesh, lambda x: np.isclose(x[1], 1.0))
    left = fem.Facets.where("left", mesh, lambda x: np.isclose(x[0], 0.0))
    pull = fem.Traction(
        top, lambda x, t: np.stack([0.0 * x[:, 0], problems.traction(x[:, 0])], axis=1)
    )
    system = fem.assemble(
        mesh,
        vc.LinearElastic(E=SIGNORINI["E"], nu=SIGNORINI["nu"], rho=1.0),
        section=vc.PlaneStrain(),
        prescribed=fem.Prescribed(left, components=(0,)),
        loads=pull,
    )
    problem = vc.ContactProblem(system, fem.contact_surface(system, foot))
    state = vc.static_equilibrium(problem, solver=vc.Condensed() if way == "best" else None)
    u = fem.as_function(problem, state, "u")
    order = np.lexsort(np.rint(n * u.function_space.tabulate_dof_coordinates()[:, :2]).T)
    return {
        "u": u.x.array.reshape(-1, 2)[order],
        "r": state.r_n[np.argsort(problem.surface.points[:, 0])],
    }


def thrown(way: str) -> dict[str, Any]:
    """Throw the square at a half-space, and return its four histories."""
    mesh = dolfinx.mesh.create_unit_square(MPI.COMM_WORLD, THROWN["n"], THROWN["n"])
    foot = fem.Facets.where("foot", mesh, lambda x: np.isclose(x[1], 0.0))
    system = fem.assemble(
        mesh,
        vc.LinearElastic(E=THROWN["E"], nu=THROWN["nu"], rho=THROWN["rho"]),
        section=vc.PlaneStrain(),
        initial_velocity=(0.0, -THROWN["speed"]),
    )
    ground = vc.HalfSpace(point=(0.0, -THROWN["gap"]), normal=(0.0, 1.0))
    problem = vc.ContactProblem(system, fem.contact_surface(system, foot, obstacle=ground))
    found = run(problem, way, THROWN["dt"], THROWN["steps"])
    return {key: found[key] for key in ("t", "force", "gap", "energy")}


def bar(way: str) -> dict[str, Any]:
    """Drop the bar in one dimension; its energy counts from the bar on the ground."""
    mesh = dolfinx.mesh.create_interval(MPI.COMM_WORLD, BAR["elements"], [0.0, BAR["length"]])
    foot = fem.Facets.where("foot", mesh, lambda x: np.isclose(x[0], 0.0))
    pull = -BAR["rho"] * BAR["gravity"]
    system = fem.assemble(
        mesh, vc.LinearElastic(E=BAR["E"], nu=0.0, rho=BAR["rho"]), loads=fem.BodyForce((pull,))
    )
    ground = vc.HalfSpace(point=(-BAR["height"],), normal=(1.0,))
    problem = vc.ContactProblem(system, fem.contact_surface(system, foot, obstacle=ground))
    found = run(problem, way, BAR["dt"], BAR["steps"])
    u = system.space.expand(found.pop("state").u, 0.0)
    along = u[np.argsort(system.space.points[:, 0]), 0]
    start = BAR["rho"] * BAR["gravity"] * BAR["length"] * BAR["height"]
    return found | {
        "u": along,
        "foot": found.pop("gap"),
        "energy": found["energy"] - found.pop("work") + start,
    }


def run(problem: Any, way: str, dt: float, steps: int) -> dict[str, Any]:
    """Return the histories of a run and its end."""
    choice = {"scheme": vc.ContactStabilisedNewmark()} if way == "never gains" else {}
    record = [vc.Energy(), vc.Contact(arrays=False)]
    solution = vc.simulate(problem, dt=dt, steps=steps, record=record, progress=False, **choice)
    told = {key: np.asarray(values)[1:] for key, values in solution.history.items()}
    return {
        "t": told["t"],
        "force": told["contact_resultant"],
        "gap": told["contact_min_gap"],
        "energy": told["energy_kinetic"] + told["energy_strain"],
        "work": told["work_input"],
        "state": solution.state,
    }


if __name__ == "__main__":
    problems.main(globals())
