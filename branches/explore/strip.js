"use strict";
// The strip in space, a lit mesh drawn by plotly; flat polygons where there is no WebGL, in small pictures and in SVG.

const [x0, y0, z0] = DATA.eye || [0.78, -1.02, 0.8],
  EYE = { x: x0, y: y0, z: z0 };
const flat = !hasWebGL();
let flatEye = EYE;

function hasWebGL() {
  const canvas = document.createElement("canvas");
  return Boolean(canvas.getContext("webgl2") || canvas.getContext("webgl"));
}

/** Width of the strip in units of L / 2 pi. */
const width = () => (Number($("width").value) / 100) * 2 * Math.PI;
/** A tight coil is drawn larger than to scale, but smaller than a single loop; open strips are all drawn to one that fits. */
const scaleOf = (strip) => DATA.scale * Math.min(1, (0.8 * $("ribbon").clientWidth) / $("ribbon").clientHeight || 1) || 0.86 / reach(strip) ** 0.6;

const LIT = {
  hoverinfo: "skip",
  showscale: false,
  lighting: { ambient: 0.52, diffuse: 0.75, specular: 0.28, roughness: 0.45, fresnel: 0.12 },
  lightposition: { x: 3000, y: -4000, z: 9000 },
};

function ribbonTraces(strip) {
  const scale = scaleOf(strip),
    n = count(strip),
    mesh = sheets(strip, width(), scale);
  const sides = Array.from({ length: 4 * n }, (_, v) => colour(v % 4 < 2 ? "front" : "rear"));
  const traces = [
    {
      type: "mesh3d",
      ...mesh,
      ...triangles(strip),
      vertexcolor: sides,
      flatshading: Boolean(strip.sizes), // narrow strips are dark if their normals are means with those of their edges
      ...LIT,
    },
  ];
  if (strip.fixtures && strip.fixtures.length) {
    const { place, corners, paints } = fixtureMesh(strip, width(), scale),
      tints = paints.flatMap((paint) => Array(4).fill(colour(paint)));
    traces.push({ type: "mesh3d", ...place, ...corners, vertexcolor: tints, flatshading: true, ...LIT });
  }
  if ($("triads").checked)
    triadLines(strip, scale).forEach((line, i) =>
      traces.push({
        type: "scatter3d",
        mode: "lines",
        ...line,
        line: { color: colour(`d${i + 1}`), width: 6 },
        hoverinfo: "skip",
        showlegend: false,
      }),
    );
  return traces;
}

/** Directors d1, d2, d3 at a few stations: a broken line for each of the three. */
function triadLines(strip, scale) {
  return [0, 1, 2].map((i) => {
    const line = { x: [], y: [], z: [] },
      n = count(strip);
    for (let a = 0; a < 16; a++) {
      const k = Math.round((a * n) / 16) * STATION,
        x = [...strip.subarray(k, k + 3)],
        d = [...strip.subarray(k + 3 + 3 * i, k + 6 + 3 * i)];
      const from = along([0, 0, 0], scale, x),
        to = along(from, 0.2, d);
      ["x", "y", "z"].forEach((name, j) => line[name].push(from[j], to[j], null));
    }
    return line;
  });
}

const sceneAxis = { visible: false, range: [-1, 1], autorange: false };

/** The strip at the chosen place, or on its way to another one. */
const shownStrip = () => now.falling || now.branch.strip(now.s);

async function createState() {
  if (!SHAPES) return drawProfile();
  if (now.branch.leftOut) return;
  const strip = shownStrip();
  if (flat) return drawFlat(strip);
  const scene = {
    xaxis: sceneAxis,
    yaxis: sceneAxis,
    zaxis: sceneAxis,
    aspectmode: "cube",
    camera: { eye: EYE, projection: { type: "perspective" } },
    dragmode: "orbit",
  };
  await Plotly.newPlot(
    "ribbon",
    ribbonTraces(strip),
    { margin: { l: 0, r: 0, t: 0, b: 0 }, paper_bgcolor: "rgba(0,0,0,0)", scene, showlegend: false },
    { responsive: true, displaylogo: false, displayModeBar: false, scrollZoom: true },
  );
  $("ribbon").on("plotly_relayout", () => !now.playing && (drawStates(), remember()));
}

/** Say that the page leaves out the shapes of a branch, in the place of the strip, and how to see them. */
function tellLeftOut({ leftOut, path }) {
  document.body.classList.toggle("left-out", Boolean(leftOut));
  if (leftOut) $("left-out-command").textContent = `python -m branches.explore "${path}"`;
}

