#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
"""A tripod on the map: stations by targets and by poses, one file for all of them, and sigmas that hold."""
import math
import os
import statistics
import unittest

import las_file
from command import SOURCE, CommandTest, codes_of

SEEDS = int(os.environ.get("RISLEY_SEEDS", 2))
ORIGIN = (1000.0, 2000.0, 100.0)  # of the scene on the map: X east, Y north
WALLS = [((1, 0, 0), 30), ((0, 1, 0), 5), ((0, -1, 0), 5), ((0, 0, 1), 4), ((0, 0, -1), 1.5)]
# Balls of 0.3 m on the ground of a hall, seen from three stations.
BALLS = [(18, -3.5, 0.3), (24, 4, 1.2), (15, 1, -1), (26, -4, 2), (12, -0.5, 0.9)]
STATIONS = [("a", (0, 0, 0), 0, 0, 0), ("b", (3, -2, 0.3), 1, 2, 4), ("c", (2, 2, -0.2), -2, 1, -5)]
RADIUS = 0.15
# Of the end wall, a year later: middle (Y, Z), width, height, by how much. 10 mm at 30 m is to be found.
BUMPS = [(-3.4, 0, 2.2, 2), (0, 0, 2.2, 2), (3.4, 0, 2.2, 2), (-3.4, 2.8, 2.2, 2), (0, 2.8, 2.2, 2),
         (3.4, 2.8, 2.2, 2)]
BUMPS = [(*where, depth) for where, depth in zip(BUMPS, (0.001, 0.010, 0.002, 0.005, 0.020, 0.050))]


