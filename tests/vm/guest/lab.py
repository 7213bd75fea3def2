"""Tools for the checks: results, programs with output to wait for, a rig on USB and the service that owns it."""

import json
import os
import queue
import shutil
import subprocess
import tempfile
import threading
import time
from pathlib import Path

REPOSITORY = Path("/lab")
BINARIES = REPOSITORY / "bin"
# Only a hang takes this long. Under emulation everything is slow.
LIMIT_S = 120

SENSOR = "/dev/serial/by-id/usb-Tactus_SIM_virtual_sensor_SIM-SENSOR-if00"
STAGE = "/dev/serial/by-id/usb-Tactus_SIM_virtual_stage_SIM-STAGE-if00"

results = {"ok": 0, "FAIL": 0}


def check(what: str, wanted, seen) -> bool:
    """Prints one result. `wanted` is a value, or a function that returns true for right values; its docstring or name is printed."""
    right = wanted(seen) if callable(wanted) else wanted == seen
    words = (wanted.__doc__ or wanted.__name__) if callable(wanted) else repr(wanted)
    word = "ok" if right else "FAIL"
    results[word] += 1
    print(f"{word:4} {what}: {seen!r}" if right else f"FAIL {what}: wanted {words}, saw {seen!r}", flush=True)
    return right


def that(words: str, is_right):
    """A condition for `check`, with the words that describe it."""
    is_right.__doc__ = words
    return is_right


def at_least(number):
    return that(f"at least {number}", lambda seen: seen >= number)


def between(low, high):
    return that(f"{low} to {high}", lambda seen: low <= seen <= high)


class Hung(Exception):
    """An awaited event has not happened."""


def wait(what: str, condition, limit_s: float = LIMIT_S):
    """Polls until `condition` returns something true, and returns that. For events without a notification."""
    deadline = time.monotonic() + limit_s
    while not (found := condition()):
        if time.monotonic() > deadline:
            raise Hung(f"{what}: not within {limit_s} s")
        time.sleep(0.02)
    return found


