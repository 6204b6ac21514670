"use strict";
// Moving along branches, and the controls.

const FOLDING_TIME = 9000; // milliseconds from one end of a branch to the other
let busy = false,
  wanted = false; // a picture of the strip is being drawn; another one is wanted after it

/** Go to a place; what is drawn follows as fast as it can. */
function go(branch, s) {
  const other = branch !== now.branch;
  if (other) writeAddress(false); // the browser's back returns there
  now.branch = branch;
  now.s = Math.min(Math.max(s, 0), branch.size - 1);
  if (other) {
    $("branch").value = String(now.family.branches.indexOf(branch));
    highlight();
    writeAddress(true);
  }
  return update();
}

async function update() {
  $("slider").value = String(Math.round(1000 * now.branch.toWay(now.s)));
  $("slider").setAttribute("aria-valuetext", `${now.x} ${short(now.branch.value(now.x, now.s))}`);
  placeMarker();
  readOut();
  clearTimeout(idle);
  if (!now.playing) idle = setTimeout(drawStates, 150);
  remember();
  wanted = true;
  if (busy) return;
  busy = true;
  while (wanted) {
    wanted = false;
    await updateState();
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

// --- controls ------------------------------------------------------------------------------------------------------

function listBranches() {
  $("branch").replaceChildren(
    ...now.family.branches.map(
      (branch, i) => new Option(branch.circle ? nameOf(branch) : `branch ${nameOf(branch)}`, String(i)),
    ),
  );
}

/** Say something above the map; nothing with an empty text. */
function tell(text) {
  $("told").textContent = text;
  $("told").hidden = !text;
}

/** The place where a branch opens: a computed point about halfway. */
const opening = (branch) => (branch.circle ? branch.fromWay(0.45) : Math.round(branch.fromWay(0.45)));

async function chooseFamily(i, compare) {
  now.family = FAMILIES[i];
  $("family").value = String(i);
  now.branch = now.family.branches[0];
  now.s = opening(now.branch);
  offerAxes();
  [now.x, now.y] = [$("x").value, $("y").value];
  range = extent(false);
  listBranches();
  listOverlays();
  if ([...$("compare").options].some(({ value }) => value === compare)) $("compare").value = compare;
  await drawDiagram();
  await moveOverlay();
}

/** Draw the map against other columns; a column is not offered against itself. */
async function chooseAxes() {
  offerAxes();
  [now.x, now.y] = [$("x").value, $("y").value];
  range = extent(false);
  await drawDiagram();
  await update();
}

function offerAxes() {
  if ($("x").value === $("y").value) for (const id of ["x", "y"]) $(id).value = FIRST_VALUES[id];
  for (const [id, other] of [["x", "y"], ["y", "x"]])
    for (const option of $(id).options) option.disabled = option.hidden = option.value === $(other).value;
}

function listChoices() {
  FAMILIES.forEach(({ name }, i) => $("family").add(new Option(name, String(i))));
  $("family-label").hidden = FAMILIES.length < 2;
  for (const id of ["x", "y"]) {
    for (const [name, { brief }] of AXES) {
      const plain = Object.assign(document.createElement("span"), { innerHTML: brief }).textContent;
      if (!STRIPS || (id === "x") === (name === "kappa_n")) $(id).add(new Option(plain, name));
    }
    $(id).value = now[id];
    FIRST_VALUES[id] = now[id];
  }
  $("x-label").hidden = STRIPS;
  $("snap-bar").hidden = !FAMILIES.some(({ branches }) => branches.some(({ marks = [] }) => marks.some(({ way }) => way)));
  $("colour").parentElement.hidden = !FAMILIES.some(({ branches }) => branches.some((branch) => branch.hasIndex));
}

/** Show all of the map, or the part that was shown first. */
function wholeOrPart() {
  const all = extent(true),
    [low, high] = shownRange("x");
  range = low <= all.x[0] && high >= all.x[1] ? extent(false) : all;
  return zoom(range);
}

function resized() {
  $("width-value").textContent = `${$("width").value} % of length`;
  update();
}

function connect() {
  listChoices();
  $("family").onchange = (event) => chooseFamily(Number(event.target.value)).then(update);
  $("colour").onchange = () => drawDiagram().then(remember);
  $("x").onchange = $("y").onchange = chooseAxes;
  $("compare").onchange = $("nu").oninput = $("gamma").oninput = moveOverlay;
  $("branch").onchange = (event) => {
    const branch = now.family.branches[Number(event.target.value)];
    go(branch, opening(branch));
  };
  $("whole").onclick = wholeOrPart;
  $("width").oninput = resized;
  if (flat) $("triads").parentElement.hidden = true;
  $("triads").onchange = () => redraw();
  $("view").onclick = () => (SHAPES ? look(EYE) : drawProfile());
  if (SHAPES) $("ribbon").addEventListener("keydown", turnByKey);
  $("slider").oninput = (event) => go(now.branch, now.branch.fromWay(Number(event.target.value) / 1000));
  $("previous").onclick = () => step(-1, false);
  $("next").onclick = () => step(1, false);
  $("play").onclick = play;
  $("snap").onclick = snap;
  $("copy").onclick = copyLink;
  $("save").onclick = (event) => event.target.dataset.save && save(event.target.dataset.save);
  addEventListener("pointerup", ({ target }) => target.type === "range" && target.blur()); // arrow keys move along the branch again
  $("told").onclick = () => tell("");
  document.addEventListener("keydown", keyPressed);
  window.addEventListener("beforeprint", toPaper);
  window.addEventListener("afterprint", fromPaper);
  window.addEventListener("popstate", () => restore(location.hash));
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  new ResizeObserver(placeMarker).observe($("diagram"));
}

function keyPressed(event) {
  const chooses = /^(INPUT|SELECT)$/.test(event.target.tagName) && event.target.id !== "slider";
  if (event.ctrlKey || event.metaKey || event.altKey || chooses) return;
  if (event.key === " " && /^(BUTTON|SUMMARY)$/.test(event.target.tagName)) return;
  const branches = now.family.branches,
    other = (by) => {
      const branch = branches[(branches.indexOf(now.branch) + by + branches.length) % branches.length];
      go(branch, opening(branch));
    };
  const actions = {
    ArrowRight: () => step(1, event.shiftKey),
    ArrowLeft: () => step(-1, event.shiftKey),
    ArrowUp: () => other(-1),
    ArrowDown: () => other(1),
    Home: () => go(now.branch, 0),
    End: () => go(now.branch, now.branch.size - 1),
    " ": play,
    s: snap,
  };
  if (!(event.key in actions)) return;
  event.preventDefault();
  actions[event.key]();
}

async function redraw() {
  await drawDiagram();
  if (SHAPES && !flat && $("ribbon").data && !now.branch.leftOut) await Plotly.react("ribbon", ribbonTraces(shownStrip()), $("ribbon").layout);
  await update();
}

/** The map was moved: its marker and its legend follow. */
function mapMoved() {
  placeMarker();
  drawLegend();
  remember();
}

const PAPER = { width: 640, height: 280 }; // pixels of a picture on a page

/** Before the page is printed: light colours, pictures as wide as paper, and the strip as flat polygons, as WebGL is not printed. */
function toPaper() {
  document.documentElement.dataset.theme = "light";
  now.zoomed = { x: [...shownRange("x")], y: [...shownRange("y")] };
  const layout = { ...diagramLayout(PAPER.height), ...PAPER };
  layout.xaxis.range = now.zoomed.x;
  layout.yaxis.range = now.zoomed.y;
  Plotly.react("diagram", diagramTraces(), layout);
  drawLegend();
  if (!SHAPES) Plotly.react("ribbon", profileTraces(), { ...profileLayout(), ...PAPER });
  else $("printed").innerHTML = now.branch.leftOut ? "" : ribbonSvg("none");
}

async function fromPaper() {
  delete document.documentElement.dataset.theme;
  await redraw();
  for (const id of SHAPES ? ["diagram"] : ["diagram", "ribbon"]) await Plotly.Plots.resize(id);
  await zoom(now.zoomed);
}

/** Unpack the library that draws, and run it. */
async function loadLibrary() {
  const stream = new Blob([bytes($("library").textContent)]).stream().pipeThrough(new DecompressionStream("gzip")),
    code = await new Response(stream).text();
  document.head.append(Object.assign(document.createElement("script"), { textContent: code }));
  $("library").remove();
}

async function start() {
  if (!window.DecompressionStream) return tell("This page needs a browser of 2023 or later.");
  await loadLibrary();
  connect();
  $("width-value").textContent = `${$("width").value} % of length`;
  await restore(location.hash);
  now.diagramTime = performance.now();
  $("diagram").on("plotly_click", clicked);
  $("diagram").on("plotly_relayout", mapMoved);
  $("diagram").on("plotly_relayouting", placeMarker);
  drawStates();
  return performance.now();
}

/** For tests, and for whoever opens the console: the state, and how long the first picture took in milliseconds. */
window.explore = { now, go, coexisting, csv, exactCurve, descent, wayHere, restOf, families: FAMILIES, ready: start() };
