import init, { algorithms, Gpu, scenarios } from "./sapwise.js";
import { clockResolution } from "./contestant.js";
import { Demo } from "./demo.js";
import { count } from "./format.js";
import { Hands, scrolls } from "./hands.js";
import { $, Panel } from "./panel.js";
import { ProbeView } from "./probe.js";
import { Stage } from "./stage.js";
import { Timeline } from "./timeline.js";

const [SCENE, FEWEST, MOST, FIRST] = ["fragmentation", 10, 200_000, 8000];
/** Milliseconds between two frames of the scene, and between two updates of the texts. */
const [FRAME, TEXTS] = [1000 / 60, 200];

const LESS_MOTION = "Paused, since your system asks for less motion.";

const calm = matchMedia("(prefers-reduced-motion: reduce)");
let running = !calm.matches;
/** Pictures that are still drawn while the scene pauses. */
let awake = 0;
let [due, told] = [0, 0];

const shaders = Promise.all(["boxes.vert", "boxes.frag"].map(async (name) => (await fetch(name)).text()));
await init().catch((error) => {
  $("failure").textContent = `WebAssembly did not start: ${error.message}. Chrome 91, Firefox 89, Safari 16.4 and `
    + "later can run this page.";
  $("failure").hidden = false;
  throw error;
});
export const demo = new Demo(SCENE, FIRST);
const all = [...algorithms(), ...Gpu.algorithms()];
const timeline = new Timeline($("timeline"), all, clockResolution());
const panel = new Panel(all, scenarios(), (...choice) => demo.compare(...choice));
let [stage, hands] = [null, null];
try {
  stage = new Stage($("stage"), await shaders);
  hands = new Hands($("stage"), stage, demo);
} catch (error) {
  panel.notice(`The boxes cannot be drawn, since ${error.message}. Everything else works.`);
}
new ProbeView(all);

/** Pauses or goes on. */
export function run(wanted) {
  [running, $("pause").textContent, awake] = [wanted, wanted ? "Pause" : "Play", 60];
  if ($("notice").textContent === LESS_MOTION) panel.notice("");
}

const toObjects = (share) => Number((FEWEST * (MOST / FEWEST) ** share).toPrecision(2));
const toShare = (objects) => Math.log(objects / FEWEST) / Math.log(MOST / FEWEST);
let wanted;
function restart() {
  demo.restart($("scene").value, wanted);
  stage?.reframe();
}
function resize(objects) {
  wanted = Math.min(MOST, Math.max(FEWEST, Math.round(objects)));
  [$("objects").value, $("wanted").textContent] = [toShare(wanted), count(wanted)];
  $("objects").ariaValueText = `${wanted} objects`;
  restart();
}
function step() {
  run(false);
  demo.advance();
}
$("objects").addEventListener("input", () => resize(toObjects($("objects").value)));
$("pause").addEventListener("click", () => run(!running));
$("step").addEventListener("click", step);
$("restart").addEventListener("click", restart);
$("scene").addEventListener("change", restart);
// What is measured must not be disturbed.
$("measure").addEventListener("click", () => run(false));
resize(FIRST);
run(running);
if (!running) panel.notice(LESS_MOTION);

document.addEventListener("keydown", (event) => {
  const { key, target, ctrlKey, metaKey, altKey } = event;
  if (ctrlKey || metaKey || altKey || $("watch").hidden || target.matches("select, input[type=range]")) return;
  if (key === " " && target.matches("button, input, summary, a")) return;
  const grow = (factor) => () => resize(wanted * factor);
  const actions = { " ": () => run(!running), s: step, "+": grow(1.25), "-": grow(0.8) };
  actions[key]?.();
  const camera = target === $("stage") || !scrolls();
  if (key in actions || camera && hands?.key(key)) event.preventDefault();
});
for (const event of ["pointermove", "wheel", "keydown", "click", "input", "change", "resize", "hashchange"]) {
  addEventListener(event, () => { awake = 60; });
}
addEventListener("error", ({ message }) => panel.notice(`${message}. Reload the page.`));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  stage?.recolour();
  timeline.recolour();
  awake = 2;
});
$("stage").addEventListener("webglcontextlost", (event) => {
  event.preventDefault();
  panel.notice("The graphics driver stopped drawing. The boxes come back when it does.");
});
$("stage").addEventListener("webglcontextrestored", () => {
  stage.prepare();
  panel.notice("");
});

function show() {
  const page = location.hash === "#probe" ? "probe" : "watch";
  for (const id of ["watch", "probe"]) {
    $(id).hidden = id !== page;
    document.querySelector(`nav a[href="#${id}"]`).ariaCurrent = id === page ? "page" : null;
  }
}
addEventListener("hashchange", show);
show();

function frame(now) {
  requestAnimationFrame(frame);
  if ($("watch").hidden) return;
  const edited = hands?.apply();
  const moves = running && now >= due - 4;
  if (moves) demo.advance();
  else if (edited) demo.find();
  else if (awake-- <= 0) return;
  if (moves) due = Math.max(due + FRAME, now);
  stage?.draw(demo.boxes, demo.hits, calm.matches ? 1 : 0.06);
  timeline.draw(demo.history);
  if (told === 0) performance.mark("first-frame");
  if (now - told > TEXTS || !running) {
    panel.update(demo);
    told = now;
  }
}
requestAnimationFrame(frame);
