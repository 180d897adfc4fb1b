# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Observation model and inverse over arrays, trains and sensors."""
import copy
import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import risley

TRAIN = risley.PrismTrain()
ERROR = st.floats(-0.005, 0.005)


@st.composite
def trains(draw):
    train = risley.PrismTrain(draw(st.sampled_from(["PA-AP", "AP-PA", "PA-PA"])))
    train["wedge_angle_a"] = draw(st.floats(0.2, 0.33))
    train["wedge_angle_b"] = draw(st.floats(0.2, 0.33))
    train["refractive_index"] = draw(st.floats(1.45, 1.55))
    for name in train.names:
        if "tilt" in name or name.startswith("incident_beam"):
            train[name] = draw(ERROR)
    return train


@settings(max_examples=15, deadline=None, derandomize=True)
@given(trains(), st.integers(0, 2 ** 32 - 1))
def test_the_inverse_undoes_the_model(train, seed):
    angles = np.random.default_rng(seed).uniform(0, 2 * np.pi, (2, 40))
    azimuth, zenith = risley.observe(train, angles)
    found = risley.invert(train, azimuth, zenith)
    assert found.first.shape == (40, 4)
    again = risley.observe(train, [found.first, found.second])
    for reported, wanted in zip(again, (azimuth, zenith)):
        close = np.isclose(reported, wanted[:, None], rtol=0, atol=1e-7)
        assert (close == np.isfinite(found.first)).all()
    turn = np.exp(1j * found.first) - np.exp(1j * angles[0])[:, None]
    other = np.exp(1j * found.second) - np.exp(1j * angles[1])[:, None]
    assert np.median(np.nanmin(abs(turn) + abs(other), axis=1)) < 1e-6


@settings(max_examples=10, deadline=None, derandomize=True)
@given(trains())
def test_trains_are_pickled(train):
    other = pickle.loads(pickle.dumps(train))
    assert other == train and other.names == train.names
    np.testing.assert_array_equal(other.parameters, train.parameters)


@st.composite
def sensors(draw):
    sensor = risley.load_sensor(draw(st.sampled_from(risley.presets())))
    for name in sensor.train.names:
        if "tilt" in name or name.startswith("incident_beam"):
            sensor[name] = sensor[name] + draw(ERROR)
    return sensor


@settings(max_examples=15, deadline=None, derandomize=True)
@given(sensors(), st.integers(0, 2 ** 32 - 1))
def test_sensors_at_random_are_inverted_pickled_and_written(sensor, seed):
    other = pickle.loads(pickle.dumps(sensor))
    assert other == sensor == risley.Sensor.from_text(sensor.to_text())
    assert other.parameters == sensor.parameters
    angles = np.random.default_rng(seed).uniform(0, 2 * np.pi, (sensor.train.prisms, 40))
    reported = risley.observe(sensor, angles)
    for one, two in zip(reported, risley.observe(other, angles)):
        np.testing.assert_array_equal(one, two)
    if sensor.train.prisms != 2:
        return
    found = risley.invert(sensor, *reported)
    assert (found.count > 0).all()
    for again, wanted in zip(risley.observe(sensor, [found.first, found.second]), reported):
        close = np.isclose(again, wanted[:, None], rtol=0, atol=1e-7)
        assert (close == np.isfinite(found.first)).all()


@settings(max_examples=20, deadline=None, derandomize=True)
@given(sensors(), st.data())
def test_nan_stays_where_it_is(sensor, data):
    prisms, rows = sensor.train.prisms, data.draw(st.integers(1, 40))
    angles = np.random.default_rng(rows).uniform(0, 2 * np.pi, (prisms, rows))
    whole = risley.observe(sensor, angles)
    lost = np.array(data.draw(st.lists(st.booleans(), min_size=rows, max_size=rows)))
    angles[data.draw(st.integers(0, prisms - 1)), lost] = np.nan
    for one, before in zip(risley.observe(sensor, angles), whole):
        assert np.isnan(one[lost]).all()
        np.testing.assert_array_equal(one[~lost], before[~lost])
    if prisms == 2:
        azimuth = np.where(lost, np.nan, whole.azimuth)
        found = risley.invert(sensor, azimuth, whole.zenith)
        assert (found.count[lost] == 0).all() and np.isnan(found.first[lost]).all()
        assert (found.count[~lost] > 0).all()


@settings(max_examples=30, deadline=None, derandomize=True)
@given(sensors(), st.lists(st.integers(2, 5), min_size=1, max_size=3), st.data())
def test_any_wrong_shape_is_named(sensor, shape, data):
    prisms = sensor.train.prisms
    which = data.draw(st.integers(1, prisms - 1))
    wrong = list(shape)
    wrong[data.draw(st.integers(0, len(shape) - 1))] += 1
    angles = [np.zeros(shape) for _ in range(prisms)]
    angles[which] = np.zeros(wrong)
    words = "(" + ", ".join(map(str, wrong)) + (",)" if len(wrong) == 1 else ")")
    with pytest.raises(ValueError) as error:
        risley.observe(sensor, angles)
    assert f"angles[{which}] has the shape {words}" in str(error.value)
    with pytest.raises(ValueError, match=f"angles has {prisms + 1} values, expected {prisms}"):
        risley.observe(sensor, [np.zeros(shape)] * (prisms + 1))


