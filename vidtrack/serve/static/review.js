"use strict";

const KEYS = { right: "r", wrong: "w", "wrong direction": "d", "wrong class": "c", double: "2", "no vehicle": "v", "cannot tell": "u" };
const GOOD = new Set(["right"]);
const FRAME_MS = 90;
const HOLD_MS = 500; // at the moment of passing, and between two rounds
const SHOWN = 200; // rows that are added at a time
const HERE = location.origin + location.pathname;
const $ = (id) => document.getElementById(id);

const token = location.hash.slice(1);
const undone = []; // changes that can be taken back, the last one at the end
let data, state; // what was counted; what was found
let rows = [];
let at = 0; // place of the event in the order
let clip = null; // {picture, frames, moment}
let frame = 0, playing = !matchMedia("(prefers-reduced-motion: reduce)").matches;
let busy = false;

async function ask(path, change) {
  const request = { headers: { "X-Vidtrack-Token": token } };
  if (change) Object.assign(request, { method: "POST", body: JSON.stringify({ changes: state.changes, ...change }) });
  const answer = await fetch(HERE + path, request);
  if (!answer.ok) throw Object.assign(new Error((await answer.text()).trim()), { status: answer.status });
  return answer;
}

function tell(trouble) {
  $("trouble").hidden = !trouble;
  $("trouble").textContent = trouble ?? "";
}

function element(tag, text) {
  const made = document.createElement(tag);
  made.textContent = text;
  return made;
}

const event = () => data.events[at];
const verdict = (one) => state.verdicts[one.number];
const percent = (share) => `${(100 * share).toFixed(share > 0 && share < 1 ? 1 : 0)} %`;

function facts(one) {
  const speed = one.speed_kmh === null ? null
    : `${one.speed_kmh.toFixed(0)}${one.speed_sigma_kmh === null ? "" : ` ± ${(1.96 * one.speed_sigma_kmh).toFixed(0)}`} km/h`;
  const sure = one.confidence === null ? null : `confidence ${one.confidence.toFixed(2)}`;
  const near = one.headway_s !== null && one.headway_s < 2 ? `${one.headway_s.toFixed(1)} s behind another` : null;
  return [one.clock, `track ${one.track_id}`, one.kind, speed, sure, one.reason === "seen" ? null : one.reason, near].filter(Boolean);
}

/* Rows */

function addRows(count) {
  const list = document.querySelector("#list ol"), model = $("row").content.firstElementChild;
  for (const one of data.events.slice(rows.length, rows.length + count)) {
    const row = model.cloneNode(true), place = rows.length;
    row.querySelector(".way").textContent = `${one.gate} ${one.direction}`;
    row.querySelector(".facts").textContent = facts(one).join(" · ");
    row.querySelector(".facts").classList.toggle("doubtful", one.doubt >= 0.05);
    row.querySelector("button").onclick = () => go(place);
    row.place = place;
    rows.push(row);
    list.append(row);
    mark(place);
    if (!data.no_clips) inSight.observe(row);
  }
  if (rows.length < data.events.length) atEnd.observe(rows[rows.length - 1]);
}

function mark(place) {
  const found = verdict(data.events[place]), label = rows[place].querySelector(".verdict");
  label.textContent = found ?? "";
  label.classList.toggle("good", GOOD.has(found));
  label.classList.toggle("unsure", found === "cannot tell");
}

const atEnd = new IntersectionObserver((entries) => {
  for (const entry of entries) {
    if (!entry.isIntersecting) continue;
    atEnd.unobserve(entry.target);
    addRows(SHOWN);
  }
});

const wanted = new Set(); // rows in sight without their picture
const inSight = new IntersectionObserver((entries) => {
  for (const entry of entries) entry.isIntersecting ? wanted.add(entry.target) : wanted.delete(entry.target);
  thumbs();
});

let drawing = false;
async function thumbs() {
  if (drawing) return;
  drawing = true;
  for (let row; (row = [...wanted].sort((a, b) => a.place - b.place)[0]); ) {
    wanted.delete(row);
    inSight.unobserve(row);
    try {
      const answer = await ask(`thumbs/${data.events[row.place].number}.jpg`);
      const picture = await createImageBitmap(await answer.blob());
      row.querySelector("canvas").getContext("2d").drawImage(picture, 0, 0);
    } catch {
      row.querySelector("canvas").title = "no picture";
    }
  }
  drawing = false;
}

/* The event */

