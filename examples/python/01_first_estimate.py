# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# %% [markdown]
# # First estimate
#
# What does a sensor believe about its optics? `estimate` finds the parameters from which it computed its reported
# directions. The recording is one of your own or, without one, a simulated second of a Mid-40 whose prisms are a
# little tilted.
#
#     python3 01_first_estimate.py [RECORDING] [--folder FOLDER]

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

parser = argparse.ArgumentParser(description="Estimates a sensor's parameters from a recording.")
parser.add_argument("recording", nargs="?", help="of any known format; otherwise one is simulated")
parser.add_argument("--folder", help="for the results; otherwise a temporary one")
options = parser.parse_args([] if "ipykernel" in sys.modules else None)
folder = Path(options.folder or tempfile.mkdtemp(prefix="risley-"))
folder.mkdir(parents=True, exist_ok=True)

# %%
recording = options.recording
if not recording:
    recording = risley.simulate(folder / "unit.nc", sensor="mid-40-table3", duration=1.0, seed=1)
    print(f"{recording.observations} shots simulated")

# %% [markdown]
# The estimate. The sigma is one standard deviation of all possible errors, including those of parameters that no
# recording determines, such as the wedge angles.

# %%
result = risley.estimate(recording)
print(result)
if not result.converged:
    sys.exit(f"the numbers cannot be used: {result.reason}")

# %% [markdown]
# The result can be given as `sensor` to every job, and as a file to the command. It contains the rotation angles of the
# prisms at every shot, with sigmas.

# %%
result.sensor.write(folder / "calibration.yaml")
print("written:", folder / "calibration.yaml")
angles = result.rotation_angles()
print(f"rotation angles of {len(angles.time_ns)} shots, sigma {np.degrees(np.median(angles.sigma)):.5f} degree")

# %% [markdown]
# What is left is noise and the rounding of the sensor's angles; anything else would show as a wider or lopsided hill.

# %%
if pyplot:
    figure, axes = pyplot.subplots(figsize=(5, 3), layout="constrained")
    result.plot(axes)
    figure.savefig(folder / "residuals.png", dpi=90)
