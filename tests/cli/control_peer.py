# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""A second-generation sensor and a host as the maker's SDK is one, each written from the protocol and not from risley."""
import select
import socket
import struct
import threading
import time
import zlib

from livox_peer import bound, send_with_room

SEARCH, SET, GET, PUSH = 0x0000, 0x0100, 0x0101, 0x0102
SEARCH_PORT = 56000
# Of commands, pushes, points and inertial samples.
PORTS = {9: (56100, 56200, 56300, 56400), 10: (56000, 56000, 57000, 58000)}
ALL_KEYS = (0x0000, 0x0001, 0x0004, 0x0005, 0x0006, 0x0007, 0x0012, *range(0x0015, 0x001B), 0x001C, *range(0x8000, 0x800D),
            0x800E, 0x8010, 0x8011)


def crc16(data):
    rest = 0xFFFF
    for byte in data:
        rest ^= byte << 8
        for _ in range(8):
            rest = (rest << 1 ^ 0x1021 if rest & 0x8000 else rest << 1) & 0xFFFF
    return rest


def control(command, data=b"", reply=0, sender=1, sequence=1):
    head = struct.pack("<BBHIHBB6x", 0xAA, 0, 24 + len(data), sequence, command, reply, sender)
    return head + struct.pack("<HI", crc16(head), zlib.crc32(data)) + data


def parse(data):
    """(command, reply, sequence, data), or None for what is no frame."""
    if len(data) < 24 or data[:2] != b"\xAA\0":
        return None
    length, sequence, command, reply = struct.unpack_from("<HIHB", data, 2)
    check, of_data = struct.unpack_from("<HI", data, 18)
    if length > len(data) or check != crc16(data[:18]) or of_data != zlib.crc32(data[24:length]):
        return None
    return command, reply, sequence, data[24:length]


def entries(*pairs):
    return b"".join(struct.pack("<HH", key, len(value)) + value for key, value in pairs)


def listed(data, count):
    values = {}
    for _ in range(count):
        key, length = struct.unpack_from("<HH", data)
        values[key] = data[4:4 + length]
        data = data[4 + length:]
    assert not data
    return values


def packet(time_ns, number, points, kind=1, interval=4750, time_type=0):
    """As the sensor sends it."""
    records = 1 if kind == 0 else len(points) // {1: 14, 2: 8, 3: 10}[kind]
    body = struct.pack("<Q", time_ns) + points
    return struct.pack("<BHHHHBBBB11xI", 0, 36 + len(points), interval if kind else 0, records, number, 0, kind,
                       time_type, 0, zlib.crc32(body)) + body


class Sensor(threading.Thread):
    """A sensor on an address. Attributes say how it is, and what it did."""

    def __init__(self, address, serial, device_type=10, interval=2102, period_ns=212_389, first_number=65_000):
        super().__init__(daemon=True)
        self.address, self.serial, self.device_type = address, serial, device_type
        self.interval, self.period_ns = interval, period_ns
        self.first_number = first_number
        command, push, points, imu = PORTS[device_type]
        self.sockets = {port: bound(address, port) for port in {SEARCH_PORT, command, push, points, imu}}
        self.public = bound("255.255.255.255", SEARCH_PORT, reuse=True)
        self.values = {0x0000: b"\2", 0x0006: bytes(8), 0x0007: bytes(8), 0x001A: b"\2", 0x001C: b"\0",
                       0x8002: bytes((1, 2, 3, 4)), 0x8006: b"\2", 0x800E: b"\0\0", 0x8010: b"\1"}
        if device_type == 9:
            self.values.update({0x0005: bytes(8), 0x8007: struct.pack("<i", 4000), 0x800C: b"\1", 0x8011: bytes(32)})
        self.sent = []  # times
        self.heard = []
        self.running = True
        self.start()

    def stop(self):
        self.running = False
        self.join()
        for one in (*self.sockets.values(), self.public):
            one.close()

    def run(self):
        waiting = [*self.sockets.values(), self.public]
        number, base, began = 0, 0, None
        while self.running:
            for one in select.select(waiting, [], [], 0.001)[0]:
                data, sender = one.recvfrom(2048)
                heard = parse(data)
                if heard and not heard[1]:
                    port = SEARCH_PORT if one is self.public else one.getsockname()[1]
                    self.sockets[port].sendto(control(heard[0], self.answer(heard), 1, 1, heard[2]), sender)
            if self.values[0x8006] != b"\1":
                began = None
                continue
            if began is None:
                began, base = time.monotonic(), number
            due = base + int((time.monotonic() - began) / self.period_ns * 1e9)
            for _ in range(min(due - number, 100)):  # it answers requests between
                self.send(number)
                number += 1

    def send(self, number):
        address, port, _ = struct.unpack("<4sHH", self.values[0x0006])
        time_ns = 10**9 + self.period_ns * number
        points = b"".join(struct.pack("<iiiBB", 3000 + record, number % 1000, 5, 9, 0) for record in range(96))
        self.sent.append(time_ns)
        send_with_room(self.sockets[PORTS[self.device_type][2]],
                       packet(time_ns, (self.first_number + number) % 65536, points, 1, self.interval),
                       (socket.inet_ntoa(address), port))

    def answer(self, heard):
        command, _, _, data = heard
        if command == SEARCH:
            return struct.pack("<BB16s4sH", 0, self.device_type, self.serial.encode(), socket.inet_aton(self.address),
                               PORTS[self.device_type][0])
        if command == GET:
            keys = struct.unpack_from(f"<{(len(data) - 4) // 2}H", data, 4)
            if any(key not in self.values for key in keys):
                return b"\x20\0\0"
            return b"\0" + struct.pack("<H", len(keys)) + entries(*((key, self.values[key]) for key in keys))
        if command == SET:
            wanted = listed(data[4:], struct.unpack_from("<H", data)[0])
            for key, value in wanted.items():
                if key not in self.values or len(value) != len(self.values[key]):
                    return b"\x20" + struct.pack("<H", key)
            self.heard.append(wanted)
            self.values.update(wanted)
            self.values[0x8006] = self.values[0x001A]
            return b"\0\0\0"
        return b"\x20"


