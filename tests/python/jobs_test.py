# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Every job of Python gives what its verb of the command prints, to the last digit."""
import csv
import inspect
import math
import os
import pathlib
import pickle
import re
import shutil

import numpy as np
import pytest

import risley
from command import command, help_of

DATA = pathlib.Path(os.environ["RISLEY_SOURCE_DIR"]) / "data"
OF_A_RUN = {"command", "inputs", "seconds"}
FLIGHT = """risley_flight: 1
rate_hz: 200
height_m: 60
speed_m_per_s: 5
turn_duration_s: 10
strips: [{headings_deg: [90, 270, 0, 180], length_m: 55}]
"""


def with_names_of_python(value):
    """Where Python says "shot_rate", the command says "--shot-rate-hz"."""
    if isinstance(value, dict):
        return {key: with_names_of_python(one) for key, one in value.items()}
    if isinstance(value, list):
        return [with_names_of_python(one) for one in value]
    if not isinstance(value, str):
        return value
    return re.sub(r"--([a-z]+(?:-[a-z]+)*)",
                  lambda flag: re.sub("-(deg|hz|m|s)$", "", flag[1]).replace("-", "_"), value)


def assert_same(ours, theirs):
    """Every key and every number is alike, except what belongs to a run."""
    ours, theirs = ({key: with_names_of_python(value) for key, value in one.items()
                     if key not in OF_A_RUN} for one in (ours, theirs))
    assert ours.keys() == theirs.keys()
    for key, value in ours.items():
        assert value == theirs[key], key


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("jobs")


@pytest.fixture(scope="module")
def simulation(folder):
    """A bent unit in a hall that believes itself perfect."""
    return risley.simulate(folder / "hall.nc", rate=20000.0, duration=2.0, seed=4,
                           scene=DATA / "hall.yaml", set={"prism_tilt_a_vertical_deg": 0.5},
                           reported_nominal=True)


@pytest.fixture(scope="module")
def hall(simulation):
    return simulation.files[0]


@pytest.fixture(scope="module")
def truth(hall):
    return hall + ".truth.yaml"


@pytest.fixture(scope="module")
def estimate(hall, truth):
    return risley.estimate(hall, truth=truth, rate=5000)


@pytest.fixture(scope="module")
def calibration(hall, truth):
    return risley.calibrate([hall], truth=truth, rate=5000)


def test_simulate(simulation, hall):
    before = pathlib.Path(hall).read_bytes()
    printed = command("simulate", "-o", hall, "--rate-hz", 20000, "--duration-s", 2, "--seed", 4,
                      "--scene", DATA / "hall.yaml", "--set", "prism_tilt_a_vertical_deg=0.5",
                      "--reported", "nominal")
    assert_same(simulation.to_dict(), printed)
    assert len(pathlib.Path(hall).read_bytes()) == len(before)
    assert simulation.observations == 40000 and len(simulation.files) == 3
    assert simulation.truth["prism_tilt_a_vertical_deg"] == pytest.approx(0.5)


def test_info(hall):
    assert_same(risley.info(hall), command("info", hall))


def test_estimate(estimate, hall, truth):
    assert_same(estimate.to_dict(),
                command("estimate", hall, "--truth", truth, "--rate-hz", 5000))
    held = risley.estimate(hall, rate=5000, fix={"bearing_tilt_a_horizontal": math.radians(0.1)},
                           noise_angle_deg=0.004)
    assert_same(held.to_dict(),
                command("estimate", hall, "--rate-hz", 5000, "--fix",
                        "bearing_tilt_a_horizontal_deg=0.1", "--noise-angle-deg", 0.004))
    filtered = risley.estimate(hall, method="ekf")
    assert_same(filtered.to_dict(), command("estimate", hall, "--method", "ekf"))


