"use strict";
// The diagram in (kappa_n, kappa*), drawn by plotly; a marker above it says where we are.

const MARGIN = { l: 62, r: 12, t: 8, b: 54 };
const WAVES = [
  ["#cc79a7", "dot"],
  ["#0072b2", "solid"],
  ["#009e73", "dash"],
  ["#d55e00", "dashdot"],
  ["#56b4e9", "longdash"],
  ["#e69f00", "longdashdot"],
  ["#882255", "4px 2px"],
];

let range = { x: [0, 1], y: [0, 1] }; // of the axes when the page, or another material, was opened

const FINE = 8; // pieces between neighbouring points

/** Lines of all branches, grouped by how they are drawn: Map of style name to {x, y}. */
function lines() {
  const groups = new Map();
  for (const branch of now.family.branches) {
    let last = null;
    for (let i = 0; i + 1 < branch.size; i++) {
      const group = groupOf(branch, i + 0.5);
      if (!groups.has(group)) groups.set(group, { x: [], y: [] });
      const { x, y } = groups.get(group),
        steps = branch.circle ? 1 : FINE;
      if (group !== last) (x.push(null), y.push(null));
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
  const found = {
    stable: ["stable", "solid", 4],
    unstable: ["unstable", "5px,3px", 1.5],
    unknown: ["unknown", "solid", 1.8],
    "flat rings": ["soft", "solid", 1.2],
    secondary: ["mark", "2px,3px", 1.8],
  }[group];
  if (found) return { color: colour(found[0]), dash: found[1], width: found[2] };
  const [hue, dash] = WAVES[(Number(group.slice(4)) - 1) % WAVES.length];
  return { color: hue, dash, width: 1.8 };
}

const SYMBOLS = {
  circle: ["circle", 7, "meets a flat ring"],
  fold: ["star", 12, "fold"],
  secondary: ["diamond", 9, "secondary bifurcation"],
  user: ["square", 7, ""],
};

/** Every computed point, to hover and click: a line that is not seen, since markers by the thousand are slow. */
function points() {
  const trace = { x: [], y: [], customdata: [], hovertext: [] };
  now.family.branches.forEach((branch, b) => {
    const { kappa_n, kappa_star, energy } = branch.columns;
    for (let i = 0; i < branch.size; i++) {
      const mark = markAt(branch, i),
        [kind, word, index] = stability(branch, i);
      const special = mark && mark.kind in SYMBOLS ? `<br>${SYMBOLS[mark.kind][2] || mark.name}` : "";
      trace.x.push(kappa_n[i]);
      trace.y.push(kappa_star[i]);
      trace.customdata.push([b, i]);
      trace.hovertext.push(
        `<b>${nameOf(branch)}</b>${special}<br>κ<sub>n</sub>L/2π = ${digits(kappa_n[i])}<br>κ* = ${digits(kappa_star[i])}<br>energy = ${digits(energy[i])}<br>${word}${index && kind !== "unknown" ? `, index ${index}` : ""}`,
      );
    }
  });
  return { type: "scatter", mode: "lines", line: { width: 0 }, hoverinfo: "text", showlegend: false, ...trace };
}

/** Folds, bifurcations and other labelled points, to be seen. */
function specialPoints() {
  const found = now.family.branches.flatMap((branch) => branch.marks || []).filter((mark) => mark.kind in SYMBOLS);
  return {
    type: "scatter",
    mode: "markers",
    x: found.map((mark) => mark.kappa_n),
    y: found.map((mark) => mark.kappa_star),
    hoverinfo: "skip",
    showlegend: false,
    marker: {
      symbol: found.map((mark) => SYMBOLS[mark.kind][0]),
      size: found.map((mark) => SYMBOLS[mark.kind][1]),
      color: colour("mark"),
      opacity: 1,
      line: { width: 1, color: colour("card") },
    },
  };
}

function diagramTraces() {
  const drawn = [...lines()].map(([group, { x, y }]) => ({
    type: "scatter",
    mode: "lines",
    name: group,
    x,
    y,
    line: styleOf(group),
    hoverinfo: "skip",
    showlegend: false,
  }));
  const order = ["unknown", "unstable", "stable"];
  drawn.sort((a, b) => order.indexOf(a.name) - order.indexOf(b.name));
  const halo = {
    type: "scatter",
    mode: "lines",
    ...selected(),
    line: { color: colour("front"), width: 9 },
    opacity: 0.38,
    hoverinfo: "skip",
    showlegend: false,
  };
  const here = {
    type: "scatter",
    mode: "markers",
    x: [],
    y: [],
    hoverinfo: "skip",
    showlegend: false,
    marker: { size: 13, color: colour("front"), line: { width: 2, color: colour("mark") } },
  };
  return [halo, ...drawn, points(), specialPoints(), here];
}

function diagramLayout() {
  const axis = {
    gridcolor: colour("grid"),
    zeroline: false,
    linecolor: colour("line"),
    tickcolor: colour("line"),
    automargin: false,
  };
  return {
    margin: MARGIN,
    paper_bgcolor: "rgba(0,0,0,0)",
    plot_bgcolor: "rgba(0,0,0,0)",
    font: { family: "system-ui, sans-serif", size: 13, color: colour("soft") },
    xaxis: { ...axis, title: { text: "natural curvature κ<sub>n</sub>L/2π", standoff: 8 }, range: range.x },
    yaxis: { ...axis, title: { text: "conjugate curvature κ*", standoff: 10 }, range: range.y },
    annotations: ringNames(),
    hovermode: "closest",
    hoverdistance: 30,
    dragmode: "pan",
    hoverlabel: { bgcolor: colour("card"), bordercolor: colour("line"), font: { color: colour("ink") } },
  };
}

/** Names of the rings, at the right end of what is shown first of their lines. */
function ringNames() {
  return now.family.branches
    .filter((branch) => branch.circle)
    .map((ring) => {
      const x = Math.min(range.x[1], ring.columns.kappa_n[ring.size - 1]),
        [s] = [...ring.places(x), ring.size - 1];
      return {
        x,
        y: ring.value("kappa_star", s),
        text: loopName(ring.m),
        showarrow: false,
        xanchor: "right",
        yanchor: "bottom",
        font: { size: 11.5, color: colour("ink") },
        bgcolor: colour("card"),
        opacity: 0.85,
        borderpad: 0,
        yshift: 4,
      };
    });
}

const ends = (values) => [values.reduce((a, b) => Math.min(a, b)), values.reduce((a, b) => Math.max(a, b))];

/** The part of the diagram that is shown: all of it, or of many branches the neighbourhood of the rings. */
function extent(whole) {
  const places = now.family.branches.flatMap(({ columns }) => [...columns.kappa_n].map((k, i) => [k, columns.kappa_star[i]]));
  let [low, high] = ends(places.map(([k]) => k));
  if (!whole && now.family.branches.length > 4) [low, high] = [Math.max(low, -8), Math.min(high, 14)];
  const [bottom, top] = ends(places.filter(([k]) => k >= low && k <= high).map(([, star]) => star));
  const across = 0.06 * (high - low || 1),
    up = 0.08 * (top - bottom || 1);
  return { x: [low - across, high + across], y: [bottom - up, top + up] };
}

async function drawDiagram() {
  await Plotly.react("diagram", diagramTraces(), diagramLayout(), {
    responsive: true,
    displaylogo: false,
    scrollZoom: true,
    displayModeBar: false,
  });
  drawLegend();
  placeMarker();
}

function drawLegend() {
  const groups = [...lines().keys()].sort(),
    svg = ({ color, dash, width }) =>
      `<svg width="34" height="10" aria-hidden="true"><path d="M1 5H33" stroke="${color}" stroke-width="${width}" stroke-dasharray="${{ solid: "none", dot: "2 3", dash: "7 4", longdash: "11 4", dashdot: "7 3 2 3", longdashdot: "11 3 2 3" }[dash] || dash.replaceAll("px", "")}"/></svg>`;
  const words = { stable: "stable", unstable: "unstable", unknown: "index not known" };
  const marks = new Set(now.family.branches.flatMap((branch) => (branch.marks || []).map((mark) => mark.kind)));
  $("legend").innerHTML =
    groups.map((group) => `<span>${svg(styleOf(group))}${words[group] || group}</span>`).join("") +
    [
      ["circle", "● meets a flat ring"],
      ["fold", "★ fold"],
      ["secondary", "◆ secondary bifurcation"],
    ]
      .filter(([kind]) => marks.has(kind))
      .map(([, text]) => `<span>${text}</span>`)
      .join("");
}

/** The line of the branch that is selected. */
function selected() {
  const { branch } = now,
    x = [],
    y = [],
    steps = branch.circle ? 1 : FINE;
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
  const { clientWidth: w, clientHeight: h } = $("diagram"),
    { xaxis, yaxis } = $("diagram").layout;
  const part = (name, { range: [low, high] }) => (branch.value(name, s) - low) / (high - low);
  const across = part("kappa_n", xaxis),
    up = part("kappa_star", yaxis);
  return {
    x: MARGIN.l + across * (w - MARGIN.l - MARGIN.r),
    y: h - MARGIN.b - up * (h - MARGIN.t - MARGIN.b),
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
  const [b, i] = point.customdata,
    branch = now.family.branches[b],
    here = pixel(branch, i);
  const distance = (place) => Math.hypot(pixel(branch, place).x - here.x, pixel(branch, place).y - here.y);
  const near = (branch.marks || []).map((mark) => mark.point).filter((place) => distance(place) < 6);
  go(branch, near.length ? near.reduce((p, q) => (distance(p) < distance(q) ? p : q)) : i);
}
