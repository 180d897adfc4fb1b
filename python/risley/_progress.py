# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Progress of a job: what callers may pass as ``progress``."""
import contextlib
from typing import Any, Callable, Iterator, Optional, Union

OnProgress = Callable[[str, float], object]
Progress = Union[None, bool, OnProgress]


class _Bars:
    """A tqdm bar for every stage."""

    def __init__(self, tqdm: Any) -> None:
        self._tqdm = tqdm
        self._bar: Any = None

    def show(self, name: str, fraction: float) -> None:
        if self._bar is None or self._bar.desc.rstrip(": ") != name:
            self.close()
            self._bar = self._tqdm(total=1.0, desc=name,
                                   bar_format="{l_bar}{bar}| {elapsed}<{remaining}")
        self._bar.n = fraction
        self._bar.refresh()

    def close(self) -> None:
        if self._bar is not None:
            self._bar.close()


@contextlib.contextmanager
def reporting(progress: Progress) -> Iterator[Optional[OnProgress]]:
    """The function to call with the name of a stage and the fraction done, or None."""
    if progress is None or progress is False:
        yield None
    elif progress is True:
        try:
            from tqdm.auto import tqdm
        except ImportError:
            yield None
            return
        bars = _Bars(tqdm)
        try:
            yield bars.show
        finally:
            bars.close()
    else:
        yield progress
