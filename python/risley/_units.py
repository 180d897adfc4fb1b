# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Arguments of jobs: recordings, files, and angles in SI units or, under another name, in degrees."""
import os
from typing import Any, Dict, Iterable, List, Mapping, Optional, Sequence, Tuple, Union

from risley import _risley

Path = Union[str, "os.PathLike[str]"]
Source = Union[Path, _risley.Recording]
YawPitchRoll = Optional[Tuple[float, float, float]]
Fixed = Union[Mapping[str, Optional[float]], Iterable[str]]
Rate = Union[None, float, str]


def source(recording: Source) -> Union[str, _risley.Recording]:
    """A recording by its path, or one in memory."""
    return recording if isinstance(recording, _risley.Recording) else os.fspath(recording)


def sources(recordings: Union[Source, Sequence[Source]]) -> List[Union[str, _risley.Recording]]:
    """One recording or several, as a list."""
    if isinstance(recordings, (str, os.PathLike, _risley.Recording)):
        return [source(recordings)]
    return [source(recording) for recording in recordings]


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


def paths(given: Union[Path, Sequence[Path]]) -> List[str]:
    """One path or several, as a list."""
    if isinstance(given, (str, os.PathLike)):
        return [os.fspath(given)]
    return [os.fspath(path) for path in given]


def options_of(values: Mapping[str, Any]) -> Dict[str, Any]:
    """Keyword arguments of a job as the libraries take them: angles in radians, paths as texts."""
    options: Dict[str, Any] = {}
    for name, value in values.items():
        if name in ("progress", "stop", "threads") or name.removesuffix("_deg") in options:
            continue
        if name == "extrinsics":
            value = pose(value, values["extrinsics_deg"])
        elif name == "start_angles":
            value = angles(name, value, values["start_angles_deg"])
        elif f"{name}_deg" in values:
            value = angle(name, value, values[f"{name}_deg"])
        elif name == "recordings":
            value = sources(value)
        elif isinstance(value, os.PathLike):
            value = os.fspath(value)
        elif isinstance(value, Mapping):
            value = list(value.items())
        elif name == "fix":
            value = [(parameter, None) for parameter in value]
        elif isinstance(value, Iterable) and not isinstance(value, (str, _risley.Recording)):
            value = list(value)
        options[name] = value
    return options
