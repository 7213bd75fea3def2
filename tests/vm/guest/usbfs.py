"""USB transfers without a driver, through the kernel's /dev/bus/usb, as libraries make them.

Linux, include/uapi/linux/usbdevice_fs.h; numbers as on 64-bit machines.
"""

import ctypes
import os
from pathlib import Path

CLAIM_INTERFACE, CLEAR_HALT, BULK, SUBMIT, REAP = 0x8004550F, 0x80045515, 0xC0185502, 0x8038550A, 0x4008550C
BULK_URB = 3

libc = ctypes.CDLL(None, use_errno=True)


class Bulk(ctypes.Structure):
    _fields_ = [("endpoint", ctypes.c_uint), ("length", ctypes.c_uint), ("timeout_ms", ctypes.c_uint), ("data", ctypes.c_void_p)]


class Urb(ctypes.Structure):
    _fields_ = [
        ("kind", ctypes.c_ubyte),
        ("endpoint", ctypes.c_ubyte),
        ("status", ctypes.c_int),
        ("flags", ctypes.c_uint),
        ("data", ctypes.c_void_p),
        ("length", ctypes.c_int),
        ("actual", ctypes.c_int),
        ("start_frame", ctypes.c_int),
        ("packets", ctypes.c_int),
        ("errors", ctypes.c_int),
        ("signal", ctypes.c_uint),
        ("context", ctypes.c_void_p),
    ]


class Device:
    """A device, found by its serial number, with interface 0 claimed."""

    def __init__(self, serial: str):
        for device in Path("/sys/bus/usb/devices").iterdir():
            file = device / "serial"
            if file.exists() and file.read_text().strip() == serial:
                bus, number = (int((device / name).read_text()) for name in ("busnum", "devnum"))
                self.file = os.open(f"/dev/bus/usb/{bus:03}/{number:03}", os.O_RDWR)
                self.call(CLAIM_INTERFACE, ctypes.c_uint(0))
                return
        raise OSError(f"no device {serial}")

    def call(self, number: int, argument) -> int:
        result = libc.ioctl(self.file, ctypes.c_ulong(number), ctypes.byref(argument))
        if result < 0:
            error = ctypes.get_errno()
            raise OSError(error, os.strerror(error))
        return result

    def read(self, endpoint: int, room: int, timeout_ms: int) -> bytes:
        buffer = ctypes.create_string_buffer(room)
        count = self.call(BULK, Bulk(endpoint, room, timeout_ms, ctypes.addressof(buffer)))
        return buffer.raw[:count]

    def write(self, endpoint: int, data: bytes, timeout_ms: int) -> int:
        buffer = ctypes.create_string_buffer(data, len(data))
        return self.call(BULK, Bulk(endpoint, len(data), timeout_ms, ctypes.addressof(buffer)))

    def stream(self, endpoint: int, room: int, count: int, at_once: int) -> list[bytes]:
        """Reads `count` transfers. `at_once` of them are always pending, as in programs that must lose nothing."""
        buffers = [ctypes.create_string_buffer(room) for _ in range(at_once)]
        urbs = {}
        for buffer in buffers:
            urb = Urb(kind=BULK_URB, endpoint=endpoint, data=ctypes.addressof(buffer), length=room)
            urbs[ctypes.addressof(urb)] = (urb, buffer)
            self.call(SUBMIT, urb)
        found = []
        while len(found) < count:
            done = ctypes.c_void_p()
            self.call(REAP, done)
            urb, buffer = urbs[done.value]
            if urb.status != 0:
                raise OSError(-urb.status, os.strerror(-urb.status))
            found.append(buffer.raw[: urb.actual])
            self.call(SUBMIT, urb)
        return found

    def clear_halt(self, endpoint: int) -> None:
        self.call(CLEAR_HALT, ctypes.c_uint(endpoint))

    def close(self) -> None:
        os.close(self.file)