def test_calibrate(calibration, hall, truth):
    assert_same(calibration.to_dict(),
                command("calibrate", hall, "--truth", truth, "--rate-hz", 5000))
    code = calibration.verdict.code
    assert code == calibration.to_dict()["verdict"]["code"] == "off_within_tolerance"
    strict = risley.calibrate([hall], truth=truth, rate=5000, tolerance_deg=0.001)
    assert strict.verdict.code == "bent"
    assert strict.to_dict()["tolerance_deg"] == pytest.approx(0.001)
    assert calibration.to_dict()["tolerance_deg"] == pytest.approx(0.1)
    total = calibration.pointing_error.total_deg
    assert total.value == total["value"] > 0.01 and "pointing_error" in dir(calibration)
    with pytest.raises(AttributeError, match="no pointing, only"):
        calibration.pointing
    assert calibration.names[-1] == "range_offset" and calibration.units[-1] == "m"
    assert calibration.covariance.shape == (len(calibration.free),) * 2
    held = risley.calibrate(hall, rate=2000, fix=["refractive_index"], beam_origin=False,
                            range_offset_sigma=0.0, prior_sigma_deg=0.2)
    assert_same(held.to_dict(),
                command("calibrate", hall, "--rate-hz", 2000, "--fix", "refractive_index",
                        "--beam-origin", "no", "--range-offset-sigma-m", 0,
                        "--prior-sigma-deg", 0.2))


def test_plan():
    planned = risley.plan(DATA / "hall.yaml", duration=5.0, noise_range=0.01)
    assert_same(planned.to_dict(), command("calibrate", "--plan", DATA / "hall.yaml",
                                           "--duration-s", 5, "--noise-range-m", 0.01))
    assert np.all(planned.sigmas > 0) and "<td>" in planned._repr_html_()


def test_a_flight_planned_and_calibrated(folder):
    plan, path = folder / "flight.yaml", folder / "flight.nc"
    true_mount, mount = DATA / "mount-nadir.yaml", DATA / "mount-as-built.yaml"
    plan.write_text(FLIGHT, encoding="utf-8")
    errors = DATA / "trajectory-errors.yaml"
    planned = risley.plan(plan, rate=200.0, mount=mount, trajectory_errors=errors)
    assert_same(planned.to_dict(),
                command("calibrate", "--plan", plan, "--rate-hz", 200, "--mount", mount,
                        "--trajectory-errors", errors))
    assert "boresight_x" in planned.names and set(planned.units) >= {"rad", "m", "s"}
    assert planned.covariance.shape == (len(planned.names),) * 2
    flown = risley.simulate(path, rate=1000.0, flight=plan, mount=true_mount, seed=1,
                            scene=DATA / "village.yaml", trajectory_errors=errors)
    trajectory = flown.to_dict()["trajectory"]
    assert_same(flown.to_dict(),
                command("simulate", "-o", path, "--rate-hz", 1000, "--flight", plan,
                        "--mount", true_mount, "--seed", 1, "--scene", DATA / "village.yaml",
                        "--trajectory-errors", errors))
    found = risley.calibrate(path, trajectory=trajectory, mount=mount, trajectory_errors=errors,
                             knot_spacing=1.0, sensor="mid-40")
    assert isinstance(found, risley.FlightCalibration)
    assert_same(found.to_dict(),
                command("calibrate", path, "--trajectory", trajectory, "--mount", mount,
                        "--trajectory-errors", errors, "--knot-spacing-s", 1,
                        "--sensor", "mid-40"))
    at = found.names.index("boresight_x")
    assert found.units[at] == "rad" and found.sigmas[at] > 0
    found.report(folder / "flight.html")


def test_cloud(hall, calibration, folder):
    calibration.sensor.write(folder / "calibration.yaml")
    made = risley.cloud(hall, folder / "calibration.yaml", folder / "hall.ply",
                        common_factors=True)
    assert_same(made.to_dict(),
                command("cloud", hall, "--calibration", folder / "calibration.yaml",
                        "-o", folder / "hall.ply", "--common-factors", "yes"))
    assert made.points > 10000 and pathlib.Path(made.output).stat().st_size > 0


