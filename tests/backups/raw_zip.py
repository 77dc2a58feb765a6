"""Zip archives byte by byte, where `zipfile` would refuse to write them or repair them."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass, field


@dataclass
class Entry:
    """An entry; what is None is what an honest writer would put there."""

    name: bytes
    data: bytes = b""
    flags: int = 0
    method: int = 0
    attributes: int = 0
    extra: bytes = b""
    size: int | None = None
    offset: int | None = None
    stored: bytes | None = None
    compressed: int | None = None
    made: dict = field(default_factory=dict)


def raw_zip(*entries: Entry) -> bytes:
    """Archive of the entries. Layout: PKWARE APPNOTE 4.3.7 (local), 4.3.12 (directory), 4.3.16 (end)."""
    out = bytearray()
    directory = bytearray()
    for entry in entries:
        stored = entry.data if entry.stored is None else entry.stored
        size = len(entry.data) if entry.size is None else entry.size
        compressed = len(stored) if entry.compressed is None else entry.compressed
        crc = zlib.crc32(entry.data)
        offset = len(out) if entry.offset is None else entry.offset
        if entry.offset is None:
            out += b"PK\x03\x04" + struct.pack(
                "<5H3L2H", 20, entry.flags, entry.method, 0, 33, crc, compressed, size, len(entry.name), 0
            )
            out += entry.name + stored
        directory += b"PK\x01\x02" + struct.pack(
            "<6H3L5H2L", 0x0314, 20, entry.flags, entry.method, 0, 33, crc, compressed, size,
            len(entry.name), len(entry.extra), 0, 0, 0, entry.attributes, offset,
        )  # fmt: skip
        directory += entry.name + entry.extra
    end = struct.pack("<4H2LH", 0, 0, len(entries), len(entries), len(directory), len(out), 0)
    return bytes(out + directory + b"PK\x05\x06" + end)


def unicode_path(raw: bytes, name: str) -> bytes:
    """Extra field 0x7075 (APPNOTE 4.6.9): version, checksum of the raw name, the name in UTF-8."""
    body = b"\x01" + struct.pack("<L", zlib.crc32(raw)) + name.encode("utf-8")
    return struct.pack("<HH", 0x7075, len(body)) + body
