/* Drawing and moving with the mouse, the finger and the keyboard. */

import { distance, metresOfPlan, planOfMetres, rounded, snapped, squared } from "./geometry.js";

const REACH_PX = 9;
const HINTS = {
  select: "Drag a line or a corner; drag a small dot to add a corner. Drag beside it to move the picture, wheel to zoom.",
  gate: "Drag across the lane; or click corner by corner, and Enter. Shift: level, upright or 45°; Alt: no snapping.",
  zone: "Click the corners; Enter or the first corner ends.",
  point: "Click a marking on the road, then the same place on the plan, or type its metres at the right.",
  scale: "Click two points on the plan that are a known length apart.",
};

export class Tools {
  /* store: the drawing; panes: {scene, plan}; redraw(): shows all anew. */
  constructor(store, panes, redraw) {
    this.store = store;
    this.panes = panes;
    this.redraw = redraw;
    this.tool = "select";
    this.selection = null;
    this.started = null; // {kind, points, end, closed}
    this.snap = null;
    this.aim = null; // {pane, at}
    this.drag = null;
    this.scale = []; // two points on the plan
    this.active = panes.scene;
    this.place = null;
  }

  get hint() {
    if (this.tool === "point" && this.active === this.panes.plan && !this.store.now.world) return HINTS.scale;
    return HINTS[this.tool];
  }

  /* A point of the calibration is being moved. */
  get movesPoint() {
    return this.drag?.part === "pairs";
  }

  choose(tool) {
    this.cancel();
    this.tool = tool;
    for (const pane of Object.values(this.panes)) pane.root.classList.toggle("drawing", tool !== "select");
    this.redraw();
  }

  select(part, name, vertex = null) {
    this.selection = part === null ? null : { part, name, vertex };
    this.redraw();
  }

  cancel() {
    if (this.drag) this.store.cancel();
    this.drag = this.started = this.snap = this.aim = null;
    this.redraw();
  }

  /* Pointer. */

  down(pane, point, event) {
    this.active = pane;
    this.aim = null;
    const held = event.target.closest?.("[data-part]");
    if (this.tool === "point") return this.#pointDown(pane, point, held);
    if (this.tool === "gate" || this.tool === "zone") return pane === this.panes.scene && this.#drawDown(pane, point, event);
    if (!held) return false;
    const { part, name } = held.dataset;
    this.#take(pane, part, part === "pairs" ? Number(name) : name, point, event.target.dataset);
    return true;
  }

  move(pane, point, event) {
    this.place = { pane, at: point };
    if (this.drag) this.#dragTo(pane, point, event);
    else if (this.started && pane === this.panes.scene) {
      const from = this.started.points[this.started.points.length - 1];
      this.started.end = this.#snapped(pane, point, event, from, null);
    } else if (this.tool === "gate" || this.tool === "zone") this.#snapped(pane, point, event, null, null);
    this.redraw();
  }

  up(pane, point, event) {
    if (this.drag) {
      this.store.end();
      this.drag = null;
    } else if (this.started?.kind !== "zone" && this.started?.points.length === 1 && pane.moved) {
      this.add(this.#snapped(pane, point, event, this.started.points[0], null));
      this.finish();
    }
    this.snap = null;
    this.redraw();
  }

  leave() {
    this.place = null;
    if (!this.drag) this.snap = null;
    this.redraw();
  }

  click() {
    this.select(null);
  }

  /* Drawing. */

  #drawDown(pane, point, event) {
    const points = this.started?.points ?? [];
    const last = points[points.length - 1];
    const at = this.#snapped(pane, point, event, last ?? null, null);
    const near = (other) => distance(pane.screen(other), pane.screen(point)) < REACH_PX;
    const closes = this.tool === "zone" && points.length > 2 && near(points[0]);
    if (closes || (points.length > 1 && near(last))) this.finish();
    else if (!last || !near(last)) this.add(at);
    return true;
  }

  add(point) {
    const kind = this.tool === "zone" ? "zone" : "neutral";
    this.started ??= { kind, points: [], end: null, closed: this.tool === "zone" };
    this.started.points.push(point);
    this.started.end = null;
    this.redraw();
  }

  finish() {
    const points = this.started?.points ?? [];
    const [part, key, least, word] = this.tool === "zone" ? ["zones", "polygon", 3, "zone"] : ["gates", "line", 2, "gate"];
    if (points.length < least) return;
    this.started = this.snap = null;
    let name = "";
    this.store.edit((drawing) => {
      drawing.tree[part] ??= {};
      let number = 1;
      while (`${word} ${number}` in drawing.tree[part]) number += 1;
      name = `${word} ${number}`;
      drawing.tree[part][name] = { [key]: points };
    });
    this.select(part, name);
  }

