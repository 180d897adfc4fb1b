# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Recordings as columns: no copy, read-only, sound without their owner, errors with names."""
import gc
import os
import pickle
import signal

import numpy as np
import pytest

import risley
from scans import scan

COLUMNS = {"time_ns": np.int64, "azimuth": np.float64, "zenith": np.float64, "range": np.float64,
           "azimuth_resolution": np.float32, "zenith_resolution": np.float32,
           "range_resolution": np.float32, "intensity": np.uint8, "return_number": np.uint8,
           "tag": np.uint8, "beam": np.uint8, "device": np.uint8, "valid": np.uint8}


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    name = tmp_path_factory.mktemp("recordings") / "scan.nc"
    risley.write(scan(0.5), name)
    return name


def test_columns_are_views_without_a_copy(path):
    recording = risley.read(path)
    for name, dtype in COLUMNS.items():
        column, again = getattr(recording, name), getattr(recording, name)
        assert column.dtype == dtype and column.shape == (len(recording),)
        address, read_only = column.__array_interface__["data"]
        assert address == again.__array_interface__["data"][0]
        assert read_only and not column.flags.writeable and not column.flags.owndata
        with pytest.raises(ValueError):
            column[0] = 1
        with pytest.raises(ValueError):
            column.flags.writeable = True


def test_columns_outlive_the_recording(path):
    recording = risley.read(path)
    azimuth, expected = recording.azimuth, recording.azimuth.copy()
    del recording
    gc.collect()
    others = [risley.read(path) for _ in range(3)]  # would reuse memory that was given back
    np.testing.assert_array_equal(azimuth, expected)
    assert len(others) == 3


def test_warnings_have_codes(tmp_path):
    name = tmp_path / "cut.csv"
    name.write_text("time_s,x_m,y_m,z_m,colour\n0.1,1,2,3,7\n0.2,1,2,3,7\n0.3,1", encoding="utf-8")
    unused, cut = risley.read(name).warnings
    assert (unused.code, cut.code) == ("columns_unused", "cut_off")
    assert (unused.line, cut.line, cut.lost_records) == (1, 4, 1)
    assert str(cut) == cut.message and "line 4" in cut.message
    with risley.read_chunks(name, rows=10) as reader:
        list(reader)
        assert reader.warnings == [unused, cut]
    assert risley.info(name)["warnings"][1]["code"] == "cut_off"


def test_chunks_are_the_whole(path):
    whole = risley.read(path)
    with risley.read_chunks(path, rows=1000) as reader:
        assert reader.header.format == "netcdf"
        chunks = list(reader)
        assert reader.fraction_read == 1
    assert len(chunks) == 10
    for name in COLUMNS:
        np.testing.assert_array_equal(np.concatenate([getattr(one, name) for one in chunks]),
                                      getattr(whole, name))
    assert list(reader) == []


def test_columns_of_a_piece_outlive_it(path):
    whole = risley.read(path).azimuth
    columns = [piece.azimuth for piece in risley.read_chunks(path, rows=700)]
    np.testing.assert_array_equal(np.concatenate(columns), whole)
    seen = 0
    for piece in risley.read_chunks(path, rows=700):
        np.testing.assert_array_equal(piece.azimuth, whole[seen:seen + len(piece)])
        seen += len(piece)
    assert seen == len(whole)


def test_arrays_come_back(path):
    original, back = scan(0.5), risley.read(path)
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(original, name), getattr(back, name))
    assert back.header.has_times and not back.header.has_range
    assert back.header.devices[0].type_name == "Livox Mid-40"


def test_rows_without_a_return_are_not_valid():
    recording = risley.from_arrays(azimuth=[0, 0.1, 0.2], zenith=[1, np.nan, 1], range=[5, 5, 0],
                                   beam=2)
    assert recording.valid.tolist() == [1, 0, 0]
    assert recording.beam.tolist() == [2, 2, 2]
    assert not recording.header.has_times and recording.time_ns.tolist() == [0, 1, 2]


