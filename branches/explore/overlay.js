"use strict";
// Thin lines laid over the map, to compare: the exact solution of a law at any nu, computed here, or the branches of another
// material that the page holds.

const OVERLAY = "overlay",
  OVERLAY_FOLDS = "overlay folds";
let laid = null; // what is laid over the map, as `overlayData` returns

/** The list of what can be compared with. */
function listOverlays() {
  const options = [new Option("nothing", "")];
  if (STRIPS) for (const law of Object.keys(EXACT_LAWS)) options.push(new Option(`exact solution: ${law}`, `exact ${law}`));
  FAMILIES.forEach((family, i) => family !== now.family && options.push(new Option(`computed: ${family.name}`, `family ${i}`)));
  const before = $("compare").value;
  $("compare").replaceChildren(...options);
  $("compare").value = options.some(({ value }) => value === before) ? before : "";
  $("compare-bar").hidden = options.length < 2;
}

/** What is chosen: {law, nu}, {family}, or null. */
function overlay() {
  const [kind, which] = [$("compare").value.slice(0, 5), $("compare").value.slice(6)];
  if (kind === "exact") return { law: which, nu: Number($("nu").value) };
  return kind === "famil" ? { family: FAMILIES[Number($("compare").value.slice(7))] } : null;
}

/** Modes of the primary branches that are shown, one for each curve. */
function shownModes() {
  const primary = now.family.branches.filter((branch) => !branch.circle && !("origin" in branch));
  return [...new Map(primary.map(({ m, n }) => [`${m} ${n}`, [m, n]])).values()];
}

/** Exact branches of the modes that are shown: points and folds, as `exactCurve` returns. */
function exactBranches({ law, nu }) {
  const limits = ends(now.family.branches.flatMap((branch) => [...branch.columns.kappa_n]));
  return shownModes().map(([m, n]) => ({ m, n, ...exactCurve(law, m, n, nu, limits) }));
}

/** Lines of the overlay, {x, y}, broken between branches; and its folds with a text each. */
function overlayData() {
  const chosen = overlay(),
    data = { x: [], y: [], folds: { x: [], y: [], hovertext: [] } };
  if (!chosen) return data;
  const add = ({ x, y }) => (data.x.push(...x, null), data.y.push(...y, null));
  if (chosen.family) {
    for (const branch of chosen.family.branches) if (!branch.circle) add(branch.line(now.x, now.y));
    return data;
  }
  for (const { m, n, points: found, folds } of exactBranches(chosen)) {
    add({ x: found.map((point) => point[now.x]), y: found.map((point) => point[now.y]) });
    for (const fold of folds) {
      data.folds.x.push(fold[now.x]);
      data.folds.y.push(fold[now.y]);
      data.folds.hovertext.push(
        `<b>exact fold of (${m}, ${n})</b>, ${overlayName()}<br>${AXES.get("kappa_n").brief} = ${digits(fold.kappa_n)}<br>κ* = ${digits(fold.kappa_star)}`,
      );
    }
  }
  return data;
}

function overlayName() {
  const chosen = overlay();
  return chosen.family ? chosen.family.name : `${chosen.law}, ν = ${minus(String(chosen.nu))}`;
}

const overlayText = () =>
  overlay().family ? `computed: ${overlayName()}` : `exact solution, computed in this page: ${overlayName()}`;
const overlayStroke = () => ({ color: colour("overlay"), dash: "solid", width: 1.3, simplify: false });
const overlayEntries = () => {
  const chosen = overlay();
  if (!chosen) return [];
  return [
    { text: overlayText(), stroke: overlayStroke() },
    ...(chosen.law ? [{ text: SYMBOLS.exact[2], symbol: "exact" }] : []),
  ];
};

function overlayTraces() {
  laid = overlayData();
  const { x, y, folds } = laid,
    shape = overlay() && overlay().law ? "spline" : "linear";
  const marker = { symbol: "star-open", size: 11, color: colour("overlay"), line: { width: 1.2 } };
  return [
    { ...QUIET, name: OVERLAY, x, y, line: { ...overlayStroke(), shape } },
    { type: "scatter", mode: "markers", name: OVERLAY_FOLDS, ...folds, hoverinfo: "text", showlegend: false, marker },
  ];
}

let overlayBusy = false,
  overlayWanted = false;

/** Draw the overlay again, as fast as it can follow the slider. */
async function moveOverlay() {
  $("nu-label").hidden = !(overlay() && overlay().law);
  $("nu-value").textContent = minus(Number($("nu").value).toFixed(2));
  overlayWanted = true;
  if (overlayBusy) return;
  overlayBusy = true;
  while (overlayWanted) {
    overlayWanted = false;
    const traces = overlayTraces(),
      drawn = $("diagram").data,
      columns = (name) => traces.map((trace) => trace[name] || []);
    await Plotly.restyle(
      "diagram",
      {
        x: columns("x"),
        y: columns("y"),
        hovertext: columns("hovertext"),
        "line.shape": traces.map(({ line }) => line && line.shape),
      },
      traces.map(({ name }) => drawn.findIndex((trace) => trace.name === name)),
    );
  }
  overlayBusy = false;
  drawLegend();
  remember();
}
