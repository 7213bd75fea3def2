"""Hidden physics of wires, amplifiers, clocks and the converter: what happens to counts above the baseline."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import bilinear, lfilter

from physics import Hidden
from rig import COLUMNS, ELEMENTS, RATE_HZ, ROWS, STEP_S


@dataclass
class RowLadder(Hidden):
    """Crosstalk of an RC ladder along each row: element i gives share exp(-(|i - j| - 1) / reach) of its counts to j."""

    share: float
    reach_columns: float

    def counts(self, scene, counts):
        column = np.arange(COLUMNS)
        taken = self.share * np.exp(-(np.abs(column[:, None] - column) - 1) / self.reach_columns)
        taken[column, column] = 1
        return (counts.reshape(-1, ROWS, COLUMNS) @ taken.T).reshape(counts.shape)


@dataclass
class MultiplexerMemory(Hidden):
    """Crosstalk of a hold capacitor that keeps a share of the element read before, row by row. It is empty when a frame begins."""

    share: float

    def counts(self, scene, counts):
        return lfilter([1 - self.share], [1, -self.share], counts, axis=1)


@dataclass
class Wires(Hidden):
    """Elements that are swapped, a bridge by which one reads a share of another, and dead elements."""

    bridged: tuple
    share: float
    swapped: tuple = ()
    dead: tuple = ()

    def element(self, scene, signal_mm):
        read = signal_mm.copy()
        if self.swapped:
            one, other = self.swapped
            read[:, one], read[:, other] = signal_mm[:, other], signal_mm[:, one]
        one, other = self.bridged
        read[:, one] = (1 - self.share) * signal_mm[:, one] + self.share * signal_mm[:, other]
        for element in self.dead:
            read[:, element] = 0
        return read


@dataclass
class TanhSaturation(Hidden):
    """top tanh(c / top)."""

    top_counts: float

    def counts(self, scene, counts):
        return self.top_counts * np.tanh(counts / self.top_counts)


@dataclass
class ArctanSaturation(Hidden):
    """(2 top / pi) atan(pi c / (2 top))."""

    top_counts: float

    def counts(self, scene, counts):
        scale = 2 * self.top_counts / np.pi
        return scale * np.arctan(counts / scale)


@dataclass
class WarmUp(Hidden):
    """Drift of the baselines: a warm-up and a cycle of the room. Coefficients of the elements differ by 5 %."""

    warm_up_counts: float
    time_s: float
    cycle_counts: float
    period_s: float
    seed: int

    def readout(self, scene, counts):
        t_s = scene.frame_t_s
        coefficients = 1 + np.random.default_rng(self.seed).normal(0, 0.05, ELEMENTS)
        warm_up = self.warm_up_counts * (1 - np.exp(-t_s / self.time_s))
        drift = warm_up + self.cycle_counts * np.sin(2 * np.pi * t_s / self.period_s)
        return counts + drift[:, None] * coefficients


@dataclass
class Flicker(Hidden):
    """Drift of all baselines alike: the sum of three processes of Ornstein and Uhlenbeck, which is about 1/f noise."""

    rms_counts: float
    seed: int

    def readout(self, scene, counts):
        rng = np.random.default_rng(self.seed)
        frames = len(scene.frame_t_s)
        wander = np.zeros(frames)
        for time_s in (60.0, 200.0, 700.0):
            kept = np.exp(-1 / (RATE_HZ * time_s))
            pushes = rng.normal(0, 1, frames + int(4 * time_s * RATE_HZ))
            wander += lfilter([np.sqrt(1 - kept * kept)], [1, -kept], pushes)[-frames:]
        wander -= wander[0]
        return counts + (self.rms_counts * wander / wander.std())[:, None]


@dataclass
class ReferenceAging(Hidden):
    """Drift of all gains: the reference voltage settles, and follows a cycle of the room. Both as shares of the gain."""

    settling: float
    time_s: float
    cycle: float
    period_s: float

    def readout(self, scene, counts):
        t_s = scene.frame_t_s
        settled = 1 + self.settling * (1 - np.exp(-t_s / self.time_s))
        return counts * (settled + self.cycle * np.sin(2 * np.pi * t_s / self.period_s))[:, None]


@dataclass
class Discharge(Hidden):
    """Drift of all gains by the discharge of a cell: 1 - loss (q / 2 + (e^(knee q) - 1) / (e^knee - 1) / 2), q the share of the time."""

    loss: float
    knee: float

    def readout(self, scene, counts):
        gone = scene.frame_t_s / scene.frame_t_s[-1]
        return counts * (1 - self.loss * (0.5 * gone + 0.5 * (np.exp(self.knee * gone) - 1) / (np.exp(self.knee) - 1)))[:, None]


@dataclass
class SecondOrder(Hidden):
    """A low pass of second order, w^2 / (s^2 + 2 damping w s + w^2)."""

    corner_hz: float
    damping: float

    def counts(self, scene, counts):
        w = 2 * np.pi * self.corner_hz
        numerator, denominator = bilinear([w * w], [1, 2 * self.damping * w, w * w], 1 / STEP_S)
        return lfilter(numerator, denominator, counts, axis=0)


@dataclass
class TwoPoles(Hidden):
    """A low pass of two RC stages."""

    first_s: float
    second_s: float

    def counts(self, scene, counts):
        for time_s in (self.first_s, self.second_s):
            kept = np.exp(-STEP_S / time_s)
            counts = lfilter([1 - kept], [1, -kept], counts, axis=0)
        return counts


@dataclass
class ClockError(Hidden):
    """Frames that are late by a lag and, as the clock runs at another rate, by a share of the time."""

    lag_s: float
    skew: float

    def sample(self, scene, counts):
        read_s = scene.frame_t_s - self.lag_s - self.skew * scene.frame_t_s
        return np.stack([np.interp(read_s, scene.t_s, counts[:, element]) for element in range(ELEMENTS)], axis=1)


@dataclass
class ColumnScan(Hidden):
    """Elements read one after another: column by column, in each row by row. A frame's time is that of its last element."""

    column_s: float
    row_s: float

    def sample(self, scene, counts):
        frames = np.empty((len(scene.frame_t_s), ELEMENTS))
        for element in range(ELEMENTS):
            row, column = divmod(element, COLUMNS)
            lag_s = (COLUMNS - 1 - column) * self.column_s + (ROWS - 1 - row) * self.row_s
            frames[:, element] = np.interp(scene.frame_t_s - lag_s, scene.t_s, counts[:, element])
        return frames


@dataclass
class Switcher(Hidden):
    """Interference of a switching supply, which the frames alias: the first two terms of a square wave, shifted from column to column."""

    amplitude_counts: float
    frequency_hz: float
    column_deg: float
    phase: float

    def readout(self, scene, counts):
        turns = 2 * np.pi * self.frequency_hz * scene.frame_t_s[:, None] + self.phase
        angle = turns + np.deg2rad(self.column_deg) * (np.arange(ELEMENTS) % COLUMNS)
        return counts + self.amplitude_counts * (np.sin(angle) + np.sin(3 * angle) / 3)


@dataclass
class Truncation(Hidden):
    """A converter that goes down to the next whole step."""

    step_counts: int

    def converter(self, scene, counts):
        return self.step_counts * np.floor(np.maximum(counts, 0) / self.step_counts)
