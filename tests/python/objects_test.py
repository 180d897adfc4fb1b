# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Objects in and out: results, sensors, points and scans without a file between."""
import inspect
import os
import pathlib
import pickle
import re
import sys

import numpy as np
import pytest

import risley
from command import command_text, help_of

DATA = pathlib.Path(os.environ["RISLEY_SOURCE_DIR"]) / "data"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("objects")


@pytest.fixture(scope="module")
def simulation(folder):
    return risley.simulate(folder / "hall.nc", rate=20000.0, duration=2.0, seed=4,
                           scene=DATA / "hall.yaml", set={"prism_tilt_a_vertical_deg": 0.5},
                           reported_nominal=True)


@pytest.fixture(scope="module")
def recording(simulation):
    return risley.read(simulation.files[0])


@pytest.fixture(scope="module")
def estimate(recording):
    return risley.estimate(recording, rate=5000)


@pytest.fixture(scope="module")
def calibration(recording):
    return risley.calibrate(recording, rate=5000)


@pytest.fixture(scope="module")
def points(recording, calibration):
    return risley.points(recording, calibration, common_factors=True)


def test_what_is_given_in_memory_is_what_its_file_gives(simulation, recording, calibration, estimate, folder):
    file = folder / "calibration.yaml"
    calibration.sensor.write(file)
    alike = {"warnings", "parameters", "shots"}
    for given in (calibration, calibration.sensor, file, str(file)):
        found = risley.estimate(simulation, sensor=given, truth=simulation, rate=2000).to_dict()
        first = locals().get("first", found)
        assert {key: found[key] for key in alike & set(found)} == {key: first[key] for key in alike & set(found)}
    pairs = [risley.compare(results)["pairs"] for results in
             ([calibration, calibration.sensor], [file, file])]
    assert pairs[0][0]["differences"] == pairs[1][0]["differences"]
    assert pairs[0][0]["a"] == "result 1 in memory"
    np.testing.assert_array_equal(risley.pattern(calibration, duration=0.01).directions,
                                  risley.pattern(file, duration=0.01).directions)
    assert risley.coverage(estimate, after=[0.1])["after"]
    assert risley.observability(sensor=calibration, duration=1.0)["parameters"]
    made = risley.cloud(recording, calibration, folder / "memory.csv")
    assert made.to_dict()["calibration"]["path"] == "calibration in memory"
    risley.simulate(folder / "again.nc", sensor=calibration, duration=0.01)
    with pytest.raises(TypeError, match="calibration"):
        risley.points(recording, 5)


def test_a_flight_in_memory(folder):
    plan = folder / "flight.yaml"
    plan.write_text("risley_flight: 1\nrate_hz: 200\nheight_m: 60\nspeed_m_per_s: 5\nturn_duration_s: 10\n"
                    "strips: [{headings_deg: [90, 270, 0, 180], length_m: 55}]\n", encoding="utf-8")
    mount = risley.load_mount(DATA / "mount-as-built.yaml")
    errors = DATA / "trajectory-errors.yaml"
    flown = risley.simulate(folder / "flight.nc", rate=1000.0, flight=plan, seed=1, scene=DATA / "village.yaml",
                            mount=risley.load_mount(DATA / "mount-nadir.yaml"), trajectory_errors=errors)
    trajectory = risley.load_trajectory(flown.trajectory)
    wanted = {"trajectory_errors": errors, "knot_spacing": 1.0, "sensor": "mid-40"}
    by_file = risley.calibrate(flown, trajectory=flown, mount=DATA / "mount-as-built.yaml", **wanted)
    found = risley.calibrate(flown, trajectory=trajectory, mount=mount, **wanted)
    np.testing.assert_array_equal(found.values, by_file.values)
    assert found.mount.boresight.shape == (3,) and len(found.corrected_trajectory) == len(trajectory)
    points = risley.points(flown, found, mount=found, trajectory=found, trajectory_errors=errors)
    assert points.strip.max() >= 1 and np.isfinite(points.xyz).all()
    for one in (mount, found):
        assert pickle.loads(pickle.dumps(one)).__class__ is type(one)
    assert pickle.loads(pickle.dumps(mount)) == mount
    again = pickle.loads(pickle.dumps(trajectory))
    for column in ("time_ns", "position", "attitude", "velocity"):
        np.testing.assert_array_equal(getattr(again, column), getattr(trajectory, column))
    made = risley.Trajectory.from_arrays(again.time_ns, again.position, again.attitude)
    assert len(made) == len(trajectory) and made.frame == "local"
    with pytest.raises(ValueError, match=r"attitude has the shape"):
        risley.Trajectory.from_arrays(again.time_ns, again.position, again.position)


