// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Shows the events of a running recording. Texts from the network are inserted only as text.
"use strict";

const kSilenceMs = 3000; // between two events
let before = null, heard = 0, over = false;

function element(name, text, className) {
  const made = document.createElement(name);
  if (text !== undefined) made.textContent = text;
  if (className) made.className = className;
  return made;
}

function row(cells, head) {
  const line = element("tr");
  for (const cell of cells) line.append(element(head ? "th" : "td", cell));
  return line;
}

const count = (value) => value.toLocaleString("en").replaceAll(",", "\u202f");
// A number with a minus sign as wide as the plus, and none for values shown as zero.
const number = (value, digits) => {
  const text = Math.abs(value).toFixed(digits);
  return (value < 0 && Number(text) !== 0 ? "\u2212" : "") + text;
};
const signed = (value, digits) => {
  const text = number(value, digits);
  return text.startsWith("\u2212") || Number(text) === 0 ? text : "+" + text;
};

// As many decimals as show two digits of a sigma.
function decimals(sigma) {
  if (!(sigma > 0)) return 6;
  return Math.min(9, Math.max(0, 1 - Math.floor(Math.log10(sigma))));
}

function rate(sensor, seconds) {
  const last = before && before.sensors.find((one) => one.serial === sensor.serial);
  if (!last || !(seconds > 0)) return "\u2013";
  return count(Math.round((sensor.rows - last.rows) / seconds)) + " / s";
}

function opticsState(optics) {
  if (optics.words) return ["not watched: " + optics.words, "care"];
  if (optics.alarm) {
    const a = optics.alarm;
    const what = a.kind === "changed" ? "Alarm: the optics have changed" : "Alarm: the optics differ from those of " +
      optics.reference;
    return [`${what}: ${a.parameter} by ${signed(a.difference, decimals(a.sigma))} \u00b1 ` +
      `${a.sigma.toFixed(decimals(a.sigma))} if nothing else differs${optics.alarmed ? "" : "; the last checks no longer show it"}`, "alarm"];
  }
  if (optics.reason) return ["the last shots gave no estimate: " + optics.reason, "care"];
  if (optics.phase === "waiting") return ["waiting for shots", "care"];
  if (optics.phase === "beginning") return ["getting to know the unit", "care"];
  return ["no change seen since the beginning", ""];
}

function opticsParts(optics) {
  const parts = [];
  const [words, kind] = opticsState(optics);
  parts.push(element("p", "Optics: " + words, ("state " + kind).trim()));
  if (optics.speeds.length > 0) {
    parts.push(element("p", "Rotors: " + optics.speeds.map((one) =>
      `${number(one.deg_per_s, decimals(one.sigma_deg_per_s))} \u00b1 ` +
      one.sigma_deg_per_s.toFixed(decimals(one.sigma_deg_per_s))).join(", ") + " deg/s"));
  }
  if (optics.dropped_packets > 0) {
    parts.push(element("p", `The estimate was too slow for ${count(optics.dropped_packets)} packets; ` +
      "the file has them."));
  }
  if (optics.parameters.length === 0) return parts;
  const table = element("table");
  table.append(element("caption", `Parameters over the last ${optics.window_s.toFixed(1)} s`));
  table.append(row(["parameter", "value", "\u00b1 sigma", "since the beginning", "\u00b1 sigma",
    "from " + optics.reference, "\u00b1 sigma"], true));
  for (const one of optics.parameters) {
    const change = decimals(one.change_sigma), off = decimals(one.off_reference_sigma);
    table.append(row([one.name, number(one.value, decimals(one.sigma)), one.sigma.toFixed(decimals(one.sigma)),
      signed(one.change, change), one.change_sigma.toFixed(change),
      signed(one.off_reference, off), one.off_reference_sigma.toFixed(off)]));
  }
  parts.push(table);
  return parts;
}

function sensorSection(sensor, seconds) {
  const section = element("section");
  section.append(element("h2", `${sensor.sensor} ${sensor.serial}`));
  if (sensor.silent) section.append(element("p", "Nothing comes from it.", "state care"));
  const table = element("table");
  table.append(row(["observations", "rate", "packets", "lost", "dropped by the kernel", "rejected"], true));
  table.append(row([count(sensor.rows), rate(sensor, seconds), count(sensor.packets), count(sensor.lost),
    count(sensor.kernel_drops), count(sensor.rejected)]));
  section.append(table);
  if (sensor.status) {
    const bad = Object.values(sensor.status).some((one) => one !== "normal");
    section.append(element("p", "It says: " + Object.entries(sensor.status).map(([name, value]) =>
      `${name} ${value}`).join(", "), bad ? "state care" : ""));
  }
  if (sensor.report) {
    const { work_state: state, time_sync: sync, temperature_deg_c: temperature, says } = sensor.report;
    const words = [state, sync && `time from ${sync === "none" ? "its own clock" : sync}`,
      temperature !== null && `${temperature.toFixed(1)} \u00b0C`, ...says];
    section.append(element("p", "It says: " + words.filter(Boolean).join(", "),
      says.length > 0 || state === "error" ? "state care" : ""));
  }
  if (sensor.publishing) section.append(element("p", ...publishedWords(sensor)));
  section.append(...scanFigure(sensor));
  if (sensor.optics) section.append(...opticsParts(sensor.optics));
  return section;
}

