"use strict";
// Shapes from the numbers that the page carries: a quarter wave (or half a loop) is interpolated along its branch and unfolded
// to the closed strip by its mirrors and two-fold axes. No mechanics here: the states are solutions already.

const CHANNELS = 8; // of a node: quaternion q0..q3, eta, centreline x1..x3
const STATION = 13; // of a closed strip: x, d1, d2, d3 (three numbers each), eta

const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const along = (a, s, b) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const unit = (a) => along([0, 0, 0], 1 / (Math.hypot(...a) || 1), a);
const apply = (m, a) => [dot(m[0], a), dot(m[1], a), dot(m[2], a)];

/** A branch or a circle: columns, and a shape anywhere along it. `s` is the number of a point, with fractions between points. */
class Branch {
  constructor(about, law) {
    Object.assign(this, about);
    this.ruled = !law.endsWith("rod"); // the section of a rod stays straight and at right angles to it
    this.columns = {};
    for (const [name, text] of Object.entries(about.columns)) this.columns[name] = new Float64Array(bytes(text));
    this.circle = !("shapes" in about);
    this.size = this.columns.kappa_n.length;
    this.abscissa = this.columns.arclength || this.columns.kappa_n;
    if (this.circle) return;
    this.packed = new Int16Array(bytes(about.shapes));
    this.scale = new Float64Array(bytes(about.scale));
  }

  /** Pairs of row and weight: cubic Hermite interpolation with slopes of parabolas, on the points themselves exact. */
  weights(s) {
    const i = Math.min(Math.max(Math.floor(s), 0), this.size - 2),
      u = s - i,
      rows = new Map();
    const add = (row, weight) => rows.set(row, (rows.get(row) || 0) + weight);
    if (u < 1e-12) return [[i, 1]];
    if (u > 1 - 1e-12) return [[i + 1, 1]];
    const h = this.abscissa[i + 1] - this.abscissa[i];
    add(i, (1 + 2 * u) * (1 - u) ** 2);
    add(i + 1, u * u * (3 - 2 * u));
    if (h > 0) {
      this.slope(i, h * u * (1 - u) ** 2, add);
      this.slope(i + 1, -h * u * u * (1 - u), add);
    }
    return [...rows];
  }

  slope(i, factor, add) {
    const a = this.abscissa,
      last = this.size - 1;
    const secant = (j, f) => (add(j + 1, f / (a[j + 1] - a[j])), add(j, -f / (a[j + 1] - a[j])));
    const before = i > 0 ? a[i] - a[i - 1] : 0,
      after = i < last ? a[i + 1] - a[i] : 0;
    if (before > 0 && after > 0) {
      secant(i - 1, (factor * after) / (before + after));
      secant(i, (factor * before) / (before + after));
    } else secant(after > 0 ? i : i - 1, factor);
  }

  value(name, s) {
    return this.weights(s).reduce((sum, [row, weight]) => sum + weight * this.columns[name][row], 0);
  }

  /** The index at s: that of the piece between two labelled points; null where it is not known. */
  index(s) {
    const index = this.columns.index;
    if (!index) return null;
    const near = Math.round(s);
    if (Math.abs(s - near) < 1e-6) return index[near] === -1 ? null : index[near];
    const ends = [index[Math.floor(s)], index[Math.ceil(s)]].filter((value) => value !== -1);
    return ends.length ? ends[0] : null;
  }

  /** States at the nodes, (nodes, CHANNELS). */
  states(s) {
    const result = new Float64Array(this.nodes * CHANNELS);
    for (const [row, weight] of this.weights(s))
      for (let k = 0, at = row * this.nodes * CHANNELS; k < result.length; k++, at++)
        result[k] += weight * this.packed[at] * this.scale[row * CHANNELS + (k % CHANNELS)];
    return result;
  }

  /** The closed strip at s, its axis upright and its middle at the origin: stations one after the other, the last before the first. */
  strip(s) {
    if (this.circle) return placed(planar(this.m), [1, 0, 0]);
    const part = stations(this.states(s), this.nodes);
    if (!this.ruled) part.forEach((station) => (station.eta = 0));
    if (this.domain === "half loop") return placed(mirrored(part).slice(0, -1));
    if (this.domain !== "cell") return placed(turned(part).slice(0, -1));
    const axis = unit([this.value("M1", s) * this.columns.sense[0], this.value("M2", s) * this.columns.sense[0], 0]);
    return placed(repeated(mirrored(turned(part)), this.n, axis, 4 * this.columns.turn[0]), axis);
  }

  /** How far each point is along the branch, 0 ... 1, by how much the shape changes on the way. */
  get way() {
    if (this.ways) return this.ways;
    this.ways = [0];
    for (let i = 1; i < this.size; i++) {
      let change = 1e-3 + 1e-3 * Math.abs(this.columns.kappa_n[i] - this.columns.kappa_n[i - 1]);
      if (!this.circle) {
        const a = this.states(i - 1),
          b = this.states(i);
        let sum = 0;
        for (let k = 0; k < a.length; k++) if (k % CHANNELS < 4) sum += (a[k] - b[k]) ** 2;
        change += Math.sqrt(sum / this.nodes);
      }
      this.ways.push(this.ways[i - 1] + change);
    }
    const whole = this.ways[this.size - 1];
    return (this.ways = this.ways.map((w) => w / whole));
  }

