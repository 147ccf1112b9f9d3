/* Draws gates, zones, points and the grid over a pane, in pixels of the screen. */

import { between, middle, planOfMetres } from "./geometry.js";

const TOWARDS = { up: [0, -1], down: [0, 1], left: [-1, 0], right: [1, 0] };
const HANDLE = 6;
const TOUCH = 16;

function put(parent, tag, attributes, text) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  if (text !== undefined) element.textContent = text;
  parent.append(element);
  return element;
}

const listed = (points) => points.map((point) => point.map((value) => value.toFixed(1)).join(",")).join(" ");

function group(svg, classes, part, name) {
  const element = put(svg, "g", { class: classes.filter(Boolean).join(" ") });
  element.dataset.part = part;
  element.dataset.name = name;
  return element;
}

/* A line or an outline with what can be taken hold of. */
function shape(pane, parent, points, closed, chosen, vertex) {
  const places = points.map((point) => pane.screen(point));
  const tag = closed ? "polygon" : "polyline";
  if (closed) put(parent, tag, { points: listed(places), class: "area" });
  put(parent, tag, { points: listed(places), class: "edge" });
  put(parent, tag, { points: listed(places), class: "line" });
  put(parent, tag, { points: listed(places), class: "hit" });
  if (!chosen) return places;
  const ends = closed ? [...places.slice(1), places[0]] : places.slice(1);
  ends.forEach((end, k) => {
    const [cx, cy] = between(places[k], end);
    if (Math.hypot(end[0] - places[k][0], end[1] - places[k][1]) < 40) return;
    put(parent, "circle", { cx, cy, r: 4, class: "between" }).dataset.between = k;
  });
  places.forEach(([cx, cy], k) => {
    put(parent, "circle", { cx, cy, r: HANDLE, class: k === vertex ? "handle vertex-chosen" : "handle" }).dataset.vertex = k;
    put(parent, "circle", { cx, cy, r: TOUCH, class: "touch" }).dataset.vertex = k;
  });
  return places;
}

function gate(pane, svg, name, { line, role = "neutral" }, { chosen, vertex, counts, faulty }) {
  const parent = group(svg, [role, chosen && "chosen", faulty && "fault"], "gates", name);
  const places = shape(pane, parent, line, false, chosen, vertex);
  if (places.length < 2) return;
  const at = middle(places);
  const [first, last] = [places[0], places[places.length - 1]];
  const width = Math.hypot(last[0] - first[0], last[1] - first[1]) || 1;
  const along = [(last[0] - first[0]) / width, (last[1] - first[1]) / width];
  const normal = [-along[1], along[0]];
  for (const [direction, count] of Object.entries(counts ?? {})) {
    const towards = TOWARDS[direction];
    const side = Math.sign(normal[0] * towards[0] + normal[1] * towards[1]) || 1;
    const out = [side * normal[0], side * normal[1]];
    const tip = [at[0] + 17 * out[0], at[1] + 17 * out[1]];
    const base = [at[0] + 8 * out[0], at[1] + 8 * out[1]];
    const wing = [6 * along[0], 6 * along[1]];
    const corners = [tip, [base[0] + wing[0], base[1] + wing[1]], [base[0] - wing[0], base[1] - wing[1]]];
    const opacity = count ? 1 : 0.45;
    put(parent, "polygon", { points: listed(corners), class: "way", opacity });
    const anchor = out[0] > 0.5 ? "start" : out[0] < -0.5 ? "end" : "middle";
    const place = { x: at[0] + 22 * out[0], y: at[1] + 29 * out[1], "text-anchor": anchor };
    put(parent, "text", { ...place, class: "count", opacity }, count);
  }
  label(pane, parent, name, places);
}

/* The name beyond the end of a line that has more room, within the pane. */
function label(pane, parent, name, places) {
  const [a, b] = places.length > 1 ? places.slice(-2) : [places[0], places[0]];
  if (!places.some(([x, y]) => x > 0 && y > 0 && x < pane.root.clientWidth && y < pane.root.clientHeight)) return;
  const length = Math.hypot(b[0] - a[0], b[1] - a[1]) || 1;
  const half = 3.1 * name.length;
  const reach = 12 + (half * Math.abs(b[0] - a[0])) / length;
  const x = Math.min(Math.max(b[0] + ((b[0] - a[0]) / length) * reach, half + 4), pane.root.clientWidth - half - 4);
  const y = Math.min(Math.max(b[1] + ((b[1] - a[1]) / length) * reach, 10), pane.root.clientHeight - 10);
  put(parent, "text", { x, y, class: "label", "text-anchor": "middle" }, name);
}

