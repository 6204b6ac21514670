"use strict";
// A link to what is shown: the address of the page holds the place, the view and the sliders, after its #.

const CONTROLS = ["x", "y", "colour", "compare", "nu", "gamma", "width", "ground"]; // their values, where they are not the first ones
const FIRST_VALUES = Object.fromEntries(CONTROLS.map((id) => [id, $(id).value]));
let restoring = false,
  writing = 0; // timer: the address follows when nothing has moved for a moment

const rounded = (values) => values.map((value) => Number(Number(value).toPrecision(6))).join(",");
const numbers = (text, size) => {
  const values = (text || "").split(",").map(Number);
  return values.length === size && values.every(Number.isFinite) ? values : null;
};

/** What is shown, as text. */
function address() {
  const words = new URLSearchParams();
  if (FAMILIES.length > 1) words.set("material", String(FAMILIES.indexOf(now.family)));
  words.set("branch", now.branch.id);
  words.set("point", String(Number(now.s.toFixed(4))));
  for (const id of CONTROLS) if ($(id).value !== FIRST_VALUES[id]) words.set(id, $(id).value);
  const [x, y] = [shownRange("x"), shownRange("y")];
  if (rounded([...x, ...y]) !== rounded([...range.x, ...range.y])) words.set("map", rounded([...x, ...y]));
  if (SHAPES && $("triads").checked) words.set("directors", "1");
  const eye = SHAPES ? eyeNow() : Object.values(EYE);
  if (rounded(eye) !== rounded(Object.values(EYE))) words.set("eye", rounded(eye));
  return `#${words}`;
}

/** Write the address; as a new entry of the browser's history with `push`. */
function writeAddress(push) {
  clearTimeout(writing);
  const text = address();
  if (restoring || text === location.hash) return;
  history[push ? "pushState" : "replaceState"](null, "", text);
}

/** Write the address in a moment. */
function remember() {
  clearTimeout(writing);
  if (!restoring && !now.playing) writing = setTimeout(() => writeAddress(false), 300);
}

/** Give a control a value; its first one where it cannot have that. */
function setControl(control, value, first) {
  const possible = control.tagName === "SELECT" || (value !== null && Number.isFinite(Number(value)));
  control.value = value !== null && possible ? value : first;
  if (!control.value) control.value = first;
}

/** Show what an address says; what it does not say, or says wrongly, is as on a page just opened. */
async function restore(text) {
  restoring = true;
  const words = new URLSearchParams(text.replace(/^#/, ""));
  for (const id of CONTROLS) setControl($(id), words.get(id), FIRST_VALUES[id]);
  if (SHAPES) $("triads").checked = words.has("directors");
  await chooseFamily(FAMILIES[Number(words.get("material"))] ? Number(words.get("material")) : 0, words.get("compare"));
  const wanted = now.family.branches.find(({ id }) => id === words.get("branch")),
    branch = wanted || now.branch,
    absent = words.has("branch") && !wanted,
    s = words.has("point") && !absent ? Number(words.get("point")) : NaN;
  tell(absent ? `The link names the branch “${words.get("branch")}”, which is not on this page. Shown instead: ${nameOf(branch)}.` : "");
  await go(branch, Number.isFinite(s) ? s : opening(branch));
  const part = numbers(words.get("map"), 4),
    eye = numbers(words.get("eye"), 3) || Object.values(EYE);
  if (part) await zoom({ x: part.slice(0, 2), y: part.slice(2) });
  if (SHAPES && rounded(eye) !== rounded(eyeNow())) await look({ x: eye[0], y: eye[1], z: eye[2] });
  restoring = false;
}

/** Put the link on the clipboard. */
async function copyLink() {
  writeAddress(false);
  const done = (text) => {
    $("copy").textContent = text;
    setTimeout(() => ($("copy").textContent = "Copy link"), 2000);
  };
  try {
    await navigator.clipboard.writeText(location.href);
    done("Copied");
  } catch {
    window.prompt("The link to what is shown:", location.href);
  }
}
