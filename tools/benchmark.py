#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Answers what users ask about speed, each answer beside its peer of the same run, and writes docs/performance.md.
scripts/bench builds what it needs and calls it.

Usage: benchmark.py BUILD [--quick] [--folder DIR] [--json FILE] [--page] [--only PART]
  BUILD         a build with the command, the benchmarks and the Python package
  --quick       shorter recordings and fewer repetitions, less than three minutes
  --folder DIR  where recordings and results go meanwhile (default: the system's folder for temporary files)
  --json FILE   where the numbers go
  --page        write docs/performance.md, too
  --only PART   kernels, jobs, growth or parameters (repeatable)
Ratios of programs of this repository and their peers are those of neighbours: both run in turn. Times of kernels are of
one thread's processor time, times of whole processes are those of the wall clock.
"""
import argparse
import datetime
import filecmp
import json
import math
import os
import pathlib
import platform
import re
import shutil
import statistics
import struct
import subprocess
import sys
import tempfile
import textwrap
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "performance.md"
HALL = ROOT / "data" / "hall.yaml"
SENSOR = "mid-40-table3"
RATE = 100_000  # Hz
PARTS = ("kernels", "jobs", "growth", "parameters")
MEGABYTE = 1 << 20


# ---- this machine ----

def first_match(pattern, text, otherwise="unknown"):
    found = re.search(pattern, text, re.MULTILINE)
    return found.group(1).strip() if found else otherwise


def output_of(*command):
    return subprocess.run([str(word) for word in command], cwd=ROOT, capture_output=True, text=True, check=False).stdout


def machine(build):
    cpu = pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8")
    memory = pathlib.Path("/proc/meminfo").read_text(encoding="utf-8")
    cache = (build / "CMakeCache.txt").read_text(encoding="utf-8")
    compiler = first_match(r"^CMAKE_CXX_COMPILER:\w+=(.*)$", cache)
    flags = first_match(r"^flags\s*:\s*(.*)$", cpu).split()
    named = [words for flag, words in (("avx512f", "AVX-512"), ("avx2", "AVX2"), ("sse2", "SSE2")) if flag in flags]
    return {"processor": first_match(r"^model name\s*:\s*(.*)$", cpu), "architecture": platform.machine(),
            "family_model": f"{first_match(r'^cpu family[^:]*:(.*)$', cpu)}/{first_match(r'^model[^:n]*:(.*)$', cpu)}",
            "cores": os.cpu_count(), "memory_GB": round(int(first_match(r"^MemTotal:\s*(\d+)", memory, "0")) / 1e6, 1),
            "instruction_set": named[0] if named else platform.machine(), "kernel": platform.release(),
            "compiler": output_of(compiler, "--version").splitlines()[0] if compiler != "unknown" else compiler,
            "build_type": first_match(r"^CMAKE_BUILD_TYPE:\w+=(.*)$", cache),
            "commit": output_of("git", "rev-parse", "--short=12", "HEAD").strip() or "unknown",
            "changed_since_commit": bool(output_of("git", "status", "--porcelain", "--untracked-files=no").strip()),
            "date": datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d %H:%M UTC"),
            "load_at_begin": round(os.getloadavg()[0], 2)}


# ---- processes ----

class Failed(Exception):
    """A program that is measured has failed."""


def spread(values):
    """Median and range of some numbers."""
    return {"median": statistics.median(values), "least": min(values), "most": max(values), "times": len(values)}


def measured(command):
    """Runs a process to its end: what it printed, its seconds, those of its processors, the most memory it had."""
    with tempfile.TemporaryFile() as output, tempfile.TemporaryFile() as errors:
        begin = time.perf_counter()
        child = os.posix_spawnp(command[0], [str(word) for word in command], os.environ, file_actions=[
            (os.POSIX_SPAWN_DUP2, output.fileno(), 1), (os.POSIX_SPAWN_DUP2, errors.fileno(), 2)])
        _, status, usage = os.wait4(child, 0)
        seconds = time.perf_counter() - begin
        for stream in (output, errors):
            stream.seek(0)
        if os.waitstatus_to_exitcode(status) != 0:
            raise Failed(f"{' '.join(map(str, command))}: {errors.read().decode(errors='replace')}")
        return {"printed": output.read().decode(), "seconds": seconds,
                "processor_seconds": usage.ru_utime + usage.ru_stime, "memory_MB": usage.ru_maxrss * 1024 / 1e6}


def bytes_only(inputs, outputs, path):
    """The peer of a job: reads the same bytes, writes as many, and waits until the disk has them, as the command does."""
    buffer = bytearray(MEGABYTE)
    begin, processor = time.perf_counter(), time.process_time()
    for one in inputs:
        with open(one, "rb", buffering=0) as file:
            while file.readinto(buffer):
                pass
    left = outputs
    with open(path, "wb", buffering=0) as file:
        while left > 0:
            left -= file.write(memoryview(buffer)[:min(left, MEGABYTE)])
        os.fsync(file.fileno())
    result = {"seconds": time.perf_counter() - begin, "processor_seconds": time.process_time() - processor}
    os.remove(path)
    return result


def size_of(path):
    path = pathlib.Path(path)
    if path.is_dir():
        return sum(one.stat().st_size for one in path.rglob("*") if one.is_file())
    return path.stat().st_size if path.exists() else 0


def remove(path):
    path = pathlib.Path(path)
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


# ---- kernels: the programs of bench/ ----

def google_benchmark(build, name, wanted):
    """{benchmark: its counters} of one of the programs of bench/."""
    printed = measured([build / "bench" / f"risley_{name}_bench", f"--benchmark_filter={wanted}",
                        "--benchmark_format=json"])["printed"]
    found = {}
    for row in json.loads(printed)["benchmarks"]:
        if row.get("error_occurred"):
            raise Failed(f"{name}: {row['name']}: {row['error_message']}")
        found[row["name"].split("/iterations")[0].split("/min_time")[0]] = row
    return found


def interpreter(build):
    """The Python that the package of a build is made for."""
    cache = (build / "CMakeCache.txt").read_text(encoding="utf-8")
    return first_match(r"^_Python_EXECUTABLE:\w+=(.*)$", cache, sys.executable)


def kernels(build, quick):
    python = json.loads(measured(["env", f"PYTHONPATH={build / 'python'}", "PYTHONDONTWRITEBYTECODE=1", interpreter(build),
                                  ROOT / "bench" / "numpy_directions.py", "15" if quick else "61"])["printed"])
    optics = google_benchmark(build, "optics", "^(directions|directions_in_memory|sequence|jacobian|jacobian_prepared)/")
    sets = [name.split("/")[1] for name in optics if name.startswith("directions/")]
    best = sets[-1]
    length = 3 if quick else 30
    estimation = google_benchmark(build, "estimation", f"^(accumulate/|accumulate_parameters/|filter_step/|ratio/{length}/|"
                                                       f"batch_map/{length}/)")
    calibration = google_benchmark(build, "calibration", f"^adjust/{best}/" if quick else "^adjust/avx")
    recordings = google_benchmark(build, "recordings", "^(bytes_only|read)/lvx")
    points = google_benchmark(build, "cloud", "^points/")
    keep = ("peer_over_ours", "ratio_min", "ratio_q1", "ratio_q3", "ours_ns", "peer_ns", "error_rad", "error",
            "difference_in_sigmas", "peer_GB_per_s", "cost_difference", "cpu_over_ours", "cpu_ratio_min",
            "cpu_ratio_max", "ours_s", "peer_s", "per_shot", "error_over_bound", "ratio", "cpu_ratio", "map_s",
            "items_per_second", "bytes_per_second")
    found = {name: {key: row[key] for key in keep if key in row}
             for rows in (optics, estimation, calibration, recordings, points) for name, row in rows.items()}
    found["numpy"] = python
    return {"sets": sets, "seconds_of_recording": length, "found": found}


# ---- jobs: whole processes ----

class Jobs:
    """Recordings of simulated sensors, and jobs that take them from files to files."""

    def __init__(self, build, folder):
        self.command = build / "apps" / "risley" / "risley"
        self.folder = pathlib.Path(folder)

    def path(self, name):
        return self.folder / name

    def risley(self, *words, threads=None):
        count = [] if threads is None else ["--threads", threads]
        return measured([self.command, *words, *count, "--quiet", "--json"])

    def simulate(self, name, seconds, *more, threads=None):
        return self.risley("simulate", "-o", self.path(name), "--sensor", SENSOR, "--scene", HALL, "--duration-s", seconds,
                           "--rotor", "sinusoidal", *more, threads=threads)

    def make(self, name, seconds, *more):
        """A recording, made once, with one thread."""
        if not self.path(name).exists():
            self.simulate(name, seconds, *more, threads=1)
        return self.path(name)


def flatness(las, scene_distances, rows=200_000):
    """Root mean square of the means of the points' distances from each plane of the hall, m, and the number of points:
    noise averages out, errors of directions do not."""
    with las.open("rb") as file:
        header = file.read(375)  # of LAS 1.4
    offset, length = struct.unpack_from("<I", header, 96)[0], struct.unpack_from("<H", header, 105)[0]
    count = struct.unpack_from("<Q", header, 247)[0]
    scale, shift = struct.unpack_from("<3d", header, 131), struct.unpack_from("<3d", header, 155)
    step = max(1, count // rows)
    sums = {}
    with las.open("rb") as file:
        for row in range(0, count, step):
            file.seek(offset + row * length)
            raw = struct.unpack("<3i", file.read(12))
            point = [a * b + c for a, b, c in zip(raw, scale, shift)]
            plane, distance = min(((name, sum(n * x for n, x in zip(normal, point)) - d)
                                   for name, (normal, d) in scene_distances.items()), key=lambda one: abs(one[1]))
            total, number = sums.get(plane, (0.0, 0))
            sums[plane] = (total + distance, number + 1)
    return math.sqrt(sum((total / number) ** 2 for total, number in sums.values()) / len(sums)), count


def hall_planes():
    """{name: (unit normal, distance)} of the hall's planes."""
    found = {}
    for line in HALL.read_text(encoding="utf-8").splitlines():
        row = re.match(r"\s*- \{name: ([^,]+), distance_m: ([-\d.]+), normal_azimuth_deg: ([-\d.]+), "
                       r"normal_zenith_deg: ([-\d.]+)\}", line)
        if row:
            azimuth, zenith = math.radians(float(row.group(3))), math.radians(float(row.group(4)))
            found[row.group(1)] = ((math.sin(zenith) * math.cos(azimuth), math.sin(zenith) * math.sin(azimuth),
                                    math.cos(zenith)), float(row.group(2)))
    if not found:
        raise Failed(f"{HALL} has no plane that is understood")
    return found


def job_list(jobs, seconds):
    """Name, what it does in words, arguments, inputs, output, and a function of its JSON that says how good it is."""
    unit = jobs.make("unit.lvx", seconds)
    bent = jobs.make("bent.lvx", seconds, "--reported", "nominal")
    jobs.risley("estimate", unit, "-o", jobs.path("belief"), "--no-report")
    hall = ["--sensor", SENSOR, "--scene", HALL, "--duration-s", seconds, "--rotor", "sinusoidal"]

    def same_again(result, name, *back):
        del result
        jobs.risley("convert", jobs.path(name), *back)
        same = filecmp.cmp(back[-1], unit, shallow=False)
        remove(back[-1])
        return "back to LVX: the same bytes" if same else "back to LVX: OTHER BYTES"

    def judged(*words):
        """What a run with the truth prints; users have no truth, so this run is not timed."""
        return json.loads(jobs.risley(*words, "-o", jobs.path("judged"))["printed"])

    def estimated(result):
        del result
        truth = judged("estimate", unit, "--truth", f"{unit}.truth.yaml", "--no-report")["truth"]
        rms = max(truth["rotation_angle_rmse_deg"].values())
        return f"rotation angles {rms:.2g} degree rms, squared errors of parameters over their variances {truth['nees_parameters']:.2g}"

    def calibrated(result):
        result = judged("calibrate", bent, "--truth", f"{bent}.truth.yaml", "--no-report")
        return (f"directions off by {result['truth']['after']['total_deg']:.2g} degree (sigma "
                f"{result['datum']['sigma_total_deg']:.2g}), {result['truth']['before']['total_deg']:.2g} before")

    def pointed(result):
        off, count = flatness(jobs.path("cloud.las"), hall_planes())
        return f"{count / result['observations']:.4%} of the shots; planes lie {1000 * off:.2g} mm off"

    return [
        ("info", "LVX: what it holds, gaps of time", ["info", unit], [unit], None,
         lambda result: f"{result['observations'] / (RATE * seconds):.4%} of the shots, {result['gaps']} gaps"),
        ("convert", "LVX to NetCDF, lossless", ["convert", unit, "-o", jobs.path("unit.nc")], [unit], "unit.nc",
         lambda result: same_again(result, "unit.nc", "-o", jobs.path("back.lvx"))),
        ("simulate", "a hall, to LVX, and the truth to NetCDF", ["simulate", "-o", jobs.path("sim.lvx"), *hall], [],
         "sim.lvx", lambda result: "the same bytes with one thread and with all"
         if filecmp.cmp(jobs.path("sim.lvx"), unit, shallow=False) else "OTHER BYTES with one thread"),
        ("estimate", "LVX to calibration, states of the rotors and covariances",
         ["estimate", unit, "--no-report", "-o", jobs.path("result")], [unit], "result",
         estimated),
        ("calibrate", "LVX of a bent sensor in a hall to its calibration",
         ["calibrate", bent, "-o", jobs.path("calibration")], [bent], "calibration",
         calibrated),
        ("cloud", "LVX to LAS: rotation angles, directions, origins, covariances",
         ["cloud", unit, "--calibration", jobs.path("belief"), "-o", jobs.path("cloud.las")], [unit], "cloud.las",
         pointed),
    ]


def jobs_in_turn(jobs, quick):
    seconds, times = (10, 3) if quick else (60, 3)
    counts = sorted({1, os.cpu_count()})
    results = {}
    for name, words, arguments, inputs, output, judge in job_list(jobs, seconds):
        outputs = [jobs.path(output)] if output else []
        if name == "simulate":
            outputs += [jobs.path("sim.lvx.truth.nc"), jobs.path("sim.lvx.truth.yaml")]
        runs = {count: [] for count in counts}
        peers, written, quality = [], 0, ""
        for again in range(times):
            for count in counts:
                for path in outputs:
                    remove(path)
                runs[count].append(jobs.risley(*arguments, threads=count))
            written = sum(size_of(path) for path in outputs)
            if again == 0:
                quality = judge(json.loads(runs[counts[0]][0]["printed"]))
            peers.append(bytes_only(inputs, written, jobs.path("peer")))
        row = {"does": words, "quality": quality, "read_MB": sum(map(size_of, inputs)) / 1e6, "written_MB": written / 1e6}
        for count in counts:
            row[f"threads_{count}"] = {
                "seconds_per_minute": spread([60 / seconds * run["seconds"] for run in runs[count]]),
                "processor_seconds_per_minute": spread([60 / seconds * run["processor_seconds"] for run in runs[count]]),
                "memory_MB": max(run["memory_MB"] for run in runs[count]),
                "over_bytes_only": spread([run["seconds"] / peer["seconds"] for run, peer in zip(runs[count], peers)]),
                "processor_over_bytes_only": spread([run["processor_seconds"] / peer["processor_seconds"]
                                                     for run, peer in zip(runs[count], peers)])}
        if len(counts) > 1:
            row["speed_up"] = spread([one["seconds"] / many["seconds"]
                                      for one, many in zip(runs[counts[0]], runs[counts[-1]])])
        row["bytes_only_seconds_per_minute"] = spread([60 / seconds * peer["seconds"] for peer in peers])
        results[name] = row
        for path in outputs:
            remove(path)
    return {"seconds_of_recording": seconds, "shots": RATE * seconds, "threads": counts, "found": results}


def growth(jobs, quick):
    rows = []
    for seconds in (1, 10) if quick else (1, 10, 60, 600):
        recording = jobs.make(f"growth-{seconds}.lvx", seconds)
        remove(f"{recording}.truth.nc")
        row = {"seconds_of_recording": seconds, "recording_MB": size_of(recording) / 1e6}
        for name, arguments in (("estimate", ["estimate", recording, "--no-report", "-o", jobs.path("grown")]),
                                ("cloud", ["cloud", recording, "--calibration", jobs.path("grown"), "-o",
                                           jobs.path("grown.las")])):
            run = jobs.risley(*arguments, threads=1)
            row[name] = {key: run[key] for key in ("seconds", "processor_seconds", "memory_MB")}
        for path in (recording, jobs.path("grown"), jobs.path("grown.las")):
            remove(path)
        rows.append(row)
    return rows


def parameters(jobs, quick):
    """Whole estimates with more and more free parameters; the others are held at their true values."""
    seconds = 3 if quick else 10
    recording = jobs.make(f"parameters-{seconds}.lvx", seconds)
    all_free = json.loads(jobs.risley("estimate", recording, "--truth", f"{recording}.truth.yaml")["printed"])
    truth = {name: all_free["truth"]["parameters"][name]["true"] for name in all_free["parameters"]
             if not name.startswith(("angular_velocity", "rotation_angle"))}
    rows = []
    for count in (1, len(truth)) if quick else range(1, len(truth) + 1):
        held = [f"{name}={value!r}" for name, value in list(truth.items())[count:]]
        runs = [jobs.risley("estimate", recording, *(word for one in held for word in ("--fix", one)), threads=1)
                for _ in range(3)]
        rows.append({"free": count, "processor_seconds": spread([run["processor_seconds"] for run in runs]),
                     "iterations": json.loads(runs[0]["printed"])["iterations"]})
    return {"seconds_of_recording": seconds, "found": rows}


# ---- in words ----

def short(value):
    """Three digits, without an exponent."""
    if value == 0:
        return "0"
    digits = max(0, 2 - math.floor(math.log10(abs(value))))
    return f"{value:.{digits}f}"


def in_one_row(rows):
    """Rows of one question as one, with what differs between instruction sets one after the other; what stands before a
    colon is common."""
    def joined(cells):
        label, colon, _ = cells[0].rpartition(": ")
        values = [cell.removeprefix(label + colon) for cell in cells]
        return label + colon + (" / ".join(values) if len(set(values)) > 1 else values[0])

    questions = {}
    for row in rows:
        questions.setdefault(row[0], []).append(row[1:])
    return [(question, *map(joined, zip(*answers))) for question, answers in questions.items()]


def ranged(row):
    return f"{short(row['median'])} ({short(row['least'])} to {short(row['most'])})"


def table(head, rows):
    return "\n".join(["| " + " | ".join(head) + " |", "|" + "---|" * len(head)] +
                     ["| " + " | ".join(map(str, row)) + " |" for row in rows])


SETS = {"baseline": "SSE2", "avx2": "AVX2", "avx512": "AVX-512"}


def kernel_rows(result):
    found, rows = result["found"], []

    def add(question, set_name, peer, row, ours, accuracy, ratio="peer_over_ours"):
        rows.append((question, SETS.get(set_name, set_name), ours, peer, short(row[ratio]), accuracy))

    def beams(row):
        return short(1e3 / row["ours_ns"])

    for kind, question in (("directions", "azimuth and zenith, million a second"),
                           ("sequence", "the same at constant speed, from times"),
                           ("directions_in_memory", "the same of 4 million shots, in main memory"),
                           ("jacobian", "both angles and 2 x 11 derivatives, ns"),
                           ("jacobian_prepared", "the same, parameters prepared, ns")):
        for name in result["sets"]:
            row = found[f"{kind}/{name}"]
            if kind.startswith("jacobian"):
                add(question, name, f"Jets, ns: {short(row['peer_ns'])}", row, short(row["ours_ns"]), f"to Jets: {row['error']:.0e}")
            elif kind == "directions_in_memory":
                add(question, name, f"copying the bytes, ns: {short(row['peer_ns'])}", row, beams(row), "as above")
            else:
                add(question, name, f"plain Eigen, ns: {short(row['peer_ns'])}", row, beams(row), f"rad: {row['error_rad']:.0e}")
    row = found["numpy"]
    add("the same from Python", result["sets"][-1], f"numpy in blocks, ns: {short(row['peer_ns'])}", row, beams(row),
        f"rad to numpy: {row['difference_rad']:.0e}")
    for name in result["sets"]:
        if f"adjust/{name}" in found:
            row = found[f"adjust/{name}"]
            add("calibration on a wall, 1 million ranges, s", name, f"Ceres, s: {short(row['peer_s'])}", row,
                short(row["ours_s"]), f"of the cost: {row['cost_difference']:.0e}", ratio="cpu_over_ours")
    for name in result["sets"]:
        row = found[f"filter_step/{name}"]
        add("step of the filter, 12 states, ns", name, f"Eigen, Jets, Joseph, ns: {short(row['peer_ns'])}", row,
            short(row["ours_ns"]), f"sigma to Joseph: {row['difference_in_sigmas']:.0e}")
    return in_one_row(rows)


def kernel_text(result):
    found, length = result["found"], result["seconds_of_recording"]
    batch = next(row for name, row in found.items() if name.startswith("ratio/"))
    bound = next(row for name, row in found.items() if name.startswith("batch_map/"))
    read, only = found["read/lvx"], found["bytes_only/lvx"]
    accumulated = ", ".join(f"{short(1e9 * found[f'accumulate/{name}']['per_shot'])} ns ({SETS.get(name, name)})"
                            for name in result["sets"])
    lines = [table(("question", "with", "ours", "peer", "peer over ours", "accuracy"),
                   kernel_rows(result)), "",
             f"- All {length} s of a recording, {RATE * length / 1e6:g} million shots, in the batch estimator take "
             f"{short(1 / batch['cpu_ratio'])} times less processor time than one pass of a filter with Eigen, Jets and "
             f"Joseph's form; errors are {short(bound['error_over_bound'])} times the Cramér-Rao bound.",
             f"- A shot in the sums of the batch estimator, eight parameters: {accumulated}.",
             f"- LVX to columns: {short(read['bytes_per_second'] / 1e9)} GB/s, "
             f"{short(read['items_per_second'] / 1e6)} million shots a second; reading the bytes alone: "
             f"{short(only['bytes_per_second'] / 1e9)} GB/s.",
             f"- Points from rotation angles, one block again and again: "
             f"{short(found['points/with_covariance']['items_per_second'] / 1e6)} million a second with covariance, "
             f"{short(found['points/without_covariance']['items_per_second'] / 1e6)} without."]
    return "\n".join(lines)


def job_text(result):
    few, many = result["threads"][0], result["threads"][-1]
    rows = []
    for name, row in result["found"].items():
        one, all_cores = row[f"threads_{few}"], row[f"threads_{many}"]
        rows.append((f"`{name}`: {row['does']}", ranged(one["seconds_per_minute"]),
                     ranged(all_cores["seconds_per_minute"]), f"{short(60 / one['seconds_per_minute']['median'])} x",
                     f"{ranged(one['over_bytes_only'])}" if row["read_MB"] + row["written_MB"] > 0 else "",
                     f"{one['memory_MB']:.0f}, {all_cores['memory_MB']:.0f} MB", row["quality"]))
    points = result["found"]["cloud"]
    rate = {count: 60 * RATE / points[f"threads_{count}"]["seconds_per_minute"]["median"] / 1e6 for count in (few, many)}
    return "\n".join([
        table(("job", "s per recorded minute, one thread", f"{many} threads",
               "recording time over ours", "times the time of its bytes", "memory", "accuracy"), rows), "",
        f"Recordings of {result['seconds_of_recording']} s, {result['shots'] / 1e6:g} million shots. `cloud` makes "
        f"{short(rate[few])} million points a second on one core and {short(rate[many])} on {many}. The time of its bytes is "
        "that of a program that reads the input, writes as many bytes as the job, waits until the disk has them, and does "
        "nothing else; medians of three, with least and most."])


def growth_text(rows):
    return table(("recording", "`estimate`, s", "s per minute", "memory, MB", "`cloud`, s", "s per minute", "memory, MB"),
                 [(f"{row['seconds_of_recording']} s, {row['recording_MB']:.0f} MB",
                   *(value for name in ("estimate", "cloud") for value in
                     (short(row[name]["processor_seconds"]),
                      short(60 * row[name]["processor_seconds"] / row["seconds_of_recording"]),
                      f"{row[name]['memory_MB']:.0f}"))) for row in rows])


def parameter_text(result, found):
    kernel = {int(name.split("/")[1]): row["per_shot"] for name, row in found.items()
              if name.startswith("accumulate_parameters/")}
    return table(("free parameters", f"`estimate` of {result['seconds_of_recording']} s, s", "iterations",
                  "sums over shots, ns a shot"),
                 [(row["free"], ranged(row["processor_seconds"]), row["iterations"],
                   short(1e9 * kernel[row["free"]]) if row["free"] in kernel else "")
                  for row in result["found"] if row["free"] in (1, 2, 4, 8)])


def machine_text(result):
    m = result["machine"]
    changed = " with changes" if m["changed_since_commit"] else ""
    return (f"{'A quick run, of short recordings. ' if result['quick'] else ''}Measured on {m['date']} at commit {m['commit']}{changed}, version of {m['build_type']}: {m['processor']} "
            f"(family/model {m['family_model']}), {m['cores']} processors, {m['memory_GB']} GB, {m['instruction_set']}; "
            f"{m['compiler']}; Linux {m['kernel']}. Load before: {m['load_at_begin']}, after: {m['load_at_end']}"
            f"{'; **other programs ran, too**' if max(m['load_at_begin'], 0) > 1 else ''}. "
            f"The run took {m['minutes']:.0f} minutes.")


def texts(result):
    """{part: Markdown} of what was measured."""
    found = {"machine": machine_text(result)}
    if "kernels" in result:
        found["kernels"] = kernel_text(result["kernels"])
    if "jobs" in result:
        found["jobs"] = job_text(result["jobs"])
    if "growth" in result:
        found["growth"] = growth_text(result["growth"])
    if "parameters" in result:
        found["parameters"] = parameter_text(result["parameters"], result.get("kernels", {}).get("found", {}))
    return found


def wrapped(text):
    """Text whose lines, but for those of tables, have at most 118 characters."""
    return "\n".join(line if line.startswith("|") else
                     textwrap.fill(line, 118, subsequent_indent="  " if line.startswith("- ") else "",
                                   break_on_hyphens=False) for line in text.splitlines())


def fill_page(found):
    text = PAGE.read_text(encoding="utf-8")
    for part, words in found.items():
        begin, end = f"<!-- begin {part} -->", f"<!-- end {part} -->"
        if begin not in text or end not in text:
            raise Failed(f"{PAGE} has no marks {begin} and {end}")
        head, rest = text.split(begin)
        text = f"{head}{begin}\n{wrapped(words)}\n{end}{rest.split(end)[1]}"
    PAGE.write_text(text, encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--folder")
    parser.add_argument("--json", type=pathlib.Path)
    parser.add_argument("--page", action="store_true")
    parser.add_argument("--only", action="append", choices=PARTS)
    options = parser.parse_args()
    wanted = options.only or PARTS
    build = options.build.resolve()
    begin = time.perf_counter()
    result = {"machine": machine(build), "quick": options.quick}
    with tempfile.TemporaryDirectory(dir=options.folder, prefix="risley-bench-") as folder:
        jobs = Jobs(build, folder)
        for part, measure in (("kernels", lambda: kernels(build, options.quick)),
                              ("jobs", lambda: jobs_in_turn(jobs, options.quick)),
                              ("growth", lambda: growth(jobs, options.quick)),
                              ("parameters", lambda: parameters(jobs, options.quick))):
            if part in wanted:
                print(f"bench: {part}", file=sys.stderr)
                result[part] = measure()
    result["machine"]["load_at_end"] = round(os.getloadavg()[0], 2)
    result["machine"]["minutes"] = (time.perf_counter() - begin) / 60
    found = texts(result)
    print("\n\n".join(found.values()))
    if options.json:
        options.json.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    if options.page:
        fill_page(found)


if __name__ == "__main__":
    try:
        main()
    except Failed as reason:
        sys.exit(f"bench: {reason}")
