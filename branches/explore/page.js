"use strict";
// The page: one state (family, branch, place s), and what is drawn of it. The diagram and the strip are drawn by plotly.

const $ = (id) => document.getElementById(id);
const DATA = JSON.parse($("data").textContent);
const FAMILIES = DATA.families.map((family) => ({
  ...family,
  branches: [...family.branches.map((about) => new Branch(about, family.law)), ...family.circles.map((about) => new Branch(about, family.law))],
}));
const MARGIN = { l: 62, r: 12, t: 8, b: 54 };
const EYE = { x: 0.78, y: -1.02, z: 0.8 };
const FOLDING_TIME = 9000; // milliseconds from one end of a branch to the other
const WAVES = [["#cc79a7", "dot"], ["#0072b2", "solid"], ["#009e73", "dash"], ["#d55e00", "dashdot"], ["#56b4e9", "longdash"], ["#e69f00", "longdashdot"], ["#882255", "4px 2px"]];
const TRIADS = ["#d55e00", "#009e73", "#0072b2"]; // d1, d2, d3
const LOOPS = { 1: "single", 2: "double", 3: "triple", 4: "fourfold", 5: "fivefold", 6: "sixfold", 7: "sevenfold", 8: "eightfold", 9: "ninefold" };

const now = { family: FAMILIES[0], branch: null, s: 0, playing: false };
const flat = !hasWebGL();
let range = { x: [0, 1], y: [0, 1] }, flatEye = EYE, busy = false, wanted = false, idle = 0;

// --- words ---------------------------------------------------------------------------------------------------------

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
const minus = (text) => text.replace("-", "−");
const short = (value) => minus(value.toPrecision(5).replace(/(\.\d*?)0+$/, "$1").replace(/\.$/, ""));
const digits = (value) => minus(value.toFixed(8));
const loopName = (m) => (m < 0 ? `${LOOPS[-m] || -m + "-fold"} loop, curled the wrong way` : `${LOOPS[m] || m + "-fold"} loop`);
const percent = (width) => (width < 2 * Math.PI ? `${((100 * width) / (2 * Math.PI)).toPrecision(2)} % width` : "never");
const nameOf = (branch) => {
  if (branch.circle) return loopName(branch.m);
  return "origin" in branch ? `from (${branch.m}, ${branch.n}) at ${short(branch.origin)}` : `(${branch.m}, ${branch.n})`;
};

function stability(branch, s) {
  const index = branch.index(s);
  const there = Math.abs(s - Math.round(s)) < 1e-6 && branch.m > 0; // a point where some direction is neutral
  if (index === null) return ["unknown", !branch.columns.index ? "not computed" : there ? "on the verge" : "not known", ""];
  return index === 0 ? ["stable", "stable", "0"] : ["unstable", "unstable", index === -2 ? "∞" : String(index)];
}

/** The labelled point at s, if there is one. */
const markAt = (branch, s) => (branch.marks || []).find((mark) => Math.abs(mark.point - s) < 1e-6);

const MARK_WORDS = {
  fold: "At this fold the branch turns back: push the strip on, and it snaps to another shape.",
  secondary: "Another branch, with less symmetry, crosses here.",
  limit: "The computation was told to stop here; the branch goes on.",
};

function story() {
  const { branch, s } = now, mark = markAt(branch, s), [kind] = stability(branch, s);
  const steady = { stable: "It is stable: push it a little and it comes back.", unstable: "It is unstable: it can rest here, but the least push makes it leave.", unknown: "" }[kind];
  if (branch.circle) return `A flat ring: the strip goes round ${Math.abs(branch.m) === 1 ? "once" : `${Math.abs(branch.m)} times`} (${loopName(branch.m)}). ${steady}`;
  if (mark && mark.kind === "circle") return `Here the branch meets the ${loopName(mark.covering)}, flat again. Beyond it, waves grow.`;
  const to = branch.to === null ? "does not come back" : `ends on the ${loopName(branch.to)}`;
  const way = "origin" in branch ? `This shape has less symmetry than the branch (${branch.m}, ${branch.n}) that it comes from.` : `This branch leaves the ${loopName(branch.m)} with ${branch.n} wave${branch.n > 1 ? "s" : ""} round the strip, and ${to}.`;
  return `${way} ${(mark && MARK_WORDS[mark.kind]) || steady}`;
}

