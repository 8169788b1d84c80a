/** Measures away from the page. Posts `{ progress }`, `{ report, prediction, over }` now and then, or `{ error }`. */
import init, { Probe } from "./sapwise.js";

/** Milliseconds between two reports to draw. */
const DRAWN = 2000;
let stopped = false;
addEventListener("message", () => { stopped = true; });

try {
  await init();
  const probe = new Probe();
  for (let drawn = performance.now(), over = false; !over;) {
    const progress = probe.step();
    over = stopped || progress.done >= progress.of;
    postMessage({ progress });
    if (over || performance.now() - drawn > DRAWN) {
      postMessage({ report: probe.report(), prediction: JSON.parse(probe.prediction()), over });
      drawn = performance.now();
    }
    // Lets the message of the stop button in.
    await new Promise((resume) => setTimeout(resume));
  }
} catch (error) {
  postMessage({ error: String(error.message ?? error) });
}
