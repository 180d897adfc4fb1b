# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Scans that the tests beside this file make of the observation model."""
import numpy as np

import risley


def scan(seconds=1.0, rate=20000.0, noise=1e-4):
    """Directions of a mid-40 as its rotors turn, with noise, as a recording."""
    sensor = risley.load_sensor("mid-40")
    time = np.arange(int(seconds * rate)) / rate
    angles = [0.3 + sensor.angular_velocity[0] * time, 1.7 + sensor.angular_velocity[1] * time]
    azimuth, zenith = risley.observe(sensor, angles)
    random = np.random.default_rng(5)
    return risley.from_arrays(time_ns=np.round(1e9 * time).astype(np.int64),
                              azimuth=azimuth + noise * random.standard_normal(len(time)),
                              zenith=zenith + noise * random.standard_normal(len(time)),
                              sensor="mid-40")
