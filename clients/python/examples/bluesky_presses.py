"""Presses a few elements with a Bluesky plan; each press is a run of the service. Prints one line of JSON per document.

python bluesky_presses.py --elements 18 27 --depth-mm 0.3
"""

import argparse
import json
import sys

import bluesky.plan_stubs as bps
import bluesky.preprocessors as bpp
import numpy as np
from bluesky import RunEngine
from ophyd_async.core import init_devices

import tactus_client
from tactus_client.ophyd import Press, Presser, TactileArray


def press_elements(presser, array, places, depth_mm):
    """Presses each place, and reads the array at rest after each press."""

    @bpp.stage_decorator([presser, array])
    @bpp.run_decorator(md={"plan_name": "press_elements", "depth_mm": depth_mm})
    def inner():
        for x_mm, y_mm in places:
            yield from bps.mv(presser, Press(x_mm, y_mm, depth_mm))
            yield from bps.trigger_and_read([presser, array])

    return (yield from inner())


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--endpoint", help="default: the service of this machine")
    parser.add_argument("--elements", type=int, nargs="+", default=[18, 27], help="indices, row by row")
    parser.add_argument("--depth-mm", type=float, default=0.3)
    options = parser.parse_args()

    with tactus_client.connect(options.endpoint) as client:
        rig = client.status().description
        columns = len(rig.col_centres_mm)
        places = [(rig.col_centres_mm[element % columns], rig.row_centres_mm[element // columns]) for element in options.elements]
        run_engine = RunEngine({"rig": client.rig, "simulated": client.status().simulated})
        with init_devices():
            array = TactileArray(client)
            presser = Presser(client)
        run_engine(press_elements(presser, array, places, options.depth_mm), print_document)
    return 0


def print_document(name, document):
    """One document of the plan, with its kind, as a line of JSON."""
    print(json.dumps([name, document], default=lambda value: np.asarray(value).tolist()), flush=True)


if __name__ == "__main__":
    sys.exit(main())
