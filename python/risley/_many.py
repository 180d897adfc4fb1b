# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Jobs on many recordings in one call, as the command does for folders, patterns and lists."""
import os
from typing import Any, Callable, Dict, Iterator, List, Sequence, Tuple, Union

from risley import _risley
from risley._jobs import calibrate, cloud, estimate, info
from risley._progress import Progress, reporting
from risley._results import _Shown, needed
from risley._units import (AnySensor, Path, keyword_defaults, listed, options_of,
                           unknown_keyword)


class ManyResults(_Shown, Sequence[Dict[str, Any]]):
    """Results of many inputs: a sequence of dictionaries, one per input, in order.

    Each has the keys of the job's own result, ``input``, ``status`` (0: it went well, otherwise the
    exit status of the command), ``message`` (why it failed) and, where it had been made before,
    ``skipped``.
    """

    def __init__(self, found: Dict[str, Any]) -> None:
        self._results: List[Dict[str, Any]] = found["results"]
        #: Numbers of inputs that went well, that had been made before, and that failed.
        self.done, self.skipped, self.failed = found["done"], found["skipped"], found["failed"]
        #: A dictionary per input with the columns of the command's ``--table``, None where empty.
        self.rows: List[Dict[str, Any]] = found["rows"]

    def __len__(self) -> int:
        return len(self._results)

    def __getitem__(self, place: Any) -> Any:
        return self._results[place]

    def __iter__(self) -> Iterator[Dict[str, Any]]:
        return iter(self._results)

    def __repr__(self) -> str:
        return f"<ManyResults: {self.done} done, {self.skipped} skipped, {self.failed} failed>"

    def to_pandas(self) -> Any:
        """`rows` as a `pandas.DataFrame`."""
        return needed("pandas", "to_pandas()").DataFrame(self.rows)

    def to_xarray(self) -> Any:
        """`rows` as an `xarray.Dataset` over ``row``."""
        columns = {name: ("row", [row[name] for row in self.rows])
                   for name in (self.rows[0] if self.rows else {})}
        return needed("xarray", "to_xarray()").Dataset(columns)

    def _lines(self) -> List[Tuple[str, str]]:
        counts = f"{self.done} done, {self.skipped} skipped, {self.failed} failed"
        return [("inputs", counts),
                *((one["input"], one["message"] or one.get("verdict", {}).get("code", "done"))
                  for one in self)]


def _many(verb: str, job: Callable[..., Any], wanted: Dict[str, Any], options: Dict[str, Any],
          **more: Any) -> ManyResults:
    of_each = {name: default for name, default in keyword_defaults(job).items()
               if name not in wanted}
    for name in options:
        if name not in of_each:
            raise TypeError(unknown_keyword(f"{verb}_many", name, of_each))
    values = options_of({**of_each, **options, **more, "output": os.fspath(wanted["output"])})
    many = {"inputs": listed("inputs", wanted["inputs"]), "list": os.fspath(wanted["list"]),
            "table": os.fspath(wanted["table"]), "resume": wanted["resume"]}
    with reporting(wanted["progress"]) as on_progress:
        return ManyResults(_risley.run_many(verb, values, many, wanted["threads"], on_progress))


def estimate_many(inputs: Union[Path, Sequence[Path]] = (), *, list: Path = "", output: Path = "",
                  table: Path = "", resume: bool = False, threads: int = 0,
                  progress: Progress = None, **options: Any) -> ManyResults:
    """Estimate from each of many recordings. A failure does not stop the rest.

    Parameters
    ----------
    inputs : str, path or a sequence of them
        Recordings; folders, for all recordings in and below them; patterns such as
        ``"survey/**/*.lvx"``.
    list : str or path, optional
        Text file with further inputs, one a line.
    output : str or path, optional
        Folder for results, laid out as the inputs are below their common folder.
    table : str or path, optional
        Table to write with a row per input, .csv or .nc.
    resume : bool, default False
        Keep complete results that were made from the same bytes with the same options and
        version.
    threads : int, default 0
        Number of threads; 0 means one per core.
    progress : bool or callable, optional
        As in `risley.read`.
    **options
        As in `risley.estimate`.

    Returns
    -------
    ManyResults

    Raises
    ------
    FileError, ValueError
        For invalid options, names without any recording, and outputs that cannot be
        written.
    """
    return _many("estimate", estimate, locals(), options)


def calibrate_many(inputs: Union[Path, Sequence[Path]] = (), *, list: Path = "",
                   output: Path = "", table: Path = "", resume: bool = False, threads: int = 0,
                   progress: Progress = None, **options: Any) -> ManyResults:
    """Calibrate on each of many recordings of walls, separately.

    Parameters
    ----------
    inputs, list, output, table, resume, threads, progress
        As in `risley.estimate_many`.
    **options
        As in `risley.calibrate`, without those of a flight.

    Returns
    -------
    ManyResults
    """
    if "trajectory" in options:
        raise ValueError("trajectory is not for many inputs: a flight is calibrated as a whole")
    return _many("calibrate", calibrate, locals(), options, recordings="each")


def cloud_many(inputs: Union[Path, Sequence[Path]], calibration: AnySensor, output: Path, *,
               list: Path = "", table: Path = "", resume: bool = False, threads: int = 0,
               progress: Progress = None, **options: Any) -> ManyResults:
    """Turn each of many recordings into points with covariance.

    Parameters
    ----------
    inputs, list, table, resume, threads, progress
        As in `risley.estimate_many`.
    calibration : str or path
        As in `risley.cloud`.
    output : str or path
        Folder for the clouds.
    **options
        As in `risley.cloud`; without ``format`` the clouds are LAS files.

    Returns
    -------
    ManyResults
    """
    return _many("cloud", cloud, locals(), options, calibration=calibration)


def info_many(inputs: Union[Path, Sequence[Path]] = (), *, list: Path = "", table: Path = "",
              resume: bool = False, threads: int = 0, progress: Progress = None,
              **options: Any) -> ManyResults:
    """Describe each of many recordings and trajectories.

    Parameters
    ----------
    inputs, list, table, resume, threads, progress
        As in `risley.estimate_many`.
    **options
        As in `risley.info`.

    Returns
    -------
    ManyResults
    """
    return _many("info", info, {**locals(), "output": ""}, options)


def _convert(*, accuracy: Path = "", trajectory_topic: str = "",
             shot_rate: Any = None, extrinsics: Any = None, extrinsics_deg: Any = None,
             device: str = "") -> None:
    """The options of a conversion."""


def convert_many(inputs: Union[Path, Sequence[Path]], output: Path, format: str, *,
                 list: Path = "", table: Path = "", resume: bool = False, threads: int = 0,
                 progress: Progress = None, **options: Any) -> ManyResults:
    """Convert each of many recordings or trajectories into another format.

    Parameters
    ----------
    inputs, list, table, resume, threads, progress
        As in `risley.estimate_many`.
    output : str or path
        Folder for the files.
    format : str
        Name of the format, as ``risley convert --help`` lists them.
    **options
        ``accuracy`` and ``trajectory_topic`` of trajectories; ``shot_rate``, ``extrinsics``,
        ``extrinsics_deg`` and ``device`` as in `risley.read`.

    Returns
    -------
    ManyResults
    """
    return _many("convert", _convert, locals(), options, format=format)
