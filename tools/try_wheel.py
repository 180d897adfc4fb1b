#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Uses the archive on a bare Debian that has nothing, then the wheel on the same Debian with Python.

Usage: tools/try_wheel.py RELEASE FOLDER PACKAGES [--base BASE]
  RELEASE      bookworm (Debian 12) or trixie (Debian 13)
  FOLDER       where the system goes; must not exist yet, and stays for a look around
  PACKAGES     folder of what scripts/wheel made
  --base BASE  copy this minimal system instead of downloading one with debootstrap
Needs root, and debootstrap unless --base is given. Says "all well" at its end.
"""
import argparse
import json
import pathlib
import shutil
import subprocess
import sys
import tarfile

BARE = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "HOME": "/root", "LANG": "C.UTF-8",
        "PROJ_DATA": "/nowhere"}  # as if another program's PROJ were installed
LAZ = ("hall.laz",)  # which what Debian 12's libraries make does not have
FLIGHT = """risley_flight: 1
origin: {latitude_deg: 50, longitude_deg: 8.5, ellipsoidal_height_m: 250}
start: {scale: gps-second-of-week, time_s: 208800, gps_week: 2400}
rate_hz: 200
height_m: 80
speed_m_per_s: 5
turn_duration_s: 10
strips: [{headings_deg: [0, 180], length_m: 20}]
"""
IN_PYTHON = """
import sys
import risley
risley.simulate("python.lvx", sensor="mid-40-table3", reported_nominal=True, scene=sys.argv[1] + "/hall.yaml",
                duration=1)
print(risley.estimate("python.lvx", output="python/"))
print(risley.calibrate("python.lvx"))
risley.cloud("flight.nc", "flight.nc.truth.yaml", "python.las", trajectory="flight.nc.trajectory.csv",
             mount="flight.nc.mount.truth.yaml", directions="reported", crs="EPSG:25832")
