"use strict";
// The map, one column of the branches against another, drawn by plotly; a marker above it says where we are.

const NARROW = 500; // pixels of a map in which names are short
const MARGIN = { l: 70, r: 12, t: 8, b: 54 };
let range = { x: [0, 1], y: [0, 1] }; // of the axes when the page, or another material, was opened

const shownRange = (axis) => ($("diagram").layout ? $("diagram").layout[`${axis}axis`].range : range[axis]);

/** Every computed point, to hover and click: a line that is not seen, since markers by the thousand are slow. */
function points() {
  const trace = { x: [], y: [], customdata: [], hovertext: [] };
  now.family.branches.forEach((branch, b) => {
    for (let i = 0; i < branch.size; i++) {
      trace.x.push(branch.columns[now.x][i]);
      trace.y.push(branch.columns[now.y][i]);
      trace.customdata.push([b, i]);
      trace.hovertext.push(hoverText(branch, i));
    }
  });
  return { type: "scatter", mode: "lines", line: { width: 0 }, hoverinfo: "text", showlegend: false, ...trace };
}

function hoverText(branch, i) {
  const mark = markAt(branch, i),
    [kind, word, index] = stability(branch, i);
  const special = mark && mark.kind in SYMBOLS ? `<br>${(mark.kind !== "user" && SYMBOLS[mark.kind][2]) || mark.name}` : "";
  const columns = STRIPS ? COLUMNS : [now.x, now.y];
  const values = columns
    .map((name) => [AXES.get(name), branch.columns[name][i]])
    .map(([{ brief, decimals }, value]) => `<br>${brief} = ${digits(value, decimals)}`)
    .join("");
  const known = branch.columns.index ? `<br>${word}${index && kind !== "unknown" ? `, index ${index}` : ""}` : "";
  return `<b>${escaped(nameOf(branch))}</b>${special}${values}${known}`;
}