// --- the diagram ---------------------------------------------------------------------------------------------------

const FINE = 8; // pieces between neighbouring points

/** Lines of all branches, grouped by how they are drawn: Map of style name to {x, y}. */
function lines() {
  const groups = new Map();
  for (const branch of now.family.branches) {
    let last = null;
    for (let i = 0; i + 1 < branch.size; i++) {
      const group = groupOf(branch, i + 0.5);
      if (!groups.has(group)) groups.set(group, { x: [], y: [] });
      const { x, y } = groups.get(group), steps = branch.circle ? 1 : FINE;
      if (group !== last) x.push(null), y.push(null);
      for (let j = group === last ? 1 : 0; j <= steps; j++) {
        x.push(branch.value("kappa_n", i + j / steps));
        y.push(branch.value("kappa_star", i + j / steps));
      }
      last = group;
    }
  }
  return groups;
}

function groupOf(branch, s) {
  if ($("colour").value === "stability") return stability(branch, s)[0];
  return branch.circle ? "flat rings" : "origin" in branch ? "secondary" : `n = ${branch.n}`;
}

function styleOf(group) {
  const found = { stable: ["stable", "solid", 4], unstable: ["unstable", "5px,3px", 1.5], unknown: ["unknown", "solid", 1.8], "flat rings": ["soft", "solid", 1.2], secondary: ["mark", "2px,3px", 1.8] }[group];
  if (found) return { color: colour(found[0]), dash: found[1], width: found[2] };
  const [hue, dash] = WAVES[(Number(group.slice(4)) - 1) % WAVES.length];
  return { color: hue, dash, width: 1.8 };
}

const SYMBOLS = { circle: ["circle", 7, "meets a flat ring"], fold: ["star", 12, "fold"], secondary: ["diamond", 9, "secondary bifurcation"], user: ["square", 7, ""] };

/** Every computed point, to hover and click: a line that is not seen, since markers by the thousand are slow. */
function points() {
  const trace = { x: [], y: [], customdata: [], hovertext: [] };
  now.family.branches.forEach((branch, b) => {
    const { kappa_n, kappa_star, energy } = branch.columns;
    for (let i = 0; i < branch.size; i++) {
      const mark = markAt(branch, i), [kind, word, index] = stability(branch, i);
      const special = mark && mark.kind in SYMBOLS ? `<br>${SYMBOLS[mark.kind][2] || mark.name}` : "";
      trace.x.push(kappa_n[i]);
      trace.y.push(kappa_star[i]);
      trace.customdata.push([b, i]);
      trace.hovertext.push(`<b>${nameOf(branch)}</b>${special}<br>κ<sub>n</sub>L/2π = ${digits(kappa_n[i])}<br>κ* = ${digits(kappa_star[i])}<br>energy = ${digits(energy[i])}<br>${word}${index && kind !== "unknown" ? `, index ${index}` : ""}`);
    }
  });
  return { type: "scatter", mode: "lines", line: { width: 0 }, hoverinfo: "text", showlegend: false, ...trace };
}

/** Folds, bifurcations and other labelled points, to be seen. */
function specialPoints() {
  const found = now.family.branches.flatMap((branch) => branch.marks || []).filter((mark) => mark.kind in SYMBOLS);
  return {
    type: "scatter", mode: "markers", x: found.map((mark) => mark.kappa_n), y: found.map((mark) => mark.kappa_star), hoverinfo: "skip", showlegend: false,
    marker: { symbol: found.map((mark) => SYMBOLS[mark.kind][0]), size: found.map((mark) => SYMBOLS[mark.kind][1]), color: colour("mark"), line: { width: 1, color: colour("card") } },
  };
}

