# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Recordings from files and from arrays."""
import os
import pathlib
import tempfile
from typing import Any, Optional, Tuple, Union

from risley import _risley
from risley._progress import Progress, reporting
from risley._results import needed
from risley._units import Path, YawPitchRoll, pose, suggesting

_UNKNOWN_TYPE = 255
_COLUMNS = ("time_ns", "azimuth", "zenith", "range", "azimuth_resolution", "zenith_resolution",
            "range_resolution", "intensity", "return_number", "tag", "beam", "device", "valid")


def to_xarray(recording: _risley.Recording) -> Any:
    """All columns over ``row``."""
    return needed("xarray", "to_xarray()").Dataset(
        {name: ("row", getattr(recording, name)) for name in _COLUMNS})


def to_pandas(recording: _risley.Recording) -> Any:
    """All columns."""
    return needed("pandas", "to_pandas()").DataFrame(
        {name: getattr(recording, name) for name in _COLUMNS})


def reduced(recording: _risley.Recording) -> Tuple[Any, ...]:
    """For pickle: the lossless format holds everything known about a recording."""
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "recording.nc"
        _risley.write_recording(recording, str(file), "")
        return restored, (file.read_bytes(),)


def restored(content: bytes) -> _risley.Recording:
    """The inverse of `reduced`."""
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "recording.nc"
        file.write_bytes(content)
        return _risley.read(str(file), None, None, "", None)


@suggesting
def read(path: Path, *, shot_rate: Optional[float] = None, extrinsics: YawPitchRoll = None,
         extrinsics_deg: YawPitchRoll = None, device: str = "",
         progress: Progress = None) -> _risley.Recording:
    """Read a whole recording of any known format into memory.

    Parameters
    ----------
    path : str or path
        A file, or a ROS 2 folder.
    shot_rate : float, optional
        Shots per second, Hz. Times are then computed from it, whatever times the file holds.
    extrinsics, extrinsics_deg : (float, float, float), optional
        Yaw, pitch and roll of the sensor in the frame of the recording, rad or deg. The rows are
        transformed back into the sensor's frame.
    device : str, optional
        Serial number, topic or number (from "0") of one sensor of a recording of several.
    progress : bool or callable, optional
        Function that is called with the name of the stage and the fraction done; True shows tqdm
        bars if tqdm is installed. An exception in the function stops reading and is raised here.

    Returns
    -------
    Recording
        Its columns are read-only arrays that share its memory.

    Raises
    ------
    FileError
        If the file is missing (also a `FileNotFoundError`), damaged, or of no known format.
    ValueError
        For invalid options.
    """
    with reporting(progress) as on_progress:
        return _risley.read(os.fspath(path), shot_rate, pose(extrinsics, extrinsics_deg), device,
                            on_progress)


@suggesting
def read_chunks(path: Path, rows: int = 65536, *, shot_rate: Optional[float] = None,
                extrinsics: YawPitchRoll = None,
                extrinsics_deg: YawPitchRoll = None, device: str = "") -> _risley.ChunkReader:
    """Read a recording piece by piece, so that memory use does not grow with its length.

    Parameters
    ----------
    path, shot_rate, extrinsics, extrinsics_deg, device
        As in `read`.
    rows : int, default 65536
        Approximate number of rows of a piece; packets are not split.

    Returns
    -------
    ChunkReader
        An iterator over `Recording` objects, and a context manager that closes the file.

    Raises
    ------
    FileError, ValueError
        As in `read`. Damage in the body is raised only after all valid rows before it were
        returned.
    """
    return _risley.ChunkReader(os.fspath(path), rows, shot_rate, pose(extrinsics, extrinsics_deg),
                               device)


@suggesting
def from_arrays(*, azimuth: Any, zenith: Any, time_ns: Any = None, range: Any = None,
                serial: str = "", sensor: Union[str, _risley.Sensor] = "",
                **columns: Any) -> _risley.Recording:
    """Make a recording from columns of any origin.

    Parameters
    ----------
    azimuth, zenith : array_like of float, shape (rows,)
        Directions, rad; azimuth from X towards Y, zenith from Z.
    time_ns : array_like of int, shape (rows,), optional
        Times of the shots, ns. Without them, rows are taken as shots in firing order.
    range : array_like of float, shape (rows,), optional
        Ranges, m; 0 or less if the shot had no return.
    serial : str, optional
        Serial number of the sensor.
    sensor : str or Sensor, optional
        What made it: the name of a preset such as "avia", or a sensor. By default jobs find out.
    **columns : array_like, shape (rows,) or ()
        Further columns of `Recording`: ``intensity``, ``return_number``, ``tag``, ``emitter``,
        ``valid``, ``azimuth_resolution``, ``zenith_resolution``, ``range_resolution``. Rows are
        valid if their direction is finite and their range is not 0 or less, unless ``valid`` says
        otherwise.

    Returns
    -------
    Recording
        It holds copies of the columns.

    Raises
    ------
    ValueError
        If a column has another length, or an angle is out of range, as it is when given in degrees;
        the message names the column or row.
    TypeError
        For columns that do not hold numbers, and for unknown columns.
    """
    if isinstance(sensor, str) and sensor:
        sensor = _risley.load_sensor(sensor)
    device_type = sensor.device_type if isinstance(sensor, _risley.Sensor) else _UNKNOWN_TYPE
    if "emitter" in columns:
        columns["beam"] = columns.pop("emitter")
    return _risley.recording_from_arrays(time_ns, azimuth, zenith, range, columns, serial,
                                         device_type)


@suggesting
def write(recording: _risley.Recording, path: Path, *, format: str = "") -> None:
    """Write a recording.

    Parameters
    ----------
    recording : Recording
        What to write.
    path : str or path
        The file; its ending chooses the format unless `format` does.
    format : str, optional
        Name of a format.

    Raises
    ------
    FileError
        If the file cannot be written.
    ValueError
        For an unknown format, or a value that it cannot hold.
    """
    _risley.write_recording(recording, os.fspath(path), format)
