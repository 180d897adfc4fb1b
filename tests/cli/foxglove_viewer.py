# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""A viewer of the points that record publishes: WebSocket, Foxglove's protocol and CDR by their descriptions alone."""
import base64
import collections
import hashlib
import json
import os
import socket
import struct
import threading

Channel = collections.namedtuple("Channel", "id topic encoding schema_name schema_encoding schema")
Cloud = collections.namedtuple("Cloud", "stamp_ns frame_id fields step data")
FORMATS = {2: "B", 6: "I", 7: "f", 8: "d"}  # of PointField


class Viewer:
    """A connection to a server of points."""

    def __init__(self, address, port, receive_buffer=None):
        self.socket = socket.socket()
        if receive_buffer:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        self.socket.settimeout(30)
        self.socket.connect((address, port))
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall((f"GET / HTTP/1.1\r\nHost: {address}:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                             f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n"
                             "Sec-WebSocket-Protocol: foxglove.sdk.v1, foxglove.websocket.v1\r\n\r\n").encode())
        self.file = self.socket.makefile("rb", buffering=1 << 20)
        head = b""
        while not head.endswith(b"\r\n\r\n"):
            head += self.file.readline()
        accepted = base64.b64encode(hashlib.sha1((key + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11").encode()).digest())
        assert head.startswith(b"HTTP/1.1 101 ") and b"Sec-WebSocket-Accept: " + accepted in head, head
        assert b"Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n" in head, head
        self.channels = {}

    def close(self):
        self.file.close()
        self.socket.close()

    def say(self, payload, opcode=1):
        mask = os.urandom(4)
        data = payload if isinstance(payload, bytes) else json.dumps(payload).encode()
        size = struct.pack(">B", 128 | len(data)) if len(data) < 126 else struct.pack(">BH", 254, len(data))
        self.socket.sendall(bytes([128 | opcode]) + size + mask +
                            bytes(byte ^ mask[i % 4] for i, byte in enumerate(data)))

    def frames(self):
        """Opcode and payload of every message, until the server ends."""
        parts = []
        while head := self.file.read(2):
            size = head[1]
            if size >= 126:
                size = int.from_bytes(self.file.read(2 if size == 126 else 8), "big")
            payload = self.file.read(size)
            opcode = head[0] & 15
            if opcode == 8:
                return
            if opcode == 9:
                self.say(payload, 10)
                continue
            parts.append((opcode, payload))
            if head[0] & 128:
                yield parts[0][0], b"".join(part for _, part in parts)
                parts = []

    def messages(self, topics=None):
        """Subscribes to what there is; topic, time and bytes of every message."""
        for opcode, payload in self.frames():
            if opcode == 2:
                kind, subscription, time_ns = struct.unpack_from("<BIQ", payload)
                assert kind == 1, kind
                yield self.channels[subscription - 1000], time_ns, payload[13:]
                continue
            said = json.loads(payload)
            if said["op"] == "serverInfo":
                self.info = said
            if said["op"] != "advertise":
                continue
            new = [Channel(one["id"], one["topic"], one["encoding"], one["schemaName"], one["schemaEncoding"],
                           one["schema"]) for one in said["channels"]]
            self.channels.update((one.id, one) for one in new)
            self.say({"op": "subscribe", "subscriptions": [{"id": 1000 + one.id, "channelId": one.id} for one in new
                                                           if topics is None or one.topic in topics]})


class Cdr:
    """Numbers and texts of a message, one after the other."""

    def __init__(self, data):
        assert data[:4] == b"\0\1\0\0", data[:4]
        self.data, self.at = data[4:], 0

    def number(self, kind):
        size = struct.calcsize(kind)
        self.at += -self.at % size
        value, = struct.unpack_from("<" + kind, self.data, self.at)
        self.at += size
        return value

    def bytes(self):
        size = self.number("I")
        self.at += size
        return self.data[self.at - size:self.at]

    def text(self):
        return self.bytes()[:-1].decode()


def cloud_of(data):
    """A sensor_msgs/msg/PointCloud2."""
    cdr = Cdr(data)
    stamp_ns = 10**9 * cdr.number("i") + cdr.number("I")
    frame_id = cdr.text()
    height, width = cdr.number("I"), cdr.number("I")
    fields = {}
    for _ in range(cdr.number("I")):
        name = cdr.text()
        offset, kind = cdr.number("I"), FORMATS[cdr.number("B")]
        assert cdr.number("I") == 1
        fields[name] = (offset, kind)
    assert cdr.number("B") == 0  # little-endian
    step, row_step = cdr.number("I"), cdr.number("I")
    points = cdr.bytes()
    assert cdr.number("B") == 1
    rest = cdr.data[cdr.at:]
    assert len(rest) < 4, rest  # DDS sends multiples of four bytes
    assert (height, row_step, len(points)) == (1, width * step, width * step)
    return Cloud(stamp_ns, frame_id, fields, step, points)


def columns(cloud, names):
    """Tuples of some fields of a cloud's points."""
    columns_ = []
    for name in names:
        offset, kind = cloud.fields[name]
        size = struct.calcsize(kind)
        columns_.append([value for value, in struct.iter_unpack(f"<{kind}", b"".join(
            cloud.data[i + offset:i + offset + size] for i in range(0, len(cloud.data), cloud.step)))])
    return list(zip(*columns_))


class Follower(threading.Thread):
    """Gathers the clouds of a server until that ends, or it has some."""

    def __init__(self, url, most=None, keep=True):
        super().__init__(daemon=True)
        self.viewer, self.most, self.keep = Viewer(*url), most, keep
        self.clouds, self.topics, self.count, self.points, self.failure = [], set(), 0, 0, None
        self.start()

    def run(self):
        try:
            for channel, time_ns, data in self.viewer.messages():
                self.topics.add(channel.topic)
                self.count += 1
                cloud = cloud_of(data)
                self.points += len(cloud.data) // cloud.step
                assert time_ns == cloud.stamp_ns, (time_ns, cloud.stamp_ns)
                if self.keep:
                    self.clouds.append(cloud)
                if self.most and self.count >= self.most:
                    break
        except (AssertionError, OSError, ValueError, KeyError, struct.error) as error:
            self.failure = repr(error)
        self.viewer.close()
