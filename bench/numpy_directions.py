#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Azimuth and zenith of many shots: the Python package and numpy in turn, in one process and on one core each.

The peer is numpy as an expert writes it: one array per component, blocks that stay in a cache (the fastest
of several sizes is taken), every operation into an array that is there already, and all constants of the sensor
prepared beforehand. Both write to arrays that exist. Prints one JSON object.

Usage: PYTHONPATH=build/release/python bench/numpy_directions.py [REPETITIONS]
"""
import json
import os
import sys
import time

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[name] = "1"

import numpy as np  # noqa: E402, after the number of threads

import risley  # noqa: E402

SHOTS = 1 << 18
BLOCKS = [1 << power for power in range(11, 18)]  # shots, of which the fastest is taken


def leaning(horizontal, vertical):
    return np.array([np.cos(horizontal) * np.cos(vertical), -np.sin(horizontal) * np.cos(vertical), np.sin(vertical)])


class Numpy:
    """The practical model of two prisms, PA-AP, in blocks of arrays.

    A normal n that turns by an angle about an axis k is (n.k) k + cos (n - (n.k) k) + sin (k x n), three constant
    vectors. The faces of a prism turn together: one sine and cosine each.
    """

    def __init__(self, sensor, block):
        self.size = block
        p = sensor.parameters
        bearing = leaning(p["bearing_tilt_a_horizontal"], p["bearing_tilt_a_vertical"])
        a_horizontal = p["bearing_tilt_a_horizontal"] + p["prism_tilt_a_horizontal"]
        a_vertical = p["bearing_tilt_a_vertical"] + p["prism_tilt_a_vertical"]
        b_horizontal, b_vertical = p["prism_tilt_b_horizontal"], p["prism_tilt_b_vertical"]
        wedge_a, wedge_b = p["wedge_angle_a"], p["wedge_angle_b"]
        air, glass_a, glass_b = p["refractive_index_air"], p["refractive_index_a"], p["refractive_index_b"]
        self.incident = leaning(p["incident_beam_horizontal"], p["incident_beam_vertical"])
        axes = (bearing, np.array([1.0, 0.0, 0.0]))
        normals = ((leaning(a_horizontal, a_vertical), leaning(a_horizontal, a_vertical + wedge_a)),
                   (leaning(b_horizontal, b_vertical - wedge_b), leaning(b_horizontal, b_vertical)))
        ratios = ((air / glass_a, glass_a / air), (air / glass_b, glass_b / air))
        self.prisms = []
        for axis, pair, ratio in zip(axes, normals, ratios):
            self.prisms.append([(np.dot(n, axis) * axis, n - np.dot(n, axis) * axis, np.cross(axis, n), m)
                                for n, m in zip(pair, ratio)])
        self.work = [np.empty(block) for _ in range(10)]

    def observe(self, angles, azimuth, zenith):
        for begin in range(0, len(azimuth), self.size):
            end = min(begin + self.size, len(azimuth))
            self.block([column[begin:end] for column in angles], azimuth[begin:end], zenith[begin:end])

    def block(self, angles, azimuth, zenith):
        sine, cosine, product, root, *columns = (column[:len(azimuth)] for column in self.work)
        normal, beam = columns[:3], columns[3:]
        for component, value in zip(beam, self.incident):
            component.fill(value)
        for faces, angle in zip(self.prisms, angles):
            np.sin(angle, out=sine)
            np.cos(angle, out=cosine)
            for along, across, turned, ratio in faces:
                for i, component in enumerate(normal):
                    if across[i] == 0 and turned[i] == 0:
                        component.fill(along[i])
                        continue
                    np.multiply(cosine, across[i], out=component)
                    np.multiply(sine, turned[i], out=product)
                    np.add(component, product, out=component)
                    if along[i] != 0:
                        np.add(component, along[i], out=component)
                # m L + (sqrt(1 - m^2 + (m c)^2) - m c) N with c = N.L
                np.multiply(normal[0], beam[0], out=root)
                for i in (1, 2):
                    np.multiply(normal[i], beam[i], out=product)
                    np.add(root, product, out=root)
                np.multiply(root, ratio, out=root)
                np.multiply(root, root, out=product)
                np.add(product, 1.0 - ratio * ratio, out=product)
                np.sqrt(product, out=product)
                np.subtract(product, root, out=root)
                for component, n in zip(beam, normal):
                    np.multiply(component, ratio, out=component)
                    np.multiply(n, root, out=n)
                    np.add(component, n, out=component)
        np.arctan2(beam[1], beam[0], out=azimuth)
        np.arccos(beam[2], out=zenith)


def quartiles(values):
    return [float(value) for value in np.percentile(values, [25, 50, 75])]


def main(repetitions=31):
    sensor = risley.load_sensor("mid-40-table3")
    angles = np.random.default_rng(1).uniform(0, 2 * np.pi, (2, SHOTS))
    ours, theirs = (tuple(np.empty((2, SHOTS))) for _ in range(2))

    def seconds(run):
        begin = time.thread_time()
        run()
        return time.thread_time() - begin

    def fastest(block):
        candidate = Numpy(sensor, block)
        return min(seconds(lambda: candidate.observe(angles, *theirs)) for _ in range(4))

    peer = Numpy(sensor, min(BLOCKS, key=fastest))
    times = []
    for _ in range(int(repetitions)):
        their_time = seconds(lambda: peer.observe(angles, *theirs))
        times.append((seconds(lambda: risley.observe(sensor, angles, out=ours)), their_time))
    mine, other = np.array(times[1:]).T
    low, middle, high = quartiles(other / mine)
    print(json.dumps({"peer_over_ours": middle, "ratio_q1": low, "ratio_q3": high,
                      "ours_ns": 1e9 * np.median(mine) / SHOTS, "peer_ns": 1e9 * np.median(other) / SHOTS,
                      "difference_rad": float(np.max(np.abs(np.array(ours) - np.array(theirs)))),
                      "block": peer.size, "numpy": np.__version__}))


if __name__ == "__main__":
    main(*sys.argv[1:])
