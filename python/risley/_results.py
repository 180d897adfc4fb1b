# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Results of jobs as plain data: columns, dictionaries, a sensor. All of it can be pickled."""
import html
import importlib
import os
from typing import (TYPE_CHECKING, Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple,
                    Union)

from risley import _risley
from risley import _plots
from risley._progress import Progress, reporting
from risley._units import Path

if TYPE_CHECKING:
    from risley import _answers
else:  # the attributes of results are known only from their JSON
    class _answers:
        Estimate = Calibration = FlightCalibration = Cloud = CloudOfStations = object
        Simulation = Identification = Pattern = object

Found = Union[_risley.EstimatedRecording, _risley.CalibratedRecordings, _risley.CalibratedFlight]
Planned = Union[_risley.PlannedCalibration, _risley.PlannedFlight]


class Verdict(NamedTuple):
    """What came of a job.

    Attributes
    ----------
    code : str
        Stable, for programs.
    words : str
        What was found, in a sentence.
    to_do : str
        What follows from it.
    """

    code: str
    words: str
    to_do: str


class Warning(NamedTuple):
    """A remark that does not invalidate the result; as a text, its message.

    Attributes
    ----------
    code : str
        Stable, for programs; docs/files/json.md lists all.
    message : str
        What it is, in words, with the place in the file.
    byte_offset, line : int
        Where in the file, if it is known.
    lost_records : int
        Records that are known to be missing.
    """

    code: str
    message: str
    byte_offset: Optional[int] = None
    line: Optional[int] = None
    lost_records: int = 0

    def __str__(self) -> str:
        return self.message


def needed(package: str, function: str) -> Any:
    """A package needed only by some functions. @raises ImportError that names both"""
    try:
        return importlib.import_module(package)
    except ImportError as error:
        raise ImportError(f"{function} needs {package}, which is not installed") from error


def warnings_of(found: List[Dict[str, Any]]) -> List[Warning]:
    """Warnings as results have them."""
    return [Warning(**one) for one in found]


class Fields(Dict[str, Any]):
    """A part of a result whose keys are also attributes."""

    def __getattr__(self, name: str) -> Any:
        if name not in self:
            raise AttributeError(f"no {name}, only {', '.join(self)}")
        return self[name]


def _with_attributes(value: Any, as_told: bool = False) -> Any:
    if isinstance(value, dict):
        return Fields({key: warnings_of(one) if key == "warnings" and not as_told
                       else _with_attributes(one, as_told) for key, one in value.items()})
    if isinstance(value, list):
        return [_with_attributes(one, as_told) for one in value]
    return value


def lines_of(found: Mapping[str, Any], head: str = "") -> List[Tuple[str, str]]:
    """Names and values in a dictionary, for people; for lists the length."""
    lines: List[Tuple[str, str]] = []
    for key, value in found.items():
        if key in ("format_version", "version", "warnings"):
            continue
        if isinstance(value, dict):
            lines += lines_of(value, f"{head}{key}.")
        elif isinstance(value, list) and any(isinstance(one, (dict, list)) for one in value):
            lines.append((head + key, f"{len(value)} entries"))
        elif isinstance(value, list):
            lines.append((head + key, ", ".join(map(str, value))))
        elif value is not None:
            lines.append((head + key, f"{value:.6g}" if isinstance(value, float) else str(value)))
    return lines


def table_text(lines: Sequence[Tuple[str, str]]) -> str:
    """Names and values in two columns."""
    width = max((len(name) for name, _ in lines), default=0)
    return "\n".join(f"{name:{width}}  {value}" for name, value in lines)


def table_html(lines: Sequence[Tuple[str, str]]) -> str:
    """The same for a notebook."""
    rows = "".join(f"<tr><td>{html.escape(name)}</td><td>{html.escape(value)}</td></tr>"
                   for name, value in lines)
    return f"<table>{rows}</table>"


class _Shown:
    """Display common to all results."""

    def _lines(self) -> List[Tuple[str, str]]:
        raise NotImplementedError

    def summary(self) -> str:
        """The result, in a few lines."""
        return table_text(self._lines()[:8])

    def __str__(self) -> str:
        return table_text(self._lines())

    def _repr_html_(self) -> str:
        return table_html(self._lines())


