"use strict";
// The state of a branch of any problem: its components against the independent variable, or as bars where there is none.

const byTime = () => now.branch.nodes > 1;

function profileTraces() {
  const { branch } = now,
    values = branch.states(now.s),
    { channels, nodes, components } = branch;
  const column = (c) => Array.from({ length: nodes }, (_, k) => values[k * channels + c]);
  if (!byTime())
    return components.map((name, i) => ({
      type: "scatter",
      mode: "lines",
      name: escaped(name),
      x: [escaped(name), escaped(name)],
      y: [0, values[i + 1]],
      line: { color: colour("accent"), width: 40, simplify: false },
      hoverinfo: "name+y",
    }));
  return components.map((name, i) => ({
    type: "scatter",
    mode: "lines",
    name: escaped(name),
    x: column(0),
    y: column(i + 1),
    line: {
      color: wave(i + 2),
      width: 2.2,
      shape: "spline",
      simplify: false,
      dash: ["solid", "dash", "dot"][Math.floor(i / WAVES) % 3],
    },
  }));
}

function profileLayout() {
  const axis = { gridcolor: colour("grid"), zerolinecolor: colour("line"), linecolor: colour("line"), automargin: true };
  return {
    margin: { l: 54, r: 12, t: 8, b: 46 },
    paper_bgcolor: "rgba(0,0,0,0)",
    plot_bgcolor: "rgba(0,0,0,0)",
    font: { family: "system-ui, sans-serif", size: 13, color: colour("soft") },
    xaxis: {
      ...axis,
      title: { text: byTime() ? "independent variable t" : "", standoff: 6 },
      ...(byTime() ? {} : { range: [-0.5, now.branch.components.length - 0.5] }),
    },
    yaxis: { ...axis, title: { text: byTime() ? "states" : "state", standoff: 6 } },
    showlegend: byTime(),
    legend: { orientation: "h", x: 0, y: 1.12, font: { color: colour("ink") } },
    dragmode: "pan",
  };
}

const drawProfile = () =>
  Plotly.react("ribbon", profileTraces(), profileLayout(), { responsive: true, displaylogo: false, displayModeBar: false });
