import { curves } from "./curves.js";
import { count } from "./format.js";
import { $, element } from "./panel.js";

/** Widths in CSS pixels: the least of a figure, and between two. */
const [FIGURE, BETWEEN] = [330, 32];

/** Units at the end of a parameter's name. */
const UNITS = { ghz: "GHz", ns: "ns", bytes: "bytes", gb_per_s: "GB/s", gflop_per_s: "GFLOP/s" };

/** @returns a table of the parameters of the machine that the report holds */
function hardware({ hardware: { parameters: ofCpu, gpus = [] } }) {
  const ofGpu = gpus.flatMap(({ gpu, parameters }) => parameters.map((parameter) => (
    { ...parameter, name: `gpu_${parameter.name}`, source: `${gpu.name}, ${parameter.source}` })));
  const parameters = [...ofCpu, ...ofGpu];
  const row = (cell, ...texts) => element("tr", {}, ...texts.map((text) => element(cell, {}, text)));
  const rows = parameters.filter(({ value }) => value != null).map(({ name, value, dispersion, how, source }) => {
    const [, what, unit] = name.match(/^(.*?)_?(ghz|ns|bytes|gb_per_s|gflop_per_s)?$/);
    const number = value < 100 ? Number(value.toPrecision(3)) : count(value);
    const spread = dispersion ? ` ± ${Math.round(50 * dispersion)} %` : "";
    const words = what.replaceAll("_", " ").replace("kib", "KiB");
    return row("td", words, `${number} ${UNITS[unit] ?? ""}${spread}`, `${how}: ${source}`);
  });
  const head = element("thead", {}, row("th", "what", "value ± half the spread", "how"));
  return element("table", {}, head, element("tbody", {}, ...rows));
}

/** The page that measures this browser. */
export class ProbeView {
  #algorithms;
  #worker = null;
  #report = null;
  /** Why the GPU was left out. */
  #without = "";

  constructor(algorithms) {
    this.#algorithms = algorithms;
    $("measure").addEventListener("click", () => this.#start());
    $("stop").addEventListener("click", () => {
      this.#worker.postMessage("stop");
      this.#say("Stopping after this step.");
    });
    // In the next picture, when the page is laid out.
    const draw = () => requestAnimationFrame(() => this.#draw());
    for (const event of ["resize", "hashchange"]) addEventListener(event, draw);
  }

  #start() {
    this.#worker = new Worker(new URL("probe-worker.js", import.meta.url), { type: "module" });
    this.#worker.onmessage = ({ data }) => this.#hear(data);
    this.#worker.onerror = ({ message }) => this.#hear({ error: message || "its program did not load" });
    [this.#report, this.#without] = [null, ""];
    this.#work(true);
    this.#say("Starting.");
  }

  #hear({ progress, report, prediction, over, without, error }) {
    if (without) this.#without = ` The GPU is left out, since ${without}.`;
    if (progress) {
      $("progress").value = progress.done / progress.of;
      this.#say(progress.text);
    }
    if (report) {
      this.#report = { text: report, data: JSON.parse(report), prediction };
      this.#draw();
    }
    if (!over && !error) return;
    this.#worker.terminate();
    this.#work(false);
    if (error) return this.#say(`The probe failed: ${error}. Reload the page and measure again.`);
    URL.revokeObjectURL($("report").href);
    const { provenance } = this.#report.data;
    $("report").href = URL.createObjectURL(new Blob([this.#report.text], { type: "application/json" }));
    $("report").download = `sapwise-${provenance.date}.json`;
    const ended = $("progress").value >= 1 ? "Measured" : "Stopped; the report holds what was measured";
    this.#say(`${ended}, in ${Math.round(provenance.seconds)} seconds.${this.#without}`);
  }

  /** Shows the buttons that fit: while it measures, and afterwards. */
  #work(measures) {
    $("measure").hidden = measures;
    $("stop").hidden = $("progress").hidden = !measures;
    $("report").hidden = measures || !this.#report;
    if (measures) $("progress").value = 0;
    // Screen readers hear the end, not every step.
    $("stage-of-probe").ariaBusy = measures;
  }

  #say(sentence) {
    $("stage-of-probe").textContent = sentence;
  }

  #draw() {
    if (!this.#report || $("probe").hidden) return;
    const { data, prediction } = this.#report;
    const room = $("curves").clientWidth + BETWEEN;
    const width = room / Math.max(1, Math.floor(room / (FIGURE + BETWEEN))) - BETWEEN;
    const scenes = [...new Set(data.points.map(({ scenario }) => scenario))];
    const legend = "Solid: measured here. Dashed: what the model predicts for the CPU from the parameters below.";
    const figures = scenes.map((scene) => curves(data, prediction, scene, this.#algorithms, width));
    $("curves").replaceChildren(element("p", {}, legend), ...figures);
    $("hardware").replaceChildren(element("h3", {}, "What was measured"), hardware(data));
  }
}
