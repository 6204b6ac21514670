"use strict";
// From a fold to another state of the same natural curvature: a picture between two shapes, not the dynamics.

const MORPH_TIME = 2600, // milliseconds
  MORPH_STATIONS = 384,
  SHIFTS = 96; // of the second shape along the strip, that are tried to lay it over the first

/** The unit quaternion of directors d1, d2, d3 (columns of a rotation). */
function quaternion([a, b, c]) {
  const trace = a[0] + b[1] + c[2];
  const candidates = [
    [1 + trace, b[2] - c[1], c[0] - a[2], a[1] - b[0]],
    [b[2] - c[1], 1 + 2 * a[0] - trace, a[1] + b[0], c[0] + a[2]],
    [c[0] - a[2], a[1] + b[0], 1 + 2 * b[1] - trace, b[2] + c[1]],
    [a[1] - b[0], c[0] + a[2], b[2] + c[1], 1 + 2 * c[2] - trace],
  ];
  const best = candidates.reduce((p, q, i) => (q[i] > candidates[p][p] ? i : p), 0),
    size = Math.hypot(...candidates[best]);
  return candidates[best].map((part) => part / size);
}

const dot4 = (p, q) => p[0] * q[0] + p[1] * q[1] + p[2] * q[2] + p[3] * q[3];
const conjugate = ([a, b, c, d]) => [a, -b, -c, -d];
const product = ([a, b, c, d], [e, f, g, h]) => [
  a * e - b * f - c * g - d * h,
  a * f + b * e + c * h - d * g,
  a * g - b * h + c * e + d * f,
  a * h + b * g - c * f + d * e,
];

/** Between two unit quaternions, of the nearer of the signs. */
function between(p, q, t) {
  const mixed = p.map((part, i) => (1 - t) * part + t * q[i]),
    size = Math.hypot(...mixed) || 1;
  return mixed.map((part) => part / size);
}

/** A strip as {frames, eta} at equidistant stations; the sign of the quaternions is continuous along it. */
function frames(strip) {
  const n = count(strip),
    result = { frames: [], eta: [] };
  for (let k = 0; k < MORPH_STATIONS; k++) {
    const at = Math.round((k * n) / MORPH_STATIONS) % n,
      row = strip.subarray(at * STATION, (at + 1) * STATION);
    const q = quaternion([row.subarray(3, 6), row.subarray(6, 9), row.subarray(9, 12)]),
      last = result.frames[k - 1];
    result.frames.push(last && dot4(last, q) < 0 ? q.map((part) => -part) : q);
    result.eta.push(row[12]);
  }
  return result;
}

/** The shift and rotation that lay the frames `from` over `to` best: {shift, turn, fit}, fit 1 where they agree. */
function aligned(from, to) {
  let best = { fit: -1 };
  for (let trial = 0; trial < SHIFTS; trial++) {
    const shift = (trial * MORPH_STATIONS) / SHIFTS;
    // the mean of to * conjugate(from) is the rotation that fits best; the sign jumps where the station numbers wrap round
    const wrap = Math.sign(dot4(to[0], to[MORPH_STATIONS - 1])),
      sum = [0, 0, 0, 0];
    for (let k = 0; k < MORPH_STATIONS; k += 4) {
      const sign = k + shift < MORPH_STATIONS ? 1 : wrap,
        relative = product(to[(k + shift) % MORPH_STATIONS], conjugate(from[k]));
      relative.forEach((part, i) => (sum[i] += sign * part));
    }
    const size = Math.hypot(...sum),
      fit = (4 * size) / MORPH_STATIONS;
    if (fit > best.fit) best = { fit, shift, wrap, turn: sum.map((part) => part / size) };
  }
  return best;
}

/** The strip between two strips as a function of t, 0 ... 1: frames are interpolated and integrated, and the gap is closed. */
function morph(first, second) {
  const [from, to] = [frames(first), frames(second)],
    { shift, turn, wrap, fit } = aligned(from.frames, to.frames);
  const target = from.frames.map((_, k) => {
    const sign = k + shift < MORPH_STATIONS ? 1 : wrap;
    return to.frames[(k + shift) % MORPH_STATIONS].map((part) => sign * part);
  });
  const identity = turn[0] < 0 ? [-1, 0, 0, 0] : [1, 0, 0, 0];
  const at = (t) => {
    const back = between(conjugate(turn), identity, t); // at 0 as the first strip stands, at 1 as the second
    const mixed = from.frames.map((q, k) => product(back, between(product(turn, q), target[k], t)));
    const eta = from.eta.map((value, k) => (1 - t) * value + t * to.eta[(k + shift) % MORPH_STATIONS]);
    return integrated(mixed, eta);
  };
  return { fit, at };
}

/** A closed strip from its frames: the mean tangent is taken out, and its middle lies at the origin. */
function integrated(mixed, eta) {
  const n = mixed.length,
    rows = mixed.map((q) => directors(...q)),
    mean = rows.reduce((sum, d) => along(sum, 1 / n, d[2]), [0, 0, 0]),
    step = (2 * Math.PI) / n,
    places = [];
  let x = [0, 0, 0];
  for (let k = 0; k < n; k++) {
    places.push(x);
    const here = along(along([0, 0, 0], 0.5, rows[k][2]), 0.5, rows[(k + 1) % n][2]);
    x = along(x, step, along(here, -1, mean));
  }
  const middle = places.reduce((sum, place) => along(sum, 1 / n, place), [0, 0, 0]);
  const flat = new Float64Array(n * STATION);
  rows.forEach((d, k) => flat.set([...along(places[k], -1, middle), ...d.flat(), eta[k]], k * STATION));
  return flat;
}

/** The state that a strip at this place may snap to: of those of lower energy, stable if one is, the most alike; or null. */
function snapTarget(branch, s) {
  const energy = branch.value("energy", s),
    lower = coexisting(branch, s).filter((one) => one.branch !== branch && one.energy < energy - 1e-9),
    stable = lower.filter((one) => stability(one.branch, one.s)[0] === "stable");
  const found = (stable.length ? stable : lower).map((one) => ({
    ...one,
    path: morph(branch.strip(s), one.branch.strip(one.s)),
  }));
  return found.reduce((best, one) => (best && best.path.fit >= one.path.fit ? best : one), null);
}

/** Whether a strip can come to this place and must leave it: a fold, and stable on one side if the index is known. */
function canSnap() {
  const { branch, s } = now;
  if (!STRIPS || branch.leftOut || (markAt(branch, s) || {}).kind !== "fold") return false;
  return !branch.hasIndex || [-0.5, 0.5].some((side) => branch.index(s + side) === 0);
}

/** Play the way from the fold to the state that `snapTarget` finds, then stay there. */
async function snap() {
  const target = canSnap() && !now.morph && snapTarget(now.branch, now.s);
  if (!target) return;
  if (now.playing) await play();
  const begin = performance.now(),
    from = now.branch;
  $("story").textContent =
    `A picture between two shapes, not the dynamics: towards the ${nameOf(target.branch)}, of the ` +
    `${stability(target.branch, target.s)[0] === "stable" ? "stable " : ""}states of lower energy the one most alike.`;
  now.snaps = { to: target.branch.id, energy: target.energy, fit: target.path.fit };
  for (let t = 0; t < 1 && now.branch === from;) {
    const time = await new Promise(requestAnimationFrame);
    t = Math.min(1, Math.max(0, time - begin) / MORPH_TIME);
    now.morph = target.path.at(t * t * (3 - 2 * t));
    await updateState();
  }
  now.morph = null;
  await (now.branch === from ? go(target.branch, target.s) : update());
}
