"""Images per second of a letter H pressed on three arrays: Tactus and its peers, in turns on one machine.

Arrays, poses and the images of Tactus come from `tactus-bench scene`, so that all programs press the same. The output
says what each program computes, and how far its values are from a quadrature of the definition, which is made here.
"""

import os

# One thread in every process: cores are compared, not thread pools. Must stand before numpy is loaded.
os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", MKL_NUM_THREADS="1")

import argparse
import json
import multiprocessing
import statistics
import subprocess
import time
from pathlib import Path

import mujoco
import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.special import erf

import machine

REPOSITORY = Path(__file__).parents[2]
ARRAYS = ("digitacts", "fingertip", "tekscan-5027")
# Cells of a depth map to a sigma of the blur: as coarse as an error of a hundredth allows.
CELLS_PER_SIGMA = 10
# Greatest distance of the H from its axis: so far beyond the array a depth map must reach.
REACH_MM = 6.4
# The H as strokes, each by its sides and its middle along x, and as an outline.
STROKES_MM = (((2, 10), -3), ((4, 2), 0), ((2, 10), 3))
OUTLINE_MM = np.array(
    [(-4, -5), (-2, -5), (-2, -1), (2, -1), (2, -5), (4, -5), (4, 5), (2, 5), (2, 1), (-2, 1), (-2, 5), (-4, 5)]
)


def main():
    args = arguments()
    results = [result for array in args.arrays for result in compare(args, array)]
    if args.json:
        print(json.dumps({"machine": machine.machine(), "versions": versions(results), "results": results}, indent=1))
    else:
        print_table(results)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--binary", type=Path, default=REPOSITORY / "target/dist/tactus-bench")
    parser.add_argument("--arrays", nargs="+", choices=ARRAYS, default=ARRAYS)
    parser.add_argument("--rounds", type=int, default=5, help="the median of so many counts")
    parser.add_argument("--seconds", type=float, default=0.5, help="of each measurement")
    parser.add_argument("--json", action="store_true")
    return parser.parse_args()


def compare(args, name):
    """Medians over rounds in which all take their turn."""
    scene = Scene(ask(args.binary, "scene", array=name))
    contenders = [Ours(args.binary, name, path, tool) for path, tool in OURS] + [
        peer(scene) for peer in (Mujoco, Products, Filter)
    ]
    rates = {contender: {1: [], 2: []} for contender in contenders}
    for _ in range(args.rounds):
        for contender in contenders:
            for cores, measured in rates[contender].items():
                measured.append(contender.rate(cores, args.seconds))
    sensor = statistics.median(next(rates[c][1] for c in contenders if isinstance(c, Mujoco)))
    for contender in contenders:
        one, two = (statistics.median(measured) for measured in rates[contender].values())
        yield {
            "array": name,
            "elements": scene.rows * scene.cols,
            "who": contender.who,
            "included": contender.included,
            "per_s_one_core": one,
            "per_s_two_cores": two,
            "to_mujoco": one / sensor,
            "error": contender.error(scene),
            **contender.notes(),
        }


class Scene:
    """An array, its model and some poses, and what an image of them should be."""

    def __init__(self, said):
        self.centres_mm = [np.array(said["col_centres_mm"]), np.array(said["row_centres_mm"])]
        self.cols, self.rows = map(len, self.centres_mm)
        self.element_mm, self.sigma_mm = np.array(said["element_mm"]), said["sigma_mm"]
        self.sensitivity, self.quadratic = said["sensitivity_counts_per_mm"], said["quadratic_per_mm"]
        self.poses = said["poses"]
        self.reference_mm2 = self.volume(*disc(0.5), np.zeros((2, 1))).item()
        self.extent_mm = np.array(
            [[at[0] - side / 2, at[-1] + side / 2] for at, side in zip(self.centres_mm, self.element_mm)]
        )

    def volume(self, places_mm, weights, centres_mm):
        """What of weighted points arrives in elements, rows along y: the normal distribution between their sides."""
        of_x, of_y = (
            arrived(centre, side, place, self.sigma_mm)
            for centre, side, place in zip(centres_mm, self.element_mm, places_mm)
        )
        return (of_y * weights) @ of_x.T

    def respond(self, volume_mm3):
        u = volume_mm3 / self.reference_mm2
        return self.sensitivity * (u + self.quadratic * u * u)

    def images(self, tool):
        """The model's definition by Gauss-Legendre quadrature in the tool's frame."""
        points, weights = strokes() if tool == "h" else disc(0.5)
        for pose in self.poses:
            volume = self.volume(placed(points, pose), weights * pose["depth_mm"], self.centres_mm)
            yield self.respond(volume)

    def error(self, images, tool="h"):
        """Greatest difference of any element, as a share of its image's peak."""
        return max(abs(got - want).max() / want.max() for got, want in zip(images, self.images(tool)))


