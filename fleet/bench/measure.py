"""Ingests synthetic tables in growing sizes: rows/s, memory, bytes, and what a sum over all files takes in DuckDB. One JSON line for each size."""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

RUN_FRAMES = 18_000  # ten minutes


def timed(command, folder):
    """Wall seconds, processor seconds, largest memory in MB, and what a process printed."""
    begun = time.perf_counter()
    with tempfile.TemporaryFile("w+") as out:
        child = subprocess.Popen([str(word) for word in command], cwd=folder, stdout=out)
        _, status, usage = os.wait4(child.pid, 0)
        seconds = time.perf_counter() - begun
        if status != 0:
            sys.exit(f"{command} failed")
        out.seek(0)
        return seconds, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024, out.read()


def measure(programs, folder, runs):
    """One size: 4 rigs with so many runs each."""
    # Not above: the largest memory of a process begins with that of its parent, also for who imports this.
    import duckdb

    subprocess.run([programs / "examples/synthetic_tables", "tables", "4", str(runs), str(RUN_FRAMES)], cwd=folder, check=True)
    tables = sorted(folder.glob("tables/*"))
    ingest = [programs / "tactus-fleet", "--json", "ingest", *tables, "--to", "fleet"]
    seconds, _, memory_mb, told = timed(ingest, folder)
    told = json.loads(told)
    again_s, _, again_mb, _ = timed(ingest, folder)
    begun = time.perf_counter()
    ((rows,),) = duckdb.sql(
        f"SELECT count(*) FROM read_parquet('{folder}/fleet/*/*/*.parquet', hive_partitioning = true) WHERE counts[18] > 0"
    ).fetchall()
    duckdb_s = time.perf_counter() - begun
    assert rows == told["rows"], (rows, told)
    return {
        "rows": rows,
        "runs": told["runs_written"],
        "bytes_per_row": told["bytes"] / rows,
        "ingest_s": seconds,
        "rows_per_s": rows / seconds,
        "memory_mb": memory_mb,
        "again_s": again_s,
        "again_memory_mb": again_mb,
        "duckdb_s": duckdb_s,
    }


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--programs", type=Path, required=True, help="folder with tactus-fleet and examples/synthetic_tables")
    arguments.add_argument("--runs", type=int, nargs="+", default=[10, 20, 40], help="runs of each of four rigs, ten minutes each")
    args = arguments.parse_args()
    for runs in args.runs:
        folder = Path(tempfile.mkdtemp())
        try:
            print(json.dumps(measure(args.programs.absolute(), folder, runs)), flush=True)
        finally:
            shutil.rmtree(folder)


if __name__ == "__main__":
    main()
