# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""A first-generation sensor and a host, each written from the protocol and not from risley."""
import random
import select
import socket
import struct
import threading
import time
import zlib

SENSOR_PORT, BROADCAST_PORT = 65000, 55000
# data type: records, bytes of each, ns between packets at 100 kHz and at 240 kHz
TYPES = {0: (100, 13, 1_000_000, None), 1: (100, 9, 1_000_000, None), 2: (96, 14, 960_000, 400_000),
         3: (96, 10, 960_000, 400_000), 4: (48, 28, 480_000, 200_000), 5: (48, 16, 480_000, 200_000),
         6: (1, 24, 5_000_000, 5_000_000), 7: (30, 42, None, 125_000), 8: (30, 22, None, 125_000)}
MID_40, TELE_15, HORIZON, MID_70, AVIA = 1, 2, 3, 6, 7


def crc16(data):
    rest = 0x4C49
    for byte in data:
        rest ^= byte
        for _ in range(8):
            rest = rest >> 1 ^ (0x8408 if rest & 1 else 0)
    return rest


def frame(kind, sequence, command_set, command, data=b""):
    head = struct.pack("<BBHBH", 0xAA, 1, 15 + len(data), kind, sequence)
    body = head + struct.pack("<HBB", crc16(head), command_set, command) + data
    return body + struct.pack("<I", zlib.crc32(body, 0x564F580A))


def parse(data):
    """(kind, sequence, set, command, data), or None for what is no frame."""
    if len(data) < 15 or data[0] != 0xAA or data[1] != 1:
        return None
    length, kind, sequence, check = struct.unpack_from("<HBHH", data, 2)
    if length != len(data) or check != crc16(data[:7]):
        return None
    if struct.unpack("<I", data[-4:])[0] != zlib.crc32(data[:-4], 0x564F580A):
        return None
    return kind, sequence, data[9], data[10], data[11:-4]


def bound(address, port, reuse=False):
    one = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    one.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
    if reuse:
        one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    one.bind((address, port))
    return one


def send_with_room(sender, data, to):
    """Sends once the receiver has room, so that nothing is lost on a machine that stands still for a while."""
    most_bytes, name = 250_000, f"{int.from_bytes(socket.inet_aton(to[0]), 'little'):08X}:{to[1]:04X}"
    end = time.monotonic() + 20
    while time.monotonic() < end:
        with open("/proc/net/udp", encoding="ascii") as table:
            waiting = [int(row[4].split(":")[1], 16) for row in map(str.split, table) if row[1] == name]
        if sum(waiting) < most_bytes:
            break
        time.sleep(0.001)
    sender.sendto(data, to)


def packet(data_type, time_ns, number, timestamp_type=0, status=0):
    """Its points contain the packet's number: depths, or X, of number * 1000 + record mm."""
    records, size, _, _ = TYPES[data_type]
    body = bytearray(struct.pack("<BBBBIBBQ", 5, 1, 1, 0, status, timestamp_type, data_type, time_ns))
    for record in range(records):
        depth = number % 1000 * 1000 + record + 1
        if data_type in (0, 2):
            point = struct.pack("<iii", depth, 0, 0) + bytes(size - 12)
        elif data_type in (1, 3):
            point = struct.pack("<IHH", depth, 9000, 0) + bytes(size - 8)
        elif data_type in (5, 8):
            point = struct.pack("<HHI", 9000, 0, depth) + bytes(size - 8)
        elif data_type == 6:
            point = struct.pack("<6f", 0, 0, 0, 0, 0, 1)
        else:
            point = struct.pack("<iii", depth, 0, 0) + bytes(size - 12)
        body += point
    return bytes(body)


