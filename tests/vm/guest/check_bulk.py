"""Frames from a bulk endpoint, read as USB libraries read it."""

import errno
import time

from check_enumeration import BULK_LINK
from frames import Counter
from lab import Folder, between, check, plug, rig_file, until_gone, usb_devices, wait
from usbfs import Device

IN, OUT = 0x81, 0x01


def outcome(transfer) -> str:
    """The name of the error, or the number of bytes that arrived."""
    try:
        return f"{len(transfer())} bytes"
    except OSError as error:
        return errno.errorcode[error.errno]


def device() -> Device:
    wait("the sensor is enumerated", lambda: "SIM-SENSOR" in usb_devices(), 30)
    return wait("the sensor can be opened", opened, 30)


def opened():
    try:
        return Device("SIM-SENSOR")
    except OSError:
        # The kernel lists a device before it can be opened.
        return None


def read(usb: Device, counter: Counter, frames: int) -> None:
    for _ in range(frames):
        counter.take(usb.read(IN, 512, 60_000))


def check_frames():
    """bulk: each transfer is a frame; a read without data waits, and can be cancelled"""
    with plug("--sensor", "bulk", "--link", BULK_LINK) as mock:
        usb, counter = device(), Counter("bulk")
        read(usb, counter, 60)
        check("frames, broken, missing", [60, 0, 0], [counter.frames, counter.broken, counter.missing])
        mock.do("sensor stall 3s")
        while outcome(lambda: usb.read(IN, 512, 200)) != "ETIMEDOUT":
            pass
        start = time.monotonic()
        check("a read for 500 ms while the sensor is silent", "ETIMEDOUT", outcome(lambda: usb.read(IN, 512, 500)))
        check("seconds that it waited", between(0.5, 2.5), round(time.monotonic() - start, 1))
        check("a read with a long timeout waits for the next frame", "106 bytes", outcome(lambda: usb.read(IN, 512, 60_000)))
        check("bytes taken of what the host writes", 7, usb.write(OUT, b"acquire", 1000))
        usb.close()
    until_gone("SIM-SENSOR")


def check_a_stalled_endpoint():
    """bulk: a stalled endpoint stays stalled until the program clears the halt"""
    with plug("--sensor", "bulk", "--link", BULK_LINK) as mock:
        usb, counter = device(), Counter("bulk")
        read(usb, counter, 5)
        mock.do("sensor halt")
        seen = [outcome(lambda: usb.read(IN, 512, 5000)) for _ in range(2)]
        check("reads of a halted endpoint", ["EPIPE", "EPIPE"], seen)
        usb.clear_halt(IN)
        check("a read after that", "106 bytes", outcome(lambda: usb.read(IN, 512, 5000)))
        usb.close()
    until_gone("SIM-SENSOR")


def check_unplugged_while_read():
    """bulk: after unplugging a read fails at once; after plugging in again another program finds the device"""
    with plug("--sensor", "bulk", "--link", BULK_LINK) as mock:
        usb, counter = device(), Counter("bulk")
        read(usb, counter, 5)
        mock.do("sensor unplug")
        until_gone("SIM-SENSOR")
        check("a read of an unplugged device", "ENODEV", outcome(lambda: usb.read(IN, 512, 5000)))
        usb.close()
        mock.do("sensor plug elsewhere")
        usb, again = device(), Counter("bulk")
        read(usb, again, 30)
        check("plugged in again: frames, broken, missing", [30, 0, 0], [again.frames, again.broken, again.missing])
        usb.close()
    until_gone("SIM-SENSOR")


def check_frames_at_1_khz():
    """bulk: 1000 transfers a second, none lost"""
    with Folder() as folder, plug("--sensor", "bulk", "--link", BULK_LINK, rig=rig_file(folder, rate_hz=1000.0)):
        usb, counter = device(), Counter("bulk")
        for frame in usb.stream(IN, 512, 5000, at_once=64):
            counter.take(frame)
        check("frames, broken, missing", [5000, 0, 0], [counter.frames, counter.broken, counter.missing])
        usb.close()
    until_gone("SIM-SENSOR")
