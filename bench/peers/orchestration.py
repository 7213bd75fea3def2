"""Presses per second of a scripted run without real devices: Tactus on the embedded rig in virtual time, beside bluesky on ophyd.sim.

Tactus plans, checks against the envelope, moves in confirmed steps, simulates the covering and 30 frames per second, supervises and
records. bluesky's `grid_scan` sets two simulated axes without delay, reads one detector, and hands documents to one subscriber, which
counts them. So one point of bluesky stands beside one press. `tactus plan` is the dry run alone, on the rig's twin.
"""

import argparse
import json
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--binary", type=Path, default=REPOSITORY / "target/dist/tactus")
    parser.add_argument("--rounds", type=int, default=5, help="the median of so many")
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    args.binary = args.binary.resolve()
    ways = {"tactus run": [], "tactus plan": [], "bluesky": []}
    for _ in range(args.rounds):
        ways["tactus run"].append(tactus(args.binary, "run", "--embedded", "--no-report"))
        ways["tactus plan"].append(tactus(args.binary, "plan"))
        ways["bluesky"].append(bluesky())
    result = {who: {key: statistics.median(one[key] for one in all_) for key in all_[0]} for who, all_ in ways.items()}
    if args.json:
        print(json.dumps(result, indent=1))
        return
    print(f"{'who':<14}{'presses':>9}{'s':>9}{'presses/s':>12}{'to bluesky':>12}")
    for who, one in result.items():
        ratio = one["per_s"] / result["bluesky"]["per_s"]
        print(f"{who:<14}{one['presses']:>9.0f}{one['s']:>9.3f}{one['per_s']:>12,.0f}{ratio:>12.1f}")


def tactus(binary, command, *options):
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        done = subprocess.run([binary, command, "grid-sweep", *options, "--json"], cwd=folder, capture_output=True, text=True)
        seconds = time.perf_counter() - start
    if done.returncode:
        raise SystemExit(done.stderr)
    presses = json.loads(done.stdout)["presses"]
    return {"presses": presses, "s": seconds, "per_s": presses / seconds}


def bluesky(across=20):
    from bluesky import RunEngine
    from bluesky.plans import grid_scan
    from ophyd.sim import det, motor1, motor2

    events = []
    engine = RunEngine({})
    engine.subscribe(lambda name, _: events.append(name), "event")
    start = time.perf_counter()
    engine(grid_scan([det], motor1, 0, 1, across, motor2, 0, 1, across))
    seconds = time.perf_counter() - start
    return {"presses": len(events), "s": seconds, "per_s": len(events) / seconds}


if __name__ == "__main__":
    main()