  fromWay(w) {
    let i = 0;
    while (i < this.size - 2 && this.way[i + 1] <= w) i++;
    return Math.min(i + (w - this.way[i]) / (this.way[i + 1] - this.way[i]), this.size - 1);
  }

  toWay(s) {
    const i = Math.min(Math.floor(s), this.size - 2);
    return this.way[i] + (s - i) * (this.way[i + 1] - this.way[i]);
  }

  /** All s at which kappa_n has this value. */
  places(kappa) {
    const k = this.columns.kappa_n,
      found = [];
    for (let i = 0; i + 1 < this.size; i++) {
      if (k[i] - kappa > 0 === k[i + 1] - kappa > 0) continue;
      let low = i,
        high = i + 1;
      for (let n = 0; n < 45; n++) {
        const middle = (low + high) / 2;
        if (this.value("kappa_n", middle) - kappa > 0 === k[i] - kappa > 0) low = middle;
        else high = middle;
      }
      found.push((low + high) / 2);
    }
    return found;
  }
}

// --- from states to a closed strip ---------------------------------------------------------------------------------

/** Stations {x, d: [d1, d2, d3], eta} of a part, from states at its nodes. */
function stations(states, nodes) {
  return Array.from({ length: nodes }, (_, k) => {
    const [q0, q1, q2, q3, eta, x, y, z] = states.subarray(k * CHANNELS, (k + 1) * CHANNELS),
      n = Math.hypot(q0, q1, q2, q3);
    return { x: [x, y, z], d: directors(q0 / n, q1 / n, q2 / n, q3 / n), eta };
  });
}

const directors = (q0, q1, q2, q3) => [
  [q0 * q0 + q1 * q1 - q2 * q2 - q3 * q3, 2 * (q1 * q2 + q0 * q3), 2 * (q1 * q3 - q0 * q2)],
  [2 * (q1 * q2 - q0 * q3), q0 * q0 - q1 * q1 + q2 * q2 - q3 * q3, 2 * (q2 * q3 + q0 * q1)],
  [2 * (q1 * q3 + q0 * q2), 2 * (q2 * q3 - q0 * q1), q0 * q0 - q1 * q1 - q2 * q2 + q3 * q3],
];

/** The image of a station under an isometry about a centre; signs of d1, d2, d3 and eta. */
function image({ x, d, eta }, matrix, centre, signs) {
  const moved = along(apply(matrix, along(x, -1, centre)), 1, centre);
  return { x: moved, d: d.map((a, i) => along([0, 0, 0], signs[i], apply(matrix, a))), eta: signs[3] * eta };
}

const outer = (a, f, g) => a.map((ai, i) => a.map((aj, j) => f * ai * aj + (i === j ? g : 0)));

/** A part and its image under the two-fold axis along d2 at its end. */
function turned(part) {
  const end = part[part.length - 1],
    half = outer(end.d[1], 2, -1);
  return part.concat(
    part
      .slice(0, -1)
      .reverse()
      .map((one) => image(one, half, end.x, [-1, 1, -1, 1])),
  );
}

/** Both sides of the mirror at S = 0, normal to d3 there, starting at the far end. */
function mirrored(part) {
  const mirror = outer(part[0].d[2], -2, 1);
  return part
    .slice(1)
    .reverse()
    .map((one) => image(one, mirror, [0, 0, 0], [1, 1, -1, -1]))
    .concat(part);
}

/** The loop: `copies` of a wave, each turned by `angle` about the axis through where mirror plane and two-fold axis meet. */
function repeated(wave, copies, axis, angle) {
  const middle = wave[(wave.length - 1) / 2],
    end = wave[(3 * (wave.length - 1)) / 4],
    normal = middle.d[2],
    d2 = end.d[1];
  const centre = Math.abs(Math.sin(angle / 2)) > 1e-9 ? along(end.x, -dot(end.x, normal) / dot(d2, normal), d2) : [0, 0, 0];
  const loop = [];
  for (let copy = 0; copy < copies; copy++) {
    const c = Math.cos(copy * angle),
      s = Math.sin(copy * angle),
      [a, b, g] = axis;
    const spin = [
      [0, -s * g, s * b],
      [s * g, 0, -s * a],
      [-s * b, s * a, 0],
    ];
    const rotation = outer(axis, 1 - c, c).map((row, i) => row.map((value, j) => value + spin[i][j]));
    loop.push(...wave.slice(0, -1).map((one) => image(one, rotation, centre, [1, 1, 1, 1])));
  }
  return loop;
}

