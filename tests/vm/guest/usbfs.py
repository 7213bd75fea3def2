"""Transfers without a driver: the kernel's /dev/bus/usb, as libraries use it.

Linux, include/uapi/linux/usbdevice_fs.h; numbers as on 64-bit machines.
"""

import ctypes
import fcntl
import os
import struct
from pathlib import Path

CLAIM_INTERFACE, CLEAR_HALT, BULK = 0x8004550F, 0x80045515, 0xC0185502


class Device:
    """A device by its serial number, its interface 0 claimed."""

    def __init__(self, serial: str):
        for device in Path("/sys/bus/usb/devices").iterdir():
            file = device / "serial"
            if file.exists() and file.read_text().strip() == serial:
                bus, number = (int((device / name).read_text()) for name in ("busnum", "devnum"))
                self.file = os.open(f"/dev/bus/usb/{bus:03}/{number:03}", os.O_RDWR)
                fcntl.ioctl(self.file, CLAIM_INTERFACE, struct.pack("I", 0))
                return
        raise OSError(f"no device {serial}")

    def bulk(self, endpoint: int, data: bytes | int, timeout_ms: int) -> bytes | int:
        """Reads up to so many bytes, or writes; gives the bytes read, or how many were written."""
        is_read = isinstance(data, int)
        buffer = ctypes.create_string_buffer(data) if is_read else ctypes.create_string_buffer(data, len(data))
        # Only of a buffer that it may change does Python give the call's own result: the bytes that went over.
        request = bytearray(struct.pack("IIIxxxxP", endpoint, len(buffer), timeout_ms, ctypes.addressof(buffer)))
        count = fcntl.ioctl(self.file, BULK, request, True)
        return buffer.raw[:count] if is_read else count

    def clear_halt(self, endpoint: int) -> None:
        fcntl.ioctl(self.file, CLEAR_HALT, struct.pack("I", endpoint))

    def close(self) -> None:
        os.close(self.file)
