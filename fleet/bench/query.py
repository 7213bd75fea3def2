"""Asks a fleet of synthetic runs in growing sizes, beside DuckDB: seconds, rows/s and the largest memory. One JSON line for each query, size and engine.

What the disk and the memory give is measured first; after that all files are in the system's memory, for both engines.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from measure import RUN_FRAMES, timed

DAYS = 28
RIGS = 4

SCAN = "SELECT phase, count(*) AS frames, avg(counts[18]) AS mean, max(counts[18]) AS largest FROM frames {} GROUP BY phase ORDER BY phase"
WEEK = "WHERE rig = 'rig-1' AND date BETWEEN '2026-03-05' AND '2026-03-11'"
ELEMENTS = """SELECT rig, element, avg(counts) AS mean FROM
    (SELECT rig, unnest(range(1, 49)) AS element, unnest(counts) AS counts FROM frames WHERE phase = 'hold')
    GROUP BY rig, element ORDER BY rig, element"""
IMAGES = "SELECT rig, image(counts) AS image FROM frames WHERE phase = 'hold' GROUP BY rig ORDER BY rig"
RESIDUALS = "SELECT rig, count(*) AS frames, avg(rms(residual)) AS rms FROM predicted('model.toml') WHERE phase = 'hold' GROUP BY rig ORDER BY rig"
SORT = "SELECT sum(place % 1000 * (t_ns % 1000003)) AS sum FROM (SELECT t_ns, row_number() OVER (ORDER BY counts[18], x_mm, rig, run, t_ns) AS place FROM frames)"

# Name, SQL of Tactus, SQL of DuckDB.
QUERIES = [
    ("scan", SCAN.format(""), SCAN.format("")),
    ("a rig's week", SCAN.format(WEEK), SCAN.format(WEEK)),
    ("elements", ELEMENTS, ELEMENTS),
    ("image()", IMAGES, None),
    ("predicted()", RESIDUALS, None),
    ("sort", SORT, SORT),
]

DUCKDB = """
import json, sys, duckdb
folder, threads, sql = sys.argv[1:]
con = duckdb.connect(config={"threads": int(threads)})
con.execute("SET enable_progress_bar = false")
con.sql(f"CREATE VIEW frames AS SELECT * FROM read_parquet('{folder}/*/*/*.parquet', hive_partitioning = true)")
rows = con.sql(sql)
for row in rows.fetchall():
    print(json.dumps(dict(zip(rows.columns, row)), default=str))
"""


def same(one, other):
    """True if two answers are equal; sums of floats depend on their order."""
    for left, right in zip(one, other, strict=True):
        assert left.keys() == right.keys()
        for key, value in left.items():
            if isinstance(value, float):
                assert abs(value - right[key]) <= 1e-9 * abs(value), (left, right)
            else:
                assert value == right[key], (left, right)
    return True


def read_mb_per_s(files):
    """How fast the files are read, one after the other."""
    begun = time.perf_counter()
    read = 0
    for file in files:
        with open(file, "rb", buffering=0) as bytes_of:
            while part := bytes_of.read(1 << 20):
                read += len(part)
    return read / (time.perf_counter() - begun) / 1e6


def limits(files):
    """What the disk and the memory give."""
    subprocess.run(["sync"], check=True)
    for file in files:
        with open(file, "rb") as one:
            os.posix_fadvise(one.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
    told = {"disk_mb_per_s": read_mb_per_s(files), "cached_mb_per_s": read_mb_per_s(files)}
    block = bytearray(256 << 20)
    begun = time.perf_counter()
    bytes(block)
    told["memory_mb_per_s"] = 2 * len(block) / (time.perf_counter() - begun) / 1e6
    return told


def measure(programs, folder, fleet, files, threads, query):
    """One query in one size, asked of both."""
    name, sql, of_duckdb = query
    ours = [programs / "tactus-fleet", "--json", "--threads", threads, "query", "--at", fleet, sql]
    theirs = [sys.executable, "-c", DUCKDB, folder / fleet, threads, of_duckdb]
    answers = {}
    for engine, command in [("tactus", ours), ("duckdb", theirs)]:
        if engine == "duckdb" and of_duckdb is None:
            continue
        seconds, processor_s, memory_mb, out = timed(command, folder)
        answers[engine] = [json.loads(line) for line in out.splitlines()]
        rows = len(files) * RUN_FRAMES
        told = {
            "query": name,
            "engine": engine,
            "mb": sum(file.stat().st_size for file in files) / 1e6,
            "rows": rows,
            "seconds": round(seconds, 3),
            "rows_per_s": round(rows / seconds),
            "cores": round(processor_s / seconds, 2),
            "memory_mb": round(memory_mb),
        }
        print(json.dumps(told), flush=True)
    if len(answers) == 2:
        same(answers["tactus"], answers["duckdb"])


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--programs", type=Path, required=True, help="folder with tactus-fleet and examples/synthetic_tables")
    arguments.add_argument("--model", type=Path, required=True, help="model of predicted()")
    arguments.add_argument("--runs", type=int, nargs="+", default=[1, 2, 5, 10], help="runs of each of four rigs on each of 28 days, ten minutes each; the sizes")
    arguments.add_argument("--threads", type=int, default=os.cpu_count())
    args = arguments.parse_args()
    programs = args.programs.absolute()
    folder = Path(tempfile.mkdtemp())
    try:
        shutil.copy(args.model, folder / "model.toml")
        all_runs = str(max(args.runs) * DAYS)
        subprocess.run([programs / "examples/synthetic_tables", "tables", str(RIGS), all_runs, str(RUN_FRAMES)], cwd=folder, check=True)
        subprocess.run([programs / "tactus-fleet", "ingest", *sorted(folder.glob("tables/*")), "--to", "fleet"], cwd=folder, check=True)
        shutil.rmtree(folder / "tables")
        files = sorted((folder / "fleet").glob("*/*/*.parquet"))
        # In a process of its own, because the largest memory of a process begins with that of its parent.
        with ProcessPoolExecutor(1) as pool:
            print(json.dumps(pool.submit(limits, files).result()), flush=True)
        sizes = {}
        for runs in sorted(args.runs):
            sizes[f"fleet-{runs}"] = part = []
            for file in files:
                # `20260301-000002-rig-0`: the third run of that day.
                if int(file.name.split("-")[1]) < runs:
                    link = folder / f"fleet-{runs}" / file.relative_to(folder / "fleet")
                    link.parent.mkdir(parents=True, exist_ok=True)
                    link.hardlink_to(file)
                    part.append(link)
        for query in QUERIES:
            for fleet, part in sizes.items():
                measure(programs, folder, fleet, part, args.threads, query)
    finally:
        shutil.rmtree(folder)


if __name__ == "__main__":
    main()
