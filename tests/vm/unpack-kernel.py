#!/usr/bin/env python3
"""unpack-kernel.py VMLINUZ VMLINUX: unpacks a compressed kernel.

The header of the boot protocol gives its position in the file: Linux, Documentation/x86/boot.rst.
"""

import lzma
import struct
import sys
import zlib

SETUP_SECTORS, PAYLOAD_OFFSET, SECTOR = 0x1F1, 0x248, 512
UNPACK = {b"\xfd7zXZ\0": lzma.decompress, b"\x1f\x8b": lambda data: zlib.decompress(data, 31)}


def main(packed: str, unpacked: str) -> None:
    with open(packed, "rb") as file:
        image = file.read()
    # 0 means four sectors, for compatibility with old boot loaders. The boot sector comes before them.
    sectors = (image[SETUP_SECTORS] or 4) + 1
    offset, length = struct.unpack_from("<II", image, PAYLOAD_OFFSET)
    begin = sectors * SECTOR + offset
    payload = image[begin : begin + length]
    for magic, unpack in UNPACK.items():
        if payload.startswith(magic):
            # The last four bytes are the unpacked length, not compressed data.
            kernel = unpack(payload[:-4])
            if not kernel.startswith(b"\x7fELF"):
                sys.exit(f"{packed}: the content is not a kernel")
            with open(unpacked, "wb") as file:
                file.write(kernel)
            return
    sys.exit(f"{packed}: unknown compression, which starts with {payload[:6].hex()}")


main(*sys.argv[1:])
