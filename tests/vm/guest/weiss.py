"""The part of weiss-dsa that is needed to count frames; crates/tactus-wire/src/weiss.rs has the whole protocol."""

import struct

FRAME_BYTES = 109
SYNC = b"\xaa\xaa\xaa"


def crc(data: bytes) -> int:
    """The CRC with polynomial 0x1021; the table is not reflected, the register shifts to the right."""
    value = 0xFFFF
    for byte in data:
        entry = ((value ^ byte) & 0xFF) << 8
        for _ in range(8):
            entry = (entry << 1 ^ 0x1021 if entry & 0x8000 else entry << 1) & 0xFFFF
        value = value >> 8 ^ entry
    return value


def acquire(rate_hz: int) -> bytes:
    """The command that makes the sensor send frames."""
    body = struct.pack("<BHBH", 3, 3, 0x80, rate_hz)
    return SYNC + body + struct.pack("<H", crc(body))


def times_ms(stream: bytes) -> list[int]:
    """The device times of the complete frames, in order."""
    head = SYNC + struct.pack("<BH", 0, FRAME_BYTES - 8)
    found, at = [], stream.find(head)
    while at >= 0 and at + FRAME_BYTES <= len(stream):
        frame = stream[at : at + FRAME_BYTES]
        if crc(frame[3:-2]) == int.from_bytes(frame[-2:], "little"):
            found.append(struct.unpack_from("<I", frame, 6)[0])
            at += FRAME_BYTES
        at = stream.find(head, at)
    return found