  #pointDown(pane, point, held) {
    if (held?.dataset.part === "pairs") {
      this.#take(pane, "pairs", Number(held.dataset.name), point, {});
      return true;
    }
    const onPlan = pane === this.panes.plan;
    if (onPlan && !this.store.now.world) {
      this.scale = this.scale.length === 2 ? [point] : [...this.scale, point];
      this.redraw();
      return true;
    }
    this.pair(pane, pane.inside(point));
    this.#take(pane, "pairs", this.selection.name, point, {});
    return true;
  }

  /* A calibration point in one of the panes: of the pair that waits for it, or of a new one. */
  pair(pane, point) {
    const key = pane === this.panes.plan ? "ground" : "picture";
    const value = this.#pairValue(pane, point);
    const { pairs } = this.store.now;
    const chosen = this.selection?.part === "pairs" ? this.selection.name : -1;
    const waiting = pairs[chosen] && !pairs[chosen][key] ? chosen : pairs.findIndex((pair) => !pair[key]);
    const number = waiting >= 0 ? waiting : pairs.length;
    this.store.edit((drawing) => {
      drawing.pairs[number] ??= { picture: null, ground: null };
      drawing.pairs[number][key] = value;
    });
    this.select("pairs", number);
  }

  #pairValue(pane, point) {
    return pane === this.panes.plan ? rounded(metresOfPlan(this.store.now.world, point), 3) : rounded(point);
  }

  /* Moving. */

  #take(pane, part, name, point, { vertex, between: gap }) {
    vertex = vertex === undefined ? null : Number(vertex);
    this.store.begin();
    this.drag = { part, name, vertex, gap: gap === undefined ? null : Number(gap), from: point };
    this.select(part, name, gap === undefined ? vertex : Number(gap) + 1);
  }

  #dragTo(pane, point, event) {
    if (!pane.moved && event.pointerType) return; // a click only selects
    const { part, name, vertex, gap, from } = this.drag;
    if (part === "pairs") {
      const key = pane === this.panes.plan ? "ground" : "picture";
      this.store.during((drawing) => (drawing.pairs[name][key] = this.#pairValue(pane, pane.inside(point))));
      return;
    }
    const key = part === "gates" ? "line" : "polygon";
    const before = this.store.before.tree[part][name][key];
    if (vertex === null && gap === null) {
      const step = this.#step(pane, before, [point[0] - from[0], point[1] - from[1]]);
      this.store.during((drawing) => {
        drawing.tree[part][name][key] = before.map((corner) => rounded([corner[0] + step[0], corner[1] + step[1]]));
      });
      return;
    }
    const corner = gap === null ? vertex : gap + 1;
    const neighbour = before[gap === null ? (corner > 0 ? corner - 1 : 1) : gap];
    const at = this.#snapped(pane, point, event, neighbour, { part, name });
    this.store.during((drawing) => drawing.tree[part][name][key].splice(corner, gap === null ? 1 : 0, at));
  }

  /* A step that keeps a shape inside the picture. */
  #step(pane, points, step) {
    return step.map((way, axis) => {
      const values = points.map((point) => point[axis]);
      return Math.min(Math.max(way, -Math.min(...values)), pane.size[axis] - 1 - Math.max(...values));
    });
  }

  #snapped(pane, point, event, from, own) {
    this.snap = null;
    point = pane.inside(point);
    if (event.shiftKey && from) return rounded(pane.inside(squared(from, point)));
    if (event.altKey) return rounded(point);
    const { gates = {}, zones = {} } = this.store.now.tree;
    const other = (part) => ([name]) => own?.part !== part || own.name !== name;
    const lines = [
      ...Object.entries(gates).filter(other("gates")).map(([, gate]) => ({ points: gate.line, closed: false })),
      ...Object.entries(zones).filter(other("zones")).map(([, zone]) => ({ points: zone.polygon, closed: true })),
    ];
    const found = snapped(point, lines, pane.size, REACH_PX / pane.view.k);
    if (found) this.snap = found.at;
    return rounded(found ? found.at : point);
  }

  /* Keyboard. */

  key(event) {
    const { key } = event;
    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    if (steps[key]) this.#arrow(steps[key], event.shiftKey);
    else if (key === "Enter" && this.started) this.finish();
    else if (key === " " && this.aim) this.#placeAim();
    else if (key === "Escape" && (this.started || this.drag)) this.cancel();
    else if (key === "Escape" && this.tool !== "select") this.choose("select");
    else if (key === "Escape") this.select(null);
    else if (key === "Backspace" && this.started) this.back();
    else if ((key === "Delete" || key === "Backspace") && this.selection) this.remove();
    else if ((key === "." || key === ",") && this.selection) this.#nextCorner(key === "." ? 1 : -1);
    else return false;
    return true;
  }

  back() {
    this.started.points.pop();
    if (!this.started.points.length) this.started = null;
    this.redraw();
  }

  #arrow(step, large) {
    if (this.tool !== "select") {
      const pane = this.active;
      const middle = pane.point([pane.root.clientWidth / 2, pane.root.clientHeight / 2]);
      const from = this.aim?.pane === pane ? this.aim.at : this.place?.pane === pane ? this.place.at : middle;
      const length = large ? 1 : 10 / pane.view.k;
      this.aim = { pane, at: pane.inside([from[0] + length * step[0], from[1] + length * step[1]]) };
      this.place = this.aim;
      if (this.started) this.started.end = rounded(this.aim.at);
      this.redraw();
    } else if (this.selection) this.#nudge(step, large ? 10 : 1);
    else this.active.pan(-40 * step[0], -40 * step[1]);
  }

  #placeAim() {
    const { pane, at } = this.aim;
    const plain = { target: pane.root, shiftKey: false, altKey: false };
    if (this.tool === "point") {
      this.#pointDown(pane, at, null);
      if (this.drag) {
        this.store.end();
        this.drag = null;
      }
    } else if (pane === this.panes.scene) this.#drawDown(pane, at, plain);
    this.redraw();
  }

  #nudge([dx, dy], length) {
    const { part, name, vertex } = this.selection;
    this.store.edit((drawing) => {
      if (part === "pairs") {
        const pane = this.active;
        const key = pane === this.panes.plan ? "ground" : "picture";
        const pair = drawing.pairs[name];
        if (!pair?.[key]) return;
        const at = key === "ground" ? planOfMetres(drawing.world, pair.ground) : pair.picture;
        pair[key] = this.#pairValue(pane, pane.inside([at[0] + length * dx, at[1] + length * dy]));
        return;
      }
      const points = drawing.tree[part][name][part === "gates" ? "line" : "polygon"];
      const moved = vertex === null ? points.map((_, k) => k) : [vertex];
      const chosen = moved.map((k) => points[k]);
      const step = this.#step(this.panes.scene, chosen, [length * dx, length * dy]);
      for (const k of moved) points[k] = rounded([points[k][0] + step[0], points[k][1] + step[1]]);
    }, `nudge ${part} ${name} ${vertex}`);
  }

  #nextCorner(step) {
    const { part, name, vertex } = this.selection;
    if (part === "pairs") {
      const count = this.store.now.pairs.length;
      return this.select(part, (name + step + count) % count);
    }
    const count = this.store.now.tree[part][name][part === "gates" ? "line" : "polygon"].length;
    return this.select(part, name, vertex === null ? (step > 0 ? 0 : count - 1) : (vertex + step + count) % count);
  }

  /* The chosen corner, where the shape can do without it, else the whole. */
  remove() {
    const { part, name, vertex } = this.selection;
    const key = part === "gates" ? "line" : "polygon";
    const corner = part !== "pairs" && vertex !== null && this.store.now.tree[part][name][key].length > (part === "gates" ? 2 : 3);
    this.store.edit((drawing) => {
      if (part === "pairs") drawing.pairs.splice(name, 1);
      else if (corner) drawing.tree[part][name][key].splice(vertex, 1);
      else {
        delete drawing.tree[part][name];
        if (part === "gates") forgetGate(drawing.tree);
      }
    });
    this.select(...(corner ? [part, name] : [null]));
  }
}

export const legsOf = (tree) => [...new Set(Object.entries(tree.gates ?? {}).map(([name, gate]) => gate.leg || name))];

/* Without what named a gate or a leg that is gone. */
export function forgetGate(tree) {
  const legs = legsOf(tree);
  for (const [name, section] of Object.entries(tree.sections ?? {}))
    if (![section.from, section.to].every((gate) => Object.hasOwn(tree.gates ?? {}, gate))) delete tree.sections[name];
  if (tree.movements?.allowed)
    tree.movements.allowed = tree.movements.allowed.filter((pair) => pair.every((leg) => legs.includes(leg)));
}
