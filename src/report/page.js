// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Draws the diagrams in the JSON of the element "page-data" with Apache ECharts.
// window.risley.charts: [{data, chart}] of the unfolded sections once <html data-drawn="N"> is set,
// which counts them.
(function () {
  'use strict';
  const page = document.documentElement;
  const data = JSON.parse(document.getElementById('page-data').textContent);
  const margins = { left: 74, right: 24, top: 36, bottom: 52 };
  const legendHeight = 18, scaleHeight = 36, narrow = 500, narrowSpace = 700; // pixels
  const barWidth = 64; // of the colour scale
  const zoomStep = 0.8, panStep = 0.1, turnStep = 10;
  const thinnestBox = 8; // pixels
  const leastWidth = 100; // pixels of a figure, its margins included
  const longestPause = 200; // ms
  const growth = 10_000; // ms, duration of the animation
  let drawn = [];

  // ECharts derives the height of a line from the width of this character, which is almost zero if
  // no font has it.
  const pen = document.createElement('canvas').getContext('2d');
  echarts.setPlatformAPI({
    measureText: (text, font) => {
      pen.font = font;
      return text === '国' ? { width: parseFloat(/([\d.]+)px/.exec(pen.font)[1]) }
                          : pen.measureText(text);
    },
  });

  const colour = (name) => getComputedStyle(page).getPropertyValue('--' + name).trim();
  const sequential = colour('sequential').split(' ');
  const rounded = (value, digits) =>
    value === null || value === undefined ? '–' : String(Number(Number(value).toPrecision(digits)));
  const short = (value) => rounded(value, 6);
  // 12345 as "12 345", with non-breaking spaces, as in the text of the page.
  const grouped = (value) => {
    const [whole, part] = String(value).split('.');
    return whole.replace(/(?<=\d)(?=(\d{3})+$)/g, '\u202f') + (part ? '.' + part : '');
  };
  const finite = (values) => values.filter((v) => v !== null);
  const least = (values) => finite(values).reduce((a, b) => Math.min(a, b), Infinity);
  const most = (values) => finite(values).reduce((a, b) => Math.max(a, b), -Infinity);
  const every = (one, key) => one.series.flatMap((series) => series[key]);
  // Digits that distinguish values: more than six if they differ little.
  const digitsOf = (values) => {
    const from = least(values), to = most(values), size = Math.max(Math.abs(from), Math.abs(to));
    if (!(to > from) || !Number.isFinite(size)) return 6;
    return Math.min(6 + Math.max(0, Math.ceil(Math.log10(size / (to - from)))), 15);
  };
  const dateText = (time) => new Date(time).toISOString().slice(0, 10);
  // Ticks of an axis. They stand at round numbers.
  const marks = (values) => {
    const tiny = Math.max(Math.abs(least(values)), Math.abs(most(values))) < 1e-6;
    return (value) => {
      const round = Number(value.toPrecision(12));
      if (round === 0 || tiny) return round === 0 ? '0' : round.toExponential();
      if (Math.abs(round) >= 10_000) return grouped(round);
      return Math.abs(round) < 1e-6 ? round.toFixed(12).replace(/0+$/, '') : String(round);
    };
  };
  // Width of the upright axis's numbers between it and its title.
  const titleGap = (one) => {
    const text = marks(every(one, 'y'));
    const ends = [least(every(one, 'y')), most(every(one, 'y'))].filter(Number.isFinite);
    return Math.max(52, ...ends.map((end) => 16 + 7 * text(Number(end.toPrecision(3))).length));
  };
  const leftMargin = (one) => titleGap(one) + margins.left - 52;
  const legendRow = (one) => (one.series.length > 1 ? legendHeight : 0);
  const hasValues = (one) => one.series.some((series) => series.value.length > 0);

  // ---- two dimensions ----

  function axis(label, gap, values) {
    return {
      type: 'value', scale: true, name: label, nameLocation: 'middle', nameGap: gap,
      nameTextStyle: { color: colour('ink') },
      axisLabel: { color: colour('muted'), hideOverlap: true, formatter: marks(values) },
      axisLine: { show: true, lineStyle: { color: colour('muted') } },
      splitLine: { lineStyle: { color: colour('grid') } },
    };
  }

  // Equal scales on both axes: the wider span of the two.
  function mapLimits(one) {
    const x = [least(every(one, 'x')), most(every(one, 'x'))];
    const y = [least(every(one, 'y')), most(every(one, 'y'))];
    if (!Number.isFinite(x[0] + y[0])) return [{}, {}];
    const half = 0.52 * Math.max(x[1] - x[0], y[1] - y[0], 1e-9);
    const unit = Math.pow(10, Math.floor(Math.log10(half))) / 5;
    const wide = Math.ceil((2 * half) / unit) * unit / 2;
    return [x, y].map((v) => {
      const middle = Math.round((v[0] + v[1]) / unit) * unit / 2;
      return { min: middle - wide, max: middle + wide };
    });
  }

  // Half the width and height of a diagram's symbols about their places.
  const halfCell = (one, key) => Math.max(...one.series.map((series) => series[key])) / 2;

  // All around: equal scales, and limits at round numbers.
  function panoramaLimits(one) {
    const from = least(every(one, 'y')) - halfCell(one, 'cell_height');
    const to = most(every(one, 'y')) + halfCell(one, 'cell_height');
    const y = Number.isFinite(from + to)
      ? { min: Math.floor(from / 20) * 20, max: Math.ceil(to / 20) * 20 } : { min: -90, max: 90 };
    return [{ min: -180, max: 180 }, y];
  }

  function cells(series) {
    return {
      type: 'custom', name: series.label, clip: true,
      progressive: 0, // complete at once: a picture for the printer cannot wait
      encode: { x: 0, y: 1 },
      data: series.x.map((x, i) => [x, series.y[i], series.value[i]]),
      renderItem: (params, api) => {
        const w = series.cell_width, h = series.cell_height;
        const from = api.coord([api.value(0) - w / 2, api.value(1) - h / 2]);
        const to = api.coord([api.value(0) + w / 2, api.value(1) + h / 2]);
        return {
          type: 'rect',
          shape: {
            x: Math.min(from[0], to[0]), y: Math.min(from[1], to[1]),
            width: Math.abs(to[0] - from[0]) + 0.5, height: Math.abs(to[1] - from[1]) + 0.5,
          },
          style: { fill: api.visual('color') },
        };
      },
    };
  }

  function flatSeries(series) {
    if (series.kind === 'cells') return cells(series);
    const points = series.x.map((x, i) => [x, series.y[i]]);
    const tone = colour(series.colour);
    if (series.kind === 'points') {
      return {
        type: 'scatter', name: series.label, data: points, itemStyle: { color: tone },
        symbolSize: points.length < 500 ? 5 : 2.4, large: points.length > 1000, largeThreshold: 1000,
        progressive: 0,
      };
    }
    const steps = series.kind === 'steps';
    return {
      type: 'line', name: series.label, data: points, showSymbol: false, connectNulls: false,
      step: steps ? 'middle' : false, itemStyle: { color: tone },
      lineStyle: { color: tone, width: steps ? 1 : 1.6, type: series.dashed ? 'dashed' : 'solid' },
      areaStyle: steps ? { color: tone, opacity: 0.3, origin: 'start' } : undefined,
      emphasis: { disabled: true },
    };
  }

  // One standard deviation down and up.
  function bars(series) {
    const stroke = colour(series.colour), half = 3; // pixels, of the ends
    return {
      type: 'custom', name: series.label, clip: true, silent: true, progressive: 0,
      encode: { x: 0, y: [1, 2] },
      data: series.x.map((x, i) =>
        [x, series.y[i] - series.sigma[i], series.y[i] + series.sigma[i]]),
      renderItem: (params, api) => {
        const [low, high] = [1, 2].map((k) => api.coord([api.value(0), api.value(k)]));
        const line = (x1, y1, x2, y2) => ({ type: 'line', shape: { x1, y1, x2, y2 }, style: { stroke } });
        return {
          type: 'group',
          children: [
            line(low[0], low[1], low[0], high[1]),
            ...[low, high].map(([x, y]) => line(x - half, y, x + half, y)),
          ],
        };
      },
    };
  }

  function tip(one) {
    const escaped = echarts.format.encodeHTML; // names come from files
    const row = (name, value) => escaped(name) + ': <b>' + value + '</b>';
    const digits = { x: digitsOf(every(one, 'x')), y: digitsOf(every(one, 'y')) };
    const across = (item) =>
      row(one.x_label, one.dates ? dateText(item.value[0]) : rounded(item.value[0], digits.x));
    const bar = (item) => {
      const sigma = one.series[item.seriesIndex].sigma;
      return sigma ? ' ± ' + rounded(sigma[item.dataIndex], 2) : '';
    };
    const text = (item) => {
      const rows = [across(item), row(one.y_label, rounded(item.value[1], digits.y) + bar(item))];
      if (one.z_label) rows.push(row(one.z_label, short(item.value[2])));
      const value = item.value[one.z_label ? 3 : 2];
      if (one.value_label && value !== undefined) rows.push(row(one.value_label, short(value)));
      return (item.seriesName ? escaped(item.seriesName) + '<br>' : '') + rows.join('<br>');
    };
    // Of several lines at one place: the place, and a line for each.
    const texts = (items) => [across(items[0]), ...items.map((item) =>
      row(item.seriesName || one.y_label, rounded(item.value[1], digits.y)))].join('<br>');
    const lines = one.series.some((series) => series.kind === 'line' || series.kind === 'steps');
    return {
      trigger: lines ? 'axis' : 'item', confine: true, transitionDuration: 0,
      axisPointer: { type: 'line', snap: true, lineStyle: { color: colour('muted') } },
      backgroundColor: colour('paper'), borderColor: colour('muted'),
      textStyle: { color: colour('ink'), fontSize: 12 },
      formatter: (items) => (Array.isArray(items) ? texts(items) : text(items)),
    };
  }

  // below: beneath the diagram, if it is too narrow for a scale beside it.
  function colourScale(one, dimension, below) {
    const values = every(one, 'value');
    const range = one.value_range || [least(values), most(values)];
    const diverging = ['low', 'low-half', 'middle', 'high-half', 'high'].map(colour);
    return {
      type: 'continuous', dimension: dimension, min: range[0], max: range[1], calculable: false,
      ...(below ? { orient: 'horizontal', left: 'center', bottom: 0 } : { right: 0, top: 'middle' }),
      itemHeight: 150, itemWidth: 12, precision: 6, formatter: short,
      text: [range[1], range[0]].map((end) => marks(range)(Number(rounded(end, 2)))),
      seriesIndex: one.series.flatMap((series, i) => (series.value.length > 0 ? [i] : [])),
      inRange: { color: one.palette === 'diverging' ? diverging : sequential },
      textStyle: { color: colour('muted') },
    };
  }

  function flatOption(one, below) {
    const square = one.kind === 'map' || one.kind === 'ground';
    const scaled = hasValues(one);
    const x = axis(one.x_label, 30, every(one, 'x'));
    if (one.dates) Object.assign(x, { type: 'time', axisLabel: { color: colour('muted'), hideOverlap: true } });
    const y = axis(one.y_label, titleGap(one), every(one, 'y'));
    if (square) {
      const limits = mapLimits(one);
      const turned = one.kind === 'map'; // as one looks out
      Object.assign(x, limits[0], { inverse: turned, position: 'bottom' });
      Object.assign(y, limits[1], { inverse: turned, position: 'left' });
      // The ends are not round numbers.
      for (const one of [x, y]) Object.assign(one.axisLabel, { showMinLabel: false, showMaxLabel: false });
    }
    if (one.kind === 'panorama') {
      const limits = panoramaLimits(one);
      Object.assign(x, limits[0], { inverse: true, position: 'bottom', interval: below ? 90 : 45 });
      Object.assign(y, limits[1], { position: 'left', interval: below ? 40 : 20 });
    }
    if (one.kind === 'full_turn' || one.kind === 'two_turns') {
      Object.assign(x, { min: 0, max: 360, interval: 60 });
    }
    if (one.kind === 'two_turns') Object.assign(y, { min: 0, max: 360, interval: 60 });
    x.axisLine.onZero = false;
    y.axisLine.onZero = false;
    const zoom = (key) => ({
      type: 'inside', [key]: 0, filterMode: 'none', zoomOnMouseWheel: 'ctrl',
      moveOnMouseMove: 'shift', moveOnMouseWheel: false, preventDefaultMouseMove: false,
    });
    return {
      animation: false, backgroundColor: 'transparent',
      grid: {
        ...margins, top: margins.top + legendRow(one), left: leftMargin(one),
        right: margins.right + (scaled && !below ? barWidth : 0),
        bottom: margins.bottom + (scaled && below ? scaleHeight : 0), containLabel: false,
        outerBoundsMode: 'none',
      },
      xAxis: x, yAxis: y,
      legend: {
        show: one.series.length > 1, top: 0, left: leftMargin(one), type: 'scroll',
        itemWidth: 16, itemHeight: 8,
        textStyle: { color: colour('ink') }, inactiveColor: colour('grid'),
        pageTextStyle: { color: colour('ink') },
      },
      tooltip: tip(one),
      toolbox: {
        right: 0, top: legendRow(one), itemSize: 13, iconStyle: { borderColor: colour('muted') },
        emphasis: { iconStyle: { borderColor: colour('a') } },
        feature: {
          dataZoom: {
            xAxisIndex: 0, yAxisIndex: 0, filterMode: 'none',
            title: { zoom: 'Draw a box to zoom', back: 'One zoom back' },
          },
          restore: { title: 'Show all again' },
          saveAsImage: { title: 'Save as PNG', name: one.id, pixelRatio: 2 },
        },
      },
      dataZoom: [zoom('xAxisIndex'), zoom('yAxisIndex')],
      visualMap: scaled ? [colourScale(one, 2, below)] : [],
      series: [...one.series.map(flatSeries),
               ...one.series.filter((series) => series.sigma).map(bars)],
    };
  }

  // ---- three dimensions ----

  function spaceOption(one, below) {
    const span = (key) => {
      const values = every(one, key);
      return [least(values), most(values)];
    };
    const spans = ['x', 'y', 'z'].map(span);
    const widest = Math.max(...spans.map(([a, b]) => b - a), 1e-9);
    const axis3d = (name, [min, max]) => ({
      type: 'value', name: name, min: Math.floor(min), max: Math.ceil(max), splitNumber: 4,
      nameGap: 20, nameTextStyle: { color: colour('ink'), fontSize: 14 },
      axisLabel: {
        color: colour('muted'), fontSize: 12, margin: 10,
        formatter: (value) => (value > Math.floor(min) && value < Math.ceil(max) ? short(value) : ''),
      },
      axisLine: { lineStyle: { color: colour('muted') } },
      splitLine: { lineStyle: { color: colour('grid') } },
    });
    const box = (k) => Math.max(100 * (spans[k][1] - spans[k][0]) / widest, 4);
    return {
      animation: false, backgroundColor: 'transparent',
      tooltip: tip(one),
      toolbox: {
        right: 0, top: legendRow(one), itemSize: 13, iconStyle: { borderColor: colour('muted') },
        emphasis: { iconStyle: { borderColor: colour('a') } },
        feature: {
          saveAsImage: {
            title: 'Save as PNG', name: one.id, pixelRatio: window.devicePixelRatio || 1,
          },
        },
      },
      legend: {
        show: one.series.length > 1, top: 0, left: 10, type: 'scroll',
        itemWidth: 16, itemHeight: 8,
        textStyle: { color: colour('ink') }, inactiveColor: colour('grid'),
      },
      visualMap: hasValues(one) ? [colourScale(one, 3, below)] : [],
      xAxis3D: axis3d(one.x_label, spans[0]),
      yAxis3D: axis3d(one.y_label, spans[1]),
      zAxis3D: axis3d(one.z_label, spans[2]),
      grid3D: {
        left: 0, right: hasValues(one) && !below ? barWidth : 0, top: -30, bottom: below ? 30 : 0,
        boxWidth: box(0), boxDepth: box(1), boxHeight: box(2),
        viewControl: {
          alpha: 25, beta: -50, distance: below ? 170 : 140, zoomSensitivity: 1, animation: false,
        },
        postEffect: { enable: false }, temporalSuperSampling: { enable: false },
        axisPointer: { show: false },
      },
      series: one.series.map((series) => ({
        type: 'scatter3D', name: series.label, symbolSize: series.x.length < 3000 ? 6 : 3,
        itemStyle: series.value.length > 0 ? { opacity: 0.9 }
                                           : { color: colour(series.colour), opacity: 0.9 },
        data: series.x.map((x, i) => {
          const place = [x, series.y[i], series.z[i]];
          if (series.value.length === 0) return place;
          place.push(series.value[i]);
          return series.value[i] === null ? { value: place, itemStyle: { opacity: 0 } } : place;
        }),
      })),
    };
  }

  // ---- what a hand does with a diagram ----

  function limitsNow(chart) {
    return [0, 1].map((k) => {
      const zoom = chart.getOption().dataZoom[k];
      return [zoom.start, zoom.end];
    });
  }

  function show(chart, limits) {
    limits.forEach(([from, to], k) => {
      const width = Math.min(to - from, 100);
      const start = Math.min(Math.max(from, 0), 100 - width);
      chart.dispatchAction({ type: 'dataZoom', dataZoomIndex: k, start: start, end: start + width });
    });
  }

  const showAll = (chart) => show(chart, [[0, 100], [0, 100]]);

  function zoomBy(chart, factor) {
    show(chart, limitsNow(chart).map(([from, to]) => {
      const middle = 0.5 * (from + to), half = 0.5 * factor * (to - from);
      return [middle - half, middle + half];
    }));
  }

  function panBy(chart, one, right, up) {
    const turned = { map: [true, true], panorama: [true, false] }[one.kind] || [false, false];
    show(chart, limitsNow(chart).map(([from, to], k) => {
      const step = (turned[k] ? -panStep : panStep) * (k === 0 ? right : up) * (to - from);
      return [from + step, to + step];
    }));
  }

  function turnBy(chart, beta, alpha) {
    const view = chart.getOption().grid3D[0].viewControl;
    chart.setOption({
      grid3D: {
        viewControl: {
          alpha: Math.min(Math.max(view.alpha + alpha, -90), 90), beta: view.beta + beta,
        },
      },
    });
  }

  function nearBy(chart, factor) {
    const view = chart.getOption().grid3D[0].viewControl;
    chart.setOption({ grid3D: { viewControl: { distance: view.distance * factor } } });
  }

  // Reads the values of the points aloud, one after another.
  function step(entry, forward) {
    const series = entry.data.series[0];
    if (!series || series.x.length === 0) return;
    const count = series.x.length;
    entry.point = entry.point === undefined ? 0 : (entry.point + forward + count) % count;
    entry.chart.dispatchAction({ type: 'showTip', seriesIndex: 0, dataIndex: entry.point });
    const value = series.value.length > 0 ? ', ' + short(series.value[entry.point]) : '';
    document.getElementById('spoken').textContent =
      entry.data.x_label + ' ' +
      (entry.data.dates ? dateText(series.x[entry.point])
                        : rounded(series.x[entry.point], digitsOf(series.x))) + ', ' +
      entry.data.y_label + ' ' + rounded(series.y[entry.point], digitsOf(series.y)) + value;
  }

  function onKey(event, entry) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const { chart, data: one } = entry;
    const space = one.kind === 'space';
    const keys = {
      '+': () => (space ? nearBy(chart, zoomStep) : zoomBy(chart, zoomStep)),
      '-': () => (space ? nearBy(chart, 1 / zoomStep) : zoomBy(chart, 1 / zoomStep)),
      ArrowLeft: () => (space ? turnBy(chart, -turnStep, 0) : panBy(chart, one, -1, 0)),
      ArrowRight: () => (space ? turnBy(chart, turnStep, 0) : panBy(chart, one, 1, 0)),
      ArrowUp: () => (space ? turnBy(chart, 0, turnStep) : panBy(chart, one, 0, 1)),
      ArrowDown: () => (space ? turnBy(chart, 0, -turnStep) : panBy(chart, one, 0, -1)),
      0: () => (space ? draw(entry) : showAll(chart)),
      n: () => step(entry, 1),
      p: () => step(entry, -1),
    };
    const act = keys[event.key === '=' ? '+' : event.key];
    if (!act) return;
    act();
    event.preventDefault();
  }

  // ---- the page ----

  // Height over width of a diagram with equal scales.
  function shapeOf(one) {
    if (['map', 'ground', 'two_turns'].includes(one.kind)) return 1;
    if (one.kind !== 'panorama') return null;
    const [x, y] = panoramaLimits(one);
    return (y.max - y.min) / (x.max - x.min);
  }

  // Pixels of a figure without its paddings.
  function room({ place }) {
    const figure = getComputedStyle(place.parentElement);
    return place.parentElement.clientWidth - parseFloat(figure.paddingLeft) -
      parseFloat(figure.paddingRight);
  }
  // Titles of axes in space stand beside them.
  const isNarrow = (entry) => room(entry) < (entry.data.kind === 'space' ? narrowSpace : narrow);

  function size(entry) {
    const shape = shapeOf(entry.data);
    if (shape === null) return;
    const width = Math.min(room(entry), entry.data.kind === 'panorama' ? Infinity : 640);
    const [right, bottom] = !hasValues(entry.data) ? [0, 0]
      : isNarrow(entry) ? [0, scaleHeight] : [barWidth, 0];
    entry.place.style.width = width + 'px';
    entry.place.style.height = shape * (width - leftMargin(entry.data) - margins.right - right) +
      margins.top + legendRow(entry.data) + margins.bottom + bottom + 'px';
  }

  // Whether a box drawn with the mouse zooms.
  function setBoxes(entry, active) {
    if (entry.boxes === active) return;
    entry.boxes = active;
    entry.chart.dispatchAction({
      type: 'takeGlobalCursor', key: 'dataZoomSelect', dataZoomSelectActive: active,
    });
  }

  // again: in other colours, with the current rotation and zoom.
  function draw(entry, again) {
    const one = entry.data;
    entry.below = isNarrow(entry);
    if (one.kind === 'space') {
      const option = spaceOption(one, entry.below);
      if (again) delete option.grid3D.viewControl; // a new camera would need a frame to be set up
      entry.chart.setOption(option, !again);
      return;
    }
    const limits = again ? limitsNow(entry.chart) : null;
    const boxes = entry.boxes;
    if (boxes) setBoxes(entry, false); // otherwise the old toolbox would continue drawing beside
                                       // the new one
    entry.chart.setOption(flatOption(one, entry.below), true);
    if (boxes) setBoxes(entry, true);
    if (entry.grown && !page.dataset.printing) entry.grown.show(); // paper gets all
    if (limits && limits.some(([from, to]) => to - from < 100)) show(entry.chart, limits);
  }

  // Behaviour missing in ECharts: boxes and Shift exclude each other, a box that is hardly more
  // than a line zooms only along it, and without Ctrl the wheel belongs to the page.
  function guideMouse(entry) {
    const { chart, place } = entry;
    let from = null, to = null, limits = null;
    // Only when a mouse arrives: it would draw every diagram twice.
    place.addEventListener('pointerenter', () => setBoxes(entry, true));
    place.addEventListener('pointerdown', (event) => {
      setBoxes(entry, !event.shiftKey);
      from = [event.clientX, event.clientY];
      limits = limitsNow(chart);
    }, true);
    window.addEventListener('pointerup', (event) => {
      to = [event.clientX, event.clientY];
    }, true);
    chart.on('datazoom', (event) => {
      if (!from || !to || event.batch?.[0].startValue === undefined) return; // not by a box
      limits.forEach(([start, end], k) => {
        if (Math.abs(to[k] - from[k]) >= thinnestBox) return;
        chart.dispatchAction({ type: 'dataZoom', dataZoomIndex: k, start: start, end: end });
      });
    });
    for (const name of ['wheel', 'mousewheel']) {
      place.addEventListener(name, (event) => {
        if (!event.ctrlKey) event.stopPropagation();
      }, true);
    }
    chart.getZr().on('dblclick', () => showAll(chart));
  }

  // A button and a slider that show the points of the first series in firing order. It starts
  // slowly, so that the first turns can be followed.
  function addGrowth(entry) {
    const { chart, data: one, place } = entry;
    const all = flatSeries(one.series[0]).data;
    const bar = document.createElement('div');
    const button = document.createElement('button');
    const slider = document.createElement('input');
    const time = document.createElement('output');
    bar.className = 'growth';
    button.type = 'button';
    Object.assign(slider, { type: 'range', min: 0, max: 1000, value: 1000 });
    slider.setAttribute('aria-label', one.title);
    bar.append(button, slider, time);
    place.after(bar);
    let started = null;
    const show = () => {
      const share = Math.pow(slider.value / 1000, 2);
      chart.setOption({ series: [{ data: all.slice(0, Math.ceil(share * all.length)) }] });
      time.textContent = rounded(share * one.grows_for, 3) + ' s';
      slider.setAttribute('aria-valuetext', time.textContent);
    };
    const stop = () => {
      started = null;
      button.textContent = 'Watch it grow';
    };
    const step = (now) => {
      if (started === null) return;
      slider.value = Math.min(1000, 1000 * (now - started) / growth);
      show();
      if (slider.value >= 1000) stop();
      else requestAnimationFrame(step);
    };
    button.addEventListener('click', () => {
      if (started !== null) return stop();
      started = performance.now();
      button.textContent = 'Stop';
      requestAnimationFrame(step);
    });
    slider.addEventListener('input', () => {
      stop();
      show();
    });
    time.textContent = rounded(one.grows_for, 3) + ' s';
    stop();
    entry.grown = { show };
  }

  // Thousands of small dots are painted on their first canvas, unless they are marked as changed: a
  // picture to print or to save would lack them.
  function paintAllOnPictures(chart) {
    const { painter, storage } = chart.getZr();
    const paint = painter.getRenderedCanvas;
    if (!paint) return; // three dimensions
    const renew = () => storage.getDisplayList(true).forEach((one) => one.dirtyShape?.());
    painter.getRenderedCanvas = (options) => {
      renew();
      const canvas = paint.call(painter, options);
      renew();
      return canvas;
    };
  }

  function make(one) {
    const place = document.getElementById(one.id);
    const entry = { data: one, place: place };
    size(entry);
    entry.chart = echarts.init(place);
    paintAllOnPictures(entry.chart);
    draw(entry);
    if (one.kind !== 'space') guideMouse(entry);
    if (one.grows_for && one.kind !== 'space') addGrowth(entry);
    place.addEventListener('keydown', (event) => onKey(event, entry));
    return entry;
  }

  // Three dimensions need WebGL, which remote desktops and old machines lack.
  function makeOrSay(one) {
    try {
      return make(one);
    } catch (error) {
      const place = document.getElementById(one.id);
      echarts.getInstanceByDom(place)?.dispose();
      place.textContent = 'This diagram needs WebGL, which this browser does not offer.';
      place.style.height = 'auto';
      return null;
    }
  }

  function redraw() {
    drawn.forEach((entry) => draw(entry, true));
  }

  // Paper gets pictures in light colours: canvases do not follow the width of a sheet.
  function beforePrint() {
    foldedAgain = sections.filter((one) => !one.open);
    for (const section of foldedAgain) section.open = true;
    drawUnfolded();
    drawn.filter(({ place }) => foldedAgain.some((one) => one.contains(place))).forEach(fit);
    page.dataset.printing = '1';
    redraw();
    drawn.forEach(({ chart, data: one, place }) => {
      const picture = new Image();
      picture.className = 'printed';
      picture.alt = one.title;
      picture.src = chart.getDataURL({ // WebGL gives no picture in another resolution
        pixelRatio: one.kind === 'space' ? chart.getDevicePixelRatio() : 2,
        backgroundColor: '#ffffff', excludeComponents: ['toolbox'],
      });
      place.after(picture);
    });
  }

  function afterPrint() {
    document.querySelectorAll('img.printed').forEach((picture) => picture.remove());
    delete page.dataset.printing;
    for (const section of foldedAgain) section.open = false;
    redraw();
  }

  function setTheme(dark) {
    page.dataset.theme = dark ? 'dark' : 'light';
    redraw();
  }

  // In page order, whenever they were unfolded.
  function keep(entry) {
    drawn.push(entry);
    drawn.sort((a, b) => data.indexOf(a.data) - data.indexOf(b.data));
    if (window.risley) page.dataset.drawn = String(drawn.length);
  }

  // Folded diagrams have no room; they are made when unfolded.
  const isFolded = ({ id }) => document.getElementById(id).closest('details:not([open])') !== null;
  const isDrawn = (one) => drawn.some((entry) => entry.data === one);

  function drawUnfolded() {
    data.filter((one) => !isFolded(one) && !isDrawn(one)).forEach((one) => {
      const entry = one.kind === 'space' ? makeOrSay(one) : make(one);
      if (entry) keep(entry);
    });
  }

  function fit(entry) {
    if (isFolded(entry.data)) return;
    size(entry);
    entry.chart.resize();
    if (entry.below !== isNarrow(entry)) draw(entry, true);
  }

  // Sections open for links that lead into them, and all of them for the button and for paper.
  const sections = [...document.querySelectorAll('details.section')];
  let foldedAgain = [];

  function unfoldTarget() {
    const target = location.hash && document.getElementById(decodeURIComponent(location.hash.slice(1)));
    const section = target && target.closest('details.section');
    if (!section) return;
    section.open = true;
    target.scrollIntoView();
  }

  function addFolding() {
    const button = document.getElementById('unfold');
    const name = () => {
      button.textContent = sections.every((one) => one.open) ? 'Fold all' : 'Unfold all';
    };
    for (const section of sections) {
      section.addEventListener('toggle', () => {
        if (button) name();
        if (!section.open || !page.dataset.begun) return;
        drawUnfolded();
        drawn.filter(({ place }) => section.contains(place)).forEach(fit);
      });
    }
    button?.addEventListener('click', () => {
      const open = !sections.every((one) => one.open);
      for (const section of sections) section.open = open;
    });
    if (button) name();
    window.addEventListener('hashchange', unfoldTarget);
    // A link that was followed before leads there again.
    document.querySelector('.contents')?.addEventListener('click', (event) => {
      if (event.target.hash && event.target.hash === location.hash) unfoldTarget();
    });
    unfoldTarget();
  }

  async function start() {
    const main = document.querySelector('main');
    // A window that is not visible yet has no size, and diagrams cannot be made without one.
    const hasRoom = () => main.clientWidth > leastWidth;
    if (data.length > 0 && !hasRoom()) await new Promise((done) => {
      const watch = new ResizeObserver(() => {
        if (!hasRoom()) return;
        watch.disconnect();
        done();
      });
      watch.observe(main);
    });
    page.dataset.begun = '1';
    let pause = performance.now();
    for (const one of data) {
      if (isFolded(one) || isDrawn(one)) continue;
      const entry = one.kind === 'space' ? makeOrSay(one) : make(one);
      if (entry) keep(entry);
      if (performance.now() - pause < longestPause) continue;
      await new Promise((done) => setTimeout(done)); // the page stays alive meanwhile
      pause = performance.now();
    }
    window.risley = { charts: drawn };
    page.dataset.drawn = String(drawn.length);
    let width = main.clientWidth;
    new ResizeObserver(() => {
      if (main.clientWidth === width || !hasRoom()) return;
      width = main.clientWidth;
      drawn.forEach(fit);
    }).observe(main);
  }

  window.matchMedia('(prefers-color-scheme: dark)')
    .addEventListener('change', (event) => setTheme(event.matches));
  window.addEventListener('beforeprint', beforePrint);
  window.addEventListener('afterprint', afterPrint);
  document.getElementById('theme')
    .addEventListener('click', () => setTheme(page.dataset.theme !== 'dark'));
  addFolding();
  start();
})();
