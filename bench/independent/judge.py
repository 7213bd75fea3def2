"""Runs `tactus discover` on the sets of make.py, one after another or several at a time, and holds its reports against the labels.

A set whose report is there already is not run again; reports of another build or of other tables are refused. With `--document`, the
results replace what stands between the markers of a document. The program gets a state folder of its own, without a lab's own effects.
"""

import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

from score import judgement, totals
from show import markdown, page, text

BEGIN, END = "<!-- independent: begin -->", "<!-- independent: end -->"
DISCOVERY_SEED = 1


def main():
    args = arguments()
    labels = json.loads((args.sets / "labels.json").read_text())
    args.out.mkdir(parents=True, exist_ok=True)
    workers = ThreadPoolExecutor(args.jobs)
    try:
        rows = list(workers.map(partial(judged, args, digest(args.tactus)), sorted(labels.items())))
    finally:
        workers.shutdown(cancel_futures=True)
    (args.out / "judged.json").write_text(json.dumps(rows, indent=1) + "\n")
    facts = {
        "seed": rows[0]["seed"],
        "frames": [row["frames"] for row in rows],
        "presses": [row["presses"] for row in rows],
        "threads": args.threads,
        "jobs": args.jobs,
    }
    print(text(rows))
    print()
    print(markdown(("what", "sets"), totals(rows), is_aligned=True))
    if args.document:
        replace(args.document, page(rows, totals(rows), facts))


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tactus", type=Path, required=True, help="the program")
    parser.add_argument("--sets", type=Path, required=True, help="folder that make.py has written")
    parser.add_argument("--out", type=Path, required=True, help="folder for reports and judged.json")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="sets at a time")
    parser.add_argument("--threads", type=int, default=1, help="of each")
    parser.add_argument("--limit-s", type=float, default=1800.0, help="a set that takes longer has no report")
    parser.add_argument("--document", type=Path, help="Markdown file with the two markers")
    args = parser.parse_args()
    args.tactus = args.tactus.resolve()
    return args


def judged(args, program, listed):
    """The row of a set, which is run if it has no report."""
    name, label = listed
    table, folder, noted = args.sets / f"{name}.parquet", args.out / name, args.out / f"{name}.json"
    made = {"program": program, "table": digest(table)}
    ran = json.loads(noted.read_text()) if noted.exists() else {}
    if (folder / "report.json").exists():
        if ran and {key: ran[key] for key in made} != made:
            raise SystemExit(f"{folder} has the report of another build or of another table: take another folder")
    else:
        ran = {**made, **run(args, table, folder)}
        noted.write_text(json.dumps(ran, indent=1) + "\n")
    file = folder / "report.json"
    report = json.loads(file.read_text()) if file.exists() else None
    row = {
        "name": name,
        **{key: label[key] for key in ("seed", "label", "form", "frames", "presses")},
        "seconds": ran.get("seconds"),
        "peak_mib": ran.get("peak_mib"),
        **judgement(label["label"], report),
    }
    print(f"{name} {' + '.join(row['label'])}: {row['judgement']}", file=sys.stderr, flush=True)
    return row


def run(args, table, folder):
    """Runs the program on a table: wall seconds, greatest resident memory in MiB, exit status and its last words."""
    command = [args.tactus, "--json", "discover", "--threads", str(args.threads), "--seed", str(DISCOVERY_SEED)]
    with tempfile.TemporaryDirectory() as state, tempfile.TemporaryFile() as said:
        environment = {**os.environ, "XDG_STATE_HOME": state}
        for name in ("STATE_DIRECTORY", "TACTUS_LIBRARY"):
            environment.pop(name, None)
        started = time.perf_counter()
        program = subprocess.Popen(
            [*command, "--out", folder, table], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=said, env=environment
        )
        limit = threading.Timer(args.limit_s, program.kill)
        limit.start()
        _, status, usage = os.wait4(program.pid, 0)
        limit.cancel()
        seconds = time.perf_counter() - started
        # It has been waited for already.
        program.returncode = os.waitstatus_to_exitcode(status)
        said.seek(0)
        words = said.read().decode(errors="replace")[-2000:]
    return {"seconds": seconds, "peak_mib": usage.ru_maxrss / 1024, "exit": program.returncode, "said": words}


def digest(file):
    return hashlib.sha256(file.read_bytes()).hexdigest()


def replace(document, new):
    """Replaces what stands between the markers."""
    whole = document.read_text()
    if whole.count(BEGIN) != 1 or whole.count(END) != 1:
        raise SystemExit(f"{document} has not once each of {BEGIN} and {END}")
    before, rest = whole.split(BEGIN)
    _, after = rest.split(END)
    document.write_text(f"{before}{BEGIN}\n\n{new}\n\n{END}{after}")


if __name__ == "__main__":
    main()
