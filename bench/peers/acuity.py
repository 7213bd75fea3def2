"""Both panels of Fig. 6 with 25 x 25 cells: Tactus and a plain numpy program, in turns on one machine.

The numpy program takes every step that the paper describes, all steps of a search in one array (or in arrays that
double until the change is found), and counts with numpy.unique. Both use the grid of Tactus; all values are compared.
"""

import os

# One thread in every process. Must stand before numpy is loaded.
os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", MKL_NUM_THREADS="1")

import argparse
import json
import statistics
import subprocess
import time
from pathlib import Path

import numpy as np
from scipy.special import ndtr

import machine

REPOSITORY = Path(__file__).parents[2]
EDGES = np.arange(-2, 4)
OFFSETS = np.arange(10) / 10
STEP = 0.02


def main():
    args = arguments()
    rounds = [one_round(args.binary) for _ in range(args.rounds)]
    result = {
        "machine": machine.machine(),
        "versions": machine.versions("numpy", "scipy"),
        **{key: statistics.median(one[key] for one in rounds) for key in rounds[0]},
    }
    for panel in ("locations", "separations", "both"):
        result[f"{panel}_ratio_one_core"] = result[f"{panel}_numpy_s"] / result[f"{panel}_one_core_s"]
        result[f"{panel}_ratio"] = result[f"{panel}_numpy_s"] / result[f"{panel}_s"]
    if args.json:
        print(json.dumps(result, indent=1))
    else:
        print(result["machine"], result["versions"])
        print(f"{'panel':<14}{'numpy s':>10}{'ours, 1 core':>14}{'all cores':>12}{'ratio, 1 core':>15}{'ratio':>8}")
        for panel in ("locations", "separations", "both"):
            print(
                f"{panel:<14}{result[f'{panel}_numpy_s']:>10.3f}{result[f'{panel}_one_core_s']:>14.4f}"
                f"{result[f'{panel}_s']:>12.4f}{result[f'{panel}_ratio_one_core']:>15.0f}{result[f'{panel}_ratio']:>8.0f}"
            )
        print(f"cells of 1250 that differ: {result['differ']:.0f}")


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--binary", type=Path, default=REPOSITORY / "target/dist/tactus-bench")
    parser.add_argument("--rounds", type=int, default=5, help="the median of so many")
    parser.add_argument("--json", action="store_true")
    return parser.parse_args()


def one_round(binary):
    core = min(os.sched_getaffinity(0))
    one_core = ask("taskset", "-c", str(core), binary)
    ours = ask(binary)
    cells = [(sigma, f) for f in ours["force_resolutions"] for sigma in ours["sigmas"]]
    locations, locations_s = timed(lambda: [count(sigma, f) for sigma, f in cells])
    separations, separations_s = timed(
        lambda: [np.mean([separation(offset, sigma, f) for offset in OFFSETS]) for sigma, f in cells]
    )
    ours_separations = np.array(ours["separations"], float)
    differ = np.count_nonzero(np.array(locations) != ours["locations"])
    differ += np.count_nonzero(~np.isclose(separations, ours_separations, rtol=1e-9, equal_nan=True))
    seconds = {
        "locations_numpy_s": locations_s,
        "separations_numpy_s": separations_s,
        "both_numpy_s": locations_s + separations_s,
    }
    for name, said in (("_one_core", one_core), ("", ours)):
        a, b = said["panels_s"]
        seconds |= {f"locations{name}_s": a, f"separations{name}_s": b, f"both{name}_s": a + b}
    return {"differ": int(differ), **seconds}


def count(sigma, f):
    """Distinct readings as a point goes over one element."""
    at = np.arange(int(1 / (STEP * f) * (1 + 1e-12)) + 1) * (STEP * f)
    readings = rounded(shares(at, sigma), f).astype(np.int64)
    # One number a reading is much faster to count than a row of five.
    return len(np.unique(readings @ (1 << (12 * np.arange(5)))))


def separation(offset, sigma, f):
    """How far two points part until they read otherwise; not a number if never."""
    def read(steps):
        half = steps * (STEP * f) / 2
        return rounded(shares(offset - half, sigma) + shares(offset + half, sigma), f)

    together = read(np.zeros(1))[0]
    first, many, last = 1, 256, (10 + 18 * sigma) / (STEP * f)
    while first <= last:
        changed = (read(np.arange(first, first + many)) != together).any(axis=1)
        if changed.any():
            return (first + changed.argmax()) * (STEP * f)
        first, many = first + many, min(2 * many, 8192)
    return np.nan


def shares(at, sigma):
    """What each of five elements has of a Gaussian at each place."""
    return np.diff(ndtr((EDGES - at[:, None]) / sigma), axis=1)


def rounded(values, f):
    return np.floor(values / f + 0.5)


def ask(*command):
    done = subprocess.run([*command, "acuity", "--json"], check=True, capture_output=True)
    return json.loads(done.stdout)


def timed(work):
    started = time.perf_counter()
    done = work()
    return done, time.perf_counter() - started


if __name__ == "__main__":
    main()