def test_cloud_of_stations(folder):
    scans = [folder / "gate.nc", folder / "crane.nc"]
    for seed, scan in enumerate(scans):
        risley.simulate(scan, scene=DATA / "site.yaml", station=scan.stem, seed=seed, duration=4.0)
    lines = (DATA / "site-stations.yaml").read_text(encoding="utf-8").split("  - name: ")
    stations = folder / "stations.yaml"
    stations.write_text("  - name: ".join(lines[:3]), encoding="utf-8")
    made = risley.cloud([scans[0], risley.read(scans[1])], "mid-40", folder / "site.ply", station=stations)
    written = command("cloud", *scans, "--calibration", "mid-40", "-o", folder / "site.ply", "--station", stations)
    assert made.points == written["points"] > 10000
    assert [one["position_m"] for one in made.stations] == [one["position_m"] for one in written["stations"]]
    with pytest.raises(ValueError, match="mount is not for a sensor on stations"):
        risley.cloud(scans, "mid-40", folder / "site.ply", station=stations, mount="m.yaml")


def test_identify(folder):
    scan = folder / "scan.nc"
    risley.simulate(scan, rate=20000.0, duration=1.0, seed=2)
    found = risley.identify(scan, most_prisms=2)
    assert_same(found.to_dict(), command("identify", scan, "--most-prisms", 2))
    assert found.verdict.code == "identified" and found.sensor["wedge_angle_a_deg"] > 1


def test_pattern(folder):
    written = risley.pattern("mid-70", "npy", folder / "mid-70.npy", duration=0.2)
    assert_same(written.to_dict(),
                command("pattern", "--sensor", "mid-70", "--format", "npy",
                        "-o", folder / "mid-70.npy", "--duration-s", 0.2))
    assert written.rows == len(np.load(folder / "mid-70.npy"))
    covered = risley.coverage("mid-70", after=[0.1, 0.5])
    printed = command("pattern", "--sensor", "mid-70", "--coverage", "--integration-s", "0.1,0.5")
    assert_same(covered, {**printed["coverage"], "format_version": 1,
                          "version": risley.__version__})


def test_observability(hall):
    assert_same(risley.observability(sensor="mid-70", duration=5.0),
                command("observability", "--sensor", "mid-70", "--duration-s", 5))
    assert_same(risley.observability(hall, rate=2000.0),
                command("observability", hall, "--rate-hz", 2000))


def test_compare(calibration, estimate, folder):
    calibration.sensor.write(folder / "a.yaml")
    estimate.sensor.write(folder / "b.yaml")
    assert_same(risley.compare([folder / "a.yaml", folder / "b.yaml", folder / "a.yaml"]),
                command("compare", folder / "a.yaml", folder / "b.yaml", folder / "a.yaml"))


def test_campaign(folder):
    (folder / "plan.yaml").write_text(
        "simulate: {sensor: mid-40-table3, duration_s: 0.2, rate_hz: 2000}\n"
        "estimate: {sensor: mid-40}\nseeds: {first: 1, count: 3}\n")
    results = folder / "campaign"
    part = risley.campaign(folder / "plan.yaml", results, chunk=(2, 3))
    assert (part["first"], part["cells"], part["made_before"]) == (1, 1, False)
    assert_same(risley.campaign(folder / "plan.yaml", results, chunk=(2, 3)),
                command("campaign", folder / "plan.yaml", "--chunk", "2/3", "-o", results))
    some = risley.campaign(folder / "plan.yaml", results, merge=True)
    assert some["done"] == 1 and some["missing"] == [[0, 0], [2, 2]]
    whole = risley.campaign(folder / "plan.yaml", results, threads=1)
    printed = command("campaign", folder / "plan.yaml", "-o", results)
    del printed["summary"], printed["html"]
    assert_same(whole, printed)
    with pytest.raises(ValueError, match="chunk and merge"):
        risley.campaign(folder / "plan.yaml", results, chunk=(1, 3), merge=True)
    with pytest.raises(risley.FileError, match="no chunk of a campaign"):
        risley.campaign(folder / "plan.yaml", folder / "nowhere", merge=True)


def named_alike(value, path):
    """What says which recording it was, said the same way."""
    if isinstance(value, dict):
        return {key: named_alike(one, path) for key, one in value.items()}
    if isinstance(value, list):
        return [named_alike(one, path) for one in value]
    return value.replace("recording 1 in memory", path) if isinstance(value, str) else value


