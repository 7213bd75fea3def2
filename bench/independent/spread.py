"""Hidden physics of the image: other tools than the declared one, and other point spreads than the paper's Gaussian.

G is the Gaussian of the rig's standard deviation.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import roots_genlaguerre

from image import disc, gauss_image, profile_image, spread_image, unique_rows
from physics import Hidden
from rig import ELEMENTS, HALF_ELEMENT_MM, X_MM, Y_MM


@dataclass
class FilletedTool(Hidden):
    """A cylinder of so many times the declared diameter, with a fillet of its rim."""

    ratio: float
    fillet_mm: float

    def image(self, scene):
        radius_mm = self.ratio * scene.rig.tool_mm / 2
        nodes = disc(radius_mm, 24, 32)
        into_mm = np.clip(np.hypot(nodes[0], nodes[1]) - (radius_mm - self.fillet_mm), 0, self.fillet_mm)
        drop_mm = self.fillet_mm - np.sqrt(self.fillet_mm**2 - into_mm**2)
        return profile_image(scene, nodes, lambda depth_mm: np.maximum(0, depth_mm - drop_mm))


@dataclass
class TiltedTool(Hidden):
    """A cylinder that leans by tilt / (1 + depth / aligning), since its joint yields; depth is that of its lowest point."""

    tilt_deg: float
    azimuth_deg: float
    aligning_mm: float

    def image(self, scene):
        tilt, azimuth = np.deg2rad(self.tilt_deg), np.deg2rad(self.azimuth_deg)
        nodes = disc(scene.rig.tool_mm / 2, 16, 32)
        along_mm = nodes[0] * np.cos(azimuth) + nodes[1] * np.sin(azimuth)
        radius_mm = scene.rig.tool_mm / 2

        def profile(depth_mm):
            slope = np.tan(tilt / (1 + depth_mm / self.aligning_mm))
            return np.maximum(0, depth_mm - radius_mm * slope + slope * along_mm)

        return profile_image(scene, nodes, profile)


@dataclass
class Fibres(Hidden):
    """Shear lag along fibres: (1 - share) G + share G * exp(-|s| / length) / (2 length), s along the fibres at an angle to x."""

    share: float
    length_mm: float
    angle_deg: float

    def image(self, scene):
        angle = np.deg2rad(self.angle_deg)
        nodes, weights = np.polynomial.laguerre.laggauss(12)

        def gauss(x, y):
            return gauss_image(x, y, scene.nodes, scene.rig.sigma_mm)

        def kernel(x, y):
            image = (1 - self.share) * gauss(x, y)
            for node, weight in zip(nodes, weights, strict=True):
                for sign in (-1, 1):
                    along_x = sign * self.length_mm * node * np.cos(angle)
                    along_y = sign * self.length_mm * node * np.sin(angle)
                    image += self.share * weight / 2 * gauss(x + along_x, y + along_y)
            return image

        return spread_image(scene, kernel)


@dataclass
class HertzSpread(Hidden):
    """A contact that widens as that of Hertz: sigma^2 = sigma0^2 + growth depth."""

    growth_mm: float

    def image(self, scene):
        signal = np.zeros((len(scene.t_s), ELEMENTS))
        touching = np.flatnonzero(scene.touches)
        columns = [values[touching] for values in (scene.x_mm, scene.y_mm, scene.depth_mm)]
        first, group = unique_rows(*columns)
        x, y, depth = (values[first] for values in columns)
        sigma_mm = np.sqrt(scene.rig.sigma_mm**2 + self.growth_mm * depth)
        signal[touching] = (gauss_image(x, y, scene.nodes, sigma_mm) * depth[:, None] / scene.reference)[group]
        return signal


@dataclass
class Boussinesq(Hidden):
    """A tail of the pressure in an elastic half-space at a depth h: (1 - share) G + share h / (2 pi (r^2 + h^2)^1.5)."""

    share: float
    below_mm: float

    def image(self, scene):
        below, half = self.below_mm, HALF_ELEMENT_MM

        def corner(x, y):
            return np.arctan(x * y / (below * np.sqrt(x * x + y * y + below * below))) / (2 * np.pi)

        def kernel(x, y):
            image = (1 - self.share) * gauss_image(x, y, scene.nodes, scene.rig.sigma_mm)
            for node_x, node_y, area in zip(*scene.nodes, strict=True):
                dx = X_MM[None, :] - (x + node_x)[:, None]
                dy = Y_MM[None, :] - (y + node_y)[:, None]
                inside = corner(dx + half, dy + half) - corner(dx - half, dy + half)
                inside = inside - corner(dx + half, dy - half) + corner(dx - half, dy - half)
                image += self.share * area * inside
            return image

        return spread_image(scene, kernel)


@dataclass
class VarianceGamma(Hidden):
    """A mixture of Gaussians whose variance has a gamma distribution of a given shape and the rig's mean; a large shape gives G."""

    shape: float

    def image(self, scene):
        variances, weights = roots_genlaguerre(16, self.shape - 1)
        weights = weights / weights.sum()

        def kernel(x, y):
            return sum(
                weight * gauss_image(x, y, scene.nodes, scene.rig.sigma_mm * np.sqrt(variance / self.shape))
                for variance, weight in zip(variances, weights, strict=True)
            )

        return spread_image(scene, kernel)
