# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# %% [markdown]
# # Covariance of points
#
# How uncertain is a point, and how much of its error does it share with its neighbour? What they share does not
# average out, but it does not matter for the distance between them either.
#
#     python3 04_covariance_of_points.py [SCENE] [--folder FOLDER]

# %%
import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

import risley

try:
    from matplotlib import pyplot
except ImportError:  # there are no pictures then
    pyplot = None

here = Path(__file__).parent if "__file__" in globals() else Path.cwd()
parser = argparse.ArgumentParser(description="Reads the covariance of points from a cloud.")
parser.add_argument("scene", nargs="?", default=here / "../../data/hall.yaml", help="walls (data/hall.yaml)")
parser.add_argument("--folder", help="for the results; otherwise a temporary one")
options = parser.parse_args([] if "ipykernel" in sys.modules else None)
folder = Path(options.folder or tempfile.mkdtemp(prefix="risley-"))
folder.mkdir(parents=True, exist_ok=True)

# %% [markdown]
# One second of a unit in a hall, calibrated on its walls. With `common_factors` every point carries what one standard
# deviation of each error of the calibration moves it by.

# %%
hall, calibration = folder / "hall.lvx", folder / "calibration"
risley.simulate(hall, sensor="mid-40-table3", reported_nominal=True, scene=options.scene, duration=1.0, seed=1)
risley.calibrate(hall, output=calibration)
made = risley.cloud(hall, calibration / "calibration.yaml", folder / "hall.npy", common_factors=True)
factors = made.to_dict()["common_factors"]
print(f"{made.points} points, {len(factors)} common factors")

# %% [markdown]
# The file is a NumPy array with named fields. The total sigma of a point is the root of the sum of its variances.

# %%
points = np.load(folder / "hall.npy")
total = np.sqrt(points["VarianceX"] + points["VarianceY"] + points["VarianceZ"])
for low, high in ((1, 5), (5, 10), (10, 20), (20, 35)):
    some = total[(points["LidarRange"] >= low) & (points["LidarRange"] < high)]
    print(f"{low:2} to {high:2} m: total sigma {1000 * np.median(some):.1f} mm, {len(some)} points")

# %% [markdown]
# A point on the end wall and the next shot: their covariance is the sum of the products of their loadings.

# %%
first = int(np.argmax((points["X"] > 29.5) & (abs(points["Z"]) < 1)))
a, b = points[first], points[first + 1]
loadings = [np.array([[p[f"Loading{n}{axis}"] for n in range(1, len(factors) + 1)] for axis in "XYZ"], float)
            for p in (a, b)]
shared = loadings[0] @ loadings[1].T
print(f"{1000 * np.linalg.norm([a[axis] - b[axis] for axis in 'XYZ']):.0f} mm apart")
for n, axis in enumerate("XYZ"):
    correlation = shared[n, n] / (a[f"Std{axis}"] * b[f"Std{axis}"])
    print(f"{axis}: sigma {1000 * a[f'Std{axis}']:.2f} mm, of it shared {1000 * np.sqrt(shared[n, n]):.3f} mm, "
          f"correlation {correlation:.4f}")

# %%
if pyplot:
    some = points[::50]
    figure, axes = pyplot.subplots(figsize=(6, 3), layout="constrained")
    dots = axes.scatter(some["X"], some["Y"], c=1000 * total[::50], s=2)
    figure.colorbar(dots, label="total sigma, mm")
    axes.set(xlabel="ahead, m", ylabel="left, m", aspect="equal")
    figure.savefig(folder / "cloud.png", dpi=80)
