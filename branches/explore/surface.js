"use strict";
// The surface of a strip: triangles in space, flat polygons, and a solid for other programs.

const count = (strip) => strip.length / STATION;

/** The largest distance of the centreline from the origin. */
function reach(strip) {
  let most = 0;
  for (let k = 0; k < strip.length; k += STATION) most = Math.max(most, Math.hypot(strip[k], strip[k + 1], strip[k + 2]));
  return most;
}

/** The number of the station after each one, of every so many: the first of a strip follows its last one. */
function following(strip, every = 1) {
  const next = [];
  for (const size of strip.sizes || [count(strip)]) {
    const first = next.length,
      n = Math.ceil(size / every);
    for (let k = 0; k < n; k++) next.push(first + ((k + 1) % n));
  }
  return next;
}

/** The widest strip whose rulings (6a) do not cross: 2 / max |eta'|. */
function widest(strip) {
  const eta = (k) => strip[k * STATION + 12],
    place = (k) => strip.subarray(k * STATION, k * STATION + 3);
  let most = 0;
  following(strip).forEach((next, k) => {
    const step = Math.hypot(...along(place(next), -1, place(k)));
    if (step > 0) most = Math.max(most, Math.abs(eta(next) - eta(k)) / step);
  });
  return 2 / most;
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
function triangles(strip) {
  const i = [],
    j = [],
    k = [];
  following(strip).forEach((next, a) => {
    const p = 4 * a,
      q = 4 * next;
    i.push(p, p + 1, p + 2, p + 3);
    j.push(p + 1, q + 1, q + 2, q + 2);
    k.push(q, q, p + 3, q + 3);
  });
  return { i, j, k };
}

/** Quadrilaterals of joints, supports and forces: corners, and their paint. A profile is turned around an axis; that of a force
 * points against it for negative numbers, and is a point for zero. */
function fixtureQuads(strip, width, scale) {
  return (strip.fixtures || []).flatMap(({ station, arm, axes, sides, profile, held, inSpace, signs, sign }) => {
    const at = (i) => strip.subarray(station * STATION + i, station * STATION + i + 3),
      turn = (a) => a.reduce((sum, part, i) => along(sum, part, at(3 + 3 * i)), [0, 0, 0]),
      place = along(turn(arm), 1, at(0)),
      isForce = signs !== undefined,
      [ahead, ...across] = inSpace ? axes : axes.map(turn), // the direction of a dead force is fixed in space
      size = width * sign,
      paint = isForce ? "force" : held ? "support" : "joint";
    const rings = profile.map(([height, radius]) =>
      Array.from({ length: sides }, (_, k) => {
        const angle = (2 * Math.PI * (k + 0.5)) / sides,
          aside = along(along([0, 0, 0], Math.cos(angle), across[0]), Math.sin(angle), across[1]);
        return along([0, 0, 0], scale, along(along(place, size * height, ahead), size * radius, aside));
      }),
    );
    return rings.slice(1).flatMap((ring, r) =>
      ring.map((corner, k) => {
        const next = (k + 1) % sides;
        return { corners: [rings[r][k], rings[r][next], ring[next], corner], paint };
      }),
    );
  });
}

/** The same as a mesh: coordinates, corners of triangles, and the paint of each quadrilateral. */
function fixtureMesh(strip, width, scale) {
  const quads = fixtureQuads(strip, width, scale),
    points = quads.flatMap(({ corners }) => corners),
    [x, y, z] = [0, 1, 2].map((i) => Float32Array.from(points, (point) => point[i])),
    first = quads.map((_, q) => 4 * q);
  return {
    place: { x, y, z },
    corners: {
      i: first.flatMap((q) => [q, q]),
      j: first.flatMap((q) => [q + 1, q + 2]),
      k: first.flatMap((q) => [q + 2, q + 3]),
    },
    paints: quads.map(({ paint }) => paint),
  };
}

/**
 * The strip as flat polygons seen from `eye`, the farthest first, each with its side and the brightness 0 ... 1.
 * For small pictures, for vector graphics, and where there is no WebGL.
 */
function polygons(strip, width, scale, eye, every = 1) {
  const view = unit(eye),
    right = unit(cross([0, 0, 1], view)),
    top = cross(view, right),
    light = unit([0.3, -0.4, 0.85]);
  const rows = edges(strip, width, scale, every),
    next = following(strip, every),
    result = [];
  const add = (corners, normal, side) =>
    result.push({
      points: corners.map((p) => [dot(p, right), -dot(p, top)]),
      depth: corners.reduce((sum, p) => sum + dot(p, view), 0),
      side,
      shade: 0.5 + 0.5 * Math.abs(dot(normal, light)),
    });
  rows.forEach(([a, b, normal], k) => {
    const [c, d] = rows[next[k]];
    add([a, b, d, c], normal, dot(normal, view) > 0 ? "front" : "rear");
  });
  for (const { corners, paint } of fixtureQuads(strip, width, scale)) {
    const normal = unit(cross(along(corners[2], -1, corners[0]), along(corners[3], -1, corners[1])));
    if (dot(normal, view) > 0) add(corners, normal, paint);
  }
  return result.sort((p, q) => p.depth - q.depth);
}

/** A closed solid from the two sheets of n stations, as a binary STL file: four quadrilaterals a station. */
function stl({ x, y, z }, n) {
  const ring = [0, 1, 3, 2], // vertices of a cross section in order
    at = (vertex) => [x[vertex], y[vertex], z[vertex]],
    facets = [];
  for (let k = 0; k < n; k++)
    ring.forEach((corner, i) => {
      const [a, b, c, d] = [
        4 * k + corner,
        4 * k + ring[(i + 1) % 4],
        4 * ((k + 1) % n) + ring[(i + 1) % 4],
        4 * ((k + 1) % n) + corner,
      ];
      facets.push([at(a), at(b), at(c)], [at(a), at(c), at(d)]);
    });
  const volume = facets.reduce((sum, [a, b, c]) => sum + dot(a, cross(b, c)), 0);
  const view = new DataView(new ArrayBuffer(84 + 50 * facets.length));
  view.setUint32(80, facets.length, true);
  facets.forEach((facet, f) => {
    const [a, b, c] = volume > 0 ? facet : [...facet].reverse(), // seen from outside, counterclockwise
      normal = unit(cross(along(b, -1, a), along(c, -1, a)));
    [normal, a, b, c].flat().forEach((value, i) => view.setFloat32(84 + 50 * f + 4 * i, value, true));
  });
  return view.buffer;
}
