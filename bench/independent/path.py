"""The way of the tool: presses at the elements' centres, at random places and on a fine grid of places, some twice in a row.

Moves have trapezoidal speeds; the stage goes in steps of 3 um in x and y and of 1 um in z. Heights are above the covering's surface.
"""

from dataclasses import dataclass

import numpy as np

from rig import COLUMN_CENTRES_MM, FINE, HEIGHT_MM, RATE_HZ, ROW_CENTRES_MM, STEP_S, WIDTH_MM, X_MM, Y_MM

IDLE = -1
STEP_XY_MM = 0.003
ACCELERATION_MM_PER_S2 = 100.0
TRAVEL_MM_PER_S = 20.0
TRAVEL_HEIGHT_MM = 2.0
APPROACH_HEIGHT_MM = 0.3
RETRACT_HEIGHT_MM = 0.2


@dataclass
class Segment:
    """A move from one position to another, or a rest between two times."""

    begins_s: float
    ends_s: float
    start_mm: np.ndarray
    target_mm: np.ndarray
    press: int
    ramp_s: float = 0.0
    speed_mm_per_s: float = 0.0
    length_mm: float = 0.0

    def travelled_mm(self, t_s):
        """The distance from the start at times since the beginning."""
        even_s = (self.ends_s - self.begins_s) - 2 * self.ramp_s
        acceleration = self.speed_mm_per_s / self.ramp_s
        left_s = np.maximum(self.ends_s - self.begins_s - t_s, 0)
        return np.where(
            t_s < self.ramp_s,
            0.5 * acceleration * t_s**2,
            np.where(
                t_s < self.ramp_s + even_s,
                0.5 * self.speed_mm_per_s * self.ramp_s + self.speed_mm_per_s * (t_s - self.ramp_s),
                self.length_mm - 0.5 * acceleration * left_s**2,
            ),
        )


