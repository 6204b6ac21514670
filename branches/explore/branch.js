"use strict";
// A branch: its columns, and its states, anywhere along it.

const FINE = 8; // pieces of a drawn curve between neighbouring points
const CIRCLE_PIECES = 8; // pieces of a circle between neighbouring points of the data: its columns are parabolas
const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
const KINDS = { d: Float64Array, b: Int8Array, h: Int16Array, i: Int32Array };

/** A branch or a circle: columns, and a shape anywhere along it. `s` is the number of a point, with fractions between points.
 * Columns and shapes are unpacked when they are looked at. */
class Branch {
  constructor(about, family) {
    const { columns, shapes, ...rest } = about;
    Object.assign(this, rest);
    this.packed = { columns, shapes };
    this.ruled = family.ruled !== false; // else sections stay straight and at right angles to the strip
    this.parameter = family.parameter;
    this.circle = !("file" in about);
    this.leftOut = shapes === null; // to keep the page small
    this.id = this.circle ? `circle_${this.m}` : this.file.replace(/\.\w+$/, "");
    if (this.profile) Object.assign(this, { channels: shapes.channels, nodes: shapes.nodes });
  }

  get columns() {
    return this.kept("columns", () => {
      const { columns } = this.packed,
        found = {},
        size = Math.max(...Object.values(columns).map((one) => (typeof one === "string" ? unpacked(one).length : 1)));
      for (const [name, one] of Object.entries(columns))
        found[name] = typeof one === "string" ? unpacked(one) : new Float64Array(size).fill(one);
      return this.profile ? found : withElasticEnergy(this.circle ? finer(found, this.parameter) : found);
    });
  }

  /** What `make` returns, made once. */
  kept(name, make) {
    const value = make();
    Object.defineProperty(this, name, { value });
    return value;
  }

  get size() {
    return this.columns[this.parameter].length;
  }

  get abscissa() {
    return this.columns.arclength || this.columns[this.parameter];
  }

