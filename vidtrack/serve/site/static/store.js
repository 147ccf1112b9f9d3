/* The drawing and its history.

   A drawing is {tree, pairs, world}: the site as in its file but for its pairs of points, those pairs
   ({picture, ground}, either may be missing), and the six numbers of the plan's world file. */

const MOST = 500;
const copy = (value) => structuredClone(value);
const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);

export function fromTree(tree, world) {
  tree = copy(tree);
  const { picture = [], ground = [] } = tree.calibration ?? {};
  const pairs = picture.map((point, k) => ({ picture: point, ground: ground[k] ?? null }));
  return { tree, pairs, world };
}

/* The tree as it stands in a file: whole pairs only, and no empty parts. */
export function toTree({ tree, pairs }) {
  tree = copy(tree);
  if (!straightRoad(tree)) {
    const whole = pairs.filter((pair) => pair.picture && pair.ground);
    const points = { picture: whole.map((pair) => pair.picture), ground: whole.map((pair) => pair.ground) };
    if (whole.length) tree.calibration = { ...tree.calibration, ...points };
    else delete tree.calibration;
  }
  for (const part of ["gates", "zones", "sections", "movements"]) {
    if (part === "movements" && tree.movements?.allowed?.length === 0) delete tree.movements.allowed;
    if (tree[part] && Object.keys(tree[part]).length === 0) delete tree[part];
  }
  return tree;
}

/* Whether the calibration is by segments of a straight road, which this page shows and does not change. */
export const straightRoad = (tree) => Boolean(tree.calibration?.lengths || tree.calibration?.directions);

export class Store {
  constructor(changed) {
    this.changed = changed;
    this.past = [];
    this.future = [];
    this.now = null;
    this.saved = null;
    this.lastKey = null;
    this.before = null; // the drawing before a drag that is under way
  }

  open(drawing) {
    this.now = drawing;
    this.saved = copy(drawing);
    this.changed();
  }

  get unsaved() {
    return !same(this.now, this.saved);
  }

  markSaved() {
    this.saved = copy(this.now);
    this.changed();
  }

  /* One step of history. Edits that follow each other with the same key are one. */
  edit(change, key = null) {
    const next = copy(this.now);
    change(next);
    if (same(next, this.now)) return;
    if (key === null || key !== this.lastKey) this.#remember(this.now);
    this.lastKey = key;
    this.now = next;
    this.changed();
  }

  /* A drag: any number of changes, each of the drawing before it, and one step of history. */
  begin() {
    this.before = copy(this.now);
  }

  during(change) {
    this.now = copy(this.before);
    change(this.now);
    this.changed();
  }

  end() {
    if (!same(this.before, this.now)) this.#remember(this.before);
    this.before = this.lastKey = null;
    this.changed();
  }

  cancel() {
    if (this.before) this.now = this.before;
    this.before = null;
    this.changed();
  }

  undo() {
    if (!this.past.length || this.before) return;
    this.future.push(this.now);
    this.now = this.past.pop();
    this.lastKey = null;
    this.changed();
  }

  redo() {
    if (!this.future.length || this.before) return;
    this.past.push(this.now);
    this.now = this.future.pop();
    this.lastKey = null;
    this.changed();
  }

  #remember(drawing) {
    this.past.push(drawing);
    if (this.past.length > MOST) this.past.shift();
    this.future = [];
  }
}