class Path:
    """Positions in the robot's frame, press numbers and phases on the fine grid of times.

    `speeds_mm_per_s` are those of slow and of other presses, `depth_max_mm` is that of the deepest press.
    """

    def __init__(self, rng, rig, random_places, repeats, speeds_mm_per_s, depth_max_mm):
        self.segments, self.ends_s = [], 0.0
        self.position_mm = np.array([*rig.to_robot(WIDTH_MM / 2, HEIGHT_MM / 2), TRAVEL_HEIGHT_MM])
        self.places_mm = places(rng, random_places, repeats)
        self.rest(3.0, IDLE)
        for press, place_mm in enumerate(self.places_mm):
            self.press_at(rng, press, rig.to_robot(*place_mm), speeds_mm_per_s, depth_max_mm)
        self.rest(2.0, IDLE)
        self.frames = int(self.ends_s * RATE_HZ)
        self.t_s = np.arange(self.frames * FINE) * STEP_S
        self.sample()

    def press_at(self, rng, press, at_mm, speeds_mm_per_s, depth_max_mm):
        """A press in two or three depths with a hold in each; the third depth may lie on the way back."""
        x, y = at_mm
        self.move((x, y, TRAVEL_HEIGHT_MM), TRAVEL_MM_PER_S, IDLE)
        self.rest(rng.uniform(0.5, 1.0), IDLE)
        slow, other = speeds_mm_per_s
        speed = slow if rng.random() < 0.4 else other
        count = int(rng.integers(2, 4))
        depths_mm = np.sort(rng.uniform(0.1, depth_max_mm, count))
        depths_mm[-1] = max(depths_mm[-1], depth_max_mm * rng.uniform(0.6, 1.0))
        if count == 3 and rng.random() < 0.45:
            depths_mm = depths_mm[[0, 2, 1]]
        is_light = rng.random() < 0.15
        if is_light:
            depths_mm = np.sort(depths_mm) * 0.5
        self.move((x, y, APPROACH_HEIGHT_MM), TRAVEL_MM_PER_S, press)
        for depth_mm in depths_mm:
            self.move((x, y, -depth_mm), speed, press)
            self.rest(rng.uniform(0.5, 2.0), press)
        self.move((x, y, RETRACT_HEIGHT_MM), speed, press)
        self.move((x, y, TRAVEL_HEIGHT_MM), TRAVEL_MM_PER_S, press)
        self.rest(rng.uniform(0.5, 1.0), IDLE)

    def move(self, target_mm, speed_mm_per_s, press):
        """Goes to a position, at most at a speed."""
        target = stepped(*target_mm)
        length = np.linalg.norm(target - self.position_mm)
        if length < 1e-9:
            return
        ramp = min(speed_mm_per_s / ACCELERATION_MM_PER_S2, np.sqrt(length / ACCELERATION_MM_PER_S2))
        speed = ramp * ACCELERATION_MM_PER_S2
        ends = self.ends_s + 2 * ramp + (length - speed * ramp) / speed
        self.segments.append(Segment(self.ends_s, ends, self.position_mm, target, press, ramp, speed, length))
        self.ends_s, self.position_mm = ends, target

    def rest(self, seconds, press):
        """Stands still."""
        ends = self.ends_s + seconds
        self.segments.append(Segment(self.ends_s, ends, self.position_mm, self.position_mm, press))
        self.ends_s = ends

    def sample(self):
        """Position, press and phase at each time of the fine grid."""
        n = len(self.t_s)
        positions_mm, presses, direction = np.empty((n, 3)), np.full(n, IDLE), np.zeros(n, int)
        for part in self.segments:
            first, end = (min(n, int(np.ceil(t_s / STEP_S - 1e-9))) for t_s in (part.begins_s, part.ends_s))
            if end <= first:
                continue
            if part.length_mm == 0:
                positions_mm[first:end] = part.start_mm
            else:
                share = part.travelled_mm(self.t_s[first:end] - part.begins_s) / part.length_mm
                positions_mm[first:end] = part.start_mm + (part.target_mm - part.start_mm) * share[:, None]
                direction[first:end] = np.sign(part.target_mm[2] - part.start_mm[2]) if part.press >= 0 else 0
            presses[first:end] = part.press
        self.positions_mm = np.stack(stepped(*positions_mm.T), axis=1)
        self.presses = presses
        self.phases = phases(presses >= 0, direction, self.positions_mm[:, 2] < 0)


def places(rng, random_places, repeats):
    """Places of the presses in the sensor's frame, in random order."""
    all_mm = list(zip(X_MM, Y_MM, strict=True))
    all_mm += [(rng.uniform(0.4, WIDTH_MM - 0.4), rng.uniform(0.4, HEIGHT_MM - 0.4)) for _ in range(random_places)]
    column, row = int(rng.integers(1, 7)), int(rng.integers(1, 5))
    step_mm = float(rng.choice([0.3, 0.4, 0.5]))
    around = range(-2, 3)
    all_mm += [(COLUMN_CENTRES_MM[column] + step_mm * i, ROW_CENTRES_MM[row] + step_mm * j) for i in around for j in around]
    all_mm = [all_mm[i] for i in rng.permutation(len(all_mm))]
    for i in sorted(rng.choice(np.arange(5, len(all_mm)), repeats, replace=False))[::-1]:
        all_mm.insert(i + 1, all_mm[i])
    return all_mm


def stepped(x_mm, y_mm, z_mm):
    """A position in whole steps of the stage."""
    return np.array([np.round(x_mm / STEP_XY_MM) * STEP_XY_MM, np.round(y_mm / STEP_XY_MM) * STEP_XY_MM, np.round(z_mm, 3)])


def phases(is_press, direction, is_below):
    """Names of the phases of a press; `direction` is the sign of the speed in z."""
    names = np.full(len(is_press), "idle", dtype="U8")
    names[is_press & (direction < 0) & ~is_below] = "approach"
    names[is_press & (direction < 0) & is_below] = "load"
    names[is_press & (direction == 0)] = "hold"
    names[is_press & (direction > 0) & is_below] = "unload"
    names[is_press & (direction > 0) & ~is_below] = "retract"
    return names