class Sensor(threading.Thread):
    """A sensor on an address. Attributes say what it does to its packets, and what it did."""

    def __init__(self, address="127.0.0.11", code="3GGDPEERX000011", device_type=MID_40, **faults):
        super().__init__(daemon=True)
        self.address, self.code, self.device_type = address, code, device_type
        self.period = None  # s of real time per packet, instead of the sensor's own
        self.loss = self.duplication = self.disorder = 0.0
        self.farthest = 10  # packets that one may be overtaken by
        self.spherical, self.mode, self.imu = 0, 0, 0
        self.first_ns = 5_000_000_000
        self.timestamp_type = self.status = 0
        for name, value in faults.items():
            assert hasattr(self, name), name
            setattr(self, name, value)
        self.random = random.Random(code)
        self.socket = bound(address, SENSOR_PORT)
        self.host = None
        self.sampling = self.deaf = self.paused = False
        self.sent, self.lost, self.times = 0, 0, []
        self.heard = []  # set and id of commands
        self.running = True
        self.start()

    def stop(self):
        self.running = False
        self.join()
        self.socket.close()

    def data_type(self):
        if self.device_type == MID_40:
            return 1 if self.spherical else 0
        return {0: 2, 1: 2, 2: 4, 3: 7}[self.mode] + (1 if self.spherical else 0)

    def run(self):
        broadcast_due = heartbeat = 0
        number, queue, began = 0, [], 0.0
        while self.running:
            now = time.monotonic()
            if self.host is None and now >= broadcast_due and not self.deaf:
                code = self.code.encode().ljust(16, b"\0")
                self.socket.sendto(frame(2, 0, 0, 0, code + struct.pack("<BH", self.device_type, 0)),
                                   ("255.255.255.255", BROADCAST_PORT))
                broadcast_due = now + 1
            if self.host and now - heartbeat > 5:
                self.host, self.sampling = None, False
            ready = select.select([self.socket], [], [], 0.0005 if self.sampling else 0.01)[0]
            if ready:
                data, sender = self.socket.recvfrom(2048)
                heard = None if self.deaf else parse(data)
                was = self.sampling
                if heard and self.obey(heard, sender):
                    heartbeat = now
                if self.sampling and not was:
                    number, queue, began = 0, [], time.monotonic()
                if was and not self.sampling:
                    self.finish(queue)
            if self.sampling and not self.paused:
                self.send_due(number, queue, began)
                number = self.number

    def obey(self, heard, sender):
        kind, sequence, command_set, command, data = heard
        if kind == 2:
            return False
        if (command_set, command) == (0, 1) and len(data) in (8, 10):
            host = socket.inet_ntoa(data[:4])
            ports = struct.unpack(f"<{(len(data) - 4) // 2}H", data[4:])
            if host != sender[0] or self.host and self.host[0] != host:
                return False
            self.host = (host, ports[0], ports[1])
            self.sampling = False
            answer = b"\0"
        elif self.host is None or sender[0] != self.host[0]:
            return False
        elif (command_set, command) == (0, 2):
            answer = bytes((0, 3, 8, 0, 0))
        elif (command_set, command) == (0, 3):
            answer = struct.pack("<BBBI", 0, 1, 0, 0)
        elif (command_set, command) == (0, 4):
            self.sampling, answer = data == b"\1", b"\0"
        elif (command_set, command) == (0, 5):
            self.spherical, answer = data[0], b"\0"
        elif (command_set, command) == (0, 6):
            answer = b"\0"
        elif (command_set, command) == (1, 6):
            self.mode, answer = data[0], b"\0"
        elif (command_set, command) == (1, 8):
            self.imu, answer = data[0], b"\0"
        else:
            answer = b"\1"
        self.heard.append((command_set, command))
        self.socket.sendto(frame(1, sequence, command_set, command, answer), (self.host[0], self.host[2]))
        if (command_set, command) == (0, 6):
            self.host, self.sampling = None, False
        return True

    number = 0

    def send_due(self, number, queue, began):
        _, _, slow, fast = TYPES[self.data_type()]
        step = slow if self.device_type in (MID_40, MID_70) else fast
        period = self.period or step * 1e-9
        due = min(int((time.monotonic() - began) / period), number + 50)  # it answers commands between
        while number < due:
            one = packet(self.data_type(), self.first_ns + number * step, number, self.timestamp_type, self.status)
            if number > 0 and self.random.random() < self.loss:
                self.lost += 1
            else:
                def place():
                    late = self.random.random() < self.disorder
                    return number + (self.random.randint(1, self.farthest) if late else 0)
                queue.append((place(), number, one))
                if self.random.random() < self.duplication:
                    queue.append((place(), number, one))
                self.times.append(self.first_ns + number * step)
            number += 1
            queue.sort(key=lambda entry: entry[0])
            while queue and queue[0][0] < number:
                self.send(queue.pop(0)[2])
        self.number = number

    def finish(self, queue):
        """What waits goes out; the last packet is not lost, so that all losses can be seen."""
        for entry in queue:
            self.send(entry[2])
        _, _, slow, fast = TYPES[self.data_type()]
        step = slow if self.device_type in (MID_40, MID_70) else fast
        self.times.append(self.first_ns + self.number * step)
        self.send(packet(self.data_type(), self.times[-1], self.number, self.timestamp_type, self.status))

    def send(self, data):
        send_with_room(self.socket, data, (self.host[0], self.host[1]))
        self.sent += 1


