# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Results of jobs as plain data: columns, dictionaries, a sensor. All of it can be pickled."""
import html
import os
from typing import TYPE_CHECKING, Any, Dict, List, NamedTuple, Optional, Tuple, Union

from risley import _risley
from risley._progress import Progress, telling
from risley._units import Path

if TYPE_CHECKING:
    from risley import _answers
else:  # what attributes results have is known from their JSON alone
    class _answers:
        Estimate = Calibration = FlightCalibration = Cloud = Simulation = Identification = Pattern = object

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
    """What a user should know that does not make an answer useless; as a text, its message.

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


def warnings_of(found: List[Dict[str, Any]]) -> List[Warning]:
    """Warnings as results have them."""
    return [Warning(**one) for one in found]


class Fields(Dict[str, Any]):
    """A part of a result whose keys are attributes, too."""

    def __getattr__(self, name: str) -> Any:
        if name not in self:
            raise AttributeError(f"no {name}, only {', '.join(self)}")
        return self[name]


def _with_attributes(value: Any) -> Any:
    if isinstance(value, dict):
        return Fields({key: warnings_of(one) if key == "warnings" else _with_attributes(one)
                       for key, one in value.items()})
    return [_with_attributes(one) for one in value] if isinstance(value, list) else value


class _Answer:
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

    def to_dict(self) -> Dict[str, Any]:
        """The same as the command prints with ``--json``, without ``command`` and ``inputs``.

        Angles are in degrees there, as the names say.
        """
        return dict(self._dict)

    @property
    def warnings(self) -> List[Warning]:
        """What to know before the result is used."""
        return warnings_of(self._dict.get("warnings", []))


class _Columns(_Answer):
    """Quantities by name, in SI units."""

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

    def to_xarray(self) -> Any:
        """An `xarray.Dataset` of all columns over ``name`` and the covariance over ``free``.

        Raises
        ------
        ImportError
            If xarray is not installed.
        """
        import xarray
        data: Dict[str, Any] = {name: ("name", column) for name, column in self._columns().items()}
        data["covariance"] = (("free", "free_too"), self.covariance)
        return xarray.Dataset(
            data, coords={"name": self.names, "unit": ("name", self.units), "free": self.free,
                          "free_too": self.free})


class Solution(_Columns):
    """What estimates and calibrations have in common."""

    def __init__(self, found: Found) -> None:
        table = found.table
        super().__init__(found.to_dict(), table)
        #: Their values; shape (n,).
        self.values = table.values
        #: One standard deviation each if held parameters are exact; shape (n,).
        self.sigmas_given_held = table.sigmas_given_held
        #: Stable code, what was found, and what follows from it.
        self.verdict = Verdict(**self._dict["verdict"])
        #: The sensor as it was found, with its covariance.
        self.sensor = found.sensor
        self._html = found.html
        self._found: Optional[Found] = found
        self._report = ""

    def _columns(self) -> Dict[str, Any]:
        return {"value": self.values, "sigma": self.sigmas,
                "sigma_given_held": self.sigmas_given_held}

    def _report_text(self, progress: Progress) -> str:
        if not self._report and self._found is not None:
            with telling(progress) as tell:
                self._report = self._found.report_text(tell)
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
        self._report_text(None)  # what the page needs is gone with the C++ object
        return {**self.__dict__, "_found": None}

    def _repr_html_(self) -> str:
        return self._html

    def __repr__(self) -> str:
        return (f"<risley.{type(self).__name__} {self.sensor.name}: {len(self.names)} values, "
                f"{self.verdict.code}>")


class Estimate(Solution, _answers.Estimate):
    """What `risley.estimate` found: parameters, mean speeds, first rotation angles."""

    def __init__(self, found: _risley.EstimatedRecording) -> None:
        super().__init__(found)
        self._residuals: Optional[Tuple[Any, Any]] = None

    def _both_residuals(self) -> Tuple[Any, Any]:
        if self._residuals is None:  # nobody asked before: they are as many as shots
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
        self._both_residuals()  # gone with the C++ object, as what the page needs
        return super().__getstate__()


class Calibration(Solution, _answers.Calibration):
    """What `risley.calibrate` found on walls: parameters and the offset of ranges."""


class FlightCalibration(Solution, _answers.FlightCalibration):
    """What `risley.calibrate` found in flight: boresight, lever arm, clock, ranges, parameters."""


class Plan(_Columns):
    """What `risley.plan` predicts for a calibration: sigmas without values."""

    def __init__(self, planned: Planned) -> None:
        super().__init__(planned.to_dict(), planned.table)

    def _repr_html_(self) -> str:
        rows = "".join(f"<tr><td>{html.escape(name)}</td><td>{sigma:.2g}</td><td>{unit}</td></tr>"
                       for name, sigma, unit in zip(self.names, self.sigmas, self.units))
        return ("<table><tr><th>parameter</th><th>&plusmn; sigma</th><th>unit</th></tr>"
                f"{rows}</table>")


class Cloud(_Answer, _answers.Cloud):
    """What `risley.cloud` wrote."""


class Simulation(_Answer, _answers.Simulation):
    """What `risley.simulate` wrote."""


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

    @property
    def verdict(self) -> Verdict:
        """Stable code, what was found, and what follows from it."""
        return Verdict(**self._dict["verdict"])


class Pattern(_Answer, _answers.Pattern):
    """What `risley.pattern` wrote."""
