#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Runs some hundred risley commands over all verbs, sensors, formats and faults, and keeps what they
print and write, so that two builds can be compared to the last digit.

    frozen_commands.py run RISLEY FOLDER     one folder per case: status, stdout, stderr, files
    frozen_commands.py compare BEFORE AFTER  lists what differs; numbers with their largest difference

What depends on the clock, the machine or the version is left out. With RISLEY_VENDOR_DATA the maker's
sequences and real recordings are read, too; FROZEN_CASES may name a folder of further recordings.
"""
import argparse
import concurrent.futures
import difflib
import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
HALL = "simulate --sensor mid-40-table3 --reported nominal --scene {data}/hall.yaml --rate-hz 10000 --duration-s 2"
SHORT = "simulate --sensor {} --scene {{data}}/room.yaml --duration-s 0.2"
SENSORS = ["mid-40", "mid-70", "avia", "horizon", "tele-15", "mid-40-table3", "mid-40-reversed"]


def damaged(name, copy, at, text):
    """A command of the shell that overwrites bytes of a copy."""
    return f"!cp {name} {copy} && printf '{text}' | dd of={copy} bs=1 seek={at} conv=notrunc status=none"


def cases():
    """name: [commands]; `!` marks a command of the shell, the others are risley's."""
    all_cases = {}

    def case(name, *commands):
        assert name not in all_cases
        all_cases[name] = commands

    for sensor in SENSORS:
        case(f"sensor-{sensor}", SHORT.format(sensor) + " -o a.lvx --json", "info a.lvx --json",
             "estimate a.lvx --truth a.lvx.truth.yaml --json", "estimate a.lvx -o unit")
    for method in ("map", "ekf"):
        case(f"method-{method}", SHORT.format("mid-40-table3") + " --rotor hunting -o a.nc",
             f"estimate a.nc --method {method} --json", f"estimate a.nc --method {method}")
    case("estimate-files", SHORT.format("mid-40-table3") + " -o a.lvx",
         "estimate a.lvx --states all -o all", "estimate a.lvx --states none -o none --no-report",
         "report all", "report all none -o two.html --json", "compare all none --json")
    case("estimate-thinned", "simulate --sensor mid-40-table3 --scene {data}/room.yaml --duration-s 1 -o a.lvx",
         "estimate a.lvx --rate-hz 2000 --json", "estimate a.lvx --rate-hz full --json")
    case("estimate-held", SHORT.format("avia") + " -o a.lvx",
         "estimate a.lvx --fix refractive_index=1.51 --free wedge_angle_a_deg --json",
         "estimate a.lvx --noise-angle-deg 0.01 --json", "estimate a.lvx --sensor mid-40 --json")
    for ending in ("lvx", "openpylivox.csv", "sequence.csv", "nc", "csv"):
        case(f"format-{ending}", SHORT.format("mid-40-table3") + " -o a.nc",
             f"convert a.nc -o b.{ending} --json", f"info b.{ending} --json", f"info b.{ending}",
             f"estimate b.{ending} --json", f"convert b.{ending} -o c.nc --json")
    for ending in ("pcd", "ply", "las", "npy", "xyz"):
        case(f"points-{ending}", SHORT.format("mid-40-table3") + " -o a.nc", f"cloud a.nc --calibration mid-40 -o a.{ending} --json",
             f"info a.{ending} --json", f"estimate a.{ending} --shot-rate-hz 100000 --json", f"estimate a.{ending} --json")
    case("mirror", "pattern --sensor mid-40-reversed --format livox-csv --duration-s 0.2 -o a.csv --json",
         "estimate a.csv --sensor mid-40 --mirror auto --json", "estimate a.csv --sensor mid-40 --mirror no --json")
    case("extrinsics", SHORT.format("mid-40-table3") + " -o a.nc", "estimate a.nc --extrinsics 30,10,5 --json")
    case("hall", HALL + " -o a.lvx", "calibrate a.lvx --truth a.lvx.truth.yaml --json", "calibrate a.lvx",
         "calibrate a.lvx -o cal", "cloud a.lvx --calibration cal/calibration.yaml -o a.las --json",
         "cloud a.lvx --calibration cal/calibration.yaml -o a.ply --report a.html",
         "cloud a.lvx --calibration mid-40 -o a.npy --json", "report cal --json")
    case("hall-flat", HALL + " -o a.lvx", "calibrate a.lvx --walls flat --json")
    case("hall-two", HALL + " --seed 1 -o a.lvx", HALL + " --seed 2 -o b.lvx", "calibrate a.lvx b.lvx --same-walls --json")
    for sensor in ("avia", "mid-70", "horizon", "tele-15"):
        case(f"walls-{sensor}", f"simulate --sensor {sensor} --scene {{data}}/hall.yaml --duration-s 1 -o a.lvx",
             "calibrate a.lvx --json")
    case("plan-walls", "calibrate --plan {data}/hall.yaml --duration-s 10 --json",
         "calibrate --plan {data}/room.yaml --sensor avia --duration-s 2")
    case("plan-flight", "calibrate --plan {data}/flight-s4.yaml --mount {data}/mount-as-built.yaml --scene "
         "{data}/village.yaml --trajectory-errors {data}/trajectory-errors.yaml --json")
    case("flight", "simulate -o s4.lvx --sensor mid-40-table3 --reported nominal --rotor hunting --rate-hz 5000 "
         "--scene {data}/village.yaml --flight {data}/flight-s4.yaml --mount {data}/mount-nadir.yaml "
         "--trajectory-errors {data}/trajectory-errors.yaml --json",
         "info s4.lvx.trajectory.csv --json", "convert s4.lvx.trajectory.csv -o copy.csv --json", "info copy.csv --json",
         "calibrate s4.lvx --trajectory s4.lvx.trajectory.csv --mount {data}/mount-as-built.yaml "
         "--trajectory-errors {data}/trajectory-errors.yaml --truth s4.lvx.truth.yaml --json -o flight",
         "cloud s4.lvx --calibration mid-40 --trajectory s4.lvx.trajectory.csv --mount {data}/mount-as-built.yaml -o s4.las --json",
         "report flight --json")
    for verb in ("observability --duration-s 3", "observability --sensor horizon --duration-s 1"):
        case(verb.replace(" ", "-"), verb, verb + " --json")
    case("observability-recording", SHORT.format("mid-70") + " -o a.lvx", "observability a.lvx --json")
    for sensor in ("mid-40", "horizon", "avia"):
        case(f"identify-{sensor}", f"pattern --sensor {sensor} --format livox-csv --duration-s 0.2 -o a.csv",
             "identify a.csv --json", "identify a.csv -o mine.yaml", "preset check mine.yaml --json")
    for layout in ("livox-csv", "helios-xml", "npy", "json", "usda"):
        case(f"pattern-{layout}", f"pattern --sensor avia --format {layout} --duration-s 0.1 -o a --json")
    case("pattern-coverage", "pattern --sensor avia --coverage --report a.html --json", "pattern --sensor avia --coverage")
    case("presets", "preset list --json", "preset list", *(f"preset show {sensor}" for sensor in SENSORS),
         "preset new unit-17 --from mid-40 -o new.yaml", "preset check {root}/presets/avia.yaml")
    case("origins", "cloud --calibration mid-40 --beam-origin-map a.html --json")
    case("campaign", "!printf 'simulate: {{sensor: mid-40-table3, duration_s: 0.1, rate_hz: 2000}}\\nestimate: {{sensor: mid-40}}"
         "\\ngrid:\\n  simulate.noise_angle_deg: [0.005, 0.02]\\nseeds: {{first: 1, count: 3}}\\n' > plan.yaml",
         "campaign plan.yaml --chunk 1/2 -o parts --json", "campaign plan.yaml --merge -o parts --json",
         "campaign plan.yaml --chunk 2/2 -o parts --json", "campaign plan.yaml --merge -o parts --json",
         "campaign plan.yaml --merge -o parts", "campaign plan.yaml -o whole --json")
    case("many", *(SHORT.format("mid-40-table3") + f" --seed {i} -o in/{i}.lvx" for i in (1, 2)),
         SHORT.format("avia") + " -o in/3.csv", "!echo nonsense > in/4.lvx",
         "estimate in -o out --table fleet.csv --no-report --json", "estimate in -o out --table fleet.csv --resume --json",
         "info in --table info.csv --json", "info in", "convert in/1.lvx in/2.lvx --format netcdf -o nc --json",
         "compare out/1 out/2 --json", "compare out/1 out/2", "compare fleet.csv -o page.html",
         "cloud in/1.lvx in/2.lvx --calibration mid-40 --format ply -o clouds --json")
    case("excerpt", SHORT.format("mid-40-table3") + " -o a.lvx", "info a.lvx --share e.nc --json",
         "info e.nc --json")
    case("faults", SHORT.format("mid-40-table3") + " -o a.lvx", "!head -c 50000 a.lvx > cut.lvx", "info cut.lvx --json",
         "estimate cut.lvx --json", damaged("a.lvx", "bad.lvx", 30000, "\\377\\377\\377\\377\\377\\377"), "info bad.lvx --json",
         "info missing.lvx --json", "info missing.lvx", "!: > empty.lvx", "info empty.lvx", "estimate empty.lvx --json",
         "!head -c 30000 /dev/zero > zero.bin", "info zero.bin", "convert a.lvx -o a.nc", "!head -c 30000 a.nc > cut.nc",
         "info cut.nc", "convert a.lvx -o a.csv", "!sed 100s/,/,x/ a.csv > bad.csv", "info bad.csv", "estimate bad.csv --json")
    case("wrong-usage", "estimate", "estimate a.lvx --rate-hz -1", "estimate a.lvx --method best", "simulate",
         "simulate --sensor unknown -o a.lvx", "simulate --sensor mid-40 --duration-s 0 -o a.lvx",
         "simulate --sensor mid-40 --set wedge_angle_q_deg=3 -o a.lvx", "simulate --sensor mid-40 --noise-angle-deg -1 -o a.lvx",
         "calibrate a.lvx --trajectory t.csv", "cloud a.lvx -o a.las", "pattern --sensor avia --format other -o a",
         "preset show unknown", "compare one", "campaign plan.yaml --chunk 3/2 -o p", "nonsense", "identify --json",
         "estimate a.lvx --fix wedge_angle_deg --json", "estimate a.lvx --extrinsics 1,2 --json", "observability --duration-s x",
         "record -o a.lvx --interface 1.2.3", "simulate --sensor mid-40 --scene missing.yaml -o a.lvx --json")
    case("wrong-values", SHORT.format("mid-40-table3") + " -o a.lvx", "estimate a.lvx --fix wedge_angle_deg=200 --json",
         "estimate a.lvx --free unknown --json", "estimate a.lvx --device 7 --json", "estimate a.lvx --truth missing.yaml --json",
         "cloud a.lvx --calibration missing.yaml -o a.las --json", "cloud a.lvx --calibration avia -o a.las --json",
         "calibrate a.lvx --json", "convert a.lvx -o a.unknown --json", "cloud a.lvx --calibration mid-40 -o a.xyz --json",
         "estimate a.lvx -o a.lvx --json", "convert a.lvx -o a.lvx --json", "report missing --json")
    case("helps", "--help", "--version", *(f"{verb} --help" for verb in (
        "info", "convert", "simulate", "estimate", "observability", "calibrate", "cloud", "identify", "pattern", "reproduce",
        "report", "preset", "compare", "campaign", "record", "emulate", "plan-flight")))
    vendor = os.environ.get("RISLEY_VENDOR_DATA")
    if vendor:
        for path in sorted(pathlib.Path(vendor).glob("*.csv")):
            case(f"vendor-{path.stem}", f"info {path} --json", f"estimate {path} --json", f"identify {path} --json")
        for path in sorted(pathlib.Path(vendor, "real").glob("*")):
            case(f"vendor-{path.stem}", f"info {path} --json", f"estimate {path} --json --shot-rate-hz 100000")
    further = os.environ.get("FROZEN_CASES")
    if further:
        for path in sorted(pathlib.Path(further).glob("*")):
            if path.suffix == ".md":
                continue
            case(f"case-{path.name}", f"info {path} --json", f"estimate {path} --json", f"convert {path} -o a.nc --json")
    return all_cases


