# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""The model in plain numpy of docs/theory/in-numpy.md, run as it stands there, equals risley.observe."""
import contextlib
import io
import itertools
import os
import pathlib
import sys

import numpy as np
import pytest

import risley

SOURCE = pathlib.Path(os.environ["RISLEY_SOURCE_DIR"])
sys.path.insert(0, str(SOURCE / "tests/cli"))
from documents_test import blocks_of  # noqa: E402

PAGE, SHOWN, PRINTED = {}, [], io.StringIO()
with contextlib.redirect_stdout(PRINTED):
    for language, lines in blocks_of((SOURCE / "docs/theory/in-numpy.md").read_text("utf-8")):
        if language == "python":
            exec("\n".join(lines), PAGE)
        else:
            SHOWN += lines

ORDERS = ["-".join(faces) for prisms in range(1, 5)
          for faces in itertools.product(["PA", "AP"], repeat=prisms)]
RANDOM = np.random.default_rng(4722)


def random_train(face_order, emitters):
    """Every parameter off its nominal value, wedges and tilts small enough for most beams to get through."""
    train = risley.PrismTrain(face_order, emitters)
    for name in train.names:
        if name.startswith(("angular_velocity", "rotation_angle")):
            continue
        if name.startswith("wedge_angle"):
            train[name] = RANDOM.uniform(0.05, 0.3)
        elif name.startswith("refractive_index") and name != "refractive_index_air":
            train[name] = train[name] + RANDOM.uniform(-0.05, 0.05)
        else:
            train[name] = train[name] + RANDOM.uniform(-0.02, 0.02)
    return train


def assert_agrees(train, angles, reported, emitter):
    wanted = risley.observe(train, angles, beam=(emitter or 1) - 1)
    through = np.isfinite(wanted.azimuth)
    assert through.mean() > 0.5
    for one, other in zip(reported, wanted):
        np.testing.assert_array_equal(np.isfinite(one), through)
        np.testing.assert_allclose(one[through], other[through], rtol=0, atol=1e-12)


def test_the_page_prints_what_it_shows():
    assert PRINTED.getvalue().splitlines() == SHOWN


@pytest.mark.parametrize("emitters", [1, 6])
@pytest.mark.parametrize("face_order", ORDERS)
@pytest.mark.filterwarnings("ignore:invalid value")  # where a beam is totally reflected
def test_prisms(face_order, emitters):
    train = random_train(face_order, emitters)
    angles = RANDOM.uniform(0, 2 * np.pi, (train.prisms, 200))
    for emitter in range(1, emitters + 1) if emitters > 1 else [None]:
        reported = PAGE["prisms"](train, face_order, angles, emitter)
        assert_agrees(train, angles, reported, emitter)
    if face_order == "PA-AP" and emitters == 1:
        assert_agrees(train, angles, PAGE["mid_40"](train, *angles), None)


@pytest.mark.parametrize("unit", range(20))
def test_mid_360(unit):
    train = random_train("AA-PMU", 4)
    angles = RANDOM.uniform(0, 2 * np.pi, (2, 500))
    for emitter in range(1, 5):
        assert_agrees(train, angles, PAGE["mid_360"](train, *angles, emitter), emitter)


@pytest.mark.parametrize("name", risley.presets())
def test_every_preset_is_one_of_these_trains(name):
    train = risley.load_sensor(name).train
    assert train.face_order in [*ORDERS, "AA-PMU"]
