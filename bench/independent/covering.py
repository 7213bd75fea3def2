"""Hidden mechanics of the covering: what it makes of the signal u in mm, or of the tool's depth.

Factors of the whole image follow the tool's depth. What an element remembers follows its own signal.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls
from scipy.signal import lfilter

from physics import Hidden
from rig import FINE, HEIGHT_MM, STEP_S, WIDTH_MM

LEAST_DEPTH_MM = 1e-9
FACTOR_MAX = 50


@dataclass
class Ogden(Hidden):
    """Hardening after Ogden, uniaxial: (l^(-a/2 - 1) - l^(a - 1)) / (1.5 a e) with l = 1 - e and e = share depth / thickness."""

    exponent: float
    share: float

    def covering(self, scene, signal_mm):
        strain = np.maximum(self.share * scene.depth_mm / scene.rig.thickness_mm, 1e-6)
        stretch, a = 1 - strain, self.exponent
        factor = (stretch ** (-a / 2 - 1) - stretch ** (a - 1)) / (1.5 * a * strain)
        return signal_mm * factor[:, None]


@dataclass
class FreeEdge(Hidden):
    """Free ends of a beam on an elastic foundation after Hetenyi: 1 - sum over the sides of share exp(-d) cos(d), d in lengths."""

    share: float
    length_mm: float

    def covering(self, scene, signal_mm):
        factor = np.ones(len(scene.t_s))
        for distance_mm in (scene.x_mm, WIDTH_MM - scene.x_mm, scene.y_mm, HEIGHT_MM - scene.y_mm):
            distance = np.maximum(distance_mm, 0) / self.length_mm
            factor -= self.share * np.exp(-distance) * np.cos(distance)
        return signal_mm * factor[:, None]


@dataclass
class PowerLaw(Hidden):
    """Relaxation: superposition after Boltzmann with G(t) = (1 + t / after)^-exponent, as 16 arms of Maxwell; not below 0."""

    exponent: float
    after_s: float

    def covering(self, scene, signal_mm):
        t_s, times_s = np.logspace(-2.5, 3, 300), np.logspace(-2, 3.3, 16)
        arms = np.column_stack([np.exp(-t_s[:, None] / times_s), np.ones_like(t_s)])
        weights, _ = nnls(arms, (1 + t_s / self.after_s) ** -self.exponent)
        weights /= weights.sum()
        relaxed = signal_mm * weights[-1]
        for weight, time_s in zip(weights[:-1], times_s, strict=True):
            if weight > 1e-9:
                relaxed += weight * maxwell(signal_mm, time_s)
        return np.maximum(relaxed, 0)


@dataclass
class StandardLinearSolid(Hidden):
    """Relaxation with one time, by a share of the load; not below 0."""

    share: float
    time_s: float

    def covering(self, scene, signal_mm):
        return np.maximum(0, (1 - self.share) * signal_mm + self.share * maxwell(signal_mm, self.time_s))


@dataclass
class MaxwellSlip(Hidden):
    """Hysteresis: ten parallel elements of Jenkins (Iwan's model) beside a spring, on the tool's depth.

    They yield at lengths spread about 0.06 mm, and carry `total_mm` when all of them slip. A tool that leaves lets them go.
    """

    total_mm: float
    spread: float

    def covering(self, scene, signal_mm):
        yields_mm = 0.06 * np.exp(self.spread * np.linspace(-1.3, 1.3, 10))
        stiffness = self.total_mm / yields_mm.sum() * np.ones(len(yields_mm))
        extension_mm = np.zeros(len(yields_mm))
        steps_mm = np.diff(scene.depth_mm, prepend=0.0)
        friction_mm = np.zeros(len(steps_mm))
        for i in np.flatnonzero(scene.touches):
            if not scene.touches[i - 1]:
                extension_mm[:] = 0
            if steps_mm[i]:
                extension_mm = np.clip(extension_mm + steps_mm[i], -yields_mm, yields_mm)
            friction_mm[i] = stiffness @ extension_mm
        return scaled_to(signal_mm, scene, scene.depth_mm + friction_mm)


@dataclass
class BoucWen(Hidden):
    """Hysteresis after Bouc and Wen with an exponent of 1.5, on the tool's depth: (1 - share) depth + 3 share z, |z| at most `most_mm`."""

    share: float
    most_mm: float

    def covering(self, scene, signal_mm):
        steps_mm = np.diff(scene.depth_mm, prepend=0.0)
        z, memory_mm = 0.0, np.zeros(len(steps_mm))
        for i in np.flatnonzero(scene.touches):
            if not scene.touches[i - 1]:
                z = 0.0
            z += steps_mm[i] * (1 - (0.5 * np.sign(z * steps_mm[i]) + 0.5) * abs(z / self.most_mm) ** 1.5)
            z = min(max(z, -self.most_mm), self.most_mm)
            memory_mm[i] = z
        return scaled_to(signal_mm, scene, (1 - self.share) * scene.depth_mm + self.share * 3 * memory_mm)


@dataclass
class CowperSymonds(Hidden):
    """Stiffer at speed v in mm/s: 1 + share v^(1 / exponent) while the tool goes down. It dies away in a hold."""

    share: float
    exponent: float
    time_s: float

    def covering(self, scene, signal_mm):
        return signal_mm * (1 + overstress(scene, lambda v: self.share * v ** (1 / self.exponent), self.time_s))[:, None]


@dataclass
class Eyring(Hidden):
    """Stiffer at speed v by thermally activated flow: 1 + share asinh(v / speed) while the tool goes down. It dies away in a hold."""

    share: float
    speed_mm_per_s: float
    time_s: float

    def covering(self, scene, signal_mm):
        return signal_mm * (1 + overstress(scene, lambda v: self.share * np.arcsinh(v / self.speed_mm_per_s), self.time_s))[:, None]


@dataclass
class Dent(Hidden):
    """An imprint: a share of the greatest signal of a contact, recovering as exp(-(t / time)^exponent).

    The covering is never less compressed than its dent.
    """

    share: float
    time_s: float
    exponent: float

    def covering(self, scene, signal_mm):
        dents_mm = np.zeros_like(signal_mm)
        for first, end in scene.contacts():
            peak_mm = self.share * signal_mm[first:end].max(0)
            # Nothing is left after five minutes.
            count = min(len(signal_mm) - end, int(300 / STEP_S))
            left = np.exp(-((((np.arange(count) + 1) * STEP_S) / self.time_s) ** self.exponent))
            dents_mm[end : end + count] = np.maximum(dents_mm[end : end + count], peak_mm * left[:, None])
        return np.maximum(signal_mm, dents_mm)


@dataclass
class Damage(Hidden):
    """Softening by the work of all loading so far, W = integral of u du: 1 - most (1 - exp(-W / work)), for each element."""

    most: float
    work_mm2: float

    def covering(self, scene, signal_mm):
        work_mm2 = np.cumsum(signal_mm * np.maximum(0, np.diff(signal_mm, axis=0, prepend=0)), axis=0)
        return signal_mm * (1 - self.most * (1 - np.exp(-work_mm2 / self.work_mm2)))


def maxwell(signal_mm, time_s):
    """What a spring and a dashpot in series carry."""
    return lfilter([1, -1], [1, -np.exp(-STEP_S / time_s)], signal_mm, axis=0)


def scaled_to(signal_mm, scene, depth_mm):
    """The signal of another depth than the tool's."""
    factor = np.where(scene.touches, np.maximum(0, depth_mm) / np.maximum(scene.depth_mm, LEAST_DEPTH_MM), 1)
    return signal_mm * np.minimum(factor, FACTOR_MAX)[:, None]


def overstress(scene, law, time_s):
    """What speed adds, as a share: at least `law` of the speed in mm/s, and it dies away with a time. None is left after a contact."""
    speed = np.maximum(0, np.diff(scene.depth_mm, prepend=0.0) / STEP_S)
    # The stage's steps are no strain rate.
    added = law(np.convolve(speed, np.ones(FINE) / FINE, "same"))
    stress, now, decay = np.zeros(len(added)), 0.0, np.exp(-STEP_S / time_s)
    for i in np.flatnonzero(scene.touches):
        if not scene.touches[i - 1]:
            now = 0.0
        now = max(now * decay, added[i])
        stress[i] = now
    return stress
