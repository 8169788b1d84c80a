/** CSS pixels that a pointer may move in a click, and the radius around it in which a drag deletes. */
const [CLICK, BRUSH] = [5, 20];
/** Radians a CSS pixel, and a key. */
const [DRAG, KEY] = [0.006, 0.08];

/** Whether the page is longer than the window: the wheel and the arrows belong to it then. */
export const scrolls = () => document.documentElement.scrollHeight > innerHeight;

/** Reads pointers and keys, and gathers what they do to the scene until the next frame. */
export class Hands {
  #stage;
  #canvas;
  #demo;
  #pointers = new Map();
  #grip = {};
  #split = [];
  #wiped = [];

  constructor(canvas, stage, demo) {
    [this.#canvas, this.#stage, this.#demo] = [canvas, stage, demo];
    canvas.addEventListener("pointerdown", (event) => this.#press(event));
    canvas.addEventListener("pointermove", (event) => this.#move(event));
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => this.#release(event));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => {
      if (scrolls() && !event.ctrlKey) return;
      event.preventDefault();
      stage.magnify(Math.exp(-event.deltaY * 0.0015));
    }, { passive: false });
  }

  /**
   * Splits and deletes what was asked for since the last frame.
   * @returns whether there was anything
   */
  apply() {
    const edited = this.#split.length + this.#wiped.length > 0;
    const { boxes } = this.#demo;
    const wiped = this.#wiped.flatMap(([x, y]) => [
      this.#stage.pick(boxes, x, y), ...this.#stage.within(boxes, x, y, BRUSH),
    ]);
    this.#split.forEach((box) => this.#demo.split(box));
    this.#demo.remove(new Set(wiped.filter((box) => box >= 0)));
    [this.#split, this.#wiped] = [[], []];
    return edited;
  }

  /**
   * Does what a key says to the camera, or to the middle of the picture.
   * @returns whether it means anything
   */
  key(key) {
    const middle = [this.#canvas.clientWidth / 2, this.#canvas.clientHeight / 2];
    const actions = {
      ArrowLeft: () => this.#stage.turn(-KEY, 0),
      ArrowRight: () => this.#stage.turn(KEY, 0),
      ArrowUp: () => this.#stage.turn(0, KEY),
      ArrowDown: () => this.#stage.turn(0, -KEY),
      PageUp: () => this.#stage.magnify(1.15),
      PageDown: () => this.#stage.magnify(1 / 1.15),
      x: () => this.#split.push(this.#stage.pick(this.#demo.boxes, ...middle)),
      Delete: () => this.#wiped.push(middle),
    };
    actions[key]?.();
    return key in actions;
  }

  #press(event) {
    this.#canvas.setPointerCapture(event.pointerId);
    const place = [event.offsetX, event.offsetY];
    this.#pointers.set(event.pointerId, place);
    const only = this.#pointers.size === 1 && event.button === 0 && !event.shiftKey;
    const box = only ? this.#stage.pick(this.#demo.boxes, ...place) : -1;
    this.#grip = { does: box < 0 ? "turn" : "split", box, place };
  }

  #move(event) {
    const before = this.#pointers.get(event.pointerId);
    if (!before) return;
    const place = [event.offsetX, event.offsetY];
    this.#pointers.set(event.pointerId, place);
    if (this.#pointers.size === 2) {
      const [, other] = [...this.#pointers].find(([id]) => id !== event.pointerId);
      const apart = (a) => Math.hypot(a[0] - other[0], a[1] - other[1]);
      this.#stage.magnify(apart(place) / Math.max(1, apart(before)));
    }
    const { does, place: start } = this.#grip;
    if (does === "turn") this.#stage.turn((before[0] - place[0]) * DRAG, (place[1] - before[1]) * DRAG);
    else if (Math.hypot(place[0] - start[0], place[1] - start[1]) > CLICK) this.#grip.does = "delete";
    if (this.#grip.does === "delete") this.#wiped.push(place);
  }

  #release(event) {
    this.#pointers.delete(event.pointerId);
    if (this.#grip.does === "split" && event.type === "pointerup") this.#split.push(this.#grip.box);
    this.#grip.does = "turn";
  }
}
