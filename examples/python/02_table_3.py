# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# %% [markdown]
# # Table 3 with a noise of your own
#
# Table 3 of the paper: 30 s of a Mid-40, thinned to 1000 shots a second, with 0.01 degree of noise. How large are the
# errors of the estimate, do they agree with its sigmas, and how near are they to the Cramér-Rao bound, the
# least average error of an unbiased estimator?
#
#     python3 02_table_3.py [NOISE_DEG] [--folder FOLDER]

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

parser = argparse.ArgumentParser(description="Repeats Table 3 of the paper with another noise.")
parser.add_argument("noise", nargs="?", type=float, default=0.01, help="of azimuth and zenith, degree (0.01)")
parser.add_argument("--folder", help="for the results; otherwise a temporary one")
options = parser.parse_args([] if "ipykernel" in sys.modules else None)
folder = Path(options.folder or tempfile.mkdtemp(prefix="risley-"))
folder.mkdir(parents=True, exist_ok=True)

# %%
plan = {"sensor": "mid-40-table3", "duration": 30.0, "rate": 1000.0, "noise_angle_deg": options.noise}
recording = risley.simulate(folder / "table-3.nc", seed=1, **plan)
result = risley.estimate(recording, truth=recording)
if not result.converged:
    sys.exit(f"the numbers cannot be used: {result.reason}")

# %% [markdown]
# The bound needs no data, only the plan. The held index and angles are exact in this simulation, so compare with
# the sigmas given the held values.

# %%
found, truth = result.to_dict()["parameters"], result.to_dict()["truth"]["parameters"]
bounds = risley.observability(**plan)["parameters"]
names = [name for name in truth if not name.startswith(("angular_velocity", "rotation_angle"))]
ratios = []
print(f"noise {options.noise:g} degree")
print(f"{'parameter':31}{'truth':>9}{'error':>11}{'sigma':>11}{'bound':>11}{'error/bound':>13}")
for name in names:
    error, bound = truth[name]["error"], bounds[name]["sigma"]
    ratios.append(error / bound)
    print(f"{name:31}{truth[name]['true']:9.4f}{error:11.6f}{found[name]['sigma_given_held']:11.6f}{bound:11.6f}"
          f"{ratios[-1]:13.2f}")
print(f"root mean square of error/bound: {np.sqrt(np.mean(np.square(ratios))):.2f} (about 1 over many seeds)")

# %%
if pyplot:
    figure, axes = pyplot.subplots(figsize=(6, 3), layout="constrained")
    axes.barh(names, ratios)
    axes.axvspan(-1, 1, color="0.9", zorder=0)
    axes.set(xlabel="error / Cramér-Rao bound", xlim=(-3, 3))
    axes.invert_yaxis()
    figure.savefig(folder / "errors.png", dpi=90)
