// A picture on a canvas that a worker renders, and that pointers, wheels, fingers and keys move.

/** Dragging less than this many pixels is a click. */
const CLICK = 4;
/** What a key does: a gesture of the worker and its numbers. */
const KEYS = {
  ArrowLeft: ["orbit", -0.05, 0], ArrowRight: ["orbit", 0.05, 0],
  ArrowUp: ["orbit", 0, -0.05], ArrowDown: ["orbit", 0, 0.05],
  "+": ["dolly", 1], "=": ["dolly", 1], "-": ["dolly", -1],
};

/**
 * A view of a scene.
 *
 * Events: `picture` (detail: { width, height, progress, denoised }), `progress` (detail), `failed` (detail: text), `pick`
 * (detail: { x, y }, shares of the picture), `moved`.
 */
export class View extends EventTarget {
  #worker = new Worker(new URL("worker.js", import.meta.url), { type: "module" });
  #asked = new Map();
  #last = 0;
  #pointers = new Map();
  #travelled = 0;

  /** @param {HTMLCanvasElement} canvas What the picture is shown on. */
  constructor(canvas) {
    super();
    this.canvas = canvas;
    this.#worker.onmessage = ({ data }) => this.#told(data);
    this.#worker.onerror = (event) => this.#tell("failed", event.message || "the renderer could not be loaded");
    this.#listen();
  }

  /** Asks the worker for something: see `calls` in worker.js. Rejects with the renderer's own message. */
  ask(call, ...parameters) {
    const id = ++this.#last;
    this.#worker.postMessage({ id, call, parameters });
    return new Promise((resolve, reject) => this.#asked.set(id, { resolve, reject }));
  }

  /** Ends the worker. */
  close() { this.#worker.terminate(); }

  #told({ id, result, error, picture, progress, failed }) {
    if (id !== undefined) {
      const { resolve, reject } = this.#asked.get(id);
      this.#asked.delete(id);
      if (error === undefined) resolve(result);
      else reject(new Error(error));
    } else if (picture) {
      const { width, height, pixels, ...rest } = picture;
      if (this.canvas.width !== width || this.canvas.height !== height) {
        [this.canvas.width, this.canvas.height] = [width, height];
      }
      const data = new ImageData(new Uint8ClampedArray(pixels.buffer), width, height);
      this.canvas.getContext("2d").putImageData(data, 0, 0);
      this.#tell("picture", { width, height, ...rest });
    } else if (progress) {
      this.#tell("progress", progress);
    } else if (failed !== undefined) {
      this.#tell("failed", failed);
    }
  }

  #tell(type, detail) { this.dispatchEvent(new CustomEvent(type, { detail })); }

  /** Moves the camera; what goes wrong is told, not thrown. */
  move(call, ...parameters) {
    this.ask(call, ...parameters).then(() => this.#tell("moved"), (error) => this.#tell("failed", error.message));
  }

  #listen() {
    const canvas = this.canvas;
    const height = () => canvas.getBoundingClientRect().height || 1;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      if (this.#pointers.size === 0) this.#travelled = 0;
      this.#pointers.set(event.pointerId, [event.clientX, event.clientY]);
    });
    canvas.addEventListener("pointermove", (event) => {
      const before = this.#pointers.get(event.pointerId);
      if (!before) return;
      const others = [...this.#pointers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
      const now = [event.clientX, event.clientY];
      const [x, y] = [now[0] - before[0], now[1] - before[1]];
      this.#travelled += Math.hypot(x, y);
      if (this.#travelled < CLICK) return;
      this.#pointers.set(event.pointerId, now);
      if (others.length > 0) {
        // Two fingers: apart goes nearer, together goes away, and both move the picture.
        const apart = (at) => Math.hypot(at[0] - others[0][0], at[1] - others[0][1]) || 1;
        this.move("dolly", Math.log(apart(now) / apart(before)) / Math.log(1 / 0.9));
        this.move("pan", x / 2 / height(), y / 2 / height());
      } else if (event.buttons & 6 || event.shiftKey) {
        this.move("pan", x / height(), y / height());
      } else {
        this.move("orbit", x / height(), y / height());
      }
    });
    const lift = (event) => {
      const was = this.#pointers.delete(event.pointerId);
      if (event.type === "pointerup" && was && this.#travelled < CLICK && event.button === 0) {
        const box = canvas.getBoundingClientRect();
        const share = { x: (event.clientX - box.left) / box.width, y: (event.clientY - box.top) / box.height };
        this.#tell("pick", share);
      }
    };
    canvas.addEventListener("pointerup", lift);
    canvas.addEventListener("pointercancel", lift);
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.move("dolly", -event.deltaY / (event.deltaMode === WheelEvent.DOM_DELTA_PIXEL ? 100 : 3));
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (event.key === "Enter") this.#tell("pick", { x: 0.5, y: 0.5 });
      else if (KEYS[event.key]) this.move(...KEYS[event.key]);
      else return;
      event.preventDefault();
    });
  }
}
