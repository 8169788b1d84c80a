import { recent } from "./demo.js";
import { count, hue, label, milliseconds } from "./format.js";

/** Frames over which numbers are averaged. */
const FRAMES = 30;
/** The scenes that come first, as people call them. */
const SCENES = {
  fragmentation: "Explode: cubes shatter",
  "free-fall": "Fall: cubes drop onto a pile",
  gravity: "Swarm: a whirling cloud",
  uniform: "Even: spread out, drifting",
  clustered: "Crowd: dense clusters",
  mixed: "Mix: small and large",
  teleport: "Jump: all at once, now and then",
};

export const $ = (id) => document.getElementById(id);

/** @returns an element with properties and children */
export function element(name, properties, ...children) {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...children);
  return made;
}

/** A square in the colour of an algorithm. */
export function swatch(index) {
  const made = element("i", { className: "swatch" });
  made.style.setProperty("--hue", `var(--${hue(index)})`);
  return made;
}

/** The texts beside the picture. */
export class Panel {
  #algorithms;
  #rows = new Map();

  /** `compare(algorithm, wanted, failed)` is called at a switch; what it rejects with is shown. */
  constructor(algorithms, scenarios, compare) {
    this.#algorithms = algorithms;
    const known = Object.keys(SCENES).filter((name) => scenarios.includes(name));
    const option = (name) => element("option", { value: name }, SCENES[name] ?? name);
    const others = scenarios.filter((name) => !known.includes(name)).map(option);
    $("scene").append(...known.map(option), element("optgroup", { label: "Others" }, ...others));
    algorithms.forEach((algorithm, index) => {
      const box = element("input", { type: "checkbox" });
      const [ms, ratio] = [element("span", {}), element("span", {})];
      const failed = (error) => {
        [box.checked, box.disabled] = [false, false];
        this.notice(`${label(algorithm)} cannot run in this browser: ${error.message ?? error}`);
      };
      box.addEventListener("change", async () => {
        // A GPU opens later.
        box.disabled = true;
        try {
          await compare(algorithm, box.checked, failed);
          box.disabled = false;
          this.notice("");
        } catch (error) {
          failed(error);
        }
      });
      this.#rows.set(algorithm, [ms, ratio]);
      $("fixed").append(element("li", {}, element("label", {}, box, swatch(index), label(algorithm), ms, ratio)));
    });
  }

  /** Shows a sentence over the picture, or none. */
  notice(sentence) {
    $("notice").textContent = sentence;
  }

  update({ history, switches, fixed }) {
    const last = history.at(-1);
    const ms = recent(history, FRAMES, (frame) => frame.ms);
    $("running").replaceChildren(swatch(this.#algorithms.indexOf(last.algorithm)),
      element("b", {}, label(last.algorithm)), ` runs: ${last.because}.`);
    $("ms").textContent = milliseconds(ms);
    $("count").textContent = count(last.objects);
    $("pairs").textContent = count(last.pairs);
    for (const id of ["begun", "ended"]) $(id).textContent = count(recent(history, FRAMES, (frame) => frame[id]));
    for (const [algorithm, [own, ratio]] of this.#rows) {
      const mean = recent(history, FRAMES, (frame) => frame.fixed.get(algorithm) ?? NaN);
      const waits = fixed.has(algorithm) && Number.isNaN(last.fixed.get(algorithm) ?? 0);
      own.textContent = waits ? "too slow here" : fixed.has(algorithm) ? `${milliseconds(mean)} ms` : "";
      ratio.textContent = !waits && mean > 0 && ms > 0 ? `${(mean / ms).toPrecision(2)} ×` : "";
    }
    $("switches").replaceChildren(...switches.map(({ frame, objects, from, to, because }) => element("li", {},
      swatch(this.#algorithms.indexOf(to)), " ", element("b", {}, `${label(from)} → ${label(to)}`),
      ` in frame ${count(frame)}, ${count(objects)} objects: ${because}.`)));
    $("timeline").ariaLabel = `Last ten seconds: ${label(last.algorithm)} runs, ${milliseconds(ms)} milliseconds a `
      + `frame, ${count(last.objects)} objects.`;
  }
}
