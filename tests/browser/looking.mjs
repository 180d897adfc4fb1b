// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What is in the pixels of a page, read back inside of it: window.looking.

function install() {
  if (window.looking) return; // and all that is remembered
  const besides = ['toolbox', 'legend', 'visualMap', 'tooltip', 'axisPointer'];
  const tolerance = 28; // of colours, of 255
  const entry = (k) => window.risley.charts[k];
  const model = (k) => entry(k).chart.getModel();

  const sketch = document.createElement('canvas').getContext('2d', { willReadFrequently: true });

  // Every pixel as one number: alpha, blue, green and red, from the highest byte to the lowest.
  function pixelsOf(image, width, height) {
    Object.assign(sketch.canvas, { width, height }); // clears it, too
    sketch.drawImage(image, 0, 0);
    const { data } = sketch.getImageData(0, 0, width, height);
    return { width, height, words: new Uint32Array(data.buffer) };
  }

  const colourOf = (word) => [word & 255, (word >> 8) & 255, (word >> 16) & 255];

  // How often each number is there.
  function census(words) {
    const counts = new Map();
    for (let from = 0, to = 0; from < words.length; from = to) {
      while (to < words.length && words[to] === words[from]) ++to; // neighbours are mostly alike
      counts.set(words[from], (counts.get(words[from]) ?? 0) + to - from);
    }
    return counts;
  }

  // A diagram as it is now. As getDataURL() of ECharts, but PNG takes long to write and to read.
  function picture(k, { without = [], ...options } = {}) {
    const { chart } = entry(k);
    const views = without.flatMap((mainType) => chart.getModel().queryComponents({ mainType }))
      .map((component) => chart.getViewOfComponentModel(component))
      .filter((view) => !view.group.ignore);
    const ignore = (whether) => views.forEach(({ group }) => { group.ignore = whether; });
    ignore(true);
    const canvas = chart.renderToCanvas(options);
    ignore(false);
    return pixelsOf(canvas, canvas.width, canvas.height);
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
  const bare = (k) => picture(k, {
    pixelRatio: 1, backgroundColor: 'rgb(' + panelOf(k) + ')', without: besides,
  });

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

  let followed, notes;
  document.addEventListener('keydown', () => {
    if (followed === undefined) return;
    notes.push({ extents: extents(followed), spoken: document.getElementById('spoken').textContent });
  });

  // From now on, notes what every key does to a diagram.
  function followKeys(k) {
    followed = k;
    notes = [];
  }

  const keyNotes = () => notes;

  // What came of the mouse lately, for complaints.
  let mouse = [];
  for (const type of ['pointerenter', 'pointerdown', 'pointermove', 'pointerup', 'pointercancel', 'scroll']) {
    document.addEventListener(type, ({ clientX, clientY, shiftKey }) => {
      mouse = [...mouse.slice(-19), [type, clientX, clientY, shiftKey ? 'Shift' : ''].join(' ').trim()];
    }, true);
  }
  const mouseNotes = () => mouse.join(', ');

  // Whether a colour is a tone laid over the panel, at least so thickly.
  function isTone(pixel, panel, tone, thinnest) {
    const way = tone.map((v, i) => v - panel[i]);
    const from = panel.map((v, i) => pixel[i] - v);
    const square = way.reduce((sum, v) => sum + v * v, 0);
    if (square < 400) return false; // too small to see
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
  function drawn(k) {
    const one = entry(k), image = bare(k), panel = panelOf(k), box = area(k);
    const at = (x, y) => image.words[Math.round(y) * image.width + Math.round(x)];
    const near = [[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, -1], [1, -1], [-1, 1]];
    const onceEach = (judge) => {
      const memory = new Map();
      return (word) => {
        if (!memory.has(word)) memory.set(word, judge(colourOf(word)));
        return memory.get(word);
      };
    };
    const quiet = [panel, named('grid')];
    const isQuiet = onceEach((pixel) =>
      quiet.some((colour) => Math.hypot(...colour.map((v, i) => v - pixel[i])) < 12));
    const left = Math.ceil(box.x), right = Math.ceil(box.x + box.width);
    const inside = [];
    for (let y = Math.ceil(box.y); y < box.y + box.height; ++y) {
      inside.push(...census(image.words.subarray(y * image.width + left, y * image.width + right)));
    }
    return one.data.series.map((series) => {
      const tones = tonesOf(k, series);
      const isOwn = onceEach((pixel) => tones.some((tone) => isTone(pixel, panel, tone, 0.3)));
      const found = {
        label: series.label, hidden: isHidden(k, series), values: 0, looked: 0, own: 0, any: 0,
        pixels: 0,
      };
      for (let i = 0; i < series.x.length; ++i) {
        if (Number.isFinite(series.x[i]) && Number.isFinite(series.y[i]) && series.x[i] !== null &&
            series.y[i] !== null) ++found.values;
      }
      for (const [word, count] of inside) found.pixels += isOwn(word) ? count : 0;
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

  const albums = new Map();

  // Keeps how all diagrams look now.
  const remember = (album) => { albums.set(album, window.risley.charts.map((_, k) => picture(k))); };

  // Whether two pictures are the same, and the share of pixels that are clearly of another colour:
  // lines may shift by a part of a pixel.
  function difference(a, b) {
    if (a.width !== b.width || a.height !== b.height) return { same: false, share: 1 };
    let same = true, count = 0;
    for (let i = 0; i < a.words.length; ++i) {
      if (a.words[i] === b.words[i]) continue;
      same = false;
      const apart = [0, 8, 16, 24].map((bit) =>
        ((a.words[i] >>> bit) & 255) - ((b.words[i] >>> bit) & 255));
      if (Math.hypot(...apart) > 100) ++count;
    }
    return { same, share: count / a.words.length };
  }

  // Of every diagram, between two albums.
  const differences = (one, other) =>
    albums.get(one).map((picture, k) => difference(picture, albums.get(other)[k]));

  // The size of a picture, and the share of its pixels that are not of the commonest colour.
  async function seen(url) {
    const image = new Image();
    image.src = url;
    await image.decode();
    const { width, height, words } = pixelsOf(image, image.naturalWidth, image.naturalHeight);
    return { size: [width, height], busy: 1 - Math.max(...census(words).values()) / words.length };
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
    const numbers = visible ? [...tip.querySelectorAll('b')].map((one) => Number(one.textContent)) : [];
    // As far as a value differs visibly from the others along its axis, whichever series they are of.
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

  window.looking = { area, extents, drawn, seen, remember, differences, pointToHover, tooltip,
    followKeys, keyNotes, mouseNotes };
}

export const look = (tab) => tab.evaluate(install);
