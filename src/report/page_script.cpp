// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "report/page_assets.hpp"

namespace risley::report {

std::string_view page_script() {
  return R"~js~(// Draws the diagrams that stand as JSON in the element "page-data".
(function () {
  'use strict';
  const charts = JSON.parse(document.getElementById('page-data').textContent);
  let drawn = [];

  function dataset(series, colour) {
    const points = series.x.map((x, i) => ({ x: x, y: series.y[i] }));
    const line = series.kind !== 'points';
    return {
      label: series.label,
      data: points,
      showLine: line,
      stepped: series.kind === 'steps' ? 'middle' : false,
      fill: series.kind === 'steps' ? 'origin' : false,
      borderColor: colour,
      backgroundColor: series.kind === 'steps' ? colour + '55' : colour,
      borderWidth: series.kind === 'steps' ? 1 : 1.5,
      pointRadius: line ? 0 : points.length < 500 ? 2.5 : 1.2,
      pointHitRadius: 4,
      pointBorderWidth: 0,
    };
  }

  // Equal scales on both axes: the wider span of the two.
  function mapLimits(series) {
    const all = (key) => series.flatMap((one) => one[key]).filter((v) => v !== null);
    const range = (v) => [v.reduce((a, b) => Math.min(a, b)), v.reduce((a, b) => Math.max(a, b))];
    const x = range(all('x')), y = range(all('y'));
    const half = Math.ceil(0.52 * Math.max(x[1] - x[0], y[1] - y[0]));
    const limits = (v) => {
      const middle = Math.round(0.5 * (v[0] + v[1]));
      return { min: middle - half, max: middle + half };
    };
    return { x: limits(x), y: limits(y) };
  }

  function draw() {
    drawn.forEach((chart) => chart.destroy());
    const style = getComputedStyle(document.documentElement);
    const colour = (name) => style.getPropertyValue('--' + name).trim();
    drawn = charts.map((chart) => {
      const axis = (label) => ({
        type: 'linear',
        title: { display: true, text: label, color: colour('ink') },
        ticks: { color: colour('muted'), maxRotation: 0, autoSkipPadding: 12 },
        grid: { color: colour('grid'), borderColor: colour('muted') },
      });
      const scales = { x: axis(chart.x_label), y: axis(chart.y_label) };
      if (chart.kind === 'map' && chart.series.some((one) => one.x.length > 0)) {
        const limits = mapLimits(chart.series);
        Object.assign(scales.x, limits.x, { reverse: true });
        Object.assign(scales.y, limits.y, { reverse: true });
      }
      if (chart.kind === 'full_turn') {
        Object.assign(scales.x, { min: 0, max: 360 });
        scales.x.ticks.stepSize = 60;
      }
      return new Chart(document.getElementById(chart.id), {
        type: 'scatter',
        data: { datasets: chart.series.map((one) => dataset(one, colour(one.colour))) },
        options: {
          animation: false,
          locale: 'en',
          responsive: true,
          maintainAspectRatio: false,
          scales: scales,
          plugins: {
            legend: {
              display: chart.series.length > 1,
              labels: { color: colour('ink'), boxWidth: 14 },
            },
            tooltip: { mode: 'nearest' },
          },
        },
      });
    });
  }

  draw();
  window.matchMedia('(prefers-color-scheme: dark)').addEventListener('change', draw);
})();
)~js~";
}

}  // namespace risley::report
