"""The sensor of the paper on its rig: two capacitive arrays of 6 x 4 elements as one image of 6 rows and 8 columns.

Lengths are in mm, counts are those of the converter. Elements are numbered along the rows. The sensor's frame has its origin at a corner
of the array, the robot's frame is that of the stage.
"""

import json

import numpy as np

COLUMNS, ROWS = 8, 6
ELEMENTS = COLUMNS * ROWS
# The gap between the two arrays is wider than those within them.
COLUMN_CENTRES_MM = np.array([0.9, 2.9, 5.1, 7.1, 9.1, 11.1, 13.3, 15.3])
ROW_CENTRES_MM = np.array([0.9, 2.9, 4.9, 6.9, 8.9, 10.9])
X_MM = np.tile(COLUMN_CENTRES_MM, ROWS)
Y_MM = np.repeat(ROW_CENTRES_MM, COLUMNS)
HALF_ELEMENT_MM = 0.9
WIDTH_MM, HEIGHT_MM = 16.2, 11.8

RATE_HZ = 30.0
# Physics runs on a grid of times so many times as fine as the frames.
FINE = 6
STEP_S = 1.0 / (RATE_HZ * FINE)

FULL_SCALE_COUNTS = 4095.0
# The paper's Eq. 4: standard deviation of the spread of a covering of thickness t is a + b t.
SIGMA_INTERCEPT_MM, SIGMA_PER_MM = 2.22, 0.497


class Rig:
    """A sensor with its covering, its cylinder and its place under the robot.

    What the rig file declares differs from the truth as in a lab: the mean sensitivity by up to 8 %, gains of elements by some 15 %,
    baselines by some 15 %, the spread by up to 3 %. `noise` is a kind and its root mean square in counts.
    """

    def __init__(self, rng, name, thickness_mm=1.016, tool_mm=1.0, noise=("white", 1.3), quadratic_per_mm=0.0):
        self.name, self.thickness_mm, self.tool_mm = name, thickness_mm, tool_mm
        self.noise, self.quadratic_per_mm = noise, quadratic_per_mm
        self.origin_mm = np.array([20.0, 15.0]) + rng.uniform(-1.5, 1.5, 2)
        self.rotation_deg = rng.uniform(-1.0, 1.0)
        self.sensitivity_counts_per_mm = float(rng.choice([900.0, 1000.0, 1100.0]))
        self.declared_baseline_counts = float(rng.choice([80.0, 100.0, 150.0]))
        mean = self.sensitivity_counts_per_mm * rng.uniform(0.92, 1.08)
        self.gains_counts_per_mm = mean * np.exp(rng.normal(0, 0.15, ELEMENTS).clip(-0.35, 0.35))
        self.baselines_counts = self.declared_baseline_counts * (1 + rng.normal(0, 0.15, ELEMENTS).clip(-0.4, 0.4))
        self.sigma_mm = (SIGMA_INTERCEPT_MM + SIGMA_PER_MM * thickness_mm) * rng.uniform(0.97, 1.03)

    @property
    def tool(self):
        """The name of the cylinder."""
        return f"cyl{self.tool_mm:g}"

    def declared(self):
        """The rig as its table declares it: JSON of the schema `tactus.rig/1`."""
        array = {
            "name": "digitacts",
            "rows": ROWS,
            "cols": COLUMNS,
            "element_mm": [2 * HALF_ELEMENT_MM, 2 * HALF_ELEMENT_MM],
            "col_centres_mm": COLUMN_CENTRES_MM.tolist(),
            "row_centres_mm": ROW_CENTRES_MM.tolist(),
            "rate_hz": RATE_HZ,
            "full_scale_counts": FULL_SCALE_COUNTS,
            "step_counts": 1.0,
        }
        rig = {
            "schema": "tactus.rig/1",
            "name": self.name,
            "simulated": True,
            "array": array,
            "registration": {"origin_mm": self.origin_mm.tolist(), "rotation_deg": self.rotation_deg},
            "psf": {"sigma_intercept_mm": SIGMA_INTERCEPT_MM, "sigma_per_mm": SIGMA_PER_MM},
            "sensitivity_counts_per_mm": self.sensitivity_counts_per_mm,
            "sensitivity_reference": {"indenter": self.tool, "covering_mm": self.thickness_mm},
            "baseline_counts": self.declared_baseline_counts,
            "indenters": {self.tool: {"shape": "cylinder", "diameter_mm": self.tool_mm}},
            "indenter": self.tool,
            "covering": {"thickness_mm": self.thickness_mm},
        }
        return json.dumps(rig, separators=(",", ":"))

    def to_sensor(self, x_mm, y_mm):
        """From the robot's frame to the sensor's."""
        angle = np.deg2rad(-self.rotation_deg)
        dx, dy = x_mm - self.origin_mm[0], y_mm - self.origin_mm[1]
        return np.cos(angle) * dx - np.sin(angle) * dy, np.sin(angle) * dx + np.cos(angle) * dy

    def to_robot(self, x_mm, y_mm):
        """From the sensor's frame to the robot's."""
        angle = np.deg2rad(self.rotation_deg)
        x = np.cos(angle) * x_mm - np.sin(angle) * y_mm + self.origin_mm[0]
        y = np.sin(angle) * x_mm + np.cos(angle) * y_mm + self.origin_mm[1]
        return x, y
