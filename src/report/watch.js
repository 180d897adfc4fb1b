// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Shows the events of a recording that runs. Texts from the network go into the page as text alone.
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
// A number with a minus sign as long as the plus, and none before what is shown as zero.
const number = (value, digits) => {
  const text = Math.abs(value).toFixed(digits);
  return (value < 0 && Number(text) !== 0 ? "\u2212" : "") + text;
};
const signed = (value, digits) => {
  const text = number(value, digits);
  return text.startsWith("\u2212") || Number(text) === 0 ? text : "+" + text;
};

// As many decimals as leave two digits of a sigma.
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
    const what = a.kind === "changed" ? "Alarm: the optics have changed" : "Alarm: the optics are not those of " +
      optics.reference;
    return [`${what}: ${a.parameter} by ${signed(a.difference, decimals(a.sigma))} \u00b1 ` +
      `${a.sigma.toFixed(decimals(a.sigma))} if nothing else differs${optics.alarmed ? "" : "; the last looks see nothing of it"}`, "alarm"];
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
  if (sensor.optics) section.append(...opticsParts(sensor.optics));
  return section;
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
    else if (Date.now() - heard > kSilenceMs) words += " Nothing is heard of it any more.";
  }
  if (link.textContent !== words) link.textContent = words;
}

const events = new EventSource("/events");
events.onmessage = (event) => show(JSON.parse(event.data));
setInterval(tellLink, 1000);
