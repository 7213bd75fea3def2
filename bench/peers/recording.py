"""Frames per second to disk: Tactus, the bare `mcap` crate and h5py, in turns, with and without a sync for every second of frames.

The first two write the same protobuf messages in chunks of half a second (crates/tactus-record/examples/throughput.rs). h5py appends
rows of 48 single-precision numbers and a time to a chunked table, half a second at a time; it does not keep what a message has besides.
"""

import argparse
import json
import os
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

import h5py
import numpy as np

import machine

REPOSITORY = Path(__file__).parents[2]
CHUNK_FRAMES, SYNC_FRAMES = 15, 30
# The largest size beside the smallest, for the growth.
GROWTH = 4


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--binary", type=Path, default=REPOSITORY / "target/dist/examples/throughput")
    parser.add_argument("--frames", type=int, default=30_000)
    parser.add_argument("--rounds", type=int, default=5, help="the median of so many")
    parser.add_argument("--folder", type=Path, default=REPOSITORY / "target", help="on the disk that is measured")
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=args.folder) as folder:
        ways, larger = (throughput(args.binary, frames, folder) for frames in (args.frames, GROWTH * args.frames))
        for name, sync in (("h5py", False), ("h5py_synced", True)):
            rounds = [table(Path(folder) / "frames.h5", args.frames, sync) for _ in range(args.rounds)]
            ways[name] = {key: statistics.median(one[key] for one in rounds) for key in rounds[0]}
    times = lambda name: [(size, size / of[name]["frames_per_s"]) for size, of in ((args.frames, ways), (GROWTH * args.frames, larger))]
    growth = {name: machine.exponent(times(name)) for name in sorted(larger)}
    if args.json:
        described = machine.described(machine.versions("h5py", "numpy"))
        print(json.dumps({"machine": described, "frames": args.frames, "ways": ways, "growth": growth}, indent=1))
        return
    print(machine.described(machine.versions("h5py", "numpy")))
    print(f"{'who':<16}{'frames/s':>12}{'bytes/frame':>13}{'share of mcap':>15}")
    for name, way in sorted(ways.items()):
        bare = ways["mcap_synced" if name.endswith("_synced") else "mcap"]
        share = way["frames_per_s"] / bare["frames_per_s"]
        print(f"{name:<16}{way['frames_per_s']:>12,.0f}{way['bytes_per_frame']:>13.0f}{share:>15.2f}")
    for name, exponent in growth.items():
        print(f"{name}: time ~ frames^{exponent:.2f}, from {args.frames:,} to {GROWTH * args.frames:,}")


def throughput(binary, frames, folder):
    command = [binary, str(frames), folder]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)["ways"]


def table(path, frames, sync):
    readings = np.random.default_rng(1).normal(100, 2, (CHUNK_FRAMES, 48)).round().astype(np.float32)
    start = time.perf_counter()
    with h5py.File(path, "w") as file:
        options = {"chunks": (CHUNK_FRAMES, 48), "compression": "gzip", "compression_opts": 1}
        counts = file.create_dataset("counts", (0, 48), np.float32, maxshape=(None, 48), **options)
        times = file.create_dataset("t_ns", (0,), np.int64, maxshape=(None,), chunks=(CHUNK_FRAMES,))
        for first in range(0, frames, CHUNK_FRAMES):
            counts.resize(first + CHUNK_FRAMES, 0)
            times.resize(first + CHUNK_FRAMES, 0)
            counts[first:] = readings
            times[first:] = np.arange(first, first + CHUNK_FRAMES) * 33_333_333
            file.flush()
            if sync and (first + CHUNK_FRAMES) % SYNC_FRAMES == 0:
                os.fdatasync(file.id.get_vfd_handle())
    seconds = time.perf_counter() - start
    return {"frames_per_s": frames / seconds, "bytes_per_frame": path.stat().st_size / frames}


if __name__ == "__main__":
    main()
