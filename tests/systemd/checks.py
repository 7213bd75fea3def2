"""Tests the Debian package and its units on a booted systemd, from installation to removal: checks.py FOLDER PACKAGE.deb

FOLDER contains `base.tar` (made by base.sh) and gets the console's log. Every check prints its title and its result; the exit
status is 1 if one fails. The tip is that of `tactus-mock`, a separate process that outlives the service.
"""

import json
import pathlib
import shutil
import signal
import sys
import time
import traceback

from machine import Journal, Machine

UNIT = "tactusd.service"
RUNS = "/var/lib/tactus/runs"
# Presses to 0.6 mm and stays there until it is ended.
HOLD = "def run(rig):\n    tare()\n    press(5.0, 5.0, depths_mm = [0.6], dwell_s = 600.0)\n"
PRESS = "def run(rig):\n    tare()\n    press(5.0, 5.0, depths_mm = [0.2])\n"

# An HTTP request in plain bash.
ASK = "exec 3<>/dev/tcp/127.0.0.1/7480; printf 'GET / HTTP/1.0\\r\\nHost: localhost\\r\\n\\r\\n' >&3; cat <&3"


class Checks:
    """Counts passed and failed checks."""

    def __init__(self):
        self.passed = self.failed = 0

    def __call__(self, what, holds, wanted, seen):
        if holds:
            self.passed += 1
            print(f"ok   {what}", flush=True)
        else:
            self.failed += 1
            print(f"FAIL {what}: wanted {wanted}, saw {seen}", flush=True)

    def equal(self, what, seen, wanted):
        self(what, seen == wanted, repr(wanted), repr(seen))

    def succeeds(self, what, done):
        self(what, done.returncode == 0, "exit status 0", f"{done.returncode}: {done.stdout}{done.stderr}")


class Lab:
    """The machine with the package, and the actions of its users."""

    def __init__(self, machine, check):
        self.machine = machine
        self.check = check
        self.journal = None
        self.mock = None

    def tactus(self, *args):
        return self.machine.run("tactus", *args, user="scientist")

    def status(self):
        done = self.tactus("--json", "status")
        return json.loads(done.stdout) if done.returncode == 0 else {"error": done.stderr}

    def frames_later(self, count):
        """The status of the service when `count` more frames have arrived."""
        first = status = self.status()
        while status["sensor"]["frames"] < first["sensor"]["frames"] + count:
            status = self.status()
        return status

    def truth(self):
        """The true position of the tip."""
        return json.loads(self.mock.ask("truth", lambda line: line.startswith("{")))

    def press(self):
        """Starts the long press, and returns when the array responds to the tip on its way down."""
        client = self.machine.start("tactus", "run", "hold.star", user="scientist")
        viewer = self.machine.start("tactus", "watch", "--json", user="scientist")
        viewer.wait_for(lambda line: max(json.loads(line)["counts"]) > 250)
        viewer.end()
        return client

    def recording(self):
        """The newest recording."""
        runs = self.machine.must("ls", "-t", RUNS).split()
        return f"{RUNS}/{runs[0]}/recording.mcap"

    def configure(self, **changes):
        """The shipped configuration with other values for some of its keys."""
        path = self.machine.root / "etc/tactus/tactusd.toml"
        shipped = path.with_suffix(".shipped")
        if not shipped.exists():
            shutil.copy(path, shipped)
        text = shipped.read_text()
        for key, value in changes.items():
            lines = [f'{key} = "{value}"' if line.startswith(f"{key} = ") else line for line in text.splitlines()]
            text = "\n".join(lines) + "\n"
        path.write_text(text)

    def drop_in(self, text):
        """Installs a drop-in of the unit, or removes it if `text` is None."""
        path = self.machine.root / f"etc/systemd/system/{UNIT}.d/test.conf"
        if text is None:
            shutil.rmtree(path.parent)
        else:
            path.parent.mkdir()
            path.write_text(text)
        self.machine.must("systemctl", "daemon-reload")


