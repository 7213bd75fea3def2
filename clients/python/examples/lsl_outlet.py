"""Passes live frames on to the Lab Streaming Layer. Ctrl-C ends it.

python lsl_outlet.py --reachable
"""

import argparse
import sys

import tactus_client
from tactus_client.lsl import FrameOutlet


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--endpoint", help="default: the service of this machine")
    parser.add_argument("--reachable", action="store_true", help="LSL may take connections on all interfaces of this machine")
    options = parser.parse_args()

    try:
        with tactus_client.connect(options.endpoint) as client, FrameOutlet(client, is_reachable=options.reachable) as outlet:
            print(f"stream {outlet.info.name()!r}: {outlet.info.channel_count()} channels", flush=True)
            outlet.run()
    except (tactus_client.TactusError, ValueError) as error:
        sys.exit(str(error))
    except KeyboardInterrupt:
        pass
    return 0


if __name__ == "__main__":
    sys.exit(main())
