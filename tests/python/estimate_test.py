# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""An estimate from Python: numbers, page, interrupts, exceptions, and the end of the interpreter."""
import os
import pathlib
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import risley
from scans import scan

SCENE = pathlib.Path(os.environ["RISLEY_SOURCE_DIR"]) / "data" / "room.yaml"


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    name = tmp_path_factory.mktemp("estimates") / "scan.nc"
    risley.write(scan(), name)
    return name


@pytest.fixture(scope="module")
def result(path):
    return risley.estimate(path, rate=4000)


def test_numbers_have_names_units_and_sigmas(result):
    assert len(result.names) == len(result.units) == len(result.values) == len(result.sigmas)
    assert "angular_velocity_a" in result.names and set(result.units) == {"1", "rad", "rad/s"}
    assert result.covariance.shape == (len(result.free), len(result.free))
    speeds = risley.load_sensor("mid-40")
    at = result.names.index("angular_velocity_a")
    assert abs(result.values[at] - speeds["angular_velocity_a"]) < 0.01
    assert result.azimuth_residual.ndim == 1 and result.azimuth_residual.flags.writeable
    assert 0.5e-4 < np.nanstd(result.zenith_residual) < 2e-4
    code, words, to_do = result.verdict
    assert code in ("consistent", "unusual", "inconsistent", "undecided") and words and to_do
    html = result._repr_html_()
    assert code in html and "<td>angular_velocity_a_deg_per_s</td>" in html


def test_a_page_is_written(result, tmp_path):
    result.report(tmp_path / "page.html")
    assert "<html" in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_the_calibrated_sensor_is_a_preset(result, tmp_path):
    result.sensor.write(tmp_path / "calibration.yaml")
    assert risley.load_sensor(tmp_path / "calibration.yaml") == result.sensor
    assert risley.load_sensor(tmp_path) == result.sensor  # the folder of a result


@pytest.mark.parametrize("options, words", [
    ({"method": "guess"}, "method = 'guess'"),
    ({"rate": 0}, "rate = 0"),
    ({"noise_angle": 1e-4, "noise_angle_deg": 0.01}, "noise_angle and noise_angle_deg"),
    ({"fix": ["colour"]}, "colour"),
    ({"fix": {"wedge_angle_a_deg": 90}}, "wedge_angle_a"),
    ({"threads": -1}, "threads = -1"),
    ({"sensor": "mid-41"}, "mid-41"),
])
def test_wrong_options_are_named(path, options, words):
    with pytest.raises(ValueError, match=words):
        risley.estimate(path, **options)


def test_too_few_shots_cannot_answer(tmp_path):
    risley.write(scan(0.0005), tmp_path / "short.nc")
    with pytest.raises(risley.EstimationError):
        risley.estimate(tmp_path / "short.nc", sensor="mid-40")


def test_an_exception_in_the_callback_stops_the_job(path):
    class Enough(Exception):
        pass

    def tell(name, fraction):
        raise Enough(name)

    started = time.process_time()
    with pytest.raises(Enough):
        risley.estimate(path, rate="full", progress=tell)
    assert time.process_time() - started < 10


CHILD = """
import sys, threading, time, risley
def tell(name, fraction):
    print(name, flush=True)
def run():
    risley.estimate(sys.argv[1], rate="full", progress=tell)
"""


def child(path, rest):
    return subprocess.Popen([sys.executable, "-c", CHILD + rest, str(path)], text=True,
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE)


@pytest.fixture(scope="module")
def long_path(tmp_path_factory):
    name = tmp_path_factory.mktemp("estimates") / "long.nc"
    risley.write(scan(10.0), name)
    return name


def test_an_interrupt_stops_the_job(long_path):
    process = child(long_path, "run()")
    process.stdout.readline()
    sent = time.monotonic()
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert errors.rstrip().endswith("KeyboardInterrupt")
    assert process.returncode in (-signal.SIGINT, 130)
    assert time.monotonic() - sent < 5  # a second on a machine that does nothing else


def test_the_interpreter_ends_while_a_job_runs(long_path):
    process = child(long_path, """
def observe():
    train = risley.PrismTrain()
    while True:
        risley.observe(train, [[0.1] * 10000, 0.2])
for target in (run, observe):
    threading.Thread(target=target, daemon=True).start()
time.sleep(1.5)
""")
    _, errors = process.communicate(timeout=120)
    assert process.returncode == 0, errors
    assert "terminate" not in errors and "Fatal" not in errors


def test_the_interpreter_ends_while_recordings_are_read_and_made(long_path, tmp_path):
    process = child(long_path, f"""
def read():
    while True:
        for piece in risley.read_chunks(sys.argv[1], rows=1000):
            piece.azimuth.sum()
def simulate():
    risley.simulate({str(tmp_path / "made.nc")!r}, duration=1000.0)
for target in (read, read, simulate):
    threading.Thread(target=target, daemon=True).start()
time.sleep(1.0)
""")
    _, errors = process.communicate(timeout=120)
    assert process.returncode == 0, errors
    assert "terminate" not in errors and "Fatal" not in errors


def test_threads_make_their_first_arrays_at_a_time(long_path):
    process = child(long_path, """
def read():
    for piece in risley.read_chunks(sys.argv[1], rows=1000):
        piece.azimuth.sum()
threads = [threading.Thread(target=read) for _ in range(4)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
""")
    _, errors = process.communicate(timeout=120)
    assert process.returncode == 0, errors


def test_without_memory_no_number_of_threads_ends_the_interpreter(tmp_path):
    path = tmp_path / "scan.lvx"  # HDF5 has words of its own
    risley.simulate(path, duration=2.0, scene=SCENE)
    process = child(path, """
import resource
def has(megabytes, threads):
    with open("/proc/self/statm") as file:
        used = int(file.read().split()[0]) * resource.getpagesize()
    limits = (used + (megabytes << 20), resource.RLIM_INFINITY)
    resource.setrlimit(resource.RLIMIT_AS, limits)
    try:
        risley.estimate(sys.argv[1], threads=threads)
        return True
    except (MemoryError, RuntimeError):  # the latter where a thread has no room for its stack
        return False
print([has(megabytes, threads) for megabytes in (16, 24, 40) for threads in (1, 2, 0)])
""")
    words, errors = process.communicate(timeout=120)
    assert process.returncode == 0, errors
    assert words.startswith("[False, ")
