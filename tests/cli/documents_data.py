# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""What documents_test.py has to know of single documents; keys are names of files, and "help"."""
import sys

HALL = "--sensor mid-40-table3 --reported nominal --scene data/hall.yaml"
DAMAGED = ("cp out/unit.lvx out/damaged.lvx && "
           "printf '\\377\\377' | dd of=out/damaged.lvx bs=1 seek=3000004 conv=notrunc status=none")
WITHOUT_RANGES = ("risley simulate -o out/unit.sequence.csv --sensor mid-40-table3 --duration-s 0.1")

# A clock that falls to zero at every PPS edge: packets of 19 and 900 bytes in frames of 24 and those.
PPS = f"""{sys.executable} - <<'TEXT'
import struct
lvx = bytearray(open("out/unit.lvx", "rb").read())
frame = 24 + 5 + 59
while frame < len(lvx):
    end = struct.unpack_from("<Q", lvx, frame + 8)[0] or len(lvx)
    for packet in range(frame + 24, end, 919):
        lvx[packet + 9] = 4
        time = struct.unpack_from("<Q", lvx, packet + 11)[0]
        struct.pack_into("<Q", lvx, packet + 11, (time + 500_000_000) % 1_000_000_000)
    frame = end
open("out/pps.lvx", "wb").write(lvx)
TEXT
"""

# The tables of a reproduction as its text has them.
TABLES = f"""{sys.executable} - <<'TEXT'
import json
result = json.load(open("out/reproduction/reproduction.json"))
for table in result["tables"].values():
    print(table["title"])
    print("term paper ours unit\\n---")
    for row in table["rows"]:
        print("pass" if row["pass"] else "FAIL", row["term"], row["paper_text"] or "-",
              f"{{row['ours']:.6g}}", row["unit"])
    print()
print(result["passed"], "of", result["rows"], "rows pass")
TEXT
"""

# Commands that make what a document takes for granted.
DATA = {
    "reproduce.md": ('mkdir -p out && cp -r "$RISLEY_REPRODUCED" out/reproduction',),
    "README.md": (
        "risley simulate -o my.lvx --sensor mid-40-table3 --scene data/room.yaml --duration-s 1",
        f"mkdir survey && risley simulate -o survey/one.lvx {HALL} --duration-s 0.5",
    ),
    "recording.md": (
        "risley simulate -o wall.lvx --sensor mid-40-table3 --scene data/room.yaml --duration-s 1",
    ),
    "help": (
        f"risley simulate -o recording.lvx {HALL} --duration-s 1",
        f"risley simulate -o wall.lvx {HALL} --duration-s 1 --seed 1",
        "cp data/hall.yaml .", "cp data/campaign.yaml plan.yaml",
        "sed '/upright left/d; /flipped left/d' data/stations.yaml > stations.yaml",
        *(f"risley simulate -o {station}.lvx --sensor mid-40-table3 --reported nominal "
          f"--scene stations.yaml --station '{station} right' --duration-s 1"
          for station in ("upright", "flipped")),
        "mkdir flight && cp recording.lvx flight/",
        "risley calibrate wall.lvx --force -o march/ && cp -r march june && cp -r march november",
        "risley pattern --sensor horizon --format livox-csv --duration-s 0.1 -o sequence.csv",
        # A frame of a sensor in which no shot is missing, as points.
        "risley simulate -o all.csv --sensor tele-15 --rate-hz 240385 --duration-s 0.1 --scene data/room.yaml",
        """awk -F, 'NR > 1 { r = 0.017453292519943295
            print $1 * sin($2 * r) * cos($3 * r), $1 * sin($2 * r) * sin($3 * r), $1 * cos($2 * r) }' \
            all.csv > points.txt
        { printf 'VERSION 0.7\\nFIELDS x y z\\nSIZE 4 4 4\\nTYPE F F F\\nCOUNT 1 1 1\\nWIDTH %d\\nHEIGHT 1\\n' \
            $(wc -l < points.txt); printf 'POINTS %d\\nDATA ascii\\n' $(wc -l < points.txt)
          cat points.txt; } > frame.pcd""",
    ),
}

# Commands that do not run here, by what they begin with, and why.
LEFT_OUT = {
    "scripts/demo": "it installs packages and builds",
    "scripts/test": "it installs packages and builds",
    "scripts/package": "it installs packages and builds",
    "apt-get install ./build/packages": "tools/try-packages does it on a bare system",
    "man risley": "tools/try-packages does it on a bare system; cli.man_test looks at the pages",
    "risley record -o hall.lvx": "there is no sensor; cli.record_test has one",
    "risley record --list": "which interface it is depends on the machine; cli.record_test has one",
    "risley emulate --interface 127.0.0.5": "it takes a minute, or has no end; record.md has one",
    "risley reproduce -o": "a minute of two cores; cli.reproduce_test runs it",
    "risley reproduce --full": "it takes many minutes",
}

