"""Frames as HID reports, read from /dev/hidraw."""

import os
import select
from pathlib import Path

from check_enumeration import HID_LINK
from frames import HID_BYTES, Counter
from lab import Folder, Hung, at_least, check, plug, rig_file, until_gone, wait


def hidraw() -> Path:
    def found():
        nodes = Path("/sys/class/hidraw").iterdir()
        ours = [node.name for node in nodes if "HID_UNIQ=SIM" in (node / "device/uevent").read_text()]
        return Path("/dev") / ours[0] if ours and (Path("/dev") / ours[0]).exists() else None

    return wait("a report device", found, 30)


def read(file: int, counter: Counter, frames: int, limit_s: float = 60) -> None:
    """Reads this number of reports and decodes them afterwards, because the kernel keeps at most 64 for a slow reader."""
    reports = []
    while len(reports) < frames:
        if not select.select([file], [], [], limit_s)[0]:
            raise Hung(f"no report for {limit_s} s after {len(reports)}")
        reports.append(os.read(file, 4096))
    for report in reports:
        counter.take(report)


def check_reports():
    """hid: each report is a frame, none is lost, and the kernel does not treat them as input"""
    with plug("--sensor", "hid", "--link", HID_LINK):
        node = hidraw()
        check("input devices (keyboard, mouse) that it makes", [], [str(path) for path in Path("/dev").glob("input/event*")])
        descriptor = (Path("/sys/class/hidraw") / node.name / "device/report_descriptor").read_bytes()
        check("report descriptor: vendor page, report 1 of 104 bytes",
              "0600ff0901a10185010901150026ff0075089668008102c0", descriptor.hex())
        counter = Counter("hid")
        file = os.open(node, os.O_RDONLY)
        read(file, counter, 90)
        os.close(file)
        check("three seconds at 30 Hz: frames, broken, missing", [90, 0, 0],
              [counter.frames, counter.broken, counter.missing])
        steps = sorted({b - a for a, b in zip(counter.ticks_ms, counter.ticks_ms[1:])})
        check("ms from frame to frame by the device's clock", [33, 34], steps)
    until_gone("SIM-SENSOR")


def check_reports_at_100_hz():
    """hid: 100 reports a second, none lost"""
    with Folder() as folder, plug("--sensor", "hid", "--link", HID_LINK, rig=rig_file(folder, rate_hz=100.0)):
        counter = Counter("hid")
        file = os.open(hidraw(), os.O_RDONLY)
        read(file, counter, 500)
        os.close(file)
        check("frames, broken, missing", [500, 0, 0], [counter.frames, counter.broken, counter.missing])
    until_gone("SIM-SENSOR")


def check_reports_at_1_khz():
    """hid: 1000 reports a second; each arrives or is counted as missing (the driver requests one at a time, too slow under emulation)"""
    with Folder() as folder, plug("--sensor", "hid", "--link", HID_LINK, rig=rig_file(folder, rate_hz=1000.0)):
        counter = Counter("hid")
        file = os.open(hidraw(), os.O_RDONLY)
        read(file, counter, 2000)
        os.close(file)
        check("frames, broken", [2000, 0], [counter.frames, counter.broken])
        ms = counter.ticks_ms[-1] - counter.ticks_ms[0]
        check("frames and missing ones, by the device's clock", ms, counter.frames + counter.missing - 1)
    until_gone("SIM-SENSOR")


def check_unplugged_while_read():
    """hid: a reading program gets an error when the device is unplugged, and finds it again under another name"""
    with plug("--sensor", "hid", "--link", HID_LINK) as mock:
        before, counter = hidraw(), Counter("hid")
        file = os.open(before, os.O_RDONLY)
        read(file, counter, 5)
        mock.do("sensor unplug")
        try:
            read(file, counter, 1000)
            check("the read", "fails", "goes on")
        except OSError as error:
            check("the read fails", "EIO" if error.errno == 5 else error.errno, "EIO")
        # While the old node is open, its number is in use.
        until_gone("SIM-SENSOR")
        mock.do("sensor plug")
        after = hidraw()
        os.close(file)
        check("it comes back as another node", True, after != before)
        again, file = Counter("hid"), os.open(after, os.O_RDONLY)
        read(file, again, 30)
        os.close(file)
        check("after that: broken, missing", [0, 0], [again.broken, again.missing])
        check("first time on its new clock, ms", at_least(1), again.ticks_ms[0])
    until_gone("SIM-SENSOR")


def check_a_stalled_endpoint():
    """hid: after a stall the kernel clears the halt, and reports continue"""
    with plug("--sensor", "hid", "--link", HID_LINK) as mock:
        counter, file = Counter("hid"), os.open(hidraw(), os.O_RDONLY)
        read(file, counter, 5)
        mock.do("sensor halt")
        read(file, counter, 60)
        os.close(file)
        check("frames, broken", [65, 0], [counter.frames, counter.broken])
    until_gone("SIM-SENSOR")