class Program:
    """A program that runs beside the check. Its output is read line by line."""

    def __init__(self, name: str, *arguments, folder: Path | None = None):
        self.name = name
        self.seen: list[str] = []
        self.said = queue.Queue()
        self.process = subprocess.Popen(
            [str(BINARIES / name), *map(str, arguments)],
            cwd=folder,
            env={**os.environ, "RUST_LOG": "info,zenoh=error"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            bufsize=1,
        )
        threading.Thread(target=self.read, daemon=True).start()

    def read(self) -> None:
        for line in self.process.stdout:
            self.said.put(line.rstrip())
        self.said.put(None)

    def until(self, is_it, what: str, limit_s: float = LIMIT_S) -> str:
        """The next line for which `is_it` is true."""
        deadline = time.monotonic() + limit_s
        while True:
            try:
                line = self.said.get(timeout=max(0.0, deadline - time.monotonic()))
            except queue.Empty:
                line = None
            if line is None:
                said = "\n  ".join(self.seen[-20:])
                raise Hung(f"{self.name} never said {what}; it said:\n  {said}")
            self.seen.append(line)
            if is_it(line):
                return line

    def say(self, line: str) -> str:
        """Types a line and returns the answer."""
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        return self.until(lambda said: said == "ok" or said.startswith("error"), f"an answer to {line!r}")

    def do(self, line: str) -> None:
        """Types a command that must succeed."""
        if (answer := self.say(line)) != "ok":
            raise Hung(f"{self.name}, told {line!r}: {answer}")

    def wait(self) -> int:
        return self.process.wait(LIMIT_S)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


def rig_file(folder: Path, sensor: str = SENSOR, stage: str = STAGE, rate_hz: float = 30.0, **changes: str) -> Path:
    """The shipped rig at other ports; `changes` maps texts of the file to their replacements."""
    text = (REPOSITORY / "config/rigs/pty.toml").read_text()
    edits = {'"mock/sensor"': f'"{sensor}"', '"mock/stage"': f'"{stage}"', "rate_hz = 30.0": f"rate_hz = {rate_hz}", **changes}
    for old, new in edits.items():
        if old not in text:
            raise ValueError(f"the shipped rig has no {old!r} any more")
        text = text.replace(old, new)
    path = folder / "rig.toml"
    path.write_text(text)
    return path


def plug(*arguments, rig: Path | None = None) -> Program:
    """Plugs in virtual devices, and waits until the kernel has accepted them."""
    mock = Program("tactus-mock", "usb", "--config", rig or REPOSITORY / "config/rigs/pty.toml", *arguments)
    wanted = sum(argument in ("--sensor", "--stage") for argument in arguments)
    for _ in range(wanted):
        mock.until(lambda line: " port " in line and line.split()[0] in ("sensor", "stage"), "what it plugged in")
    return mock


class Service:
    """`tactusd` with a rig file, in its own folder."""

    def __init__(self, rig: Path, says: str = "ready"):
        """Starts the service and waits for a line that contains `says`."""
        self.folder = rig.parent
        config = self.folder / "tactusd.toml"
        if not config.exists():
            config.write_text('rig = "rig.toml"\nrecordings = "runs"\n')
        self.program = Program("tactusd", "--config", config, folder=self.folder)
        try:
            self.said = self.program.until(lambda line: says in line, repr(says))
        except Hung:
            self.program.__exit__()
            raise

    def tactus(self, *arguments) -> subprocess.CompletedProcess:
        command = [str(BINARIES / "tactus"), "--json", *map(str, arguments)]
        return subprocess.run(command, cwd=self.folder, capture_output=True, text=True, timeout=LIMIT_S, stdin=subprocess.DEVNULL)

    def status(self) -> dict:
        # A client waits some seconds for a service. Under emulation this can be too short.
        for _ in range(5):
            said = self.tactus("status")
            if said.returncode == 0:
                return json.loads(said.stdout)
        raise Hung(f"tactus status: {said.stdout} {said.stderr}")

    def until(self, what: str, is_it, limit_s: float = LIMIT_S) -> dict:
        """Asks for the status until `is_it` is true of it."""
        last = {}

        def asked():
            last.update(self.status())
            return is_it(last)

        try:
            wait(what, asked, limit_s)
        except Hung as hung:
            raise Hung(f"{hung}; status: sensor {last.get('sensor')}, stage {last.get('stage')}") from None
        return last

    def until_connected(self) -> dict:
        def is_up(said):
            return said["sensor"]["connected"] and said["stage"]["status"] not in ("DISCONNECTED", "unknown")

        return self.until("sensor and stage are connected", is_up)

    def start_run(self, script: str) -> Program:
        """Resets first: after a start of the service nothing moves before a reset."""
        said = self.tactus("reset")
        if said.returncode != 0:
            raise Hung(f"tactus reset: {said.stdout} {said.stderr}")
        path = self.folder / "script.star"
        path.write_text(script)
        return Program("tactus", "--json", "run", path, "--no-report", folder=self.folder)

    def __enter__(self):
        self.failed_before = results["FAIL"]
        return self

    def __exit__(self, kind, *_):
        self.program.__exit__()
        if kind is not None or results["FAIL"] > self.failed_before:
            while not self.program.said.empty():
                self.program.seen.append(self.program.said.get())
            said = [line for line in self.program.seen if line is not None]
            print("  the service said:\n    " + "\n    ".join(said[-30:]), flush=True)


class Folder:
    """A temporary folder."""

    def __enter__(self) -> Path:
        self.path = Path(tempfile.mkdtemp(dir="/run"))
        return self.path

    def __exit__(self, *_):
        shutil.rmtree(self.path)


def usb_devices() -> dict[str, tuple[str, str]]:
    """Our devices that the kernel has enumerated: by serial number, their id and product."""
    found = {}
    for device in Path("/sys/bus/usb/devices").iterdir():
        try:
            vendor, product, serial, name = (
                (device / file).read_text().strip() for file in ("idVendor", "idProduct", "serial", "product")
            )
        except OSError:
            # An interface, or a device that is being removed.
            continue
        if serial.startswith("SIM"):
            found[serial] = (f"{vendor}:{product}", name)
    return found


def until_gone(*serials: str) -> None:
    wait(f"{serials} are gone", lambda: not any(serial in usb_devices() for serial in serials or ("SIM-SENSOR", "SIM-STAGE")))