class Ours:
    """Our optimised program, with its own clock and threads."""

    def __init__(self, binary, array, path, tool):
        self.binary, self.asked = binary, {"array": array, "path": path, "tool": tool}
        self.who = f"tactus {path}" if tool == "h" else f"tactus {path}, {tool}"
        self.included = "pose to depth, blur, elements, response"
        self.said = {}

    def rate(self, cores, seconds):
        self.said = ask(self.binary, "forward", "--json", **self.asked, threads=cores, seconds=seconds, compared=0)
        return self.said["images_per_s"]

    def error(self, scene):
        images = np.array(ask(self.binary, "scene", **self.asked)["images"])
        return scene.error(images.reshape(-1, scene.rows, scene.cols), self.asked["tool"])

    def notes(self):
        return {"version": self.said["version"], "ready_s": self.said["ready_s"]}


OURS = (("press-table", "h"), ("outline", "h"), ("raster", "h"), ("exact", "h"), ("press-table", "cylinder"))


class Peer:
    """What runs in this process, over all poses of the scene at a time."""

    def rate(self, cores, seconds):
        """Images a second in as many processes at once."""
        context = multiprocessing.get_context("fork")
        together, rates = context.Barrier(cores), context.SimpleQueue()

        def work():
            self.batch()
            together.wait()
            batches, started = 0, time.perf_counter()
            while (took := time.perf_counter() - started) < seconds:
                self.batch()
                batches += 1
            rates.put(batches * self.images_of_batch / took)

        workers = [context.Process(target=work) for _ in range(cores)]
        for worker in workers:
            worker.start()
        for worker in workers:
            worker.join()
            if worker.exitcode:
                raise SystemExit(f"{self.who} failed")
        return sum(rates.get() for _ in workers)

    def notes(self):
        return {}


class Mujoco(Peer):
    """The `tactile` sensor over a plate with a point in the middle of every element, evenly spaced."""

    who = "MuJoCo tactile"
    included = "depth, sliding speed at points; no blur, area, response; after kinematics and collision"

    def __init__(self, scene):
        middle, half = scene.extent_mm.mean(axis=1), np.ptp(scene.extent_mm, axis=1) / 2
        spec = mujoco.MjSpec.from_string(f"""
            <mujoco>
              <option gravity="0 0 0"/>
              <asset>
                <mesh name="plate" builtin="plate" params="{scene.cols} {scene.rows}" scale="{half[0]} {half[1]} 1"/>
                <mesh name="h" file="{REPOSITORY / "assets/h.stl"}" inertia="exact"/>
              </asset>
              <worldbody>
                <geom type="box" size="{half[0]} {half[1]} 1" pos="{middle[0]} {middle[1]} -1"/>
                <geom name="plate" type="mesh" mesh="plate" pos="{middle[0]} {middle[1]} 1" contype="0" conaffinity="0"/>
                <body><freejoint/><geom type="mesh" mesh="h"/></body>
              </worldbody>
              <sensor><tactile geom="plate" mesh="plate"/></sensor>
            </mujoco>""")
        spec.mesh("h").needsdf = True
        self.model = spec.compile()
        self.poses = scene.poses
        self.scenes = [self.pressed(pose) for pose in self.poses]
        self.images_of_batch = len(self.scenes)
        # The stage that computes the sensor is not the same in every version.
        stages = {1: mujoco.mj_sensorPos, 2: mujoco.mj_sensorVel, 3: mujoco.mj_sensorAcc}
        self.stage = stages[int(self.model.sensor_needstage[0])]

    def pressed(self, pose):
        """A scene in which all is done that comes before the sensor."""
        data, half_turn = mujoco.MjData(self.model), np.radians(pose["rotation_deg"]) / 2
        data.qpos[:] = [*pose["position_mm"], -pose["depth_mm"], np.cos(half_turn), 0, 0, np.sin(half_turn)]
        mujoco.mj_forward(self.model, data)
        return data

    def batch(self):
        for data in self.scenes:
            self.stage(self.model, data)

    def error(self, scene):
        """None to compare: points are not elements. See `notes`."""

    def notes(self):
        """How its time splits, and how its depths differ from the distance to the H's nearest face."""
        def each_us(call):
            started = time.perf_counter()
            for data in self.scenes:
                call(self.model, data)
            return (time.perf_counter() - started) / len(self.scenes) * 1e6

        return {
            "forward_us": statistics.median(each_us(mujoco.mj_forward) for _ in range(9)),
            "sensor_us": statistics.median(each_us(self.stage) for _ in range(9)),
            "depth_error_95th": float(np.percentile(self.depth_errors(), 95)),
            "depth_error_most": float(self.depth_errors().max()),
        }

    def depth_errors(self):
        """Of every point in every scene, as a share of the tool's depth."""
        plate, geom = self.model.mesh("plate"), self.model.geom("plate").id
        vertices = self.model.mesh_vert[plate.vertadr[0] : plate.vertadr[0] + plate.vertnum[0]]

        def of(data, pose):
            places = vertices @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
            want = np.minimum(within_h(unplaced(places[:, :2].T, pose)), pose["depth_mm"])
            return abs(data.sensordata[: len(places)] - want) / pose["depth_mm"]

        return np.array([of(data, pose) for data, pose in zip(self.scenes, self.poses)])