def test_a_mount_has_the_numbers_of_its_file():
    text = (DATA / "mount-nadir.yaml").read_text(encoding="utf-8")
    for number in range(1, 8):
        text = text.replace("sigma: 0,", f"sigma: 0.{number},", 1)
    mount = risley.Mount.from_text(text)
    np.testing.assert_allclose(np.degrees(mount.boresight), [0.8, -0.5, 0.3])
    np.testing.assert_allclose(np.degrees(mount.boresight_sigma), [0.1, 0.2, 0.3])
    np.testing.assert_allclose(mount.lever_arm, [0.1, 0.05, 0.12])
    np.testing.assert_allclose(mount.lever_arm_sigma, [0.4, 0.5, 0.6])
    assert (mount.clock_offset, mount.clock_offset_sigma) == (0.0012, 0.7)


def test_points_are_those_of_the_cloud(recording, calibration, points, folder):
    risley.cloud(recording, calibration, folder / "hall.npy", common_factors=True)
    cloud = np.load(folder / "hall.npy")
    assert len(points) == len(cloud) == points.found["points"]
    np.testing.assert_array_equal(points.xyz, np.stack([cloud["X"], cloud["Y"], cloud["Z"]], 1))
    np.testing.assert_array_equal(points.covariance[:, 0, 1].astype(np.float32), cloud["CovarianceXY"])
    np.testing.assert_array_equal(points.covariance[:, 2, 2].astype(np.float32), cloud["VarianceZ"])
    np.testing.assert_array_equal(points.intensity, cloud["Intensity"])
    np.testing.assert_array_equal(points.range.astype(np.float32), cloud["LidarRange"])
    np.testing.assert_array_equal(points.loading[:, 1, 2].astype(np.float32), cloud["Loading2Z"])
    np.testing.assert_array_equal(points.covariance, points.covariance.transpose(0, 2, 1))
    shared = np.einsum("nfi,nfj->nij", points.loading, points.loading)
    np.testing.assert_allclose(points.own_covariance + shared, points.covariance, rtol=1e-9, atol=1e-15)
    assert np.linalg.eigvalsh(points.own_covariance).min() > 0
    assert points.rotation_angle.shape == (len(points), 2) and points.emitter.dtype == np.uint8
    assert points.loading.shape[1] == len(points.found["common_factors"])
    bare = risley.points(recording, "mid-40", directions="reported", beam_origin=False, covariance=False)
    assert bare.covariance is None and bare.own_covariance is None and bare.rotation_angle is None


def test_chunks_of_points_are_all_points(recording, calibration, points):
    chunks = list(risley.point_chunks(recording, calibration, rows=1000, common_factors=True))
    for name in ("xyz", "covariance", "own_covariance", "loading", "time_ns", "emitter"):
        np.testing.assert_array_equal(np.concatenate([getattr(one, name) for one in chunks]),
                                      getattr(points, name))
    with pytest.raises(TypeError, match="did you mean noise_angle"):
        risley.point_chunks(recording, calibration, noise_angl=1.0)
    unfinished = risley.point_chunks(recording, calibration, rows=1)
    assert len(next(unfinished)) > 0
    unfinished.close()


