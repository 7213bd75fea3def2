"""Presses, points and readings per second of a script without real devices: Tactus on the embedded rig in virtual time, beside bluesky on
ophyd.sim.

Tactus plans, checks against the envelope, moves in confirmed steps, simulates the covering and 30 frames per second, supervises and
records. bluesky's `grid_scan` sets two simulated axes without delay, reads one detector, and hands documents to one subscriber, which
counts them; `count` reads the detector only. A press is held against a point of `grid_scan`, although it is some hundred frames;
`points.star` moves and reads as `grid_scan` does, and `readings.star` reads as `count` does. `tactus plan` is the dry run alone, on the
rig's twin; it records nothing.
"""

import argparse
import json
import resource
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

from machine import described, exponent, versions

REPOSITORY = Path(__file__).parents[2]
HERE = Path(__file__).parent

# What is counted, the script, and how often the script does it; `None`: as often as the program says.
WORKS = {"presses": ("grid-sweep", None), "points": (HERE / "points.star", 100 * 100), "readings": (HERE / "readings.star", 10_000)}

# Sizes of the works that have one, for the growth: a quarter of them and all.
SIZES = {"points": [("across=50", 50 * 50), ("across=100", 100 * 100)], "readings": [("readings=2500", 2_500), ("readings=10000", 10_000)]}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--binary", type=Path, default=REPOSITORY / "target/dist/tactus")
    parser.add_argument("--rounds", type=int, default=5, help="the median of so many")
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    args.binary = args.binary.resolve()
    rows = []
    for _ in range(args.rounds):
        grid_scan, count = bluesky()
        peers = {"presses": grid_scan, "points": grid_scan, "readings": count}
        for work in WORKS:
            rows.append((work, "tactus run", tactus(args.binary, work, "run", "--embedded", "--no-report")))
            rows.append((work, "tactus plan", tactus(args.binary, work, "plan")))
            rows.append((work, "bluesky", peers[work]))
    result = {}
    for work, who, one in rows:
        result.setdefault(work, {}).setdefault(who, []).append(one)
    for ways in result.values():
        for who, rounds in ways.items():
            ways[who] = {key: statistics.median(one[key] for one in rounds) for key in rounds[0]}
    growth = {work: growth_of(args.binary, work, args.rounds) for work in SIZES}
    if args.json:
        machine = described(versions("bluesky", "ophyd"))
        print(json.dumps({"machine": machine, "works": result, "growth": growth}, indent=1))
        return
    print(described(versions("bluesky", "ophyd")))
    print(f"{'what':<10}{'who':<14}{'done':>9}{'s':>9}{'a second':>12}{'to bluesky':>12}")
    for work, ways in result.items():
        for who, one in ways.items():
            ratio = one["per_s"] / ways["bluesky"]["per_s"]
            print(f"{work:<10}{who:<14}{one['done']:>9.0f}{one['s']:>9.3f}{one['per_s']:>12,.0f}{ratio:>12.1f}")
    for work, ways in growth.items():
        for who, power in ways.items():
            print(f"{who} of {work}: processor time ~ {work}^{power:.2f}")


def growth_of(binary, work, rounds):
    """With which power of the number of steps the processor time grows, that of the script's process and of the programs' start included."""
    powers = {}
    for command, options in (("run", ["--embedded", "--no-report"]), ("plan", [])):
        times = []
        for parameter, done in SIZES[work]:
            one = lambda: tactus(binary, work, command, *options, "--param", parameter, done=done)["processor_s"]
            times.append((done, statistics.median(one() for _ in range(rounds))))
        powers[f"tactus {command}"] = exponent(times)
    return powers


def tactus(binary, work, command, *options, done=None):
    script, usual = WORKS[work]
    done = done or usual
    with tempfile.TemporaryDirectory() as folder:
        start, before = time.perf_counter(), used()
        ended = subprocess.run([binary, command, script, *options, "--json"], cwd=folder, capture_output=True, text=True)
        seconds, processor_s = time.perf_counter() - start, used() - before
    if ended.returncode:
        raise SystemExit(ended.stderr)
    told = json.loads(ended.stdout)
    done = done or told["presses"]
    # A run of points has at least a frame for each.
    if told["exit_status"] != "done" or told.get("frames", done) < done:
        raise SystemExit(f"{script}: {ended.stdout}")
    return {"done": done, "s": seconds, "per_s": done / seconds, "processor_s": processor_s}


def used():
    """Processor time of all programs that have ended."""
    ended = resource.getrusage(resource.RUSAGE_CHILDREN)
    return ended.ru_utime + ended.ru_stime


def bluesky(across=20, readings=400):
    """A raster of `across` by `across` points, and `readings` of one place."""
    from bluesky import RunEngine
    from bluesky.plans import count, grid_scan
    from ophyd.sim import det, motor1, motor2

    events = []
    engine = RunEngine({})
    engine.subscribe(lambda name, _: events.append(name), "event")

    def timed(plan):
        events.clear()
        start = time.perf_counter()
        engine(plan)
        seconds = time.perf_counter() - start
        return {"done": len(events), "s": seconds, "per_s": len(events) / seconds}

    return timed(grid_scan([det], motor1, 0, 1, across, motor2, 0, 1, across)), timed(count([det], readings))


if __name__ == "__main__":
    main()
