"use strict";
// The way down from a fold, along the energy, that `ribbon_model.descent` computed when the page was written.

const DESCENT_TIME = 5000, // milliseconds
  LAID_STATIONS = 384,
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

/** The frames of a strip at equidistant stations; the sign of the quaternions is continuous along it. */
function frames(strip) {
  const n = count(strip),
    result = [];
  for (let k = 0; k < LAID_STATIONS; k++) {
    const at = Math.round((k * n) / LAID_STATIONS) % n,
      row = strip.subarray(at * STATION, (at + 1) * STATION);
    const q = quaternion([row.subarray(3, 6), row.subarray(6, 9), row.subarray(9, 12)]),
      last = result[k - 1];
    result.push(last && dot4(last, q) < 0 ? q.map((part) => -part) : q);
  }
  return result;
}

/** The rotation that lays the frames `from` over `to` best, at the best shift along the strip. */
function aligned(from, to) {
  let best = { fit: -1 };
  for (let trial = 0; trial < SHIFTS; trial++) {
    const shift = (trial * LAID_STATIONS) / SHIFTS;
    // the mean of to * conjugate(from) is the rotation that fits best; the sign jumps where the station numbers wrap round
    const wrap = Math.sign(dot4(to[0], to[LAID_STATIONS - 1])),
      sum = [0, 0, 0, 0];
    for (let k = 0; k < LAID_STATIONS; k += 4) {
      const sign = k + shift < LAID_STATIONS ? 1 : wrap,
        relative = product(to[(k + shift) % LAID_STATIONS], conjugate(from[k]));
      relative.forEach((part, i) => (sum[i] += sign * part));
    }
    const fit = Math.hypot(...sum);
    if (fit > best.fit) best = { fit, turn: sum.map((part) => part / fit) };
  }
  return best.turn;
}

/** A strip turned by a unit quaternion. */
function turnedBy(q, strip) {
  const columns = directors(...q),
    turn = (a) => columns.reduce((sum, column, i) => along(sum, a[i], column), [0, 0, 0]),
    result = Float64Array.from(strip);
  for (let at = 0; at < strip.length; at += STATION)
    for (let i = 0; i < 12; i += 3) result.set(turn(strip.subarray(at + i, at + i + 3)), at + i);
  return result;
}

/** The way down as a function of t, 0 ... 1; it begins as the strip `first` stands, and ends as `last` does, if there is one. */
function descent({ columns, shapes }, first, last) {
  const way = new Branch({ columns, shapes, file: "descent", domain: "loop" }, now.family),
    end = way.size - 1,
    laid = (s, over) => aligned(frames(way.strip(s)), frames(over));
  const from = laid(0, first),
    to = last ? laid(end, last) : from;
  return (t) => turnedBy(between(from, to, t), way.strip(t * end));
}

/** The fold here with its way down; undefined where no stable strip comes to a fold. */
const wayHere = () => (!now.branch.leftOut && (markAt(now.branch, now.s) || {}).way) || undefined;
const canSnap = () => Boolean(wayHere() && wayHere().shapes);

/** The place on the page of the state in which a strip comes to rest; undefined where the page does not hold it. */
function restOf({ m, n, kind, energy }, kappa) {
  const there = now.family.branches.filter((one) => one.m === m && (kind === "circle" ? one.circle : one.n === n && !("origin" in one)));
  const places = there.flatMap((branch) => branch.places(kappa).map((s) => ({ branch, s })));
  const off = ({ branch, s }) => Math.abs(branch.value("energy", s) - energy);
  return places.sort((a, b) => off(a) - off(b))[0];
}

const restName = ({ kind, m, n }) => (kind === "circle" ? `the ${loopName(m)}` : kind === "unknown" ? "a state on none of the primary branches" : `a shape of the branch (${m}, ${n})`);

/** Play the way down from the fold, then stay where it ends. */
async function snap() {
  if (!canSnap() || now.falling) return;
  if (now.playing) await play();
  const way = wayHere(),
    from = now.branch,
    rest = restOf(way.ends[0], way.kappa_n),
    at = descent(way, from.strip(now.s), rest && !rest.branch.leftOut && rest.branch.strip(rest.s)),
    begin = performance.now();
  $("story").textContent =
    `Let go at κₙL/2π = ${short(way.kappa_n)}, just past the fold, the strip follows its energy down and comes to rest as ` +
    `${way.ends.map(restName).join(" or, with other damping, as ")}. This is a descent without inertia, not the motion in time.`;
  for (let t = 0; t < 1 && now.branch === from;) {
    const time = await new Promise(requestAnimationFrame);
    t = Math.min(1, Math.max(0, time - begin) / DESCENT_TIME);
    now.falling = at(t);
    await updateState();
  }
  now.falling = null;
  await (now.branch === from && rest ? go(rest.branch, rest.s) : update());
}