def rotation(roll, pitch, yaw):
    """Of angles about X, then Y, then Z, deg: scene from sensor, row by row."""
    (sr, cr), (sp, cp), (sy, cy) = ((math.sin(math.radians(a)), math.cos(math.radians(a)))
                                    for a in (roll, pitch, yaw))
    return ((cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
            (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
            (-sp, cp * sr, cp * cr))


def seen_from(station, place):
    """A place of the scene in the frame of a station's sensor."""
    _, position, *angles = station
    turn = rotation(*angles)
    off = [a - b for a, b in zip(place, position)]
    return [sum(turn[row][axis] * off[row] for row in range(3)) for axis in range(3)]


def scene(patches=""):
    """@param patches  of the end wall"""
    text = (SOURCE / "data" / "hall.yaml").read_text(encoding="utf-8") + "people:\n"
    if patches:
        text = text.replace("normal_azimuth_deg: 0, normal_zenith_deg: 90}",
                            f"normal_azimuth_deg: 0, normal_zenith_deg: 90, patches: [{patches}]}}", 1)
    for i, (x, y, z) in enumerate(BALLS):
        feet = f"[{x}, {y}, {z - RADIUS}]"
        text += (f"  - {{name: ball {i}, from_m: {feet}, to_m: {feet}, speed_m_per_s: 0, "
                 f"size_m: [{2 * RADIUS}, {2 * RADIUS}]}}\n")
    text += "stations:\n"
    for name, position, roll, pitch, yaw in STATIONS:
        text += (f"  - {{name: {name}, position_m: {list(position)}, roll_deg: {roll}, "
                 f"pitch_deg: {pitch}, yaw_deg: {yaw}}}\n")
    return text


def targets(noise, sigma, crs=""):
    """The stations with their balls, each place on the map off by noise()."""
    places = [[o + c + noise() for o, c in zip(ORIGIN, ball)] for ball in BALLS]
    text = "risley_stations: 1\n" + (f"crs: {crs}\n" if crs else "") + "stations:\n"
    for station in STATIONS:
        text += f"  - name: {station[0]}\n    targets:\n"
        for i, (ball, place) in enumerate(zip(BALLS, places)):
            near = [round(c + 0.03 * (-1)**(i + k), 2) for k, c in enumerate(seen_from(station, ball))]
            text += (f"      - {{name: ball {i}, place_m: {place}, sigma_m: {[sigma] * 3}, "
                     f"in_scan_m: {near}, radius_m: {RADIUS}}}\n")
    return text


def normal_of(seed):
    """Numbers that are nearly normal, from a generator of its own."""
    state = seed * 7919 + 12345

    def draw():
        nonlocal state
        total = 0.0
        for _ in range(12):
            state = (1103515245 * state + 12345) % 2**31
            total += state / 2**31
        return total - 6
    return draw


class StationTest(CommandTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        (cls.folder / "scene.yaml").write_text(scene())
        # Towards the sensor.
        (cls.folder / "later.yaml").write_text(scene(", ".join(
            f"{{name: bump {i}, center_m: [{y}, {z}], size_m: [{width}, {height}], depth_m: {-depth}}}"
            for i, (y, z, width, height, depth) in enumerate(BUMPS))))

    def survey(self, seed, where="scene.yaml", sigma=0.002, seconds=4):
        """Three recordings of a bent unit, and the targets' file."""
        draw = normal_of(seed)
        for name, *_ in STATIONS:
            self.expect(0, "simulate", "-o", f"{name}.lvx", "--sensor", "mid-40-table3", "--reported",
                        "nominal", "--scene", where, "--station", name, "--duration-s", seconds,
                        "--seed", 10 * seed + ord(name), "--quiet")
        (self.folder / "targets.yaml").write_text(targets(lambda: sigma * draw(), sigma))

    def calibrate(self):
        self.expect(0, "calibrate", "a.lvx", "b.lvx", "c.lvx", "-o", "cal", "--walls", "flat", "--quiet",
                    "--no-report", "--force")

    def cloud(self, status, stations, *more, inputs=("a.lvx", "b.lvx", "c.lvx"), output="all.las"):
        command = ("cloud", *inputs, "--station", stations, "--calibration", "cal", "-o", output,
                   "--beam-divergence", "no", *more)
        return self.expect_json(0, *command) if status == 0 else self.expect(status, *command)

    def distances(self, name, factors, of_station, every=17):
        """Of points: squares of their distances from their wall over the variances; of patches of a
        wall as a station sees it, that of the mean with all that its points share."""
        points, patches = [], {}
        for row in las_file.read(self.folder / name, every)[0]:
            place = [c - o for c, o in zip(row["at"], ORIGIN)]
            off = sorted((abs(sum(n * c for n, c in zip(normal, place)) - d), k)
                         for k, (normal, d) in enumerate(WALLS))
            if off[0][0] > 0.12 or off[1][0] < 0.3:
                continue
            if any(math.dist(place, ball) < 0.4 for ball in BALLS):
                continue
            k = off[0][1]
            normal, d = WALLS[k]
            axis = [abs(n) for n in normal].index(1)
            distance = sum(n * c for n, c in zip(normal, place)) - d
            variance, own = row["Variance" + "XYZ"[axis]], row["OwnVariance" + "XYZ"[axis]]
            points.append(distance**2 / variance)
            other = [round(c / 2) for i, c in enumerate(place) if i != axis]
            patch = patches.setdefault((k, row["source"], *other), [0, 0.0, 0.0, [0.0] * factors])
            patch[0] += 1
            patch[1] += distance
            patch[2] += own
            for f in range(factors):
                patch[3][f] += normal[axis] * row[f"Loading{f + 1}{'XYZ'[axis]}"]
        means = [(total / n)**2 / (own / n**2 + sum((f / n)**2 for f in loading))
                 for n, total, own, loading in patches.values() if n > 30]
        self.assertLessEqual(of_station, factors)
        return points, means

    def test_errors_on_the_map_are_as_stated(self):
        point_sum = point_count = patch_sum = patch_count = 0
        for seed in range(1, SEEDS + 1):
            self.survey(seed)
            self.calibrate()
            made = self.cloud(0, "targets.yaml", "--common-factors", "yes")
            self.assertEqual([one["name"] for one in made["stations"]], ["a", "b", "c"])
            self.assertNotIn("targets_doubtful", codes_of(made))
            for one, (_, position, *_) in zip(made["stations"], STATIONS):
                self.assertEqual(one["fit"]["degrees_of_freedom"], 9)
                for value, sigma, c, o in zip(*one["position_m"].values(), position, ORIGIN):
                    self.assertLess(abs(value - c - o), 5 * sigma)
            points, means = self.distances("all.las", len(made["common_factors"]),
                                           made["factors_of_one_station"])
            point_sum, point_count = point_sum + sum(points), point_count + len(points)
            patch_sum, patch_count = patch_sum + sum(means), patch_count + len(means)
            print(f"seed {seed}: points {math.sqrt(sum(points) / len(points)):.3f}, means of patches "
                  f"{math.sqrt(sum(means) / len(means)):.3f} of {len(means)}")
        points, patches = math.sqrt(point_sum / point_count), math.sqrt(patch_sum / patch_count)
        print(f"{SEEDS} seeds: errors over sigmas: points {points:.3f}, means of patches {patches:.3f}")
        self.assertAlmostEqual(points, 1, delta=0.1)
        # Patches of one survey share most of their errors: a survey counts as ten.
        self.assertAlmostEqual(patches, 1, delta=0.1 + 2 / math.sqrt(20 * SEEDS))


    def test_bumps_are_found_as_stated_and_little_else(self):
        false = unchanged = 0
        ratios = []
        found = {depth: [0, 0, 0.0] for *_, depth in BUMPS}  # cells, found, stated
        normal = statistics.NormalDist()
        for seed in range(1, SEEDS + 1):
            self.survey(100 + seed)
            self.calibrate()
            self.cloud(0, "targets.yaml", "--common-factors", "yes", output="before.las")
            self.survey(200 + seed, "later.yaml")
            self.cloud(0, "targets.yaml", "--common-factors", "yes", output="after.las")
            change = self.expect_json(0, "compare", "before.las", "after.las")
            self.assertGreater(change["shared_factors"], 3)
            limit = change["detection_sigmas"]
            self.assertAlmostEqual(limit, normal.inv_cdf(1 - 0.005), places=6)
            own = [0, 0]
            for cell in change["cells"]:
                x, y, z = (c - o for c, o in zip(cell["place_m"], ORIGIN))
                if any(math.dist((x, y, z), ball) < 0.8 for ball in BALLS):
                    continue
                near = [(depth, max(abs(y - at_y) - 0.5 * width, abs(z - at_z) - 0.5 * height))
                        for at_y, at_z, width, height, depth in BUMPS] if x > 29.5 else []
                for depth, beyond in near:
                    if beyond > -0.35:
                        continue
                    shift = depth / cell["sigma_m"]
                    found[depth][0] += 1
                    found[depth][1] += cell["significant"]
                    found[depth][2] += normal.cdf(shift - limit) + normal.cdf(-shift - limit)
                if all(beyond > 0.5 for _, beyond in near):
                    own[0] += 1
                    own[1] += cell["significant"]
                    ratios.append((cell["distance_m"] / cell["sigma_m"])**2)
            print(f"seed {seed}: {own[1]} of {own[0]} unchanged cells alarm")
            unchanged, false = unchanged + own[0], false + own[1]
        ratio = math.sqrt(sum(ratios) / len(ratios))
        print(f"{SEEDS} seeds: false alarms {false / unchanged:.4f}, distances over sigmas {ratio:.3f}")
        for depth, (cells, seen, stated) in found.items():
            print(f"bump of {1e3 * depth:g} mm: found in {seen / cells:.3f} of {cells} cells, stated {stated / cells:.3f}")
            # A survey counts as four independent cells of a bump.
            self.assertAlmostEqual(seen / cells, stated / cells, delta=0.05 + 1 / math.sqrt(4 * SEEDS))
        # 1 % is stated; a survey counts as ten independent cells.
        self.assertLess(false / unchanged, 0.01 + 4 * math.sqrt(0.01 / (10 * SEEDS)))
        cells, seen, _ = found[0.010]
        self.assertGreater(seen / cells, 0.8)
        self.assertEqual(found[0.050][0], found[0.050][1])

    def test_a_flight_and_a_tripod_are_compared(self):
        origin = "{latitude_deg: 50, longitude_deg: 8.5, ellipsoidal_height_m: 250}"
        village = (SOURCE / "data" / "village.yaml").read_text(encoding="utf-8")
        (self.folder / "village.yaml").write_text(
            village + "stations: [{name: mast, position_m: [0, 0, 8], pitch_deg: 10, yaw_deg: 45}]\n")
        (self.folder / "flight.yaml").write_text(
            f"risley_flight: 1\norigin: {origin}\nstart: {{scale: gps-second-of-week, time_s: 208800, "
            "gps_week: 2422}\nrate_hz: 200\nheight_m: 60\nspeed_m_per_s: 5\nturn_duration_s: 10\n"
            "strips: [{headings_deg: [45, 225], length_m: 60}]\n")
        (self.folder / "mast.yaml").write_text(
            "risley_stations: 1\nstations:\n  - name: mast\n"
            "    position: {latitude_deg: 50, longitude_deg: 8.5, ellipsoidal_height_m: 258, "
            "sigma_m: [0.004, 0.004, 0.006]}\n"
            "    attitude: {roll_deg: 0, pitch_deg: -10, heading_deg: 45, sigma_deg: [0.01, 0.01, 0.02]}\n")
        errors = SOURCE / "data" / "trajectory-errors.yaml"
        mount = SOURCE / "data" / "mount-nadir.yaml"
        make = ("--crs", "EPSG:25832", "--common-factors", "yes", "--beam-divergence", "no",
                "--calibration", "mid-40")
        self.expect(0, "simulate", "-o", "mast.lvx", "--scene", "village.yaml", "--station", "mast",
                    "--duration-s", "3", "--quiet")
        self.expect(0, "simulate", "-o", "air.lvx", "--scene", "village.yaml", "--flight", "flight.yaml",
                    "--mount", mount, "--trajectory-errors", errors, "--rate-hz", "20000", "--quiet")
        self.expect_json(0, "cloud", "mast.lvx", "--station", "mast.yaml", *make, "-o", "mast.las")
        self.expect_json(0, "cloud", "air.lvx", "--trajectory", "air.lvx.trajectory.csv", "--mount", mount,
                         "--trajectory-errors", errors, *make, "-o", "air.las")
        change = self.expect_json(0, "compare", "mast.las", "air.las")
        self.assertEqual(change["shared_factors"], 0)
        cells = change["cells"]
        self.assertGreater(len(cells), 100)
        # The trajectory's errors are those of one flight: all cells share them.
        ratio = math.sqrt(sum((one["distance_m"] / one["sigma_m"])**2 for one in cells) / len(cells))
        sigma = sorted(one["sigma_m"] for one in cells)[len(cells) // 2]
        print(f"flight and tripod: {len(cells)} cells, sigma {1e3 * sigma:.1f} mm, distances over sigmas "
              f"{ratio:.2f}, {change['significant']:.3f} alarm")
        self.assertLess(ratio, 2.5)
        self.assertGreater(sigma, 0.01)
        self.assertLess(sigma, 0.2)


if __name__ == "__main__":
    unittest.main()
