"use strict";
// The exact solution of the law of finite width by quadrature, as `ribbon_model.exact_finite_width` derives it. A branch is one
// curve in v = (kappa_n, omega, sqrt(A)), on which the length and the precession of a quarter wave are those of a closed strip.

const FINITE_WIDTH = "finite width",
  WIDTH_SERIES = 16, // below this x^4 the series of g is used: the closed form cancels
  WIDTH_FIRST = 0.02, // sqrt(A) of the first point
  WIDTH_DIFFERENCE = 1e-5,
  WIDTH_NODES = [32, 64, 128, 256, 512];

/** Coefficients of g about 0: 1 - G by division of power series in x^4. */
const MEMBRANE = (() => {
  const factorial = (k) => (k < 2 ? 1 : k * factorial(k - 1)),
    quotient = [];
  for (let k = 0; k <= 20; k++) {
    const rest = quotient.reduce((sum, q, j) => sum + (q * 2) / factorial(4 * (k - j) + 1), 0);
    quotient.push((4 / factorial(4 * k + 2) - rest) / 2);
  }
  return quotient.slice(1).map((value) => -value);
})();

/** g, g' and g'' at z = x^4. */
function membrane(z) {
  let [g, slope, half] = [0, 0, 0];
  if (z < WIDTH_SERIES) {
    for (let i = MEMBRANE.length - 1; i >= 0; i--) [half, slope, g] = [half * z + slope, slope * z + g, g * z + MEMBRANE[i]];
    return [g, slope, 2 * half];
  }
  const x = Math.sqrt(Math.sqrt(z)),
    e = Math.exp(-x),
    [sine, cosine] = [2 * Math.sin(x) * e, 2 * Math.cos(x) * e],
    below = 1 - e * e + sine,
    F = (1 + e * e - cosine) / below,
    E = (1 + e * e + cosine) / below,
    J = (1 - e * e - sine) / below,
    G = (2 * F) / x,
    first = 2 * (1 - F * E) - G,
    second = 2 * x * (-E + 2 * F * E * E - F * J) - first;
  g = (1 - G) / z;
  const a = -g - first / (4 * z),
    b = -a - (second / 16 - first / 4) / z;
  return [g, a / z, (b - a) / (z * z)];
}

/** U and its derivatives {U, U1, U3, U11, U13, U33, Uk}, k for kappa_n, without the term -kappa_n^2 / 2. */
function widthEnergy(w1, w3, kappa, nu, Gamma) {
  const plane = 1 - nu * nu,
    C = 3 * plane * Gamma * Gamma,
    z = C * w1 * w1,
    [g, slope, curvature] = membrane(z),
    P = C * g,
    P1 = 2 * C * C * w1 * slope,
    P11 = 2 * C * C * (slope + 2 * z * curvature),
    bent = w1 - kappa,
    Q = w3 * w3 + nu * w1 * bent,
    Q1 = nu * (w1 + bent),
    Q3 = 2 * w3,
    PQ = P * Q;
  return {
    U: (plane * bent * bent) / 2 + (1 - nu) * w3 * w3 + (PQ * Q) / 2,
    U1: plane * bent + (P1 * Q * Q) / 2 + PQ * Q1,
    U3: 2 * (1 - nu) * w3 + PQ * Q3,
    U11: plane + (P11 * Q * Q) / 2 + 2 * P1 * Q * Q1 + P * Q1 * Q1 + 2 * nu * PQ,
    U13: (P1 * Q + P * Q1) * Q3,
    U33: 2 * (1 - nu) + P * Q3 * Q3 + 2 * PQ,
    Uk: -plane * bent - PQ * nu * w1,
  };
}

const widthTables = new Map(); // by the number of nodes

/** Midpoints theta of a quarter wave, and the matrix that integrates values there (a series of sines) from theta to pi / 2. */
function widthTable(nodes) {
  if (widthTables.has(nodes)) return widthTables.get(nodes);
  const theta = Float64Array.from({ length: nodes }, (_, i) => ((i + 0.5) * Math.PI) / (2 * nodes)),
    matrix = Array.from({ length: nodes }, () => new Float64Array(nodes));
  for (let k = 1; k < nodes; k++) {
    const sines = theta.map((t) => (2 / nodes) * Math.sin(2 * k * t)),
      sign = k % 2 ? 1 : -1;
    for (let i = 0; i < nodes; i++) {
      const factor = (sign * Math.sin(k * (Math.PI / 2 - theta[i])) ** 2) / k;
      for (let j = 0; j < nodes; j++) matrix[i][j] += factor * sines[j];
    }
  }
  const table = { theta, matrix };
  widthTables.set(nodes, table);
  return table;
}