def installation(lab, package):
    """Installation: `dpkg -i`, then the README's commands."""
    machine, check = lab.machine, lab.check
    shutil.copy(package, machine.root / "tactus.deb")
    check.succeeds("the package installs", machine.run("dpkg", "-i", "/tactus.deb"))
    check.equal("the unit is enabled", machine.run("systemctl", "is-enabled", UNIT).stdout.strip(), "enabled")
    shown = machine.run("stat", "--format=%U:%G %a", RUNS).stdout.strip()
    check.equal("the folder for recordings exists before the first start", shown, "tactus:tactus 755")
    check.equal("an installation starts nothing", machine.unit(UNIT, "ActiveState"), "inactive")
    done = machine.run("udevadm", "test", "--action=add", "/sys/devices/virtual/mem/null")
    said = [line for line in (done.stdout + done.stderr).splitlines() if "70-tactus.rules:" in line]
    check.equal("udev reads the rules without a message", said, [])

    check.succeeds("tactus validate /etc/tactus/tactusd.toml", machine.run("tactus", "validate", "/etc/tactus/tactusd.toml"))
    machine.must("useradd", "--create-home", "--groups", "tactus", "scientist")
    machine.must("useradd", "--create-home", "stranger")
    for name, text in (("hold.star", HOLD), ("press.star", PRESS)):
        (machine.root / "home/scientist" / name).write_text(text)
    lab.journal = Journal(machine, UNIT)
    check.succeeds("systemctl start tactusd", machine.run("systemctl", "start", "tactusd"))
    state = machine.unit(UNIT, "ActiveState", "SubState", "StatusText")
    check.equal("it is ready, and its status says why", state, ["active", "running", "rig sim: frames flow"])
    status = lab.status()
    check("tactus status: simulated frames arrive, no run", status.get("simulated") and status["sensor"]["frames"] > 0
          and status["run"]["phase"] == "idle", "simulated, frames, idle", status)
    done = lab.tactus("run", "press.star")
    check("nothing moves before a reset", done.returncode == 4 and "`tactus reset`" in done.stderr, "exit status 4", done)
    check.succeeds("tactus reset", lab.tactus("reset"))
    check.succeeds("a scientist runs an experiment", lab.tactus("--json", "run", "press.star"))

    sockets = machine.must("stat", "--format=%n %U:%G %a", "/run/tactus/bus.sock", "/run/tactus/bus.sock.stop").splitlines()
    wanted = [f"/run/tactus/bus.sock{end} tactus:tactus 660" for end in ("", ".stop")]
    check.equal("the bus is for the group", sockets, wanted)
    listening = machine.must("cat", "/proc/net/tcp", "/proc/net/tcp6")
    check("and listens on no port", f":{7447:04X} " not in listening, "no port 7447", listening)
    for command, wanted in (("status", "may not reach"), ("reset", "may not reach"), ("stop", "STOP WAS NOT CONFIRMED")):
        done = machine.run("tactus", command, user="stranger")
        check(f"who is not in the group is refused: tactus {command}", done.returncode != 0 and wanted in done.stderr,
              wanted, f"{done.returncode}: {done.stderr}")
    done = machine.run("tactus", "run", "corners", user="stranger")
    check("nor does a run of theirs begin elsewhere", done.returncode != 0 and "embedded" not in done.stdout, "an error", done)


