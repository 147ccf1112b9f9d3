/* The page: joins the drawing, the panes, the tools, the panel and vidtrack. */

import { distance, metresOf, metresOfPlan } from "./geometry.js";
import { Pane } from "./pane.js";
import { Panel } from "./panel.js";
import * as server from "./server.js";
import { render } from "./shapes.js";
import { Store, fromTree, straightRoad, toTree } from "./store.js";
import { Tools } from "./tools.js";

const HERE_MS = 2000;
const EDITOR = crypto.randomUUID();
const KEYS = [
  ["V G Z P", "select, draw a gate, a zone, a calibration point"],
  ["Enter", "end the line or the zone"],
  ["Backspace", "take the last corner back"],
  ["Esc", "stop drawing; let go"],
  ["← ↑ → ↓", "move what is chosen by 1 px, with Shift by 10; while drawing: move the aim by 10 px of the screen, with Shift by 1 px"],
  ["Space", "set a corner or a point at the aim"],
  [". ,", "next and last corner of what is chosen"],
  ["Del", "delete the chosen corner, else the whole"],
  ["Shift", "while drawing: level, upright or 45°"],
  ["Alt", "while drawing: no snapping"],
  ["Ctrl+Z", "undo; with Shift, or Ctrl+Y: redo"],
  ["Ctrl+S", "save"],
  ["+ - 0", "zoom in, zoom out, the whole picture"],
  ["T M L", "paths, grid of metres, plan: on and off"],
];

const $ = (selector) => document.querySelector(selector);
const layers = { paths: true, grid: true, plan: true };
const banners = new Map();
let opened = null; // what vidtrack said of the run and the file
let digest = "";
let found = null; // what vidtrack said of the drawing, as it was when last asked
let saving = false;

const store = new Store(changed);
const handlers = Object.fromEntries(["down", "move", "up", "cancel", "leave", "click"].map((name) => [name, (...given) => tools[name](...given)]));
const panes = { scene: new Pane($("#scene"), handlers), plan: new Pane($("#plan"), handlers) };
const tools = new Tools(store, panes, changed);
const panel = new Panel($("#panel"), store, tools);
tools.say = (words) => banner("said", words, "doubt", 6000);

/* Asking vidtrack: one question at a time, and always the newest. */

class Asker {
  constructor(ask) {
    this.ask = ask;
    this.busy = false;
    this.next = null;
  }

  async put(question) {
    this.next = question;
    if (this.busy) return;
    this.busy = true;
    while (this.next !== null) {
      const now = this.next;
      this.next = null;
      try {
        await this.ask(now);
        banner("answer", null);
      } catch (error) {
        complain("answer", error);
      }
    }
    this.busy = false;
    changed();
  }
}

let asked = "";
const looking = new Asker(async ({ tree, count }) => {
  const answer = await server.look(tree, count);
  found = answer.tally || count ? answer : { ...answer, tally: found?.tally };
  changed();
});
let laidOn = "";
const pathing = new Asker(async (tree) => panes.scene.setPaths(await server.paths(tree)));

/* Ask for what has changed: counts with every change of gates, paths when the road is another one. */
function look() {
  const tree = toTree(store.now);
  const count = !tools.movesPoint;
  const question = JSON.stringify([tree, count]);
  if (question !== asked) {
    asked = question;
    banner("save", null);
    looking.put({ tree, count });
  }
  const road = JSON.stringify(tree.calibration ?? null);
  if (count && road !== laidOn) {
    laidOn = road;
    pathing.put(tree);
  }
}

/* Showing. */

let waiting = false;
function changed() {
  if (waiting) return;
  waiting = true;
  requestAnimationFrame(() => {
    waiting = false;
    if (store.now) show();
  });
}

function show() {
  forgetSelection();
  look();
  const faults = [...panel.localFaults(), ...(found?.faults ?? [])];
  const shown = {
    selection: tools.selection,
    calibration: found?.calibration,
    tally: found?.tally,
    grid: layers.grid,
    faulty: (part, name) => faults.some(({ key }) => key[0] === part && key[1] === name),
  };
  const of = (pane) => ({
    aim: tools.aim?.pane === pane ? tools.aim.at : null,
    snap: pane === panes.scene ? tools.snap : null,
  });
  render(panes.scene, store.now, { ...shown, ...of(panes.scene), started: tools.started });
  const scale = { kind: "pair", points: tools.scale, end: null, closed: false };
  render(panes.plan, store.now, { ...shown, ...of(panes.plan), plan: true, started: tools.scale.length ? scale : null });
  panel.render(found);
  showButtons(faults);
  showPlace();
}

/* After an undo, what was chosen may not be there. */
function forgetSelection() {
  const { selection, drag } = tools;
  if (!selection || drag) return;
  const there = selection.part === "pairs" ? store.now.pairs[selection.name] : store.now.tree[selection.part]?.[selection.name];
  if (!there) tools.selection = null;
  else if (selection.vertex !== null && selection.vertex >= (there.line ?? there.polygon ?? []).length) selection.vertex = null;
}

