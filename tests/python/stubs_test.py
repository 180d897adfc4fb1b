# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""The stubs say what the module has, and the public face is typed and documented."""
import inspect
import os
import pathlib
import subprocess
import sys

import pytest

import risley

PACKAGE = pathlib.Path(risley.__file__).parent
# pybind11 gives its classes a metaclass, and those without a constructor one that refuses.
ALLOWED = r"risley\._risley\.(CalibratedFlight|CalibratedRecordings|ChunkReader|Device|EstimatedRecording|Mount|PlannedCalibration"
ALLOWED += r"|PlannedFlight|PointReader|PrismTrain|Recording|RecordingHeader|RotorMotion|Sensor|Stop|Trajectory|ValueTable)"
ALLOWED += r"(\.__init__)?"


def run(*words, folder):
    pytest.importorskip("mypy")
    done = subprocess.run([sys.executable, "-m", *words], cwd=folder, capture_output=True,
                          text=True, timeout=300, check=False,
                          env={"PYTHONPATH": str(PACKAGE.parent), "MYPYPATH": str(PACKAGE.parent)})
    assert done.returncode == 0, done.stdout + done.stderr


def test_stubs_are_those_of_the_module(tmp_path):
    allowed = tmp_path / "allowed"
    allowed.write_text(ALLOWED + "\n", encoding="utf-8")
    run("mypy.stubtest", "risley._risley", "--allowlist", str(allowed), folder=tmp_path)


def test_types_of_results_are_those_of_the_schemas():
    tool = pathlib.Path(os.environ["RISLEY_SOURCE_DIR"]) / "tools" / "result_types.py"
    subprocess.run([sys.executable, tool, "--check"], check=True, timeout=60)


def test_the_public_face_is_typed(tmp_path):
    run("mypy", "--strict", "--ignore-missing-imports", "--cache-dir", str(tmp_path / "cache"),
        "-p", "risley", folder=tmp_path)


def test_every_public_name_is_documented():
    for name in risley.__all__:
        public = getattr(risley, name)
        if name.startswith("__"):
            continue
        assert inspect.getdoc(public), name
        if inspect.isfunction(public):
            assert "Returns" in public.__doc__ or "Raises" in public.__doc__, name
            for parameter in inspect.signature(public).parameters:
                assert parameter in public.__doc__, f"{name}: {parameter}"


def public_members(cls):
    """(name, member) of what a public class has of its own or from classes of this package."""
    for owner in cls.__mro__:
        if owner.__module__.split(".")[0] == "risley":
            for name, member in vars(owner).items():
                if not name.startswith("_"):
                    yield name, getattr(member, "__func__", member)


def test_every_method_and_property_is_documented():
    classes = {name: getattr(risley, name) for name in risley.__all__
               if inspect.isclass(getattr(risley, name))}
    assert {"Recording", "Sensor", "Solution", "Verdict"} <= set(classes)
    for class_name, cls in classes.items():
        for name, member in public_members(cls):
            if name in getattr(cls, "_fields", ()):  # of a named tuple, which speaks for its fields
                assert name in cls.__doc__, f"{class_name}.{name}"
            else:
                assert inspect.getdoc(member), f"{class_name}.{name}"
            if callable(member):  # help() shows the signature, which is not pybind's
                assert "args" not in inspect.signature(member).parameters, f"{class_name}.{name}"
