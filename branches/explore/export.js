"use strict";
// Files to take away: pictures, tables, the solid for a printer.

function csv(branch) {
  const names = Object.keys(branch.columns).filter((name) => name !== "elastic"), // the file holds the others
    head = [...(branch.circle ? [] : ["point", "label"]), ...names.map((name) => (DATA.told && AXES.has(name) ? AXES.get(name).brief : name))].join(",");
  const rows = Array.from({ length: branch.size }, (_, i) =>
    [...(branch.circle ? [] : [i, branch.labels[i] || ""]), ...names.map((name) => branch.columns[name][i])].join(","),
  );
  return [head, ...rows, ""].join("\n");
}

function download(name, content, type) {
  const link = document.createElement("a");
  link.href =
    typeof content === "string" && content.startsWith("data:") ? content : URL.createObjectURL(new Blob([content], { type }));
  link.download = name;
  link.click();
  if (link.href.startsWith("blob:")) setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

const decoded = (dataUrl) => decodeURIComponent(dataUrl.slice(dataUrl.indexOf(",") + 1));

/** Make a picture with the colours of the ground that is chosen: those of the screen, or the light ones. */
function onGround(make) {
  const root = document.documentElement;
  if ($("ground").value === "white") root.dataset.theme = "light";
  try {
    return make({ screen: colour("card"), white: "#ffffff", clear: "rgba(0,0,0,0)" }[$("ground").value]);
  } finally {
    delete root.dataset.theme;
  }
}

/** A trace without points, for an entry of the legend. */
function legendTrace({ text, tint, kind, symbol, stroke }) {
  const trace = { type: "scatter", x: [null], y: [null], name: text, showlegend: true };
  if (!symbol) return { ...trace, mode: "lines", line: stroke || strokeOf({ tint, kind }) };
  return { ...trace, mode: "markers", marker: { symbol: SYMBOLS[symbol][0], size: SYMBOLS[symbol][1], color: colour("mark") } };
}

/** The map as shown, with a legend and the chosen state: a figure of its own. */
function diagramFigure(paper) {
  const layout = diagramLayout(),
    groups = lines(),
    font = { ...layout.font, color: colour("ink") };
  const here = {
    ...QUIET,
    mode: "markers",
    x: [now.branch.value(now.x, now.s)],
    y: [now.branch.value(now.y, now.s)],
    name: `chosen: ${nameOf(now.branch)}`,
    showlegend: true,
    marker: { size: 13, color: colour("front"), line: { width: 2, color: colour("mark") } },
  };
  const inside = ["x", "y"].every((axis) => here[axis][0] >= shownRange(axis)[0] && here[axis][0] <= shownRange(axis)[1]);
  const entries = legendEntries(groups).map(legendTrace),
    second = [...overlayEntries().map(legendTrace), ...(inside ? [here] : [])].map((trace) => ({
      ...trace,
      legend: "legend2",
    }));
  layout.annotations.forEach((note) => (note.bgcolor = paper));
  const legend = { orientation: "h", x: 0, y: -0.13, font, bgcolor: "rgba(0,0,0,0)", itemwidth: 40 };
  Object.assign(layout, { paper_bgcolor: paper, font, legend, showlegend: true, hovermode: false });
  layout.legend2 = { ...legend, y: -0.135 - 0.037 * Math.ceil(entries.length / 5) }; // entries of its own width, under the first
  layout.margin = { ...MARGIN, r: 24, t: 20, b: 160 };
  layout.xaxis.range = [...shownRange("x")];
  layout.yaxis.range = [...shownRange("y")];
  return { data: [...branchTraces(groups), indexTexts(), specialPoints(), ...entries, ...second], layout };
}

/** The strip as shown, or the profiles: a figure of its own. */
function stateFigure(paper) {
  if (SHAPES) return { data: ribbonTraces(shownStrip()), layout: { ...$("ribbon").layout, paper_bgcolor: paper } };
  const layout = profileLayout();
  return { data: profileTraces(), layout: { ...layout, paper_bgcolor: paper, font: { ...layout.font, color: colour("ink") } } };
}

async function picture(figure, format, [width, height]) {
  const image = await Plotly.toImage(onGround(figure), { format, width, height, scale: format === "png" ? 2 : 1 });
  return format === "svg" ? decoded(image) : image;
}

/** A picture of the strip from flat polygons. */
function flatPicture(paper) {
  const canvas = Object.assign(document.createElement("canvas"), { width: 2000, height: 2000 }),
    strip = shownStrip();
  canvas.getContext("2d").fillStyle = paper;
  canvas.getContext("2d").fillRect(0, 0, canvas.width, canvas.height);
  paint(canvas, strip, eyeNow(), scaleOf(strip), 1);
  return canvas.toDataURL();
}

const millimetres = (id) => Math.max(Number($(id).value) || 0, 1e-3);

/** The strip as a closed solid in millimetres, of the length, width and thickness that are chosen. */
function stlFile() {
  const unitLength = millimetres("length") / (2 * Math.PI),
    strip = shownStrip();
  return stl(sheets(strip, width(), unitLength, millimetres("thickness") / 2), count(strip));
}

const SAVED = {
  csv: () => ["csv", csv(now.branch), "text/csv"],
  yaml: () => [
    "yaml",
    now.branch.circle ? "# A planar circle has a closed formula; nothing was computed.\n" : now.branch.config,
    "text/yaml",
  ],
  stl: () => ["stl", stlFile(), "model/stl"],
  "diagram.png": async () => ["diagram.png", await picture(diagramFigure, "png", [1000, 760])],
  "diagram.svg": async () => ["diagram.svg", await picture(diagramFigure, "svg", [1000, 760]), "image/svg+xml"],
  "strip.svg": () => ["strip.svg", onGround(ribbonSvg), "image/svg+xml"],
  "strip.png": async () => ["strip.png", flat ? onGround(flatPicture) : await picture(stateFigure, "png", [1000, 1000])],
  "state.png": async () => ["state.png", await picture(stateFigure, "png", [1000, 700])],
  "state.svg": async () => ["state.svg", await picture(stateFigure, "svg", [1000, 700]), "image/svg+xml"],
};

async function save(what) {
  const [ending, content, type] = await SAVED[what]();
  const separator = /^(diagram|strip|state)/.test(ending) ? "_" : ".";
  download(`${now.branch.id}${separator}${ending}`, content, type);
}
