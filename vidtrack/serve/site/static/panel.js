/* The lists and forms beside the picture. Everything that the user or vidtrack wrote goes in as text, never as markup. */

import { distance, metresOf, middle } from "./geometry.js";
import { straightRoad } from "./store.js";
import { forgetGate, legsOf } from "./tools.js";

const ROLES = ["entry", "exit", "both", "neutral"];
const ARROWS = { up: "↑", down: "↓", left: "←", right: "→" };

function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (name === "key") made.dataset.key = value; // by which it gets the focus back when it is drawn anew
    else if (value === true) made.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) made.setAttribute(name, value);
  }
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}

/* A number that was typed, with a point or a comma; null for none. */
function number(text) {
  const value = Number(text.trim().replace(",", "."));
  return text.trim() !== "" && Number.isFinite(value) ? value : null;
}

const renamed = (part, old, name) => Object.fromEntries(Object.entries(part).map(([key, value]) => [key === old ? name : key, value]));

export class Panel {
  constructor(root, store, tools) {
    this.root = root;
    this.store = store;
    this.tools = tools;
    this.drawn = {};
    root.querySelector("#sections .add").addEventListener("click", () => this.#addSection());
  }

  render(found) {
    this.found = found;
    const { tree } = this.store.now;
    const { selection } = this.tools;
    const chosen = (part) => (selection?.part === part ? selection.name : null);
    const tally = found?.tally;
    this.#list("faults", [...this.localFaults(), ...(found?.faults ?? [])].map((fault) => ({ ...fault, text: fault.words })));
    this.#list("warnings", (found?.warnings ?? []).map((text) => ({ key: [], text })));
    this.#part("gates", [tree.gates, chosen("gates"), tally?.counts, found?.calibration?.metres], () => this.#gates());
    this.#part("zones", [tree.zones, chosen("zones"), tally?.stays], () => this.#zones());
    this.#part("movements", [tree.gates, tree.movements, tally?.movements, tally?.trips], () => this.#movements());
    this.#part("points", [this.store.now.pairs, tree.calibration, chosen("pairs"), found?.calibration], () => this.#points());
    this.#part("sections", [tree.sections, Object.keys(tree.gates ?? {})], () => this.#sections());
    this.#part("site", [tree.site, tree.report], () => this.#site());
  }

  /* What keeps the drawing from being saved and only this page knows. */
  localFaults() {
    const lacking = (key, one, several, todo) => {
      const numbers = this.store.now.pairs.flatMap((pair, k) => (pair[key] ? [] : [k + 1]));
      if (!numbers.length) return [];
      const who = numbers.length === 1 ? `point ${numbers[0]} ${one}` : `points ${numbers.join(", ")} ${several}`;
      return [{ key: ["calibration"], words: `${who} ${todo}` }];
    };
    return [
      ...lacking("ground", "has", "have", "no metres: click the place on the plan, or type them"),
      ...lacking("picture", "has", "have", "no place in the picture: press P and click it"),
    ];
  }

  #list(id, items) {
    const section = this.root.querySelector(`#${id}`);
    this.#part(id, items, () => {
      section.hidden = items.length === 0;
      section.querySelector("ul").replaceChildren(...items.map((item) => element("li", {}, item.text)));
    });
  }

  /* Draw a section anew if what it shows is new; who types there goes on typing. */
  #part(id, values, draw) {
    const now = JSON.stringify(values);
    if (this.drawn[id] === now) return;
    this.drawn[id] = now;
    const active = document.activeElement;
    const key = this.root.querySelector(`#${id}`).contains(active) ? active.dataset?.key : null;
    const typed = active instanceof HTMLInputElement && active.value !== active.defaultValue ? active.value : null;
    const caret = active instanceof HTMLInputElement ? [active.selectionStart, active.selectionEnd] : null;
    draw();
    if (!key) return;
    const again = [...this.root.querySelectorAll("[data-key]")].find((one) => one.dataset.key === key);
    if (!again) return;
    again.focus({ preventScroll: true });
    if (typed !== null) again.value = typed;
    if (caret && again instanceof HTMLInputElement && again.type === "text") again.setSelectionRange(...caret);
  }

  /* An input that changes the drawing when it is left or Enter is pressed. */
  #input(key, value, change, attributes = {}) {
    const input = element("input", { key, type: "text", value: value ?? "", autocomplete: "off", spellcheck: "false", ...attributes });
    input.addEventListener("change", () => {
      input.defaultValue = input.value;
      change(input.value.trim(), input);
    });
    return input;
  }

  #choice(key, value, options, change) {
    const select = element("select", { key }, ...options.map((one) => element("option", { value: one, selected: one === value }, one)));
    select.addEventListener("change", () => change(select.value));
    return select;
  }

  #number(key, value, change, attributes = {}) {
    return this.#input(key, value, (text, input) => {
      const typed = number(text);
      input.classList.toggle("bad", typed === null);
      if (typed !== null) change(typed);
    }, { inputmode: "decimal", ...attributes });
  }

  #row(part, name, kind, counts, more = null) {
    const chosen = this.tools.selection?.part === part && this.tools.selection.name === name;
    const row = element(
      "button", { key: `${part} ${name}`, class: "row", "aria-expanded": String(chosen), onclick: () => this.tools.select(...(chosen ? [null] : [part, name])) },
      element("span", { class: `swatch ${kind}` }), element("span", { class: "name" }, name),
      more && element("span", { class: "leg" }, more), element("span", { class: "counts" }, counts),
    );
    return [chosen, row];
  }

  #rename(part, old, name, follow = () => {}) {
    if (name === old) return;
    if (Object.hasOwn(this.store.now.tree[part] ?? {}, name)) return this.tools.say(`there is a ${part.slice(0, -1)} ${name} already`);
    this.store.edit((drawing) => {
      drawing.tree[part] = renamed(drawing.tree[part], old, name);
      follow(drawing.tree);
    });
    this.tools.select(part, name);
  }

  #gates() {
    const { tree } = this.store.now;
    const rows = Object.entries(tree.gates ?? {}).map(([name, gate]) => {
      const counts = Object.entries(this.found?.tally?.counts[name] ?? {}).map(([way, count]) => `${ARROWS[way]} ${count}`);
      const role = gate.role ?? "neutral";
      const [chosen, row] = this.#row("gates", name, role, counts.join("  "), gate.leg);
      return element("li", {}, row, chosen ? this.#gateForm(name, gate, role) : null);
    });
    this.root.querySelector("#gates ol").replaceChildren(...rows);
  }

  #gateForm(name, gate, role) {
    const edit = (change) => this.store.edit((drawing) => this.#withLegs(drawing.tree, () => change(drawing.tree.gates[name])));
    const legs = element("datalist", { id: "legs" }, ...legsOf(this.store.now.tree).map((leg) => element("option", { value: leg })));
    const rename = (text) => this.#rename("gates", name, text, (tree) => {
      for (const section of Object.values(tree.sections ?? {}))
        for (const end of ["from", "to"]) if (section[end] === name) section[end] = text;
      if (!gate.leg) this.#legRenamed(tree, name, text);
    });
    const setLeg = (leg) => edit((one) => (leg ? (one.leg = leg) : delete one.leg));
    const setRole = (chosen) => edit((one) => (chosen === "neutral" && !("role" in one) ? null : (one.role = chosen)));
    return element(
      "div", { class: "form" },
      element("label", {}, "Name"), this.#input(`gate name ${name}`, name, rename, { id: "gate-name" }),
      element("label", {}, "Role"), this.#choice(`gate role ${name}`, role, ROLES, setRole),
      element("label", {}, "Leg"), this.#input(`gate leg ${name}`, gate.leg, setLeg, { list: "legs", placeholder: "arm of the junction", id: "gate-leg" }), legs,
      element("div", { class: "wide" }, this.#length(gate.line), this.#delete()),
    );
  }

  #length(line) {
    const metres = line.map((point) => metresOf(this.found?.calibration?.metres, point));
    if (metres.some((point) => !point)) return `${line.length} corners`;
    const length = metres.slice(1).reduce((sum, point, k) => sum + distance(metres[k], point), 0);
    return `${line.length} corners, ${length.toFixed(1)} m long`;
  }

  #delete() {
    return element("button", { key: "delete", class: "delete", title: "Delete (Del)", onclick: () => this.tools.remove() }, "Delete");
  }

  /* Change a gate, and let movements follow a leg that has got another name. */
  #withLegs(tree, change) {
    const before = legsOf(tree);
    change();
    const after = legsOf(tree);
    const gone = before.filter((leg) => !after.includes(leg));
    const come = after.filter((leg) => !before.includes(leg));
    if (gone.length === 1 && come.length === 1) this.#legRenamed(tree, gone[0], come[0]);
    else forgetGate(tree);
  }

  #legRenamed(tree, old, name) {
    if (tree.movements?.allowed)
      tree.movements.allowed = tree.movements.allowed.map((pair) => pair.map((leg) => (leg === old ? name : leg)));
  }

  #zones() {
    const rows = Object.entries(this.store.now.tree.zones ?? {}).map(([name, zone]) => {
      const masks = zone.tracked === false;
      const stays = masks ? undefined : this.found?.tally?.stays[name];
      const [chosen, row] = this.#row("zones", name, masks ? "mask" : "zone", stays === undefined ? "" : `${stays} stays`, masks ? "mask" : null);
      const use = (chosen) => this.store.edit((drawing) => (chosen === "mask" ? (drawing.tree.zones[name].tracked = false) : delete drawing.tree.zones[name].tracked));
      const form = () => element(
        "div", { class: "form" },
        element("label", {}, "Name"), this.#input(`zone name ${name}`, name, (text) => this.#rename("zones", name, text)),
        element("label", {}, "Use"), this.#choice(`zone use ${name}`, masks ? "mask" : "zone", ["zone", "mask"], use),
        element("div", { class: "wide" }, "", this.#delete()),
      );
      return element("li", {}, row, chosen ? form() : null);
    });
    this.root.querySelector("#zones ol").replaceChildren(...rows);
  }

  /* Whole trips from leg to leg; a cell that is pressed is a movement that there is. */
  #movements() {
    const { tree } = this.store.now;
    const section = this.root.querySelector("#movements");
    const having = (...roles) => [...new Set(Object.entries(tree.gates ?? {})
      .filter(([, gate]) => roles.includes(gate.role)).map(([name, gate]) => gate.leg || name))];
    const [from, to] = [having("entry", "both"), having("exit", "both")];
    section.hidden = !from.length || !to.length;
    if (section.hidden) return;
    const allowed = tree.movements?.allowed ?? [];
    const isAllowed = (a, b) => allowed.some(([x, y]) => x === a && y === b);
    const trips = this.found?.tally?.movements ?? [];
    const cell = (a, b) => {
      const count = trips.find(([x, y]) => x === a && y === b)?.[2] ?? 0;
      const button = element("button", {
        key: `movement ${JSON.stringify([a, b])}`,
        "aria-pressed": String(isAllowed(a, b)), title: `${a} to ${b}`,
        class: count && allowed.length && !isAllowed(a, b) ? "impossible" : null,
        onclick: () => this.store.edit((drawing) => {
          const others = allowed.filter(([x, y]) => x !== a || y !== b);
          drawing.tree.movements = { ...drawing.tree.movements, allowed: isAllowed(a, b) ? others : [...allowed, [a, b]] };
        }),
      }, this.found?.tally ? String(count) : "");
      return element("td", {}, button);
    };
    section.querySelector(".scroll").replaceChildren(element(
      "table", {},
      element("thead", {}, element("tr", {}, element("th", {}, "from \\ to"), ...to.map((leg) => element("th", { title: leg }, leg)))),
      element("tbody", {}, ...from.map((a) => element("tr", {}, element("th", { title: a }, a), ...to.map((b) => cell(a, b))))),
    ));
    const whole = trips.reduce((sum, [, , count]) => sum + count, 0);
    const rule = allowed.length ? "Pressed: there is this movement; red: a trip that cannot be." : "Press the movements that there are, to have others reported.";
    section.querySelector(".note").textContent = `${whole} whole trips of ${this.found?.tally?.trips ?? 0}. ${rule}`;
  }

  #points() {
    const body = this.root.querySelector("#points .body");
    const { tree, pairs } = this.store.now;
    const calibration = this.found?.calibration;
    if (straightRoad(tree)) {
      body.replaceChildren(element("p", { class: "note" }, "Calibrated by a straight road: its segments are kept as they are, and their grid is shown."), ...this.#worth(calibration));
      return;
    }
    if (!pairs.length) {
      body.replaceChildren(element("p", { class: "empty" }, "For metres and speeds: press P and click at least 4, better 8, markings on the road that you find on a plan."));
      return;
    }
    const [east, north] = tree.calibration?.geographic ? ["longitude", "latitude"] : ["east m", "north m"];
    let whole = 0;
    const rows = pairs.map((pair, k) => {
      const number = pair.picture && pair.ground ? ++whole : null;
      const off = number && calibration?.pairs[number - 1];
      const chosen = this.tools.selection?.part === "pairs" && this.tools.selection.name === k;
      const metres = (axis) => this.#number(`pair ${k} ${axis}`, pair.ground?.[axis] ?? pair.half?.[axis], (value) => this.store.edit((drawing) => {
        const one = drawing.pairs[k];
        const ground = [...(one.ground ?? one.half ?? [null, null])];
        ground[axis] = value;
        if (ground.includes(null)) one.half = ground;
        else {
          one.ground = ground;
          delete one.half;
        }
      }), { "aria-label": `${axis ? north : east} of point ${k + 1}` });
      const choose = element("button", { key: `pair ${k}`, title: "Choose", onclick: () => this.tools.select("pairs", k) }, String(k + 1));
      const remove = element("button", { key: `delete pair ${k}`, class: "delete", title: `Delete point ${k + 1}`, onclick: () => { this.tools.select("pairs", k); this.tools.remove(); } }, "×");
      const classes = [chosen && "chosen", number && calibration?.wrong.includes(number) && "wrong"].filter(Boolean).join(" ");
      const shown = (value, digits) => element("td", {}, value === null || value === undefined ? "" : value.toFixed(digits));
      return element("tr", { class: classes }, element("td", {}, choose), element("td", {}, metres(0)), element("td", {}, metres(1)),
        shown(off?.residual_px, 1), shown(off?.residual_m, 2), element("td", {}, remove));
    });
    const head = ["", east, north, "off px", "off m", ""].map((text) => element("th", {}, text));
    body.replaceChildren(
      element("div", { class: "scroll" }, element("table", {}, element("thead", {}, element("tr", {}, ...head)), element("tbody", {}, ...rows))),
      ...this.#worth(calibration),
    );
  }

  /* What the calibration is worth, in words. */
  #worth(calibration) {
    if (!calibration) return [];
    const { camera, places, grid_m: step } = calibration;
    const [near, far] = [places[0], places[places.length - 1]];
    const lines = [`Grid of ${step} m.`];
    if (camera?.height_sigma_m)
      lines.push(`The camera is ${camera.height_m.toFixed(2)} m above the road (± ${camera.height_sigma_m.toFixed(2)} m).`);
    const span = (name, digits) => [near, far].map((place) => place[name]?.toFixed(digits) ?? "?").join(" to ");
    lines.push(`A pixel is ${span("m_per_px_away", 2)} m, near and far; speeds are off by ${span("speed_sigma_percent", 1)} % by the calibration.`);
    return lines.map((line) => element("p", { class: "note" }, line));
  }

  #sections() {
    const { tree } = this.store.now;
    const gates = Object.keys(tree.gates ?? {});
    this.root.querySelector("#sections .add").disabled = gates.length < 2;
    const rows = Object.entries(tree.sections ?? {}).map(([name, section]) => {
      const set = (key, value) => this.store.edit((drawing) => (drawing.tree.sections[name][key] = value));
      return element("li", { class: "form" },
        element("label", {}, "Name"), this.#input(`section name ${name}`, name, (text) => this.#rename("sections", name, text)),
        element("label", {}, "From"), this.#choice(`section from ${name}`, section.from, gates, (gate) => set("from", gate)),
        element("label", {}, "To"), this.#choice(`section to ${name}`, section.to, gates, (gate) => set("to", gate)),
        element("label", {}, "Length, m"), this.#number(`section length ${name}`, section.length_m || "", (value) => set("length_m", value)),
        element("div", { class: "wide" }, "", element("button", { key: `delete section ${name}`, class: "delete", onclick: () => this.store.edit((drawing) => delete drawing.tree.sections[name]) }, "Delete")));
    });
    this.root.querySelector("#sections ol").replaceChildren(...rows);
  }

  /* A section between the first two gates; as long as the calibration says, else of a length that is to be typed. */
  #addSection() {
    const { tree } = this.store.now;
    const [from, to] = Object.keys(tree.gates ?? {});
    const ends = [from, to].map((name) => metresOf(this.found?.calibration?.metres, middle(tree.gates[name].line)));
    this.store.edit((drawing) => {
      drawing.tree.sections ??= {};
      let count = 1;
      while (`section ${count}` in drawing.tree.sections) count += 1;
      const length = ends.every(Boolean) ? Number(distance(...ends).toFixed(1)) : 0;
      drawing.tree.sections[`section ${count}`] = { from, to, length_m: length };
    });
  }

  #site() {
    const { site, report } = this.store.now.tree;
    const start = (text) => this.store.edit((drawing) => (text ? (drawing.tree.site.start = text) : delete drawing.tree.site.start));
    const interval = (value) => this.store.edit((drawing) => (drawing.tree.report = { ...drawing.tree.report, interval_s: value * 60 }));
    this.root.querySelector("#site .body").replaceChildren(element(
      "div", { class: "form" },
      element("label", {}, "Name"), this.#input("site name", site.name, (text) => this.store.edit((drawing) => (drawing.tree.site.name = text))),
      element("label", {}, "First picture at"), this.#input("site start", site.start, start, { placeholder: "2026-06-01T07:00:00+02:00" }),
      element("label", {}, "Interval, min"), this.#number("site interval", (report?.interval_s ?? 900) / 60, interval),
      element("div", { class: "wide" }, `Drawn on ${site.width} × ${site.height} px`),
    ));
  }
}