def test_shapes_broadcast():
    a, b = np.linspace(0, 1, 3), np.linspace(2, 5, 4)
    grid = risley.observe(TRAIN, [a[:, None], b])
    assert grid.azimuth.shape == grid.zenith.shape == (3, 4)
    one = risley.observe(TRAIN, (a[1], b[2]))
    assert np.ndim(one.azimuth) == 0 and one.azimuth == grid.azimuth[1, 2]
    stacked = risley.observe(TRAIN, np.stack([np.tile(a, 2), np.tile(a, 2)]))
    assert stacked.zenith.shape == (6,)
    assert risley.observe(TRAIN, [[], []]).azimuth.shape == (0,)
    assert risley.observe(TRAIN, [a.astype(np.float32)[::2], 1]).azimuth.shape == (2,)
    assert risley.invert(TRAIN, 0.05, np.full((2, 3), 1.5)).first.shape == (2, 3, 4)


def test_nan_stays_nan():
    azimuth, zenith = risley.observe(TRAIN, [[0.1, np.nan, 0.3], 0.2])
    assert np.isnan(azimuth).tolist() == np.isnan(zenith).tolist() == [False, True, False]
    found = risley.invert(TRAIN, [0.05, np.nan], [1.5, 1.5])
    assert found.count.tolist() == [2, 0] and np.isnan(found.first[1]).all()


def test_results_may_be_given():
    angles = np.linspace(0, 1, 10), np.linspace(1, 3, 10)
    azimuth, zenith = np.empty(10), np.empty(10)
    given_back = risley.observe(TRAIN, angles, out=(azimuth, zenith))
    assert given_back.azimuth is azimuth
    np.testing.assert_array_equal(azimuth, risley.observe(TRAIN, angles).azimuth)
    with pytest.raises(ValueError, match=r"out\[1\] has the shape \(9,\), expected \(10,\)"):
        risley.observe(TRAIN, angles, out=(azimuth, np.empty(9)))


@pytest.mark.parametrize("angles, beam, error, words", [
    ([np.zeros(3), np.zeros(4)], None, ValueError,
     r"angles\[1\] has the shape \(4,\), which does not fit \(3,\)"),
    ([np.zeros(3)], None, ValueError, "angles has 1 values, expected 2"),
    ([np.zeros(3), "north"], None, TypeError, r"angles\[1\] has the type <U5, expected numbers"),
    ([np.zeros(3), None], None, TypeError, r"angles\[1\] has the type object"),
    ([np.zeros(3), np.zeros(3)], [0, 0], ValueError, r"beam has the shape \(2,\)"),
    ([np.zeros(3), np.zeros(3)], [0, 0, 1], ValueError, "beam = 1 in row 2, allowed 0 to 0"),
    ([np.zeros(3), np.zeros(3)], 0.5, TypeError, "beam has the type float64"),
])
def test_wrong_shapes_are_named(angles, beam, error, words):
    with pytest.raises(error, match=words):
        risley.observe(TRAIN, angles, beam=beam)


def test_derivatives_are_slopes():
    train = risley.PrismTrain()
    angles = [np.array([0.4, 2.0]), np.array([1.0, 5.0])]
    line = risley.linearise(train, angles)
    assert line.d_azimuth.shape == (len(train.parameters) + 2, 2)
    step = 1e-6
    moved = risley.observe(train, [angles[0] + step, angles[1]])
    np.testing.assert_allclose(line.d_zenith[-2], (moved.zenith - line.zenith) / step, rtol=1e-4)


def test_rays_of_a_sensor_leave_its_last_prism():
    sensor = risley.load_sensor("mid-40")
    angles = np.zeros((2, 5)) + 0.3
    (x, y, z), direction = risley.rays(sensor, angles)
    azimuth, zenith = risley.observe(sensor, angles)
    np.testing.assert_allclose(direction[2], np.cos(zenith), atol=1e-12)
    assert (np.hypot(y, z) > 1e-4).all() == (np.max(sensor.prism_thickness, initial=0) > 0)
    assert not np.any(risley.rays(sensor.train, angles).origin)
    assert x.shape == (5,) and azimuth.shape == (5,)


def test_names_say_their_unit():
    train = risley.PrismTrain("PA-AP-AP")
    assert train.prisms == 3
    train["wedge_angle_b_deg"] = 17.5
    assert train["wedge_angle_b"] == math.radians(17.5)
    assert train["wedge_angle_b_deg"] == 17.5
    with pytest.raises(ValueError, match="wedge_angle_z"):
        train["wedge_angle_z"] = 1
    with pytest.raises(ValueError, match="wedge_angle"):
        train["wedge_angle"] = 90
    assert copy.deepcopy(train) == train != risley.PrismTrain()


def test_sensors(tmp_path):
    assert "mid-40" in risley.presets()
    for name in risley.presets():
        sensor = risley.load_sensor(name)
        other = pickle.loads(pickle.dumps(sensor))
        assert other == sensor and other.parameters == sensor.parameters
    sensor = risley.load_sensor("mid-40")
    sensor["wedge_angle_a_deg"] = 17.9
    sensor.write(tmp_path / "own.yaml")
    assert risley.load_sensor(tmp_path / "own.yaml") == sensor
    assert sensor.covariance.shape == (0, 0) and sensor.covariance_names == []
    assert sensor.angle_noise > 0 and sensor.angular_velocity.shape == (2,)
    with pytest.raises(ValueError, match="mid-41"):
        risley.load_sensor("mid-41")
    with pytest.raises(risley.FileError, match="line"):
        risley.Sensor.from_text("risley_preset: 1\nname: x\ncolour: red\n")
