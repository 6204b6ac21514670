"use strict";
// Thin lines laid over the map, to compare: the exact solution of a law with any parameters, computed here, or the branches of
// another material that the page holds.

const OVERLAY = "overlay",
  OVERLAY_FOLDS = "overlay folds";
let laid = { lines: [], folds: [] }; // what is laid over the map, as `overlayData` returns

/** The list of what can be compared with. */
function listOverlays() {
  const options = [new Option("nothing", "")];
  if (STRIPS)
    for (const law of [...Object.keys(EXACT_LAWS), FINITE_WIDTH])
      options.push(new Option(`exact solution: ${law}`, `exact ${law}`));
  const { given, none } = givenExact(now.family);
  if (given.length || none) options.push(new Option(`exact solution: ${now.family.law}`, "given"));
  if (none && !given.length) Object.assign(options.at(-1), { text: `no exact solution: ${none}`, disabled: true });
  FAMILIES.forEach((family, i) => family !== now.family && options.push(new Option(`computed: ${family.name}`, `family ${i}`)));
  const before = $("compare").value;
  $("compare").replaceChildren(...options);
  $("compare").value = options.some(({ value }) => value === before) ? before : "";
  $("compare-bar").hidden = options.length < 2;
}

/** The exact branches of a law that the page does not know, as results came with them; and why there is none, or not all. */
function givenExact({ branches }) {
  const known = branches.filter(({ exact }) => exact).map(({ exact, m, n }) => ({ ...exact, m, n }));
  return { given: known.filter(({ points }) => points), none: known.find(({ none }) => none)?.none };
}

/** Gamma of its slider, which is logarithmic, to three digits. */
const roundGamma = () => Number((10 ** Number($("gamma").value)).toPrecision(3));

/** What is chosen: {law, nu, Gamma}, {family}, or null. */
function overlay() {
  const [kind, ...words] = $("compare").value.split(" "),
    which = words.join(" ");
  if (kind === "family") return { family: FAMILIES[Number(which)] };
  if (kind === "given") return { given: givenExact(now.family).given };
  if (kind !== "exact") return null;
  return { law: which, nu: Number($("nu").value), Gamma: which === FINITE_WIDTH ? roundGamma() : undefined };
}

/** Modes of the primary branches that are shown, one for each curve. */
function shownModes() {
  const primary = now.family.branches.filter((branch) => !branch.circle && !("origin" in branch));
  return [...new Map(primary.map(({ m, n }) => [`${m} ${n}`, [m, n]])).values()];
}

/** A line to be laid over the map: its columns by name. */
const overlayLine = (found) => Object.fromEntries([...AXES.keys()].map((name) => [name, found.map((point) => point[name])]));

/** Compute what is to be laid over the map, with a breath between branches; null when another choice came on the way. */
async function overlayData() {
  const chosen = overlay(),
    data = { lines: [], folds: [] };
  if (!chosen) return data;
  if (chosen.family) {
    data.lines = chosen.family.branches.filter(({ circle }) => !circle);
    return data;
  }
  if (chosen.given) {
    for (const { m, n, points, folds } of chosen.given) addExact(data, m, n, points.map(withElastic), folds.map(withElastic));
    return data;
  }
  const [low, high] = ends(now.family.branches.flatMap((branch) => [...branch.columns.kappa_n])),
    limits = [2 * low - high, 2 * high - low]; // with other parameters a branch may reach farther than the computed ones
  let last = performance.now();
  for (const [m, n] of shownModes()) {
    const { points: found, folds } = exactCurve(chosen.law, m, n, chosen.nu, limits, chosen.Gamma);
    addExact(data, m, n, found, folds);
    if (performance.now() - last < 100) continue;
    await new Promise(setTimeout);
    last = performance.now();
    if (overlayWanted) return null;
  }
  return data;
}

/** Add the exact branch (m, n) to what is laid over the map, with its folds. */
function addExact(data, m, n, found, folds) {
  data.lines.push(overlayLine(found));
  data.folds.push(...folds.map((fold) => ({ ...fold, text: `<b>exact fold of (${m}, ${n})</b>, ${overlayName()}` })));
}

function overlayName() {
  const chosen = overlay();
  if (chosen.given) return now.family.name;
  if (chosen.family) return chosen.family.name;
  return `${chosen.law}, ν = ${minus(String(chosen.nu))}${chosen.Gamma ? `, Γ = ${chosen.Gamma}` : ""}`;
}

const overlayText = () =>
  overlay().family
    ? `computed: ${overlayName()}`
    : `exact solution${overlay().given ? "" : ", computed in this page"}: ${overlayName()}`;
const overlayStroke = () => ({ color: colour("overlay"), dash: "solid", width: 1.3, simplify: false });
const overlayEntries = () => {
  const chosen = overlay();
  if (!chosen) return [];
  return [
    { text: overlayText(), stroke: overlayStroke() },
    ...(chosen.family ? [] : [{ text: SYMBOLS.exact[2], symbol: "exact" }]),
  ];
};

function overlayTraces() {
  const line = { x: [], y: [] },
    folds = { x: laid.folds.map((fold) => fold[now.x]), y: laid.folds.map((fold) => fold[now.y]) };
  for (const one of laid.lines) {
    const { x, y } = one instanceof Branch ? one.line(now.x, now.y) : { x: one[now.x], y: one[now.y] };
    (line.x.push(...x, null), line.y.push(...y, null));
  }
  const values = (fold) =>
    ["kappa_n", "kappa_star"].map((name) => `<br>${AXES.get(name).brief} = ${digits(fold[name])}`).join("");
  folds.hovertext = laid.folds.map((fold) => fold.text + values(fold));
  const shape = overlay() && !overlay().family ? "spline" : "linear",
    marker = { symbol: "star-open", size: 11, color: colour("overlay"), line: { width: 1.2 } };
  return [
    { ...QUIET, name: OVERLAY, ...line, line: { ...overlayStroke(), shape } },
    { type: "scatter", mode: "markers", name: OVERLAY_FOLDS, ...folds, hoverinfo: "text", showlegend: false, marker },
  ];
}

/** Put the overlay on the map. */
function restyleOverlay() {
  const traces = overlayTraces(),
    drawn = $("diagram").data,
    columns = (name) => traces.map((trace) => trace[name] || []),
    shapes = traces.map(({ line }) => line && line.shape);
  return Plotly.restyle(
    "diagram",
    { x: columns("x"), y: columns("y"), hovertext: columns("hovertext"), "line.shape": shapes },
    traces.map(({ name }) => drawn.findIndex((trace) => trace.name === name)),
  );
}

let overlayBusy = false,
  overlayWanted = false;

/** Compute and draw the overlay again, as fast as it can follow the sliders. */
async function moveOverlay() {
  const exact = overlay() && overlay().law;
  $("nu-label").hidden = !exact;
  $("gamma-label").hidden = exact !== FINITE_WIDTH;
  $("nu-value").textContent = minus(Number($("nu").value).toFixed(2));
  $("gamma-value").textContent = roundGamma().toString();
  overlayWanted = true;
  if (overlayBusy) return;
  overlayBusy = true;
  while (overlayWanted) {
    overlayWanted = false;
    const data = await overlayData();
    if (!data) continue;
    laid = data;
    await restyleOverlay();
  }
  overlayBusy = false;
  drawLegend();
  remember();
}
