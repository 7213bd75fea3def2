"""How parameters of hidden physics are drawn, so that no set is that of another seed."""

from dataclasses import dataclass

import numpy as np

from rig import COLUMNS, ELEMENTS, RATE_HZ

NEAR = 0.25


@dataclass
class Near:
    """Drawn within a quarter of a value; with a sign of its own, or in whole numbers, where that is asked for.

    `above` is a value at which nothing is hidden: what is above it is drawn within a quarter.
    """

    middle: float
    is_signed: bool = False
    is_whole: bool = False
    above: float = 0.0

    def draw(self, rng):
        value = self.above + (self.middle - self.above) * rng.uniform(1 - NEAR, 1 + NEAR)
        if self.is_signed:
            value *= rng.choice([-1, 1])
        return round(value) if self.is_whole else float(value)


def either_way(middle):
    """A shift, a slope or a turn: drawn within a quarter of a value, to either side."""
    return Near(middle, is_signed=True)


class Aliased(Near):
    """A frequency in Hz beyond the frame rate whose alias is neither at rest nor at the Nyquist frequency."""

    def draw(self, rng):
        while True:
            hz = super().draw(rng)
            if 1.0 < abs(hz - RATE_HZ * round(hz / RATE_HZ)) < 0.5 * RATE_HZ - 1.0:
                return hz


class Seed:
    """Any seed."""

    def draw(self, rng):
        return int(rng.integers(1 << 31))


class Phase:
    """Any phase in rad."""

    def draw(self, rng):
        return float(rng.uniform(0, 2 * np.pi))


class TwoPairs:
    """Two pairs of neighbours in a row, without an element in common."""

    def draw(self, rng):
        firsts = np.flatnonzero(np.arange(ELEMENTS) % COLUMNS < COLUMNS - 1)
        while True:
            one, other = (int(first) for first in rng.choice(firsts, 2, replace=False))
            if abs(one - other) > 1:
                return [[one, one + 1], [other, other + 1]]
