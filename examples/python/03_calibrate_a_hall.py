# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# %% [markdown]
# # Calibrate in a hall
#
# A unit is bent by 0.4 degree and does not know it: it reports directions as if it were perfect. Its own recording
# cannot show that, but five flat walls can. Nothing about them has to be measured.
#
#     python3 03_calibrate_a_hall.py [SCENE] [--folder FOLDER]

# %%
import argparse
import sys
import tempfile
from pathlib import Path

import risley

try:
    from matplotlib import pyplot
except ImportError:  # there are no pictures then
    pyplot = None

here = Path(__file__).parent if "__file__" in globals() else Path.cwd()
parser = argparse.ArgumentParser(description="Calibrates a bent unit on the walls of a hall.")
parser.add_argument("scene", nargs="?", default=here / "../../data/hall.yaml", help="walls (data/hall.yaml)")
parser.add_argument("--folder", help="for the results; otherwise a temporary one")
options = parser.parse_args([] if "ipykernel" in sys.modules else None)
folder = Path(options.folder or tempfile.mkdtemp(prefix="risley-"))
folder.mkdir(parents=True, exist_ok=True)

# %%
unit = {"sensor": "mid-40-table3", "scene": options.scene, "duration": 2.0}
bent = risley.simulate(folder / "bent.lvx", reported_nominal=True, seed=1, **unit)
found = risley.calibrate(bent, truth=bent, output=folder / "calibration")
print("before:", found)

# %% [markdown]
# The same hall and unit, now with the calibration stored in the unit: the walls confirm its parameters.

# %%
calibrated = {name: one["value"] for name, one in found.to_dict()["parameters"].items()}
corrected = risley.simulate(folder / "corrected.lvx", reported=calibrated, seed=2, **unit)
again = risley.calibrate(corrected, truth=corrected)
print("after:", again.summary())
if found.verdict.code != "bent" or again.verdict.code != "as_believed":
    sys.exit("these are not the verdicts that a bent unit should get")

# %% [markdown]
# Only a simulation knows the truth. The error of the directions has two parts: a rotation that all beams share moves
# a cloud and leaves it flat; the rest, the shape, bends it.

# %%
truth = found.to_dict()["truth"]
print(f"{'error, degree':16}{'total':>9}{'shared':>9}{'shape':>9}")
for when in ("before", "after"):
    error = truth[when]
    print(f"{when:16}{error['total_deg']:9.5f}{error['gauge_deg']:9.5f}{error['shape_deg']:9.5f}")

# %% [markdown]
# Walls are thinner afterwards where the beam meets them obliquely, because there direction errors act as range errors.

# %%
if pyplot:
    bins = [one for one in found.to_dict()["thickness"]["incidence"] if one["points"] > 500]
    degrees = [(one["from_deg"] + one["to_deg"]) / 2 for one in bins]
    figure, axes = pyplot.subplots(figsize=(5, 3), layout="constrained")
    for when in ("before", "after"):
        axes.plot(degrees, [1000 * one[f"{when}_rms_m"] for one in bins], "o", fillstyle="none", label=when)
    axes.set(xlabel="angle of incidence, degree", ylabel="distance from the wall, rms, mm", ylim=(0, None))
    axes.legend()
    figure.savefig(folder / "walls.png", dpi=90)
