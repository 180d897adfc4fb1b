# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Arguments of jobs: recordings, files, and angles in SI units or, under another name, in degrees."""
import os
from typing import List, Optional, Sequence, Tuple, Union

from risley import _risley

Path = Union[str, "os.PathLike[str]"]
Source = Union[Path, _risley.Recording]
YawPitchRoll = Optional[Tuple[float, float, float]]


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