function diagramTraces() {
  const drawn = [...lines()].map(([group, { x, y }]) => ({ type: "scatter", mode: "lines", name: group, x, y, line: styleOf(group), hoverinfo: "skip", showlegend: false }));
  const order = ["unknown", "unstable", "stable"];
  drawn.sort((a, b) => order.indexOf(a.name) - order.indexOf(b.name));
  const halo = { type: "scatter", mode: "lines", ...selected(), line: { color: colour("front"), width: 9 }, opacity: 0.38, hoverinfo: "skip", showlegend: false };
  const here = { type: "scatter", mode: "markers", x: [], y: [], hoverinfo: "skip", showlegend: false, marker: { size: 13, color: colour("front"), line: { width: 2, color: colour("mark") } } };
  return [halo, ...drawn, points(), specialPoints(), here];
}

function diagramLayout() {
  const axis = { gridcolor: colour("grid"), zeroline: false, linecolor: colour("line"), tickcolor: colour("line"), automargin: false };
  return {
    margin: MARGIN, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: { family: "system-ui, sans-serif", size: 13, color: colour("soft") },
    xaxis: { ...axis, title: { text: "natural curvature κ<sub>n</sub>L/2π", standoff: 8 }, range: range.x },
    yaxis: { ...axis, title: { text: "conjugate curvature κ*", standoff: 10 }, range: range.y },
    annotations: ringNames(), hovermode: "closest", hoverdistance: 30, dragmode: "pan", hoverlabel: { bgcolor: colour("card"), bordercolor: colour("line"), font: { color: colour("ink") } },
  };
}

/** Names of the rings, at the right end of what is shown first of their lines. */
function ringNames() {
  return now.family.branches.filter((branch) => branch.circle).map((ring) => {
    const x = Math.min(range.x[1], ring.columns.kappa_n[ring.size - 1]), [s] = [...ring.places(x), ring.size - 1];
    return { x, y: ring.value("kappa_star", s), text: loopName(ring.m), showarrow: false, xanchor: "right", yanchor: "bottom", font: { size: 11.5, color: colour("ink") }, bgcolor: colour("card"), opacity: 0.85, borderpad: 0, yshift: 4 };
  });
}

const ends = (values) => [values.reduce((a, b) => Math.min(a, b)), values.reduce((a, b) => Math.max(a, b))];

/** The part of the diagram that is shown: all of it, or of many branches the neighbourhood of the rings. */
function extent(whole) {
  const places = now.family.branches.flatMap(({ columns }) => [...columns.kappa_n].map((k, i) => [k, columns.kappa_star[i]]));
  let [low, high] = ends(places.map(([k]) => k));
  if (!whole && now.family.branches.length > 4) [low, high] = [Math.max(low, -8), Math.min(high, 14)];
  const [bottom, top] = ends(places.filter(([k]) => k >= low && k <= high).map(([, star]) => star));
  const across = 0.06 * (high - low || 1), up = 0.08 * (top - bottom || 1);
  return { x: [low - across, high + across], y: [bottom - up, top + up] };
}

async function drawDiagram() {
  await Plotly.react("diagram", diagramTraces(), diagramLayout(), { responsive: true, displaylogo: false, scrollZoom: true, displayModeBar: false });
  drawLegend();
  placeMarker();
}

function drawLegend() {
  const groups = [...lines().keys()].sort(), svg = ({ color, dash, width }) =>
    `<svg width="34" height="10" aria-hidden="true"><path d="M1 5H33" stroke="${color}" stroke-width="${width}" stroke-dasharray="${{ solid: "none", dot: "2 3", dash: "7 4", longdash: "11 4", dashdot: "7 3 2 3", longdashdot: "11 3 2 3" }[dash] || dash.replaceAll("px", "")}"/></svg>`;
  const words = { stable: "stable", unstable: "unstable", unknown: "index not known" };
  const marks = new Set(now.family.branches.flatMap((branch) => (branch.marks || []).map((mark) => mark.kind)));
  $("legend").innerHTML = groups.map((group) => `<span>${svg(styleOf(group))}${words[group] || group}</span>`).join("") +
    [["circle", "● meets a flat ring"], ["fold", "★ fold"], ["secondary", "◆ secondary bifurcation"]].filter(([kind]) => marks.has(kind)).map(([, text]) => `<span>${text}</span>`).join("");
}