class _Answer(_Shown):
    """Result of a job. The keys of the command's ``--json`` are its attributes, in the same units:
    ``found.pointing_error.total_deg.value``; angles are in degrees there, as the names say.
    """

    def __init__(self, found: Dict[str, Any]) -> None:
        self._dict = found

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):  # while it is unpickled, there is no _dict
            raise AttributeError(name)
        return _with_attributes(getattr(Fields(self._dict), name))

    def __dir__(self) -> List[str]:
        return [*super().__dir__(), *self._dict]

    def _lines(self) -> List[Tuple[str, str]]:
        return lines_of(self._dict)

    def __repr__(self) -> str:
        what = self._dict.get("verdict", {}).get("code") or ", ".join(
            f"{value} {key}" for key, value in self._dict.items()
            if key in ("points", "observations", "rows"))
        return f"<risley.{type(self).__name__}: {what}>"

    def to_dict(self) -> Dict[str, Any]:
        """The same as the command prints with ``--json``, without ``command`` and ``inputs``.

        Angles are in degrees there, as the names say.
        """
        return dict(self._dict)

    @property
    def warnings(self) -> List[Warning]:
        """Remarks to read before the result is used."""
        return warnings_of(self._dict.get("warnings", []))


class _Columns(_Answer):
    """Quantities by name, in SI units. Where numpy is not installed, their arrays are lists."""

    def __init__(self, found: Dict[str, Any], table: _risley.ValueTable) -> None:
        super().__init__(found)
        #: Names of the quantities, without units.
        self.names = table.names
        #: Their units: 1, rad, rad/s, m or s.
        self.units = table.units
        #: One standard deviation each, including the uncertainty of held parameters; shape (n,).
        self.sigmas = table.sigmas
        #: Names of the quantities of the covariance.
        self.free = table.covariance_names
        #: Covariance of the free quantities if held ones are exact; shape (free, free).
        self.covariance = table.covariance

    def _columns(self) -> Dict[str, Any]:
        return {"sigma": self.sigmas}

    def to_pandas(self) -> Any:
        """A `pandas.DataFrame` of all columns with the names as index."""
        return needed("pandas", "to_pandas()").DataFrame({**self._columns(), "unit": self.units},
                                                         index=self.names)

    def to_xarray(self) -> Any:
        """An `xarray.Dataset` of all columns over ``name`` and the covariance over ``free``.

        Raises
        ------
        ImportError
            If xarray is not installed.
        """
        xarray = needed("xarray", "to_xarray()")
        data: Dict[str, Any] = {name: ("name", column) for name, column in self._columns().items()}
        data["covariance"] = (("free", "free_too"), self.covariance)
        return xarray.Dataset(
            data, coords={"name": self.names, "unit": ("name", self.units), "free": self.free,
                          "free_too": self.free})


class Solution(_Columns):
    """Common part of estimates and calibrations."""

    def __init__(self, found: Found) -> None:
        table = found.table
        super().__init__(found.to_dict(), table)
        #: Their values; shape (n,).
        self.values = table.values
        #: One standard deviation each if held parameters are exact; shape (n,).
        self.sigmas_given_held = table.sigmas_given_held
        #: Stable code, result, and recommendation.
        self.verdict = Verdict(**self._dict["verdict"])
        #: The estimated sensor, with its covariance.
        self.sensor = found.sensor
        self._html, self._text = found.html, found.text
        self._found: Optional[Found] = found
        self._report = ""

    def _columns(self) -> Dict[str, Any]:
        return {"value": self.values, "sigma": self.sigmas,
                "sigma_given_held": self.sigmas_given_held}

    def _report_text(self, progress: Progress) -> str:
        if not self._report and self._found is not None:
            with reporting(progress) as on_progress:
                self._report = self._found.report_text(on_progress)
        return self._report

    def report(self, path: Path, *, progress: Progress = None) -> None:
        """Write the page of the result as one HTML file that needs no network.

        Parameters
        ----------
        path : str or path
            The file to write.
        progress : bool or callable, optional
            As in `risley.read`.

        Raises
        ------
        FileError
            If the file cannot be written.
        """
        _risley.write_page(self._report_text(progress), os.fspath(path))

    def __getstate__(self) -> Dict[str, Any]:
        self._report_text(None)  # the data for the page are gone with the C++ object
        return {**self.__dict__, "_found": None}

    def _as_option(self, name: str) -> Any:
        return self.sensor

    def summary(self) -> str:
        """The verdict, the recommended action, and remarks to read before the result is used."""
        return "\n".join([self.verdict.words, f"what to do: {self.verdict.to_do}",
                          *map(str, self.warnings)])

    def _repr_html_(self) -> str:
        return self._html

    def __str__(self) -> str:
        return self._text

    def __repr__(self) -> str:
        return (f"<risley.{type(self).__name__} {self.sensor.name}: {len(self.names)} values, "
                f"{self.verdict.code}>")

    def plot(self, axes: Any = None) -> Any:
        """Every value with its sigma, less that of the sensor type, in sigmas.

        Parameters
        ----------
        axes : matplotlib axes, optional
            Where to draw; by default a new figure.

        Returns
        -------
        matplotlib axes
        """
        return _plots.sigmas(self, axes)


