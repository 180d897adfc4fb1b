# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""What documents_test.py has to know of single documents; keys are names of files, and "help"."""
import sys

HALL = "--sensor mid-40-table3 --reported nominal --scene data/hall.yaml"
DAMAGED = ("cp data/recordings/mid-40.lvx out/damaged.lvx && "
           "printf '\\377\\377' | dd of=out/damaged.lvx bs=1 seek=300008 conv=notrunc status=none")

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
    "reproduce.md": ('cp -r "$RISLEY_REPRODUCED" out/reproduction',),
    "README.md": (
        "risley simulate -o my.lvx --sensor mid-40-table3 --scene data/room.yaml --duration-s 1",
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
        "mkdir flight survey && cp recording.lvx flight/ && cp wall.lvx survey/",
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
    "risley emulate --interface 127.0.0.7 --sensor mid-360": "it has no end; mid-360.md has one",
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
    "convert.md": {
        "risley: error: out/damaged.lvx": (
            (0, DAMAGED), (3, "risley convert out/damaged.lvx -o out/saved.nc")),
    },
    "estimate.md": {
        "NOT CONVERGED": ((1, "risley estimate out/unit.lvx --free wedge_angle_deg "
                              "--free refractive_index_air"),),
    },
    "info.md": {
        "sensor        Livox Tele-15": tuple(
            (0, f'risley info "$RISLEY_VENDOR_DATA"/real/{name}') for name in
            ("tele-15.pcd --shot-rate-hz 240385", "horizon-1.pcd --shot-rate-hz 240385",
             "avia-viewer-1.csv --shot-rate-hz 240000")),
    },
    "reproduce.md": {"Table 3: a simulated unit": ((0, TABLES),)},
}
