# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Sensors by name, and sensors, mounts and trajectories from files."""
import os
from typing import List

from risley import _risley
from risley._progress import Progress, reporting
from risley._units import Path, suggesting


@suggesting
def presets() -> List[str]:
    """Names of the built-in sensors.

    Returns
    -------
    list of str
        Sorted; `load_sensor` accepts each of them.
    """
    return _risley.preset_names()


@suggesting
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


@suggesting
def load_mount(path: Path) -> _risley.Mount:
    """Load the mounting of a sensor on a moving platform.

    Parameters
    ----------
    path : str or path
        A file (YAML).

    Returns
    -------
    Mount

    Raises
    ------
    FileError
        For a missing or invalid file; the message names the line.
    """
    return _risley.load_mount(os.fspath(path))


@suggesting
def load_trajectory(path: Path, *, topic: str = "",
                    progress: Progress = None) -> _risley.Trajectory:
    """Load the poses of a moving platform.

    Parameters
    ----------
    path : str or path
        A file of any known format, or a folder of ROS 2.
    topic : str, optional
        Topic of the poses, if a ROS bag has several.
    progress : bool or callable, optional
        As in `risley.read`.

    Returns
    -------
    Trajectory

    Raises
    ------
    FileError, ValueError
        For a missing, damaged or invalid file, and for a topic without poses.
    """
    with reporting(progress) as on_progress:
        return _risley.load_trajectory(os.fspath(path), topic, on_progress)
