# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Risley-prism lidars: observation model, recordings, simulation, estimation, calibration, points.

Everything is in SI units (radians, metres, seconds) unless a name ends in another unit, such as
``_deg``. All computation is done by the C++ libraries of risley, with the interpreter's lock
released. Wrong arguments raise `ValueError`, files that cannot be read or written `FileError` and
a network without sensors `NetworkError` (both an `OSError`), and data from which nothing can be
estimated `EstimationError`. Ctrl-C stops what is running.
"""
from risley._jobs import (calibrate, campaign, cloud, compare, coverage, estimate, identify,
                          info, observability, pattern, plan, simulate)
from risley._many import (ManyResults, calibrate_many, cloud_many, convert_many, estimate_many,
                          info_many)
from risley._network import emulate, find_sensors, record
from risley._optics import (Directions, Inverse, Linearisation, Rays, invert, linearise, observe,
                            rays)
from risley._points import Points, point_chunks, points
from risley._recordings import from_arrays, read, read_chunks, write
from risley._results import (Answer, Calibration, Cloud, CloudOfStations, Estimate, FlightCalibration,
                             Identification, Pattern, Plan, RotationAngles, Scan, Simulation,
                             Solution, Verdict, Warning)
from risley._risley import (Cancelled, ChunkReader, Device, EstimationError, FileError,
                            MissingFileError, Mount, NetworkError, PrismTrain, Recording,
                            RecordingHeader, Sensor, Stop, Trajectory, __version__)
from risley._sensors import load_mount, load_sensor, load_trajectory, presets

__all__ = [
    "Answer", "Calibration", "Cancelled", "ChunkReader", "Cloud", "CloudOfStations", "Device", "Directions",
    "Estimate", "EstimationError", "FileError", "FlightCalibration", "Identification", "Inverse",
    "Linearisation", "ManyResults", "MissingFileError", "Mount", "NetworkError", "Pattern", "Plan",
    "Points", "PrismTrain", "Rays", "Recording", "RecordingHeader", "RotationAngles", "Scan",
    "Sensor", "Simulation", "Solution", "Stop", "Trajectory", "Verdict", "Warning", "__version__",
    "calibrate", "calibrate_many", "campaign", "cloud", "cloud_many", "compare", "convert_many",
    "coverage", "emulate", "estimate", "estimate_many", "find_sensors", "from_arrays", "identify",
    "info", "info_many", "invert", "linearise", "load_mount", "load_sensor", "load_trajectory",
    "observability", "observe", "pattern", "plan", "point_chunks", "points", "presets", "rays",
    "read", "read_chunks", "record", "simulate", "write",
]
