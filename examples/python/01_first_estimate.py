# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# %% [markdown]
# # First estimate
#
# What does a sensor believe about its optics? A recording tells: `estimate` finds the parameters with which the sensor
# computed the directions that it reports. The recording is one of your own or, without one, a simulated second of a
# Mid-40 whose prisms are a little tilted.
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
    recording = folder / "unit.nc"
    made = risley.simulate(recording, sensor="mid-40-table3", duration=1.0, seed=1)
    print(f"{made.observations} shots simulated")

# %% [markdown]
# The estimate. `sigma` is one standard deviation of everything that may be off; `given held` leaves out what the
# parameters that no recording determines, such as the wedge angles, may be off by.

# %%
result = risley.estimate(recording)
print(f"{'parameter':27}{'value':>15}{'sigma':>11}{'given held':>12}  unit")
for name, value, sigma, given_held, unit in zip(result.names, result.values, result.sigmas,
                                                result.sigmas_given_held, result.units):
    scale = np.degrees(1) if unit.startswith("rad") else 1
    print(f"{name:27}{scale * value:15.5f}{scale * sigma:11.5f}{scale * given_held:12.6f}  "
          f"{unit.replace('rad', 'deg')}")

# %% [markdown]
# The verdict says what was found and what to do next. The calibration can be given as `sensor` to every job.

# %%
print(result.verdict.words)
print("what to do:", result.verdict.to_do)
if not result.converged:
    sys.exit(f"the numbers cannot be used: {result.reason}")
result.sensor.write(folder / "calibration.yaml")
print("written:", folder / "calibration.yaml")

# %% [markdown]
# What is left is noise and the rounding of the sensor's angles; anything else would show as a wider or lopsided hill.

# %%
if pyplot:
    figure, axes = pyplot.subplots(figsize=(5, 3), layout="constrained")
    for name, residual in (("azimuth", result.azimuth_residual), ("zenith", result.zenith_residual)):
        axes.hist(1000 * np.degrees(residual), bins=60, range=(-20, 20), histtype="step", label=name)
    axes.set(xlabel="observed less estimated, 0.001 degree", ylabel="shots")
    axes.legend()
    figure.savefig(folder / "residuals.png", dpi=90)
