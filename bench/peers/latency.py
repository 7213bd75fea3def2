"""Latency of a frame: from its last byte at a pseudo-terminal to the callback in another process. Tactus and others, in turns.

Every program reads the same frames from a pseudo-terminal (48 elements, the format of config/links/digitacts.toml) and passes them on
to a process that notes when it has them, by CLOCK_MONOTONIC. A frame has its number in its first two readings. A frame's last byte is at
the terminal at some moment of the call that writes it: times are from the call's start, and the last two columns from its end.

- tactus: `tactusd`, with recording off, its safety supervisor and history on; heard by a Rust client in a callback (`Client::listen`).
- queue: the same, heard from a subscription's queue (`Client::subscribe`), which wakes one more thread.
- zenoh: a Rust program that reads the terminal and publishes as many bytes with zenoh; heard by zenoh in Rust.
- zmq: pyserial and pyzmq, publisher and subscriber in Python.
- lsl: pyserial and an LSL outlet; an inlet in Python, with `dest_obj`. LSL listens on all interfaces whatever one sets.
"""

import argparse
import atexit
import binascii
import json
import os
import resource
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import tty
from pathlib import Path

import machine

REPOSITORY = Path(__file__).parents[2]
FIRST_READINGS = 4000
FRAME_BYTES = 106
READINGS_AT = 8
WARM_UP = 30


def main():
    args = arguments()
    if args.part:
        return PARTS[args.part](*args.rest)
    if args.growth:
        return print(growth(args))
    result = {"machine": machine.described(machine.versions("pyserial", "pyzmq", "pylsl")), "rows": []}
    for rate_hz, seconds in ((30, args.seconds), (1000, args.seconds / 3)):
        for busy in (False, True):
            loads = [begin([sys.executable, "-c", "while True: pass"]) for _ in range(os.cpu_count() * busy)]
            rounds = {who: [] for who in args.who}
            for _ in range(args.rounds):
                for who in args.who:
                    rounds[who].append(one_round(who, args, rate_hz, int(rate_hz * seconds)))
            for load in loads:
                load.kill()
                load.wait()
            for who in args.who:
                medians = {key: statistics.median(one[key] for one in rounds[who]) for key in rounds[who][0]}
                result["rows"].append({"who": who, "rate_hz": rate_hz, "busy": busy, **medians})
                print(json.dumps(result["rows"][-1]), file=sys.stderr, flush=True)
    print(json.dumps(result, indent=1) if args.json else table(result))


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bench", type=Path, default=REPOSITORY / "target/dist/tactus-bench")
    parser.add_argument("--daemon", type=Path, default=REPOSITORY / "target/dist/tactusd")
    parser.add_argument("--rounds", type=int, default=5, help="the median of so many")
    parser.add_argument("--seconds", type=float, default=30.0, help="of a round at 30 Hz; a third of it at 1 kHz")
    parser.add_argument("--who", nargs="+", default=["tactus", "queue", "zenoh", "zmq", "lsl"])
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--growth", action="store_true", help="of Tactus alone, with the rate and with the number of who hear it")
    parser.add_argument("--part", choices=PARTS, help=argparse.SUPPRESS)
    parser.add_argument("rest", nargs="*", help=argparse.SUPPRESS)
    args = parser.parse_args()
    args.bench, args.daemon, args.others = args.bench.resolve(), args.daemon.resolve(), 0
    return args


def growth(args):
    """Latency, processor time and memory of the service at several rates and with several who hear it, and with which powers they grow."""
    costs = {"p50_ms": "p50", "core_share": "processor", "memory_mib": "memory"}
    lines = [machine.described({}), f"{'rate':>7} {'hear it':>8} {'p50 ms':>9} {'p99 ms':>9} {'p99.9 ms':>9} {'lost':>5} {'% core':>7} {'MiB':>6}"]
    powers = []
    for what, sizes in (("rate", [(30, 1), (120, 1), (480, 1)]), ("who hear it", [(30, 1), (30, 4), (30, 16)])):
        rows = []
        for rate_hz, hear in sizes:
            args.others = hear - 1
            count = int(rate_hz * args.seconds)
            rounds = [one_round("tactus", args, rate_hz, count) for _ in range(args.rounds)]
            row = {key: statistics.median(one[key] for one in rounds) for key in rounds[0]}
            rows.append((rate_hz if what == "rate" else hear, row))
            times = " ".join(f"{row[key]:>9.3f}" for key in ("p50_ms", "p99_ms", "p999_ms"))
            lines.append(f"{rate_hz:>4} Hz {hear:>8} {times} {row['lost']:>5.0f} {100 * row['core_share']:>7.2f} {row['memory_mib']:>6.1f}")
        of = [f"{name} ^{machine.exponent([(size, row[key]) for size, row in rows]):.2f}" for key, name in costs.items()]
        powers.append(f"with {what}: {', '.join(of)}")
    return "\n".join(lines + powers)