/** The line of the branch that is selected. */
function selected() {
  const { branch } = now, x = [], y = [], steps = branch.circle ? 1 : FINE;
  for (let i = 0; i <= (branch.size - 1) * steps; i++) {
    x.push(branch.value("kappa_n", i / steps));
    y.push(branch.value("kappa_star", i / steps));
  }
  return { x, y };
}

/** Lay the halo under the branch that is selected now. */
function highlight() {
  const { x, y } = selected();
  return Plotly.restyle("diagram", { x: [x], y: [y] }, [0]);
}

/** Where the place s of a branch is in the diagram's frame: pixels, and whether it is inside the axes. */
function pixel(branch, s) {
  const { clientWidth: w, clientHeight: h } = $("diagram"), { xaxis, yaxis } = $("diagram").layout;
  const part = (name, { range: [low, high] }) => (branch.value(name, s) - low) / (high - low);
  const across = part("kappa_n", xaxis), up = part("kappa_star", yaxis);
  return {
    x: MARGIN.l + across * (w - MARGIN.l - MARGIN.r), y: h - MARGIN.b - up * (h - MARGIN.t - MARGIN.b),
    inside: Math.abs(across - 0.5) < 0.505 && Math.abs(up - 0.5) < 0.505,
  };
}

function placeMarker() {
  if (!$("diagram").layout) return;
  const { x, y, inside } = pixel(now.branch, now.s);
  $("here").style.visibility = inside ? "visible" : "hidden";
  $("here").style.transform = `translate(${x}px, ${y}px)`;
}

/** A click on a point; a labelled point so near that it covers this one is meant instead. */
function clicked({ points: [point] }) {
  if (!point.customdata) return;
  const [b, i] = point.customdata, branch = now.family.branches[b], here = pixel(branch, i);
  const distance = (place) => Math.hypot(pixel(branch, place).x - here.x, pixel(branch, place).y - here.y);
  const near = (branch.marks || []).map((mark) => mark.point).filter((place) => distance(place) < 6);
  go(branch, near.length ? near.reduce((p, q) => (distance(p) < distance(q) ? p : q)) : i);
}

// --- the strip -----------------------------------------------------------------------------------------------------

function hasWebGL() {
  const canvas = document.createElement("canvas");
  return Boolean(canvas.getContext("webgl2") || canvas.getContext("webgl"));
}

/** Width of the strip in units of L / 2 pi. */
const width = () => (Number($("width").value) / 100) * 2 * Math.PI;
/** A tight coil is drawn larger than to scale, but smaller than a single loop. */
const scaleOf = (strip) => 0.86 / reach(strip) ** 0.6;

function ribbonTraces(strip) {
  const scale = scaleOf(strip), n = count(strip), mesh = sheets(strip, width(), scale);
  const sides = Array.from({ length: 4 * n }, (_, v) => colour(v % 4 < 2 ? "front" : "rear"));
  const traces = [{
    type: "mesh3d", ...mesh, ...triangles(n), vertexcolor: sides, hoverinfo: "skip", showscale: false,
    lighting: { ambient: 0.52, diffuse: 0.75, specular: 0.28, roughness: 0.45, fresnel: 0.12 }, lightposition: { x: 3000, y: -4000, z: 9000 },
  }];
  if ($("triads").checked)
    triadLines(strip, scale).forEach((line, i) => traces.push({ type: "scatter3d", mode: "lines", ...line, line: { color: TRIADS[i], width: 6 }, hoverinfo: "skip", showlegend: false }));
  return traces;
}

/** Directors d1, d2, d3 at a few stations: a broken line for each of the three. */
function triadLines(strip, scale) {
  return [0, 1, 2].map((i) => {
    const line = { x: [], y: [], z: [] }, n = count(strip);
    for (let a = 0; a < 16; a++) {
      const k = Math.round((a * n) / 16) * STATION, x = [...strip.subarray(k, k + 3)], d = [...strip.subarray(k + 3 + 3 * i, k + 6 + 3 * i)];
      const from = along([0, 0, 0], scale, x), to = along(from, 0.2, d);
      ["x", "y", "z"].forEach((name, j) => line[name].push(from[j], to[j], null));
    }
    return line;
  });
}

const sceneAxis = { visible: false, range: [-1, 1], autorange: false };

