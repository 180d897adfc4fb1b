# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Drawings of the plot() of results, if matplotlib is installed."""
from typing import Any, Mapping, Sequence


def _axes(axes: Any) -> Any:
    if axes is not None:
        return axes
    try:
        from matplotlib import pyplot  # pylint: disable=import-outside-toplevel
    except ImportError as error:
        raise ImportError("plot() needs matplotlib, which is not installed") from error
    return pyplot.figure(layout="constrained").add_subplot()


def _bars(axes: Any, names: Sequence[str], values: Sequence[float], label: str) -> Any:
    axes = _axes(axes)
    axes.barh(range(len(names)), values)
    axes.set_yticks(range(len(names)), names)
    axes.invert_yaxis()
    axes.set_xlabel(label)
    return axes


def sigmas(found: Any, axes: Any) -> Any:
    """Values of a result less those of the type's preset without errors, in sigmas."""
    errors = [i for i, name in enumerate(found.names) if "tilt" in name or "incident" in name
              or "boresight" in name or name == "range_offset"]
    return _bars(axes, [found.names[i] for i in errors],
                 [found.values[i] / found.sigmas[i] if found.sigmas[i] > 0 else 0.0
                  for i in errors], "value / sigma")


def residuals(found: Any, axes: Any) -> Any:
    """Histograms of azimuth and zenith residuals."""
    import numpy as np  # pylint: disable=import-outside-toplevel
    axes = _axes(axes)
    for name, values in (("azimuth", found.azimuth_residual), ("zenith", found.zenith_residual)):
        shown = np.degrees(values[np.isfinite(values)])
        reach = 5 * float(np.std(shown)) or 1.0
        axes.hist(1000 * shown, bins=60, range=(-1000 * reach, 1000 * reach), histtype="step",
                  label=name)
    axes.set(xlabel="observed less estimated, 0.001 degree", ylabel="shots")
    axes.legend()
    return axes


def scan(found: Any, axes: Any) -> Any:
    """Azimuth and elevation of directions; left is left."""
    import numpy as np  # pylint: disable=import-outside-toplevel
    axes = _axes(axes)
    x, y, z = found.directions.T
    axes.plot(np.degrees(np.arctan2(y, x)), np.degrees(np.arcsin(z)), ",")
    axes.set(xlabel="azimuth, degree", ylabel="elevation, degree", aspect="equal")
    axes.invert_xaxis()
    return axes


def points(found: Any, axes: Any) -> Any:
    """Points from above, coloured by their total sigma."""
    axes = _axes(axes)
    some = found[::max(1, len(found) // 20_000)]
    colour = None if some.covariance is None else 1000 * some.sigma
    dots = axes.scatter(some.xyz[:, 0], some.xyz[:, 1], c=colour, s=2)
    if colour is not None:
        axes.figure.colorbar(dots, label="total sigma, mm")
    axes.set(xlabel=f"{found.axes[0]}, m", ylabel=f"{found.axes[1]}, m", aspect="equal")
    return axes


def answer(verb: str, found: Mapping[str, Any], axes: Any) -> Any:
    """The differences of a comparison's last pair, in sigmas."""
    if verb != "compare" or not found["pairs"]:
        raise ValueError(f"a result of {verb} has no plot")
    differences = found["pairs"][-1]["differences"]
    known = {name: one["value"] / one["sigma"] for name, one in differences.items()
             if one.get("sigma")}
    return _bars(axes, list(known), list(known.values()), "difference / sigma")