# What no two runs have in common.
VOLATILE_KEYS = {"seconds", "version", "date", "created", "made", "host", "threads", "duration_of_run_s", "points_per_s"}


def settled(value):
    """JSON without what depends on clock and machine."""
    if isinstance(value, dict):
        return {k: settled(v) for k, v in value.items() if k not in VOLATILE_KEYS}
    if isinstance(value, list):
        return [settled(v) for v in value]
    return value


def cleaned(text, folder):
    text = text.replace(str(folder), "FOLDER").replace(str(ROOT), "ROOT")
    text = re.sub(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d)?(\.\d+)?Z?", "DATE", text)
    text = re.sub(r"\b(read|solved|rotation angles|total) [\d.]+ s\b", r"\1 TIME", text)
    text = re.sub(r"/tmp/[A-Za-z0-9_.]+", "TMP", text)
    return text


def without_times_of_run(text):
    """A table without its columns of seconds and hashes of what holds them."""
    rows = [line.split(",") for line in text.splitlines()]
    if not rows or "seconds_total" not in rows[0]:
        return text
    kept = [i for i, name in enumerate(rows[0]) if not name.startswith("seconds_")]
    return "\n".join(",".join(row[i] for i in kept if i < len(row)) for row in rows) + "\n"


def run_case(risley, name, commands, folder):
    kept = folder / name
    kept.mkdir(parents=True)
    with tempfile.TemporaryDirectory() as work:
        for number, command in enumerate(commands):
            text = command.format(data=ROOT / "data", root=ROOT)
            shell = text.startswith("!")
            words = ["bash", "-c", text[1:]] if shell else [risley, *text.split(), *([] if "help" in text else ["--quiet"])]
            pathlib.Path(work, "in").mkdir(exist_ok=True)
            done = subprocess.run(words, cwd=work, capture_output=True, text=True, errors="replace", timeout=600)
            if shell:
                continue
            out = done.stdout
            try:
                out = json.dumps(settled(json.loads(out)), indent=1)
            except ValueError:
                pass
            pathlib.Path(kept, f"{number:02}.txt").write_text(
                f"$ risley {command}\nstatus {done.returncode}\n--- stdout\n{cleaned(out, work)}\n--- stderr\n"
                f"{cleaned(done.stderr, work)}\n")
        lines = []
        for path in sorted(pathlib.Path(work).rglob("*")):
            if not path.is_file() or ".records" in str(path):  # what --resume keeps holds run times
                continue
            data = path.read_bytes()
            name_in = path.relative_to(work)
            if path.suffix in (".json", ".yaml", ".html", ".csv", ".txt") and len(data) < 30_000_000:
                text = cleaned(data.decode(errors="replace"), work)
                if path.suffix == ".csv":
                    text = without_times_of_run(text)
                if path.suffix == ".json":
                    try:
                        text = json.dumps(settled(json.loads(data)), indent=1)
                    except ValueError:
                        pass
                target = kept / "files" / name_in
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_text(text)
            else:
                lines.append(f"{name_in} {len(data)} {hashlib.sha256(data).hexdigest()}")
        (kept / "binary.txt").write_text("\n".join(lines) + "\n")
    return name