async function createRibbon() {
  const strip = now.branch.strip(now.s);
  if (flat) return drawFlat(strip);
  const scene = { xaxis: sceneAxis, yaxis: sceneAxis, zaxis: sceneAxis, aspectmode: "cube", camera: { eye: EYE, projection: { type: "perspective" } }, dragmode: "orbit" };
  await Plotly.newPlot("ribbon", ribbonTraces(strip), { margin: { l: 0, r: 0, t: 0, b: 0 }, paper_bgcolor: "rgba(0,0,0,0)", scene, showlegend: false }, { responsive: true, displaylogo: false, displayModeBar: false, scrollZoom: true });
}

async function updateRibbon() {
  const strip = now.branch.strip(now.s);
  if (flat) return drawFlat(strip);
  const scale = scaleOf(strip), mesh = sheets(strip, width(), scale), n = count(strip);
  if (4 * n !== $("ribbon").data[0].x.length) return Plotly.react("ribbon", ribbonTraces(strip), $("ribbon").layout);
  const drawn = $("triads").checked ? [mesh, ...triadLines(strip, scale)] : [mesh];
  return Plotly.restyle("ribbon", { x: drawn.map((one) => one.x), y: drawn.map((one) => one.y), z: drawn.map((one) => one.z) }, drawn.map((_, i) => i));
}

const eyeNow = () => {
  const { x, y, z } = flat ? flatEye : $("ribbon").layout.scene.camera.eye;
  return [x, y, z];
};

/** Look from elsewhere. */
function look(eye) {
  flatEye = eye;
  if (flat) return update();
  return Plotly.relayout("ribbon", { "scene.camera.eye": eye, "scene.camera.up": { x: 0, y: 0, z: 1 }, "scene.camera.center": { x: 0, y: 0, z: 0 } });
}

