"""Threads of the service hang alone, as `ptrace` stops them: nothing but these threads knows."""

import contextlib
import ctypes
import os
import pathlib
import socket
import subprocess
import time

import pytest
from lab import Lab, binary, tactus

# linux/ptrace.h and linux/wait.h
PTRACE_DETACH, PTRACE_SEIZE, PTRACE_INTERRUPT, WALL = 17, 0x4206, 0x4207, 0x40000000

libc = ctypes.CDLL(None, use_errno=True)
libc.ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
libc.ptrace.restype = ctypes.c_long

HOLD = "def run(rig):\n    tare()\n    press(5.0, 5.0, depths_mm = [0.2], dwell_s = 600.0)\n"
# Each step of 0.1 mm takes two seconds.
SLOW = "def run(rig):\n    tare()\n    press(5.0, 5.0, depths_mm = [0.6], speed_mm_per_s = 0.05)\n"


def ptrace(request, thread):
    if libc.ptrace(request, thread, None, None) != 0:
        error = ctypes.get_errno()
        raise OSError(error, os.strerror(error))


@contextlib.contextmanager
def hanging(process, name):
    """All threads whose name begins with this hang meanwhile."""
    tasks = pathlib.Path(f"/proc/{process.pid}/task")
    threads = [int(task.name) for task in tasks.iterdir() if (task / "comm").read_text().startswith(name)]
    assert threads, f"no thread is named {name}"
    for thread in threads:
        ptrace(PTRACE_SEIZE, thread)
        ptrace(PTRACE_INTERRUPT, thread)
        os.waitpid(thread, WALL)
    try:
        yield
    finally:
        for thread in threads:
            ptrace(PTRACE_DETACH, thread)


class WatchedLab(Lab):
    """A lab whose service has a watchdog, as under systemd."""

    def __init__(self, folder):
        self.watchdog = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.watchdog.bind(str(folder / "notify.sock"))
        self.watchdog.settimeout(60)
        super().__init__(folder)

    def start(self, name, *args):
        return super().start(name, *args, NOTIFY_SOCKET=str(self.folder / "notify.sock"), WATCHDOG_USEC="2000000")

    def run_until(self, script, is_it):
        """Starts a run and returns it once the rig's true state is so. A run that a busy machine ends before is begun again."""
        (self.folder / "script.star").write_text(script)
        for _ in range(4):
            client = subprocess.Popen(
                [binary("tactus"), "--endpoint", self.endpoint, "run", "script.star", "--no-report"],
                cwd=self.folder,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
            while client.poll() is None:
                if is_it(self.mock.truth()):
                    return client
            tactus("--endpoint", self.endpoint, "reset")
        raise AssertionError("no run came so far")

    def wait_for_the_truth(self, is_it):
        """Asks for the rig's true state until it is so; only a hang takes a minute."""
        deadline = time.monotonic() + 60
        while not is_it(truth := self.mock.truth()):
            assert time.monotonic() < deadline, truth
        return truth

    def wait_until_the_watchdog_is_told(self, text):
        while text not in self.watchdog.recv(4096).decode():
            pass

    def drain_the_watchdog(self):
        self.watchdog.setblocking(False)
        with contextlib.suppress(BlockingIOError):
            while self.watchdog.recv(4096):
                pass
        self.watchdog.settimeout(60)

    def status(self):
        return tactus("--endpoint", self.endpoint, "status")


@pytest.fixture
def watched(tmp_path):
    lab = WatchedLab(tmp_path)
    yield lab
    lab.close()
    lab.watchdog.close()


def test_a_recorder_that_hangs_fails_the_run_with_the_tip_up(watched):
    client = watched.run_until(HOLD, lambda truth: truth["depth_mm"] > 0.19 and not truth["moving"])
    with hanging(watched.daemon.process, "recorder"):
        watched.drain_the_watchdog()
        watched.daemon.wait_for("does not go on")
        watched.wait_until_the_watchdog_is_told("WATCHDOG=trigger")
        watched.wait_for_the_truth(lambda truth: truth["z_mm"] > 1.9)
    assert client.wait(timeout=60) != 0
    watched.wait_until_the_watchdog_is_told("WATCHDOG=1")
    assert watched.status()["run"]["phase"] == "finished"


def test_a_runtime_that_hangs_in_a_step_down_stops_the_stage_within_the_step(watched):
    client = watched.run_until(SLOW, lambda truth: 0.11 < truth["depth_mm"] < 0.13 and truth["moving"])
    with hanging(watched.daemon.process, "tokio-r"):
        watched.drain_the_watchdog()
        rest = watched.wait_for_the_truth(lambda truth: not truth["moving"])
        # The step would end at 0.2 mm, more than a second later.
        assert rest["depth_mm"] < 0.19
        watched.watchdog.settimeout(3)
        with pytest.raises(TimeoutError):
            # What was on its way.
            for _ in range(30):
                watched.watchdog.recv(4096)
    assert "stopped without it" in watched.daemon.wait_for("the stage's driver hangs")
    watched.wait_for_the_truth(lambda truth: truth["z_mm"] > 1.9)
    # The press may be repeated: for that run the sensor was silent.
    client.terminate()
    client.wait(timeout=60)


def test_a_systemd_that_does_not_read_delays_nothing(watched):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as full:
        full.connect(watched.watchdog.getsockname())
        full.setblocking(False)
        with pytest.raises(BlockingIOError):
            while True:
                full.send(b"X_TEST=1")
    watched.daemon.end()
    assert watched.daemon.process.returncode == 0