"""
WITH_NUMPY = """
import risley
points = risley.points("python.lvx", "python/calibration.yaml")
assert points.xyz.shape == (len(points), 3) and points.covariance.shape == (len(points), 3, 3)
print(points)
"""


def use(run, work, data, also=()):
    """Does every job once and has each library read or write a file.

    @param run   runs the command with some words and returns what it prints
    @param work  the folder that it works in
    @param data  folder of the scenes, as the command sees it
    @param also  further names of clouds
    """
    (work / "flight.yaml").write_text(FLIGHT, encoding="utf-8")
    run("simulate", "-o", "hall.lvx", "--sensor", "mid-40-table3", "--reported", "nominal", "--scene",
        f"{data}/hall.yaml", "--duration-s", "1")
    verdict = json.loads(run("estimate", "hall.lvx", "-o", "result/", "--json"))["verdict"]["code"]
    assert verdict == "consistent", verdict
    verdict = json.loads(run("calibrate", "hall.lvx", "-o", "calibration/", "--json"))["verdict"]["code"]
    assert verdict == "bent", verdict
    run("simulate", "-o", "flight.nc", "--sensor", "mid-40", "--flight", "flight.yaml", "--mount",
        f"{data}/mount-nadir.yaml", "--scene", f"{data}/village.yaml", "--rate-hz", "2000", "--start-s", "3",
        "--duration-s", "2")
    cloud = json.loads(run(
        "cloud", "flight.nc", "-o", "flight.las", "--calibration", "flight.nc.truth.yaml", "--directions", "reported",
        "--trajectory", "flight.nc.trajectory.csv", "--mount", "flight.nc.mount.truth.yaml", "--crs",
        "EPSG:25832+5773", "--json"))  # heights above the geoid: a grid beside PROJ's database
    assert cloud["points"] > 3000, cloud
    assert (work / "result/report.html").stat().st_size > 100_000
    for name in ("hall.bag", "hall.pcd", *also):
        run("cloud", "hall.lvx", "--calibration", "calibration/", "-o", name)
        run("info", name)


def in_system(system, *command, folder="/root/work"):
    """What a command prints in the system that lies in a folder."""
    done = subprocess.run(["chroot", system, "/bin/sh", "-c", 'cd "$0" && exec "$@"', folder, *command],
                          check=False, env=BARE, stdout=subprocess.PIPE, text=True)
    if done.returncode != 0:
        sys.exit(f"try_wheel: {' '.join(map(str, command))}: exit status {done.returncode}")
    return done.stdout


def only(folder, pattern):
    """The one file of this kind."""
    found = sorted(folder.glob(pattern))
    if len(found) != 1:
        sys.exit(f"try_wheel: {folder} holds {len(found)} files {pattern}, not one")
    return found[0]


def prepare(release, system, base):
    """The bare system, with an empty folder to work in."""
    if system.exists():
        sys.exit(f"try_wheel: {system} exists already")
    command = ["cp", "-a", base, system] if base else ["debootstrap", "--variant=minbase", release, system]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    (system / "root/work").mkdir()
    shutil.copy("/etc/resolv.conf", system / "etc/resolv.conf")
    bundle = pathlib.Path("/etc/ssl/certs/ca-certificates.crt")  # behind a proxy that opens TLS
    if bundle.exists():
        folder = system / "usr/local/share/ca-certificates"
        folder.mkdir(parents=True, exist_ok=True)
        shutil.copy(bundle, folder / "this-machine.crt")


def try_archive(system, archive):
    """The archive with nothing but what every Debian has."""
    print(f"try_wheel: {archive.name}", flush=True)
    with tarfile.open(archive) as file:
        file.extractall(system / "opt")
    top = only(system / "opt", "risley-*").name
    data = f"/opt/{top}/share/risley/data"
    use(lambda *words: in_system(system, f"/opt/{top}/bin/risley", *words), system / "root/work", data, LAZ)
    shutil.rmtree(system / "root/work")
    (system / "root/work").mkdir()


def try_wheel(system, wheel):
    """The wheel with Python alone, then with numpy."""
    print(f"try_wheel: {wheel.name}", flush=True)
    apt = ("apt-get", "-qq", "-o", "Dpkg::Use-Pty=0")
    install = (*apt, "install", "-y", "--no-install-recommends")
    in_system(system, *apt, "update")
    in_system(system, "env", "DEBIAN_FRONTEND=noninteractive", *install, "python3", "python3-venv")
    shutil.copy(wheel, system / "root")
    in_system(system, "python3", "-m", "venv", "--system-site-packages", "/root/venv")
    print(in_system(system, "/root/venv/bin/pip", "install", "--no-index", f"/root/{wheel.name}"), end="")
    package = only(system / "root/venv/lib", "python3.*/site-packages/risley")
    data = f"/{package.relative_to(system)}/share/risley/data"
    use(lambda *words: in_system(system, "/root/venv/bin/risley", *words), system / "root/work", data, LAZ)
    print(in_system(system, "/root/venv/bin/python", "-c", IN_PYTHON, data))
    in_system(system, "env", "DEBIAN_FRONTEND=noninteractive", *install, "python3-numpy")
    print(in_system(system, "/root/venv/bin/python", "-c", WITH_NUMPY))


def main():
    """Does it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("release", choices=("bookworm", "trixie"))
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("packages", type=pathlib.Path)
    parser.add_argument("--base", type=pathlib.Path)
    options = parser.parse_args()
    system = options.folder.resolve()
    prepare(options.release, system, options.base)
    mounted = system / "proc"
    subprocess.run(["mount", "-t", "proc", "proc", mounted], check=True)
    try:
        try_archive(system, only(options.packages, "risley-*.tar.xz"))
        try_wheel(system, only(options.packages, "risley-*.whl"))
    finally:
        subprocess.run(["umount", mounted], check=True)
    print("try_wheel: all well")


if __name__ == "__main__":
    main()
