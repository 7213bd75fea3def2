#!/usr/bin/env python3
"""unpack-kernel.py VMLINUZ VMLINUX: takes the kernel out of its compressed file.

Where in the file it lies stands in the header of the boot protocol: Linux, Documentation/x86/boot.rst.
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
    # No sectors means four, for the oldest loaders' sake; the boot sector comes before them.
    sectors = (image[SETUP_SECTORS] or 4) + 1
    offset, length = struct.unpack_from("<II", image, PAYLOAD_OFFSET)
    begin = sectors * SECTOR + offset
    payload = image[begin : begin + length]
    for magic, unpack in UNPACK.items():
        if payload.startswith(magic):
            # The unpacked length follows the compressed data, which the unpackers leave alone.
            kernel = unpack(payload[:-4])
            if not kernel.startswith(b"\x7fELF"):
                sys.exit(f"{packed}: what it holds is no kernel")
            with open(unpacked, "wb") as file:
                file.write(kernel)
            return
    sys.exit(f"{packed}: compressed in a way unknown here, it begins with {payload[:6].hex()}")


main(*sys.argv[1:])