def one_round(who, args, rate_hz, count):
    """Milliseconds at the median and in the tail, frames that were lost, and what the passing program used."""
    master, slave = os.openpty()
    tty.setraw(slave)
    tty.setraw(master)
    writer = Writer(master, rate_hz)
    with tempfile.TemporaryDirectory() as folder:
        passes, hears = START[who](args, Path(folder), os.ttyname(slave), writer, str(WARM_UP + count))
        first, before = writer.number + WARM_UP // 2, used(passes.pid)
        began = time.monotonic()
        try:
            said, _ = hears.communicate(timeout=30 + 2 * count / rate_hz)
        except subprocess.TimeoutExpired:
            hears.kill()
            said, _ = hears.communicate()
        seconds, after = time.monotonic() - began, used(passes.pid)
        writer.ends.set()
        writer.join()
        passes.terminate()
        passes.wait()
    os.close(master)
    os.close(slave)
    lines = said.strip().splitlines()
    heard = dict(json.loads(lines[-1])) if lines and lines[-1].startswith("[") else {}
    numbers = range(max(first, min(heard, default=first)), max(heard, default=first + count - 1) + 1)
    ms = sorted((heard[number] - writer.begun[number]) / 1e6 for number in numbers if number in heard)
    at = lambda share: ms[min(len(ms) - 1, int(share * len(ms)))] if ms else float("nan")
    after_ms = [(heard[number] - writer.written[number]) / 1e6 for number in numbers if number in heard]
    return {
        "p50_ms": at(0.5),
        "p99_ms": at(0.99),
        "p999_ms": at(0.999),
        "p50_after_write_ms": statistics.median(after_ms) if after_ms else float("nan"),
        "lost": len(numbers) - len(ms),
        "core_share": (after["cpu_s"] - before["cpu_s"]) / seconds,
        "memory_mib": after["memory_mib"],
    }