def test_recordings_in_memory_give_what_their_files_give(hall, truth, estimate, calibration,
                                                         folder):
    recording = risley.read(hall)
    assert_same(risley.estimate(recording, truth=truth, rate=5000).to_dict(), estimate.to_dict())
    found = risley.calibrate(recording, truth=truth, rate=5000, output=folder / "of-memory")
    assert_same({**named_alike(found.to_dict(), hall), "calibration_written": False},
                calibration.to_dict())
    assert found.to_dict()["calibration_written"]
    assert_same(risley.info(recording), risley.info(hall))
    assert_same(risley.observability(recording, rate=2000.0),
                risley.observability(hall, rate=2000.0))
    written = (folder / "of-memory" / "calibration.yaml").read_text(encoding="utf-8")
    assert "recording 1 in memory" in written and "input_sha256" not in written
    points = [risley.cloud(one, folder / "of-memory" / "calibration.yaml", folder / name).points
              for one, name in ((recording, "memory.csv"), (hall, "file.csv"))]
    assert points[0] == points[1] > 10000
    rows = [[line for line in (folder / name).read_text(encoding="utf-8").splitlines()
             if not line.startswith("#")] for name in ("memory.csv", "file.csv")]
    assert rows[0] == rows[1]
    scan = risley.from_arrays(time_ns=recording.time_ns, azimuth=recording.azimuth,
                              zenith=recording.zenith, range=recording.range,
                              valid=recording.valid, sensor="mid-40")
    assert risley.identify(scan, most_prisms=2).verdict.code == "identified"
    with pytest.raises(ValueError, match="recording 2 in memory is given twice"):
        risley.calibrate([recording, recording])
    with pytest.raises(TypeError):
        risley.estimate(5)


def test_presets():
    listed = command("preset", "list")["presets"]
    assert [one["name"] for one in listed] == list(risley.presets())


def test_files_of_a_result(hall, folder):
    risley.calibrate([hall], rate=2000, output=folder / "result")
    names = {path.name for path in (folder / "result").iterdir()}
    assert names == {"calibration.yaml", "states.nc", "report.json", "report.html"}
    again = command("report", folder / "result", "-o", folder / "again.html")
    assert again["verb"] == "calibrate"


@pytest.mark.parametrize("name", ["estimate", "calibration"])
def test_results_are_pickled_and_drawn(name, folder, request):
    result = request.getfixturevalue(name)
    result.report(folder / "page.html")
    restored = pickle.loads(pickle.dumps(result))
    restored.report(folder / "restored.html")
    assert (folder / "page.html").read_bytes() == (folder / "restored.html").read_bytes()
    assert restored.to_dict() == result.to_dict() and restored.sensor == result.sensor
    assert restored.names == result.names and restored.verdict == result.verdict
    np.testing.assert_array_equal(restored.covariance, result.covariance)
    assert result.verdict.words.split()[0] in result._repr_html_()


def test_results_become_datasets(calibration):
    pytest.importorskip("xarray")
    data = calibration.to_xarray()
    assert float(data["sigma"].sel(name="range_offset")) == calibration.sigmas[-1]
    assert data["covariance"].shape == calibration.covariance.shape


