# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""LVX 1.1, read from its description and not with risley. data may be bytes or a mapped file."""
import struct

from livox_peer import TYPES

HEADER_BYTES, DEVICE_BYTES, FRAME_BYTES, PACKET_BYTES = 29, 59, 24, 18


def devices(data):
    """(serial number, kind of data set, device type) of every device."""
    assert data[:10] == b"livox_tech" and data[16:20] == b"\1\1\0\0"
    places = (HEADER_BYTES + DEVICE_BYTES * i for i in range(data[28]))
    return [(data[at:at + 16].rstrip(b"\0").decode(), data[at + 32], data[at + 33]) for at in places]


def packets(data):
    """(index of its device, packet as it came from the sensor), one after another."""
    at, index = HEADER_BYTES + DEVICE_BYTES * data[28], 0
    while at < len(data):
        current, following, number = struct.unpack_from("<QQQ", data, at)
        assert current == at and following <= len(data) and number == index
        at, index = at + FRAME_BYTES, index + 1
        while at < following:
            records, size, _, _ = TYPES[data[at + 10]]
            end = at + 1 + PACKET_BYTES + records * size
            yield data[at], data[at + 1:end]
            at = end
