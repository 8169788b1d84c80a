// The meshes of a three.js scene that overlap, and those along a ray: a space of Sapwise beside the scene.
import init, { Space } from "sapwise";
import { Box3 } from "three";

await init();

export class Overlaps {
  #space = new Space();
  /** The mesh of each handle, and the handle of each mesh with the box that the space knows. */
  #meshes = new Map();
  #known = new Map();
  #removed = [];

  /** Adds a mesh. Two fixed ones never meet. */
  add(mesh, { fixed = false } = {}) {
    const box = new Box3().setFromObject(mesh);
    const [handle] = this.#space.insert(numbers([box]), { fixed });
    this.#meshes.set(handle, mesh);
    this.#known.set(mesh, { handle, box });
  }

  remove(mesh) {
    this.#removed.push(this.#known.get(mesh).handle);
    this.#known.delete(mesh);
  }

  /** Takes in what moved, and returns the pairs of meshes that began and ended to overlap. Call it in each frame. */
  update() {
    const [moved, boxes] = [[], []];
    for (const [mesh, known] of this.#known) {
      const box = new Box3().setFromObject(mesh);
      if (box.equals(known.box)) continue;
      moved.push(known);
      boxes.push(box);
    }
    // If one of the boxes is invalid, this throws and sets none.
    this.#space.set(BigUint64Array.from(moved, ({ handle }) => handle), numbers(boxes));
    moved.forEach((known, k) => (known.box = boxes[k]));
    this.#space.remove(BigUint64Array.from(this.#removed));
    this.#space.update();
    const events = { begun: this.#pairs(this.#space.begun()), ended: this.#pairs(this.#space.ended()) };
    this.#removed.splice(0).forEach((handle) => this.#meshes.delete(handle));
    return events;
  }

  /** Returns all pairs of meshes that overlap. */
  pairs() {
    return this.#pairs(this.#space.pairs());
  }

  /** Returns the meshes whose boxes the ray of a Raycaster meets, the first one first. */
  along({ ray, far }) {
    const { handles } = this.#space.castRay(ray.origin.toArray(), ray.direction.toArray(), far);
    return Array.from(handles, (handle) => this.#meshes.get(handle));
  }

  #pairs(handles) {
    const mesh = (k) => this.#meshes.get(handles[k]);
    return Array.from({ length: handles.length / 2 }, (_, k) => [mesh(2 * k), mesh(2 * k + 1)]);
  }
}

const numbers = (boxes) => new Float32Array(boxes.flatMap(({ min, max }) => [...min, ...max]));
