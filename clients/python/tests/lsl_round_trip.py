"""Frames from a publisher to an inlet of LSL, in a network of its own: lsl_round_trip.py PULSE. Prints what arrived as JSON.

LSL listens on all interfaces; here the only one is loopback.
"""

import fcntl
import json
import socket
import struct
import subprocess
import sys
import threading

import pylsl

import tactus_client
from tactus_client.lsl import FrameOutlet

SIOCSIFFLAGS = 0x8914
IFF_UP = 1
ENDPOINT = "tcp/127.0.0.1:7447"


def main() -> None:
    with socket.socket() as any_socket:
        fcntl.ioctl(any_socket, SIOCSIFFLAGS, struct.pack("16sh14x", b"lo", IFF_UP))
    assert [name for _, name in socket.if_nameindex()] == ["lo"], "this would be reachable from elsewhere"
    pulse = subprocess.Popen([sys.argv[1], ENDPOINT, "200", "10"], stdout=subprocess.PIPE, text=True)
    try:
        pulse.stdout.readline()
        with tactus_client.connect(ENDPOINT) as client, FrameOutlet(client, is_reachable=True) as outlet:
            pushed = []
            push = outlet.push
            outlet.push = lambda frame: (pushed.append(frame), push(frame))
            passing = threading.Thread(target=outlet.run)
            passing.start()
            (found,) = pylsl.resolve_byprop("type", "Tactile", timeout=30)
            inlet = pylsl.StreamInlet(found)
            samples = [inlet.pull_sample(timeout=30) for _ in range(200)]
            about = inlet.info().desc().child("tactus")
            outlet.close()
            passing.join()
        counts = [list(frame.counts) for frame in pushed]
        first = next(at for at in range(len(pushed)) if counts[at : at + 200] == [sample for sample, _ in samples])
        sent_s = [frame.t_wall_ns * 1e-9 for frame in pushed[first : first + 200]]
        print(
            json.dumps(
                {
                    "name": found.name(),
                    "channels": found.channel_count(),
                    "rate_hz": found.nominal_srate(),
                    "simulated": about.child_value("simulated"),
                    # The publisher's wall clock counts from its start.
                    "offsets_s": [at - sent for (_, at), sent in zip(samples, sent_s)],
                }
            )
        )
    finally:
        pulse.terminate()
        pulse.communicate()


if __name__ == "__main__":
    main()