function showButtons(faults) {
  $("#undo").disabled = !store.past.length;
  $("#redo").disabled = !store.future.length;
  const state = $("#state");
  const { unsaved } = store;
  const asking = looking.busy ? "counting" : "";
  $("#save").disabled = saving || !unsaved || faults.length > 0;
  $("#save").title = faults.length && unsaved ? "Mend what is listed at the right first" : "Save (Ctrl+S)";
  const words = saving ? "saving" : unsaved ? (faults.length ? "not saved: to be mended first" : "not saved") : opened.digest || digest ? "saved" : "new";
  state.textContent = [asking, words].filter(Boolean).join(" · ");
  state.className = unsaved ? "unsaved" : words === "saved" ? "good" : "";
  state.dataset.busy = String(looking.busy || pathing.busy || saving);
  document.title = `${unsaved ? "• " : ""}${store.now.tree.site.name} – vidtrack site`;
  $("#title").textContent = store.now.tree.site.name;
  for (const button of document.querySelectorAll("[data-tool]")) button.setAttribute("aria-pressed", String(button.dataset.tool === tools.tool));
  for (const button of document.querySelectorAll("[data-layer]")) button.setAttribute("aria-pressed", String(layers[button.dataset.layer]));
  const asks = tools.scale.length === 2;
  if (asks && $("#scale").hidden) setTimeout(() => $("#scale input").focus());
  $("#scale").hidden = !asks;
}

function showPlace() {
  $("#hint").textContent = tools.hint;
  const { place } = tools;
  if (!place) return ($("#place").textContent = "");
  const metres = place.pane === panes.plan
    ? store.now.world && metresOfPlan(store.now.world, place.at)
    : metresOf(found?.calibration?.metres, place.at);
  const pixels = `${place.at[0].toFixed(0)}, ${place.at[1].toFixed(0)} px`;
  $("#place").textContent = metres ? `${pixels} · ${metres[0].toFixed(2)} m east, ${metres[1].toFixed(2)} m north` : pixels;
}

/* A line at the top; words null: none. */
function banner(key, words, kind = "doubt", ms = null, ...buttons) {
  const there = banners.get(key);
  if (there?.dataset.words === words) return;
  there?.remove();
  banners.delete(key);
  if (!words) return;
  const line = document.createElement("div");
  line.className = kind;
  line.dataset.words = words;
  const text = document.createElement("span");
  text.textContent = words;
  line.append(text);
  for (const [name, act] of buttons) {
    const button = document.createElement("button");
    button.textContent = name;
    button.addEventListener("click", act);
    line.append(button);
  }
  banners.set(key, line);
  $("#banners").append(line);
  if (ms) setTimeout(() => banners.get(key) === line && banner(key, null), ms);
}

function complain(key, error) {
  if (error.status) banner(key, error.message, "bad");
  else banner("gone", `${error.message} What you draw stays in this window.`, "bad");
}

function fileChanged(words) {
  banner("changed", words, "bad", null, ["Reload the file (undo brings this drawing back)", reload]);
}

/* The file and vidtrack. */

async function save() {
  if (saving || !store.unsaved) return;
  const lacking = panel.localFaults(); // vidtrack finds all others
  if (lacking.length) return tools.say(lacking[0].words);
  saving = true;
  const what = store.now;
  changed();
  try {
    const world = JSON.stringify(what.world) === JSON.stringify(opened.plan?.world ?? null) ? null : what.world;
    ({ digest } = await server.save(toTree(what), digest, world));
    if (opened.plan && world) opened.plan.world = world;
    store.saved = structuredClone(what);
    for (const key of ["save", "changed"]) banner(key, null);
  } catch (error) {
    if (error.status === 409) fileChanged(error.message);
    else complain("save", error);
  }
  saving = false;
  changed();
}

async function reload() {
  try {
    const drawing = await server.drawing();
    digest = drawing.digest;
    store.edit((now) => Object.assign(now, fromTree(drawing.tree, drawing.plan?.world ?? now.world)));
    store.markSaved();
    for (const key of ["save", "changed"]) banner(key, null);
  } catch (error) {
    complain("save", error);
  }
}

async function here() {
  const before = digest;
  try {
    const answer = await server.here(EDITOR, true);
    for (const key of ["gone", "here"]) banner(key, null);
    if (answer.digest !== digest && before === digest && !saving) fileChanged(`${opened.file} was ${answer.digest ? "changed" : "deleted"} by somebody else since it was opened here.`);
    if (answer.shown && answer.shown !== opened.shown) panes.scene.renew(await server.picture("scene"));
    opened.shown = answer.shown;
    banner("others", answer.others ? "This site is open in another window too; who saves second has to reload first." : null);
  } catch (error) {
    complain("here", error);
  }
}

/* Buttons and keys. */

function zoom(factor) {
  tools.active.zoom(factor);
}

function toggle(layer) {
  layers[layer] = !layers[layer];
  panes.scene.showPaths = layers.paths;
  showPlan();
  panes.scene.redraw();
}

