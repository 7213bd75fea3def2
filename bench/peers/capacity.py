"""How many sensors one Python process carries: frames from sockets to ZeroMQ and to disk, without a loss.

`tactus-bench devices` serves the same sensors as for `tactus-bench rigs`: 48 elements at 30 Hz, each behind a socket. One process reads
all of them by epoll, cuts frames by their length, makes arrays of them, publishes each with pyzmq and appends it to a file of its
sensor. Unlike a service of Tactus it checks no sum, has no stage, supervises nothing and answers nobody. Another process subscribes and counts
by the sensors' own clocks. The number of sensors doubles until a frame is lost or the rate falls by 2 %, and then the distance is halved.
"""

import argparse
import json
import selectors
import socket
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from latency import free_port, used
from machine import described, versions

REPOSITORY = Path(__file__).parents[2]
RATE_HZ = 30
FRAME_BYTES = 109
# Has a `weiss-dsa` controller send 30 frames a second, with its check sum.
ACQUIRE = bytes.fromhex("aaaaaa030300801e008e1c")


def main():
    if sys.argv[1:2] == ["--part"]:
        return PARTS[sys.argv[2]](*sys.argv[3:])
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--binary", type=Path, default=REPOSITORY / "target/dist/tactus-bench")
    parser.add_argument("--sensors", type=int, default=50, help="so many at first")
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--halvings", type=int, default=3)
    args = parser.parse_args()
    print(described(versions("pyzmq", "numpy")))
    print(f"{'sensors':>8}{'frames/s':>10}{'lost':>7}{'cores':>7}")
    whole, broken = 0, None
    sensors = args.sensors
    for _ in range(20):
        measured = measure(args, sensors)
        print(f"{sensors:>8}{measured['frames_per_s']:>10.0f}{measured['lost']:>7}{measured['cores']:>7.2f}", flush=True)
        if measured["lost"] == 0 and measured["frames_per_s"] > 0.98 * RATE_HZ * sensors:
            whole = sensors
        else:
            broken = sensors
        if broken is None:
            sensors *= 2
            continue
        if args.halvings == 0:
            break
        args.halvings -= 1
        sensors = (whole + broken) // 2
    print(f"{whole} sensors without a loss")


def measure(args, sensors):
    devices = subprocess.Popen([args.binary, "devices", str(sensors)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    addresses = json.loads(devices.stdout.readline())
    me = [sys.executable, __file__, "--part"]
    with tempfile.TemporaryDirectory() as folder:
        port = str(free_port())
        (Path(folder) / "addresses.json").write_text(json.dumps(addresses))
        passes = subprocess.Popen([*me, "passes", folder, port], stdout=subprocess.PIPE, text=True)
        passes.stdout.readline()
        hears = subprocess.run([*me, "hears", port, str(args.seconds)], capture_output=True, text=True, check=True)
        # Its whole time; connecting is a small part of it.
        spent_s = used(passes.pid)["cpu_s"]
        passes.kill()
        passes.wait()
    devices.stdin.close()
    devices.wait()
    heard = json.loads(hears.stdout)
    return {**heard, "cores": spent_s / (args.seconds * 1.5)}


def passes(folder, port):
    import numpy as np
    import zmq

    publisher = zmq.Context().socket(zmq.PUB)
    publisher.setsockopt(zmq.SNDHWM, 1_000_000)
    publisher.bind(f"tcp://127.0.0.1:{port}")
    selector = selectors.EpollSelector()
    for number, address in enumerate(json.loads((Path(folder) / "addresses.json").read_text())):
        host, _, its_port = address.rpartition(":")
        line = socket.create_connection((host, int(its_port)))
        line.sendall(ACQUIRE)
        line.setblocking(False)
        rig = [line, bytearray(), open(Path(folder) / f"{number}.bin", "wb", buffering=1 << 14), struct.pack("<I", number)]
        selector.register(line, selectors.EVENT_READ, rig)
    print("ready", flush=True)
    head = b"\xaa\xaa\xaa" + struct.pack("<BH", 0, FRAME_BYTES - 8)
    while True:
        for key, _ in selector.select():
            line, buffer, file, name = key.data
            buffer += line.recv(1 << 14)
            while True:
                at = buffer.find(head)
                if at < 0 or len(buffer) < at + FRAME_BYTES:
                    break
                frame = bytes(buffer[at : at + FRAME_BYTES])
                del buffer[: at + FRAME_BYTES]
                counts = np.frombuffer(frame, "<u2", 48, 11).astype(np.float32)
                message = name + frame[6:10] + counts.tobytes()
                publisher.send(message)
                file.write(message)


def hears(port, seconds):
    import zmq

    subscriber = zmq.Context().socket(zmq.SUB)
    subscriber.setsockopt(zmq.RCVHWM, 1_000_000)
    subscriber.setsockopt(zmq.SUBSCRIBE, b"")
    subscriber.connect(f"tcp://127.0.0.1:{port}")
    time.sleep(float(seconds) / 2)
    seen = {}
    begin = time.monotonic()
    # What has waited until now is not of this time.
    while True:
        try:
            subscriber.recv(zmq.NOBLOCK)
        except zmq.Again:
            break
        if time.monotonic() - begin > float(seconds):
            break
    begin = time.monotonic()
    while time.monotonic() - begin < float(seconds):
        if not subscriber.poll(100):
            continue
        number, at_ms = struct.unpack_from("<II", subscriber.recv())
        of = seen.setdefault(number, [at_ms, at_ms, 0])
        of[1] = at_ms
        of[2] += 1
    lasted_s = time.monotonic() - begin
    lost = sum(round((last - first) * RATE_HZ / 1000) + 1 - count for first, last, count in seen.values())
    frames = sum(count for _, _, count in seen.values())
    print(json.dumps({"frames_per_s": frames / lasted_s, "lost": lost}))


PARTS = {"passes": passes, "hears": hears}

if __name__ == "__main__":
    main()