async function updateState() {
  tellLeftOut(now.branch);
  if (!SHAPES || flat || !$("ribbon").data || now.branch.leftOut) return createState();
  const strip = shownStrip(),
    scale = scaleOf(strip),
    mesh = sheets(strip, width(), scale),
    n = count(strip);
  if (4 * n !== $("ribbon").data[0].x.length) return Plotly.react("ribbon", ribbonTraces(strip), $("ribbon").layout);
  const joints = strip.fixtures && strip.fixtures.length ? [fixtureMesh(strip, width(), scale).place] : [],
    drawn = [mesh, ...joints, ...($("triads").checked ? triadLines(strip, scale) : [])];
  return Plotly.restyle(
    "ribbon",
    { x: drawn.map((one) => one.x), y: drawn.map((one) => one.y), z: drawn.map((one) => one.z) },
    drawn.map((_, i) => i),
  );
}

const eyeNow = () => {
  const { x, y, z } = flat || !$("ribbon").layout ? flatEye : $("ribbon").layout.scene.camera.eye;
  return [x, y, z];
};

/** Look from elsewhere. */
function look(eye) {
  flatEye = eye;
  if (flat) return update();
  return Plotly.relayout("ribbon", {
    "scene.camera.eye": eye,
    "scene.camera.up": { x: 0, y: 0, z: 1 },
    "scene.camera.center": { x: 0, y: 0, z: 0 },
  });
}

/** Arrow keys turn the strip when it has the focus, + and - change the distance. */
function turnByKey(event) {
  const turns = {
    ArrowLeft: [-0.15, 0, 1],
    ArrowRight: [0.15, 0, 1],
    ArrowUp: [0, 0.15, 1],
    ArrowDown: [0, -0.15, 1],
    "+": [0, 0, 0.9],
    "-": [0, 0, 1 / 0.9],
  };
  if (!(event.key in turns) || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  event.stopPropagation();
  const [about, over, farther] = turns[event.key],
    [x, y, z] = eyeNow(),
    r = Math.hypot(x, y, z) * farther;
  const azimuth = Math.atan2(y, x) + about,
    height = Math.min(1.5, Math.max(-1.5, Math.asin(z / Math.hypot(x, y, z)) + over));
  look({ x: r * Math.cos(height) * Math.cos(azimuth), y: r * Math.cos(height) * Math.sin(azimuth), z: r * Math.sin(height) });
}

/** The fill of a polygon as a function: its side's colour, darker where it faces away from the light. */
function fills() {
  const parts = (side) =>
    colour(side)
      .match(/\w\w/g)
      .map((part) => parseInt(part, 16));
  const known = Object.fromEntries(["front", "rear", "joint", "support", "force"].map((side) => [side, parts(side)]));
  return ({ side, shade }) => `rgb(${known[side].map((part) => Math.round(part * shade)).join(",")})`;
}

/** A picture of the strip without WebGL. */
function paint(canvas, strip, eye, scale, every) {
  const ratio = window.devicePixelRatio || 1,
    context = canvas.getContext("2d");
  if (canvas.isConnected) [canvas.width, canvas.height] = [canvas.clientWidth * ratio, canvas.clientHeight * ratio];
  const size = Math.min(canvas.width, canvas.height) * 0.46,
    fill = fills();
  context.translate(canvas.width / 2, canvas.height / 2);
  for (const polygon of polygons(strip, width(), scale, eye, every)) {
    context.fillStyle = context.strokeStyle = fill(polygon);
    context.beginPath();
    polygon.points.forEach(([x, y]) => context.lineTo(x * size, y * size));
    context.closePath();
    context.fill();
    context.stroke();
  }
}

function drawFlat(strip) {
  const canvas =
    $("ribbon").querySelector("canvas") ||
    $("ribbon").appendChild(Object.assign(document.createElement("canvas"), { className: "flat" }));
  paint(canvas, strip, eyeNow(), scaleOf(strip), 1);
}

function ribbonSvg(paper) {
  const strip = shownStrip(),
    round = (x) => (400 + 340 * x).toFixed(2),
    fill = fills();
  const shapes = polygons(strip, width(), scaleOf(strip), eyeNow(), 1).map((polygon) => {
    const tint = fill(polygon);
    return `<path fill="${tint}" stroke="${tint}" d="M${polygon.points.map(([x, y]) => `${round(x)} ${round(y)}`).join("L")}Z"/>`;
  });
  const ground = `<rect width="800" height="800" fill="${paper}"/>`;
  return `<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 800 800" stroke-width=".6" stroke-linejoin="round">${ground}${shapes.join("")}</svg>`;
}