def sandbox(lab):
    """Sandbox: the user of the service, and what it cannot reach."""
    machine, check = lab.machine, lab.check
    pid = machine.unit(UNIT, "MainPID")
    fields = dict(line.split(":\t", 1) for line in machine.must("cat", f"/proc/{pid}/status").splitlines() if ":\t" in line)
    user = machine.must("id", "-u", "tactus").strip()
    check.equal("the service runs as the user tactus", set(fields["Uid"].split()), {user})
    check("this is a system user, not root", 0 < int(user) < 1000, "1 to 999", user)
    limits = [fields["CapEff"], fields["CapBnd"], fields["NoNewPrivs"], fields["Seccomp"]]
    check.equal("without capabilities, with a filter of system calls", limits, ["0" * 16, "0" * 16, "1", "2"])
    shown = machine.must("stat", "--format=%U:%G %a", "/var/lib/tactus", RUNS, str(pathlib.Path(lab.recording()).parent), lab.recording())
    wanted = ["tactus:tactus 755"] * 3 + ["tactus:tactus 644"]
    check.equal("owner and modes of the state directory and a recording", shown.splitlines(), wanted)
    check.succeeds("a scientist reads the recording", lab.tactus("record", "info", lab.recording()))
    done = machine.run("touch", f"{RUNS}/mine", user="scientist")
    check("and cannot write there", "Permission denied" in done.stderr, "Permission denied", done.stderr)

    done = machine.run("systemd-analyze", "security", "--no-pager", "--threshold=20", UNIT)
    check.succeeds("the exposure of the installed unit is at most 2.0", done)
    print("     " + next(line for line in done.stdout.splitlines() if "Overall" in line).strip())

    # These nodes stand for devices that are plugged in after the start. If the filter allows one, the kernel itself answers that it
    # has no such driver or device.
    drivers = [line.split() for line in pathlib.Path("/proc/devices").read_text().splitlines()]
    hidraw = next((fields[0] for fields in drivers if fields[1:] == ["hidraw"]), None)
    nodes = [("ttyACM7", 166, True), ("ttyUSB7", 188, True), ("usb7", 189, True), ("full-again", 1, True),
             ("kmsg", 1, False), ("ttyS7", 4, False), ("vcs7", 7, False), ("misc7", 10, False)]
    nodes += [("hidraw7", hidraw, True)] if hidraw else []
    for name, major, allowed in nodes:
        minor = {"full-again": 7, "kmsg": 11}.get(name, 7)
        machine.must("mknod", "-m", "666", f"/dev/{name}", "c", major, minor)
        free = machine.run("dd", "count=0", f"if=/dev/{name}").stderr
        held = machine.run("dd", "count=0", f"if=/dev/{name}", unit=UNIT).stderr
        refused = "Operation not permitted" in held and "Operation not permitted" not in free
        check(f"the device filter {'allows' if allowed else 'refuses'} {name} ({major}:{minor})", refused != allowed,
              "refused only inside the unit" if not allowed else "the same as outside the unit", f"{held!r}; outside {free!r}")
    if not hidraw:
        print("     this kernel has no hidraw: the filter is not tested for it")


def journal(lab):
    """Logs in the journal."""
    machine, check = lab.machine, lab.check
    lines = machine.must("journalctl", "--unit", UNIT, "_COMM=tactusd", "--output=json").splitlines()
    entries = [json.loads(line) for line in lines]
    check("the journal has the service's messages under its unit and name",
          entries and all(entry["_SYSTEMD_UNIT"] == UNIT and entry["SYSLOG_IDENTIFIER"] == "tactusd" for entry in entries),
          "entries of tactusd.service", f"{len(entries)} entries")
    texts = [entry["MESSAGE"] for entry in entries]
    check("they are text without control characters", all(isinstance(text, str) for text in texts), "text", texts)
    accepted = next((text for text in texts if "run accepted" in text), "")
    check("with their fields", "recording=/var/lib/tactus/runs/" in accepted, "run accepted ... recording=...", accepted)
    levels = {("6", " INFO "), ("4", " WARN ")}
    check("the level is the entry's priority and not part of the text",
          all((entry["PRIORITY"], str(entry["MESSAGE"])[:6]) in levels for entry in entries),
          "6 and INFO, or 4 and WARN", {(entry["PRIORITY"], str(entry["MESSAGE"])) for entry in entries})
    # This machine has no logind to ask, and the dashboard's STOP was tried.
    expected = ("can go to sleep", 'stop by="dashboard"')
    problems = [entry["MESSAGE"] for entry in entries
                if entry["PRIORITY"] != "6" and not any(text in str(entry["MESSAGE"]) for text in expected)]
    check.equal("there is no problem so far", problems, [])

    before = time.monotonic()
    lab.configure(format="json")
    machine.must("systemctl", "restart", UNIT)
    message = lab.journal.wait_for("ready: frames flow", before)["MESSAGE"]
    check("with format = \"json\" each message is an object", json.loads(message)["message"] == "ready: frames flow", "an object", message)
    lab.configure()
    machine.must("systemctl", "restart", UNIT)