  /** Whether its index is known, without unpacking. */
  get hasIndex() {
    return "index" in this.packed.columns;
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
    } else this.endSlope(i, after > 0 ? 1 : -1, factor, secant);
  }

  /** The slope of the parabola through three points at the first or last one; of a line where two of them coincide. */
  endSlope(i, inward, factor, secant) {
    const a = this.abscissa,
      [first, second] = inward > 0 ? [i, i + 1] : [i - 1, i - 2], // the numbers of the intervals, from the end
      length = (k) => (k >= 0 && k + 1 < this.size ? a[k + 1] - a[k] : 0),
      part = length(second) > 0 ? length(first) / (length(first) + length(second)) : 0;
    secant(first, factor * (1 + part));
    if (part > 0) secant(second, -factor * part);
  }

  value(name, s) {
    return this.weights(s).reduce((sum, [row, weight]) => sum + weight * this.columns[name][row], 0);
  }

  /** The estimated error of an interpolated value: that of parabolas, by the largest third difference of points around s; it
   * exceeds the true one several times. 0 at computed points and on circles (whose columns are parabolas), NaN with too few points. */
  uncertainty(name, s) {
    if (this.circle || Math.abs(s - Math.round(s)) < 1e-9) return 0;
    const a = this.abscissa,
      y = this.columns[name],
      i = Math.floor(s),
      at = a[i] + (s - i) * (a[i + 1] - a[i]);
    let largest = NaN;
    for (let first = Math.max(i - 2, 0); first <= Math.min(i, this.size - 4); first++) {
      const secants = [0, 1, 2].map((k) => (y[first + k + 1] - y[first + k]) / (a[first + k + 1] - a[first + k])),
        bends = [0, 1].map((k) => (secants[k + 1] - secants[k]) / (a[first + k + 2] - a[first + k])),
        change = Math.abs(bends[1] - bends[0]);
      if (!(change <= largest)) largest = change;
    }
    return largest * Math.abs((at - a[i]) * (at - a[i + 1]));
  }

  /** The index at s: that of the piece between two labelled points; null where it is not known. */
  index(s) {
    const index = this.columns.index;
    if (!index) return null;
    const near = Math.round(s);
    if (Math.abs(s - near) < 1e-6) return index[near] === -1 ? null : index[near];
    const ends = [index[Math.floor(s)], index[Math.ceil(s)]].filter((value) => value !== -1);
    if (ends.length) return ends[0];
    const { index_after = null } = (this.marks || []).find(({ point }) => point === Math.floor(s)) || {}; // between two special points
    return index_after;
  }

  /** The branch as a line in the plane of two columns, smooth between the points. */
  line(x, y) {
    const steps = Array.from({ length: (this.size - 1) * FINE + 1 }, (_, i) => i / FINE);
    return { x: steps.map((s) => this.value(x, s)), y: steps.map((s) => this.value(y, s)) };
  }

  /** The shapes as the page holds them: see `packing.compressed`. */
  get shapes() {
    return this.kept("shapes", () => {
      const { basis, functions, products, wide, left, right, scale, size, ...rest } = this.packed.shapes;
      return {
        ...rest,
        basis: rows(basis, functions, functions),
        left: rows(left, products, wide),
        right: rows(right, products, wide),
        scale: unpacked(`d${scale}`),
        size: unpacked(`d${size}`),
      };
    });
  }

  /** States at the nodes, (nodes, channels). */
  states(s) {
    const { nodes, channels, basis, left, right, scale, size } = this.shapes,
      weights = this.weights(s),
      each = size.length > channels ? channels : 0, // a size for each point, or one for all
      parts = new Float64Array(basis.length * channels),
      result = new Float64Array(nodes * channels);
    right.forEach((row, k) => {
      for (let c = 0; c < channels; c++) {
        let factor = 0;
        for (const [point, weight] of weights) factor += (weight * scale[k] * left[k][point] * size[point * each + c]) / 32767;
        for (let i = c; i < parts.length; i += channels) parts[i] += factor * row[i];
      }
    });
    basis.forEach((values, j) => {
      for (let i = 0, at = 0; i < nodes; i++)
        for (let c = 0; c < channels; c++, at++) result[at] += values[i] * parts[j * channels + c];
    });
    return result;
  }

  /** The closed strip at s, its axis upright and its middle at the origin: stations one after the other, the last before the first.
   * Open strips go there and back; several of them have `sizes`, the numbers of their stations, and `fixtures`. */
  strip(s) {
    if (this.circle) return placed(planar(this.m), [1, 0, 0]);
    const states = this.states(s),
      parts = this.shapes.channels / CHANNELS;
    if (this.domain === "open") {
      const each = Array.from({ length: parts }, (_, i) => stations(states, this.shapes.nodes, i, parts));
      return open(each, this.fixtures.map((one) => ({ ...one, sign: this.sign(one, s) })));
    }
    const part = stations(states, this.shapes.nodes);
    if (this.domain === "loop") return flattened(part.slice(0, -1));
    if (!this.ruled) part.forEach((station) => (station.eta = 0));
    if (this.domain === "half loop") return placed(mirrored(part).slice(0, -1));
    if (this.domain !== "cell") return placed(turned(part).slice(0, -1));
    const axis = unit([this.value("M1", s) * this.columns.sense[0], this.value("M2", s) * this.columns.sense[0], 0]);
    return placed(repeated(mirrored(turned(part)), this.n, axis, 4 * this.columns.turn[0]), axis);
  }

  /** The sign of a force at the nearest point; 1 of joints and supports. */
  sign({ signs = 1 }, s) {
    return typeof signs === "string" ? unpacked(signs)[Math.round(s)] : signs;
  }

  /** How far each point is along the branch, 0 ... 1, by how much the shape changes on the way. */
  get way() {
    if (this.ways) return this.ways;
    this.ways = [0];
    for (let i = 1; i < this.size; i++) {
      let change = 1e-3 + 1e-3 * Math.abs(this.columns[this.parameter][i] - this.columns[this.parameter][i - 1]);
      if (this.profile) change = Math.max(this.abscissa[i] - this.abscissa[i - 1], 1e-12);
      else if (!this.circle && !this.leftOut) {
        const a = this.states(i - 1),
          b = this.states(i);
        let sum = 0;
        for (let k = 0; k < a.length; k++) if (k % CHANNELS < 4) sum += (a[k] - b[k]) ** 2;
        change += Math.sqrt(sum / this.shapes.nodes);
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

  /** All s at which the parameter (kappa_n of a strip) has this value. */
  places(kappa) {
    const k = this.columns[this.parameter],
      found = [];
    for (let i = 0; i + 1 < this.size; i++) {
      if (k[i] - kappa > 0 === k[i + 1] - kappa > 0) continue;
      let low = i,
        high = i + 1;
      for (let n = 0; n < 45; n++) {
        const middle = (low + high) / 2;
        if (this.value(this.parameter, middle) - kappa > 0 === k[i] - kappa > 0) low = middle;
        else high = middle;
      }
      found.push((low + high) / 2);
    }
    return found;
  }
}

/** Numbers from text that begins with the letter of their type. */
const unpacked = (text) => new KINDS[text[0]](bytes(text.slice(1)));

/** Rows of whole numbers, the first `wide` of 16 bits and the others of 8. */
function rows(text, rank, wide) {
  const buffer = bytes(text),
    length = buffer.byteLength / (rank + wide);
  return Array.from({ length: rank }, (_, k) =>
    k < wide ? new Int16Array(buffer, 2 * k * length, length) : new Int8Array(buffer, (wide + k) * length, length),
  );
}

const withElasticEnergy = (columns) => ({ ...columns, elastic: columns.kappa_n.map((k, i) => columns.energy[i] + (k * k) / 2) });

/** The columns of a circle at more points: parabolas through neighbouring ones, and the index of the piece. */
function finer(columns, parameter) {
  const coarse = Object.create(Branch.prototype, { columns: { value: columns } });
  coarse.parameter = parameter;
  const places = Array.from({ length: (coarse.size - 1) * CIRCLE_PIECES + 1 }, (_, i) => i / CIRCLE_PIECES),
    found = {};
  for (const name of Object.keys(columns))
    found[name] = Float64Array.from(places, (s) => (name === "index" ? (coarse.index(s) ?? -1) : coarse.value(name, s)));
  return found;
}
