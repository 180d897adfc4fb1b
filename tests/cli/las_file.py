# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Reads clouds in LAS files by the words of docs/files/clouds.md."""
import struct


def read(path, every=97):
    """Every so manieth point with its extra fields, facts of the records of the user risley, and the
    table of a trajectory's errors."""
    data = path.read_bytes()
    at, points_at, records = struct.unpack_from("<HII", data, 94)
    length, = struct.unpack_from("<H", data, 105)
    scale, offset = struct.unpack_from("<3d", data, 131), struct.unpack_from("<3d", data, 155)
    (evlr_at, evlrs), (count,) = struct.unpack_from("<QI", data, 235), struct.unpack_from("<Q", data, 247)
    fields, kinds, facts, rows = [], [], {}, []

    def take(user, number, body):
        if user == b"LASF_Spec" and number == 4:
            for k in range(0, len(body), 192):
                fields.append(body[k + 4:k + 36].split(b"\0")[0].decode())
                kinds.append(" BbHhIiQqfd"[body[k + 2]])
        if user == b"risley" and number in (99, 100):
            for line in body.decode().rstrip("\0").splitlines():
                key, _, values = line.partition(": ")
                facts.setdefault(key, []).extend(values.strip("[]").split(","))
        if user == b"risley" and number > 100:
            for k in range(0, len(body), 80):
                rows.append(struct.unpack_from("<q9d", body, k))
    for _ in range(records):
        user, number, size = struct.unpack_from("<16sHH", data, at + 2)
        take(user.split(b"\0")[0], number, data[at + 54:at + 54 + size])
        at += 54 + size
    at = evlr_at
    for _ in range(evlrs):
        user, number, size = struct.unpack_from("<16sHQ", data, at + 2)
        take(user.split(b"\0")[0], number, data[at + 60:at + 60 + size])
        at += 60 + size
    points = []
    for k in range(0, count, every):
        base = points_at + k * length
        whole = struct.unpack_from("<3i", data, base)
        point = dict(zip(fields, struct.unpack_from("<" + "".join(kinds), data, base + 30)))
        point["at"] = [w * s + o for w, s, o in zip(whole, scale, offset)]
        point["source"], = struct.unpack_from("<H", data, base + 20)
        adjusted, = struct.unpack_from("<d", data, base + 22)
        point["time_ns"] = round(1e9 * adjusted) + (10**9 + 315964800 - 18) * 10**9
        points.append(point)
    return points, facts, rows
