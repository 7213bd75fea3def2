"""From the tool's way to counts: the paper's physics, and the stages at which hidden physics may act.

The signal u of an element, in mm, is its integral of the penetration spread by a Gaussian, over what it reads of the same tool 1 mm deep
at its own centre. Counts above the baseline are g (u + k u |u|) with the element's gain g in counts per mm and the rig's k in 1/mm. Then
come the baseline, the noise, the ends of the converter's range and rounding.
"""

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from image import disc, reference, spread_image
from rig import ELEMENTS, FINE, FULL_SCALE_COUNTS, RATE_HZ, Rig

AR1_SHARE = 0.5


class Hidden:
    """Hidden physics: a method for each stage. This one does nothing.

    The stages run in the order of the methods, all but the last three on the fine grid of times.
    """

    def motion(self, x_mm, y_mm, z_mm):
        """Where the tool is; robot's frame."""
        return x_mm, y_mm, z_mm

    def place(self, x_mm, y_mm):
        """Where the tool is; sensor's frame."""
        return x_mm, y_mm

    def height(self, x_mm, y_mm, raw_mm):
        """Depth below the surface, negative above it."""
        return raw_mm

    def image(self, scene):
        """The signal in mm, or None for that of the paper."""
        return None

    def covering(self, scene, signal_mm):
        """What the covering makes of the signal."""
        return signal_mm

    def element(self, scene, signal_mm):
        """What the elements make of the signal."""
        return signal_mm

    def counts(self, scene, counts):
        """Counts above the baseline, on the fine grid."""
        return counts

    def sample(self, scene, counts):
        """Takes the frames from the fine grid."""
        return counts[::FINE]

    def readout(self, scene, counts):
        """Counts above the baseline, of the frames."""
        return counts

    def converter(self, scene, counts):
        """What the converter gives for counts with baseline and noise."""
        return counts


class Both(Hidden):
    """Several hidden physics, one after another at each stage. At most one may replace the image, and one the sampling."""

    def __init__(self, *parts):
        self.parts = parts

    def motion(self, x_mm, y_mm, z_mm):
        for part in self.parts:
            x_mm, y_mm, z_mm = part.motion(x_mm, y_mm, z_mm)
        return x_mm, y_mm, z_mm

    def place(self, x_mm, y_mm):
        for part in self.parts:
            x_mm, y_mm = part.place(x_mm, y_mm)
        return x_mm, y_mm

    def height(self, x_mm, y_mm, raw_mm):
        for part in self.parts:
            raw_mm = part.height(x_mm, y_mm, raw_mm)
        return raw_mm

    def image(self, scene):
        images = (part.image(scene) for part in self.parts)
        return next((image for image in images if image is not None), None)

    def covering(self, scene, signal_mm):
        return self.in_turn("covering", scene, signal_mm)

    def element(self, scene, signal_mm):
        return self.in_turn("element", scene, signal_mm)

    def counts(self, scene, counts):
        return self.in_turn("counts", scene, counts)

    def sample(self, scene, counts):
        samplers = [part for part in self.parts if type(part).sample is not Hidden.sample]
        return samplers[0].sample(scene, counts) if samplers else super().sample(scene, counts)

    def readout(self, scene, counts):
        return self.in_turn("readout", scene, counts)

    def converter(self, scene, counts):
        return self.in_turn("converter", scene, counts)

    def in_turn(self, stage, scene, values):
        for part in self.parts:
            values = getattr(part, stage)(scene, values)
        return values


@dataclass
class Scene:
    """What the stages know: rig and times, and where the tool truly is in the sensor's frame."""

    rig: Rig
    t_s: np.ndarray
    frame_t_s: np.ndarray
    nodes: tuple
    reference: float
    x_mm: np.ndarray
    y_mm: np.ndarray
    # Below the surface; negative above it.
    raw_mm: np.ndarray

    def __post_init__(self):
        self.depth_mm = np.clip(self.raw_mm, 0, self.rig.thickness_mm)
        self.touches = self.depth_mm > 0

    def contacts(self):
        """First index of each contact, and that after its last."""
        changes = np.diff(np.concatenate([[0], self.touches.astype(int), [0]]))
        return list(zip(np.flatnonzero(changes == 1), np.flatnonzero(changes == -1), strict=True))


def simulate(rig, path, hidden):
    """Counts above the baseline of all frames, without noise, and the scene that they are of."""
    # Spread by the covering, a small tool needs few nodes.
    nodes = disc(rig.tool_mm / 2, *((4, 12) if rig.tool_mm <= 1.5 else (10, 24)))
    scene = Scene(
        rig=rig,
        t_s=path.t_s,
        frame_t_s=np.arange(path.frames) / RATE_HZ,
        nodes=nodes,
        reference=reference(nodes, rig.sigma_mm),
        **true_place(rig, path, hidden),
    )
    signal = hidden.image(scene)
    if signal is None:
        signal = spread_image(scene)
    signal = hidden.element(scene, hidden.covering(scene, signal))
    response = signal + rig.quadratic_per_mm * signal * np.abs(signal)
    counts = hidden.counts(scene, rig.gains_counts_per_mm * response)
    return hidden.readout(scene, hidden.sample(scene, counts)), scene


def true_place(rig, path, hidden):
    """Where the tool truly is, after the stages before the image."""
    x, y, z = hidden.motion(*path.positions_mm.T.copy())
    x, y = hidden.place(*rig.to_sensor(x, y))
    return {"x_mm": x, "y_mm": y, "raw_mm": hidden.height(x, y, -z)}


def noise(rng, frames, kind, rms_counts):
    """Noise of all readings in counts: `white`, `ar1` with a memory of one frame, or `quantised`, which is rounding alone."""
    if kind == "white":
        return rng.normal(0, rms_counts, (frames, ELEMENTS))
    if kind == "ar1":
        # The first readings are thrown away, until nothing is left of the start.
        settling = 200
        new = rng.normal(0, rms_counts * np.sqrt(1 - AR1_SHARE**2), (frames + settling, ELEMENTS))
        return lfilter([1], [1, -AR1_SHARE], new, axis=0)[settling:]
    if kind == "quantised":
        return np.zeros((frames, ELEMENTS))
    raise ValueError(f"no such noise: {kind}")


def digitise(rig, counts, noise_counts, converter=lambda counts: counts):
    """What the converter reports of counts above the baseline."""
    read = np.clip(converter(rig.baselines_counts + counts + noise_counts), 0, FULL_SCALE_COUNTS)
    return np.round(read)
