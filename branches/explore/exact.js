"use strict";
// The exact solution of primary branches by quadrature, as `ribbon_model.exact` and `ribbon_model.exact_rods` derive it: a branch
// is one curve in the plane of two unknowns, on which the strip closes. Trapezoidal rule in v = log(tan(theta)), whose error is
// that of the arithmetic.

const NODE_SPACING = 1 / 6,
  NODE_TAIL = 38, // integrands have decayed to 1e-16 there
  NODE_MOST = 6 * 360; // nodes on either side
const NODES = Array.from({ length: 2 * NODE_MOST + 1 }, (_, k) => (k - NODE_MOST) * NODE_SPACING);
const SIN2 = Float64Array.from(NODES, (v) => 1 / (1 + Math.exp(-2 * v))); // sin(theta)^2
const COS2 = Float64Array.from(NODES, (v) => 1 / (1 + Math.exp(2 * v)));
const WEIGHT = Float64Array.from(NODES, (v) => NODE_SPACING / (Math.PI * Math.cosh(v)));
const HOMOCLINIC = 150; // size of the unknowns at which a branch is left: the period has grown to some hundred times its first

/** First and last node for integrands that have decayed a tail's length outside [lower, upper]. */
const nodeRange = (lower, upper) => [
  Math.max(0, NODE_MOST + Math.floor((lower - NODE_TAIL) / NODE_SPACING)),
  Math.min(2 * NODE_MOST, NODE_MOST + Math.floor((upper + NODE_TAIL) / NODE_SPACING) - 1),
];

/** The ribbon's branch (m, n): unknowns log(1 + A) and log(q) / 2. Its curve does not depend on nu. */
const exactRibbon = {
  covering: (m, n) => (2 * n > m ? 2 * n - m : null),
  circle: (index, n) => [0, Math.log((2 * n) / index)],
  means([x, y]) {
    const A = Math.expm1(x),
      q = Math.exp(2 * y),
      beta = (A + 4 - q) / 2,
      mu = Math.sqrt(beta * beta + A * q),
      close = Math.abs(beta - A) < 0.2 * Math.sqrt(Math.max(A, 0)); // d3 passes close to the axis: take the azimuth of d2
    const [first, last] = nodeRange(A > Math.max(q, 0) ? 0.5 * Math.log(q / A) : 0, 0);
    let azimuth = 0,
      mean = 0,
      squared = 0;
    for (let k = first; k <= last; k++) {
      const eta = A * SIN2[k],
        weight = WEIGHT[k] / Math.sqrt(eta + q);
      mean += weight;
      squared += weight * eta;
      azimuth +=
        (weight * (close ? beta + eta : beta - eta)) / ((beta - (close ? eta : A)) ** 2 + 4 * (close ? eta : A * COS2[k]));
    }
    return { A, beta, mean, squared, azimuth: mu * azimuth };
  },
  defect(z, { m, n }) {
    const turn = ((m > n ? 1 : -1) * this.means(z).azimuth * 2 * n - m) / (2 * n);
    return turn - Math.round(turn);
  },
  values(z, { n, nu }) {
    const { A, beta, mean, squared } = this.means(z),
      c = 2 * n * (mean + squared),
      kappa_n = (c * (1 - beta)) / (1 - nu * beta),
      kappa_star = 2 * n * (mean + nu * squared);
    return { kappa_n, kappa_star, energy: (c * c) / 2 - kappa_n * kappa_star, amplitude: A, side: Math.sign(1 - nu * beta) };
  },
};

/** What the rods share. A rod has alpha, beta(nu), constants(x, y, nu) = {A, p, q, moment, k, U} and omega(s, constants, nu). */
const exactRod = {
  means(z, nu) {
    const constants = this.constants(...z, nu),
      { p, q } = constants;
    if (!(Math.min(p, q) > 0)) return { inverse: NaN, ratio: NaN, strain: NaN, constants };
    const middle = 0.5 * Math.log(p / q),
      [first, last] = nodeRange(Math.min(middle, 0), Math.max(middle, 0));
    let inverse = 0,
      ratio = 0,
      strain = 0;
    for (let k = first; k <= last; k++) {
      const s = SIN2[k],
        rate = p * COS2[k] + q * s,
        weight = WEIGHT[k] / Math.sqrt(rate);
      inverse += weight;
      ratio += (weight * s) / (s + COS2[k] * rate);
      strain += weight * this.omega(s, constants, nu);
    }
    return { inverse, ratio, strain, constants };
  },
  defect(z, { m, n, nu }) {
    const { inverse, ratio, constants } = this.means(z, nu);
    const turn = n * constants.moment * (this.alpha * inverse + (this.beta(nu) - this.alpha) * ratio);
    return (turn - Math.abs(m - n)) / (2 * n);
  },
  values(z, { n, nu }) {
    const { inverse, strain, constants } = this.means(z, nu),
      { A, p, k } = constants,
      C = n * inverse,
      kappa_star = n * strain,
      H = (C * C * (this.omega(0, constants, nu) ** 2 + this.alpha * A * p)) / 2;
    return { kappa_n: C * k, kappa_star, energy: H - C * k * kappa_star, amplitude: A, side: 1 };
  },
};

const exactFlatRod = {
  ...exactRod,
  alpha: 0,
  beta: (nu) => (1 + nu) / 2,
  covering: (m, n) => (2 * n > m ? 2 * n - m : null),
  circle: (index, n) => [0, Math.log(n / index)],
  constants(x, y, nu) {
    const A = Math.expm1(x),
      q = Math.exp(2 * y),
      beta = (1 + nu) / 2,
      p = (q + ((1 - beta) * A) / (1 + A)) / (1 + A);
    const remainder = (1 - q - (2 * (1 - beta) * A) / (1 + A)) / beta; // 1 - k
    const k = (q - ((1 - beta) * (1 - A)) / (1 + A)) / beta;
    return { A, p, q, k, moment: Math.sqrt(remainder ** 2 + (4 * A * p) / beta) };
  },
  omega: (s, { A }) => (1 - A * s) / (1 + A * s),
};

const exactIsotropicRod = {
  ...exactRod,
  alpha: 1,
  beta: (nu) => 1 + nu,
  covering: (m, n) => 2 * n - m,
  circle(index, n, nu) {
    const half = (nu * index) / 2,
      kappa_n = (half + Math.hypot(half, Math.sqrt(1 + nu) * n)) / (1 + nu),
      U = (index - kappa_n) / kappa_n;
    return [0, nu ? -Math.log1p(-nu * U) / nu : U];
  },
  constants(x, y, nu) {
    const A = Math.expm1(x),
      p = Math.exp(-nu * y),
      U = (nu ? -Math.expm1(-nu * y) / nu : y) + (nu * A) / 4;
    return { A, p, q: p + (nu * nu * A) / 4, k: 1, U, moment: Math.sqrt(U * U + A * p) };
  },
  omega: (s, { A, U }, nu) => 1 + U - (nu * A * s) / 2,
};

const EXACT_LAWS = { ribbon: exactRibbon, "flat rod": exactFlatRod, "isotropic rod": exactIsotropicRod };

/** A branch to be followed; null where there is none. */
function exactBranch(name, m, n, nu) {
  if (m === n || m % (2 * n) === 0) return null; // a rigid motion, or the loop does not close without a force
  const law = EXACT_LAWS[name],
    mode = { m, n, nu };
  const values = (z) => {
    const found = law.values(z, mode);
    return { ...found, elastic: found.energy + found.kappa_n ** 2 / 2 };
  };
  return { law, mode, defect: (z) => law.defect(z, mode), values };
}
