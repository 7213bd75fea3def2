"""A machine made of Debian's packages, with systemd as its first process. It runs in namespaces, on this kernel, without emulation.

Needs root. It always cleans up: its processes end with this process, and its mounts end with its processes.
"""

import json
import os
import pathlib
import queue
import select
import shlex
import shutil
import socket
import subprocess
import threading
import time

HERE = pathlib.Path(__file__).resolve().parent
# Only a hang takes this long.
DEADLINE_S = 90
# Units of Debian that would look for hardware, the network or updates.
UNWANTED = """
    systemd-udevd.service systemd-udevd-control.socket systemd-udevd-kernel.socket systemd-udev-trigger.service
    systemd-networkd.service systemd-networkd.socket systemd-logind.service systemd-modules-load.service
    systemd-timesyncd.service apt-daily.timer apt-daily-upgrade.timer dpkg-db-backup.timer getty.target
    console-getty.service e2scrub_all.timer e2scrub_reap.service fstrim.timer
""".split()


class Machine:
    """Boots when the `with` block is entered, and ends when it is left."""

    def __init__(self, folder):
        self.folder = folder
        self.root = folder / "root"
        self.cgroup = _unified_cgroups() / f"tactus-systemd-boot-{os.getpid()}"
        self.console = folder / "console.log"
        self.outer = None
        self.pid = None

    def __enter__(self):
        try:
            self._lay_root()
            self._boot()
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(self, *_):
        self.close()

    def _lay_root(self):
        shutil.rmtree(self.root, ignore_errors=True)
        self.root.mkdir()
        subprocess.run(["tar", "-C", self.root, "-xf", self.folder / "base.tar"], check=True)
        (self.root / "etc/hostname").write_text("bench\n")
        (self.root / "etc/fstab").write_text("")
        (self.root / "etc/machine-id").write_text("0123456789abcdef0123456789abcdef\n")
        # The root file system is temporary, so nothing has to be synced to the disk.
        (self.root / "etc/dpkg/dpkg.cfg.d/unsafe-io").write_text("force-unsafe-io\n")
        for unit in UNWANTED:
            link = self.root / "etc/systemd/system" / unit
            link.unlink(missing_ok=True)
            link.symlink_to("/dev/null")

    def _boot(self):
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as ready:
            # The path of a socket must be short, and this one may be long.
            folder = os.open(self.root, os.O_DIRECTORY)
            ready.bind(f"/proc/self/fd/{folder}/ready.socket")
            os.close(folder)
            ready.settimeout(DEADLINE_S)
            for left in self.cgroup.parent.glob("tactus-systemd-boot-*"):
                # Left by a test that was killed, or used by one that is still running.
                _remove_cgroups(left, busy_is_fine=True)
            self.cgroup.mkdir()
            with self.console.open("wb") as console:
                self.outer = subprocess.Popen(
                    # With `setpriv` and `--kill-child`, everything ends with this process.
                    ["setpriv", "--pdeathsig", "KILL"]
                    + "unshare --mount --uts --ipc --net --pid --cgroup --fork --kill-child --propagation private".split()
                    + [HERE / "pid1.sh", self.root],
                    stdin=subprocess.DEVNULL,
                    stdout=console,
                    stderr=console,
                    preexec_fn=lambda: (self.cgroup / "cgroup.procs").write_text("0"),
                )
            while b"READY=1" not in ready.recv(4096):
                pass
        children = pathlib.Path(f"/proc/{self.outer.pid}/task/{self.outer.pid}/children").read_text().split()
        self.pid = int(children[0])

    def close(self):
        if self.outer is not None:
            # When the first process of a namespace ends, all others end too.
            self.outer.kill()
            self.outer.wait()
        if self.pid is not None:
            _wait_for_end(self.pid)
        _remove_cgroups(self.cgroup, busy_is_fine=False)
        shutil.rmtree(self.root, ignore_errors=True)

    def _inside(self, command, user=None):
        if user is not None:
            command = ["runuser", "--login", user, "--command", shlex.join(map(str, command))]
        enter = ["nsenter", f"--target={self.pid}", "--mount", "--uts", "--ipc", "--net", "--pid", "--wd=/"]
        return enter + ["env", "-i", "PATH=/usr/sbin:/usr/bin:/sbin:/bin", "LC_ALL=C.UTF-8"] + list(map(str, command))

    def run(self, *command, user=None, unit=None):
        """Runs a command in the machine to its end; with `unit`, behind that unit's device filter."""
        join = None if unit is None else lambda: self._cgroup_of(unit).write_text("0")
        return subprocess.run(
            self._inside(command, user), stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=DEADLINE_S, preexec_fn=join
        )

    def must(self, *command, user=None):
        """Runs a command in the machine that must succeed for the checks to continue; returns its output."""
        done = self.run(*command, user=user)
        if done.returncode != 0:
            raise RuntimeError(f"{shlex.join(map(str, command))}: exit status {done.returncode}: {done.stdout}{done.stderr}")
        return done.stdout

    def start(self, *command, user=None):
        """Starts a command in the machine."""
        return Process(self._inside(command, user))

    def _cgroup_of(self, unit):
        return self.cgroup / "system.slice" / unit / "cgroup.procs"

    def unit(self, name, *properties):
        """Properties of a unit: one value, or a list if several are asked for."""
        lines = self.must("systemctl", "show", name, *(f"--property={property}" for property in properties)).splitlines()
        shown = dict(line.split("=", 1) for line in lines)
        return shown[properties[0]] if len(properties) == 1 else [shown[property] for property in properties]


