# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# %% [markdown]
# # A scan pattern for a simulator
#
# The directions of an Avia's shots, as unit vectors for a simulator with its own walls and as a file, and the share of
# the field of view that they cover after a tenth of a second, half a second and a second.
#
#     python3 05_pattern_for_a_simulator.py [SENSOR] [--folder FOLDER]

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

parser = argparse.ArgumentParser(description="Writes where a sensor sends its shots.")
parser.add_argument("sensor", nargs="?", default="avia", help="preset, or a preset or calibration file (avia)")
parser.add_argument("--folder", help="for the results; otherwise a temporary one")
options = parser.parse_args([] if "ipykernel" in sys.modules else None)
folder = Path(options.folder or tempfile.mkdtemp(prefix="risley-"))
folder.mkdir(parents=True, exist_ok=True)

# %% [markdown]
# The rays of a second, as torch or jax take them, too; `livox-csv`, `npy`, `helios-xml`, `json` and `usda` are formats
# of files.

# %%
scan = risley.pattern(options.sensor, duration=1.0, dtype="float32")
risley.pattern(options.sensor, "livox-csv", folder / "pattern.csv", duration=1.0)
x, y, z = scan.directions.T
azimuth, elevation = np.degrees(np.arctan2(y, x)), np.degrees(np.arcsin(z))
print(f"{len(scan)} shots, azimuth {azimuth.min():.2f} to {azimuth.max():.2f} degree, "
      f"elevation {elevation.min():.2f} to {elevation.max():.2f} degree")

# %% [markdown]
# Cells of half a degree with a shot count as covered; a gap is the largest circle without one.

# %%
for one in risley.coverage(options.sensor, after=[0.1, 0.5, 1.0])["after"]:
    print(f"after {one['time_s']:.1f} s: {one['shots']} shots, {100 * one['covered']:.1f} % covered, "
          f"largest gap {one['gap_deg']:.2f} degree")

# %%
if pyplot:
    figure, axes = pyplot.subplots(1, 2, figsize=(7, 3.6), sharey=True, layout="constrained")
    for one, seconds in zip(axes, (0.02, 0.1)):
        risley.pattern(options.sensor, duration=seconds).plot(one)
        one.set(title=f"{seconds:g} s")
    figure.savefig(folder / "pattern.png", dpi=90)