def test_arrays_are_passed_on_without_a_copy(points, recording):
    for array in (points.xyz, points.covariance, points.range, recording.xyz,
                  risley.pattern("mid-40", duration=0.01, dtype="float32").directions):
        assert array.flags.writeable and array.flags.c_contiguous
        passed = np.from_dlpack(array)
        assert passed.__array_interface__["data"][0] == array.__array_interface__["data"][0]


def test_rotation_angles_of_an_estimate(estimate, recording):
    shots = estimate.rotation_angles()
    assert shots.angle.shape == shots.sigma.shape == (len(shots.time_ns), 2)
    assert shots.covariance.shape == (len(shots.time_ns), 2, 2) and np.all(shots.sigma > 0)
    azimuth, zenith = risley.observe(estimate.sensor, shots.angle.T)
    used = np.searchsorted(recording.time_ns, shots.time_ns)
    np.testing.assert_allclose(recording.azimuth[used] - azimuth, estimate.azimuth_residual, atol=1e-9)
    np.testing.assert_allclose(recording.zenith[used] - zenith, estimate.zenith_residual, atol=1e-9)
    again = estimate.rotation_angles(shots.time_ns[::7])
    np.testing.assert_allclose(again.angle, shots.angle[::7], atol=1e-4)
    assert np.isnan(estimate.rotation_angles([-10**12]).angle).all() and again.outlier is None
    restored = pickle.loads(pickle.dumps(estimate)).rotation_angles()
    np.testing.assert_array_equal(restored.angle, shots.angle)
    np.testing.assert_array_equal(restored.covariance, shots.covariance)


def test_recordings_are_sliced_masked_and_pickled(recording):
    some, far = recording[10:1000:3], recording[recording.range > 10]
    np.testing.assert_array_equal(some.azimuth, recording.azimuth[10:1000:3])
    np.testing.assert_array_equal(far.range, recording.range[recording.range > 10])
    assert len(recording[5]) == 1 and len(recording[[1, 2]]) == 2
    with pytest.raises(IndexError):
        recording[np.ones(3, bool)]
    found = recording.range > 0
    np.testing.assert_allclose(np.linalg.norm(recording.xyz, axis=1)[found], recording.range[found])
    assert np.isnan(recording.xyz[~found]).all()
    np.testing.assert_array_equal(recording.emitter, recording.beam)
    restored = pickle.loads(pickle.dumps(far))
    for name in ("time_ns", "azimuth", "range", "azimuth_resolution", "valid"):
        np.testing.assert_array_equal(getattr(restored, name), getattr(far, name))
    assert restored.header.devices[0].serial == far.header.devices[0].serial
    assert len(risley.points(far, "mid-40", directions="reported")) == len(far)


@pytest.mark.parametrize("sensor", ["mid-40", "mid-360", "avia", "mid-40-sequence"])
def test_scans_are_arrays(sensor, folder):
    if sensor not in risley.presets():
        pytest.skip(f"no preset {sensor}")
    exact = risley.pattern(sensor, duration=0.05)
    single = risley.pattern(sensor, duration=0.05, dtype="float32")
    assert exact.directions.dtype == np.float64 and single.directions.dtype == np.float32
    np.testing.assert_allclose(single.directions, exact.directions, atol=3e-6)
    np.testing.assert_allclose(np.linalg.norm(exact.directions, axis=1), 1, atol=1e-12)
    risley.pattern(sensor, "npy", folder / "scan.npy", duration=0.05)
    azimuth, elevation = np.load(folder / "scan.npy").T
    np.testing.assert_allclose(np.arctan2(exact.directions[:, 1], exact.directions[:, 0]), azimuth, atol=1e-6)
    np.testing.assert_allclose(np.arcsin(exact.directions[:, 2]), elevation, atol=1e-6)
    later = risley.pattern(sensor, start=0.02, duration=0.03, every=3)
    whole = risley.pattern(sensor, duration=0.05, every=3)
    np.testing.assert_array_equal(later.directions, whole.directions[-len(later):])
    np.testing.assert_array_equal(later.time, whole.time[-len(later):])
    np.testing.assert_array_equal(later.emitter, whole.emitter[-len(later):])
    fast = risley.pattern(sensor, start=0.02, duration=0.03, every=3, dtype="float32")
    np.testing.assert_allclose(fast.directions, later.directions, atol=3e-6)
    with pytest.raises(ValueError, match="goes with output"):
        risley.pattern(sensor, "npy")


