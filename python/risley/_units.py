# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Arguments of jobs: objects, files, and angles in SI units or, under another name, in degrees."""
import difflib
import functools
import inspect
import os
from typing import (TYPE_CHECKING, Any, Callable, Dict, Iterable, List, Mapping, Optional, Sequence,
                    Tuple, TypeVar, Union)

from risley import _risley

if TYPE_CHECKING:
    from risley._results import FlightCalibration, Identification, Simulation, Solution

Path = Union[str, "os.PathLike[str]"]
Source = Union[Path, _risley.Recording, "Simulation"]
#: A preset by name, a file or folder with a calibration, or a result of a job.
AnySensor = Union[Path, _risley.Sensor, "Solution", "Identification"]
AnyMount = Union[Path, _risley.Mount, "FlightCalibration"]
AnyTrajectory = Union[Path, _risley.Trajectory, "FlightCalibration", "Simulation"]
Truth = Union[Path, "Simulation"]
YawPitchRoll = Optional[Tuple[float, float, float]]
Fixed = Union[Mapping[str, Optional[float]], Iterable[str]]
Rate = Union[None, float, str]


Function = TypeVar("Function", bound=Callable[..., Any])

#: Arguments given by path or as an object.
_IN_MEMORY = (_risley.Recording, _risley.Sensor, _risley.Mount, _risley.Trajectory)


def keyword_defaults(function: Callable[..., Any]) -> Dict[str, Any]:
    """Default values of a function's keywords."""
    return {name: parameter.default
            for name, parameter in inspect.signature(function).parameters.items()
            if parameter.kind is parameter.KEYWORD_ONLY}


def suggesting(function: Function) -> Function:
    """The same function; its TypeError about an unknown keyword names the nearest one."""
    parameters = inspect.signature(function).parameters
    known = list(parameters)
    if any(one.kind is one.VAR_KEYWORD for one in parameters.values()):
        return function  # which says so itself

    @functools.wraps(function)
    def call(*args: Any, **keywords: Any) -> Any:
        for name in keywords:
            if name not in known:
                raise TypeError(unknown_keyword(function.__name__, name, known))
        return function(*args, **keywords)

    return call  # type: ignore[return-value]


def unknown_keyword(function: str, name: str, known: Iterable[str]) -> str:
    """Message on a keyword that a function does not have."""
    near = difflib.get_close_matches(name, known, 1, 0.5)
    return f"{function}() has no keyword {name}" + (f"; did you mean {near[0]}?" if near else "")


def plain(name: str, value: Any) -> Any:
    """The libraries' form of an option: a path as text, for a result its object."""
    if hasattr(value, "_as_option"):
        value = value._as_option(name)
    return os.fspath(value) if isinstance(value, os.PathLike) else value


def listed(name: str, given: Any) -> List[Any]:
    """One or several objects, as a list in the libraries' form."""
    if isinstance(given, (str, os.PathLike, *_IN_MEMORY)) or hasattr(given, "_as_option"):
        given = [given]
    return [plain(name, one) for one in given]


def angle(name: str, radians: Optional[float], degrees: Optional[float]) -> Optional[float]:
    """An optional angle, rad."""
    if degrees is None:
        return radians
    if radians is not None:
        raise ValueError(f"{name} and {name}_deg are one angle: give one of them")
    return _risley.radians(degrees)


def angles(name: str, radians: Optional[Sequence[float]],
           degrees: Optional[Sequence[float]]) -> Optional[Tuple[float, ...]]:
    """Optional angles, rad."""
    if degrees is None:
        return None if radians is None else tuple(radians)
    if radians is not None:
        raise ValueError(f"{name} and {name}_deg are the same angles: give one of them")
    return tuple(_risley.radians(value) for value in degrees)


def pose(radians: YawPitchRoll, degrees: YawPitchRoll) -> YawPitchRoll:
    """Extrinsics, rad."""
    given = angles("extrinsics", radians, degrees)
    if given is None:
        return None
    if len(given) != 3:
        raise ValueError(f"extrinsics has {len(given)} angles, expected yaw, pitch, roll")
    return given[0], given[1], given[2]


def options_of(values: Mapping[str, Any]) -> Dict[str, Any]:
    """Keyword arguments of a job in the libraries' form: angles in radians, paths as texts."""
    options: Dict[str, Any] = {}
    for name, value in values.items():
        if name in ("progress", "stop", "threads") or name.removesuffix("_deg") in options:
            continue
        value = plain(name, value)
        if name == "extrinsics":
            value = pose(value, values["extrinsics_deg"])
        elif name == "start_angles":
            value = angles(name, value, values["start_angles_deg"])
        elif name == "process_noise" and isinstance(value, str):
            degrees = values["process_noise_deg"]
            value = angle(name, None if value == "auto" else 0.0, degrees) or value
        elif f"{name}_deg" in values:
            value = angle(name, value, values[f"{name}_deg"])
        elif name in ("recordings", "truths", "results"):
            value = listed(name, value)
        elif isinstance(value, Mapping):
            value = list(value.items())
        elif name == "fix":
            value = [(parameter, None) for parameter in value]
        elif isinstance(value, Iterable) and not isinstance(value, (str, *_IN_MEMORY)):
            value = list(value)
        options[name] = value
    return options
