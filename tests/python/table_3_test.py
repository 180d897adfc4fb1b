# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Table 3 of the paper from Python: errors over their Cramer-Rao bounds, equal to those of C++."""

import numpy as np
import pytest

import risley
from command import command

SEEDS = 4
# Holds the root mean square of so many errors over its expected value in 999 of 1000 cases.
LEAST, GREATEST = 0.126, 2.236


def ratios(errors, bounds):
    """Errors over their bounds by name, of the parameters of the prisms."""
    return {name: one["error"] / bounds[name]["sigma"] for name, one in errors.items()
            if not name.startswith(("angular_velocity", "rotation_angle"))}


def from_python(recording, seed):
    unit = {"sensor": "mid-40-table3", "duration": 30.0, "rate": 1000.0, "noise_angle_deg": 0.01}
    risley.simulate(recording, quantize=False, rotor="sinusoidal", seed=seed, **unit)
    found = risley.estimate(recording, sensor="mid-40", noise_angle_deg=0.01, rate="full",
                            truth=f"{recording}.truth.yaml")
    assert found.converged, found.reason
    return ratios(found.to_dict()["truth"]["parameters"],
                  risley.observability(**unit)["parameters"])


def from_the_command(recording, seed):
    unit = ("--sensor", "mid-40-table3", "--duration-s", 30, "--rate-hz", 1000,
            "--noise-angle-deg", 0.01)
    command("simulate", "-o", recording, "--quantize", "no", "--rotor", "sinusoidal",
            "--seed", seed, *unit)
    found = command("estimate", recording, "--sensor", "mid-40", "--noise-angle-deg", 0.01,
                    "--rate-hz", "full", "--truth", f"{recording}.truth.yaml")
    return ratios(found["truth"]["parameters"], command("observability", *unit)["parameters"])


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    folder = tmp_path_factory.mktemp("table-3")
    return [from_python(folder / f"{seed}.nc", seed) for seed in range(SEEDS)]


def test_errors_over_bounds_are_those_of_the_command(drawn, tmp_path):
    assert drawn[0] == from_the_command(tmp_path / "unit.nc", 0) and len(drawn[0]) == 8


def test_errors_are_at_the_bounds(drawn):
    for name in drawn[0]:
        ratio = np.sqrt(np.mean([one[name] ** 2 for one in drawn]))
        assert LEAST <= ratio <= GREATEST, f"{name}: {ratio}"