def test_many_recordings(folder, hall):
    scans = folder / "scans" / "deep"
    scans.mkdir(parents=True)
    shutil.copy(hall, scans / "one.nc")
    risley.simulate(scans.parent / "two.lvx", scene=DATA / "room.yaml", rate=20000.0, duration=0.3, seed=2)
    (scans / "bad.lvx").write_bytes(b"no recording")
    wanted = {"output": folder / "each", "table": folder / "each.csv", "resume": True, "rate": 5000}
    found = risley.estimate_many(scans.parent, **wanted)
    assert (found.done, found.skipped, found.failed, len(found)) == (2, 0, 1, 3)
    assert [one["status"] for one in found] == [3, 0, 0]
    assert sorted(path.parent.name for path in (folder / "each").rglob("calibration.yaml")) == ["one", "two"]
    assert "bad.lvx" in str(found) and "bad.lvx" in found._repr_html_()
    alone = risley.estimate(scans / "one.nc", rate=5000).to_dict()
    assert found[1]["parameters"] == alone["parameters"]
    assert found.rows[1]["prism_tilt_a_vertical_deg"] == alone["parameters"]["prism_tilt_a_vertical_deg"]["value"]
    with open(folder / "each.csv", newline="", encoding="utf-8") as table:
        assert len(list(csv.DictReader(table))) == 3
    again = risley.estimate_many([scans / "*.nc", scans / "bad.lvx", scans.parent / "two.lvx"], **wanted)
    assert (again.done, again.skipped, again.failed) == (0, 2, 1)
    assert risley.estimate_many(scans.parent, **{**wanted, "rate": 4000}).skipped == 0
    assert [row["observations"] for row in risley.info_many(scans.parent).rows][1] == 40000
    made = risley.cloud_many([str(scans / "*.nc")], "mid-40", folder / "clouds/")
    assert made.done == 1 and (folder / "clouds/one.las").exists()
    assert risley.convert_many(scans.parent, folder / "converted", "netcdf").done == 2
    assert risley.calibrate_many([scans / "one.nc"], rate=2000)[0]["converged"]
    with pytest.raises(ValueError, match="rate = -1 Hz"):
        risley.estimate_many(scans.parent, rate=-1)
    with pytest.raises(TypeError, match="colour"):
        risley.info_many(scans.parent, colour=1)


@pytest.mark.parametrize("call, words", [
    (lambda hall: risley.calibrate(hall, method="guess"), "method = 'guess', allowed adjustment"),
    (lambda hall: risley.calibrate(hall, mount="m.yaml"), "mount is not for a calibration with no"),
    (lambda hall: risley.calibrate(hall, noise_range=0.0), "noise_range = 0 m"),
    (lambda hall: risley.calibrate(hall, planes="no.yaml"), "no.yaml"),
    (lambda hall: risley.cloud(hall, "mid-40", "x.ply", time="now"), "time = 'now', allowed gps"),
    (lambda hall: risley.cloud(hall, "mid-40", "x.xyz1"), "x.xyz1"),
    (lambda hall: risley.simulate("x.nc", set={"colour": 1.0}), "unknown parameter \"colour\""),
    (lambda hall: risley.simulate("x.nc", mount="m.yaml"), "mount needs trajectory or flight"),
    (lambda hall: risley.identify(hall, fastest=-1.0), "fastest = -1 rad/s"),
    (lambda hall: risley.pattern("mid-40", "bmp", "x.bmp"), "bmp"),
    (lambda hall: risley.plan(DATA / "hall.yaml", cell_size=2.0), "cell_size goes with a flight"),
])
def test_wrong_options_are_named(hall, call, words):
    with pytest.raises((ValueError, OSError), match=words):
        call(hall)


def test_every_setting_has_one_name():
    """The command has an option of every setting, and Python a keyword of all but the command's own."""
    header = (DATA.parent / "include/risley/core/setting.hpp").read_text(encoding="utf-8")
    flags = re.findall(r'\{"([a-z-]+)"\}', header)
    assert len(flags) > 70
    verbs = ["calibrate", "campaign", "cloud", "compare", "convert", "emulate", "estimate", "identify", "info",
             "pattern", "record", "simulate"]
    options = set()
    for verb in verbs:
        options |= set(re.findall(r"--([a-z-]+)", help_of(verb)))
    assert set(flags) - options == {"from"}  # of preset new
    keywords = {name for public in risley.__all__ if inspect.isfunction(getattr(risley, public))
                for name in inspect.signature(getattr(risley, public)).parameters}
    of_python = {"bend_s" if flag == "bend-s" else re.sub("-(deg|hz|ms|m|ppm|s)$", "", flag).replace("-", "_")
                 for flag in flags}
    assert of_python - keywords == {"from", "sensor_type"}


def test_a_wrong_type_is_named(hall):
    with pytest.raises(TypeError, match="noise_range = 'loud'"):
        risley.calibrate(hall, noise_range="loud")
