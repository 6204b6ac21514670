"use strict";
// Following a curve on which a function of two unknowns vanishes, and the exact branches that it gives.

const FIRST_STEP = 0.01,
  LONGEST_STEP = 0.12,
  SHORTEST_STEP = 1e-7,
  STRAIGHT = 0.99; // cosine of the largest turn in a step

const plus = ([x, y], s, [a, b]) => [x + s * a, y + s * b];

/** The unit tangent of the curve, by central differences; they only set the direction of search. */
function curveTangent(defect, z) {
  const slope = (e) => defect(plus(z, 1e-6, e)) - defect(plus(z, -1e-6, e)),
    across = [slope([1, 0]), slope([0, 1])],
    size = Math.hypot(...across);
  return [across[1] / size, -across[0] / size];
}

/** The curve's point on the normal to `tangent` through z, by the secant method; null where there is none nearby. */
function curvePoint(defect, z, [a, b]) {
  const at = (s) => defect(plus(z, s, [-b, a]));
  let [s, before] = [0, 1e-5],
    [value, old] = [at(s), at(before)];
  for (let i = 0; i < 25; i++) {
    const change = (-value * (s - before)) / (value - old);
    if (value === 0 || Math.abs(change) < 1e-13) return plus(z, s, [-b, a]);
    if (value === old) return Math.abs(value) < 1e-14 ? plus(z, s, [-b, a]) : null;
    if (!(Math.abs(change) < 0.5)) return null;
    [before, old, s] = [s, value, s + change];
    value = at(s);
  }
  return Math.abs(value) < 1e-13 ? plus(z, s, [-b, a]) : null;
}

/** Unknowns along a branch, from its circle to the one where it ends, or to where `stop(z)` says. */
function followed({ law, mode, defect }, stop) {
  const { m, n, nu } = mode,
    found = [law.circle(m, n, nu)],
    finish = law.covering(m, n);
  let z = found[0],
    tangent = curveTangent(defect, z),
    length = FIRST_STEP;
  if (tangent[0] < 0) tangent = tangent.map((part) => -part); // the amplitude grows from 0
  while (length > SHORTEST_STEP && found.length < 3000) {
    const ahead = curvePoint(defect, plus(z, length, tangent), tangent),
      turned = ahead && curveTangent(defect, ahead),
      cosine = turned ? turned[0] * tangent[0] + turned[1] * tangent[1] : 0;
    if (!(Math.abs(cosine) > STRAIGHT)) {
      length /= 2;
      continue;
    }
    if (ahead[0] < 0 && finish !== null) found.push(law.circle(finish, n, nu));
    if (ahead[0] < 0 || Math.abs(ahead[0]) > HOMOCLINIC || Math.abs(ahead[1]) > HOMOCLINIC) break;
    found.push(ahead);
    if (stop && stop(ahead)) break;
    [z, tangent] = [ahead, turned.map((part) => part * Math.sign(cosine))];
    length = Math.min(1.5 * length, LONGEST_STEP);
  }
  return found;
}

const ribbonCurves = new Map(); // they are the same for every nu

/**
 * The exact branch (m, n) of a law: {points: [{kappa_n, kappa_star, energy, elastic, amplitude}], folds: the same}, within limits
 * of kappa_n; Gamma for the law of finite width.
 */
function exactCurve(name, m, n, nu, [low, high], Gamma) {
  if (name === FINITE_WIDTH) return widthCurve(m, n, nu, Gamma, [low, high]);
  const branch = exactBranch(name, m, n, nu);
  if (!branch) return { points: [], folds: [] };
  const inside = ({ kappa_n, side }, { side: first }) => side === first && kappa_n >= low && kappa_n <= high;
  const begin = branch.values(branch.law.circle(m, n, nu)),
    key = `${m} ${n}`;
  if (name === "ribbon" && !ribbonCurves.has(key)) ribbonCurves.set(key, followed(branch));
  const places = name === "ribbon" ? ribbonCurves.get(key) : followed(branch, (z) => !inside(branch.values(z), begin));
  const values = places.map(branch.values),
    out = values.findIndex((value) => !inside(value, begin)),
    size = out < 0 ? values.length : out + Number(values[out].side === begin.side); // one beyond, so that the line meets the limit
  const folds = [];
  for (let i = 1; i + 1 < size; i++) {
    const rise = (values[i].kappa_n - values[i - 1].kappa_n) * (values[i + 1].kappa_n - values[i].kappa_n);
    if (rise < 0)
      folds.push(exactFold(branch, places[i - 1], places[i + 1], Math.sign(values[i].kappa_n - values[i - 1].kappa_n)));
  }
  return { points: values.slice(0, size), folds: folds.filter(Boolean) };
}

/** The extreme kappa_n between two places of a branch, on the curve over their chord. */
function exactFold({ defect, values }, from, to, sign) {
  const chord = plus(to, -1, from),
    size = Math.hypot(...chord),
    tangent = chord.map((part) => part / size);
  return extreme(
    (s) => {
      const place = curvePoint(defect, plus(from, s, tangent), tangent);
      return place && values(place);
    },
    size,
    sign,
  );
}

/** The value at(s), 0 <= s <= size, of largest sign * kappa_n, by golden section; null where at(s) is null on the way. */
function extreme(at, size, sign) {
  const golden = (Math.sqrt(5) - 1) / 2;
  let [low, high] = [0, size],
    best = null;
  for (let i = 0; i < 40; i++) {
    const [s, t] = [high - golden * (high - low), low + golden * (high - low)],
      [left, right] = [at(s), at(t)];
    if (!left || !right) return null;
    const leftwards = sign * left.kappa_n > sign * right.kappa_n;
    if (leftwards) high = t;
    else low = s;
    best = leftwards ? left : right;
  }
  return best;
}
