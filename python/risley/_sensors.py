# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Sensors by name and from files."""
import os
from typing import List

from risley import _risley
from risley._units import Path


def presets() -> List[str]:
    """Names of the built-in sensors.

    Returns
    -------
    list of str
        Sorted; `load_sensor` accepts each of them.
    """
    return _risley.preset_names()


def load_sensor(name_or_path: Path) -> _risley.Sensor:
    """Load a built-in sensor by name, or a sensor from a preset or calibration file.

    Parameters
    ----------
    name_or_path : str or path
        A name from `presets`, a file, or a folder that `estimate` or `calibrate` wrote.

    Returns
    -------
    Sensor

    Raises
    ------
    ValueError
        For an unknown name; the message lists the known ones.
    FileError
        For a file that does not follow the schema; the message names the line.
    """
    return _risley.load_sensor(os.fspath(name_or_path))