def run(risley, folder, only):
    folder = pathlib.Path(folder)
    if folder.exists():
        shutil.rmtree(folder)
    chosen = {k: v for k, v in cases().items() if re.search(only, k)}
    risley = str(pathlib.Path(risley).resolve())
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        for future in [pool.submit(run_case, risley, k, v, folder) for k, v in chosen.items()]:
            future.result()
    print(f"frozen_commands: {len(chosen)} cases, {sum(map(len, chosen.values()))} commands kept in {folder}")


NUMBER = re.compile(r"-?\d+\.?\d*(?:[eE][-+]?\d+)?")


def largest_difference(before, after):
    """The largest relative difference of the numbers; None where the words differ."""
    if NUMBER.sub("#", before) != NUMBER.sub("#", after):
        return None
    pairs = zip(map(float, NUMBER.findall(before)), map(float, NUMBER.findall(after)))
    return max((abs(a - b) / max(abs(a), abs(b), 1e-300) for a, b in pairs), default=0.0)


def compare(before, after, lines):
    before, after = pathlib.Path(before), pathlib.Path(after)
    names = sorted({p.relative_to(root) for root in (before, after) for p in root.rglob("*") if p.is_file()})
    differ = 0
    for name in names:
        texts = [(root / name).read_text() if (root / name).exists() else "" for root in (before, after)]
        if texts[0] == texts[1]:
            continue
        differ += 1
        if not all(texts):
            print(f"{name}: only {'after' if not texts[0] else 'before'}")
            continue
        difference = largest_difference(*texts)
        if difference is not None:
            print(f"{name}: numbers differ by at most {difference:.1e} of their size")
            continue
        print(f"{name}: differs")
        a, b = (text.splitlines() for text in texts)
        shown = 0
        for line in difflib.unified_diff(a, b, lineterm="", n=0):
            if shown < lines and not line.startswith(("---", "+++", "@@")):
                print("   ", line[:300])
                shown += 1
    print(f"frozen_commands: {differ} of {len(names)} answers differ")
    return 1 if differ else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(dest="verb", required=True)
    one = verbs.add_parser("run")
    one.add_argument("risley")
    one.add_argument("folder")
    one.add_argument("--only", default="", help="regular expression of the cases' names")
    two = verbs.add_parser("compare")
    two.add_argument("before")
    two.add_argument("after")
    two.add_argument("--lines", type=int, default=6, help="lines shown of each text that differs")
    options = parser.parse_args()
    if options.verb == "run":
        return run(options.risley, options.folder, options.only)
    return compare(options.before, options.after, options.lines)


if __name__ == "__main__":
    sys.exit(main())
