/** Measures away from the page. Posts `{ progress }`, `{ report, prediction, over }` now and then, `{ without }`
 * if there is no GPU, and `{ error }`. */
import { gpuParameters } from "./gpu-parameters.js";
import init, { Gpu, Probe } from "./sapwise.js";

/** Milliseconds between two reports to draw. */
const DRAWN = 2000;
let stopped = false;
addEventListener("message", () => { stopped = true; });

try {
  await init();
  const probe = new Probe();
  try {
    const { name, samples } = await gpuParameters();
    await probe.addGpu(await Gpu.open(), name, samples);
  } catch (error) {
    postMessage({ without: String(error.message ?? error) });
  }
  for (let drawn = performance.now(), over = false; !over;) {
    const progress = await probe.step();
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
