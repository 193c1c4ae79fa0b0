"""Find how far a rigid block slides on a plane that is shaken, exactly and in a few passes.

    u'' = w - r sgn(u') while it slides,    u' = 0 stays while |w| <= r

w drives the block and r >= 0 resists, both linear between the samples. While u' > 0 the velocity is
u' = S(t) - S(t_0) with S the integral of w - r, a parabola between samples, and the slide ends when
S is back at S(t_0). The slip is then the integral of S less S(t_0) times the length. Both integrals
are summed up once for all samples, so that a slide costs a search for its end and the root of one
parabola, however long it is. With u' < 0 the same holds for -w.
"""

from dataclasses import dataclass

import numpy as np

from ....core.algebra import Array, Indices, Mask

CHUNK = 32  # CHOSEN: samples in which the end of a slide is looked for first; then twice as many


def slide(t: Array, drive: Array, resist: Array, *, one_sided: bool = False) -> Array:
    """Return the displacement u [m] at times t (n,), from rest.

    Args:
        t: times [s], not decreasing; a time given twice is a jump of what acts.
        drive: w (n,) [m/s²].
        resist: r (n,) >= 0 [m/s²].
        one_sided: whether it never slides back, u' >= 0.
    """
    # Between the times, with those added at which |w| = r, the block begins to slide to one side
    # or to none.
    sides = (1.0,) if one_sided else (1.0, -1.0)
    roots = [_find_roots(t, side * drive - resist) for side in sides]
    times = np.sort(np.concatenate([t, *roots]), kind="stable")
    place = np.searchsorted(times, t, side="left")
    place[1:][np.diff(t) == 0.0] += 1  # the later one of a time given twice
    w = _interpolate(times, t, drive, place)
    r = _interpolate(times, t, resist, place)
    steps = np.diff(times)
    ways = [_Way.integrate(times, steps, side * w - r, side) for side in sides]
    starts = _find_starts(ways)

    # One slide after the other; one that ends where the other side begins goes on at once.
    u = np.zeros(len(times))
    known = 0  # up to here u is known
    slip = 0.0
    k = int(starts[0])
    inside = 0.0  # time after the node k [s]
    while k < len(steps):
        way = next(each for each in ways if each.slides[k])
        u[known + 1 : k + 1] = slip
        end, rest, values, slip = way.follow(k, inside, slip)
        u[k + 1 : end + 1] = values
        known = end
        turns = False
        if end < len(steps):
            turns = any(other.slides[end] for other in ways if other is not way)
        if turns:
            k = end
            inside = rest
        else:
            k = int(starts[min(end + 1, len(steps))])
            inside = 0.0
    u[known + 1 :] = slip
    return np.asarray(u[place])


def _find_roots(t: Array, net: Array) -> Array:
    """Return the times between samples at which a broken line changes its sign."""
    before = net[:-1]
    after = net[1:]
    crosses = (before * after < 0.0) & (np.diff(t) > 0.0)
    share = before[crosses] / (before[crosses] - after[crosses])
    return np.asarray(t[:-1][crosses] + share * np.diff(t)[crosses])


def _interpolate(times: Array, t: Array, values: Array, place: Indices) -> Array:
    """Return a broken line at more times; at its own ones exactly its values.

    Args:
        times: all times [s].
        t: its own.
        values: at these.
        place: where its own ones stand among all.
    """
    dense = np.interp(times, t, values)
    dense[place] = values
    return np.asarray(dense)


