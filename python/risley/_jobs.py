# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Jobs on recordings."""
import os
from typing import Iterable, List, Mapping, Optional, Tuple, Union

from risley import _risley
from risley._progress import Progress, telling
from risley._units import Path, YawPitchRoll, angle, pose

Fixed = Union[Mapping[str, Optional[float]], Iterable[str]]


def _held(fixed: Fixed) -> List[Tuple[str, Optional[float]]]:
    if isinstance(fixed, Mapping):
        return list(fixed.items())
    return [(name, None) for name in fixed]


def estimate(recording: Path, *, sensor: Path = "", method: str = "map",
             rate: Union[None, float, str] = None, angle_noise: Optional[float] = None,
             angle_noise_deg: Optional[float] = None, fixed: Fixed = (), free: Iterable[str] = (),
             mirrored: Optional[bool] = None, truth: Path = "",
             shot_rate: Optional[float] = None, extrinsics: YawPitchRoll = None,
             extrinsics_deg: YawPitchRoll = None, threads: int = 0,
             progress: Progress = None) -> _risley.Estimate:
    """Estimate a sensor's parameters and rotation angles from a recording.

    Parameters
    ----------
    recording : str or path
        A recording of one sensor.
    sensor : str or path, optional
        Name of a preset, or a preset or calibration file; otherwise found from the recording.
    method : {'map', 'ekf'}
        All shots at once, or the paper's filter.
    rate : float or 'full', optional
        Shots per second to use, Hz; by default what is usual for the method.
    angle_noise, angle_noise_deg : float, optional
        Standard deviation of the noise of azimuth and zenith before rounding, rad or deg; by
        default estimated.
    fixed : mapping of str to float or None, or iterable of str
        Parameters to hold, at the given value (in the unit of the name) if there is one.
    free : iterable of str
        Further parameters to estimate.
    mirrored : bool, optional
        Whether the elevation has the opposite sign; by default found from the recording.
    truth : str or path, optional
        ``OUT.truth.yaml`` of the simulation that made the recording, to compare the estimate with.
    shot_rate, extrinsics, extrinsics_deg
        As in `risley.read`.
    threads : int, default 0
        Number of threads; 0 means one per core.
    progress : bool or callable, optional
        As in `risley.read`.

    Returns
    -------
    Estimate

    Raises
    ------
    EstimationError
        If nothing can be estimated from the data.
    FileError, ValueError
        For damaged files, and for options that make no sense.
    """
    noise = angle("angle_noise", angle_noise, angle_noise_deg)
    with telling(progress) as tell:
        return _risley.estimate(os.fspath(recording), os.fspath(sensor), method, rate, noise,
                                _held(fixed), list(free), mirrored, os.fspath(truth), shot_rate,
                                pose(extrinsics, extrinsics_deg), threads, tell)


def write_report(result: _risley.Estimate, path: Path, *, progress: Progress = None) -> None:
    """Write the page of a result as one HTML file that needs no network.

    Parameters
    ----------
    result : Estimate
        What `risley.estimate` returned.
    path : str or path
        The file to write.
    progress : bool or callable, optional
        As in `risley.read`.

    Raises
    ------
    FileError
        If the file cannot be written.
    """
    with telling(progress) as tell:
        _risley.write_page(result, os.fspath(path), tell)
