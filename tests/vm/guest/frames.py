"""Decodes the frames of config/links/digitacts*.toml as far as the checks need it."""

import struct
from binascii import crc_hqx

HID_BYTES, BULK_BYTES = 105, 106
# CCITT-FALSE.
CRC_INIT = 0xFFFF


class Counter:
    """Counts good frames, broken frames (wrong form or checksum), and frames missing by their sequence numbers."""

    def __init__(self, kind: str):
        self.is_hid = kind == "hid"
        self.frames = self.broken = self.missing = 0
        self.last = None
        self.ticks_ms: list[int] = []

    def take(self, frame: bytes) -> None:
        if self.is_hid:
            is_whole = len(frame) == HID_BYTES and frame[0] == 1
            is_whole = is_whole and crc_hqx(frame[:-2], CRC_INIT) == int.from_bytes(frame[-2:], "little")
        else:
            is_whole = len(frame) == BULK_BYTES and frame[:3] == b"\xaa\x55\x65"
            is_whole = is_whole and crc_hqx(frame[2:-2], CRC_INIT) == int.from_bytes(frame[-2:], "little")
        if not is_whole:
            self.broken += 1
            return
        number, wrap = (struct.unpack_from("<H", frame, 1)[0], 1 << 16) if self.is_hid else (frame[3], 1 << 8)
        if self.last is not None:
            self.missing += (number - self.last - 1) % wrap
        self.last = number
        self.frames += 1
        self.ticks_ms.append(struct.unpack_from("<I", frame, 3 if self.is_hid else 4)[0])