async function go(place) {
  if (place < 0 || place >= data.events.length) return;
  rows[at]?.removeAttribute("aria-current");
  at = place;
  while (rows.length <= at) addRows(SHOWN);
  rows[at].setAttribute("aria-current", "true");
  if (!matchMedia("(max-width: 52rem)").matches) rows[at].scrollIntoView({ block: "nearest" });
  const one = event();
  $("what").textContent = `${one.gate}, ${one.direction}`;
  $("facts").textContent = [`${at + 1} of ${data.events.length}`, ...facts(one)].join(" · ");
  for (const button of $("verdicts").children) button.ariaPressed = String(button.value === verdict(one));
  $("miss").querySelector("[name=time_s]").value = one.time_s.toFixed(1);
  choose(one.gate, one.direction);
  $("decisions").open = false;
  await load(one);
}

async function load(one) {
  clip = null;
  $("moment").textContent = "";
  if (data.no_clips) return;
  try {
    const answer = await ask(`clips/${one.number}.jpg`);
    const picture = await createImageBitmap(await answer.blob());
    if (one !== event()) return;
    clip = { picture, frames: Number(answer.headers.get("Clip-Frames")), moment: Number(answer.headers.get("Clip-Moment")) };
    frame = playing ? 0 : clip.moment;
    noClip("");
    draw();
  } catch (error) {
    if (one === event()) noClip(error.message);
  }
}

function noClip(why) {
  $("clip").hidden = Boolean(why);
  $("no-clip").hidden = !why;
  $("no-clip").textContent = why && `No picture: ${why}`;
}

function draw() {
  if (!clip) return;
  const canvas = $("clip"), width = clip.picture.width / clip.frames;
  canvas.width = width;
  canvas.height = clip.picture.height;
  canvas.getContext("2d").drawImage(clip.picture, frame * width, 0, width, canvas.height, 0, 0, width, canvas.height);
  $("moment").textContent = frame === clip.moment ? "passes now" : `picture ${frame + 1} of ${clip.frames}`;
}

async function play() {
  for (;;) {
    const hold = clip && (frame === clip.moment || frame === clip.frames - 1) ? HOLD_MS : FRAME_MS;
    await new Promise((done) => setTimeout(done, hold));
    if (!clip || !playing || document.hidden) continue;
    frame = (frame + 1) % clip.frames;
    draw();
  }
}

function pause(paused) {
  playing = !paused;
  $("play").firstChild.textContent = paused ? "Play " : "Pause ";
}

function step(way) {
  if (!clip) return;
  pause(true);
  frame = (frame + way + clip.frames) % clip.frames;
  draw();
}

async function log() {
  const place = document.querySelector("#decisions div");
  place.textContent = "…";
  const one = event();
  try {
    const found = await (await ask(`decisions/${one.number}`)).json();
    if (one !== event()) return;
    if (!found?.length) {
      place.textContent = found ? "Nothing is noted about this track." : "There is none: it is written by --decisions.";
      return;
    }
    const names = ["time_s", "event", "weight", "d2", "gate", "runner_up_d2", "reason"];
    const table = document.createElement("table"), head = table.createTHead().insertRow(), body = table.createTBody();
    head.append(...["time s", "event", "weight", "d²", "gate", "next d²", "reason"].map((name) => element("th", name)));
    for (const row of found) {
      const cells = names.map((name) => (typeof row[name] === "number" ? row[name].toFixed(2) : row[name] ?? ""));
      body.insertRow().append(...cells.map((cell) => element("td", cell)));
    }
    place.replaceChildren(table);
  } catch (error) {
    place.textContent = error.message;
  }
}

/* What was found */

async function change(path, content, back) {
  if (busy) return false;
  busy = true;
  try {
    state = await (await ask(path, content)).json();
    if (back) undone.push(back);
    tell(null);
    show();
    return true;
  } catch (error) {
    if (error.status === 409 && (await reload())) tell(error.message);
    else tell(error.status ? error.message : "vidtrack does not answer; nothing was saved. Is it still running?");
    return false;
  } finally {
    busy = false;
  }
}

async function reload() {
  try {
    ({ state } = await (await ask("events")).json());
    show();
    return true;
  } catch {
    return false;
  }
}

async function judge(found) {
  const one = event(), place = at, before = verdict(one) ?? null;
  if (!(await change("verdict", { number: one.number, verdict: found }, { place, number: one.number, verdict: before }))) return;
  const next = data.events.findIndex((other, k) => k > place && !verdict(other));
  await go(next < 0 ? Math.min(place + 1, data.events.length - 1) : next);
}

async function undo() {
  const last = undone.pop();
  if (!last) return;
  const done = last.place === undefined
    ? await change("missed", { number: last.missed })
    : await change("verdict", { number: last.number, verdict: last.verdict });
  if (!done) undone.push(last);
  else if (last.place !== undefined) await go(last.place);
}

