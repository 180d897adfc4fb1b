#!/usr/bin/python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""Fills in docs/sensors.md: draws the scan of every preset, counts how it fills its field of view,
and compares its optics with those that public simulators ship.

Usage: sensors_page.py RISLEY
  RISLEY  the built command
Needs numpy. Writes between the marks of the page, and docs/images/patterns/*.svg.
"""
import itertools
import json
import pathlib
import re
import subprocess
import sys
import tempfile
from xml.etree import ElementTree

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "sensors.md"
PICTURES = ROOT / "docs" / "images" / "patterns"

DURATION = 0.1  # s, of a picture
SIDE = 420      # of a picture, pixels
COLOURS = ("#1f6feb", "#d9730d", "#1a7f5a", "#8250df", "#cf222e", "#5b6470")
TYPES = ("mid-40", "mid-70", "avia", "horizon", "tele-15", "mid-360")  # that have a section

# What HELIOS++ ships: python/helios/data/scanners_tls.xml of
# https://github.com/3dgeo-heidelberg/helios, commit 1b7fa9e3. Angles in degrees, their sign chooses
# the face (positive: the first); speeds in Hz.
HELIOS = {
    "livox_mid-40": {"ours": "mid-40-sequence", "angles": (18.7481, 17.9634),
                     "indices": (1.51, 1.51), "speeds": (-121.5657, 77.7430)},
    "livox_mid-70": {"ours": "mid-70", "angles": (-29.7, 29.7), "indices": (1.5095, 1.5095),
                     "speeds": (-77.733333333, 121.566666666)},
    "livox-avia-non-repetitive": {
        "ours": "avia-sequence", "angles": (30.8856, 29.7735, 3.1351),
        "indices": (1.51, 1.51, 1.51), "speeds": (-131.5463, 40.8032, 213.1611),
        "beams": (-0.05216070, -0.03237635, -0.01079672, 0.01079672, 0.03237635, 0.05300785)},
}


class Risley:
    def __init__(self, command, folder):
        self.command, self.folder = command, pathlib.Path(folder)

    def __call__(self, *words):
        done = subprocess.run([self.command, *map(str, words)], capture_output=True, text=True,
                              check=False)
        if done.returncode != 0:
            raise SystemExit(f"risley {' '.join(map(str, words))}: {done.stderr}")
        return done.stdout

    def json(self, *words):
        return json.loads(self(*words, "--json"))

    def values(self, preset):
        """{name: (value, source)} of a preset's lines."""
        line = re.compile(r'^\s+(\w+): \{value: ([^,]+), .*source: "(.*)"\}', re.MULTILINE)
        text = self("preset", "show", preset)
        found = {name: (float(value), source) for name, value, source in line.findall(text)}
        order = re.search(r"^face_order: (\S+)", text, re.MULTILINE).group(1)
        emitters = re.search(r"^emitters: (\d+)", text, re.MULTILINE)
        return found, order.split("-"), int(emitters.group(1)) if emitters else 1

    def start(self, preset):
        """What a preset that does not say where its rotors start needs."""
        return [] if "\nsequence:" in self("preset", "show", preset) else ["--start-angles-deg", "0,0"]


# ---- pictures ----

def picture(risley, preset, emitters):
    """The scan's first tenth of a second, as one looks out: left is left. One line per emitter. A
    sensor that sees all around is drawn as a panorama, azimuth against elevation."""
    path = risley.folder / "pattern.npy"
    risley("pattern", "--sensor", preset, "--format", "npy", "-o", path, "--duration-s", DURATION,
           *risley.start(preset))
    azimuth, elevation = np.load(path).T.astype(float)
    around = np.ptp(azimuth) > np.pi
    if around:
        left, up = azimuth, elevation
    else:
        x = np.cos(elevation) * np.cos(azimuth)
        scale = np.sqrt(2 / (1 + x))  # Lambert's equal-area map
        left, up = scale * np.cos(elevation) * np.sin(azimuth), scale * np.sin(elevation)
    half = 1.03 * max(np.abs(left).max(), np.abs(up).max())
    fine = 4  # steps of a pixel
    points = np.rint(fine * SIDE / 2 * np.stack([1 - left / half, 1 - up / half], 1)).astype(int)
    thin = max(1, round(len(points) / emitters / 1100))
    lines = []
    for emitter in range(emitters):
        line = points[emitter::emitters][::thin]
        steps = np.diff(line, axis=0)
        if around:  # steps of a thinned scan go right around
            path = "".join(f"M{a} {b}h0" for a, b in line)
        else:
            path = f"M{line[0][0]} {line[0][1]}l" + " ".join(f"{a} {b}" for a, b in steps)
        lines.append(f'<path d="{path.replace(" -", "-")}" stroke="{COLOURS[emitter]}"/>')
    degrees = np.degrees(half)
    bar = 10 if degrees > 12 else 2
    length = round(fine * SIDE * bar / (2 * degrees))
    size = fine * SIDE
    caps = ' stroke-linecap="round"' if around else ""
    text = (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size} {size}" width="{SIDE}" '
            f'height="{SIDE}" role="img"><title>{preset}: {DURATION} s</title>'
            f'<rect width="{size}" height="{size}" fill="#fff"/>'
            f'<g fill="none" stroke-width="{9 if around else 3}" stroke-opacity="0.75"'
            f'{caps}>{"".join(lines)}</g>'
            f'<path d="M40 {size - 40}h{length}" stroke="#1b1f24" stroke-width="6"/>'
            f'<text x="40" y="{size - 60}" font-family="sans-serif" font-size="56" fill="#1b1f24">'
            f'{bar}°</text></svg>\n')
    (PICTURES / f"{preset}.svg").write_text(text, encoding="utf-8")


# ---- tables ----

def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return lines + ["| " + " | ".join(map(str, row)) + " |" for row in rows]


def optics(risley, presets):
    rows = []
    for preset in presets:
        values, faces, emitters = risley.values(preset)
        prisms = []
        for letter, face in zip("abc", faces):
            angles = [values[name] for name in (
                f"entrance_face_{letter}_deg", f"exit_face_{letter}_deg",
                f"mirror_face_{letter}_deg", f"wedge_angle_{letter}_deg") if name in values]
            if not angles:
                angles = [values["wedge_angle_deg"]]
            index = values.get("refractive_index") or values[f"refractive_index_{letter}"]
            speed = values[f"angular_velocity_{letter}_deg_per_s"]
            shape = " and ".join(f"{angle[0]:.6g}°" for angle in angles)
            prisms.append(f"{face} {shape}, {index[0]:.6g}, {speed[0] / 6:+.6g} rpm")
        beams = f"{emitters}"
        if emitters > 1:
            axis = "vertical" if values["incident_beam_1_vertical_deg"][0] else "horizontal"
            first = values[f"incident_beam_1_{axis}_deg"][0]
            last = values[f"incident_beam_{emitters}_{axis}_deg"][0]
            beams = f"{emitters}, {min(first, last):.4f}° to {max(first, last):.4f}°"
        rows.append((f"`{preset}`", "<br>".join(prisms), beams))
    return table(("preset", "prisms in the order of the beam: faces, wedge, index, speed", "emitters"), rows)


def gallery(presets):
    lines = []
    for first in range(0, len(presets), 3):
        three = presets[first:first + 3]
        lines.append("| " + " | ".join(f"`{one}`" for one in three) + " |")
        if first == 0:
            lines.append("|" + "---|" * 3)
        lines.append("| " + " | ".join(
            f"![scan of {one}](images/patterns/{one}.svg)" for one in three) + " |")
    return lines


def reach(field):
    """How far a field of view goes from the X axis, or of one all around from where to where."""
    if "elevation_deg" not in field:
        return f"{field['half_angle_deg']:.2f}"
    return f"{field['elevation_deg']['min']:.2f} to {field['elevation_deg']['max']:.2f}"


def coverage(risley, presets):
    rows = []
    for preset in presets:
        if preset.endswith("-sequence") and preset != "mid-360-sequence":
            continue  # covers as much as its type, to 1 %
        found = risley.json("pattern", "--sensor", preset, "--coverage",
                            *risley.start(preset))["coverage"]
        field, until = found["field_of_view"], found["time_to_cover_s"]["90"]
        rows.append((f"`{preset}`", reach(field), f"{field['deg2']:.0f}",
                     *(f"{100 * one['covered']:.1f} %, {one['gap_deg']:.2f}°"
                       for one in found["after"]),
                     "later" if until is None else f"{until:.2f}",
                     f"{found['after'][-1]['density_per_deg2']['mean']:.1f}"))
    return table(("preset", "half angle, deg, or elevations", "field of view, deg²", "0.1 s", "0.2 s", "0.5 s",
                  "1 s", "90 % covered after, s", "shots per deg² after 1 s"), rows)


def carried(risley, presets):
    rows = []
    for preset in presets:
        if preset.startswith("mid-360"):
            continue  # no scanner of HELIOS++ has a mirror behind a wedge
        made = risley.json("pattern", "--sensor", preset, "--format", "helios-xml", "-o",
                           risley.folder / "scanner.xml", *risley.start(preset))
        residual = made["residual"]
        lost = [one.split(":")[0].rstrip(".") for one in made["not_carried"]
                if not one.startswith("A beam divergence")]
        if residual["worst_deg"] < 1e-9:
            continue
        figures = f"{residual['rms_deg']:.3f}, {residual['worst_deg']:.3f}"
        rows.append((f"`{preset}`", figures, "; ".join(lost)))
    return table(("preset", "residual, deg: rms, worst", "what costs it"), rows)


# ---- optics of other simulators ----

def refracted(beam, normal, ratio):
    along = beam - np.sum(beam * normal, -1, keepdims=True) * normal
    bent = ratio * along
    return bent + np.sqrt(1 - np.sum(bent * bent, -1, keepdims=True)) * normal


def directions(entry, rotors, phases):
    """Beams of a HELIOS++ scanner, axes right, forward, up. rotors: [prisms][n], rad."""
    out = []
    for incident in entry["incident"]:
        beam = np.broadcast_to(incident, (len(rotors[0]), 3))
        for angle, index, rotor, phase in zip(entry["angles"], entry["indices"], rotors, phases):
            turned = rotor + phase
            thin = np.stack([np.sin(turned), 0 * turned, np.cos(turned)], -1)
            wedge, flat = np.radians(abs(angle)), np.array([0.0, 1.0, 0.0])
            sign = -1 if angle > 0 else 1
            angled = np.cos(wedge) * flat + sign * np.sin(wedge) * thin
            flat = np.broadcast_to(flat, angled.shape)
            first, second = (angled, flat) if angle > 0 else (flat, angled)
            beam = refracted(refracted(beam, first, 1 / index), second, index)
        out.append(beam)
    return np.concatenate(out)


def best_turn(ours, theirs):
    u, _, v = np.linalg.svd(ours.T @ theirs)
    return u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v


def misfit(ours, theirs):
    apart = ours - theirs @ best_turn(ours, theirs).T
    return np.degrees(2 * np.arcsin(0.5 * np.linalg.norm(apart, axis=1)))


def difference(ours, theirs):
    """Angles between two trains at the same rotor angles, after the best turn of the whole and the
    best phase of every rotor; deg. With one emitter the rotors cannot be distinguished: the better way counts."""
    grid = np.linspace(0, 2 * np.pi, 49)[:-1] + 0.01
    a, b = (one.ravel() for one in np.meshgrid(grid, grid))
    own = directions(ours, [a, b], [0, 0])
    if len(theirs["angles"]) == 3:
        return aligned(own, theirs, [a, b, 2 * b - a])  # what the third one stands in for
    return min(aligned(own, theirs, rotors) for rotors in ([a, b], [b, a]))


def aligned(own, theirs, rotors):
    best = None
    for start in itertools.product(np.arange(4) * np.pi / 2, repeat=len(rotors) - 1):
        phases = np.array([0.0, *start])  # a common one is a turn

        def cost(free):
            return np.sqrt(np.mean(misfit(own, directions(theirs, rotors, free)) ** 2))
        step, now = 0.4, cost(phases)
        while step > 1e-6:
            moved = False
            for k in range(1, len(phases)):
                for sign in (-1, 1):
                    trial = phases.copy()
                    trial[k] += sign * step
                    value = cost(trial)
                    if value < now:
                        phases, now, moved = trial, value, True
            if not moved:
                step /= 3
        if best is None or now < best[0]:
            best = now, misfit(own, directions(theirs, rotors, phases)).max()
    return best


def half_angle(found):
    return np.degrees(np.arccos(found[:, 1].min()))


def of_xml(path):
    scanner = ElementTree.parse(path).getroot().find("scanner")
    count = 3 if scanner.get("angle3_deg") else 2
    beams = [[float(one.get(axis)) for axis in "xyz"] for one in scanner.iter("incidentBeam")]
    return {"angles": [float(scanner.get(f"angle{k + 1}_deg")) for k in range(count)],
            "indices": [float(scanner.get(f"refrIndex{k + 1}")) for k in range(count)],
            "speeds": [float(scanner.get(f"rotorFreq{k + 1}_Hz")) for k in range(count)],
            "incident": beams or [[0.0, 1.0, 0.0]]}


def simulators(risley):
    def prisms(entry):
        return "<br>".join(
            f"{'AP' if angle > 0 else 'PA'} {abs(angle):.6g}°, {index:.6g}, {60 * speed:+.5g} rpm"
            for angle, index, speed in zip(entry["angles"], entry["indices"], entry["speeds"]))
    rows = []
    for name, entry in HELIOS.items():
        path = risley.folder / "scanner.xml"
        risley("pattern", "--sensor", entry["ours"], "--format", "helios-xml", "-o", path)
        ours = of_xml(path)
        theirs = dict(entry)
        theirs["incident"] = [[x, np.sqrt(1 - x * x), 0.0] for x in entry.get("beams", (0.0,))]
        grid = np.linspace(0, 2 * np.pi, 181)
        a, b = (one.ravel() for one in np.meshgrid(grid, grid))
        widest = [half_angle(directions(one, [a, b, 2 * b - a][:len(one["angles"])],
                                        [0] * len(one["angles"]))) for one in (ours, theirs)]
        rms, worst = difference(ours, theirs)
        rows.append((f"`{name}`", prisms(theirs), f"`{entry['ours']}`", prisms(ours),
                     f"{widest[1]:.2f} / {widest[0]:.2f}", f"**{rms:.3f}**, {worst:.3f}"))
    return table(("scanner of HELIOS++", "its prisms", "ours", "its prisms",
                  "half angle, deg: theirs / ours", "difference, deg: rms, worst"), rows)


def main():
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    PICTURES.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        risley = Risley(pathlib.Path(sys.argv[1]).resolve(), folder)
        presets = sorted((one["name"] for one in risley.json("preset", "list")["presets"]),
                         key=lambda name: ([name.startswith(one) for one in TYPES].index(True), name))
        for preset in presets:
            picture(risley, preset, risley.values(preset)[2])
        parts = {
            "gallery": gallery(presets),
            "optics": optics(risley, presets),
            "coverage": coverage(risley, presets),
            "helios": carried(risley, presets),
            "simulators": simulators(risley),
        }
    page = PAGE.read_text(encoding="utf-8")
    for mark, lines in parts.items():
        begin, end = f"<!-- begin {mark} -->\n", f"<!-- end {mark} -->"
        before, rest = page.split(begin)
        page = before + begin + "\n".join(lines) + "\n" + end + rest.split(end)[1]
    PAGE.write_text(page, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