class Host:
    """What the maker's SDK does on the network, at its ports."""

    def __init__(self, address="127.0.0.31"):
        self.address = address
        self.search = bound(address, SEARCH_PORT)
        self.everybody = bound("255.255.255.255", SEARCH_PORT, reuse=True)
        self.commands, self.pushes = bound(address, 56101), bound(address, 56201)
        self.points, self.imu = bound(address, 56301), bound(address, 56401)
        self.points.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        self.sequence, self.sensor = 1, None

    def close(self):
        for one in (self.search, self.everybody, self.commands, self.pushes, self.points, self.imu):
            one.close()

    def find(self, serial, seconds=10):
        """Device type, address and command port of a sensor, of an answer to this host and of one to everybody."""
        heard, end, due = {}, time.monotonic() + seconds, 0
        while time.monotonic() < end and len(heard) < 2:
            if time.monotonic() > due:
                self.search.sendto(control(SEARCH, b"", 0, 0, self.sequence), ("255.255.255.255", SEARCH_PORT))
                due = time.monotonic() + 1
            for one in select.select([self.search, self.everybody], [], [], 0.2)[0]:
                data, sender = one.recvfrom(2048)
                found = parse(data)
                if not found or found[0] != SEARCH or not found[1] or sender[1] != SEARCH_PORT:
                    continue
                code, kind, name, address, port = struct.unpack("<BB16s4sH", found[3])
                if name.rstrip(b"\0").decode() == serial:
                    assert code == 0 and socket.inet_ntoa(address) == sender[0]
                    heard[one is self.search] = (kind, sender[0], port)
        assert len(heard) == 2, f"{serial} was not heard"
        self.sensor = (heard[True][1], heard[True][2])
        return heard[True]

    def ask(self, command, data, seconds=1.0):
        """What the sensor answers, which it must not do at once."""
        self.sequence += 1
        began = time.monotonic()
        self.commands.sendto(control(command, data, 0, 0, self.sequence), self.sensor)
        self.commands.settimeout(seconds)
        reply, sender = self.commands.recvfrom(2048)
        assert time.monotonic() - began > 0.001
        assert sender == self.sensor, sender
        found = parse(reply)
        assert found and found[:3] == (command, 1, self.sequence), found
        return found[3]

    def set(self, *pairs):
        return self.ask(SET, struct.pack("<HH", len(pairs), 0) + entries(*pairs))

    def get(self, *keys):
        reply = self.ask(GET, struct.pack(f"<HH{len(keys)}H", len(keys), 0, *keys))
        assert reply[0] == 0, reply
        return listed(reply[3:], struct.unpack_from("<H", reply, 1)[0])

    def tell_where(self):
        def target(own, theirs):
            return socket.inet_aton(self.address) + struct.pack("<HH", own, theirs)
        return self.set((0x0005, target(56201, 56200)), (0x0006, target(56301, 56300)), (0x0007, target(56401, 56400)))

    @staticmethod
    def receive(one, count, port, seconds=30):
        """So many datagrams of a socket, all from this port."""
        one.settimeout(seconds)
        received = []
        while len(received) < count:
            data, sender = one.recvfrom(2048)
            assert sender[1] == port, sender
            received.append(data)
        return received
