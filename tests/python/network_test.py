# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Recording a virtual sensor on loopback, both in Python."""
import logging
import os
import pathlib
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest

import risley
from command import command

DATA = pathlib.Path(os.environ["RISLEY_SOURCE_DIR"]) / "data"
HOST = "127.0.0.1"


@pytest.fixture
def sensors():
    """Starts virtual sensors, each in a thread; their truths come when all are stopped."""
    stop, threads, truths = risley.Stop(), [], []

    def start(address, **options):
        place = len(truths)
        truths.append(None)

        def run():
            truths[place] = risley.emulate(address, stop=stop, **options)

        threads.append(threading.Thread(target=run, daemon=True))  # never outlives the test
        threads[-1].start()

    def end():
        stop.set()
        for thread in threads:
            thread.join(30)
            assert not thread.is_alive()
        return truths

    yield start, end
    end()


def of_serial(sensors, serial):
    return next(sensor for sensor in sensors if sensor["serial"] == serial)


def test_record_writes_what_was_sent(sensors, tmp_path):
    start, end = sensors
    start("127.0.0.61", serial="PYTHON000000011", seed=3, loss=0.02)
    start("127.0.0.62", serial="PYTHON000000021", sensor="avia", seed=4)
    path = tmp_path / "live.lvx"
    wanted = ["PYTHON000000011", "PYTHON000000021"]
    recorded = risley.record(path, interface=HOST, duration=2.0, serial=wanted,
                             publish="foxglove:0", frame_rate=10.0)
    truths = [truth["sensors"][0] for truth in end()]
    assert recorded["viewers"]["connections"] == 0
    assert all(one["publishing"]["frames"] > 0 for one in recorded["sensors"])
    assert recorded["output"] == str(path) and recorded["duration_s"] == pytest.approx(2.0, abs=0.5)
    for truth in truths:
        one = of_serial(recorded["sensors"], truth["serial"])
        for key in ("rows", "packets", "imu_samples", "lost"):
            assert one[key] == truth[key], key
    recording = risley.read(path)
    assert len(recording) == sum(truth["rows"] for truth in truths)
    assert [device.serial for device in recording.header.devices] == sorted(wanted)
    assert np.isfinite(recording.azimuth).all()


def test_points_go_somewhere(tmp_path):
    with pytest.raises(ValueError, match="expected foxglove:PORT"):
        risley.record(tmp_path / "live.lvx", interface=HOST, publish="here")


def test_both_generations_are_recorded(sensors, tmp_path):
    start, end = sensors
    start("127.0.0.67", serial="PYTHON000000071", sensor="mid-360")
    start("127.0.0.68", serial="PYTHON000000081")
    recorded = risley.record(tmp_path / "both.lvx", interface=HOST, duration=1.0,
                             serial=["PYTHON000000071", "PYTHON000000081"])
    truths = [truth["sensors"][0] for truth in end()]
    for truth, ending, address in zip(truths, (".lvx2", ".lvx"), ("127.0.0.67", "")):
        one = of_serial(recorded["sensors"], truth["serial"])
        assert one["output"] == str(tmp_path / f"both{ending}")
        recording = risley.read(one["output"])
        assert len(recording) == one["rows"] == truth["rows"]
        assert [device.address for device in recording.header.devices] == [address]


def test_a_recording_is_sent_again_with_a_clock_that_is_faster(sensors, tmp_path):
    risley.simulate(tmp_path / "made.lvx", duration=0.5, seed=8, scene=DATA / "room.yaml")
    start, end = sensors
    start("127.0.0.70", serial="PYTHON000000071", recording=tmp_path / "made.lvx",
          clock_drift=400e-6, time="ptp")
    recorded = risley.record(tmp_path / "again.nc", interface=HOST, duration=6.0,
                             serial=["PYTHON000000071"])["sensors"][0]
    assert recorded["rows"] == end()[0]["sensors"][0]["rows"] == len(risley.read(tmp_path / "again.nc"))
    clock = recorded["clocks"][0]
    assert clock["source"].upper() == "PTP"
    assert abs(clock["drift_ppm"] - 400.0) < 6 * clock["drift_sigma_ppm"]


def test_a_bend_while_recording_is_told(sensors, tmp_path, caplog):
    start, end = sensors
    start("127.0.0.72", serial="PYTHON000000081", bend_s=6.0,
          bend={"prism_tilt_b_vertical_deg": 0.1})
    with caplog.at_level(logging.WARNING, logger="risley"):
        recorded = risley.record(tmp_path / "bent.lvx", interface=HOST, duration=12.0,
                                 serial=["PYTHON000000081"], optics="own")
    assert end()[0]["sensors"][0]["bends"] == 1
    assert recorded["sensors"][0]["optics"]["alarm"]["kind"] == "changed"
    assert any("optics have changed" in record.getMessage() for record in caplog.records)