// The scan of a sensor as it grows: azimuth (to the left, as seen from the sensor) by zenith,
// coloured by range.
const kMostShots = 60000, kLongestSide = 1800, kLargestHeight = 900;
const scans = new Map(); // by serial number

function newScan() {
  const scan = { figure: element("figure"), canvas: element("canvas"), words: element("figcaption"), shots: [] };
  scan.canvas.setAttribute("role", "img");
  scan.figure.append(scan.canvas, scan.words);
  return scan;
}

// The least and the greatest of each quantity, with some margin, so that not every shot moves them.
function widened(bounds, shots) {
  let result = bounds;
  for (const shot of shots) {
    if (result && shot.every((value, i) => value >= result[i][0] && value <= result[i][1])) continue;
    result = shot.map((value, i) => [Math.min(value, result ? result[i][0] : value),
      Math.max(value, result ? result[i][1] : value)]);
  }
  return result;
}

function draw(scan, shots) {
  const [[left, right], [top, bottom], [near, far]] = scan.bounds;
  const pen = scan.canvas.getContext("2d");
  for (const [azimuth, zenith, range] of shots) {
    const share = far > near ? Math.log(range / near) / Math.log(far / near) : 0;
    pen.fillStyle = `hsl(${240 * (1 - share)} 90% 50%)`;
    pen.fillRect((right - azimuth) * scan.scale, (zenith - top) * scan.scale, 2, 2);
  }
}

function grow(scan, shots) {
  if (shots.length === 0) return;
  const bounds = widened(scan.bounds, shots);
  scan.shots = scan.shots.concat(shots).slice(-kMostShots);
  if (bounds === scan.bounds) {
    draw(scan, shots);
    return;
  }
  scan.bounds = bounds;
  const [[left, right], [top, bottom], [near, far]] = bounds;
  const width = Math.max(right - left, 0.1), height = Math.max(bottom - top, 0.1);
  scan.scale = Math.min(kLongestSide / width, kLargestHeight / height);
  scan.canvas.width = Math.ceil(width * scan.scale) + 2;
  scan.canvas.height = Math.ceil(height * scan.scale) + 2;
  scan.words.textContent = `Scan: azimuth ${number(right, 1)}\u00b0 to ${number(left, 1)}\u00b0 from left to right, ` +
    `zenith ${number(top, 1)}\u00b0 to ${number(bottom, 1)}\u00b0 downwards, range ${near.toFixed(1)} m (blue) to ` +
    `${far.toFixed(1)} m (red)`;
  scan.canvas.setAttribute("aria-label", scan.words.textContent);
  draw(scan, scan.shots);
}

function scanFigure(sensor) {
  if (!scans.has(sensor.serial)) scans.set(sensor.serial, newScan());
  const scan = scans.get(sensor.serial);
  grow(scan, sensor.seen);
  return scan.shots.length > 0 ? [scan.figure] : [];
}

function publishedWords(sensor) {
  const about = sensor.publishing;
  if (about.words) return ["Points: none, " + about.words, "state care"];
  return [`Points: ${count(sensor.published)} published, made with ${about.calibration}` +
    (sensor.latency_ms === null ? "" : `; 99 % of the frames within ${sensor.latency_ms.toFixed(0)} ms`), ""];
}

function show(state) {
  const seconds = before ? state.duration_s - before.duration_s : 0;
  document.getElementById("sensors").replaceChildren(
    ...state.sensors.map((sensor) => sensorSection(sensor, seconds)));
  before = state;
  heard = Date.now();
  over = state.over;
  tellLink();
}

function tellLink() {
  const link = document.getElementById("link");
  let words = "Waiting for the recording.";
  if (before) {
    words = `${before.duration_s.toFixed(1)} s recorded.`;
    if (over) words += " The recording is over.";
    else if (Date.now() - heard > kSilenceMs) words += " No packets arrive from it any more.";
  }
  if (link.textContent !== words) link.textContent = words;
}

const events = new EventSource("/events");
events.onmessage = (event) => show(JSON.parse(event.data));
setInterval(tellLink, 1000);