def test_unknown_keywords_have_a_suggestion(recording):
    for call, nearest in ((lambda: risley.estimate(recording, noise_angl=1.0), "noise_angle"),
                          (lambda: risley.calibrate(recording, noise_range_m=1.0), "noise_range"),
                          (lambda: risley.cloud_many([], "mid-40", "x", las_scal=1.0), "las_scale")):
        with pytest.raises(TypeError, match=f"did you mean {nearest}"):
            call()


def test_every_option_of_the_command_is_a_keyword():
    """Under its own name, without the unit that it ends in."""
    of_the_command = {"help", "help-all", "no-progress", "json", "quiet", "verbose", "report", "no-report", "plan", "list", "resume", "table",
                      "every-device", "coverage", "integration-s", "cell-deg", "beam-origin-map", "share", "share-ranges"}
    for verb in ("estimate", "calibrate", "cloud", "simulate", "identify", "pattern", "observability", "compare",
                 "campaign", "info"):
        options = set(re.findall(r"^ +(?:-\w, ?)?--([a-z-]+)", help_of(verb), re.MULTILINE)) - of_the_command
        keywords = set(inspect.signature(getattr(risley, verb)).parameters)
        if verb == "calibrate":
            keywords |= set(inspect.signature(risley.plan).parameters)
        names = {re.sub("^no-|-(deg|hz|m|s|ppm)$", "", option).replace("-", "_") for option in options}
        of_a_run = {"threads", "seed", "resume", "table", "list"}  # every verb takes them
        if verb == "compare":
            of_a_run.add("output")  # a page
        assert names - of_a_run <= keywords, verb


def test_results_show_themselves(estimate, calibration, points, recording, folder):
    scan, compared = risley.pattern("mid-40", duration=0.01), risley.compare([estimate, estimate])
    made = risley.cloud(recording, calibration, folder / "shown.ply")
    for one in (estimate, calibration, points, scan, compared, made, risley.plan(DATA / "hall.yaml")):
        assert "\n" not in repr(one) and " object at 0x" not in repr(one) and len(repr(one)) < 200
        assert len(str(one).splitlines()) > 2 and one.summary()
        assert one._repr_html_().startswith("<")
        assert pickle.loads(pickle.dumps(one)).summary() == one.summary()
    assert calibration.verdict.code in repr(calibration)
    printed = command_text("estimate", folder / "hall.nc", "--rate-hz", 5000).splitlines()
    assert set(str(risley.estimate(folder / "hall.nc", rate=5000)).splitlines()[2:]) <= set(printed)
    assert "prism_tilt_a_vertical_deg" in str(calibration) and calibration.verdict.words in calibration.summary()
    assert isinstance(compared, dict) and compared.pairs[0].differences
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    for one in (estimate, calibration, points, scan, compared):
        assert one.plot().has_data()
    pyplot.close("all")


def test_a_comparison_draws_its_last_pair():
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    pairs = [{"differences": {"a": {"value": 1.0, "sigma": 1.0}}},
             {"differences": {"a": {"value": 6.0, "sigma": 2.0}, "held": {"value": 1.0, "sigma": 0.0}}}]
    axes = risley._plots.answer("compare", {"pairs": pairs}, None)
    assert [bar.get_width() for bar in axes.patches] == [3.0]
    pyplot.close("all")


def test_missing_packages_are_named(recording, calibration, points, monkeypatch):
    for name in ("xarray", "pandas"):
        monkeypatch.setitem(sys.modules, name, None)
        for one in (recording, calibration, points):
            with pytest.raises(ImportError, match=f"to_{name}\\(\\) needs {name}"):
                getattr(one, f"to_{name}")()