function zone(pane, svg, name, { polygon, tracked }, { chosen, vertex, stays, faulty }) {
  const parent = group(svg, ["zone", tracked === false && "mask", chosen && "chosen", faulty && "fault"], "zones", name);
  const places = shape(pane, parent, polygon, true, chosen, vertex);
  const x = places.reduce((sum, place) => sum + place[0], 0) / places.length;
  const y = places.reduce((sum, place) => sum + place[1], 0) / places.length;
  const place = { x, "text-anchor": "middle" };
  put(parent, "text", { ...place, y, class: "label" }, name);
  if (stays !== undefined && tracked !== false) put(parent, "text", { ...place, y: y + 18, class: "count" }, stays);
}

function cross(parent, [x, y], name) {
  const lines = `M${x - 9} ${y}h6m6 0h6M${x} ${y - 9}v6m0 6v6M${x - 4} ${y}a4 4 0 1 0 8 0a4 4 0 1 0-8 0`;
  put(parent, "path", { d: lines, class: "cross-edge" });
  put(parent, "path", { d: lines, class: "cross" });
  put(parent, "circle", { cx: x, cy: y, r: TOUCH, class: "touch" });
  put(parent, "text", { x: x + 9, y: y - 11, class: "label" }, name);
}

function pairs(pane, svg, drawing, shown, chosen) {
  let whole = 0;
  drawing.pairs.forEach((pair, k) => {
    const number = pair.picture && pair.ground ? ++whole : null; // as the calibration numbers them
    const at = shown.plan ? pair.ground && drawing.world && planOfMetres(drawing.world, pair.ground) : pair.picture;
    if (!at) return;
    const wrong = number && shown.calibration?.wrong.includes(number);
    const parent = group(svg, ["pair", k === chosen && "chosen", wrong && "wrong"], "pairs", k);
    const fitted = !shown.plan && number && shown.calibration?.fitted[number - 1];
    if (fitted) {
      const [[x1, y1], [x2, y2]] = [pane.screen(at), pane.screen(fitted)];
      put(parent, "line", { x1, y1, x2, y2, class: "off" });
      put(parent, "circle", { cx: x2, cy: y2, r: 2.5, class: "off" });
    }
    if (k === chosen) {
      const [cx, cy] = pane.screen(at);
      put(parent, "circle", { cx, cy, r: 15, class: "snap" });
    }
    cross(parent, pane.screen(at), `${k + 1}`);
  });
}

/* What is being drawn just now. */
function started(pane, svg, { points, end, closed, kind }) {
  const parent = put(svg, "g", { class: kind });
  const places = [...points, ...(end ? [end] : [])].map((point) => pane.screen(point));
  put(parent, "polyline", { points: listed(places), class: "edge" });
  put(parent, "polyline", { points: listed(places), class: "line" });
  if (closed && places.length > 2)
    put(parent, "polyline", { points: listed([places[0], places[places.length - 1]]), class: "line rubber" });
  for (const [cx, cy] of places) put(parent, "circle", { cx, cy, r: HANDLE - 1, class: "handle" });
}

export function render(pane, drawing, shown) {
  const svg = pane.svg;
  svg.replaceChildren();
  pane.root.classList.toggle("small", pane.root.clientWidth < 440);
  if (!drawing) return;
  const { selection } = shown;
  const choice = (part, name) => {
    const chosen = selection?.part === part && selection.name === name;
    return { chosen, vertex: chosen ? selection.vertex : null, faulty: shown.faulty(part, name) };
  };
  if (!shown.plan) {
    for (const line of (shown.grid && shown.calibration?.grid) || [])
      put(svg, "polyline", { points: listed(line.map((point) => pane.screen(point))), class: "grid" });
    for (const [name, one] of Object.entries(drawing.tree.zones ?? {}))
      zone(pane, svg, name, one, { ...choice("zones", name), stays: shown.tally?.stays[name] });
    for (const [name, one] of Object.entries(drawing.tree.gates ?? {}))
      gate(pane, svg, name, one, { ...choice("gates", name), counts: shown.tally?.counts[name] });
  }
  pairs(pane, svg, drawing, shown, selection?.part === "pairs" ? selection.name : null);
  const chosen = svg.querySelector("g.chosen");
  if (chosen) svg.append(chosen); // above all others, where it can be taken hold of
  if (shown.started) started(pane, svg, shown.started);
  if (shown.snap) {
    const [x, y] = pane.screen(shown.snap);
    put(svg, "path", { d: `M${x - 9} ${y}l9-9 9 9-9 9z`, class: "snap" });
  }
  if (shown.aim) {
    const [x, y] = pane.screen(shown.aim);
    put(svg, "path", { d: `M${x - 22} ${y}h16m12 0h16M${x} ${y - 22}v16m0 12v16`, class: "aim" });
  }
}
