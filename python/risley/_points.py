# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Points of recordings with their covariance, in memory."""
from typing import Any, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple

from risley import _plots, _risley
from risley._progress import Progress, reporting
from risley._results import Answer, _Shown, needed
from risley._units import (AnyMount, AnySensor, AnyTrajectory, Path, Rate, Source, YawPitchRoll,
                           keyword_defaults, options_of, suggesting, unknown_keyword)


_NOT_ALWAYS = ("covariance", "own_covariance", "loading", "rotation_angle", "azimuth_residual",
               "zenith_residual", "strip")


class Points(_Shown):
    """Points with their covariance, as arrays with a row for each point.

    The arrays are C-contiguous and may be written to; numpy hands them to torch, jax and cupy
    through DLPack without a copy. Those without a covariance, rotation angles or loadings are None.

    Attributes
    ----------
    xyz : ndarray, shape (n, 3)
        Coordinates, m, in the frame that ``frame`` names.
    time_ns : ndarray of int, shape (n,)
        Times of the shots on the recording's clock, ns.
    covariance : ndarray, shape (n, 3, 3), or None
        Covariance of each point, all its sources together, m^2.
    own_covariance : ndarray, shape (n, 3, 3), or None
        The part that it shares with no other point, m^2: what ICP wants as weights.
    loading : ndarray, shape (n, factors, 3), or None
        What one standard deviation of each common factor moves the point by, m: with
        ``common_factors=True``.
    range, incidence_angle : ndarray, shape (n,)
        Range, m, and angle between beam and surface normal, rad; NaN where it is not known.
    rotation_angle : ndarray, shape (n, prisms), or None
        Rotation angles of the prisms, rad.
    azimuth_residual, zenith_residual : ndarray, shape (n,), or None
        Reported direction less that of the smoothed rotation angles, rad.
    intensity, return_number, number_of_returns, tag, emitter : ndarray of uint8, shape (n,)
        As the sensor reports them; returns from 1, emitters from 0.
    strip : ndarray of uint16, shape (n,), or None
        Strip of a flight, from 1; 0: of none.
    frame : str
        What the coordinates are.
    axes : list of str
        Names of the axes.
    wkt : str
        OGC WKT of a map; empty for other frames.
    found : Answer
        As ``risley cloud --json``, without output; None for a piece of a recording.
    """

    xyz: Any
    time_ns: Any
    covariance: Any
    own_covariance: Any
    loading: Any
    range: Any
    incidence_angle: Any
    rotation_angle: Any
    azimuth_residual: Any
    zenith_residual: Any
    intensity: Any
    return_number: Any
    number_of_returns: Any
    tag: Any
    emitter: Any
    strip: Any

    def __init__(self, arrays: Mapping[str, Any], frame: str, wkt: str, axes: Sequence[str],
                 found: Optional[Answer] = None) -> None:
        self._arrays = dict(arrays)
        self.__dict__.update({**dict.fromkeys(_NOT_ALWAYS), **self._arrays})
        self.frame, self.wkt, self.axes, self.found = frame, wkt, list(axes), found

    @property
    def time(self) -> Any:
        """Times of the shots on the recording's clock, s. A new ndarray of shape (n,)."""
        return 1e-9 * self.time_ns

    @property
    def sigma(self) -> Any:
        """Root of the sum of the variances of each point, m. A new ndarray of shape (n,)."""
        return self.covariance.trace(axis1=1, axis2=2) ** 0.5

    def __len__(self) -> int:
        return len(self.time_ns)

    def __getitem__(self, key: Any) -> "Points":
        """Some points, by a slice, a mask or their numbers."""
        key = slice(key, key + 1 or None) if isinstance(key, int) else key
        return Points({name: array[key] for name, array in self._arrays.items()}, self.frame,
                      self.wkt, self.axes, self.found)

    def __getstate__(self) -> Dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name not in self._arrays}

    def __setstate__(self, state: Dict[str, Any]) -> None:
        self.__dict__.update(state)
        self.__dict__.update(self._arrays)

    def _lines(self) -> List[Tuple[str, str]]:
        return [("points", str(len(self))), ("frame", self.frame),
                *((name, f"{array.dtype} {array.shape}") for name, array in self._arrays.items())]

    def __repr__(self) -> str:
        return f"<risley.Points: {len(self)} points {self.frame}>"

    def to_xarray(self) -> Any:
        """An `xarray.Dataset` of all arrays over ``point``."""
        return needed("xarray", "to_xarray()").Dataset({
            name: (("point", *{2: ("axis",), 3: ("axis", "axis_too")}.get(array.ndim, ()))
                   if name in ("xyz", "covariance", "own_covariance") else
                   ("point", *(f"{name}_{i}" for i in range_of(1, array.ndim))), array)
            for name, array in self._arrays.items()})

    def to_pandas(self) -> Any:
        """A `pandas.DataFrame` of the coordinates and of all arrays of one number a point."""
        columns = {name: array for name, array in self._arrays.items() if array.ndim == 1}
        return needed("pandas", "to_pandas()").DataFrame(
            {**dict(zip("xyz", self.xyz.T)), **columns})

    def plot(self, axes: Any = None) -> Any:
        """The points from above, coloured by their sigma, as `Solution.plot`."""
        return _plots.points(self, axes)


