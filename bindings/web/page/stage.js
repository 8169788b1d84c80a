import { colours } from "./format.js";

/** Half of the vertical opening of the camera, as a tangent. */
const OPENING = 0.45;
/** Share of the boxes at each end of an axis that the camera leaves out, such as objects parked far away. */
const OUTSIDE = 0.03;
/** Boxes that are sampled for the camera. */
const SAMPLE = 500;

const add = (a, b, scale) => [0, 1, 2].map((i) => a[i] + b[i] * scale);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** Draws boxes with one call of WebGL2 a frame, and finds those under a pointer. The third axis points up. */
export class Stage {
  #azimuth = 0.6;
  #elevation = 0.42;
  #zoom = 1;
  #canvas;
  #shaders;
  #gl;
  #program;
  #buffers;
  #colours;
  /** What the camera shows, and where it has come to on its way there. */
  #bounds = null;
  #centre = [0, 0, 0];
  #radius = 0;

  /** Takes the texts of the vertex and the fragment shader. Throws if the browser has no WebGL2. */
  constructor(canvas, shaders) {
    [this.#canvas, this.#shaders] = [canvas, shaders];
    this.#gl = canvas.getContext("webgl2", { antialias: true, alpha: false });
    if (!this.#gl) throw new Error("this browser offers no WebGL2");
    this.prepare();
  }

  /** Builds what the context holds: at first, and after the browser restored a lost one. */
  prepare() {
    const gl = this.#gl;
    this.#program = gl.createProgram();
    for (const [i, kind] of [gl.VERTEX_SHADER, gl.FRAGMENT_SHADER].entries()) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, this.#shaders[i]);
      gl.compileShader(shader);
      gl.attachShader(this.#program, shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader) ?? "lost");
    }
    gl.linkProgram(this.#program);
    gl.useProgram(this.#program);
    gl.enable(gl.DEPTH_TEST);
    this.#buffers = [gl.createBuffer(), gl.createBuffer()];
    const attribute = (place, size, type, stride, offset) => {
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, size, type, type === gl.UNSIGNED_BYTE, stride, offset);
      gl.vertexAttribDivisor(place, 1);
    };
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#buffers[0]);
    attribute(0, 3, gl.FLOAT, 24, 0);
    attribute(1, 3, gl.FLOAT, 24, 12);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#buffers[1]);
    attribute(2, 1, gl.UNSIGNED_BYTE, 0, 0);
    this.recolour();
  }

  /** Reads the colours of the style sheet. */
  recolour() {
    this.#colours = colours(["paper", "body", "accent"]);
    for (const [name, hex] of Object.entries(this.#colours)) {
      this.#colours[name] = [1, 3, 5].map((digit) => parseInt(hex.slice(digit, digit + 2), 16) / 255);
    }
  }

  /** Lets the camera find the scene anew. */
  reframe() {
    this.#bounds = null;
  }

  /** Turns the camera by angles in radians. */
  turn(azimuth, elevation) {
    this.#azimuth += azimuth;
    this.#elevation = Math.min(1.5, Math.max(-0.2, this.#elevation + elevation));
  }

  magnify(factor) {
    this.#zoom = Math.min(20, Math.max(0.3, this.#zoom * factor));
  }

  /** Draws a frame. `pace` is the share of the way to its aim that the camera goes, 0 to 1. */
  draw(boxes, hits, pace) {
    const [gl, canvas] = [this.#gl, this.#canvas];
    const objects = boxes.length / 6;
    const ratio = objects > 50_000 ? 1 : Math.min(devicePixelRatio, 2);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((s) => Math.max(1, Math.round(s * ratio)));
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    this.#follow(boxes, pace);
    gl.viewport(0, 0, width, height);
    const { eye, right, up, ahead, scale, distance } = this.#camera();
    const near = Math.max(distance - 3 * this.#radius, this.#radius * 0.02);
    const lens = [...scale, near, distance + 20 * this.#radius];
    const uniforms = { ...this.#colours, eye, right, up, ahead, lens, scene: [distance, this.#radius] };
    for (const [name, values] of Object.entries(uniforms)) {
      gl[`uniform${values.length}fv`](gl.getUniformLocation(this.#program, name), values);
    }
    gl.clearColor(...this.#colours.paper, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#buffers[0]);
    gl.bufferData(gl.ARRAY_BUFFER, boxes, gl.STREAM_DRAW);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#buffers[1]);
    gl.bufferData(gl.ARRAY_BUFFER, hits, gl.STREAM_DRAW);
    gl.drawArraysInstanced(gl.TRIANGLES, 0, 18, objects);
  }

  /** @returns the index of the nearest box under a point of the canvas in CSS pixels, or -1 */
  pick(boxes, x, y) {
    const { eye, right, up, ahead, scale } = this.#camera();
    const across = (2 * x / this.#canvas.clientWidth - 1) / scale[0];
    const upwards = (1 - 2 * y / this.#canvas.clientHeight) / scale[1];
    const ray = add(add(ahead, right, across), up, upwards);
    let [nearest, found] = [Infinity, -1];
    for (let i = 0; i < boxes.length; i += 6) {
      let [enter, leave] = [0, nearest];
      for (let axis = 0; axis < 3; axis++) {
        const low = (boxes[i + axis] - eye[axis]) / ray[axis];
        const high = (boxes[i + 3 + axis] - eye[axis]) / ray[axis];
        enter = Math.max(enter, Math.min(low, high));
        leave = Math.min(leave, Math.max(low, high));
      }
      if (enter < leave) [nearest, found] = [enter, i / 6];
    }
    return found;
  }

  /** @returns the indices of the boxes whose middle is drawn within `radius` CSS pixels of a point */
  within(boxes, x, y, radius) {
    const { eye, right, up, ahead, scale } = this.#camera();
    const [width, height] = [this.#canvas.clientWidth / 2, this.#canvas.clientHeight / 2];
    const [way, found] = [[0, 0, 0], []];
    for (let i = 0; i < boxes.length; i += 6) {
      for (let axis = 0; axis < 3; axis++) way[axis] = 0.5 * (boxes[i + axis] + boxes[i + 3 + axis]) - eye[axis];
      const depth = dot(way, ahead);
      const across = width * (1 + scale[0] * dot(way, right) / depth) - x;
      const down = height * (1 - scale[1] * dot(way, up) / depth) - y;
      if (depth > 0 && across * across + down * down < radius * radius) found.push(i / 6);
    }
    return found;
  }

  #camera() {
    const [sa, ca, se, ce] = [this.#azimuth, this.#elevation].flatMap((angle) => [Math.sin(angle), Math.cos(angle)]);
    const [right, up, ahead] = [[ca, sa, 0], [-sa * se, ca * se, ce], [-sa * ce, ca * ce, -se]];
    const aspect = this.#canvas.clientWidth / Math.max(1, this.#canvas.clientHeight);
    const scale = [1 / (OPENING * aspect), 1 / OPENING];
    const distance = 1.05 * this.#radius / (OPENING * Math.min(1, aspect) * this.#zoom);
    return { right, up, ahead, scale, distance, eye: add(this.#centre, ahead, -distance) };
  }

  /** Widens the bounds so that most boxes are within them, and moves the camera towards them. */
  #follow(boxes, pace) {
    const objects = boxes.length / 6;
    if (objects === 0) return;
    const length = Math.min(objects, SAMPLE);
    const sample = Array.from({ length }, (_, i) => Math.floor(i * objects / length));
    const outside = Math.floor(sample.length * OUTSIDE);
    const bounds = [0, 1, 2].map((axis) => [
      sample.map((i) => boxes[i * 6 + axis]).sort((a, b) => a - b)[outside],
      sample.map((i) => boxes[i * 6 + 3 + axis]).sort((a, b) => b - a)[outside],
    ]);
    const first = this.#bounds === null;
    this.#bounds = first ? bounds
      : this.#bounds.map(([low, high], axis) => [Math.min(low, bounds[axis][0]), Math.max(high, bounds[axis][1])]);
    const middle = this.#bounds.map(([low, high]) => 0.5 * (low + high));
    const radius = 0.5 * Math.hypot(...this.#bounds.map(([low, high]) => high - low));
    const share = first ? 1 : pace;
    this.#centre = this.#centre.map((c, axis) => c + (middle[axis] - c) * share);
    this.#radius += (radius - this.#radius) * share;
  }
}
