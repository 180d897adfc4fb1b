#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Fills in docs/real-units.md: runs `risley estimate` on real recordings and writes what was found
between the marks of the page. The recordings are not part of this repository; the page says where
they come from.

Usage: real_units.py RISLEY FOLDER
  RISLEY  the built command
  FOLDER  holds the recordings under the names below; those that are missing keep their old text
"""
import hashlib
import json
import pathlib
import re
import subprocess
import sys
import tempfile

PAGE = pathlib.Path(__file__).resolve().parent.parent / "docs" / "real-units.md"

# Mark in the page: file, and how it has to be read.
RECORDINGS = {
    "mid-40-hub-frame": ("real/mid-40-hub-frame.csv", ["--shot-rate-hz", "100000"]),
    "tele-15": ("real/tele-15.pcd", ["--shot-rate-hz", "240385"]),
    "horizon": ("real/horizon-1.pcd", ["--shot-rate-hz", "240385"]),
}


def number(value, sigma):
    """Value and sigma to the second digit of the sigma."""
    if not sigma > 0:
        return f"{value:.6g}", ""
    digits = max(0, 1 - int(f"{sigma:e}".split("e")[1]))
    return f"{value:.{digits}f}", f"{sigma:.{digits}f}"


def in_words(name):
    """The name of a parameter without its unit, which the page states; prisms have capital letters."""
    words = name.replace("_", " ").removesuffix(" deg per s").removesuffix(" deg")
    return re.sub(r"\b[a-h]\b", lambda letter: letter.group().upper(), words)


def grouped(count):
    """As the command groups counts."""
    return f"{count:,}".replace(",", " ") if count >= 10_000 else str(count)


def table(rows):
    """The horizontal and the vertical part of a quantity stand in one row."""
    quantities = {}
    for name, value, sigma in rows:
        quantities.setdefault(re.sub(" (horizontal|vertical)$", "", name), []).append((name, *number(value, sigma)))
    lines = ["| quantity | value | sigma |", "|---|---|---|"]
    for whole, parts in quantities.items():
        names, values, sigmas = zip(*parts)
        lines.append(f"| {whole if len(parts) > 1 else names[0]} | {' / '.join(values)} | {' / '.join(sigmas)} |")
    return lines


def text_of(command, path, options):
    with tempfile.TemporaryDirectory() as folder:
        words = [command, "estimate", path, *options, "--json"]
        done = subprocess.run(words + ["-o", folder], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"{path}: exit status {done.returncode}\n{done.stderr}")
    found = json.loads(done.stdout)
    slips = found["slips"]
    lost = f" {sum(one['shots'] or 0 for one in slips)} shots are missing at {len(slips)} places." if slips else ""
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    rows = [(in_words(name), one["value"], one["sigma_given_held"])
            for name, one in found["parameters"].items()]
    if found["frame"]["estimated"]:
        rows += [(f"{axis} of the frame", found["frame"][f"{axis}_deg"]["value"],
                  found["frame"][f"{axis}_deg"]["sigma"]) for axis in ("yaw", "pitch")]
    for axis in ("azimuth", "zenith"):
        noise = found["noise"][f"{axis}_deg"]
        rows.append((f"noise of the {axis}", noise["value"], noise["sigma"]))
    residual = {axis: found["residuals"][f"{axis}_deg"]["rms"] for axis in ("azimuth", "zenith")}
    image = "mirrored" if found["mirrored"] else "not mirrored"
    if found["combination"] is not None:
        image = f"speed combination {found['combination']}, {image}"
    lines = [
        "```sh",
        " ".join(["risley estimate", path.name, *options]),
        "```",
        "",
        f"`{path.name}`, SHA-256 `{digest}`: {grouped(found['observations_used'])} directions were used, of which "
        f"{found['outliers']} are outliers. {image[0].upper()}{image[1:]}. Residuals (root mean square): "
        f"{residual['azimuth']:.2g} degree in azimuth and {residual['zenith']:.2g} in zenith.{lost}",
        "",
        *table(rows),
    ]
    return "\n".join(lines)


def main():
    if len(sys.argv) != 3:
        print(__doc__, file=sys.stderr)
        return 2
    command, folder = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])
    page = PAGE.read_text(encoding="utf-8")
    for mark, (name, options) in RECORDINGS.items():
        if not (folder / name).exists():
            print(f"{folder / name} is not there: its text stays as it is")
            continue
        begin, end = f"<!-- begin {mark} -->\n", f"<!-- end {mark} -->"
        before, rest = page.split(begin)
        page = before + begin + text_of(command, folder / name, options) + "\n" + end + rest.split(end)[1]
        print(f"{mark}: written")
    PAGE.write_text(page, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
