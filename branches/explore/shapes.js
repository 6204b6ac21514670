"use strict";
// Strips from the states that the page carries: a quarter wave (or half a loop) is unfolded to the closed strip by its mirrors
// and two-fold axes. No mechanics here: the states are solutions already.

const CHANNELS = 8; // of a node: quaternion q0..q3, eta, centreline x1..x3
const STATION = 13; // of a closed strip: x, d1, d2, d3 (three numbers each), eta

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const along = (a, s, b) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const unit = (a) => along([0, 0, 0], 1 / (Math.hypot(...a) || 1), a);
const apply = (m, a) => [dot(m[0], a), dot(m[1], a), dot(m[2], a)];

// --- from states to a closed strip ---------------------------------------------------------------------------------

/** Stations {x, d: [d1, d2, d3], eta} of a part, from states at its nodes; those of `parts` strips stand side by side. */
function stations(states, nodes, part = 0, parts = 1) {
  return Array.from({ length: nodes }, (_, k) => {
    const [q0, q1, q2, q3, eta, x, y, z] = states.subarray((k * parts + part) * CHANNELS, (k * parts + part + 1) * CHANNELS),
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

/** Open strips, each there and back, so that nothing joins its ends, with their joints and supports. */
function open(parts, fixtures) {
  const strip = flattened(parts.flatMap((part) => [...part, ...[...part].reverse()]));
  strip.sizes = parts.map((part) => 2 * part.length);
  const first = parts.map((_, i) => strip.sizes.slice(0, i).reduce((a, b) => a + b, 0));
  strip.fixtures = fixtures.map((one) => ({ ...one, station: first[one.part] + (one.last ? parts[one.part].length - 1 : 0) }));
  return strip;
}

/** Stations as one flat array, the middle at the origin, `axis` (else the normal of the enclosed area) along z, d3(0) along y. */
function placed(loop, axis) {
  const middle = loop.reduce((sum, { x }) => along(sum, 1 / loop.length, x), [0, 0, 0]);
  const area = loop.reduce((sum, { x, d }) => along(sum, 1, cross(along(x, -1, middle), d[2])), [0, 0, 0]);
  const up = axis || unit(area),
    side = unit(along([0, 0, 1], -up[2], up)),
    frame = [cross(side, up), side, up];
  return flattened(loop.map(({ x, d, eta }) => ({ x: apply(frame, along(x, -1, middle)), d: d.map((a) => apply(frame, a)), eta })));
}

/** Stations as one flat array. */
function flattened(loop) {
  const flat = new Float64Array(loop.length * STATION);
  loop.forEach(({ x, d, eta }, k) => flat.set([...x, ...d.flat(), eta], k * STATION));
  return flat;
}
