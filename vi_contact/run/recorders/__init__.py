"""Listen to the loop: every recorder of the package stands here, and is a name of ``vc.`` too.

``simulate(…, record=[Energy(), Contact()])`` calls the recorders of its list on all ranks. A
recorder is any object with three methods (``core.step.Recorder`` is the protocol), and one of your
own needs no base class:

1. ``start(problem, state, resumed)`` once, before the first step. It finds what it needs, points
   or parts for example, and returns the row of the first state. ``resumed`` is None, or the last
   row of the run that is continued, from which sums over time go on.
2. ``columns()`` after it, always the same: name -> (unit, meaning). Names consist of letters,
   digits and underscores, and no two recorders of a run share one.
3. ``row(report)`` after every certified step, in order. It returns the row of this step.

A row is name -> value. Numbers are equal on every rank, and go to history.csv and history.h5;
arrays of one shape are those of rank 0, may be empty on other ranks, and go to history.h5 alone.
Displacements and velocities are those of the equations: relative to the ground when an excitation
shakes the body. docs/guide/outputs.md explains each recorder, docs/guide/extend.md one of your own.

A recorder says when it is asked and what its columns are called. What it computes stands below, in
``core.ledger`` (energies), ``fem.output`` (work of nodal forces, cuts, strains) or
``contact_parts`` (parts of the contact), and runs without it.
"""

from ...core.lazy import lazy

__all__, __getattr__, __dir__ = lazy(__name__, __file__)
