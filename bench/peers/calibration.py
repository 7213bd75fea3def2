"""The fit of the point spreads to the paper's sweep: Tactus and scipy.optimize on the same images, on one machine.

The embedded rig makes the recordings. Tactus reads them, calibrates, and prints the images that its spreads are fitted to.
The scipy program maximises the same criterion (Eq. 3, images of unit L2 norm) over sigma for each covering and depth,
by `minimize_scalar` with bounds, in two ways. The first follows the paper: a raster of 0.1 mm, `gaussian_filter`, sums over
the elements, one press after the other, for one sweep of twelve, times twelve. The second uses the mathematics of Tactus: the
disc is cut into 16 strips (Gauss and Legendre), each blurred and integrated by the normal distribution, all presses in one array.
"""

import os

# One thread in every process. Must stand before numpy is loaded.
os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", MKL_NUM_THREADS="1")

import argparse
import json
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.optimize import minimize_scalar
from scipy.special import ndtr

import machine

REPOSITORY = Path(__file__).parents[2]
ELEMENT_MM = 1.8
RADIUS_MM = 0.5


def main():
    args = arguments()
    with tempfile.TemporaryDirectory() as folder:
        files = [record(args.tactus, folder, name, *more) for name, *more in experiments(args.points)]
        ours = json.loads(run(args.binary, "calibrate", "--json", *files))
        core = min(os.sched_getaffinity(0))
        one_core = json.loads(run("taskset", "-c", str(core), args.binary, "calibrate", "--json", *files))
    sweeps = [{key: np.array(value) for key, value in sweep.items()} for sweep in ours["sweeps"]]
    rounds = [timed(lambda: [fit(sweep) for sweep in sweeps]) for _ in range(args.rounds)]
    sigmas = rounds[0][0]
    scipy_s = statistics.median(seconds for _, seconds in rounds)
    raster, raster_s = timed(lambda: fit(sweeps[0], by_raster))
    raster_s *= len(sweeps)
    spread_s, spread_one_core_s = (one["whole_s"] - one["without_sweeps_s"] for one in (ours, one_core))
    worst = max(abs(ours_sigma - sigma) for ours_sigma, sigma in zip((s["sigma_mm"] for s in sweeps), sigmas))
    print(machine.described(machine.versions("numpy", "scipy")))
    print(f"presses: {ours['presses']}, of which sweeps {sum(len(s['places_mm']) for s in sweeps)}")
    print(f"reading the recordings            {ours['read_s']:8.3f} s")
    print(f"whole calibration                 {ours['whole_s']:8.3f} s, one core {one_core['whole_s']:.3f} s")
    print(f"spreads alone, with their errors  {spread_s:8.3f} s, one core {spread_one_core_s:.3f} s")
    for name, seconds in (("raster and filter", raster_s), ("in closed form", scipy_s)):
        ratios = f"{seconds / spread_s:.1f} x, one core {seconds / spread_one_core_s:.1f} x"
        print(f"scipy, {name:<18}        {seconds:8.3f} s: {ratios}; no errors")
    print(f"greatest difference of a sigma    {worst:8.1e} mm; raster {abs(raster - sweeps[0]['sigma_mm']):.1e} mm")


def experiments(points):
    sweep = ["-p", f"points={points}", "-p", f"spacing_mm={1.4 / (points - 1)}"]
    return [["corners"], ["element-centres"], ["grid-sweep", *sweep]]


def record(tactus, folder, experiment, *parameters):
    out = run(tactus, "--json", "run", experiment, "--embedded", "--no-report", "--seed", "1", "--out", folder, *parameters)
    return json.loads(out)["recording"]


def fit(sweep, images_of=None):
    measured = sweep["images_mm"] / np.linalg.norm(sweep["images_mm"], axis=1, keepdims=True)
    images_of = (images_of or in_closed_form)(sweep)

    def unlike(sigma):
        images = images_of(sigma)
        return -np.sum(measured * images / np.linalg.norm(images, axis=1, keepdims=True))

    return minimize_scalar(unlike, bounds=(0.5, 15.0), method="bounded", options={"xatol": 1e-7}).x


def by_raster(sweep, cell_mm=0.1, margin_mm=8.0):
    low, high = sweep["centres_mm"].min(axis=0) - margin_mm, sweep["centres_mm"].max(axis=0) + margin_mm
    x, y = (np.arange(least, most, cell_mm) + cell_mm / 2 for least, most in zip(low, high))
    cover = [np.clip((ELEMENT_MM / 2 + cell_mm / 2 - np.abs(axis - centre)) / cell_mm, 0, 1) for centre_xy in sweep["centres_mm"] for axis, centre in zip((x, y), centre_xy)]
    along_x, along_y = np.array(cover[0::2]), np.array(cover[1::2])
    discs = [soft_disc(x, y, place, cell_mm) for place in sweep["places_mm"]]

    def images_of(sigma):
        blurred = (gaussian_filter(disc, sigma / cell_mm, mode="constant", truncate=5) for disc in discs)
        return np.array([np.einsum("ey,yx,ex->e", along_y, image, along_x, optimize=True) for image in blurred])

    return images_of


def soft_disc(x, y, place, cell_mm):
    """A disc whose edge is one cell wide, so that its place is not that of whole cells."""
    away = np.hypot(x[None, :] - place[0], y[:, None] - place[1])
    return np.clip((RADIUS_MM - away) / cell_mm + 0.5, 0, 1)


def in_closed_form(sweep):
    centres, places = sweep["centres_mm"], sweep["places_mm"]
    columns, column_of = np.unique(centres[:, 0], return_inverse=True)
    rows, row_of = np.unique(centres[:, 1], return_inverse=True)
    nodes, weights = np.polynomial.legendre.leggauss(16)
    strips = RADIUS_MM * nodes
    half = np.sqrt(RADIUS_MM**2 - strips**2)

    def images_of(sigma):
        # Along x the strip is a line of no width; along y it reaches half a chord each way.
        away = places[:, 0, None, None] + strips[:, None] - columns
        along_x = weights[:, None] * (ndtr((away + ELEMENT_MM / 2) / sigma) - ndtr((away - ELEMENT_MM / 2) / sigma))
        away = places[:, 1, None, None] - rows
        along_y = sum(
            sign * side * integral((away + sign * half[:, None] + side * ELEMENT_MM / 2), sigma)
            for sign in (1, -1)
            for side in (1, -1)
        )
        return np.einsum("psc,psr->prc", along_x, along_y)[:, row_of, column_of]

    return images_of


def integral(x, sigma):
    """The integral of the normal distribution function."""
    return x * ndtr(x / sigma) + sigma / np.sqrt(2 * np.pi) * np.exp(-((x / sigma) ** 2) / 2)


def timed(work):
    start = time.perf_counter()
    result = work()
    return result, time.perf_counter() - start


def run(*command):
    return subprocess.run([str(part) for part in command], check=True, capture_output=True, text=True).stdout


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--binary", type=Path, default=REPOSITORY / "target/dist/tactus-bench")
    parser.add_argument("--tactus", type=Path, default=REPOSITORY / "target/dist/tactus")
    parser.add_argument("--points", type=int, default=15, help="points along each side of the sweep")
    parser.add_argument("--rounds", type=int, default=5, help="the median of so many")
    return parser.parse_args()


if __name__ == "__main__":
    main()