def test_stop_ends_a_recording_and_words_are_logged(sensors, tmp_path, caplog):
    start, end = sensors
    start("127.0.0.63", serial="PYTHON000000031", heartbeat_dies=0.3, wrong_checksums=0.2)
    stop = risley.Stop()
    assert not stop.is_set()
    timer = threading.Timer(8.0, stop.set)  # three seconds without an answer, and handshakes
    timer.start()
    with caplog.at_level(logging.INFO, logger="risley"):
        recorded = risley.record(tmp_path / "live.lvx", interface=HOST, stop=stop,
                                 serial=["PYTHON000000031"])
    timer.join()
    assert stop.is_set() and recorded["sensors"][0]["rows"] > 0
    assert any("PYTHON000000031" in record.getMessage() and record.levelno == logging.WARNING
               for record in caplog.records)
    assert end()[0]["sensors"][0]["wrong_checksums"] > 0


def test_find_sensors_as_the_command_does(sensors):
    start, _ = sensors
    start("127.0.0.64", serial="PYTHON000000041", sensor="horizon")
    mine = of_serial(risley.find_sensors(HOST), "PYTHON000000041")
    assert mine == {"serial": "PYTHON000000041", "sensor": "Livox Horizon", "address": "127.0.0.64"}
    listed = command("record", "--list", "--interface", HOST)
    assert of_serial(listed["sensors"], "PYTHON000000041") == mine


def test_keys_are_those_of_the_command(sensors, tmp_path):
    start, end = sensors
    start("127.0.0.65", serial="PYTHON000000051")
    words = ("--interface", HOST, "--serial", "PYTHON000000051", "--duration-s", 0.5)
    by_command = command("record", "-o", tmp_path / "command.lvx", *words)
    by_python = risley.record(tmp_path / "python.lvx", interface=HOST, duration=0.5,
                              serial=["PYTHON000000051"])
    assert by_command.keys() - by_python.keys() <= {"command", "inputs", "seconds"}
    assert by_command["sensors"][0].keys() == by_python["sensors"][0].keys()
    emulated = command("emulate", "--interface", "127.0.0.66", "--duration-s", 0.2)
    truth = end()[0]
    assert emulated.keys() - truth.keys() <= {"command", "inputs", "seconds"}
    assert emulated["sensors"][0].keys() == truth["sensors"][0].keys()


def test_an_interrupt_leaves_a_whole_recording(sensors, tmp_path):
    start, _ = sensors
    start("127.0.0.67", serial="PYTHON000000061")
    path = tmp_path / "live.lvx"
    child = subprocess.Popen([sys.executable, "-c", """
import logging, sys, risley
logging.basicConfig(level=logging.INFO, stream=sys.stdout)
risley.record(sys.argv[1], interface=sys.argv[2], serial=["PYTHON000000061"],
              progress=lambda *_: None)
""", str(path), HOST], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    unfinished = tmp_path / "live.lvx.unfinished"
    try:
        for _ in range(200):
            if unfinished.exists() and unfinished.stat().st_size > 100_000:
                break
            threading.Event().wait(0.05)
        child.send_signal(signal.SIGINT)
        _, errors = child.communicate(timeout=30)
    finally:
        child.kill()
    assert errors.rstrip().endswith("KeyboardInterrupt")
    assert not unfinished.exists() and len(risley.read(path)) > 0


def test_errors_are_those_of_the_network_and_of_arguments(tmp_path):
    with pytest.raises(risley.NetworkError, match="no sensor"):
        risley.record(tmp_path / "none.lvx", interface="127.0.0.68", find=0.3, duration=1)
    assert issubclass(risley.NetworkError, OSError)
    with pytest.raises(ValueError, match="203.0.113.9"):
        risley.find_sensors("203.0.113.9")
    with pytest.raises(ValueError, match="return_mode"):
        risley.record(tmp_path / "none.lvx", return_mode="quadruple")
    with pytest.raises(ValueError, match="loss"):
        risley.emulate("127.0.0.69", loss=2.0, duration=0.1)
    with pytest.raises(TypeError, match="duration"):
        risley.record(tmp_path / "none.lvx", duration="long")
    assert not list(tmp_path.iterdir())