class RotationAngles(NamedTuple):
    """Rotation angles of the prisms.

    Attributes
    ----------
    time_ns : ndarray of int, shape (n,)
        Times on the recording's clock, ns.
    angle : ndarray, shape (n, prisms)
        Rotation angles in beam order, not wrapped, rad.
    covariance : ndarray, shape (n, prisms, prisms)
        Their covariance, rad^2.
    speed : ndarray, shape (n, prisms)
        Speeds, rad/s.
    outlier : ndarray, shape (n,), or None
        1 where the shot was left out; None at times that were asked for.
    """

    time_ns: Any
    angle: Any
    covariance: Any
    speed: Any
    outlier: Any

    @property
    def sigma(self) -> Any:
        """One standard deviation of every angle, rad; shape (n, prisms)."""
        return self.covariance.diagonal(axis1=1, axis2=2) ** 0.5


class Estimate(Solution, _answers.Estimate):
    """Result of `risley.estimate`: parameters, mean speeds, first rotation angles."""

    def __init__(self, found: _risley.EstimatedRecording) -> None:
        super().__init__(found)
        self._residuals: Optional[Tuple[Any, Any]] = None
        self._motion: Optional[_risley.RotorMotion] = None

    def rotation_angles(self, time_ns: Any = None) -> RotationAngles:
        """Rotation angles of the prisms with their covariance.

        Parameters
        ----------
        time_ns : array_like of int, shape (n,), optional
            Times on the recording's clock, ns; by default those of the shots that were used.

        Returns
        -------
        RotationAngles
            NaN at times from which no such shot is within 2 ms.
        """
        motion = self._rotor_motion()
        if time_ns is None:
            time_ns, found, outlier = motion.shot_time_ns, motion.at_shots(), motion.outlier
        else:
            found, outlier = motion.at(time_ns), None
        return RotationAngles(time_ns, *found, outlier)

    def plot(self, axes: Any = None) -> Any:
        """Histograms of the residuals, as `Solution.plot`."""
        return _plots.residuals(self, axes)

    def _rotor_motion(self) -> _risley.RotorMotion:
        if self._motion is None:
            assert isinstance(self._found, _risley.EstimatedRecording)
            self._motion = self._found.motion
        return self._motion

    def _both_residuals(self) -> Tuple[Any, Any]:
        if self._residuals is None:  # computed on first use: one per shot
            assert isinstance(self._found, _risley.EstimatedRecording)
            self._residuals = self._found.residuals
        return self._residuals

    @property
    def azimuth_residual(self) -> Any:
        """Observed minus estimated azimuth of every used shot, rad. ndarray."""
        return self._both_residuals()[0]

    @property
    def zenith_residual(self) -> Any:
        """Observed minus estimated zenith of every used shot, rad. ndarray."""
        return self._both_residuals()[1]

    def __getstate__(self) -> Dict[str, Any]:
        self._rotor_motion()
        self._both_residuals()  # gone with the C++ object, like the data for the page
        return super().__getstate__()


class Calibration(Solution, _answers.Calibration):
    """Result of `risley.calibrate` on walls: parameters and the offset of ranges."""


class FlightCalibration(Solution, _answers.FlightCalibration):
    """Result of `risley.calibrate` in flight: boresight, lever arm, clock, ranges, parameters.

    Attributes
    ----------
    mount : Mount
        How the sensor sits on the platform, as found.
    corrected_trajectory : Trajectory
        Where the platform was, as found.
    """

    def __init__(self, found: _risley.CalibratedFlight) -> None:
        super().__init__(found)
        self.mount, self.corrected_trajectory = found.mount, found.trajectory

    def _as_option(self, name: str) -> Any:
        return {"mount": self.mount,
                "trajectory": self.corrected_trajectory}.get(name, self.sensor)


