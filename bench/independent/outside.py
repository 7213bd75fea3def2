"""Hidden physics that no effect of the library describes."""

from dataclasses import dataclass

import numpy as np

from image import gauss_image, spread_image, unique_rows
from physics import Hidden
from rig import ELEMENTS, STEP_S, X_MM, Y_MM


@dataclass
class Droop(Hidden):
    """A supply that drops out above a total load: c / (1 + slope max(0, sum of c / load - 1))."""

    load_counts: float
    slope: float

    def counts(self, scene, counts):
        return counts / (1 + self.slope * np.maximum(0, counts.sum(1, keepdims=True) / self.load_counts - 1))


@dataclass
class ClosingGap(Hidden):
    """An air gap under each element: u^3 / (u^2 + gap^2). The gaps have a lognormal distribution."""

    gap_mm: float
    seed: int

    def element(self, scene, signal_mm):
        gaps_mm = self.gap_mm * np.exp(np.random.default_rng(self.seed).normal(0, 0.4, ELEMENTS))
        return signal_mm**3 / (signal_mm**2 + gaps_mm**2 + 1e-12)


@dataclass
class GainHum(Hidden):
    """A gain that follows a hum with a beat: 1 + share sin(2 pi f t) (1 + sin(2 pi t / beat) / 2)."""

    share: float
    frequency_hz: float
    beat_s: float

    def readout(self, scene, counts):
        t_s = scene.frame_t_s
        hum = self.share * np.sin(2 * np.pi * self.frequency_hz * t_s)
        return counts * (1 + hum * (1 + 0.5 * np.sin(2 * np.pi * t_s / self.beat_s)))[:, None]


@dataclass
class ContactCharge(Hidden):
    """Contact electrification: a tool that leaves charges the covering about its place, which pulls readings down.

    The charge grows with the deepest point as 1 - exp(-depth / 0.3 mm) and leaks away, also during later presses.
    """

    charge_counts: float
    time_s: float
    width_mm: float

    def counts(self, scene, counts):
        charged = counts.copy()
        for first, end in scene.contacts():
            dose = self.charge_counts * (1 - np.exp(-scene.depth_mm[first:end].max() / 0.3))
            square_mm2 = (X_MM - scene.x_mm[end - 1]) ** 2 + (Y_MM - scene.y_mm[end - 1]) ** 2
            around = np.exp(-square_mm2 / (2 * self.width_mm**2))
            count = min(len(counts) - end, int(8 * self.time_s / STEP_S))
            charged[end : end + count] -= (dose * np.exp(-np.arange(count) * STEP_S / self.time_s))[:, None] * around
        return charged


@dataclass
class Proximity(Hidden):
    """A grounded tool in the fringing field: counts exp(-height / reach) / (1 + r^2 / width^2)^1.5, constant in contact."""

    most_counts: float
    reach_mm: float
    width_mm: float

    def counts(self, scene, counts):
        near = self.most_counts * np.exp(-np.maximum(0, -scene.raw_mm) / self.reach_mm)
        square_mm2 = (X_MM[None, :] - scene.x_mm[:, None]) ** 2 + (Y_MM[None, :] - scene.y_mm[:, None]) ** 2
        return counts + near[:, None] / (1 + square_mm2 / self.width_mm**2) ** 1.5


@dataclass
class Adhesion(Hidden):
    """A leaving tool pulls the covering up with it, by a share of its height, until it is so far above the surface."""

    reach_mm: float
    share: float

    def image(self, scene):
        signal = spread_image(scene)
        sticks = np.zeros(len(scene.t_s), bool)
        for _, end in scene.contacts():
            for i in range(end, len(scene.t_s)):
                if scene.raw_mm[i] > 0 or -scene.raw_mm[i] >= self.reach_mm:
                    break
                sticks[i] = True
        pulled = np.flatnonzero(sticks)
        x, y = scene.x_mm[pulled], scene.y_mm[pulled]
        first, group = unique_rows(x, y)
        image = gauss_image(x[first], y[first], scene.nodes, scene.rig.sigma_mm) / scene.reference
        signal[pulled] += self.share * scene.raw_mm[pulled][:, None] * image[group]
        return signal
