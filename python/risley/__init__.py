# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Risley-prism lidars: observation model, recordings, simulation, estimation, calibration, points.

Everything is in SI units (radians, metres, seconds) unless a name ends in another unit, such as
``_deg``. All computation is done by the C++ libraries of risley, with the interpreter's lock
released. Wrong arguments raise `ValueError`, files that cannot be read or written `FileError` (an
`OSError`), and data from which nothing can be estimated `EstimationError`. Ctrl-C stops what is
running.
"""
from risley._jobs import (calibrate, campaign, cloud, compare, coverage, estimate, identify,
                          info, observability, pattern, plan, simulate)
from risley._optics import (Directions, Inverse, Linearisation, Rays, invert, linearise, observe,
                            rays)
from risley._recordings import from_arrays, read, read_chunks, write
from risley._results import (Calibration, Cloud, Estimate, FlightCalibration, Identification,
                             Pattern, Plan, Simulation, Solution, Verdict)
from risley._risley import (Cancelled, ChunkReader, Device, EstimationError, FileError,
                            MissingFileError, PrismTrain, Recording, RecordingHeader, Sensor,
                            __version__)
from risley._sensors import load_sensor, presets

__all__ = [
    "Calibration", "Cancelled", "ChunkReader", "Cloud", "Device", "Directions", "Estimate",
    "EstimationError", "FileError", "FlightCalibration", "Identification", "Inverse",
    "Linearisation", "MissingFileError", "Pattern", "Plan", "PrismTrain", "Rays", "Recording",
    "RecordingHeader", "Sensor", "Simulation", "Solution", "Verdict", "__version__", "calibrate",
    "campaign", "cloud", "compare", "coverage", "estimate", "from_arrays", "identify", "info", "invert",
    "linearise", "load_sensor", "observability", "observe", "pattern", "plan", "presets", "rays", "read",
    "read_chunks", "simulate", "write",
]
