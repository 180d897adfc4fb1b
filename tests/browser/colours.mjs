// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// How colours look with colour blindness. Colours are texts such as "#0b76e0".

// Linear RGB as dichromats see it: Machado, Oliveira, Fernandes 2009, severity 1.
export const eyes = {
  all: [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
  'no red': [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216],
             [-0.003882, -0.048116, 1.051998]],
  'no green': [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413],
               [-0.01182, 0.04294, 0.968881]],
  'no blue': [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602],
              [0.004733, 0.691367, 0.3039]],
};

const times = (matrix, vector) =>
  matrix.map((row) => row.reduce((sum, value, i) => sum + value * vector[i], 0));

function linear(colour) {
  const parts = /^#(..)(..)(..)$/.exec(colour).slice(1).map((part) => parseInt(part, 16) / 255);
  return parts.map((part) => (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4));
}

const xyzFromRgb = [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.072175],
                    [0.0193339, 0.119192, 0.9503041]]; // sRGB, D65
const white = [0.95047, 1, 1.08883];

// CIELAB of a colour as an eye sees it.
export function lab(colour, eye = eyes.all) {
  const seen = times(eye, linear(colour)).map((part) => Math.min(Math.max(part, 0), 1));
  const [x, y, z] = times(xyzFromRgb, seen).map((value, i) => {
    const share = value / white[i];
    return share > 216 / 24389 ? Math.cbrt(share) : (24389 / 27 * share + 16) / 116;
  });
  return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
}

export const difference = (a, b, eye) => {
  const [p, q] = [lab(a, eye), lab(b, eye)];
  return Math.hypot(...p.map((value, i) => value - q[i]));
};

// Of the Web Content Accessibility Guidelines: 1 to 21.
export function contrast(a, b) {
  const [dark, light] = [a, b].map((one) => times(xyzFromRgb, linear(one))[1]).sort((p, q) => p - q);
  return (light + 0.05) / (dark + 0.05);
}