@pytest.mark.parametrize("change, error, words", [
    ({"zenith": [1.0]}, ValueError, "zenith has 1 values, expected 2"),
    ({"azimuth": [[0.1, 0.2]]}, ValueError, r"azimuth has the shape \(1, 2\), expected one value"),
    ({"range": [[1, 2]]}, ValueError, r"range has the shape \(1, 2\), expected \(2,\)"),
    ({"zenith": [1, 90]}, ValueError, "zenith = 90 rad in row 1, allowed 0 to pi"),
    ({"beam": [1, 300]}, ValueError, "beam = 300 in row 1, allowed 0 to 255"),
    ({"time_ns": [0.5, 1.5]}, TypeError, "time_ns has the type float64, expected whole numbers"),
    ({"azimuth": ["a", "b"]}, TypeError, "azimuth has the type <U1, expected numbers"),
    ({"colour": [1, 2]}, TypeError, "unknown column colour"),
])
def test_wrong_columns_are_named(change, error, words):
    columns = {"azimuth": [0.1, 0.2], "zenith": [1.0, 1.1], **change}
    with pytest.raises(error, match=words):
        risley.from_arrays(**columns)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(risley.MissingFileError, match="none.lvx") as missing:
        risley.read(tmp_path / "none.lvx")
    assert isinstance(missing.value, FileNotFoundError) and isinstance(missing.value, OSError)
    broken = tmp_path / "broken.lvx"
    broken.write_bytes(b"what is this" * 9)
    with pytest.raises(risley.FileError) as damaged:
        risley.read(broken)
    assert damaged.value.path == str(broken)
    assert damaged.value.problem in str(damaged.value)
    assert not isinstance(damaged.value, FileNotFoundError)
    copy = pickle.loads(pickle.dumps(damaged.value))
    assert str(copy) == str(damaged.value) and copy.path == damaged.value.path


def test_a_file_that_dies_while_it_is_read(tmp_path):
    dying = tmp_path / "dying.nc"
    risley.write(scan(5.0), dying)
    reader = risley.read_chunks(dying, rows=5000)
    first = next(reader)
    before = first.azimuth.copy()
    os.truncate(dying, dying.stat().st_size // 2)
    for _ in range(2):  # it is said again, and nothing is made up
        with pytest.raises(risley.FileError, match="dying.nc"):
            list(reader)
    np.testing.assert_array_equal(first.azimuth, before)
    reader.close()
    assert list(reader) == []


def test_a_header_outlives_its_reader(path):
    reader = risley.read_chunks(path, rows=700)
    header, device = reader.header, reader.header.devices[0]
    reader.close()
    del reader
    gc.collect()
    assert header.format == "netcdf" and device.type_name == "Livox Mid-40"


def test_a_reader_is_for_one_call_at_a_time(path):
    reader = risley.read_chunks(path, rows=200)
    refused = []

    def close(*_):
        try:
            reader.close()
        except ValueError as error:
            refused.append(str(error))

    usual = signal.signal(signal.SIGALRM, close)
    signal.setitimer(signal.ITIMER_REAL, 0.001, 0.001)
    try:
        rows = sum(len(piece) for piece in reader)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, usual)
    assert 0 <= rows <= 10000  # closed between two pieces, never within one
    assert set(refused) <= {"another call is reading this recording"}


def test_wrong_options_of_reading(path):
    with pytest.raises(ValueError, match="rows = 0"):
        risley.read_chunks(path, rows=0)
    with pytest.raises(ValueError, match="extrinsics and extrinsics_deg"):
        risley.read(path, extrinsics=(0, 0, 0), extrinsics_deg=(0, 0, 0))
    with pytest.raises(ValueError, match="shot_rate"):
        risley.read(path, shot_rate=-1)


def test_progress_is_told_and_may_stop(path):
    reported = []
    risley.read(path, progress=lambda name, fraction: reported.append((name, fraction)))
    assert reported[-1] == ("reading", 1.0)

    class Enough(Exception):
        pass

    def stop(name, fraction):
        raise Enough(name)

    with pytest.raises(Enough, match="reading"):
        risley.read(path, progress=stop)
    risley.read(path, progress=True)