class Maps(Peer):
    """Depth maps made ready: the tool's depth where a cell's middle lies under it."""

    def __init__(self, scene):
        self.cell_mm = scene.sigma_mm / CELLS_PER_SIGMA
        self.places_mm = [
            np.arange(least - REACH_MM, most + REACH_MM, self.cell_mm) for least, most in scene.extent_mm
        ]
        grid = np.array([axis.ravel() for axis in np.meshgrid(*self.places_mm)])
        shape = tuple(map(len, reversed(self.places_mm)))
        self.maps = np.array(
            [pose["depth_mm"] * (within_h(unplaced(grid, pose)) > 0).reshape(shape) for pose in scene.poses],
            dtype=np.float32,
        )
        self.images_of_batch = len(self.maps)
        self.reference = np.float32(1 / scene.reference_mm2)
        self.response = np.float32(scene.sensitivity), np.float32(scene.quadratic)

    def shares_mm(self, scene, sigma_mm):
        """What of a cell arrives in each element along x and along y, in mm."""
        return [
            (self.cell_mm * arrived(centres, side, places, sigma_mm)).astype(np.float32)
            for centres, side, places in zip(scene.centres_mm, scene.element_mm, self.places_mm)
        ]

    def respond(self, volume_mm3):
        sensitivity, quadratic = self.response
        u = self.reference * volume_mm3
        return sensitivity * (u + quadratic * u * u)

    def error(self, scene):
        return scene.error(self.batch())


class Products(Maps):
    """Blur and elements as one matrix along each axis, over all maps at once."""

    who = "numpy A Z B"
    included = "blur, elements, response; depth map given, 10 cells a sigma"

    def __init__(self, scene):
        super().__init__(scene)
        self.of_cols, self.of_rows = self.shares_mm(scene, scene.sigma_mm)

    def batch(self):
        return self.respond(self.of_rows @ self.maps @ self.of_cols.T)


class Filter(Maps):
    """The stock blur, then sums over elements as matrices."""

    who = "scipy gaussian_filter"
    included = "blur to 4 sigma, elements, response; depth map given, 10 cells a sigma"

    def __init__(self, scene):
        super().__init__(scene)
        # Hardly a blur: a cell is in an element or not.
        self.of_cols, self.of_rows = self.shares_mm(scene, self.cell_mm / 4)

    def batch(self):
        blurred = (gaussian_filter(depths, CELLS_PER_SIGMA, mode="constant") for depths in self.maps)
        return [self.respond(self.of_rows @ depths @ self.of_cols.T) for depths in blurred]