def configuration(lab):
    """A bad configuration."""
    machine, check = lab.machine, lab.check
    machine.must("systemctl", "stop", UNIT)
    before = time.monotonic()
    lab.configure(rig="rigs/none.toml")
    done = machine.run("systemctl", "start", UNIT)
    state = machine.unit(UNIT, "ActiveState", "ExecMainStatus", "NRestarts")
    check.equal("a bad configuration ends the service with status 2, and systemd does not start it again",
                [done.returncode, *state], [1, "failed", "2", "0"])
    entry = lab.journal.wait_for("none.toml", before)
    check.equal("the journal has the file's name, as an error (3)", entry["PRIORITY"], "3")
    lab.configure()
    machine.must("systemctl", "reset-failed", UNIT)


def devices(lab):
    """Devices on serial ports, in a separate process: the service waits for them."""
    machine, check = lab.machine, lab.check
    rig = (machine.root / "usr/share/tactus/rigs/pty.toml").read_text()
    # Slow loading, so that the press can be interrupted on its way down.
    rig = rig.replace('"mock/', '"/run/bench/').replace("load_speed_mm_per_s = 1.0", "load_speed_mm_per_s = 0.1")
    # Frames arrive in real time, and the supervisor stops the stage if three are late. With a low rate a busy machine does not cause
    # this.
    rig = rig.replace("rate_hz = 30.0", "rate_hz = 10.0")
    (machine.root / "etc/tactus/rigs/bench.toml").write_text(rig)
    lab.configure(rig="rigs/bench.toml")
    before = time.monotonic()
    machine.must("systemctl", "start", "--no-block", UNIT)
    lab.journal.wait_for("/run/bench/sensor", before)
    check.equal("without devices it waits, and is not ready", machine.unit(UNIT, "ActiveState"), "activating")
    lab.mock = machine.start("tactus-mock", "rig", "--config", "/etc/tactus/rigs/bench.toml", "--link-dir", "/run/bench")
    ports = [lab.mock.wait_for(lambda line: line.startswith(device)).split()[1] for device in ("sensor ", "stage ")]
    lab.journal.wait_for("this user may not open the port", before)
    check.equal("it is not ready either with ports that it may not open", machine.unit(UNIT, "ActiveState"), "activating")
    # Serial ports normally belong to this group.
    machine.must("chgrp", "dialout", *ports)
    machine.must("chmod", "660", *ports)
    lab.journal.wait_for("ready: frames flow", before)
    machine.must("systemctl", "start", UNIT)
    check.equal("with ports that it may open it becomes ready", machine.unit(UNIT, "ActiveState", "StatusText"), ["active", "rig bench: frames flow"])
    check.succeeds("tactus reset homes the stage", lab.tactus("reset"))


