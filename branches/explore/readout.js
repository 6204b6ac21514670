"use strict";
// The read-out, and all states that share the present kappa_n.

let idle = 0; // timer: pictures of the other states are drawn when nothing has moved for a moment

function readOut() {
  const { branch, s } = now,
    [kind, word, index] = stability(branch, s);
  const tag = `<span class="tag ${kind}">${word}</span>${index && kind === "unstable" ? `, index ${index}` : ""}`;
  const rows = [
    ["branch", escaped(nameOf(branch))],
    ...[...new Set([...COLUMNS, ...(DATA.told ? [now.x, now.y] : [])])].map((name) => [AXES.get(name).brief, digitsAt(branch, name, s), name]),
    ...(STRIPS || branch.hasIndex ? [["stability", tag, "stability"]] : []),
    ...(STRIPS && branch.ruled && !branch.leftOut ? [["rulings cross beyond", percent(widest(shownStrip())), "widest"]] : []),
    ["point", pointName(branch, s), "point"],
  ];
  $("readout").innerHTML = rows
    .map(([name, value, id]) => `<div><dt>${name}</dt><dd${id ? ` data-value="${escaped(id)}"` : ""}>${value}</dd></div>`)
    .join("");
  const text = story();
  if (!now.playing && $("story").textContent !== text) $("story").textContent = text;
  $("snap").hidden = !canSnap();
}

function pointName(branch, s) {
  if (branch.circle) return "exact";
  if (Math.abs(s - Math.round(s)) > 1e-9) return `interpolated, ${Math.floor(s)} – ${Math.ceil(s)}`;
  const label = branch.labels[Math.round(s)];
  return `${Math.round(s)} of ${branch.size - 1}${label ? ` (${escaped(label)})` : ""}`;
}

/** All states of the family at the kappa_n of a place, by energy. */
function coexisting(from = now.branch, place = now.s) {
  const kappa = from.value("kappa_n", place),
    found = [{ branch: from, s: place }];
  for (const branch of now.family.branches)
    for (const s of branch.places(kappa))
      if (!found.some((one) => one.branch === branch && Math.abs(one.s - s) < 0.02)) found.push({ branch, s });
  found.forEach((one) => (one.energy = one.branch.value("energy", one.s)));
  return found.sort((a, b) => a.energy - b.energy);
}

function drawStates() {
  clearTimeout(idle);
  if (!STRIPS) return;
  const found = coexisting();
  $("states-note").textContent = `${found.length} at κₙL/2π = ${short(now.branch.value("kappa_n", now.s))}, least energy first`;
  $("states").replaceChildren(
    ...found.map((one) => {
      const item = document.createElement("li"),
        button = item.appendChild(document.createElement("button")),
        [kind, word] = stability(one.branch, one.s);
      button.type = "button";
      button.innerHTML = `<canvas aria-hidden="true"></canvas><b>${nameOf(one.branch)}</b><small>energy ${digitsAt(one.branch, "energy", one.s, 5)}</small><span class="tag ${kind}">${word}</span>`;
      if (one.branch === now.branch && one.s === now.s) button.setAttribute("aria-current", "true");
      button.onclick = () => go(one.branch, one.s);
      return item;
    }),
  );
  const current = $("states").querySelector("[aria-current]").parentElement;
  const left = current.offsetLeft - $("states").offsetLeft,
    room = $("states").clientWidth - current.clientWidth - 20;
  $("states").scrollLeft = Math.max(0, left - room);
  $("states")
    .querySelectorAll("canvas")
    .forEach((canvas, i) => {
      if (found[i].branch.leftOut) return;
      const strip = found[i].branch.strip(found[i].s);
      paint(canvas, strip, eyeNow(), scaleOf(strip) * 1.05, Math.max(1, Math.round(count(strip) / 190)));
    });
}
