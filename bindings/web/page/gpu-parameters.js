/** The parameters of the GPU that WebGPU lets a page measure, under the names of a report. */

/** Bytes of a transfer, samples of each parameter, and repetitions of what is shorter than a tick of the clock. */
const [BYTES, SAMPLES, TIMES] = [33_554_432, 5, 20];
/** Dependent dispatches in a pass. */
const CHAIN = 500;
/** Invocations of the arithmetic in workgroups of 64, operations of one in a round, and milliseconds of a sample. */
const [GROUPS, OPERATIONS, LONG] = [4096, 256, 15];

const SHADER = `
  @group(0) @binding(0) var<storage, read_write> word: array<u32>;
  @compute @workgroup_size(1) fn step() { word[0]++; }
  // Four chains of four lanes, in rounds of eight multiply-adds. 1 is their fixed point.
  @compute @workgroup_size(64) fn multiply_add(@builtin(global_invocation_id) id: vec3u) {
    let m = vec4f(0.5);
    var a = vec4f(f32(id.x & 63));
    var b = a + 4; var c = a + 8; var d = a + 12;
    for (var r = 0u; r < word[1]; r++) {
      ${"a = fma(a, m, m); b = fma(b, m, m); c = fma(c, m, m); d = fma(d, m, m);\n".repeat(8)}
    }
    // Never true, but the compiler cannot know.
    if (dot(a + b + c + d, m) < -1) { word[0] = id.x; }
  }`;

/** @returns `{ name, samples }`; rejects if this browser has no GPU */
export async function gpuParameters() {
  const adapter = await navigator.gpu?.requestAdapter();
  if (!adapter) throw new Error("this browser has no WebGPU, or no GPU for it");
  const device = await adapter.requestDevice();
  const { queue } = device;
  const { COPY_SRC, COPY_DST, MAP_READ, MAP_WRITE, STORAGE } = GPUBufferUsage;
  const buffer = (usage, size = BYTES) => device.createBuffer({ size, usage });
  const [up, down, word] = [buffer(MAP_WRITE | COPY_SRC), buffer(MAP_READ | COPY_DST), buffer(MAP_READ | COPY_DST, 4)];
  const [here, there] = [0, 1].map(() => buffer(STORAGE | COPY_SRC | COPY_DST));
  const module = device.createShaderModule({ code: SHADER });
  const bound = {};
  for (const entryPoint of ["step", "multiply_add"]) {
    const pipeline = await device.createComputePipelineAsync({ layout: "auto", compute: { module, entryPoint } });
    const entries = [{ binding: 0, resource: { buffer: here } }];
    bound[entryPoint] = [pipeline, device.createBindGroup({ layout: pipeline.getBindGroupLayout(0), entries })];
  }
  const submit = (record) => {
    const encoder = device.createCommandEncoder();
    record(encoder);
    queue.submit([encoder.finish()]);
  };
  const dispatch = async (name, groups, times) => {
    submit((encoder) => {
      const pass = encoder.beginComputePass();
      pass.setPipeline(bound[name][0]);
      pass.setBindGroup(0, bound[name][1]);
      for (let k = 0; k < times; k++) pass.dispatchWorkgroups(groups);
      pass.end();
    });
    await queue.onSubmittedWorkDone();
  };
  const copy = (from, to, bytes, times = 1) => submit((encoder) => {
    for (let k = 0; k < times; k++) encoder.copyBufferToBuffer(from, 0, to, 0, bytes);
  });
  /** Nanoseconds of `work`, the mean of `times`. */
  const timed = async (work, times = 1) => {
    const start = performance.now();
    for (let k = 0; k < times; k++) await work();
    return Math.max(performance.now() - start, 0.001) * 1e6 / times;
  };
  const read = async (from, to, bytes, array) => {
    copy(from, to, bytes);
    await to.mapAsync(GPUMapMode.READ);
    array.set(new Uint8Array(to.getMappedRange(0, bytes)));
    to.unmap();
  };
  const sent = new Uint8Array(Uint32Array.from({ length: BYTES / 4 }, (_, k) => Math.imul(k, 2654435761)).buffer);
  const received = new Uint8Array(BYTES);
  const rounds = async (count) => {
    queue.writeBuffer(here, 0, Uint32Array.of(0, count));
    return timed(() => dispatch("multiply_add", GROUPS, 1));
  };
  let enough = 1;
  for (await rounds(1); enough < 1 << 20 && await rounds(enough) < LONG * 1e6;) enough *= 2;
  const samples = {};
  const add = (name, value) => (samples[name] ??= []).push(value);
  for (let sample = 0; sample < SAMPLES; sample++) {
    await up.mapAsync(GPUMapMode.WRITE);
    add("upload_gb_per_s", BYTES / await timed(async () => {
      new Uint8Array(up.getMappedRange()).set(sent);
      up.unmap();
      copy(up, there, BYTES);
      await queue.onSubmittedWorkDone();
    }));
    add("download_gb_per_s", BYTES / await timed(() => read(there, down, BYTES, received)));
    add("copy_gb_per_s", 2 * TIMES * BYTES / await timed(async () => {
      copy(here, there, BYTES, TIMES);
      await queue.onSubmittedWorkDone();
    }));
    const one = await timed(() => dispatch("step", 1, 1), TIMES);
    add("round_trip_ns", one);
    add("dispatch_ns", Math.max(await timed(() => dispatch("step", 1, 1 + CHAIN)) - one, 1) / CHAIN);
    add("read_back_ns", await timed(() => read(here, word, 4, received), TIMES));
    add("arithmetic_gflop_per_s", OPERATIONS * 64 * GROUPS * enough / await rounds(enough));
  }
  device.destroy();
  const { vendor, architecture, description } = adapter.info;
  return { name: description || `${vendor} ${architecture}`.trim() || "unknown", samples };
}
