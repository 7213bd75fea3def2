"""Hidden physics of the stage and of where the surface lies: what differs between the commanded and the true place of the tool."""

from dataclasses import dataclass

import numpy as np

from physics import Hidden
from rig import HEIGHT_MM, WIDTH_MM


@dataclass
class Dahl(Hidden):
    """Backlash: friction after Dahl in each axis. The tool is at x - f with df/dx = (a sgn(dx) - f) / reach."""

    x_mm: float
    y_mm: float
    z_mm: float
    reach_mm: float

    def motion(self, x_mm, y_mm, z_mm):
        axes = ((x_mm, self.x_mm), (y_mm, self.y_mm), (z_mm, self.z_mm))
        return [positions - self.lag_mm(positions, most) for positions, most in axes]

    def lag_mm(self, positions_mm, most_mm):
        steps_mm = np.diff(positions_mm, prepend=positions_mm[0])
        decays, targets_mm = np.exp(-np.abs(steps_mm) / self.reach_mm), np.sign(steps_mm) * most_mm
        lags_mm, lag = np.empty_like(positions_mm), 0.0
        for i in range(len(positions_mm)):
            lag = targets_mm[i] + (lag - targets_mm[i]) * decays[i]
            lags_mm[i] = lag
        return lags_mm


@dataclass
class Misregistration(Hidden):
    """A shift, a turn and a scale about the array's middle, and the periodic error of a lead screw in x."""

    x_mm: float
    y_mm: float
    turn_deg: float
    scale: float = 0.0
    lead_error_mm: float = 0.0
    lead_mm: float = 2.0

    def place(self, x_mm, y_mm):
        x, y = (x_mm - WIDTH_MM / 2) * (1 + self.scale), (y_mm - HEIGHT_MM / 2) * (1 + self.scale)
        x = x + self.lead_error_mm * np.sin(2 * np.pi * x_mm / self.lead_mm)
        cos, sin = np.cos(np.deg2rad(self.turn_deg)), np.sin(np.deg2rad(self.turn_deg))
        return cos * x - sin * y + WIDTH_MM / 2 + self.x_mm, sin * x + cos * y + HEIGHT_MM / 2 + self.y_mm


@dataclass
class SurfaceOffset(Hidden):
    """A rough surface that lies lower by an offset: depth = r ln(1 + exp((depth - offset) / r)) with the asperities' height r."""

    offset_mm: float
    roughness_mm: float

    def height(self, x_mm, y_mm, raw_mm):
        # Beyond some seven heights above the surface there is no contact.
        cut_mm = 1e-3 * self.roughness_mm
        return self.roughness_mm * np.logaddexp(0, (raw_mm - self.offset_mm) / self.roughness_mm) - cut_mm


@dataclass
class SurfaceTilt(Hidden):
    """A surface with slopes in mm per mm about the array's middle, and a bow in 1/mm: b (x^2 - W^2 / 12) with the array's width W."""

    slope_x: float
    slope_y: float
    bow_per_mm: float = 0.0

    def height(self, x_mm, y_mm, raw_mm):
        x, y = x_mm - WIDTH_MM / 2, y_mm - HEIGHT_MM / 2
        return raw_mm + self.slope_x * x + self.slope_y * y + self.bow_per_mm * (x**2 - WIDTH_MM**2 / 12)
