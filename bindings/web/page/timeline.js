import { SPAN } from "./demo.js";
import { colours, count, hue, label, power } from "./format.js";

/** Heights in CSS pixels: the band, the captions of the curves, and the curve of the objects. */
const [BAND, CAPTION, OBJECTS] = [26, 26, 44];
/** Height of the strip under the band. */
const STRIP = 5;
/** Width of the labels of the axes in CSS pixels. */
const LEFT = 52;
/** Most frames over which short ones are averaged. */
const WINDOW = 31;

/**
 * Averages each frame that is too short for the clock with short ones around it.
 * @returns the means; NaN where nothing ran
 */
export function smooth(values, resolution) {
  const enough = 8 * resolution;
  return values.map((value, at) => {
    let [sum, frames] = [value, 1];
    for (let reach = 1; sum < enough && frames < WINDOW; reach++) {
      for (const neighbour of [values[at - reach], values[at + reach]]) {
        if (neighbour < enough) [sum, frames] = [sum + neighbour, frames + 1];
      }
      if (at - reach < 0 && at + reach >= values.length) break;
    }
    return sum / frames;
  });
}

/** Draws the last frames: the algorithm that ran as a band, milliseconds, and the number of objects. */
export class Timeline {
  #canvas;
  #context;
  #algorithms;
  #resolution;

  constructor(canvas, algorithms, resolution) {
    [this.#canvas, this.#algorithms, this.#resolution] = [canvas, algorithms, resolution];
    this.#context = canvas.getContext("2d");
    this.recolour();
  }

  /** Reads the colours of the style sheet. */
  recolour() {
    this.colours = colours(["ink", "soft", "line", "on-hue", ...this.#algorithms.map((_, i) => hue(i))]);
  }

  draw(history) {
    const [canvas, context] = [this.#canvas, this.#context];
    const { clientWidth: width, clientHeight: height } = canvas;
    const ratio = devicePixelRatio;
    [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
    context.scale(ratio, ratio);
    context.font = `12px ${getComputedStyle(canvas).fontFamily}`;
    context.textBaseline = "middle";
    const x = (frame) => LEFT + (width - LEFT) * frame / (SPAN - 1);
    this.#band(history, x);
    const middle = height - OBJECTS - CAPTION;
    this.#times(history, x, BAND + CAPTION, middle);
    this.#objects(history, x, middle + CAPTION, height - 1);
  }

  #colour(algorithm) {
    return this.colours[hue(this.#algorithms.indexOf(algorithm))] ?? this.colours.soft;
  }

  #band(history, x) {
    const context = this.#context;
    this.#text("runs", LEFT - 8, BAND / 2, "right", "soft");
    for (let from = 0, to; from < history.length; from = to) {
      const { algorithm } = history[from];
      for (to = from + 1; history[to]?.algorithm === algorithm;) to++;
      const wide = x(to) - x(from);
      context.fillStyle = this.#colour(algorithm);
      context.fillRect(x(from), 0, wide + 0.5, BAND);
      const name = label(algorithm);
      if (context.measureText(name).width + 10 < wide) {
        this.#text(name, x(from) + wide / 2, BAND / 2 + 0.5, "center", "on-hue");
      }
    }
    // Below, an algorithm that ran beside it on the GPU.
    history.forEach(({ fixed }, frame) => {
      const onGpu = [...fixed.keys()].find((name) => name.includes("@gpu"));
      if (!onGpu) return;
      context.fillStyle = this.#colour(onGpu);
      context.fillRect(x(frame), BAND, x(frame + 1) - x(frame) + 0.5, STRIP);
    });
  }

  #times(history, x, top, bottom) {
    const names = [...new Set(history.flatMap((frame) => [...frame.fixed.keys()]))];
    const curves = names.map((name) => [name, smooth(history.map((f) => f.fixed.get(name) ?? NaN), this.#resolution)]);
    curves.push([null, smooth(history.map((frame) => frame.ms), this.#resolution)]);
    const values = curves.flatMap(([, ms]) => ms).filter((ms) => ms > 0.001);
    const low = Math.floor(Math.log10(Math.min(0.1, ...values)));
    const high = Math.max(low + 2, Math.ceil(Math.log10(Math.max(1, ...values))));
    const y = (ms) => bottom - (bottom - top) * (Math.max(Math.log10(ms), low) - low) / (high - low);
    for (let decade = low; decade <= high; decade++) {
      this.#rule(x(0), x(SPAN - 1), y(10 ** decade));
      const roomy = (bottom - top) / (high - low) > 15 || decade % 2 === 0;
      this.#text(roomy ? power(decade) : "", LEFT - 8, y(10 ** decade), "right", "soft");
    }
    for (const [name, ms] of curves) {
      this.#curve(ms.map((value) => y(value)), x, name ? this.#colour(name) : this.colours.ink, name ? 1.25 : 2);
    }
    const caption = "milliseconds a frame" + (names.length > 0 ? "; bold: the adaptive choice" : "");
    this.#text(caption, LEFT, top - CAPTION / 2, "left", "soft");
  }

  #objects(history, x, top, bottom) {
    const most = Math.max(10, ...history.map((frame) => frame.objects));
    const y = (objects) => bottom - (bottom - top) * objects / most;
    this.#rule(x(0), x(SPAN - 1), y(0));
    this.#text(count(most), LEFT - 8, top + 4, "right", "soft");
    const heights = history.map((frame) => y(frame.objects));
    this.#curve(heights, x, this.colours.soft, 1.5);
    this.#context.lineTo(x(history.length - 1), bottom);
    this.#context.lineTo(x(0), bottom);
    this.#context.globalAlpha = 0.12;
    this.#context.fillStyle = this.colours.soft;
    this.#context.fill();
    this.#context.globalAlpha = 1;
    this.#text("objects", LEFT, top - 10, "left", "soft");
  }

  #curve(heights, x, colour, width) {
    const context = this.#context;
    context.beginPath();
    heights.forEach((height, frame) => {
      if (Number.isNaN(height)) return;
      if (Number.isNaN(heights[frame - 1] ?? NaN)) context.moveTo(x(frame), height);
      else context.lineTo(x(frame), height);
    });
    Object.assign(context, { strokeStyle: colour, lineWidth: width, lineJoin: "round" });
    context.stroke();
  }

  #rule(from, to, y) {
    this.#context.fillStyle = this.colours.line;
    this.#context.fillRect(from, Math.round(y), to - from, 1);
  }

  #text(text, x, y, align, colour) {
    Object.assign(this.#context, { textAlign: align, fillStyle: this.colours[colour] });
    this.#context.fillText(text, x, y);
  }
}
