"""The book, "Connect your hardware" and "Your own sensor", step by step, with a kit that sends packets and a stage. The commands are taken
from the pages; only devices and files are changed in them."""

import json
import re
import subprocess
from pathlib import Path

from check_enumeration import BULK_LINK
from check_streaming import run_on
from lab import BINARIES, LIMIT_S, REPOSITORY, Folder, Service, at_least, check, plug, that, until_gone, wait

PAGES = ("hardware.md", "sensor.md")


def commands() -> list[str]:
    """Every command line of the pages."""
    text = "\n".join((REPOSITORY / "docs/book/how-to" / page).read_text() for page in PAGES)
    return [line for line in text.splitlines() if line.startswith("tactus ")]


def do(folder: Path, begin: str, *also: str, **changes: str) -> subprocess.CompletedProcess:
    """Runs the book's command that starts with `begin`; `changes` maps texts of the command to their replacements."""
    command = next((line for line in commands() if line.startswith(begin)), None)
    if command is None:
        raise ValueError(f"the book has no command {begin!r}")
    for old, new in changes.items():
        command = command.replace(old, new)
    words = [*command.split()[1:], *also]
    return subprocess.run(
        [BINARIES / "tactus", *words], cwd=folder, capture_output=True, text=True, timeout=LIMIT_S, stdin=subprocess.DEVNULL
    )


def rig_of(transports: dict[str, str]) -> str:
    """A copy of the shipped rig with other links. `simulated` stays true, because the devices here are simulated."""
    text = (REPOSITORY / "config/rigs/sim.toml").read_text()
    embedded = 'transport = { kind = "embedded" }'
    sensor, stage = f'protocol = "weiss-dsa"\n{embedded}', f'protocol = "grbl"\n{embedded}'
    described = 'protocol = "declared"\nformat = "my-kit.toml"'
    text = text.replace(sensor, f"{described}\ntransport = {transports['sensor']}")
    return text.replace(stage, f'protocol = "grbl"\ntransport = {transports["stage"]}')


def check_connect_your_hardware():
    """book: from two newly plugged-in devices to a run"""
    with Folder() as folder, plug("--sensor", "bulk", "--link", BULK_LINK, "--stage", "cdc-acm"):
        transports = {}

        def shown() -> bool:
            said = json.loads(do(folder, "tactus devices", "--json").stdout)
            ours = [device for device in said["devices"] if (device["serial"] or "").startswith("SIM")]
            transports.update({device["serial"].removeprefix("SIM-").lower(): device["transport"] for device in ours})
            return len(transports) == 2

        wait("tactus devices shows both", shown)
        check("tactus devices shows both", ["sensor", "stage"], sorted(transports))

        done = do(folder, "tactus link sniff usb:", **{"1209:0020/A1:3:85": "1209:0004/SIM-SENSOR:0:81"})
        check("tactus link sniff estimates the format of the frames", that("106 bytes, sync 0xAA 0x55", lambda said:
              "frames of 106 bytes that begin with [0xAA, 0x55]" in said), done.stdout + done.stderr)

        kit = BULK_LINK.read_text()
        (folder / "my-kit.toml").write_text(kit.replace("init = 0xFFFF", "init = 0x0000").replace("0x29B1", "0x31C3"))
        done = do(folder, "tactus link check my-kit.toml --capture", "--json")
        report = json.loads(done.stdout)["capture"]
        check("with a wrong checksum in the description no frame decodes, and the report says so", [1, 0, True],
              [done.returncode, report["frames"], report["first_bad_checksum"] is not None])
        (folder / "my-kit.toml").write_text(kit)
        done = do(folder, "tactus link check my-kit.toml --capture", "--json")
        report = json.loads(done.stdout)["capture"]
        check("with the right checksum every byte is part of a frame", [0, 0], [done.returncode, report["skipped_bytes"]])
        check("frames in the capture", at_least(60), report["frames"])

        (folder / "my-rig.toml").write_text(rig_of(transports))
        config = (REPOSITORY / "config/tactusd.toml").read_text().replace("rigs/sim.toml", "my-rig.toml")
        (folder / "tactusd.toml").write_text(re.sub("^experiments = .*$", "", config, flags=re.MULTILINE))
        for begin, *also in (("tactus validate my-rig.toml",), ("tactus devices --rig my-rig.toml",),
                             ("tactus stage check", "--yes")):
            done = do(folder, begin, *also)
            check(begin, that("exit status 0", lambda seen: seen[0] == 0), (done.returncode, done.stdout + done.stderr))

        with Service(folder / "my-rig.toml") as service:
            run_on(folder, service, "and a run")
    until_gone()