function showPlan() {
  const two = Boolean(opened.plan) && layers.plan;
  $("#plan").hidden = !two;
  $("#panes").classList.toggle("two", two);
  if (!two) tools.active = panes.scene;
}

const ACTIONS = {
  v: () => tools.choose("select"),
  g: () => tools.choose("gate"),
  z: () => tools.choose("zone"),
  p: () => choosePoint(),
  "+": () => zoom(1.4),
  "=": () => zoom(1.4),
  "-": () => zoom(1 / 1.4),
  0: () => tools.active.fit(),
  t: () => toggle("paths"),
  m: () => toggle("grid"),
  l: () => opened.plan && toggle("plan"),
  "?": () => $("#keys").showModal(),
};

function choosePoint() {
  if (straightRoad(store.now.tree)) tools.say("this site is calibrated by a straight road; take that section out of its file to use points");
  else if (store.now.tree.calibration?.geographic) {
    tools.choose("point");
    tools.say("the ground points of this site are longitude and latitude: type them at the right");
  } else tools.choose("point");
}

function command(event) {
  const key = event.key.toLowerCase();
  if (key === "s") save();
  else if (key === "z" && !event.shiftKey) tools.started ? tools.back() : store.undo();
  else if ((key === "z" && event.shiftKey) || key === "y") store.redo();
  else return false;
  return true;
}

document.addEventListener("keydown", (event) => {
  if (!store.now || $("#keys").open) return;
  const typing = event.target.matches?.("input, select, textarea");
  if (event.ctrlKey || event.metaKey) {
    const text = typing && event.target.matches("input");
    if (text && event.key.toLowerCase() !== "s") return;
    if (text) event.target.blur(); // what is typed counts
    if (command(event)) event.preventDefault();
    return;
  }
  if (typing) {
    if (event.key === "Escape" && event.target.matches("input")) event.target.value = event.target.defaultValue;
    if (event.key === "Escape" || (event.key === "Enter" && !event.target.form)) $("#scene").focus();
    return;
  }
  const pressing = event.target.matches?.("button") && (event.key === " " || event.key === "Enter");
  if (pressing || event.altKey) return;
  if (tools.key(event)) event.preventDefault();
  else ACTIONS[event.key.toLowerCase()]?.();
});

for (const button of document.querySelectorAll("[data-tool]")) {
  const { tool } = button.dataset;
  button.addEventListener("click", () => (tool === "point" ? choosePoint() : tools.choose(tool)));
}
for (const button of document.querySelectorAll("[data-layer]")) {
  button.addEventListener("click", () => {
    toggle(button.dataset.layer);
    changed();
  });
}
for (const [id, act] of Object.entries({ undo: () => store.undo(), redo: () => store.redo(), save, in: () => zoom(1.4), out: () => zoom(1 / 1.4), whole: () => tools.active.fit(), help: () => $("#keys").showModal() })) {
  $(`#${id}`).addEventListener("click", act);
}
for (const pane of Object.values(panes)) {
  pane.onview = changed;
  pane.root.addEventListener("focus", () => (tools.active = pane));
}
$("#scale").addEventListener("submit", (event) => {
  event.preventDefault();
  const length = Number($("#scale input").value.replace(",", "."));
  if (!(length > 0)) return tools.say("write the length in metres");
  const scale = length / distance(...tools.scale);
  tools.scale = [];
  $("#plan").focus();
  store.edit((drawing) => (drawing.world = [scale, 0, 0, -scale, 0, scale * (panes.plan.size[1] - 1)]));
});
window.addEventListener("pagehide", () => server.here(EDITOR, false).catch(() => {}));
window.addEventListener("beforeunload", (event) => {
  if (store.now && store.unsaved) event.preventDefault();
});

/* The beginning. */

async function open() {
  $("#keys table").replaceChildren(...KEYS.map(([key, words]) => {
    const row = document.createElement("tr");
    row.append(document.createElement("td"), document.createElement("td"));
    for (const one of key.split(" ")) {
      const box = document.createElement("kbd");
      box.textContent = one;
      row.firstChild.append(box, " ");
    }
    row.lastChild.textContent = words;
    return row;
  }));
  try {
    opened = await server.drawing();
    digest = opened.digest;
    const { width, height } = opened.tree.site;
    $("#file").textContent = opened.file;
    $("#file").title = opened.file;
    panes.scene.setPicture(opened.scene ? await server.picture("scene") : null, width, height);
    if (opened.plan) {
      const plan = await server.picture("plan");
      $('[data-layer="plan"]').hidden = false;
      showPlan();
      panes.plan.setPicture(plan, plan.width, plan.height);
    }
    store.open(fromTree(opened.tree, opened.plan?.world ?? null));
    if (opened.until_s) tools.say(`This run is long: only its first ${(opened.until_s / 60).toFixed(0)} min are shown and counted here.`);
    here();
    setInterval(here, HERE_MS);
  } catch (error) {
    $("#state").textContent = error.message;
    $("#state").className = "unsaved";
  }
}

open();