/** Folds, bifurcations and other labelled points, to be seen. */
function specialPoints() {
  const found = marks();
  return {
    type: "scatter",
    mode: "markers+text",
    text: found.map(({ name }) => name && `\u2002${name}\u2002`), // beside the marker of the present place, too
    textposition: found.map(({ side }) => `${STRIPS ? "middle" : "top"} ${side}`),
    textfont: { size: 11.5, color: colour("ink") },
    x: found.map((mark) => mark.x),
    y: found.map((mark) => mark.y),
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

/** The index on the pieces of stages: a number above the middle of each unstable one. */
function indexTexts() {
  const found = [];
  for (const branch of DATA.told ? now.family.branches : [])
    for (let i = 0, first = 0; i + 1 < branch.size; i++) {
      const index = branch.index(i + 0.5);
      if (i + 2 < branch.size && branch.index(i + 1.5) === index) continue;
      const middle = branch.fromWay((branch.toWay(first) + branch.toWay(i + 1)) / 2);
      const [from, to] = [now.x, now.y].map((name) => [branch.value(name, middle), branch.value(name, Math.min(middle + 0.1, branch.size - 1))]),
        side = (from[1] - from[0]) * (to[1] - to[0]) > 0 ? "left" : "right"; // above the line
      if (index > 0) found.push({ index, side, x: from[0], y: to[0], tint: hueOf(branch).tint });
      first = i + 1;
    }
  return {
    ...QUIET,
    mode: "text",
    x: found.map(({ x }) => x),
    y: found.map(({ y }) => y),
    text: found.map(({ index }) => `<b>${index}</b>`),
    textposition: found.map(({ side }) => `top ${side}`),
    textfont: { size: 11.5, color: found.map(({ tint }) => tint) },
  };
}

const QUIET = { type: "scatter", mode: "lines", hoverinfo: "skip", showlegend: false };

/** Measured points with their errors, where both columns were measured. */
function measured() {
  const { [now.x]: x, [now.y]: y } = DATA.measured || {};
  if (!x || !y) return [];
  const bars = (name) => ({ array: DATA.measured[`error_${name}`], visible: `error_${name}` in DATA.measured, thickness: 1, width: 0 });
  const marker = { symbol: SYMBOLS.measured[0], size: SYMBOLS.measured[1], color: colour("mark") };
  return [{ ...QUIET, mode: "markers", x, y, error_x: bars(now.x), error_y: bars(now.y), marker }];
}

/** What is drawn of the branches themselves, in pictures too. */
const branchTraces = (groups) => [
  ...overlayTraces(),
  ...groups.map((group) => ({ ...QUIET, name: group.key, x: group.x, y: group.y, line: strokeOf(group) })),
  ...measured(),
];

function diagramTraces() {
  const line = { color: colour("front"), width: 9, simplify: false };
  const halo = { ...QUIET, ...now.branch.line(now.x, now.y), line, opacity: 0.38 };
  return [halo, ...branchTraces(lines()), points(), indexTexts(), specialPoints()];
}

const LETTER = 8.5; // width of a letter of the title of an axis, in pixels

function diagramLayout(height = $("diagram").clientHeight) {
  const { title, brief } = AXES.get(now.y);
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
    xaxis: { ...axis, title: { text: AXES.get(now.x).title, standoff: 8 }, range: range.x },
    yaxis: { ...axis, title: { text: title.length * LETTER < height - MARGIN.b ? title : brief, standoff: 6 }, range: range.y },
    annotations: ringNames(),
    hovermode: "closest",
    hoverdistance: 30,
    dragmode: "pan",
    hoverlabel: { bgcolor: colour("card"), bordercolor: colour("line"), font: { color: colour("ink") } },
  };
}

/** Names of the rings, at the right end of what is shown first of their lines; their energies lie too near each other. */
function ringNames() {
  if (now.x !== "kappa_n" || now.y !== "kappa_star") return [];
  return now.family.branches
    .filter((branch) => branch.circle)
    .map((ring) => {
      const x = Math.min(range.x[1], ring.columns.kappa_n[ring.size - 1]),
        [s] = [...ring.places(x), ring.size - 1];
      return {
        x,
        y: ring.value("kappa_star", s),
        text: $("diagram").clientWidth < NARROW ? `${minus(String(ring.m))}-fold` : loopName(ring.m),
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

const lowThird = (values) => [...values].sort((a, b) => a - b)[Math.floor(values.length / 3)] ?? Infinity;

/** The part of the diagram that is shown: all of it, or of many branches the neighbourhood of the rings. */
function extent(whole) {
  const places = now.family.branches.flatMap(({ columns }) => [...columns[now.x]].map((x, i) => [x, columns[now.y][i]]));
  let [low, high] = ends(places.map(([x]) => x));
  if (!whole && STRIPS && now.x === "kappa_n" && now.family.branches.length > 4)
    [low, high] = [Math.max(low, -8), Math.min(high, 14)];
  let [bottom, top] = ends(places.filter(([x]) => x >= low && x <= high).map(([, y]) => y));
  if (!whole && STRIPS && now.y !== "kappa_star") top = Math.min(top, lowThird(marks().map((mark) => mark.y))); // low states matter
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
  $("legend").innerHTML = [...legendEntries(lines()), ...overlayEntries()]
    .map((entry) => {
      if (entry.symbol) return `<span>${SYMBOLS[entry.symbol][3]} ${entry.text}</span>`;
      const { color, dash, width } = entry.stroke || strokeOf(entry),
        pattern = dash === "solid" ? "none" : dash.replaceAll("px", "");
      const path = `<path d="M1 5H33" stroke="${color}" stroke-width="${width}" stroke-dasharray="${pattern}"/>`;
      return `<span><svg width="34" height="10" aria-hidden="true">${path}</svg>${escaped(entry.text)}</span>`;
    })
    .join("");
}

/** Lay the halo under the branch that is selected now. */
function highlight() {
  const { x, y } = now.branch.line(now.x, now.y);
  return Plotly.restyle("diagram", { x: [x], y: [y] }, [0]);
}

/** Show this part of the map. */
const zoom = (part) => Plotly.relayout("diagram", { "xaxis.range": [...part.x], "yaxis.range": [...part.y] });

/** Where the place s of a branch is in the diagram's frame: pixels, and whether it is inside the axes. */
function pixel(branch, s) {
  const { clientWidth: w, clientHeight: h } = $("diagram");
  const part = (name, [low, high]) => (branch.value(name, s) - low) / (high - low);
  const across = part(now.x, shownRange("x")),
    up = part(now.y, shownRange("y"));
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
