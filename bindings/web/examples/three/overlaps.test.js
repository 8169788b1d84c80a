import assert from "node:assert/strict";
import test from "node:test";
import { Box3, BoxGeometry, Mesh, Raycaster, Vector3 } from "three";
import { Overlaps } from "./overlaps.js";

test("meshes that move meet as their boxes do", () => {
  let state = 1;
  const random = () => (state = state * 48271 % 2147483647) / 2147483647;
  const place = () => new Vector3(random(), random(), random()).multiplyScalar(8);
  const geometry = new BoxGeometry();
  const meshes = Array.from({ length: 150 }, (_, k) => Object.assign(new Mesh(geometry), { name: `${k}` }));
  const overlaps = new Overlaps();
  for (const [k, mesh] of meshes.entries()) {
    mesh.position.copy(place());
    overlaps.add(mesh, { fixed: k < 50 });
  }
  const key = (pair) => pair.map(({ name }) => Number(name)).sort((a, b) => a - b).join();
  let before = new Set();
  for (let frame = 0; frame < 30; frame++) {
    for (const mesh of meshes.slice(50)) {
      mesh.position.addScaledVector(place().subScalar(4), 0.05);
      mesh.rotation.x += 0.1;
    }
    if (frame % 10 === 9) overlaps.remove(meshes.pop());
    const { begun, ended } = overlaps.update();
    // The space has boxes of 32 bits.
    const boxes = meshes.map((mesh) => {
      const { min, max } = new Box3().setFromObject(mesh);
      return new Box3(...[min, max].map((corner) => new Vector3(...Float32Array.from(corner))));
    });
    const now = new Set();
    meshes.forEach((a, i) => meshes.slice(i + 1).forEach((b, k) => {
      if (i + 1 + k >= 50 && boxes[i].intersectsBox(boxes[i + 1 + k])) now.add(key([a, b]));
    }));
    assert.ok(now.size > 20);
    assert.deepEqual(new Set(overlaps.pairs().map(key)), now);
    assert.deepEqual(new Set(begun.map(key)), new Set([...now].filter((pair) => !before.has(pair))));
    assert.deepEqual(new Set(ended.map(key)), new Set([...before].filter((pair) => !now.has(pair))));
    before = now;
    const ray = new Raycaster(new Vector3(4, 4, -9), new Vector3(0, 0, 1));
    const met = meshes.filter((_, k) => ray.ray.intersectsBox(boxes[k])).map(({ name }) => name);
    assert.deepEqual(overlaps.along(ray).map(({ name }) => name).sort(), met.sort());
  }
});

test("after a mesh without a valid place the others are where they are", () => {
  const overlaps = new Overlaps();
  const [a, b, c] = [0, 5, 10].map((x) => new Mesh(new BoxGeometry()).translateX(x));
  [a, b, c].forEach((mesh) => overlaps.add(mesh));
  overlaps.update();
  b.position.x = 0.5;
  c.position.x = NaN;
  assert.throws(() => overlaps.update(), /not a number/);
  c.position.x = 10;
  assert.deepEqual(overlaps.update().begun, [[a, b]]);
});
