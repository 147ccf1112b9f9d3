/* A picture that is zoomed and moved, the paths over it, and where the pointer is in it. */

const LEAST = 0.05;
const MOST = 40;
const CLICK_PX = 5;
const WAYS = 12;

export class Pane {
  /* handlers: down(pane, point, event) returns whether it takes the pointer; move, up, cancel, leave; click(pane). */
  constructor(root, handlers) {
    this.root = root;
    this.canvas = root.querySelector("canvas");
    this.svg = root.querySelector("svg");
    this.handlers = handlers;
    this.bitmap = null;
    this.size = [1, 1];
    this.view = { k: 1, x: 0, y: 0 };
    this.fitted = true;
    this.paths = [];
    this.showPaths = true;
    this.layer = null;
    this.onview = () => {};
    this.pointers = new Map();
    new ResizeObserver(() => (this.fitted ? this.fit() : this.redraw())).observe(root);
    root.addEventListener("pointerdown", (event) => this.#down(event));
    root.addEventListener("pointermove", (event) => this.#move(event));
    for (const name of ["pointerup", "pointercancel"]) root.addEventListener(name, (event) => this.#up(event));
    root.addEventListener("pointerleave", () => this.handlers.leave(this));
    root.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    root.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  setPicture(bitmap, width, height) {
    this.bitmap = bitmap;
    this.size = [width, height];
    this.fit();
  }

  /* The same view of a newer picture. */
  renew(bitmap) {
    this.bitmap = bitmap;
    this.redraw();
  }

  setPaths(paths) {
    this.paths = paths;
    this.layer = null;
    this.redraw();
  }

  screen([x, y]) {
    return [this.view.k * (x + 0.5) + this.view.x, this.view.k * (y + 0.5) + this.view.y];
  }

  point([x, y]) {
    return [(x - this.view.x) / this.view.k - 0.5, (y - this.view.y) / this.view.k - 0.5];
  }

  inside([x, y]) {
    return [Math.min(Math.max(x, 0), this.size[0] - 1), Math.min(Math.max(y, 0), this.size[1] - 1)];
  }

  fit() {
    const { clientWidth, clientHeight } = this.root;
    if (!clientWidth || !clientHeight) return;
    const k = Math.min(clientWidth / this.size[0], clientHeight / this.size[1]);
    this.view = { k, x: (clientWidth - k * this.size[0]) / 2, y: (clientHeight - k * this.size[1]) / 2 };
    this.fitted = true;
    this.redraw();
  }

  zoom(factor, at = [this.root.clientWidth / 2, this.root.clientHeight / 2]) {
    const k = Math.min(Math.max(this.view.k * factor, LEAST), MOST);
    const change = k / this.view.k;
    this.view = { k, x: at[0] - change * (at[0] - this.view.x), y: at[1] - change * (at[1] - this.view.y) };
    this.fitted = false;
    this.redraw();
  }

  pan(dx, dy) {
    this.view = { ...this.view, x: this.view.x + dx, y: this.view.y + dy };
    this.fitted = false;
    this.redraw();
  }

  redraw() {
    this.root.dataset.view = `${this.view.k},${this.view.x},${this.view.y}`;
    this.onview();
    if (this.waiting) return;
    this.waiting = requestAnimationFrame(() => {
      this.waiting = null;
      this.#draw();
    });
  }

  #draw() {
    const ratio = window.devicePixelRatio || 1;
    const { clientWidth, clientHeight } = this.root;
    this.canvas.width = Math.round(clientWidth * ratio);
    this.canvas.height = Math.round(clientHeight * ratio);
    const pen = this.canvas.getContext("2d");
    pen.scale(ratio, ratio);
    const { k, x, y } = this.view;
    const place = [x, y, k * this.size[0], k * this.size[1]];
    pen.imageSmoothingEnabled = k < 4;
    if (this.bitmap) pen.drawImage(this.bitmap, ...place);
    else {
      pen.fillStyle = "#4a4f55";
      pen.fillRect(...place);
    }
    if (!this.showPaths || !this.paths.length) return;
    pen.fillStyle = "#0004";
    pen.fillRect(...place);
    this.#drawPaths(pen, ratio);
  }

  /* All paths are drawn once for a view; while it moves, that drawing is moved along. */
  #drawPaths(pen, ratio) {
    const { width, height } = this.canvas;
    const layer = this.layer;
    const fresh = layer && layer.view === this.view && layer.canvas.width === width && layer.canvas.height === height;
    if (!fresh && layer && this.paths.length > 400) {
      clearTimeout(this.later);
      this.later = setTimeout(() => {
        this.layer = null;
        this.redraw();
      }, 120);
    } else if (!fresh) {
      this.layer = { view: this.view, canvas: this.#layer(width, height, ratio) };
    }
    const was = this.layer.view;
    const change = this.view.k / was.k;
    pen.setTransform(change, 0, 0, change, ratio * (this.view.x - change * was.x), ratio * (this.view.y - change * was.y));
    pen.drawImage(this.layer.canvas, 0, 0);
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  }

  #layer(width, height, ratio) {
    const canvas = new OffscreenCanvas(width, height);
    const pen = canvas.getContext("2d");
    const { k, x, y } = this.view;
    const ways = Array.from({ length: WAYS }, () => new Path2D());
    for (const path of this.paths) {
      const last = path.length - 2;
      const angle = Math.atan2(path[last + 1] - path[1], path[last] - path[0]);
      const way = ways[(Math.round((angle / (2 * Math.PI)) * WAYS) + WAYS) % WAYS];
      way.moveTo(k * (path[0] + 0.5) + x, k * (path[1] + 0.5) + y);
      for (let n = 2; n <= last; n += 2) way.lineTo(k * (path[n] + 0.5) + x, k * (path[n + 1] + 0.5) + y);
    }
    pen.scale(ratio, ratio);
    pen.lineWidth = 1.2;
    pen.lineJoin = "round";
    pen.globalAlpha = Math.min(Math.max(8 / Math.sqrt(this.paths.length), 0.35), 0.8);
    ways.forEach((way, n) => {
      pen.strokeStyle = `hsl(${(360 * n) / WAYS} 85% 68%)`;
      pen.stroke(way);
    });
    return canvas;
  }

  /* Where an event is, in the picture. */
  at(event) {
    return this.point(this.#local(event));
  }

  #local(event) {
    const { left, top } = this.root.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top];
  }

  #down(event) {
    if (event.target.closest("form")) return;
    this.root.focus({ preventScroll: true });
    this.root.setPointerCapture(event.pointerId);
    const local = this.#local(event);
    this.pointers.set(event.pointerId, local);
    if (this.pointers.size === 2) {
      if (this.taken) this.handlers.cancel(this);
      this.taken = false;
      return;
    }
    this.pressed = local;
    this.moved = false;
    this.taken = event.button === 0 && this.handlers.down(this, this.at(event), event);
  }

