# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Recordings of files and of arrays."""
import os
from typing import Any, Optional

from risley import _risley
from risley._progress import Progress, telling
from risley._units import Path, YawPitchRoll, pose

_UNKNOWN_TYPE = 255


def read(path: Path, *, shot_rate: Optional[float] = None, extrinsics: YawPitchRoll = None,
         extrinsics_deg: YawPitchRoll = None, progress: Progress = None) -> _risley.Recording:
    """Read a whole recording of any known format into memory.

    Parameters
    ----------
    path : str or path
        A file, or a folder of ROS 2.
    shot_rate : float, optional
        Shots per second, Hz. Times are then counted, whatever times the file holds.
    extrinsics, extrinsics_deg : (float, float, float), optional
        Yaw, pitch and roll of the sensor in the frame that the recording stands in, rad or deg.
        Rows are turned back into the sensor's frame.
    progress : bool or callable, optional
        Called with the name of the stage and the fraction done; True shows bars of tqdm where it
        is installed. An exception in it stops reading and is raised here.

    Returns
    -------
    Recording
        Its columns are read-only arrays without a copy.

    Raises
    ------
    FileError
        When the file is missing (also a `FileNotFoundError`), damaged or of no known format.
    ValueError
        For options that make no sense.
    """
    with telling(progress) as tell:
        return _risley.read(os.fspath(path), shot_rate, pose(extrinsics, extrinsics_deg), tell)


def read_chunks(path: Path, rows: int = 65536, *, shot_rate: Optional[float] = None,
                extrinsics: YawPitchRoll = None,
                extrinsics_deg: YawPitchRoll = None) -> _risley.ChunkReader:
    """Read a recording piece by piece, so that memory does not grow with its length.

    Parameters
    ----------
    path, shot_rate, extrinsics, extrinsics_deg
        As `read` has them.
    rows : int, default 65536
        About how many rows a piece has; packets stay whole.

    Returns
    -------
    ChunkReader
        An iterator over `Recording` objects, and a context manager that closes the file.

    Raises
    ------
    FileError, ValueError
        As `read`; at damage in the body after every sound row before it was given.
    """
    return _risley.ChunkReader(os.fspath(path), rows, shot_rate, pose(extrinsics, extrinsics_deg))


def from_arrays(*, azimuth: Any, zenith: Any, time_ns: Any = None, range: Any = None,
                serial: str = "", device_type: int = _UNKNOWN_TYPE,
                **columns: Any) -> _risley.Recording:
    """Make a recording of columns that come from anywhere.

    Parameters
    ----------
    azimuth, zenith : array_like of float, shape (rows,)
        Directions, rad; azimuth from X towards Y, zenith from Z.
    time_ns : array_like of int, shape (rows,), optional
        Times of the shots, ns. Without them rows are shots in firing order.
    range : array_like of float, shape (rows,), optional
        Ranges, m; 0 or less where the shot had no return.
    serial : str, optional
        Serial number of the sensor.
    device_type : int, default 255
        Livox number of its type; 255 when it is not known.
    **columns : array_like, shape (rows,) or ()
        Further columns of `Recording`: ``intensity``, ``return_number``, ``tag``, ``beam``,
        ``valid``, ``azimuth_resolution``, ``zenith_resolution``, ``range_resolution``. Rows are
        valid where directions are finite and there is no range of 0 or less, unless ``valid`` says
        otherwise.

    Returns
    -------
    Recording
        With copies of the columns.

    Raises
    ------
    ValueError
        Naming a column of another length, or a row whose angle is out of range, as degrees are.
    TypeError
        For columns that hold no numbers, and for unknown columns.
    """
    return _risley.recording_from_arrays(time_ns, azimuth, zenith, range, columns, serial,
                                         device_type)


def write(recording: _risley.Recording, path: Path, *, format: str = "") -> None:
    """Write a recording.

    Parameters
    ----------
    recording : Recording
        What is written.
    path : str or path
        The file; its ending chooses the format unless one is named.
    format : str, optional
        Name of a format.

    Raises
    ------
    FileError
        When the file cannot be written.
    ValueError
        For an unknown format, or a value that it cannot hold.
    """
    _risley.write_recording(recording, os.fspath(path), format)
