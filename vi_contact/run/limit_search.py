"""Seek where equilibrium is lost on a path of load steps, by halving the step.

Each step begins with the last state that was reached. Where a step fails it is taken again, half as
long. So the value that is lost in the end was tried from the last state itself, and not from one
that lies far back: with friction and with yielding the equilibrium depends on the way to it.
"""

from collections.abc import Callable
from dataclasses import dataclass

from ..core.errors import NoEquilibrium, StepFailure
from ..core.step import State

# Return the equilibrium at a value of the load, from the state before; raise where there is none.
Reach = Callable[[State, float], State]


@dataclass(frozen=True, eq=False)
class LoadPath:
    """Hold a path of equilibria up to where no further one was found.

    Attributes:
        values: of the load, increasing, one for each state.
        states: the equilibria.
        lost: the least value tried above the last one at which no equilibrium was found.
        reason: the sentence of the last attempt.
        proven: whether that attempt found a motion that the loads drive and nothing stops. Without
            it no answer had a certificate, which may also be the solver's fault.
    """

    values: tuple[float, ...]
    states: tuple[State, ...]
    lost: float
    reason: str
    proven: bool


def seek_limit(
    reach: Reach, start: State, *, value: float, first: float, rtol: float, most: int
) -> LoadPath:
    """March load steps until equilibrium is lost, and halve the step there.

    It ends when the value that is lost is within rtol of the last one that was reached. Any load
    that one number governs may be sought in this way: ``reach`` says what the number means.

    Args:
        reach: returns the equilibrium at a value from the state before, or raises.
        start: the equilibrium from which the path starts.
        value: of the load there.
        first: size of the first step, above zero.
        rtol: width of the bracket over the value that is lost; where nothing is reached, over the
            first step.
        most: steps, at most, that are taken at their full first size.

    Returns:
        the path, with the start as its first state.

    Raises:
        StepFailure: equilibrium is never lost within ``most`` steps.
        InputError: of ``reach``, for other reasons than a lack of equilibrium.
    """
    values = [value]
    states = [start]
    size = first
    lost = None
    while True:
        aim = values[-1] + size
        try:
            state = reach(states[-1], aim)
        except (NoEquilibrium, StepFailure) as failure:
            lost = (aim, str(failure), isinstance(failure, NoEquilibrium))
            # what was lost far below the first step is no load at all
            if size <= rtol * max(abs(aim), first):
                return LoadPath(tuple(values), tuple(states), *lost)
            size *= 0.5
            continue
        values.append(aim)
        states.append(state)
        if lost is None and len(values) > most:
            raise StepFailure(
                f"{most} load steps up to {aim:g} have equilibrium: give a larger first=, or a "
                "load that some motion without deformation follows"
            )
