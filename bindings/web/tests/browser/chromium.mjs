/** Headless Chromium over the DevTools protocol, through a pipe. */
import { spawn } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

/** Software rendering, so that WebGL2 and WebGPU work without a GPU. */
const FLAGS = [
  "--headless=new", "--no-sandbox", "--no-first-run", "--disable-dev-shm-usage", "--disable-extensions",
  "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist", "--hide-scrollbars",
  "--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader", "--enable-features=Vulkan",
];

export class Chromium {
  #process;
  #profile = mkdtempSync(join(tmpdir(), "sapwise-chromium-"));
  #calls = new Map();
  #pages = new Map();
  #last = 0;

  constructor(command = process.env.CHROMIUM ?? "chromium") {
    const flags = [...FLAGS, "--remote-debugging-pipe", `--user-data-dir=${this.#profile}`];
    this.#process = spawn(command, flags, { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] });
    this.#process.on("error", ({ message }) => {
      throw new Error(`${command} did not start: ${message}; install Chromium`);
    });
    let text = "";
    this.#process.stdio[4].setEncoding("utf8").on("data", (chunk) => {
      const messages = (text + chunk).split("\0");
      text = messages.pop();
      messages.forEach((message) => this.#hear(JSON.parse(message)));
    });
  }

  #hear({ id, sessionId, method, params, result, error }) {
    if (id === undefined) return this.#pages.get(sessionId)?.hear(method, params);
    const { resolve, reject, called } = this.#calls.get(id);
    this.#calls.delete(id);
    if (error) reject(new Error(`${called}: ${error.message}`));
    else resolve(result);
  }

  send(called, params = {}, sessionId = undefined) {
    const id = ++this.#last;
    this.#process.stdio[3].write(`${JSON.stringify({ id, method: called, params, sessionId })}\0`);
    return new Promise((resolve, reject) => this.#calls.set(id, { resolve, reject, called }));
  }

  /** Opens an empty page of this size in CSS pixels. */
  async page(width, height) {
    const { browserContextId } = await this.send("Target.createBrowserContext");
    const { targetId } = await this.send("Target.createTarget", { url: "about:blank", browserContextId });
    const { sessionId } = await this.send("Target.attachToTarget", { targetId, flatten: true });
    const page = new Page((method, params) => this.send(method, params, sessionId));
    this.#pages.set(sessionId, page);
    for (const domain of ["Page", "Runtime", "Network", "Log", "Accessibility"]) await page.send(`${domain}.enable`);
    await page.resize(width, height);
    page.close = () => this.send("Target.disposeBrowserContext", { browserContextId });
    return page;
  }

  async close() {
    await this.send("Browser.close");
    await new Promise((resolve) => this.#process.on("exit", resolve));
    rmSync(this.#profile, { recursive: true, force: true, maxRetries: 5 });
  }
}

class Page {
  /** Addresses that were asked for, and errors of scripts and of the console. */
  requests = [];
  errors = [];

  constructor(send) {
    this.send = send;
  }

  hear(method, params) {
    if (method === "Network.requestWillBeSent") this.requests.push(params.request.url);
    if (method === "Runtime.exceptionThrown") {
      this.errors.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
    }
    if (method === "Log.entryAdded" && params.entry.level === "error") {
      this.errors.push(`${params.entry.text} ${params.entry.url ?? ""}`);
    }
  }

  resize(width, height, mobile = false) {
    return this.send("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: 1, mobile });
  }

  /** Pretends features of the system, such as `{ "prefers-color-scheme": "dark" }`. */
  media(features) {
    return this.send("Emulation.setEmulatedMedia", {
      features: Object.entries(features).map(([name, value]) => ({ name, value })),
    });
  }

  /** Opens an address and waits until the page has loaded. */
  async open(url) {
    await this.send("Page.navigate", { url });
    await this.until(`location.href === ${JSON.stringify(url)} && document.readyState === "complete"`);
  }

  /** @returns the value of an expression, which may be a promise */
  async evaluate(expression) {
    const { result, exceptionDetails } = await this.send("Runtime.evaluate", {
      expression, awaitPromise: true, returnByValue: true, userGesture: true,
    });
    if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
    return result.value;
  }

  /** Waits until an expression is true. */
  async until(expression, seconds = 20) {
    const end = Date.now() + seconds * 1000;
    while (!await this.evaluate(expression).catch(() => false)) {
      if (Date.now() > end) throw new Error(`not within ${seconds} s: ${expression}`);
      await new Promise((resume) => setTimeout(resume, 50));
    }
  }

  /** Presses a key of one character or with a name. */
  async press(key) {
    const text = key.length === 1 ? key : undefined;
    await this.send("Input.dispatchKeyEvent", { type: "keyDown", key, text });
    await this.send("Input.dispatchKeyEvent", { type: "keyUp", key });
  }

  /** Presses the mouse at the first place, moves it through the others and lets go at the last. */
  async drag(...places) {
    const left = { button: "left", clickCount: 1 };
    const mouse = (type, [x, y]) => this.send("Input.dispatchMouseEvent", { type, x, y, ...left });
    await mouse("mousePressed", places[0]);
    for (const place of places.slice(1)) await mouse("mouseMoved", place);
    await mouse("mouseReleased", places.at(-1));
  }

  /** @returns a picture of what is visible, as a PNG */
  async picture() {
    return Buffer.from((await this.send("Page.captureScreenshot", { format: "png" })).data, "base64");
  }
}
