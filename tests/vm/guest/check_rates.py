"""Faster than the paper's 30 frames a second."""

import os
import termios
import time
import tty
from pathlib import Path

import weiss
from lab import SENSOR, Folder, Service, at_least, between, check, plug, rig_file, until_gone, wait


def read(file: int, count: int) -> bytes:
    """Reads this number of bytes, to be decoded afterwards."""
    pieces, length = [], 0
    while length < count:
        pieces.append(os.read(file, 65536))
        length += len(pieces[-1])
    return b"".join(pieces)


def check_a_serial_port_at_1_khz():
    """rates: 1000 frames a second from a serial port, none lost"""
    with Folder() as folder, plug("--sensor", "cdc-acm", rig=rig_file(folder, rate_hz=1000.0)):
        wait("udev names the sensor", Path(SENSOR).exists, 30)
        file = os.open(SENSOR, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(file, termios.TCSANOW)
        os.write(file, weiss.acquire(1000))
        times_ms = weiss.times_ms(read(file, 3000 * weiss.FRAME_BYTES))
        os.close(file)
        check("frames", at_least(2990), len(times_ms))
        check("ms from frame to frame by the device's clock", [1], sorted({b - a for a, b in zip(times_ms, times_ms[1:])}))
    until_gone("SIM-SENSOR")


def check_the_service_at_1_khz():
    """rates: the service at 1000 frames a second; it receives or counts as lost each frame (under emulation it is too slow for all)"""
    with Folder() as folder:
        rig = rig_file(folder, rate_hz=1000.0)
        with plug("--sensor", "cdc-acm", "--stage", "cdc-acm", rig=rig), Service(rig) as service:
            earliest = time.monotonic()
            begin = service.until_connected()["sensor"]
            latest = time.monotonic()
            service.until("frames come", lambda said: said["sensor"]["frames"] >= begin["frames"] + 5000)
            shortest_s = time.monotonic() - latest
            end = service.status()["sensor"]
            longest_s = time.monotonic() - earliest
            frames, lost = (end[key] - begin[key] for key in ("frames", "frames_lost"))
            # Frames in transit, at most those of a second, are neither.
            bounds = between(round(1000 * (shortest_s - 1)), round(1000 * (longest_s + 1)))
            check("frames received or lost in the elapsed time", bounds, frames + lost)
            check("connected", True, end["connected"])
    until_gone()


def check_the_service_at_100_hz():
    """rates: the service at 100 frames a second, none lost"""
    with Folder() as folder:
        rig = rig_file(folder, rate_hz=100.0)
        with plug("--sensor", "cdc-acm", "--stage", "cdc-acm", rig=rig), Service(rig) as service:
            begin = service.until_connected()["sensor"]
            end = service.until("frames come", lambda said: said["sensor"]["frames"] >= begin["frames"] + 500)["sensor"]
            check("frames lost", 0, end["frames_lost"] - begin["frames_lost"])
    until_gone()