def ask(binary, part, *flags, **asked):
    """What our program says, as JSON."""
    options = [text for name, value in asked.items() for text in (f"--{name}", str(value))]
    return json.loads(subprocess.run([binary, part, *flags, *options], check=True, capture_output=True).stdout)


def arrived(centres_mm, side_mm, places_mm, sigma_mm):
    """Share of each place (columns) that arrives between the sides of each element (rows)."""
    z = (centres_mm[:, None] - places_mm[None, :]) / (sigma_mm * 2**0.5)
    half = side_mm / 2 / (sigma_mm * 2**0.5)
    return (erf(z + half) - erf(z - half)) / 2


def strokes():
    """Points of the H's face and their areas."""
    nodes, weights = np.polynomial.legendre.leggauss(40)
    points = [
        np.array([axis.ravel() for axis in np.meshgrid(middle + w / 2 * nodes, h / 2 * nodes)])
        for (w, h), middle in STROKES_MM
    ]
    areas = [np.outer(weights, weights).ravel() * w * h / 4 for (w, h), _ in STROKES_MM]
    return np.hstack(points), np.hstack(areas)


def disc(radius_mm):
    """Points of a disc and their areas."""
    nodes, weights = np.polynomial.legendre.leggauss(20)
    radius, angle = radius_mm * (nodes + 1) / 2, 2 * np.pi * np.arange(64) / 64
    points = np.array([np.outer(radius, axis).ravel() for axis in (np.cos(angle), np.sin(angle))])
    return points, np.repeat(radius * weights * radius_mm / 2 * 2 * np.pi / 64, 64)


def rotation(pose):
    turn = np.radians(pose["rotation_deg"])
    return np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])


def placed(points_mm, pose):
    """From the tool's frame to the sensor's."""
    return rotation(pose) @ points_mm + np.array(pose["position_mm"])[:, None]


def unplaced(places_mm, pose):
    """From the sensor's frame to the tool's."""
    return rotation(pose).T @ (places_mm - np.array(pose["position_mm"])[:, None])


def within_h(points_mm):
    """Distance of points from the H's outline, 0 outside of it."""
    (x, y) = points_mm
    inside = np.any([(abs(x - at) <= w / 2) & (abs(y) <= h / 2) for (w, h), at in STROKES_MM], axis=0)
    distance = np.full(x.shape, np.inf)
    for start, end in zip(OUTLINE_MM, np.roll(OUTLINE_MM, -1, axis=0)):
        along = end - start
        share = np.clip(along @ (points_mm - start[:, None]) / (along @ along), 0, 1)
        distance = np.minimum(distance, np.hypot(*(points_mm - start[:, None] - along[:, None] * share)))
    return distance * inside


def versions(results):
    ours = next(result["version"] for result in results if "version" in result)
    return {"tactus": ours, **machine.versions("mujoco", "numpy", "scipy")}


def print_table(results):
    print(machine.described(versions(results)))
    print(f"{'array':<14}{'who':<23}{'1 core/s':>11}{'2 cores/s':>11}{'to MuJoCo':>11}{'error':>9}  included")
    for result in results:
        error = "-" if result["error"] is None else f"{result['error']:.0e}"
        print(
            f"{result['array']:<14}{result['who']:<23}{result['per_s_one_core']:>11,.0f}"
            f"{result['per_s_two_cores']:>11,.0f}{result['to_mujoco']:>11.2f}{error:>9}  {result['included']}"
        )
    for result in results:
        if "forward_us" in result:
            print(
                f"MuJoCo on {result['array']}: the sensor takes {result['sensor_us']:.0f} us, all of mj_forward"
                f" {result['forward_us']:.0f} us; 95 % of its depths are within {result['depth_error_95th']:.0%} of the"
                f" tool's, all within {result['depth_error_most']:.0%}"
            )
    for who in dict.fromkeys(result["who"] for result in results):
        points = [(r["elements"], 1 / r["per_s_one_core"]) for r in results if r["who"] == who]
        if len(points) > 1:
            print(f"{who}: time ~ elements^{np.polyfit(*np.log(np.transpose(points)), 1)[0]:.2f}")


if __name__ == "__main__":
    main()