function show() {
  const { all } = state, seen = data.events.filter(verdict).length;
  const of = data.sampled ? `${data.events.length} in a random sample of ${data.total}` : `${data.total}`;
  $("progress").textContent = [`${seen} of ${of} looked at`, `${all.false} false`, `${all.missed} missed`,
    ...(state.homeless ? [`${state.homeless} corrections of events that are no longer there`] : [])].join(" · ");
  const p = all.precision;
  $("precision").replaceChildren(...(p
    ? ["Precision ", element("b", percent(p.value)), ` (95 %: ${percent(p.low)} to ${percent(p.high)}), of ${all.sample} at random`]
    : ["No precision yet: the doubtful come first, which is no fair sample. --sample N draws one."]).slice(0, data.sampled || p ? 3 : 1));
  if (!p && data.sampled) $("precision").textContent = "No precision yet.";
  rows.forEach((_, place) => mark(place));
  for (const button of $("verdicts").children) button.ariaPressed = String(button.value === verdict(event()));
  $("missed").replaceChildren(...state.missed.map((one, number) => {
    const item = element("li", `${one.clock} · ${one.gate} ${one.direction}`), button = element("button", "Take back");
    button.onclick = () => change("missed", { number }).then(() => undone.splice(0, undone.length, ...undone.filter((one) => one.place !== undefined)));
    item.append(button);
    return item;
  }));
  document.querySelector("#totals tbody").replaceChildren(...state.ways.map((way) => {
    const row = document.createElement("tr");
    row.append(...[way.gate, way.direction, way.counted, way.false, way.missed, way.corrected].map((cell) => element("td", cell)));
    return row;
  }));
}

function choose(gate, direction) {
  const [gates, directions] = ["gate", "direction"].map((name) => $("miss").querySelector(`[name=${name}]`));
  gates.value = gate;
  directions.replaceChildren(...data.ways[gate].map((way) => element("option", way)));
  directions.value = direction ?? data.ways[gate][0];
}

async function noteMissed(submitted) {
  submitted.preventDefault();
  const given = new FormData(submitted.target);
  const missed = { time_s: Number(given.get("time_s")), gate: given.get("gate"), direction: given.get("direction") };
  const known = state.missed.length;
  if (await change("missed", missed)) {
    const number = state.missed.findIndex((one) => one.time_s === missed.time_s && one.gate === missed.gate && one.direction === missed.direction);
    if (state.missed.length > known) undone.push({ missed: number });
  }
}

const ACTIONS = {
  j: () => go(at + 1), arrowdown: () => go(at + 1),
  k: () => go(at - 1), arrowup: () => go(at - 1),
  arrowleft: () => step(-1), arrowright: () => step(1),
  z: undo,
  " ": () => { pause(playing); },
  m: () => { $("miss").open = true; $("miss").querySelector("[name=time_s]").focus(); },
};

function press(pressed) {
  if (pressed.ctrlKey || pressed.metaKey || pressed.altKey || pressed.target.matches("input, select")) return;
  if (pressed.target.matches("button, summary") && [" ", "Enter"].includes(pressed.key)) return;
  const action = ACTIONS[pressed.key.toLowerCase()];
  if (!action) return;
  pressed.preventDefault();
  action();
}

async function begin() {
  try {
    data = await (await ask("events")).json();
  } catch (error) {
    tell(error.status ? error.message : "vidtrack does not answer. Is it still running?");
    return;
  }
  ({ state } = data);
  document.title = `Review ${data.name}`;
  $("name").textContent = data.name;
  $("zone").textContent = `Times: ${data.zone}`;
  const classes = data.events.some((one) => one.kind !== null);
  const keys = Object.entries(KEYS).filter(([found]) => classes || found !== "wrong class");
  $("verdicts").append(...keys.map(([found, key]) => {
    const button = element("button", found[0].toUpperCase() + found.slice(1));
    button.type = "button";
    button.value = found;
    button.append(element("kbd", key.toUpperCase()));
    button.onclick = () => judge(found);
    ACTIONS[key] = button.onclick;
    return button;
  }));
  for (const button of document.querySelectorAll("#moves button")) button.onclick = () => ACTIONS[button.dataset.key]();
  const gates = $("miss").querySelector("[name=gate]");
  gates.append(...Object.keys(data.ways).map((gate) => element("option", gate)));
  gates.onchange = () => choose(gates.value);
  $("miss").querySelector("form").onsubmit = noteMissed;
  $("decisions").ontoggle = () => $("decisions").open && log();
  addEventListener("keydown", press);
  document.body.classList.toggle("no-pictures", Boolean(data.no_clips));
  if (data.no_clips) noClip(data.no_clips);
  document.querySelector("main").hidden = false;
  addRows(SHOWN);
  show();
  pause(!playing);
  play();
  const first = data.events.findIndex((one) => !verdict(one));
  await go(Math.max(first, 0));
}

begin();
