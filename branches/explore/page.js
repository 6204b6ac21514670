"use strict";
// Moving along branches, files to take away, and the controls.

const FOLDING_TIME = 9000; // milliseconds from one end of a branch to the other
let busy = false,
  wanted = false; // a picture of the strip is being drawn; another one is wanted after it

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
  const { branch, s } = now,
    near = direction > 0 ? Math.floor(s + 1e-9) + 1 : Math.ceil(s - 1e-9) - 1;
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
  let last = performance.now(),
    way = now.branch.toWay(now.s),
    branch = now.branch,
    place = now.s;
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
  const names = Object.keys(branch.columns),
    head = [...(branch.circle ? [] : ["label"]), ...names].join(",");
  const rows = Array.from({ length: branch.size }, (_, i) =>
    [...(branch.circle ? [] : [branch.labels[i]]), ...names.map((name) => branch.columns[name][i])].join(","),
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

async function save(what) {
  const { branch } = now,
    base = branch.circle ? `circle_${branch.m}` : branch.file.replace(/\.h5$/, "");
  if (what === "csv") return download(`${base}.csv`, csv(branch), "text/csv");
  if (what === "yaml")
    return download(
      `${base}.yaml`,
      branch.circle ? "# A planar circle has a closed formula; nothing was computed.\n" : branch.config,
      "text/yaml",
    );
  const format = what.split(".")[1],
    size = { format, width: 1000, height: 700, scale: format === "png" ? 2 : 1 };
  if (what === "ribbon.svg") return download(`${base}_strip.svg`, ribbonSvg(), "image/svg+xml");
  if (what === "ribbon.png")
    return download(
      `${base}_strip.png`,
      flat ? $("ribbon").querySelector("canvas").toDataURL() : await Plotly.toImage("ribbon", { ...size, height: 1000 }),
    );
  const traces = $("diagram").data.length - 1;
  await Plotly.restyle("diagram", { x: [[branch.value("kappa_n", now.s)]], y: [[branch.value("kappa_star", now.s)]] }, [
    traces,
  ]);
  const picture = await Plotly.toImage("diagram", size);
  await Plotly.restyle("diagram", { x: [[]], y: [[]] }, [traces]);
  return format === "svg"
    ? download(`${base}_diagram.svg`, decoded(picture), "image/svg+xml")
    : download(`${base}_diagram.png`, picture);
}

// --- controls ------------------------------------------------------------------------------------------------------

function listBranches() {
  $("branch").replaceChildren(
    ...now.family.branches.map(
      (branch, i) => new Option(branch.circle ? nameOf(branch) : `branch ${nameOf(branch)}`, String(i)),
    ),
  );
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
    const all = extent(true),
      shown = $("diagram").layout.xaxis.range;
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
  const branches = now.family.branches,
    other = (by) => {
      const branch = branches[(branches.indexOf(now.branch) + by + branches.length) % branches.length];
      go(branch, branch.fromWay(0.45));
    };
  const actions = {
    ArrowRight: () => step(1, event.shiftKey),
    ArrowLeft: () => step(-1, event.shiftKey),
    ArrowUp: () => other(-1),
    ArrowDown: () => other(1),
    Home: () => go(now.branch, 0),
    End: () => go(now.branch, now.branch.size - 1),
    " ": play,
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