def dashboard(lab):
    """The dashboard: a separate process without devices."""
    machine, check = lab.machine, lab.check
    unit = "tactus-web.service"
    check.equal("the dashboard's unit is enabled", machine.run("systemctl", "is-enabled", unit).stdout.strip(), "enabled")
    check.succeeds("systemctl start tactus-web", machine.run("systemctl", "start", unit))
    done = machine.run("systemd-analyze", "security", "--no-pager", "--threshold=20", unit)
    check.succeeds("its exposure is at most 2.0", done)
    print("     " + next(line for line in done.stdout.splitlines() if "Overall" in line).strip())
    pid = machine.unit(unit, "MainPID")
    user = int(machine.must("stat", "--format=%u", f"/proc/{pid}"))
    check("its user is in the dynamic range", 61184 <= user <= 65519, "61184 to 65519", user)
    names = set(machine.must("ls", f"/proc/{pid}/root/dev").split())
    check("it sees no device", not any(name.startswith(("tty", "hidraw", "bus")) and name != "tty" for name in names), "pseudo-devices", names)
    page = machine.run("bash", "-c", ASK)
    check("it serves its page on loopback", "<title>Tactus</title>" in page.stdout, "the page", page.stdout + page.stderr)
    mode = machine.must("stat", "--format=%a %G", "/run/tactus-web/token").strip()
    check.equal("its token is for the group", mode, "640 tactus")
    check("others do not see it", machine.run("cat", "/run/tactus-web/token", user="stranger").returncode != 0, "no permission", "a token")
    stop = ASK.replace("GET / ", "POST /stop ").replace("Host: localhost", "Host: localhost\\r\\nContent-Length: 0")
    done = machine.run("bash", "-c", stop, user="stranger")
    check("everybody can stop there: it reaches the bus", "204" in done.stdout, "204", done.stdout + done.stderr)
    before = lab.status()
    machine.must("systemctl", "kill", "--kill-whom=main", "--signal=KILL", unit)
    after = lab.frames_later(20)
    check.equal("if it is killed, the service loses no frame", after["sensor"]["frames_lost"], before["sensor"]["frames_lost"])
    machine.must("systemctl", "stop", unit)


def watchdog(lab):
    """Watchdog: the service hangs while the tip is on its way down."""
    machine, check = lab.machine, lab.check
    client = lab.press()
    before = time.monotonic()
    machine.must("systemctl", "kill", "--kill-whom=main", "--signal=STOP", UNIT)
    stopped = lab.truth()
    recording = lab.recording()
    lab.journal.wait_for("Watchdog timeout", before)
    hung = lab.truth()
    lab.journal.wait_for("ready: frames flow", before)
    client.wait()
    machine.must("systemctl", "start", UNIT)
    state = machine.unit(UNIT, "ActiveState", "NRestarts")
    check.equal("a service that hangs is killed and restarted", state, ["active", "1"])
    # On the way down, the true tip is below the last confirmed depth.
    check("the tip went at most 0.1 mm deeper, and stopped", hung["z_mm"] >= stopped["z_mm"] - 0.1 and not hung["moving"],
          f"z >= {stopped['z_mm'] - 0.1:.3f} mm", hung)
    status = lab.frames_later(20)
    check.equal("the restart moved nothing", lab.truth(), hung)
    check.equal("no run continues, and the status says that a reset is needed",
                [status["run"]["phase"], status["run"]["run_id"], status["fault"]], ["idle", "", "nothing has been reset since the service started"])
    print(f"     service stopped at z = {stopped['z_mm']:.3f} mm, tip at rest at {hung['z_mm']:.3f} mm")

    done = lab.tactus("--json", "record", "info", recording)
    check.succeeds("the restarted service has closed the recording", done)
    check.equal("as crashed", json.loads(done.stdout or "{}").get("exit_status"), "crashed")
    done = lab.tactus("--json", "reset")
    check.succeeds("an explicit reset", done)
    check("raises the tip", lab.truth()["z_mm"] > 0, "above the covering", lab.truth())
    check.succeeds("and the next run is done", lab.tactus("run", "press.star"))


def killed(lab):
    """The service is killed while the tip is on its way down."""
    machine, check = lab.machine, lab.check
    machine.must("systemctl", "reset-failed", UNIT)
    client = lab.press()
    before = time.monotonic()
    machine.must("systemctl", "kill", "--kill-whom=main", "--signal=KILL", UNIT)
    stopped = lab.truth()
    lab.journal.wait_for("ready: frames flow", before)
    client.wait()
    lab.frames_later(20)
    after = lab.truth()
    check("kill -9: the tip went at most 0.1 mm deeper, and does not move after the restart",
          after["z_mm"] >= stopped["z_mm"] - 0.1 and not after["moving"], f"z >= {stopped['z_mm'] - 0.1:.3f} mm", after)
    lab.machine.must("tactus", "reset")


