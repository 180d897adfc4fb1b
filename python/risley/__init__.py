# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Risley-prism lidars: observation model, recordings, simulation, estimation.

Everything is in SI units (radians, metres, seconds) unless a name ends in another unit, such as
``_deg``. All computation is done by the C++ libraries of risley, with the interpreter's lock released.
Wrong arguments raise `ValueError`, files that cannot be read or written `FileError` (an `OSError`),
and data from which nothing can be estimated `EstimationError`. Ctrl-C stops what is running.
"""
from risley._jobs import estimate, write_report
from risley._optics import (Directions, Inverse, Linearisation, Rays, invert, linearise, observe,
                            rays)
from risley._recordings import from_arrays, read, read_chunks, write
from risley._risley import (Cancelled, ChunkReader, Device, Estimate, EstimationError,
                            FileError, MissingFileError, PrismTrain, Recording, RecordingHeader, Sensor,
                            __version__)
from risley._sensors import load_sensor, presets

__all__ = [
    "Cancelled", "ChunkReader", "Device", "Directions", "Estimate", "EstimationError", "FileError",
    "Inverse", "Linearisation", "MissingFileError", "PrismTrain", "Rays", "Recording",
    "RecordingHeader", "Sensor", "__version__", "estimate", "from_arrays", "invert", "linearise",
    "load_sensor", "observe", "presets", "rays", "read", "read_chunks", "write", "write_report",
]
