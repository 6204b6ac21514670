"use strict";
// A branch: its columns, and its states, anywhere along it.

const FINE = 8; // pieces of a drawn curve between neighbouring points
const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;

/** A branch or a circle: columns, and a shape anywhere along it. `s` is the number of a point, with fractions between points. */
class Branch {
  constructor(about, family) {
    Object.assign(this, about);
    this.ruled = !(family.law || "").endsWith("rod"); // the section of a rod stays straight and at right angles to it
    this.parameter = family.parameter;
    this.columns = {};
    for (const [name, text] of Object.entries(about.columns)) this.columns[name] = new Float64Array(bytes(text));
    this.circle = !("shapes" in about);
    const { kappa_n, energy } = this.columns;
    if (!this.profile) this.columns.elastic = kappa_n.map((k, i) => energy[i] + (k * k) / 2);
    this.size = this.columns[this.parameter].length;
    this.abscissa = this.columns.arclength || this.columns[this.parameter];
    this.id = this.circle ? `circle_${this.m}` : this.file.replace(/\.\w+$/, "");
    this.channels = about.channels || CHANNELS;
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

  /** The branch as a line in the plane of two columns, smooth between the points. */
  line(x, y) {
    const steps = Array.from({ length: (this.size - 1) * FINE + 1 }, (_, i) => i / FINE);
    return { x: steps.map((s) => this.value(x, s)), y: steps.map((s) => this.value(y, s)) };
  }

  /** States at the nodes, (nodes, channels). */
  states(s) {
    const { channels, nodes } = this,
      result = new Float64Array(nodes * channels);
    for (const [row, weight] of this.weights(s))
      for (let k = 0, at = row * nodes * channels; k < result.length; k++, at++)
        result[k] += weight * this.packed[at] * this.scale[row * channels + (k % channels)];
    return result;
  }

  /** The closed strip at s, its axis upright and its middle at the origin: stations one after the other, the last before the first. */
  strip(s) {
    if (this.circle) return placed(planar(this.m), [1, 0, 0]);
    const part = stations(this.states(s), this.nodes);
    if (this.domain === "open") return open(part);
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
      let change = 1e-3 + 1e-3 * Math.abs(this.columns[this.parameter][i] - this.columns[this.parameter][i - 1]);
      if (this.profile) change = Math.max(this.abscissa[i] - this.abscissa[i - 1], 1e-12);
      else if (!this.circle) {
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
