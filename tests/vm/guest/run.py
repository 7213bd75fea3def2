"""Runs all checks or those named in /lab/chosen. Each is a module `check_NAME`; its functions `check_...` run in order."""

import importlib
import sys
import time
import traceback
from pathlib import Path

import lab

# Short ones first.
ORDER = ["enumeration", "hid", "bulk", "streaming", "transports", "book", "ftdi", "unplug", "rates", "trouble"]


def main(chosen: list[str]) -> int:
    known = {path.stem.removeprefix("check_") for path in Path(__file__).parent.glob("check_*.py")}
    if unknown := set(chosen) - known or known - set(ORDER):
        print(f"FAIL no such checks, or not in run.py's ORDER: {sorted(unknown)}")
        return 1
    for name in chosen or ORDER:
        module = importlib.import_module(f"check_{name}")
        for function in [value for key, value in vars(module).items() if key.startswith("check_")]:
            start = time.monotonic()
            print(f"-- {function.__doc__}", flush=True)
            try:
                function()
            except Exception as error:
                # A check that cannot continue has failed; the others still run.
                lab.results["FAIL"] += 1
                where = "" if isinstance(error, lab.Hung) else traceback.format_exc()
                print(f"FAIL {function.__name__}: {error}\n{where}", flush=True)
            print(f"   {time.monotonic() - start:.1f} s", flush=True)
    print(f"{lab.results['ok']} ok, {lab.results['FAIL']} FAIL", flush=True)
    return 0 if lab.results["FAIL"] == 0 and lab.results["ok"] > 0 else 1


sys.exit(main(Path("/lab/chosen").read_text().split()))