/** The planar circle, covered m times. */
function planar(m) {
  return Array.from({ length: 384 }, (_, k) => {
    const phi = (m * 2 * Math.PI * k) / 384,
      c = Math.cos(phi),
      s = Math.sin(phi);
    return {
      x: [0, (c - 1) / m, s / m],
      d: [
        [1, 0, 0],
        [0, c, s],
        [0, -s, c],
      ],
      eta: 0,
    };
  });
}

/** Stations as one flat array, the middle at the origin, `axis` (else the normal of the enclosed area) along z, d3(0) along y. */
function placed(loop, axis) {
  const middle = loop.reduce((sum, { x }) => along(sum, 1 / loop.length, x), [0, 0, 0]);
  const area = loop.reduce((sum, { x, d }) => along(sum, 1, cross(along(x, -1, middle), d[2])), [0, 0, 0]);
  const up = axis || unit(area),
    side = unit(along([0, 0, 1], -up[2], up)),
    frame = [cross(side, up), side, up];
  const flat = new Float64Array(loop.length * STATION);
  loop.forEach(({ x, d, eta }, k) => {
    flat.set([...apply(frame, along(x, -1, middle)), ...d.flatMap((a) => apply(frame, a)), eta], k * STATION);
  });
  return flat;
}

// --- surfaces ------------------------------------------------------------------------------------------------------

const count = (strip) => strip.length / STATION;

/** The largest distance of the centreline from the origin. */
function reach(strip) {
  let most = 0;
  for (let k = 0; k < strip.length; k += STATION) most = Math.max(most, Math.hypot(strip[k], strip[k + 1], strip[k + 2]));
  return most;
}

/** The widest strip whose rulings (6a) do not cross: 2 / max |eta'|. */
function widest(strip) {
  const n = count(strip),
    eta = (k) => strip[(k % n) * STATION + 12];
  let most = 0;
  for (let k = 0; k < n; k++) most = Math.max(most, Math.abs(eta(k + 1) - eta(k)));
  return (2 * 2 * Math.PI) / (n * most);
}

/**
 * Edge points x +- (width / 2) (d1 + eta d3), equation (6a), and d2 at each: (stations, [left, right, normal]). Where rulings
 * of that width would cross, all are drawn less oblique, so that the picture stays a band.
 */
function edges(strip, width, scale, every = 1) {
  const result = [],
    oblique = Math.min(1, (0.9 * widest(strip)) / width);
  for (let k = 0; k < strip.length; k += STATION * every) {
    const at = (i) => [strip[k + i], strip[k + i + 1], strip[k + i + 2]];
    const x = at(0),
      ruling = along(at(3), oblique * strip[k + 12], at(9));
    const edge = (side) => along([0, 0, 0], scale, along(x, (side * width) / 2, ruling));
    result.push([edge(-1), edge(1), at(6)]);
  }
  return result;
}

/** The strip as a mesh of two sheets a hair apart: coordinates of 4 vertices a station. */
function sheets(strip, width, scale, gap = 0.004) {
  const n = count(strip),
    x = new Float32Array(4 * n),
    y = new Float32Array(4 * n),
    z = new Float32Array(4 * n);
  edges(strip, width, scale).forEach(([left, right, normal], k) => {
    [
      [left, 1],
      [right, 1],
      [left, -1],
      [right, -1],
    ].forEach(([point, side], v) => {
      [x[4 * k + v], y[4 * k + v], z[4 * k + v]] = along(point, side * gap, normal);
    });
  });
  return { x, y, z };
}

/** Corners of the triangles of `sheets`. */
function triangles(n) {
  const i = [],
    j = [],
    k = [];
  for (let a = 0; a < n; a++) {
    const p = 4 * a,
      q = 4 * ((a + 1) % n);
    i.push(p, p + 1, p + 2, p + 3);
    j.push(p + 1, q + 1, q + 2, q + 2);
    k.push(q, q, p + 3, q + 3);
  }
  return { i, j, k };
}

/**
 * The strip as flat polygons seen from `eye`, the farthest first, each with the brightness 0 ... 1 of its side `front`.
 * For small pictures, for vector graphics, and where there is no WebGL.
 */
function polygons(strip, width, scale, eye, every = 1) {
  const view = unit(eye),
    right = unit(cross([0, 0, 1], view)),
    top = cross(view, right),
    light = unit([0.3, -0.4, 0.85]);
  const rows = edges(strip, width, scale, every),
    result = [];
  rows.forEach(([a, b, normal], k) => {
    const [c, d] = rows[(k + 1) % rows.length],
      corners = [a, b, d, c];
    result.push({
      points: corners.map((p) => [dot(p, right), -dot(p, top)]),
      depth: corners.reduce((sum, p) => sum + dot(p, view), 0),
      front: dot(normal, view) > 0,
      shade: 0.5 + 0.5 * Math.abs(dot(normal, light)),
    });
  });
  return result.sort((p, q) => p.depth - q.depth);
}
