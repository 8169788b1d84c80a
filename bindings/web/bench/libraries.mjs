/** The pairs of boxes as web developers find them. Each function returns two positions a pair, in any order. */
import { RBush3D } from "rbush-3d";
import { Matrix4 } from "three";
import { BVH } from "three-mesh-bvh";

function overlap(boxes, a, b) {
  return boxes[a] <= boxes[b + 3] && boxes[b] <= boxes[a + 3] && boxes[a + 1] <= boxes[b + 4]
    && boxes[b + 1] <= boxes[a + 4] && boxes[a + 2] <= boxes[b + 5] && boxes[b + 2] <= boxes[a + 5];
}

/** Loads all boxes at once, and searches with each. */
export function rbush3d(boxes) {
  const items = [];
  for (let i = 0; i < boxes.length; i += 6) {
    const [minX, minY, minZ, maxX, maxY, maxZ] = boxes.subarray(i, i + 6);
    items.push({ minX, minY, minZ, maxX, maxY, maxZ, index: i / 6 });
  }
  const tree = new RBush3D().load(items);
  const pairs = [];
  for (const item of items) {
    for (const { index } of tree.search(item)) if (item.index < index) pairs.push(item.index, index);
  }
  return pairs;
}

/** A tree of three-mesh-bvh over boxes, as its `PointsBVH` is one over points. */
class BoxBVH extends BVH {
  constructor(boxes) {
    super();
    this.boxes = boxes;
    this.primitiveBuffer = Uint32Array.from({ length: boxes.length / 6 }, (_, k) => k);
    this.primitiveBufferStride = 1;
    this.init({});
  }

  getRootRanges() {
    return [{ offset: 0, count: this.primitiveBuffer.length }];
  }

  writePrimitiveBounds(i, to, at) {
    const from = 6 * this.primitiveBuffer[i];
    for (let k = 0; k < 6; k++) to[at + k] = this.boxes[from + k];
    return to;
  }
}

/** Casts the tree at itself. */
export function threeMeshBvh(boxes) {
  const tree = new BoxBVH(boxes);
  const { primitiveBuffer: order } = tree;
  const pairs = [];
  tree.bvhcast(tree, new Matrix4(), {
    intersectsRanges(offset1, count1, offset2, count2) {
      for (let i = offset1; i < offset1 + count1; i++) {
        for (let j = offset2; j < offset2 + count2; j++) {
          const [a, b] = [order[i], order[j]];
          if (a < b && overlap(boxes, 6 * a, 6 * b)) pairs.push(a, b);
        }
      }
      return false;
    },
  });
  return pairs;
}

/** Sorts by the lower x, and sweeps. */
export function sweep(boxes) {
  const order = Uint32Array.from({ length: boxes.length / 6 }, (_, k) => 6 * k).sort((a, b) => boxes[a] - boxes[b]);
  const pairs = [];
  for (let i = 0; i < order.length; i++) {
    const a = order[i];
    for (let j = i + 1; j < order.length && boxes[order[j]] <= boxes[a + 3]; j++) {
      if (overlap(boxes, a, order[j])) pairs.push(a / 6, order[j] / 6);
    }
  }
  return pairs;
}
