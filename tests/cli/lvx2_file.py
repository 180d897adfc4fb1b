# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Reads LVX 2 from its description, not with risley."""
import struct


def devices(data):
    """(serial number, address, device type) of an LVX 2."""
    assert data[:16] == b"livox_tech".ljust(16, b"\0") and data[16:24] == bytes.fromhex("0200000067A70EAC")
    assert struct.unpack_from("<I", data, 24)[0] == 50
    places = (29 + 63 * i for i in range(data[28]))
    return [(data[at:at + 16].rstrip(b"\0").decode(), ".".join(map(str, data[at + 32:at + 36])), data[at + 37])
            for at in places]


def packages(data):
    """(frame, time in ns, number, data type, time type, points) of every package."""
    at, index = 29 + 63 * data[28], 0
    while at < len(data):
        current, following, number = struct.unpack_from("<QQQ", data, at)
        assert current == at and following <= len(data) and number == index
        at += 24
        while at < following:
            assert data[at] == 0
            time_type, time_ns, count, kind, length = struct.unpack_from("<BQHBI", data, at + 6)
            yield index, time_ns, count, kind, time_type, data[at + 27:at + 27 + length]
            at += 27 + length
        index += 1