  #move(event) {
    const local = this.#local(event);
    const last = this.pointers.get(event.pointerId);
    if (this.pointers.size === 2 && last) {
      const [other] = [...this.pointers].filter(([id]) => id !== event.pointerId).map(([, place]) => place);
      const apart = (a) => Math.max(Math.hypot(a[0] - other[0], a[1] - other[1]), 1);
      this.pan((local[0] - last[0]) / 2, (local[1] - last[1]) / 2);
      this.zoom(apart(local) / apart(last), [(local[0] + other[0]) / 2, (local[1] + other[1]) / 2]);
      this.moved = true;
    } else if (last) {
      const far = Math.hypot(local[0] - this.pressed[0], local[1] - this.pressed[1]) > CLICK_PX;
      if (far && !this.moved && !this.taken) this.root.classList.add("panning");
      this.moved ||= far;
      if (this.taken) this.handlers.move(this, this.at(event), event);
      else if (this.moved) this.pan(local[0] - last[0], local[1] - last[1]);
    } else {
      this.handlers.move(this, this.at(event), event);
    }
    if (last) this.pointers.set(event.pointerId, local);
  }

  #up(event) {
    if (!this.pointers.delete(event.pointerId)) return;
    this.root.classList.remove("panning");
    if (this.taken) this.handlers.up(this, this.at(event), event);
    else if (!this.moved && event.button === 0) this.handlers.click(this);
    this.taken = false;
  }

  #wheel(event) {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 20 : 1;
    this.zoom(Math.exp(-event.deltaY * lines * 0.0015), this.#local(event));
  }
}