class Host:
    """A host that shakes hands with one sensor and keeps what it sends."""

    def __init__(self, address="127.0.0.31"):
        self.address = address
        self.commands, self.data = bound(address, 0), bound(address, 0)
        self.data.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        self.broadcasts = bound("255.255.255.255", BROADCAST_PORT, reuse=True)
        self.sensor = None
        self.sequence = 0

    def close(self):
        for one in (self.commands, self.data, self.broadcasts):
            one.close()

    def find(self, code, seconds=5):
        """Waits for the broadcast of a sensor; its type and the whole frame."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.broadcasts.settimeout(max(0.01, end - time.monotonic()))
            try:
                data, sender = self.broadcasts.recvfrom(2048)
            except TimeoutError:
                break
            heard = parse(data)
            if heard and heard[2:4] == (0, 0) and heard[4][:16].rstrip(b"\0").decode() == code:
                assert sender[1] == SENSOR_PORT and heard[0] in (0, 2)
                self.sensor = sender
                return heard[4][16], data
        raise AssertionError(f"{code} was not heard")

    def ask(self, command_set, command, data=b"", kind=0, seconds=1):
        """What the sensor answers to a command."""
        self.sequence += 1
        self.commands.sendto(frame(kind, self.sequence, command_set, command, data), self.sensor)
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.commands.settimeout(max(0.01, end - time.monotonic()))
            try:
                reply, sender = self.commands.recvfrom(2048)
            except TimeoutError:
                break
            heard = parse(reply)
            if heard and heard[:4] == (1, self.sequence, command_set, command) and sender == self.sensor:
                return heard[4]
        return None

    def shake_hands(self, kind=0, with_imu_port=True):
        ports = [self.data.getsockname()[1], self.commands.getsockname()[1]]
        if with_imu_port:
            ports.append(ports[0])
        return self.ask(0, 1, socket.inet_aton(self.address) + struct.pack(f"<{len(ports)}H", *ports), kind)

    def receive_packets(self, count):
        """So many packets or more, for which a busy machine may take up to a minute."""
        packets, end = [], time.monotonic() + 60
        while len(packets) < count and time.monotonic() < end:
            packets += self.receive(0.1)
        return packets

    def receive(self, seconds):
        """Packets of a time, and those that follow without a pause, for a little while."""
        packets, end = [], time.monotonic() + seconds
        heartbeat = 0
        while True:
            now = time.monotonic()
            if now < end and now - heartbeat > 0.8:
                assert self.ask(0, 3) is not None
                heartbeat = now
            self.data.settimeout(max(0.05, min(0.5, end - now)))
            try:
                packets.append(self.data.recvfrom(2048)[0])
            except TimeoutError:
                if time.monotonic() >= end:
                    return packets
            else:
                if time.monotonic() > end + 0.2:
                    return packets