/** The strain on the ray (c, s) that lies on the level curve of omega.grad U - U, with U there; null where none is found. */
function onLevel(c, s, level, start, kappa, { nu, Gamma }) {
  let rho = start;
  for (let i = 0; i < 60; i++) {
    const [w1, w3] = [rho * c, rho * s],
      d = widthEnergy(w1, w3, kappa, nu, Gamma),
      slope = w1 * w1 * d.U11 + 2 * w1 * w3 * d.U13 + w3 * w3 * d.U33,
      change = (level - (w1 * d.U1 + w3 * d.U3 - d.U)) / slope;
    if (Math.abs(change) < 1e-13) return { w1, w3, slope, ...d };
    rho *= 1 + Math.min(1, Math.max(-0.5, change));
  }
  return null;
}

/** Length, precession of d1, kappa* and U, both integrated, of a quarter wave; null outside the convex domain. */
function widthQuadratures([kappa, omega, root], mode, nodes) {
  const { theta, matrix } = widthTable(nodes),
    d = widthEnergy(omega, 0, kappa, mode.nu, mode.Gamma),
    level = omega * d.U1 - d.U;
  const at = (t) => {
    const tangent = root * Math.sin(t),
      size = 1 + tangent * tangent,
      found = onLevel((1 - tangent * tangent) / size, (2 * tangent) / size, level, omega, kappa, mode);
    if (!found || !(found.U11 > 0 && found.U11 * found.U33 > found.U13 ** 2)) return null;
    const { w1, w3, U11, U13, U33, slope } = found,
      rate = (2 * Math.abs(root) * Math.cos(t) * (w1 * w1 + w3 * w3) * (U11 * U33 - U13 * U13)) / (slope * size);
    return { ...found, rate, fall: 2 * (w3 * found.U1 - w1 * found.U3) * rate };
  };
  const rows = Array.from(theta, at),
    last = at(Math.PI / 2);
  if (!last || rows.includes(null)) return null;
  const mu = Math.hypot(last.U1, last.U3),
    sums = [0, 0, 0, 0];
  rows.forEach(({ w3, U, U3, Uk, rate }, i) => {
    const M2 = Math.sqrt(Math.abs(rows.reduce((sum, { fall }, j) => sum + matrix[i][j] * fall, 0))),
      weight = (rate / M2) * (Math.PI / (2 * nodes));
    [1, (mu * w3 * U3) / (M2 * M2 + U3 * U3), kappa - Uk, U - (kappa * kappa) / 2].forEach(
      (value, k) => (sums[k] += value * weight),
    );
  });
  return sums;
}

/** A branch of finite width: {defects(v), values(v)}; `nodes` grows where the quadrature wants it. */
class WidthBranch {
  constructor(m, n, nu, Gamma) {
    Object.assign(this, { m, n, nu, Gamma, size: 0 });
  }

  quadratures(v) {
    return widthQuadratures(v, this, WIDTH_NODES[this.size]);
  }

  defects(v) {
    const found = this.quadratures(v);
    return found && [(found[0] * 2 * this.n) / Math.PI - 1, (found[1] * 2) / Math.PI - Math.abs(this.m - this.n) / this.n];
  }

  /** Whether twice as many nodes change nothing; else they are taken from now on. */
  resolved(v) {
    while (this.size + 1 < WIDTH_NODES.length) {
      const [coarse, fine] = [0, 1].map((more) => widthQuadratures(v, this, WIDTH_NODES[this.size + more]));
      if (!coarse || !fine || coarse.every((value, i) => Math.abs(value - fine[i]) < 1e-12 * (1 + Math.abs(value)))) return;
      this.size++;
    }
  }

  /** Rows of derivatives of the two defects; null outside the domain. */
  slopes(v) {
    const columns = [0, 1, 2].map((i) => {
      const [more, less] = [1, -1].map((sign) => this.defects(v.map((x, j) => x + (i === j ? sign * WIDTH_DIFFERENCE : 0))));
      return more && less && [0, 1].map((k) => (more[k] - less[k]) / (2 * WIDTH_DIFFERENCE));
    });
    return columns.includes(null) ? null : [0, 1].map((k) => columns.map((column) => column[k]));
  }

