"""Makes the sets of another program than ours: measurement tables with hidden physics, and `labels.json`, which says what is hidden.

The paper's physics and all hidden physics are written here anew, in numpy, from the paper and from textbooks. The seed decides the order
of the names, rigs, paths, noise, and the parameters of the hidden physics. A name is that of a set (`blind-07`) or an effect.
"""

import os

# One thread. Must stand before numpy is loaded.
os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", MKL_NUM_THREADS="1")

import argparse
import itertools
import json
import time
from pathlib import Path as File

import numpy as np

from path import Path
from physics import Hidden, digitise, noise, simulate
from rig import ELEMENTS, FINE, Rig
from sets import SPECS, drawn
from table import write

FRAMES_MAX = 42_000
THICK_MM = 2.54
NOISES = (("white", 1.0), ("white", 1.5), ("white", 2.0), ("ar1", 1.2), ("white", 1.2), ("ar1", 1.6), ("white", 1.8))
# These get no noise but rounding.
QUIET = (["miswired"], ["edge-effect"], ["saturation"])
# What the seeds of a set are for.
ORDER, MEASUREMENT, PARAMETERS = range(3)


def main():
    args = arguments()
    args.out.mkdir(parents=True, exist_ok=True)
    listed = args.out / "labels.json"
    labels = json.loads(listed.read_text()) if listed.exists() else {}
    if any(label["seed"] != args.seed for label in labels.values()):
        raise SystemExit(f"{args.out} has sets of another seed")
    order = np.random.default_rng([args.seed, ORDER]).permutation(len(SPECS))
    for number, index in enumerate(order.tolist(), 1):
        name, spec = f"blind-{number:02}", SPECS[index]
        if args.names and not {name, *spec.labels} & set(args.names):
            continue
        started = time.perf_counter()
        parameters = drawn(spec, np.random.default_rng([args.seed, PARAMETERS, index]))
        rng = np.random.default_rng([args.seed, MEASUREMENT, index])
        rig, path, counts, facts = made(spec, parameters, rng, f"rig-{number:02}")
        write(args.out / f"{name}.parquet", rig, path, counts)
        labels[name] = {"seed": args.seed, "label": spec.labels, "form": spec.form, "parameters": parameters, **facts}
        seconds = time.perf_counter() - started
        print(
            f"{name} {' + '.join(spec.labels):<32} {facts['frames']:>6} frames {facts['presses']:>4} presses {seconds:>6.1f} s", flush=True
        )
    listed.write_text(json.dumps(labels, indent=1, sort_keys=True) + "\n")


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--out", type=File, required=True, help="folder for the tables and labels.json")
    parser.add_argument("names", nargs="*", metavar="NAME", help="only these sets or effects; other labels are kept")
    return parser.parse_args()


def made(spec, parameters, rng, rig_name):
    """A set: its rig, its path, its counts, and facts about it."""
    rig = Rig(rng, rig_name, **rig_options(spec, rng))
    depth_max_mm = 0.6 if rig.thickness_mm < 2 else 0.9
    speeds = (float(rng.choice([0.2, 0.25, 0.3, 0.4])), float(rng.choice([0.8, 1.0, 1.5, 2.0])))
    for fewer in itertools.count(0, 10):
        path = Path(rng, rig, int(rng.integers(27, 48)) - fewer, int(rng.integers(8, 18)), speeds, depth_max_mm)
        if path.frames <= FRAMES_MAX:
            break
    plain, _ = simulate(rig, path, Hidden())
    noise_counts = noise(rng, path.frames, *rig.noise)
    hidden = spec.hidden(**parameters)
    clean, scene = simulate(rig, path, hidden)
    counts = digitise(rig, clean, noise_counts, lambda counts: hidden.converter(scene, counts))
    effect = clean - plain
    if not effect.any():
        # Of the converter, or none.
        effect = counts - digitise(rig, plain, noise_counts)
    facts = {
        "noise": rig.noise[0],
        "noise_rms_counts": rig.noise[1],
        "frames": path.frames,
        "presses": len(path.places_mm),
        "covering_mm": rig.thickness_mm,
        "tool_mm": rig.tool_mm,
        "sigma_mm": round(rig.sigma_mm, 4),
        "speeds_mm_per_s": speeds,
        "depth_max_mm": depth_max_mm,
        "greatest_counts": float(counts.max()),
        "effect_rms_counts": rms(effect),
        "effect_in_contact_rms_counts": rms(effect[path.positions_mm[::FINE, 2] < 0]),
        "effect_left_rms_counts": rms(left_by_recalibration(effect, plain)),
    }
    return rig, path, counts, facts


def rig_options(spec, rng):
    """The options of a set's rig: noise of any kind, and a thick covering of a fifth of them."""
    options = dict(spec.options)
    if "noise" not in options:
        options["noise"] = NOISES[int(rng.integers(len(NOISES)))]
        if spec.labels in QUIET:
            options["noise"] = ("quantised", 0.0)
    may_be_thick = not {"thickness_mm", "tool_mm"} & set(options) and spec.labels != ["hardening"]
    if may_be_thick and rng.random() < 0.2:
        options["thickness_mm"] = THICK_MM
    return options


def left_by_recalibration(effect, plain):
    """What zero, gain and a quadratic term of each element leave of the effect, in counts."""
    left = effect.copy()
    for element in range(ELEMENTS):
        terms = np.column_stack([np.ones(len(plain)), plain[:, element], plain[:, element] ** 2 / 500])
        left[:, element] -= terms @ np.linalg.lstsq(terms, effect[:, element], rcond=None)[0]
    return left


def rms(values):
    return round(float(np.sqrt(np.mean(values**2))), 3)


if __name__ == "__main__":
    main()
