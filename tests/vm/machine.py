#!/usr/bin/env python3
"""The emulated machine: boots and saves it, or resumes it and lets it run the checks.

    machine.py save WORK           boots what build.sh made in WORK, and saves the state there
    machine.py run WORK STAGE      resumes it with the folder STAGE as a disk and prints its console; exits with the checks' status

It needs no hardware virtualisation, network or root, and does not look for them: results would then depend on the host.
"""

import atexit
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

MEMORY_MB = 1024
# The disk of the checks. Its size must not change, or the saved machine would not recognise it.
STAGE_BYTES = 400 << 20
# Only a hang takes this long.
BOOT_LIMIT_S, RUN_LIMIT_S = 600, 1200
READY = "GUEST ready"
STATUS = re.compile(r"GUEST status (\d+)")

KERNEL_ARGUMENTS = (
    "console=ttyS0 quiet loglevel=3 panic=-1 mitigations=off nokaslr random.trust_cpu=on audit=0 selinux=0 apparmor=0"
    " net.ifnames=0 systemd.show_status=0 systemd.unit=lab.target tsc=reliable no_timer_check"
)


class Machine:
    """A running qemu with its console, its monitor and the serial line on which the guest waits."""

    def __init__(self, work: Path, root: str, stage: Path, extra: tuple[str, ...] = ()):
        self.folder = Path(tempfile.mkdtemp(prefix="vm-"))
        atexit.register(shutil.rmtree, self.folder, ignore_errors=True)
        command = [
            "qemu-system-x86_64",
            # The microvm machine type has hung. The default accelerator would depend on the host.
            *("-M", "pc,hpet=off", "-accel", "tcg,thread=multi,tb-size=256", "-cpu", "max,la57=off"),
            *("-smp", "2", "-m", str(MEMORY_MB)),
            *("-nodefaults", "-no-user-config", "-display", "none", "-no-reboot"),
            *("-kernel", str(work / "vmlinux"), "-initrd", str(work / "first.cpio"), "-append", KERNEL_ARGUMENTS),
            *("-drive", f"if=none,id=root,format=raw,cache=unsafe,file={work / 'root.ext4'},{root}"),
            *("-device", "virtio-blk-pci,drive=root"),
            *("-drive", f"if=none,id=stage,format=raw,readonly=on,file={stage}"),
            *("-device", "virtio-blk-pci,drive=stage"),
            *("-chardev", "stdio,id=console", "-serial", "chardev:console"),
            *("-chardev", f"socket,id=line,path={self.folder / 'line'},server=on,wait=off", "-serial", "chardev:line"),
            *("-monitor", f"unix:{self.folder / 'monitor'},server=on,wait=off"),
            *extra,
        ]
        self.qemu = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace"
        )
        atexit.register(self.end)
        self.monitor = self.connect("monitor")
        self.read_monitor()

    def connect(self, name: str) -> socket.socket:
        """Connects to a socket that qemu makes some time after its start."""
        path = self.folder / name
        while self.qemu.poll() is None:
            try:
                connection = socket.socket(socket.AF_UNIX)
                connection.connect(str(path))
                return connection
            except OSError:
                time.sleep(0.02)
        sys.exit(f"qemu ended at once:\n{self.qemu.stdout.read()}")

    def read_monitor(self) -> str:
        said = b""
        while not said.endswith(b"(qemu) "):
            more = self.monitor.recv(65536)
            if not more:
                sys.exit(f"qemu ended:\n{self.qemu.stdout.read()}")
            said += more
        return said.decode(errors="replace")

    def ask(self, command: str) -> str:
        self.monitor.sendall(command.encode() + b"\n")
        return self.read_monitor()

    def lines(self, limit_s: float):
        """The lines of the console, until it ends or the time limit is reached."""
        watch = threading.Timer(limit_s, self.end)
        watch.daemon = True
        watch.start()
        for line in self.qemu.stdout:
            yield line.rstrip()
        watch.cancel()

    def end(self) -> None:
        if self.qemu.poll() is None:
            self.qemu.kill()


def save(work: Path) -> None:
    stage = work / "empty.ext4"
    with stage.open("wb") as file:
        file.truncate(STAGE_BYTES)
    machine = Machine(work, "snapshot=off", stage)
    for line in machine.lines(BOOT_LIMIT_S):
        print(line, flush=True)
        if READY in line:
            break
    else:
        sys.exit("the machine did not boot")
    machine.ask("stop")
    machine.ask("migrate_set_parameter max-bandwidth 8G")
    machine.ask(f'migrate "exec:cat > {work / "state"}"')
    while "completed" not in (said := machine.ask("info migrate")):
        if "failed" in said:
            sys.exit(f"the machine cannot be saved: {said}")
        time.sleep(0.1)
    machine.monitor.sendall(b"quit\n")
    machine.qemu.wait()
    stage.unlink()


def run(work: Path, folder: Path) -> int:
    start = time.monotonic()
    stage = work / "stage.ext4"
    stage.unlink(missing_ok=True)
    with stage.open("wb") as file:
        file.truncate(STAGE_BYTES)
    subprocess.run(["mke2fs", "-q", "-t", "ext4", "-O", "^has_journal", "-m", "0", "-d", str(folder), str(stage)], check=True)
    machine = Machine(work, "snapshot=on", stage, ("-incoming", f"exec:cat {work / 'state'}"))
    while "inmigrate" in machine.ask("info status"):
        time.sleep(0.02)
    machine.ask("cont")
    line = machine.connect("line")
    line.sendall(f"go {time.time():.3f}\n".encode())
    print(f"the machine runs after {time.monotonic() - start:.1f} s", flush=True)
    status = None
    for text in machine.lines(RUN_LIMIT_S):
        print(text, flush=True)
        if found := STATUS.search(text):
            status = int(found[1])
            break
    machine.end()
    stage.unlink()
    if status is None:
        print(f"the machine ended, or hung for {RUN_LIMIT_S} s, before the checks were done")
        status = 1
    print(f"vm: {time.monotonic() - start:.0f} s")
    return status


def main() -> None:
    # If this process is terminated, the machine ends too.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    os.environ["LC_ALL"] = "C"
    match sys.argv[1:]:
        case ["save", work]:
            save(Path(work))
        case ["run", work, folder]:
            sys.exit(run(Path(work), Path(folder)))
        case _:
            sys.exit(__doc__)


main()