/** Arrow keys turn the strip when it has the focus, + and - change the distance. */
function turnByKey(event) {
  const turns = { ArrowLeft: [-0.15, 0, 1], ArrowRight: [0.15, 0, 1], ArrowUp: [0, 0.15, 1], ArrowDown: [0, -0.15, 1], "+": [0, 0, 0.9], "-": [0, 0, 1 / 0.9] };
  if (!(event.key in turns) || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  event.stopPropagation();
  const [about, over, farther] = turns[event.key], [x, y, z] = eyeNow(), r = Math.hypot(x, y, z) * farther;
  const azimuth = Math.atan2(y, x) + about, height = Math.min(1.5, Math.max(-1.5, Math.asin(z / Math.hypot(x, y, z)) + over));
  look({ x: r * Math.cos(height) * Math.cos(azimuth), y: r * Math.cos(height) * Math.sin(azimuth), z: r * Math.sin(height) });
}

/** The fill of a polygon as a function: its side's colour, darker where it faces away from the light. */
function fills() {
  const [front, rear] = ["front", "rear"].map((side) => colour(side).match(/\w\w/g).map((part) => parseInt(part, 16)));
  return (polygon) => `rgb(${(polygon.front ? front : rear).map((part) => Math.round(part * polygon.shade)).join(",")})`;
}

/** A picture of the strip without WebGL. */
function paint(canvas, strip, eye, scale, every) {
  const ratio = window.devicePixelRatio || 1, context = canvas.getContext("2d");
  canvas.width = (canvas.clientWidth || 120) * ratio;
  canvas.height = (canvas.clientHeight || 92) * ratio;
  const size = Math.min(canvas.width, canvas.height) * 0.46, fill = fills();
  context.translate(canvas.width / 2, canvas.height / 2);
  for (const polygon of polygons(strip, width(), scale, eye, every)) {
    context.fillStyle = context.strokeStyle = fill(polygon);
    context.beginPath();
    polygon.points.forEach(([x, y]) => context.lineTo(x * size, y * size));
    context.closePath();
    context.fill();
    context.stroke();
  }
}

function drawFlat(strip) {
  const canvas = $("ribbon").querySelector("canvas") || $("ribbon").appendChild(Object.assign(document.createElement("canvas"), { className: "flat" }));
  paint(canvas, strip, eyeNow(), scaleOf(strip), 1);
}

function ribbonSvg() {
  const strip = now.branch.strip(now.s), round = (x) => (400 + 340 * x).toFixed(2), fill = fills();
  const shapes = polygons(strip, width(), scaleOf(strip), eyeNow(), 1).map((polygon) => {
    const tint = fill(polygon);
    return `<path fill="${tint}" stroke="${tint}" d="M${polygon.points.map(([x, y]) => `${round(x)} ${round(y)}`).join("L")}Z"/>`;
  });
  return `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 800 800" stroke-width=".6" stroke-linejoin="round">${shapes.join("")}</svg>`;
}

// --- read-out and states at one kappa_n ----------------------------------------------------------------------------

function readOut() {
  const { branch, s } = now, whole = Math.abs(s - Math.round(s)) < 1e-9, [kind, word, index] = stability(branch, s);
  const rows = [
    ["branch", nameOf(branch)],
    ["κ<sub>n</sub> L/2π", digits(branch.value("kappa_n", s)), "kappa_n"],
    ["κ*", digits(branch.value("kappa_star", s)), "kappa_star"],
    ["energy", digits(branch.value("energy", s)), "energy"],
    ["stability", `<span class="tag ${kind}">${word}</span>${index && kind === "unstable" ? `, index ${index}` : ""}`, "stability"],
    ...(branch.ruled ? [["rulings cross beyond", percent(widest(branch.strip(s))), "widest"]] : []),
    ["point", branch.circle ? "exact" : whole ? `${Math.round(s)} of ${branch.size - 1}${branch.labels[Math.round(s)] ? ` (${branch.labels[Math.round(s)]})` : ""}` : `${Math.floor(s)} – ${Math.ceil(s)}`, "point"],
  ];
  $("readout").innerHTML = rows.map(([name, value, id]) => `<div><dt>${name}</dt><dd${id ? ` data-value="${id}"` : ""}>${value}</dd></div>`).join("");
  const text = story();
  if (!now.playing && $("story").textContent !== text) $("story").textContent = text;
}

/** All states of the family at the present kappa_n, by energy. */
function coexisting() {
  const kappa = now.branch.value("kappa_n", now.s), found = [{ branch: now.branch, s: now.s }];
  for (const branch of now.family.branches)
    for (const s of branch.places(kappa))
      if (!found.some((one) => one.branch === branch && Math.abs(one.s - s) < 0.02)) found.push({ branch, s });
  found.forEach((one) => (one.energy = one.branch.value("energy", one.s)));
  return found.sort((a, b) => a.energy - b.energy);
}

function drawStates() {
  clearTimeout(idle);
  const found = coexisting();
  $("states-note").textContent = `${found.length} at κₙL/2π = ${short(now.branch.value("kappa_n", now.s))}, least energy first`;
  $("states").replaceChildren(...found.map((one) => {
    const item = document.createElement("li"), button = item.appendChild(document.createElement("button")), [kind, word] = stability(one.branch, one.s);
    button.type = "button";
    button.innerHTML = `<canvas aria-hidden="true"></canvas><b>${nameOf(one.branch)}</b><small>energy ${minus(one.energy.toFixed(5))}</small><span class="tag ${kind}">${word}</span>`;
    if (one.branch === now.branch && one.s === now.s) button.setAttribute("aria-current", "true");
    button.onclick = () => go(one.branch, one.s);
    return item;
  }));
  const current = $("states").querySelector("[aria-current]").parentElement;
  const left = current.offsetLeft - $("states").offsetLeft, room = $("states").clientWidth - current.clientWidth - 20;
  $("states").scrollLeft = Math.max(0, left - room);
  $("states").querySelectorAll("canvas").forEach((canvas, i) => {
    const strip = found[i].branch.strip(found[i].s);
    paint(canvas, strip, eyeNow(), scaleOf(strip) * 1.05, Math.max(1, Math.round(count(strip) / 190)));
  });
}

// --- moving --------------------------------------------------------------------------------------------------------

/** Go to a place; what is drawn follows as fast as it can. */
function go(branch, s) {
  const other = branch !== now.branch;
  now.branch = branch;
  now.s = Math.min(Math.max(s, 0), branch.size - 1);
  if (other) {
    $("branch").value = String(now.family.branches.indexOf(branch));
    highlight();
  }
  return update();
}

async function update() {
  $("slider").value = String(Math.round(1000 * now.branch.toWay(now.s)));
  $("slider").setAttribute("aria-valuetext", `κ_n ${short(now.branch.value("kappa_n", now.s))}`);
  placeMarker();
  readOut();
  clearTimeout(idle);
  if (!now.playing) idle = setTimeout(drawStates, 150);
  wanted = true;
  if (busy) return;
  busy = true;
  while (wanted) {
    wanted = false;
    await updateRibbon();
  }
  busy = false;
}

/** To the next point, or with `special` the next labelled one, in direction +1 or -1. */
function step(direction, special) {
  const { branch, s } = now, near = direction > 0 ? Math.floor(s + 1e-9) + 1 : Math.ceil(s - 1e-9) - 1;
  if (!special || branch.circle) return go(branch, near);
  const places = branch.marks.map((mark) => mark.point).filter((place) => (place - s) * direction > 1e-9);
  return go(branch, places.length ? (direction > 0 ? Math.min(...places) : Math.max(...places)) : s);
}

async function play() {
  now.playing = !now.playing;
  $("play").textContent = now.playing ? "❚❚ Pause" : "▶ Play";
  $("play").setAttribute("aria-pressed", String(now.playing));
  if (!now.playing) return update();
  if (now.s > now.branch.size - 1 - 1e-6) now.s = 0;
  let last = performance.now(), way = now.branch.toWay(now.s), branch = now.branch, place = now.s;
  while (now.playing) {
    const time = await new Promise(requestAnimationFrame);
    if (branch !== now.branch || place !== now.s) [branch, way] = [now.branch, now.branch.toWay(now.s)]; // moved by hand
    way = Math.min(1, way + Math.max(0, time - last) / FOLDING_TIME);
    last = time;
    now.s = branch.fromWay(way);
    place = now.s;
    await update();
    now.frames = (now.frames || 0) + 1;
    if (way >= 1) return play();
  }
}

// --- files ---------------------------------------------------------------------------------------------------------

function csv(branch) {
  const names = Object.keys(branch.columns), head = [...(branch.circle ? [] : ["label"]), ...names].join(",");
  const rows = Array.from({ length: branch.size }, (_, i) => [...(branch.circle ? [] : [branch.labels[i]]), ...names.map((name) => branch.columns[name][i])].join(","));
  return [head, ...rows, ""].join("\n");
}

function download(name, content, type) {
  const link = document.createElement("a");
  link.href = typeof content === "string" && content.startsWith("data:") ? content : URL.createObjectURL(new Blob([content], { type }));
  link.download = name;
  link.click();
  if (link.href.startsWith("blob:")) setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

const decoded = (dataUrl) => decodeURIComponent(dataUrl.slice(dataUrl.indexOf(",") + 1));

async function save(what) {
  const { branch } = now, base = branch.circle ? `circle_${branch.m}` : branch.file.replace(/\.h5$/, "");
  if (what === "csv") return download(`${base}.csv`, csv(branch), "text/csv");
  if (what === "yaml") return download(`${base}.yaml`, branch.circle ? "# A planar circle has a closed formula; nothing was computed.\n" : branch.config, "text/yaml");
  const format = what.split(".")[1], size = { format, width: 1000, height: 700, scale: format === "png" ? 2 : 1 };
  if (what === "ribbon.svg") return download(`${base}_strip.svg`, ribbonSvg(), "image/svg+xml");
  if (what === "ribbon.png") return download(`${base}_strip.png`, flat ? $("ribbon").querySelector("canvas").toDataURL() : await Plotly.toImage("ribbon", { ...size, height: 1000 }));
  const traces = $("diagram").data.length - 1;
  await Plotly.restyle("diagram", { x: [[branch.value("kappa_n", now.s)]], y: [[branch.value("kappa_star", now.s)]] }, [traces]);
  const picture = await Plotly.toImage("diagram", size);
  await Plotly.restyle("diagram", { x: [[]], y: [[]] }, [traces]);
  return format === "svg" ? download(`${base}_diagram.svg`, decoded(picture), "image/svg+xml") : download(`${base}_diagram.png`, picture);
}

// --- controls ------------------------------------------------------------------------------------------------------

function listBranches() {
  $("branch").replaceChildren(...now.family.branches.map((branch, i) => new Option(branch.circle ? nameOf(branch) : `branch ${nameOf(branch)}`, String(i))));
}

async function chooseFamily(i) {
  now.family = FAMILIES[i];
  now.branch = now.family.branches[0];
  now.s = now.branch.fromWay(0.45);
  $("colour").value = now.family.branches.some((branch) => !branch.circle && branch.columns.index) ? "stability" : "wave";
  range = extent(false);
  listBranches();
  await drawDiagram();
}

function connect() {
  FAMILIES.forEach(({ law, nu }, i) => $("family").add(new Option(`${law}, ν = ${nu}`, String(i))));
  $("family-label").hidden = FAMILIES.length < 2;
  $("family").onchange = (event) => chooseFamily(Number(event.target.value)).then(update);
  $("colour").onchange = drawDiagram;
  $("branch").onchange = (event) => {
    const branch = now.family.branches[Number(event.target.value)];
    go(branch, branch.fromWay(0.45));
  };
  $("whole").onclick = () => {
    const all = extent(true), shown = $("diagram").layout.xaxis.range;
    range = shown[0] <= all.x[0] && shown[1] >= all.x[1] ? extent(false) : all;
    Plotly.relayout("diagram", { "xaxis.range": range.x, "yaxis.range": range.y });
  };
  $("width").oninput = () => {
    $("width-value").textContent = `${$("width").value} % of length`;
    update();
  };
  if (flat) $("triads").parentElement.hidden = true;
  $("triads").onchange = () => !flat && Plotly.react("ribbon", ribbonTraces(now.branch.strip(now.s)), $("ribbon").layout);
  $("view").onclick = () => look(EYE);
  $("ribbon").addEventListener("keydown", turnByKey);
  $("slider").oninput = (event) => go(now.branch, now.branch.fromWay(Number(event.target.value) / 1000));
  $("previous").onclick = () => step(-1, false);
  $("next").onclick = () => step(1, false);
  $("play").onclick = play;
  $("save").onclick = (event) => event.target.dataset.save && save(event.target.dataset.save);
  document.addEventListener("keydown", keyPressed);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  new ResizeObserver(placeMarker).observe($("diagram"));
}

function keyPressed(event) {
  if (event.ctrlKey || event.metaKey || event.altKey || /^(INPUT|SELECT)$/.test(event.target.tagName)) return;
  if (event.key === " " && /^(BUTTON|SUMMARY)$/.test(event.target.tagName)) return;
  const branches = now.family.branches, other = (by) => {
    const branch = branches[(branches.indexOf(now.branch) + by + branches.length) % branches.length];
    go(branch, branch.fromWay(0.45));
  };
  const actions = {
    ArrowRight: () => step(1, event.shiftKey), ArrowLeft: () => step(-1, event.shiftKey), ArrowUp: () => other(-1), ArrowDown: () => other(1),
    Home: () => go(now.branch, 0), End: () => go(now.branch, now.branch.size - 1), " ": play,
  };
  if (!(event.key in actions)) return;
  event.preventDefault();
  actions[event.key]();
}

async function redraw() {
  await drawDiagram();
  if (!flat) await Plotly.react("ribbon", ribbonTraces(now.branch.strip(now.s)), $("ribbon").layout);
  await update();
}

async function start() {
  connect();
  $("width-value").textContent = `${$("width").value} % of length`;
  await chooseFamily(0);
  now.diagramTime = performance.now();
  $("diagram").on("plotly_click", clicked);
  $("diagram").on("plotly_relayout", placeMarker);
  $("diagram").on("plotly_relayouting", placeMarker);
  await createRibbon();
  if (!flat) $("ribbon").on("plotly_relayout", () => !now.playing && drawStates());
  await update();
  drawStates();
  return performance.now();
}

/** For tests, and for whoever opens the console: the state, and how long the first picture took in milliseconds. */
window.explore = { now, go, coexisting, csv, families: FAMILIES, ready: start() };
