"use strict";
// Lines and marks of the map: how each piece is drawn, and the entries of its legend.

const WAVES = 7; // colours of wavenumbers, --wave1 ... in the style sheet
const STYLES = { stable: ["solid", 3.4], unstable: ["5px,3px", 1.5], unknown: ["solid", 1.5] };
const STYLE_WORDS = { stable: "stable", unstable: DATA.told ? "unstable, with its index" : "unstable", unknown: "stability not known" };
const SYMBOLS = {
  circle: ["circle", 7, "meets a flat ring", "●"],
  fold: ["star", 12, "fold", "★"],
  secondary: ["diamond", 9, STRIPS ? "secondary bifurcation" : "branch point", "◆"],
  hopf: ["square", 9, "Hopf point", "■"],
  user: ["x", 8, "given value", "✕"],
  exact: ["star-open", 11, "fold of the exact solution", "☆"], // of an overlay
  measured: ["square-open", 8, "measured", "□"],
};

const wave = (number) => colour(`wave${((number - 1) % WAVES) + 1}`);

/** What the colour of a branch says: a word for the legend, and the colour. */
function hueOf(branch) {
  if (branch.profile) return { text: branch.name, tint: wave(now.family.branches.indexOf(branch) + 2) };
  if (branch.circle) return { text: "flat rings", tint: colour("soft") };
  if ("origin" in branch) return { text: "secondary branches", tint: colour("mark") };
  return { text: `n = ${branch.n}`, tint: wave(branch.n) };
}

/** How the piece at s is drawn: {key, hue, tint, kind}; solid where it is stable, dashed where it is not. */
function styleAt(branch, s) {
  const [kind] = stability(branch, s);
  if ($("colour").value === "stability") return { key: kind, hue: "", tint: colour(kind), kind };
  const { text, tint } = hueOf(branch);
  return { key: `${text}|${kind}`, hue: text, tint, kind };
}

/** Pieces of all branches, grouped by how they are drawn: style and {x, y} of each. */
function lines() {
  const groups = new Map();
  for (const branch of now.family.branches) {
    const { x, y } = branch.line(now.x, now.y);
    let last = null;
    for (let i = 0; i + 1 < branch.size; i++) {
      const style = styleAt(branch, i + 0.5);
      if (!groups.has(style.key)) groups.set(style.key, { ...style, x: [], y: [] });
      const group = groups.get(style.key);
      if (group !== last) (group.x.push(null), group.y.push(null));
      for (let j = i * FINE + (group === last ? 1 : 0); j <= (i + 1) * FINE; j++) (group.x.push(x[j]), group.y.push(y[j]));
      last = group;
    }
  }
  const order = ["unknown", "unstable", "stable"]; // the last is drawn on top
  return [...groups.values()].sort((a, b) => order.indexOf(a.kind) - order.indexOf(b.kind));
}

const strokeOf = ({ tint, kind }) => ({ color: tint, dash: STYLES[kind][0], width: STYLES[kind][1], simplify: false });

/** The name beside a special point, of closed strips beside a fold, on the side to which its branch does not go. */
function nameAt(branch, { kind, point, tag }) {
  const x = branch.columns[now.x],
    rises = x[point] > x[Math.max(point - 1, 0)],
    room = (range.x[1] - x[point]) / (range.x[1] - range.x[0]) > 60 / $("diagram").clientWidth; // pixels of a name
  return { name: tag || (STRIPS && kind === "fold" ? nameOf(branch) : ""), side: rises && room ? "right" : "left" };
}

/** Labelled points of the family that have a symbol. */
const marks = () =>
  now.family.branches.flatMap((branch) =>
    (branch.marks || [])
      .filter((mark) => mark.kind in SYMBOLS)
      .map((mark) => ({ kind: mark.kind, x: branch.columns[now.x][mark.point], y: branch.columns[now.y][mark.point], ...nameAt(branch, mark) })),
  );

/** Entries of the legend, of what is inside the axes: lines {text, tint, kind} and symbols {text, symbol}. */
function legendEntries(groups) {
  const [x, y] = [shownRange("x"), shownRange("y")].map(
    ([a, b]) =>
      (value) =>
        value !== null && value >= a && value <= b,
  );
  const seen = groups.filter((group) => group.x.some((value, i) => x(value) && y(group.y[i]))),
    kinds = [...new Set(seen.map((group) => group.kind))];
  const hues = new Map(seen.filter(({ hue }) => hue).map((group) => [group.hue, group.tint]));
  const collator = new Intl.Collator("en", { numeric: true });
  const colours = [...hues].sort((a, b) => collator.compare(a[0], b[0])).map(([text, tint]) => ({ text, tint, kind: "plain" }));
  const styles = kinds
    .filter((kind) => !hues.size || kinds.length > 1 || kind !== "unknown")
    .map((kind) => ({ text: STYLE_WORDS[kind], tint: hues.size ? colour("mark") : colour(kind), kind }));
  const there = new Set(marks().flatMap((mark) => (x(mark.x) && y(mark.y) ? [mark.kind] : [])));
  if (measured().length) there.add("measured");
  const symbols = Object.keys(SYMBOLS).filter((kind) => there.has(kind));
  return [...colours, ...styles.reverse(), ...symbols.map((symbol) => ({ text: SYMBOLS[symbol][2], symbol }))];
}

STYLES.plain = ["solid", 2.4]; // of a colour in the legend, whatever the stability