# Exit statuses that are not 0.
STATUS = {
    "risley estimate out/fleet -o out/results --table out/fleet.csv --no-report": 3,
    "risley estimate out/fleet -o out/results --table out/fleet.csv --no-report --resume": 3,
}

# Of every document, what a block of output begins with: the commands that print it, with their exit statuses.
MESSAGES = {
    "calibrate-in-flight.md": {
        "risley: error: --mount": ((2, "risley calibrate out/s4.lvx "
                                       "--trajectory out/s4.lvx.trajectory.csv"),),
        "undecided: refractive_index": (
            (0, "risley simulate -o out/index.lvx --sensor mid-40-table3 --reported nominal "
                "--reported refractive_index=1.51 --rotor hunting --rate-hz 5000 "
                "--flight data/flight-s4.yaml --mount data/mount-nadir.yaml --scene data/village.yaml "
                "--trajectory-errors data/trajectory-errors.yaml"),
            (0, "risley calibrate out/index.lvx --trajectory out/index.lvx.trajectory.csv "
                "--mount data/mount-as-built.yaml --trajectory-errors data/trajectory-errors.yaml")),
    },
    "calibrate.md": {
        "risley: warning: the direction": (
            (0, "{ echo 'planes:'; "
                "echo '  - {name: wall, distance_m: 30, normal_azimuth_deg: 0, normal_zenith_deg: 90}'; } "
                "> out/wall.yaml && risley simulate -o out/wall.lvx --sensor mid-40-table3 "
                "--reported nominal --scene out/wall.yaml --duration-s 10"),
            (0, "risley calibrate out/wall.lvx")),
        "risley: error: station flipped": (
            (1, "risley calibrate out/upright-right.lvx out/upright-left.lvx out/flipped-left.lvx "
                "out/flipped-right.lvx --stations data/stations.yaml"),),
        "risley: error: out/unit.sequence.csv holds no ranges": (
            (0, WITHOUT_RANGES),
            (1, "risley calibrate out/unit.sequence.csv"),
            (2, "risley calibrate out/hall.lvx --stations data/stations.yaml")),
    },
    "cloud.md": {
        "risley: error: the recording has no ranges": (
            (0, WITHOUT_RANGES),
            (2, "risley cloud out/unit.sequence.csv --calibration mid-40 -o out/unit.las")),
        "risley: error: --calibration": (
            (2, "risley cloud out/hall.lvx -o out/hall.las"),
            (2, "risley cloud out/hall.lvx --calibration mid-50 -o out/hall.las")),
        "risley: error: out/damaged.lvx": (
            (0, DAMAGED.replace("unit", "hall")),
            (3, "risley cloud out/damaged.lvx --calibration mid-40 -o out/damaged.las")),
    },
    "convert.md": {
        "//Distance": ((0, "head -n 3 out/unit.csv"),),
        "Time/s": ((0, "head -n 3 out/unit.sequence.csv"),),
        "risley: error: out/damaged.lvx": (
            (0, DAMAGED), (3, "risley convert out/damaged.lvx -o out/saved.nc")),
        "risley: error: out/unit.las": ((2, "risley convert out/unit.lvx -o out/unit.las"),),
        "risley: error: several files": (
            (2, "risley convert out/unit.lvx out/again.lvx -o out/converted/"),),
    },
    "estimate.md": {
        "NOT CONVERGED": ((1, "risley estimate out/unit.lvx --free wedge_angle_deg "
                              "--free refractive_index_air"),),
        "risley: warning: residuals": ((0, "risley estimate out/unit.lvx --noise-angle-deg 0.001"),),
        "risley: warning: the times": (
            (0, "risley convert out/unit.lvx -o out/unit.sequence.csv"),
            (0, "awk -F, -v OFS=, 'NR > 1 { $1 = sprintf(\"%.6f\", $1 / 2) } NR <= 5001' "
                "out/unit.sequence.csv > out/fast.sequence.csv"),
            (0, "risley estimate out/fast.sequence.csv"),
            (0, "head -n 1501 out/unit.sequence.csv > out/short.sequence.csv"),
            (1, "risley estimate out/short.sequence.csv")),
        "risley: warning: the recording is a mirror": (
            (0, "awk -F, -v OFS=, 'NR > 1 { $3 = sprintf(\"%.5f\", 180 - $3) } NR <= 10001' "
                "out/unit.sequence.csv > out/mirror.sequence.csv"),
            (0, "risley estimate out/mirror.sequence.csv")),
    },
    "info.md": {
        "gaps          1": (
            (0, "risley convert out/unit.lvx -o out/unit.csv"),
            (0, "awk -F, 'NR == 1 || $5 < 3.999995 || $5 > 4.199985' out/unit.csv > out/gap.csv"),
            (0, "risley info out/gap.csv")),
        "time from     PPS": ((0, PPS), (0, "risley info out/pps.lvx")),
        "sensor        Livox Tele-15": tuple(
            (0, f'risley info "$RISLEY_VENDOR_DATA"/real/{name}') for name in
            ("tele-15.pcd --shot-rate-hz 240385", "horizon-1.pcd --shot-rate-hz 240385",
             "avia-viewer-1.csv --shot-rate-hz 240000")),
        "risley: warning: out/wide.nc": (
            (0, "risley simulate -o out/mid-70.sequence.csv --sensor mid-70 --duration-s 0.2"),
            (0, "risley convert out/mid-70.sequence.csv -o out/wide.nc --sensor-type mid-40"),
            (0, "risley info out/wide.nc")),
        "risley: warning: out/cut.lvx": (
            (0, "head -c 5000000 out/unit.lvx > out/cut.lvx"), (0, "risley info out/cut.lvx")),
        "risley: error: out/damaged.lvx": ((0, DAMAGED), (3, "risley info out/damaged.lvx")),
        "risley: error: out/notes.txt": (
            (0, "echo hello > out/notes.txt"), (3, "risley info out/notes.txt")),
    },
    "observability.md": {
        "risley: error: unknown parameter": ((2, "risley observability --free wedge_angle"),),
    },
    "pattern.md": {
        "risley: error: rotation_angle": (
            (2, "risley pattern --sensor mid-40 --format npy --start-angles-deg 10 -o out/x.npy"),),
        "risley: error: sensor": ((2, "risley pattern --sensor mid40 --format npy -o out/x.npy"),),
        "risley: error: duration": (
            (2, "risley pattern --sensor avia --format usda --duration-s 5 -o out/x.usda"),),
    },
    "plan-a-flight.md": {
        "risley: error: only 0 cells": (
            (0, "sed 's/headings_deg: .*, length_m/heading_deg: 90, count: 2, spacing_m: 300, length_m/' "
                "data/flight-s4.yaml > out/apart.yaml"),
            (1, "risley calibrate --plan out/apart.yaml --mount data/mount-as-built.yaml "
                "--trajectory-errors data/trajectory-errors.yaml --scene data/village.yaml")),
        "risley: warning: the mount": (
            (0, "risley calibrate --plan data/flight-s4.yaml --mount data/mount-nadir.yaml --rate-hz 1000 "
                "--trajectory-errors data/trajectory-errors.yaml --scene data/village.yaml"),),
    },
    "record.md": {
        "risley: error: 127.0.0.1:55000: no sensor": (
            (3, "risley record -o out/no.lvx --interface 127.0.0.1 --find-s 0.2"),),
        "risley: error: 127.0.0.1:55000: Address": (
            (0, "{ risley record --interface 127.0.0.1 --list --find-s 3 > out/other.txt & sleep 0.5; }"),
            (3, "risley record --interface 127.0.0.1 --list"),
            (0, "wait")),
        "risley: error: --interface": ((2, "risley record --interface 192.0.2.1 --list"),),
    },
    "report.md": {
        "risley: error: out/converted": (
            (0, "mkdir out/converted out/bad && head -c 20000 out/unit/report.json > out/bad/report.json"),
            (3, "risley report out/converted"), (3, "risley report out/nothere"),
            (3, "risley report out/bad")),
    },
    "reproduce.md": {"Table 3: a simulated unit": ((0, TABLES),)},
    "simulate.md": {
        "risley: error: out/x.lvx": ((2, "risley simulate -o out/x.lvx"),),
        "risley: error: prism_tilt": (
            (2, "risley simulate -o out/x.nc --set prism_tilt_a_vertical_deg=40"),
            (2, "risley simulate -o out/x.nc --set prism_tilt_a=0.1")),
        "risley: error: unknown station": (
            (2, "risley simulate -o out/x.lvx --scene data/stations.yaml --station left"),),
        "risley: error: the recording lasts": (
            (2, "risley simulate -o out/x.nc --duration-s 200 --flight data/flight-s4.yaml "
                "--mount data/mount-nadir.yaml --scene data/village.yaml"),),
    },
    "trajectories.md": {
        "risley: error: out/cut.sbet": (
            (0, "head -c 271 out/flight.sbet > out/cut.sbet"), (3, "risley info out/cut.sbet")),
        "risley: error: out/two.csv": (
            (0, "{ cat out/flight.csv; tail -n +2 out/flight.csv; } > out/two.csv"),
            (3, "risley info out/two.csv")),
        "risley: error: out/flight.csv": (
            (0, "cp out/flight.csv out/good.csv && sed '1s/latitude_deg/latitude/' out/good.csv "
                "> out/flight.csv"),
            (3, "risley info out/flight.csv")),
    },
}
