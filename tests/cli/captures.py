# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Writes captures of a network, pcap and pcapng, byte by byte."""
import socket
import struct

HOST = "192.168.1.5"
ETHERNET, LOOPBACK, RAW, COOKED, LOOP, IPV4, COOKED_2 = 1, 0, 101, 113, 108, 228, 276


def udp(sender, receiver, data, protocol=17, flags=0, length=None):
    """An IPv4 packet. @param sender, receiver  (address, port)"""
    body = struct.pack(">HHHH", sender[1], receiver[1], 8 + len(data), 0) + data
    size = 20 + len(body) if length is None else length
    return struct.pack(">BBHHHBBH", 0x45, 0, size, 1, flags, 64, protocol, 0) + socket.inet_aton(
        sender[0]) + socket.inet_aton(receiver[0]) + body


def framed(link, packet, tags=0, protocol=0x0800):
    """A packet as a link of a type carries it."""
    kind = b"".join(struct.pack(">HH", 0x88A8 if i == 0 and tags > 1 else 0x8100, 7 + i) for i in range(tags))
    kind += struct.pack(">H", protocol)
    if link == ETHERNET:
        return bytes(12) + kind + packet
    if link == COOKED:
        return struct.pack(">HHH8x", 0, 1, 6) + kind + packet
    if link == COOKED_2:
        return kind[:2] + struct.pack(">HIHBB8x", 0, 1, 1, 0, 6) + kind[2:] + packet
    if link == LOOPBACK:
        return struct.pack("<I", 2) + packet
    if link == LOOP:
        return struct.pack(">I", 2) + packet
    return packet


def pcap(records, link=ETHERNET, order="<", nanoseconds=False, snap=65535):
    """@param records  (time in ns, bytes)"""
    unit = 1 if nanoseconds else 1000
    out = struct.pack(order + "IHHiIII", 0xA1B23C4D if nanoseconds else 0xA1B2C3D4, 2, 4, 0, 0, snap, link)
    for time_ns, data in records:
        kept = data[:snap]
        out += struct.pack(order + "IIII", time_ns // 10**9, time_ns % 10**9 // unit, len(kept), len(data)) + kept
    return out


def pcapng(records, link=ETHERNET, order="<", snap=65535):
    def block(kind, body):
        body += bytes(-len(body) % 4)
        size = 12 + len(body)
        return struct.pack(order + "II", kind, size) + body + struct.pack(order + "I", size)

    # The times of the interface count nanoseconds.
    resolution = struct.pack(order + "HHBxxxHH", 9, 1, 9, 0, 0)
    out = block(0x0A0D0D0A, struct.pack(order + "IHHq", 0x1A2B3C4D, 1, 0, -1))
    out += block(1, struct.pack(order + "HHI", link, 0, snap) + resolution)
    for time_ns, data in records:
        kept = data[:snap]
        out += block(6, struct.pack(order + "IIIII", 0, time_ns >> 32, time_ns & 0xFFFFFFFF, len(kept),
                                    len(data)) + kept)
    return out
