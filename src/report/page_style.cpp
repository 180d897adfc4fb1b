// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "report/page_assets.hpp"

namespace risley::report {

std::string_view page_style() {
  return R"~css~(:root {
  color-scheme: light dark;
  --paper: #ffffff; --panel: #f5f6f8; --ink: #1b1f24; --muted: #5b6470; --grid: #dfe3e8;
  --a: #1f6feb; --b: #d9730d; --c: #1a7f5a; --d: #8250df; --bad: #cf222e;
  --ok-panel: #e3f5ea; --ok-edge: #1a7f37; --care-panel: #fff4d6; --care-edge: #b7791f;
  --bad-panel: #fde7e9; --bad-edge: #cf222e;
  --plus: 31, 111, 235; --minus: 217, 60, 60;
}
@media (prefers-color-scheme: dark) {
  :root {
    --paper: #14171c; --panel: #1d2127; --ink: #e6e9ee; --muted: #9aa4b1; --grid: #323942;
    --a: #6cb0ff; --b: #ffa657; --c: #56d39b; --d: #c8a6ff; --bad: #ff7b72;
    --ok-panel: #15301f; --ok-edge: #3fb950; --care-panel: #33290f; --care-edge: #d8a53a;
    --bad-panel: #3a1a1d; --bad-edge: #ff7b72;
    --plus: 90, 160, 255; --minus: 255, 110, 100;
  }
}
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink);
       font: 16px/1.5 system-ui, -apple-system, "Segoe UI", "DejaVu Sans", sans-serif; }
main { max-width: 84rem; margin: 0 auto; padding: 1.5rem 1.25rem 4rem; }
h1 { font-size: 1.5rem; margin: 0; overflow-wrap: anywhere; }
h2 { font-size: 1.2rem; margin: 2.5rem 0 0.75rem; }
h3 { font-size: 1rem; margin: 1.5rem 0 0.5rem; }
p { margin: 0.5rem 0; max-width: 60rem; }
.lead, .note { color: var(--muted); }
.note { font-size: 0.85rem; margin: 0.4rem 0 0; }
.verdict { border-left: 6px solid; border-radius: 6px; padding: 0.9rem 1.2rem; margin: 1rem 0; }
.verdict strong { font-size: 1.15rem; }
.verdict.ok { background: var(--ok-panel); border-color: var(--ok-edge); }
.verdict.care { background: var(--care-panel); border-color: var(--care-edge); }
.verdict.bad { background: var(--bad-panel); border-color: var(--bad-edge); }
.verdict ul { margin: 0.5rem 0; padding-left: 1.3rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 0.9rem; }
th, td { padding: 0.3rem 0.55rem; text-align: right; border-bottom: 1px solid var(--grid);
         white-space: nowrap; }
th { font-weight: 600; }
th:first-child, td.text { text-align: left; }
thead th { border-bottom: 2px solid var(--muted); vertical-align: bottom; }
tbody th { font-weight: 400; text-align: left; white-space: normal; min-width: 13rem; }
td.far { color: var(--bad); font-weight: 600; }
.name { display: block; font-size: 0.8rem; color: var(--muted);
        font-family: ui-monospace, "DejaVu Sans Mono", monospace; }
.heat th, .heat td { padding: 0.3rem 0.45rem; text-align: center; }
.heat tbody th { text-align: left; }
.heat td { min-width: 3.4rem; border: 1px solid var(--paper); }
.charts { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 30rem), 1fr));
          gap: 1rem; }
figure { margin: 0; padding: 0.8rem 1rem; background: var(--panel); border-radius: 8px;
         min-width: 0; }
figcaption { font-weight: 600; margin-bottom: 0.4rem; }
.plot { position: relative; height: 19rem; }
.map .plot { height: auto; aspect-ratio: 1; max-width: 36rem; margin: 0 auto; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 0.3rem 1rem; margin: 0; }
dt { color: var(--muted); }
dd { margin: 0; overflow-wrap: anywhere;
     font-family: ui-monospace, "DejaVu Sans Mono", monospace; font-size: 0.9rem; }
@media print { figure, .verdict { break-inside: avoid; } }
)~css~";
}

}  // namespace risley::report