  /** The curve's point in the plane through v with this normal, by a chord method; null where there is none nearby. */
  correct(v, normal, slopes = this.slopes(v)) {
    if (!slopes) return null;
    const [a, b] = slopes,
      sides = [cross(b, normal), cross(normal, a), cross(a, b)],
      volume = dot(a, sides[0]),
      start = v;
    for (let i = 0; i < 20; i++) {
      const defects = this.defects(v);
      if (!defects) return null;
      const wrong = [...defects, dot(normal, along(v, -1, start))],
        change = sides.reduce((sum, side, k) => along(sum, -wrong[k] / volume, side), [0, 0, 0]);
      v = along(v, 1, change);
      const most = Math.max(...change.map(Math.abs));
      if (!(most < 0.5)) return null;
      if (most < 1e-12) return v;
    }
    return null;
  }

  values(v) {
    const [length, , star, energy] = this.quadratures(v);
    return { kappa_n: v[0], kappa_star: star / length, energy: energy / length, amplitude: v[2] ** 2 };
  }

  /** The circle where the branch begins or ends: there M = t (1 - (n / m)^2), quadratic in y = 1 - kappa_n / m. */
  circle(index) {
    const { n, nu, Gamma } = this;
    const at = (y) => widthEnergy(index, 0, index * (1 - y), nu, Gamma),
      [none, one, opposite] = [0, 1, -1].map((y) => at(y).U1 / index - at(y).U33 * (1 - (n / index) ** 2)),
      [A, B] = [(one + opposite) / 2 - none, (one - opposite) / 2],
      y = (-2 * none) / (B + Math.sqrt(B * B - 4 * A * none)),
      { U, U1, U11, U33, Uk } = at(y),
      kappa_n = index * (1 - y);
    if (!(B > 0 && U33 > 0 && U11 > 0 && Number.isFinite(U1))) return null;
    return { kappa_n, kappa_star: kappa_n - Uk, energy: U - (kappa_n * kappa_n) / 2, amplitude: 0 };
  }
}

const withElastic = (value) => ({ ...value, elastic: value.energy + value.kappa_n ** 2 / 2 });

/** The exact branch (m, n) of finite width; see `exactCurve`. */
function widthCurve(m, n, nu, Gamma, [low, high]) {
  const branch = new WidthBranch(m, n, nu, Gamma),
    begin = m !== n && m % (2 * n) ? branch.circle(m) : null,
    found = { points: [], folds: [] };
  let v = begin && branch.correct([begin.kappa_n, m, WIDTH_FIRST], [0, 0, 1]);
  if (!v) return found;
  branch.resolved(v);
  found.points.push(begin, branch.values(v));
  let slopes = branch.slopes(v),
    tangent = unit(cross(...slopes)),
    length = WIDTH_FIRST;
  if (tangent[2] < 0) tangent = tangent.map((part) => -part);
  while (length > 1e-3 && v[0] > low && v[0] < high && found.points.length < 1000) {
    const size = Math.hypot(tangent[0] / 5, tangent[1], tangent[2]),
      ahead = branch.correct(along(v, length / size, tangent), tangent);
    if (ahead && ahead[2] < WIDTH_FIRST / 2) {
      const end = branch.circle(Math.round(v[1]));
      if (end) found.points.push(end); // the circle at the other end
      break;
    }
    if (ahead) branch.resolved(ahead);
    const next = ahead && branch.slopes(ahead),
      turned = next && unit(cross(...next)),
      cosine = turned ? dot(turned, tangent) : 0;
    if (!(Math.abs(cosine) > 0.98)) {
      length /= 2;
      continue;
    }
    const forward = turned.map((part) => part * Math.sign(cosine));
    if (tangent[0] * forward[0] < 0) found.folds.push(widthFold(branch, v, ahead, slopes, Math.sign(tangent[0])));
    found.points.push(branch.values(ahead));
    [v, slopes, tangent, length] = [ahead, next, forward, Math.min(1.5 * length, 0.2)];
  }
  return { points: found.points.map(withElastic), folds: found.folds.filter(Boolean).map(withElastic) };
}

/** The extreme kappa_n between two points of the curve. */
function widthFold(branch, from, to, slopes, sign) {
  const chord = along(to, -1, from),
    normal = unit(chord);
  return extreme(
    (s) => {
      const place = branch.correct(along(from, s, chord), normal, slopes);
      return place && branch.values(place);
    },
    1,
    sign,
  );
}