class Writer(threading.Thread):
    """Writes frames in time, and notes when the writing of each began and ended."""

    def __init__(self, master, rate_hz):
        super().__init__(daemon=True)
        self.master, self.rate_hz = master, rate_hz
        self.number, self.begun, self.written, self.ends = 0, {}, {}, threading.Event()

    def run(self):
        start = time.monotonic_ns()
        while not self.ends.is_set():
            bytes_ = frame(self.number, 1000 // self.rate_hz)
            ahead = (start + self.number * 1_000_000_000 // self.rate_hz - time.monotonic_ns()) / 1e9
            if ahead > 0:
                time.sleep(ahead)
            # The number first: the frame may be heard before the next line.
            self.number += 1
            self.begun[self.number - 1] = time.monotonic_ns()
            os.write(self.master, bytes_)
            self.written[self.number - 1] = time.monotonic_ns()


def frame(number, interval_ms):
    readings = [number % FIRST_READINGS, number // FIRST_READINGS] + [100] * 46
    body = bytes([101, number % 256]) + (number * interval_ms).to_bytes(4, "little")
    body += b"".join(reading.to_bytes(2, "little") for reading in readings)
    return b"\xaa\x55" + body + binascii.crc_hqx(body, 0xFFFF).to_bytes(2, "little")


def number_of(readings):
    return int(readings[0]) + FIRST_READINGS * int(readings[1])


def used(pid):
    """Processor time and memory of a process."""
    ticks = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[11:13]
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return {
        "cpu_s": sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK"),
        "memory_mib": pages * resource.getpagesize() / 2**20,
    }


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def begin(command, **options):
    """Starts a program that ends with this one at the latest."""
    process = subprocess.Popen([str(one) for one in command], **options)
    atexit.register(process.kill)
    return process


def start(command, seconds=0):
    """Starts a program until it says that it is ready, again for some time if it ends: what it connects to may still be starting."""
    until = time.monotonic() + seconds
    while True:
        errors = subprocess.DEVNULL if time.monotonic() < until else None
        process = begin(command, stdout=subprocess.PIPE, stderr=errors, text=True)
        if "ready" in process.stdout.readline():
            return process
        process.wait()
        if time.monotonic() >= until:
            raise SystemExit(f"{command[0]} did not become ready")
        time.sleep(0.1)


def start_tactus(args, folder, device, writer, count, *how):
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    rig = (REPOSITORY / "config/rigs/pty-declared.toml").read_text()
    rig = rig.replace('"mock/sensor"', json.dumps(device)).replace("rate_hz = 30.0", f"rate_hz = {writer.rate_hz}.0")
    rig = rig.replace('"../links/digitacts.toml"', json.dumps(str(REPOSITORY / "config/links/digitacts.toml")))
    (folder / "rig.toml").write_text(rig)
    (folder / "tactusd.toml").write_text(f'rig = "rig.toml"\nrecordings = "runs"\n[bus]\nlisten = ["{endpoint}"]\n')
    command = [args.daemon, "--config", folder / "tactusd.toml"]
    passes = begin(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=(folder / "log").open("w"))
    # A rig is ready once its frames flow.
    writer.start()
    for _ in range(args.others):
        start([args.bench, "hear", endpoint, count], seconds=20)
    hears = start([args.bench, "hear", endpoint, count, *how], seconds=20)
    return passes, hears


def start_queue(args, folder, device, writer, count):
    return start_tactus(args, folder, device, writer, count, "--queued")


def start_zenoh(args, folder, device, writer, count):
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    passes = start([args.bench, "relay", device, endpoint])
    hears = start([args.bench, "hear", endpoint, count, "--bare"])
    time.sleep(0.5)
    writer.start()
    return passes, hears


def python_pair(name):
    def begin(args, folder, device, writer, count):
        port = str(free_port())
        me = [sys.executable, __file__, "--part"]
        passes = start([*me, f"{name}-passes", device, port])
        hears = start([*me, f"{name}-hears", port, count])
        time.sleep(0.5)
        writer.start()
        return passes, hears

    return begin


def opened(device):
    """A terminal, as plain Python opens it."""
    import serial

    return serial.Serial(device, 115200)


def zmq_passes(device, port):
    import zmq

    publisher = zmq.Context().socket(zmq.PUB)
    publisher.bind(f"tcp://127.0.0.1:{port}")
    terminal = opened(device)
    print("ready", flush=True)
    while True:
        publisher.send(terminal.read(FRAME_BYTES))


def zmq_hears(port, count):
    import zmq

    subscriber = zmq.Context().socket(zmq.SUB)
    subscriber.setsockopt(zmq.SUBSCRIBE, b"")
    subscriber.setsockopt(zmq.RCVTIMEO, 20_000)
    subscriber.connect(f"tcp://127.0.0.1:{port}")
    print("ready", flush=True)
    heard = []
    while len(heard) < int(count):
        one = subscriber.recv()
        at_ns = time.monotonic_ns()
        readings = memoryview(one)[READINGS_AT : READINGS_AT + 4].cast("H")
        heard.append((number_of(readings), at_ns))
    print(json.dumps(heard))


def lsl_passes(device, name):
    import numpy as np
    from pylsl import StreamInfo, StreamOutlet

    outlet = StreamOutlet(StreamInfo(name, "tactile", 48, 0, "float32", name))
    terminal = opened(device)
    print("ready", flush=True)
    while True:
        outlet.push_sample(np.frombuffer(terminal.read(FRAME_BYTES), "<u2", 48, READINGS_AT).astype(np.float32))


def lsl_hears(name, count):
    import numpy as np
    from pylsl import StreamInlet, resolve_byprop

    inlet = StreamInlet(resolve_byprop("name", name, timeout=20)[0])
    inlet.open_stream(timeout=20)
    print("ready", flush=True)
    heard, chunk = [], np.zeros((64, 48), np.float32)
    while len(heard) < int(count):
        _, stamps = inlet.pull_chunk(timeout=0.0, max_samples=1, dest_obj=chunk)
        if not stamps:
            # Waits for one; the samples that it returns as a list would cost far more than the pull.
            sample, _ = inlet.pull_sample(timeout=20.0)
            at_ns = time.monotonic_ns()
            heard.append((number_of(sample), at_ns))
        else:
            heard.append((number_of(chunk[0]), time.monotonic_ns()))
    print(json.dumps(heard))


PARTS = {
    "zmq-passes": zmq_passes,
    "zmq-hears": zmq_hears,
    "lsl-passes": lsl_passes,
    "lsl-hears": lsl_hears,
}
START = {"tactus": start_tactus, "queue": start_queue, "zenoh": start_zenoh, "zmq": python_pair("zmq"), "lsl": python_pair("lsl")}


def table(result):
    lines = [result["machine"]]
    names = ["p50 ms", "p99 ms", "p99.9 ms", "lost", "% core", "MiB", "to zenoh", "after write", "to zenoh"]
    lines.append(f"{'rate':>7} {'load':<5} {'who':<7}" + "".join(f" {name:>11}" for name in names))
    for row in result["rows"]:
        same = [one for one in result["rows"] if (one["rate_hz"], one["busy"]) == (row["rate_hz"], row["busy"])]
        zenoh = next((one for one in same if one["who"] == "zenoh"), None)
        ratio = lambda key: row[key] / zenoh[key] if zenoh else float("nan")
        load = "busy" if row["busy"] else "idle"
        values = [f"{row['p50_ms']:.3f}", f"{row['p99_ms']:.3f}", f"{row['p999_ms']:.3f}", f"{row['lost']:.0f}"]
        values += [f"{100 * row['core_share']:.2f}", f"{row['memory_mib']:.1f}", f"{ratio('p50_ms'):.2f}"]
        values += [f"{row['p50_after_write_ms']:.3f}", f"{ratio('p50_after_write_ms'):.2f}"]
        lines.append(f"{row['rate_hz']:>4} Hz {load:<5} {row['who']:<7}" + "".join(f" {value:>11}" for value in values))
    return "\n".join(lines)


if __name__ == "__main__":
    main()