class Process:
    """A process in the machine that runs beside the checks. Its output is read line by line."""

    def __init__(self, command):
        self.lines = queue.Queue()
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        for line in self.process.stdout:
            self.lines.put(line.rstrip("\n"))
        self.lines.put(None)

    def wait_for(self, is_it):
        """Waits for a line for which `is_it` is true, and returns it."""
        seen = []
        until = time.monotonic() + DEADLINE_S
        while True:
            try:
                line = self.lines.get(timeout=max(0.0, until - time.monotonic()))
            except queue.Empty:
                raise RuntimeError(f"the expected line never came; the last lines: {seen[-5:]}") from None
            if line is None:
                raise RuntimeError(f"the process ended before the expected line; its last lines: {seen[-5:]}")
            if is_it(line):
                return line
            seen.append(line)

    def ask(self, line, answers=lambda _: True):
        """Types a line, and returns the next line of output that answers it: log lines may stand in between."""
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        return self.wait_for(answers)

    def wait(self):
        """Waits for its end; returns its exit status and all lines that were not read yet."""
        status = self.process.wait(DEADLINE_S)
        return status, list(iter(self.lines.get, None))

    def end(self):
        """Terminates it and waits for its end."""
        self.process.terminate()
        self.process.wait(DEADLINE_S)


class Journal:
    """The journal of a unit, from its beginning, followed live."""

    def __init__(self, machine, unit):
        self.process = machine.start("journalctl", "--follow", "--no-tail", "--output=json", f"--unit={unit}")

    def wait_for(self, text, after):
        """Waits for a message that contains the text and is later than `after` (`time.monotonic()`); returns the entry."""
        def is_it(line):
            entry = json.loads(line)
            return text in str(entry["MESSAGE"]) and int(entry["__MONOTONIC_TIMESTAMP"]) > after * 1e6
        return json.loads(self.process.wait_for(is_it))


def _unified_cgroups():
    """The mount point of the unified control group hierarchy."""
    for line in pathlib.Path("/proc/mounts").read_text().splitlines():
        _, where, kind, *_ = line.split()
        if kind == "cgroup2":
            return pathlib.Path(where)
    raise RuntimeError("no cgroup2 is mounted: systemd cannot be booted here")


def _remove_cgroups(top, busy_is_fine):
    """Removes a control group and all groups in it."""
    for folder, _, _ in os.walk(top, topdown=False):
        try:
            os.rmdir(folder)
        except OSError:
            if not busy_is_fine:
                raise


def _wait_for_end(pid):
    """Waits until a process has ended that is not our child."""
    try:
        there = os.pidfd_open(pid)
    except ProcessLookupError:
        return
    select.select([there], [], [], DEADLINE_S)
    os.close(there)
