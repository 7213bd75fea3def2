"""Counts frames and lost frames; prints one line of JSON. Exit status 1 if the bus lost any or too few came.

python count_frames.py --frames 300
python count_frames.py --seconds 10
"""

import argparse
import json
import sys
import time

import tactus_client

#: Give up after this time without a frame.
PATIENCE_S = 10.0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--endpoint", help="default: the service of this machine")
    parser.add_argument("--rig", help="default: the one that is ready")
    length = parser.add_mutually_exclusive_group(required=True)
    length.add_argument("--frames", type=int, help="stop after this number of frames")
    length.add_argument("--seconds", type=float, help="stop after this time")
    options = parser.parse_args()

    try:
        client = tactus_client.connect(options.endpoint, options.rig)
    except (tactus_client.TactusError, ValueError) as error:
        sys.exit(str(error))
    with client, client.frames() as frames:
        tally = frames.tally
        if options.frames is not None:
            while tally.received < options.frames:
                if frames.receive(PATIENCE_S) is None:
                    print(f"no frame for {PATIENCE_S} s", file=sys.stderr)
                    break
        else:
            end = time.monotonic() + options.seconds
            while (left_s := end - time.monotonic()) > 0:
                frames.receive(left_s)
        print(
            json.dumps(
                {
                    "rig": client.rig,
                    "frames": tally.received,
                    "device_lost": tally.device_lost,
                    "bus_missing": tally.bus_missing,
                    "first_seq": tally.first_seq,
                    "last_seq": tally.last_seq,
                    "restarts": tally.restarts,
                }
            )
        )
        short = options.frames is not None and tally.received < options.frames
        return 1 if tally.bus_missing or short else 0


if __name__ == "__main__":
    sys.exit(main())
