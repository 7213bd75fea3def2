"""Starts the real binaries for tests with stock Python tools."""

import json
import os
import pathlib
import queue
import socket
import subprocess
import threading

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
BINARIES = REPOSITORY / "target" / os.environ.get("TACTUS_PROFILE", "debug")


def binary(name):
    path = BINARIES / name
    assert path.is_file(), f"{path} is missing: run `cargo build --workspace --bins`"
    return str(path)


def tactus(*args, check=True, cwd=None):
    """Runs `tactus --json` to its end and returns its one JSON object."""
    done = subprocess.run([binary("tactus"), "--json", *map(str, args)], cwd=cwd, capture_output=True, text=True)
    assert not check or done.returncode == 0, done.stderr + done.stdout
    return json.loads(done.stdout)


class Lab:
    """Virtual devices on pseudo-terminals, and a service that owns them. In contact a sensor may be silent for three frames."""

    def __init__(self, folder, rate_hz=30.0):
        self.folder = folder
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
        rig = (REPOSITORY / "config/rigs/pty.toml").read_text().replace("rate_hz = 30.0", f"rate_hz = {rate_hz}")
        (folder / "rig.toml").write_text(rig)
        (folder / "tactusd.toml").write_text(
            f'rig = "rig.toml"\nrecordings = "runs"\n[bus]\nlisten = ["{self.endpoint}"]\n'
        )
        self.mock = self.start("tactus-mock", "rig", "--config", "rig.toml", "--link-dir", "mock")
        self.mock.wait_for("stage")
        self.daemon = self.start("tactusd", "--config", "tactusd.toml")
        self.daemon.wait_for("ready")
        tactus("--endpoint", self.endpoint, "reset")

    def start(self, name, *args, **environment):
        return Process(name, args, self.folder, environment)

    def close(self):
        for process in (self.daemon, self.mock):
            process.end()


class Process:
    """One of our binaries, running beside a test. Its output is kept and printed."""

    def __init__(self, name, args, folder, environment=None):
        self.name = name
        self.lines = queue.Queue()
        self.process = subprocess.Popen(
            [binary(name), *args],
            cwd=folder,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env=os.environ | {"RUST_LOG": "info,zenoh=error"} | (environment or {}),
        )
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self):
        for line in self.process.stdout:
            print(f"{self.name}: {line}", end="")
            self.lines.put(line)

    def wait_for(self, text):
        """Waits for a line that contains the text, and returns it; only a hang takes a minute."""
        while text not in (line := self.lines.get(timeout=60)):
            pass
        return line

    def truth(self):
        """What is true of virtual devices now."""
        return json.loads(self._ask("truth", "{"))

    def tell(self, fault):
        """Injects a fault into virtual devices, such as `sensor stall 2s`."""
        self._ask(fault, "ok")

    def _ask(self, line, answer):
        self.process.stdin.write(f"{line}\n")
        self.process.stdin.flush()
        return self.wait_for(answer)

    def end(self):
        self.process.terminate()
        self.process.wait(timeout=60)
        self.reader.join()
        self.process.stdin.close()
