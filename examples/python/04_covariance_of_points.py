# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# %% [markdown]
# # Covariance of points
#
# How uncertain is a point, and how much of its error does it share with its neighbour? The shared part does not
# average out, but it does not affect the distance between them either.
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
parser = argparse.ArgumentParser(description="Shows the covariance of points.")
parser.add_argument("scene", nargs="?", default=here / "../../data/hall.yaml", help="walls (data/hall.yaml)")
parser.add_argument("--folder", help="for the results; otherwise a temporary one")
options = parser.parse_args([] if "ipykernel" in sys.modules else None)
folder = Path(options.folder or tempfile.mkdtemp(prefix="risley-"))
folder.mkdir(parents=True, exist_ok=True)

# %% [markdown]
# One second of a unit in a hall, calibrated on its walls. With `common_factors`, every point carries its
# displacement by one standard deviation of each calibration error.

# %%
hall = risley.simulate(folder / "hall.lvx", sensor="mid-40-table3", reported_nominal=True, scene=options.scene,
                       duration=1.0, seed=1)
points = risley.points(hall, risley.calibrate(hall), common_factors=True)
print(f"{len(points)} points, {points.loading.shape[1]} common factors")

# %% [markdown]
# The total sigma of a point is the root of the sum of its variances.

# %%
for low, high in ((1, 5), (5, 10), (10, 20), (20, 35)):
    some = points.sigma[(points.range >= low) & (points.range < high)]
    print(f"{low:2} to {high:2} m: total sigma {1000 * np.median(some):.1f} mm, {len(some)} points")

# %% [markdown]
# A point on the end wall and the next shot: their covariance is the sum of the products of their loadings.

# %%
a = int(np.argmax((points.xyz[:, 0] > 29.5) & (abs(points.xyz[:, 2]) < 1)))
b = a + 1
shared = points.loading[a].T @ points.loading[b]
sigma = [np.sqrt(points.covariance[i].diagonal()) for i in (a, b)]
print(f"{1000 * np.linalg.norm(points.xyz[a] - points.xyz[b]):.0f} mm apart")
for n, axis in enumerate("XYZ"):
    print(f"{axis}: sigma {1000 * sigma[0][n]:.2f} mm, of it shared {1000 * np.sqrt(shared[n, n]):.3f} mm, "
          f"correlation {shared[n, n] / (sigma[0][n] * sigma[1][n]):.4f}")

# %%
if pyplot:
    figure, axes = pyplot.subplots(figsize=(6, 3), layout="constrained")
    points[::60].plot(axes)
    figure.savefig(folder / "cloud.png", dpi=80)