def termination(lab):
    """`systemctl stop` in the middle of a press."""
    machine, check = lab.machine, lab.check
    client = lab.press()
    recording = lab.recording()
    machine.must("systemctl", "stop", UNIT)
    client.wait()
    state = machine.unit(UNIT, "ActiveState", "Result", "ExecMainStatus")
    check.equal("systemctl stop during a press ends the service within the limit, with status 0", state, ["inactive", "success", "0"])
    truth = lab.truth()
    check("the tip is up", truth["z_mm"] > 1.9 and not truth["moving"], "z = 2 mm", truth)
    done = lab.tactus("--json", "record", "info", recording)
    check.succeeds("the recording has its footer", done)
    check.equal("and says that the run was stopped", json.loads(done.stdout or "{}").get("exit_status"), "stopped")


def dynamic_user(lab):
    """Decision 0016: the service also works as a dynamic user, but then nobody can read what it records."""
    machine, check = lab.machine, lab.check
    lab.configure()
    recording = lab.recording()
    machine.must("systemctl", "reset-failed", UNIT)
    lab.drop_in("[Service]\nUser=\nGroup=\nDynamicUser=yes\n")
    check.succeeds("with DynamicUser=yes it becomes ready", machine.run("systemctl", "start", UNIT))
    pid = machine.unit(UNIT, "MainPID")
    user = int(machine.must("stat", "--format=%u", f"/proc/{pid}"))
    check("its user is in the dynamic range then", 61184 <= user <= 65519, "61184 to 65519", user)
    done = lab.tactus("record", "info", recording)
    check("and a scientist cannot reach the recordings", "ermission denied" in done.stderr, "Permission denied", done.stderr)
    machine.must("systemctl", "stop", UNIT)
    lab.drop_in(None)
    machine.must("systemctl", "start", UNIT)
    owner = machine.must("stat", "--format=%U", recording).strip()
    check.equal("without it again, the recordings are in their place and belong to tactus", owner, "tactus")
    check.succeeds("and a scientist reads them", lab.tactus("record", "info", recording))


def removal(lab):
    """Upgrade, removal and purge."""
    machine, check = lab.machine, lab.check
    recording = lab.recording()
    before = machine.unit(UNIT, "MainPID", "InvocationID")
    done = machine.run("dpkg", "-i", "/tactus.deb")
    check.succeeds("the package installs over itself", done)
    check.equal("the service keeps running meanwhile", machine.unit(UNIT, "MainPID", "InvocationID"), before)
    check("the output says how to restart it", "systemctl restart tactusd" in done.stdout, "a hint", done.stdout)
    check.succeeds("the package is removed", machine.run("dpkg", "-r", "tactus"))
    ended = machine.run("systemctl", "is-active", UNIT).stdout.strip()
    left = machine.run("ls", "/etc/tactus/tactusd.toml", recording)
    check.equal("the service has ended", ended, "inactive")
    check.succeeds("configuration and recordings remain", left)
    check.succeeds("the package is purged", machine.run("dpkg", "-P", "tactus"))
    check.succeeds("recordings remain even then", machine.run("ls", recording))
    check("the configuration is removed", machine.run("ls", "/etc/tactus/tactusd.toml").returncode != 0, "gone", "there")


def main():
    folder, package = map(pathlib.Path, sys.argv[1:])
    # A terminated test cleans up like a failed one.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    check = Checks()
    started = time.monotonic()
    with Machine(folder.resolve()) as machine:
        print(f"booted in {time.monotonic() - started:.1f} s", flush=True)
        lab = Lab(machine, check)
        try:
            installation(lab, package)
            for part in (sandbox, dashboard, journal, configuration, devices, watchdog, killed, termination, dynamic_user, removal):
                print(f"-- {part.__doc__.strip()} [{time.monotonic() - started:.0f} s]", flush=True)
                part(lab)
        except Exception:
            check("the checks run to their end", False, "no error", traceback.format_exc())
            print(machine.run("journalctl", "--no-pager", "--lines=60").stdout)
    print(f"{check.passed} passed, {check.failed} failed in {time.monotonic() - started:.0f} s")
    return 1 if check.failed else 0


if __name__ == "__main__":
    sys.exit(main())
