"use strict";

/* Charts of counts: bars of intervals, the two directions of a line on each other, grey where nobody watched. */

const ARROWS = { left: "←", right: "→", up: "↑", down: "↓" };
const WAYS = ["first", "second"];
const BAND = 16; // px below the bars, for the hours
const SIDE = 30; // px at the left, for the numbers

const CLOCK = { hour: "2-digit", minute: "2-digit", hourCycle: "h23" };
const clock = (unix) => new Date(1000 * unix).toLocaleTimeString([], CLOCK);
const whole = (count) => (count ?? 0).toLocaleString();

function shape(name, attributes, text) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text) made.textContent = text;
  return made;
}

/* The direction with its arrow, and a number. */
function way(direction, place, count) {
  const made = document.createElement("span");
  made.className = `way ${WAYS[place % 2]}`;
  const arrow = document.createElement("i");
  arrow.textContent = ARROWS[direction] ?? direction;
  arrow.title = direction;
  const number = document.createElement("b");
  number.textContent = count === undefined ? "–" : whole(count);
  made.append(arrow, number);
  return made;
}

/* Rows of one gate in intervals: begin, end, what was watched, and each direction's row. */
function intervals(rows, ways) {
  const groups = new Map();
  for (const row of rows) {
    const group = groups.get(row.begin_s) ?? { begin: row.begin_s, end: row.end_s, covered: Math.min(row.coverage ?? 0, 1), of: [] };
    group.of[ways.indexOf(row.direction)] = row;
    groups.set(row.begin_s, group);
  }
  return [...groups.values()];
}

/* Neighbouring intervals together, until each lasts so long [s]. */
function joined(groups, seconds) {
  const found = new Map();
  for (const group of groups) {
    const key = Math.floor(group.begin / seconds);
    const one = found.get(key) ?? { begin: group.begin, end: group.end, watched: 0, of: [] };
    one.end = group.end;
    one.watched += group.covered * (group.end - group.begin);
    group.of.forEach((row, place) => { one.of[place] = { count: (one.of[place]?.count ?? 0) + (row.count ?? 0) }; });
    found.set(key, one);
  }
  return [...found.values()].map((one) => ({ ...one, covered: one.watched / (one.end - one.begin) }));
}

function bars(drawing, groups, across, low, high) {
  const total = (group) => group.of.reduce((sum, row) => sum + (row?.count ?? 0), 0);
  const most = nice(Math.max(1, ...groups.map(total)));
  for (const group of groups) {
    const x = across(group.begin);
    const width = Math.max(across(group.end) - x - (across(group.end) - x > 4 ? 1 : 0), 0.5);
    drawing.append(shape("rect", { class: "ground", x, y: high, width: width + 1, height: low - high, opacity: group.covered }));
    let y = low;
    group.of.forEach((row, place) => {
      const height = ((low - high) * (row?.count ?? 0)) / most;
      y -= height;
      drawing.append(shape("rect", { class: WAYS[place % 2], x, y, width, height }));
    });
  }
  return most;
}

/* The least of 1, 2, 3, 4, 5, 6, 8, 10, 20, ... that is no less. */
function nice(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return power * [1, 2, 3, 4, 5, 6, 8, 10].find((factor) => factor * power >= value);
}

/* Where a chart of the last hours begins: there are no more than have been watched, and three at least. */
const beginning = (rows, since, until) => Math.max(since, Math.min(until - 10800, ...rows.map((row) => row.begin_s)));

/* Small, without numbers: the last day by hours, or the few hours that there are by quarters. */
function spark(rows, ways, since, until) {
  const drawing = shape("svg", { viewBox: "0 0 240 40", preserveAspectRatio: "none", "aria-hidden": "true" });
  drawing.append(shape("rect", { class: "unwatched", x: 0, y: 0, width: 240, height: 40 }));
  const across = (unix) => (240 * (Math.min(Math.max(unix, since), until) - since)) / (until - since);
  bars(drawing, joined(intervals(rows, ways), until - since > 28800 ? 3600 : 900), across, 40, 0);
  return drawing;
}

/* Large, with numbers; `tell` is called with what an interval counted. */
function chart(rows, ways, since, until, [wide, high], tell) {
  const low = high - BAND;
  const drawing = shape("svg", { viewBox: `0 0 ${wide} ${high}`, height: high, preserveAspectRatio: "none", role: "img" });
  const across = (unix) => SIDE + ((wide - SIDE) * (Math.min(Math.max(unix, since), until) - since)) / (until - since);
  drawing.append(shape("rect", { class: "unwatched", x: SIDE, y: 8, width: wide - SIDE, height: low - 8 }));
  const groups = intervals(rows, ways);
  const most = bars(drawing, groups, across, low, 8);
  for (const part of [0, 0.5, 1]) {
    const y = low - part * (low - 8);
    if (part) drawing.append(shape("line", { class: "grid", x1: SIDE, x2: wide, y1: y, y2: y, opacity: 0.7 }));
    if (most * part === Math.round(most * part)) drawing.append(shape("text", { x: SIDE - 5, y: y + 4, "text-anchor": "end" }, whole(most * part)));
  }
  const hours = wide < 420 ? 6 : 3;
  for (let unix = Math.ceil(since / 3600) * 3600; unix <= until; unix += 3600) {
    const x = across(unix);
    if (new Date(1000 * unix).getHours() % hours || x > wide - 16 || x < SIDE + 14) continue;
    drawing.append(shape("line", { class: "grid", x1: x, x2: x, y1: low, y2: low + 3 }), shape("text", { x, y: high - 1, "text-anchor": "middle" }, clock(unix)));
  }
  for (const group of groups) {
    const x = across(group.begin);
    const hit = shape("rect", { class: "hit", x, y: 8, width: Math.max(across(group.end) - x, 1), height: low - 8 });
    hit.onpointerenter = () => tell(inWords(group, ways));
    hit.onpointerleave = () => tell("");
    drawing.append(hit);
  }
  return drawing;
}

function inWords(group, ways) {
  const told = ways.map((name, place) => {
    const row = group.of[place];
    const speed = row?.time_mean_speed_kmh ? ` at ${row.time_mean_speed_kmh.toFixed(0)} km/h` : "";
    return `${ARROWS[name] ?? name} ${whole(row?.count)}${speed}`;
  });
  const watched = group.covered < 0.995 ? `, watched ${Math.round(100 * group.covered)} %` : "";
  return `${clock(group.begin)} to ${clock(group.end)}: ${told.join(", ")}${watched}`;
}
