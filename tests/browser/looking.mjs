// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What is in the pixels of a page, read back inside of it: window.looking.

function install() {
  const besides = ['toolbox', 'legend', 'visualMap', 'tooltip', 'axisPointer'];
  const tolerance = 28; // of colours, of 255
  const entry = (k) => window.risley.charts[k];
  const model = (k) => entry(k).chart.getModel();

  async function pixelsOf(url) {
    const image = new Image();
    image.src = url;
    await image.decode();
    const canvas = document.createElement('canvas');
    canvas.width = image.naturalWidth;
    canvas.height = image.naturalHeight;
    const pen = canvas.getContext('2d', { willReadFrequently: true });
    pen.drawImage(image, 0, 0);
    return pen.getImageData(0, 0, canvas.width, canvas.height);
  }

  // As red, green and blue, of any colour that CSS knows.
  function parts(colour) {
    const canvas = document.createElement('canvas');
    canvas.width = canvas.height = 1;
    const pen = canvas.getContext('2d', { willReadFrequently: true });
    pen.fillStyle = colour;
    pen.fillRect(0, 0, 1, 1);
    return [...pen.getImageData(0, 0, 1, 1).data].slice(0, 3);
  }

  const named = (name) =>
    parts(getComputedStyle(document.documentElement).getPropertyValue('--' + name).trim());
  const panelOf = (k) => parts(getComputedStyle(entry(k).place.closest('figure')).backgroundColor);

  // The diagram without what stands around it, on its panel.
  function picture(k) {
    return pixelsOf(entry(k).chart.getDataURL({
      pixelRatio: 1, backgroundColor: 'rgb(' + panelOf(k) + ')', excludeComponents: besides,
    }));
  }

  // Where the data of a flat diagram are, in pixels of its place.
  function area(k) {
    const grid = model(k).getComponent('grid');
    if (!grid) {
      const { width, height } = entry(k).place.getBoundingClientRect();
      return { x: 0, y: 0, width: width, height: height };
    }
    const { x, y, width, height } = grid.coordinateSystem.getRect();
    return { x, y, width, height };
  }

  const extents = (k) =>
    ['xAxis', 'yAxis'].map((name) => model(k).getComponent(name).axis.scale.getExtent().slice());

  // Whether a colour is a tone laid over the panel, at least so thickly.
  function isTone(pixel, panel, tone, thinnest) {
    const way = tone.map((v, i) => v - panel[i]);
    const from = panel.map((v, i) => pixel[i] - v);
    const square = way.reduce((sum, v) => sum + v * v, 0);
    if (square < 400) return false; // nobody could see it
    const share = way.reduce((sum, v, i) => sum + v * from[i], 0) / square;
    if (share < thinnest || share > 1.1) return false;
    return Math.hypot(...way.map((v, i) => from[i] - Math.min(share, 1) * v)) < tolerance;
  }

  function tonesOf(k, series) {
    if (series.value.length === 0) return [named(series.colour)];
    const ends = entry(k).chart.getOption().visualMap[0].inRange.color.map(parts);
    const tones = [];
    for (let i = 0; i + 1 < ends.length; ++i) {
      for (let t = 0; t < 1; t += 0.1) tones.push(ends[i].map((v, j) => v + t * (ends[i + 1][j] - v)));
    }
    return tones;
  }

  // Series that page.js says it hides until asked for.
  const isHidden = (k, series) =>
    (entry(k).chart.getOption().legend[0]?.selected ?? {})[series.label] === false;

  // Of every series: how many points were looked for, how many of them lie on a pixel of the
  // series' own colour and of any colour that is not the panel's, and how much of the diagram has
  // the series' colour.
  async function drawn(k) {
    const one = entry(k), image = await picture(k), panel = panelOf(k), box = area(k);
    const at = (x, y) => {
      const i = 4 * (Math.round(y) * image.width + Math.round(x));
      return [image.data[i], image.data[i + 1], image.data[i + 2]];
    };
    const near = [[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, -1], [1, -1], [-1, 1]];
    const quiet = [panel, named('grid')];
    const isQuiet = (pixel) =>
      quiet.some((colour) => Math.hypot(...colour.map((v, i) => v - pixel[i])) < 12);
    return one.data.series.map((series) => {
      const tones = tonesOf(k, series);
      const memory = new Map();
      const isOwn = (pixel) => {
        const key = (pixel[0] << 16) | (pixel[1] << 8) | pixel[2];
        if (!memory.has(key)) {
          memory.set(key, tones.some((tone) => isTone(pixel, panel, tone, 0.3)));
        }
        return memory.get(key);
      };
      const found = {
        label: series.label, hidden: isHidden(k, series), values: 0, looked: 0, own: 0, any: 0,
        pixels: 0,
      };
      for (let i = 0; i < series.x.length; ++i) {
        if (Number.isFinite(series.x[i]) && Number.isFinite(series.y[i]) && series.x[i] !== null &&
            series.y[i] !== null) ++found.values;
      }
      for (let y = Math.ceil(box.y); y < box.y + box.height; ++y) {
        for (let x = Math.ceil(box.x); x < box.x + box.width; ++x) {
          if (isOwn(at(x, y))) ++found.pixels;
        }
      }
      if (one.data.kind === 'space') return found;
      const stride = Math.ceil(series.x.length / 2000);
      for (let i = 0; i < series.x.length; i += stride) {
        if (series.x[i] === null || series.y[i] === null || series.value[i] === null) continue;
        const [x, y] = one.chart.convertToPixel({ gridIndex: 0 }, [series.x[i], series.y[i]]);
        if (x < box.x + 2 || x > box.x + box.width - 2 || y < box.y + 2 ||
            y > box.y + box.height - 2) continue;
        ++found.looked;
        const seen = near.map(([a, b]) => at(x + a, y + b));
        const isItsOwn = seen.some(isOwn);
        if (isItsOwn) ++found.own;
        if (isItsOwn || !seen.every(isQuiet)) ++found.any;
      }
      return found;
    });
  }

  // Share of pixels that are clearly of another colour: lines may shift by a part of a pixel.
  async function difference(one, other) {
    const [a, b] = [await pixelsOf(one), await pixelsOf(other)];
    if (a.width !== b.width || a.height !== b.height) return 1;
    let count = 0;
    for (let i = 0; i < a.data.length; i += 4) {
      if (Math.hypot(...[0, 1, 2, 3].map((k) => a.data[i + k] - b.data[i + k])) > 100) ++count;
    }
    return count / (a.data.length / 4);
  }

  // Share of pixels that are not of the commonest colour.
  async function busyShare(url) {
    const { data } = await pixelsOf(url);
    const counts = new Map();
    for (let i = 0; i < data.length; i += 4) {
      const key = (data[i] << 16) | (data[i + 1] << 8) | data[i + 2];
      counts.set(key, (counts.get(key) ?? 0) + 1);
    }
    return 1 - Math.max(...counts.values()) / (data.length / 4);
  }

  // A point of a flat diagram that can be pointed at: well inside, in the middle of its series.
  function pointToHover(k) {
    const one = entry(k), box = area(k);
    for (const [index, series] of one.data.series.entries()) {
      if (isHidden(k, series)) continue;
      for (let n = 0; n < series.x.length; ++n) {
        const i = (n + Math.floor(series.x.length / 2)) % series.x.length;
        if (series.x[i] === null || series.y[i] === null) continue;
        const [x, y] = one.chart.convertToPixel({ gridIndex: 0 }, [series.x[i], series.y[i]]);
        if (x < box.x + 6 || x > box.x + box.width - 6 || y < box.y + 6 ||
            y > box.y + box.height - 6) continue;
        return { series: index, point: i, x: x, y: y };
      }
    }
    return null;
  }

  // What the tooltip says, and whether these are values of points near a pixel: by both axes, or
  // along the first one alone.
  function tooltip(k, x, y) {
    const one = entry(k);
    const tip = [...one.place.children].find(
      (child) => child.tagName === 'DIV' && !child.querySelector('canvas'));
    const style = tip && getComputedStyle(tip);
    const visible = Boolean(tip) && style.visibility === 'visible' && style.opacity !== '0' &&
      style.display !== 'none' && tip.textContent.length > 0;
    const text = visible ? tip.textContent : '';
    const numbers = (text.match(/: ?(-?[\d.]+(e[+-]?\d+)?)/g) ?? [])
      .map((match) => Number(match.replace(/: ?/, '')));
    // As far as a value can be told from the others along its axis, whichever series they are of.
    const spread = (axis) => {
      const known = one.data.series.flatMap((series) => series[axis]).filter((v) => v !== null);
      return known.reduce((a, v) => Math.max(a, Math.abs(v - known[0])), 0);
    };
    const spreads = { x: spread('x'), y: spread('y') };
    const says = (value, axis) => numbers.some(
      (number) => Math.abs(number - value) <= 1e-5 * Math.max(spreads[axis], Math.abs(value) * 1e-9));
    const lines = one.data.series.some(({ kind }) => kind === 'line' || kind === 'steps');
    const right = one.data.series.some((series) => series.x.some((value, i) => {
      if (value === null || series.y[i] === null) return false;
      if (!says(value, 'x') || !says(series.y[i], 'y')) return false;
      const [px, py] = one.chart.convertToPixel({ gridIndex: 0 }, [value, series.y[i]]);
      const reach = series.kind === 'cells' ? 60 : 8;
      return Math.abs(px - x) < reach && (lines || Math.abs(py - y) < reach);
    }));
    return { visible, text, right };
  }

  window.looking = { area, extents, drawn, busyShare, difference, pointToHover, tooltip, parts };
}

export const look = (tab) => tab.evaluate(install);
