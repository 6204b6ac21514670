"use strict";
// The state of the page, one place on one branch, and the words for it.

const $ = (id) => document.getElementById(id);
const DATA = JSON.parse($("data").textContent);
const STRIPS = DATA.kind === "strips"; // closed ones
const SHAPES = DATA.kind !== "branches"; // strips, closed or open; else branches of any problem, without shapes in space
const FAMILIES = DATA.families.map((family) => ({
  ...family,
  branches: [
    ...family.branches.map((about) => new Branch(about, family)),
    ...family.circles.map((about) => new Branch(about, family)),
  ],
}));
const AXES = new Map(DATA.axes.map(([name, title, brief, decimals = 8]) => [name, { title, brief, decimals }]));
const COLUMNS = DATA.told || [...AXES.keys()].filter((name) => name !== "elastic" && name !== "index"); // in read-outs
const now = { family: FAMILIES[0], branch: null, s: 0, playing: false, x: DATA.shown[0], y: DATA.shown[1] };

// --- words ---------------------------------------------------------------------------------------------------------

const LOOPS = {
  1: "single",
  2: "double",
  3: "triple",
  4: "fourfold",
  5: "fivefold",
  6: "sixfold",
  7: "sevenfold",
  8: "eightfold",
  9: "ninefold",
};

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
const minus = (text) => text.replace("-", "−");
const short = (value) =>
  minus(
    value
      .toPrecision(5)
      .replace(/(\.\d*?)0+$/, "$1")
      .replace(/\.$/, ""),
  );
const digits = (value, decimals = 8) => minus(Math.abs(value) < 1e6 ? value.toFixed(decimals).replace(/^-(0\.?0*)$/, "$1") : value.toPrecision(9));
/** A value at a place of a branch: between computed points those digits that hold, after a sign that it is interpolated. */
function digitsAt(branch, name, s, most = AXES.get(name).decimals) {
  const value = branch.value(name, s),
    error = branch.uncertainty(name, s);
  if (error === 0) return digits(value, most);
  if (!(error < Math.abs(value) || error < 10 ** (8 - most))) return `≈ ${minus(value.toPrecision(1))}`;
  return `≈ ${minus(value.toFixed(Math.min(most, Math.max(0, Math.floor(-Math.log10(error))))))}`;
}
const escaped = (text) => text.replace(/[&<>"]/g, (letter) => `&#${letter.charCodeAt(0)};`);
const loopName = (m) => (m < 0 ? `${LOOPS[-m] || -m + "-fold"} loop, curled the wrong way` : `${LOOPS[m] || m + "-fold"} loop`);
const percent = (width) => (width < 2 * Math.PI ? `${((100 * width) / (2 * Math.PI)).toPrecision(2)} % width` : "never");
const nameOf = (branch) => {
  if (branch.profile) return branch.name;
  if (branch.circle) return loopName(branch.m);
  return "origin" in branch ? `from (${branch.m}, ${branch.n}) at ${short(branch.origin)}` : `(${branch.m}, ${branch.n})`;
};

function stability(branch, s) {
  const index = branch.index(s);
  const there = Math.abs(s - Math.round(s)) < 1e-6 && !(branch.m <= 0); // a point where some direction is neutral
  if (index === null) return ["unknown", !branch.hasIndex ? "not computed" : there ? "on the verge" : "not known", ""];
  return index === 0 ? ["stable", "stable", "0"] : ["unstable", "unstable", index === -2 ? "∞" : String(index)];
}

/** The labelled point at s, if there is one. */
const markAt = (branch, s) => (branch.marks || []).find((mark) => Math.abs(mark.point - s) < 1e-6);

const MARK_WORDS = {
  secondary: "Another branch, with less symmetry, crosses here.",
  limit: "The computation was told to stop here; the branch goes on.",
};

const STEADY = {
  stable: "It is stable: push it a little and it comes back.",
  unstable: "It is unstable: forces balance, but the least push makes it leave.",
  unknown: "",
};

/** What a fold means for a strip: it depends on the stability of both sides, and without that nothing is said. */
function foldWords(branch, s) {
  const sides = [-0.5, 0.5].map((side) => stability(branch, s + side)),
    kinds = sides.map(([kind]) => kind);
  if (kinds.includes("unknown") || !kinds.includes("unstable")) return "At this fold the branch turns back.";
  if (!kinds.includes("stable"))
    return `At this fold the branch turns back. It is unstable on both sides (index ${sides.map(([, , index]) => index).join(" and ")}): no strip comes here by itself.`;
  const { way } = markAt(branch, s);
  const words = "At this fold the branch turns back and is no longer stable: a strip that is pushed on snaps.";
  if (!way) return `${words} A page of fewer branches shows where to.`;
  return way.failed ? `${words} Where to is not known: ${way.failed}.` : words;
}

function story() {
  const { branch, s } = now,
    mark = markAt(branch, s),
    [kind] = stability(branch, s);
  if (branch.profile) return mark ? `Special point: ${mark.name}. ${mark.fall || ""}`.trim() : branch.stop && `The run stopped: ${branch.stop}.`;
  if (branch.circle)
    return `A flat ring: the strip goes round ${Math.abs(branch.m) === 1 ? "once" : `${Math.abs(branch.m)} times`} (${loopName(branch.m)}). ${STEADY[kind]}`;
  if (mark && mark.kind === "circle")
    return `Here the branch meets the ${loopName(mark.covering)}, flat again. Beyond it, waves grow.`;
  const to = branch.to === null ? "does not come back" : `ends on the ${loopName(branch.to)}`;
  const way =
    "origin" in branch
      ? `This shape has less symmetry than the branch (${branch.m}, ${branch.n}) that it comes from.`
      : `This branch leaves the ${loopName(branch.m)} with ${branch.n} wave${branch.n > 1 ? "s" : ""} round the strip, and ${to}.`;
  if (mark && mark.kind === "fold") return `${way} ${foldWords(branch, s)}`;
  if (mark && mark.kind === "end" && mark.point === branch.size - 1) return `${way} The run stopped: ${branch.stop}.`;
  return `${way} ${(mark && MARK_WORDS[mark.kind]) || STEADY[kind]}`;
}