class Plan(_Columns):
    """Prediction of `risley.plan` for a calibration: sigmas without values."""

    def __init__(self, planned: Planned) -> None:
        super().__init__(planned.to_dict(), planned.table)

    def _lines(self) -> List[Tuple[str, str]]:
        return [(name, f"+- {sigma:.2g} {unit}")
                for name, sigma, unit in zip(self.names, self.sigmas, self.units)]

    def __repr__(self) -> str:
        return f"<risley.Plan: {len(self.names)} sigmas>"


class Cloud(_Answer, _answers.Cloud):
    """What `risley.cloud` wrote."""


class CloudOfStations(_Answer, _answers.CloudOfStations):
    """Result of `risley.cloud` for recordings on stations."""


class Simulation(_Answer, _answers.Simulation):
    """What `risley.simulate` wrote. Can be used as its recording, truth or trajectory."""

    def _as_option(self, name: str) -> Any:
        endings = {"truth": ".truth.yaml"}
        if name == "trajectory":
            return self._dict["trajectory"]
        return self._dict["files"][0] + endings.get(name, "")


class Identification(_Answer, _answers.Identification):
    """What `risley.identify` found.

    Attributes
    ----------
    sensor : Sensor
        The best hypothesis as a sensor.
    """

    def __init__(self, sensor: _risley.Sensor, found: Dict[str, Any]) -> None:
        super().__init__(found)
        self.sensor = sensor

    def _as_option(self, name: str) -> Any:
        return self.sensor

    @property
    def verdict(self) -> Verdict:
        """Stable code, result, and recommendation."""
        return Verdict(**self._dict["verdict"])


class Pattern(_Answer, _answers.Pattern):
    """What `risley.pattern` wrote."""


class Scan(_Shown):
    """Shot directions of a sensor, from `risley.pattern`.

    Attributes
    ----------
    directions : ndarray, shape (n, 3)
        Unit vectors in the sensor's frame; NaN where no beam gets through.
    """

    def __init__(self, options: Dict[str, Any], directions: Any) -> None:
        self._options = options
        self._times: Optional[Tuple[Any, Any]] = None
        self.directions = directions

    def _both_times(self) -> Tuple[Any, Any]:
        if self._times is None:
            self._times = _risley.pattern_times(self._options)
        return self._times

    @property
    def time(self) -> Any:
        """Times of the shots, s; ndarray of shape (n,)."""
        return self._both_times()[0]

    @property
    def emitter(self) -> Any:
        """Emitters of the shots, counted from 0; ndarray of shape (n,)."""
        return self._both_times()[1]

    def __len__(self) -> int:
        return len(self.directions)

    def _lines(self) -> List[Tuple[str, str]]:
        sensor = self._options["sensor"]
        return [("sensor", getattr(sensor, "name", sensor)), ("shots", str(len(self))),
                ("seconds", f"{self.time[-1] - self.time[0]:.6g}"),
                ("dtype", str(self.directions.dtype))]

    def __repr__(self) -> str:
        return f"<risley.Scan: {len(self)} directions, {self.directions.dtype}>"

    def plot(self, axes: Any = None) -> Any:
        """Azimuth and elevation of the shots, as `Solution.plot`."""
        return _plots.scan(self, axes)


class Answer(Fields, _Shown):
    """Result of a job, as a dictionary whose keys are also attributes."""

    def __init__(self, verb: str, found: Mapping[str, Any]) -> None:
        super().__init__(_with_attributes(dict(found), as_told=True))
        self.__dict__["_verb"] = verb

    def __reduce__(self) -> Tuple[Any, ...]:
        return Answer, (self._verb, dict(self))

    def __repr__(self) -> str:
        return f"<risley.{type(self).__name__} of {self._verb}: {', '.join(self)}>"

    def _lines(self) -> List[Tuple[str, str]]:
        return lines_of(self)

    def plot(self, axes: Any = None) -> Any:
        """Changes of a comparison or bounds of an observability, as `Solution.plot`."""
        return _plots.answer(self._verb, self, axes)