@dataclass(frozen=True, eq=False)
class _Way:
    """Slide to one side.

    Attributes:
        side: 1 or -1.
        net: (n,) side times w less r at the nodes [m/s²].
        slides: (n - 1,) whether a block at rest slides, between two nodes.
        times: (n,) [s].
        speed: (n,) S, the integral of net [m/s].
        way: (n,) the integral of S [m].
    """

    side: float
    net: Array
    slides: Mask
    times: Array
    speed: Array
    way: Array

    @classmethod
    def integrate(cls, times: Array, steps: Array, net: Array, side: float) -> "_Way":
        """Integrate.

        Args:
            times: (n,) [s].
            steps: (n - 1,) between them [s].
            net: (n,) side times w less r [m/s²], of one sign between two nodes.
            side: 1 or -1.
        """
        gains = 0.5 * (net[:-1] + net[1:]) * steps
        speed = np.concatenate([[0.0], np.cumsum(gains)])
        parts = speed[:-1] * steps + (2.0 * net[:-1] + net[1:]) * steps**2 / 6.0
        way = np.concatenate([[0.0], np.cumsum(parts)])
        return cls(side, net, gains > 0.0, times, speed, way)

    def follow(self, k: int, inside: float, u: float) -> tuple[int, float, Array, float]:
        """Slide from rest until it rests again.

        Args:
            k: the node at which or after which it begins.
            inside: how long after [s].
            u: where it is [m].

        Returns:
            The node after which it ends, how long after [s], u at the nodes from k + 1 to that one,
            and u at the end.
        """
        start = self.times[k] + inside
        level, way = self._evaluate(k, inside)
        end = self._find_last_above(k + 1, level)
        if end == k:  # it begins a rounding error before the next node
            return k, 0.0, np.zeros(0), u
        nodes = slice(k + 1, end + 1)
        slid = self.way[nodes] - way - level * (self.times[nodes] - start)
        values = u + self.side * slid
        if end == len(self.times) - 1:
            return end, 0.0, values, float(values[-1])
        rest = self._find_fall(end, level)
        _, way_at_end = self._evaluate(end, rest)
        slid = way_at_end - way - level * (self.times[end] + rest - start)
        return end, rest, values, float(u + self.side * slid)

    def _evaluate(self, k: int, inside: float) -> tuple[float, float]:
        """Return S [m/s] and its integral [m] so long after a node [s]."""
        if inside == 0.0:
            return float(self.speed[k]), float(self.way[k])
        slope = self._compute_slope(k)
        net = self.net[k]
        speed = self.speed[k] + inside * (net + 0.5 * slope * inside)
        way = self.way[k] + inside * (self.speed[k] + inside * (0.5 * net + slope * inside / 6.0))
        return float(speed), float(way)

    def _compute_slope(self, k: int) -> float:
        """Return the rate of net after a node [m/s³]."""
        return float((self.net[k + 1] - self.net[k]) / (self.times[k + 1] - self.times[k]))

    def _find_last_above(self, first: int, level: float) -> int:
        """Return the last node before S falls to a level [m/s], at or after ``first``; or the last.

        Between two nodes S only rises or only falls: it is above the level up to there.
        """
        size = CHUNK
        while first < len(self.speed):
            below = self.speed[first : first + size] <= level
            place = int(below.argmax())
            if below[place]:
                return first + place - 1
            first += size
            size *= 2
        return len(self.speed) - 1

    def _find_fall(self, k: int, level: float) -> float:
        """Return how long after a node S has fallen to the level [s]."""
        height = self.speed[k] - level
        net = self.net[k]
        # slope/2 x² + net x + height = 0 with net <= 0: the first root, without cancellation
        root = np.sqrt(max(net**2 - 2.0 * self._compute_slope(k) * height, 0.0))
        whole = self.times[k + 1] - self.times[k]
        if root <= net:
            return float(whole)
        return float(min(2.0 * height / (root - net), whole))


def _find_starts(ways: list[_Way]) -> Indices:
    """Return for each node the first one, from it on, after which a block at rest slides (n,).

    It is the number of the last node where there is none.
    """
    slides = np.logical_or.reduce([way.slides for way in ways])
    count = len(slides)
    own = np.where(slides, np.arange(count), count)
    later = np.minimum.accumulate(own[::-1])[::-1]
    return np.append(later, count)