range_of = range  # for classes above that have such a column


@suggesting
def points(recording: Source, calibration: AnySensor, *, directions: str = "smoothed",
           beam_origin: bool = True, beam_divergence: bool = True, covariance: bool = True,
           common_factors: bool = False, rate: Rate = None, noise_angle: Optional[float] = None,
           noise_angle_deg: Optional[float] = None, trajectory: AnyTrajectory = "",
           trajectory_topic: str = "", mount: AnyMount = "", accuracy: Path = "",
           trajectory_errors: Path = "", crs: str = "", datum: str = "",
           shot_rate: Optional[float] = None, extrinsics: YawPitchRoll = None,
           extrinsics_deg: YawPitchRoll = None, device: str = "", threads: int = 0,
           progress: Progress = None) -> Points:
    """Turn a recording into points with covariance, in memory.

    Parameters
    ----------
    recording, calibration, directions, beam_origin, beam_divergence, covariance, common_factors,
    rate, noise_angle, noise_angle_deg, trajectory, trajectory_topic, mount, accuracy,
    trajectory_errors, crs, datum, shot_rate, extrinsics, extrinsics_deg, device, threads, progress
        As in `risley.cloud`.

    Returns
    -------
    Points
        The same as `risley.cloud` writes, before its formats round them.

    Raises
    ------
    EstimationError, FileError, ValueError
        As in `risley.cloud`.
    """
    options = options_of(locals())
    with reporting(progress) as on_progress:
        made, found = _risley.points(options, threads, on_progress)
    return Points(*made, Answer("points", found))


@suggesting
def point_chunks(recording: Source, calibration: AnySensor, *, rows: int = 1_000_000,
                 threads: int = 0, **options: Any) -> Iterator[Points]:
    """Turn a recording into points piece by piece, so that memory does not grow with its length.

    Parameters
    ----------
    recording, calibration, threads
        As in `risley.points`.
    rows : int, default 1000000
        Least number of points of a piece, but for the last one; a piece has up to a million more.
    **options
        As in `risley.points`.

    Returns
    -------
    iterator of Points
        Together they are what `risley.points` returns.

    Raises
    ------
    EstimationError, FileError, ValueError
        As in `risley.points`. Damage is raised only after all valid points before it were returned.
    """
    of_points = keyword_defaults(points)
    unknown = [name for name in options if name not in of_points]
    if unknown:
        raise TypeError(unknown_keyword("point_chunks", unknown[0], of_points))
    values = options_of({**of_points, **options, "recording": recording,
                         "calibration": calibration})
    return (Points(*made) for made in _risley.PointReader(values, rows, threads))
