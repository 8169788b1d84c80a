/** How far a probe is. */
export interface Progress {
  /** Parts that are done, and all of them. */
  done: number;
  of: number;
  /** What was done last, in words. */
  text: string;
}

/** What `findPairs` may be asked for beside the boxes. */
export interface FindOptions extends Memberships {
  /** Run this algorithm, for instance "bvh@cpu1" or in short "bvh". `algorithms()` lists them. */
  algorithm?: string;
  /** The most pairs: with more, the search ends with an error. */
  limit?: number;
  /** Boxes are a pair too if they are no further apart than this on each axis. */
  margin?: number;
}

/** What a box or body may meet: one value for all boxes, or an array with one for each. */
export interface Memberships {
  /** The groups of the box, one bit each. By default all. */
  groups?: Uint32Array | number;
  /** The groups that it meets, one bit each. The masks of both boxes of a pair must allow the other. By default all. */
  masks?: Uint32Array | number;
  /** What it is a part of, such as a ragdoll: boxes with the same owner do not meet. 0, the default, is no owner. */
  owner?: Uint32Array | number;
  /** Whether it never moves, not 0 in an array: two fixed boxes do not meet. */
  fixed?: Uint8Array | boolean;
}

/** What a query found, the nearest first. */
export interface Hits {
  handles: BigUint64Array;
  /** Of `nearest`: lengths. Of `castRay`: lengths of the direction. 0 for a body around the point or origin. */
  distances: Float32Array;
}

/** Which algorithm ran in the last frame, and why. */
export interface Decision {
  /** The algorithm, for instance "grid-sap@cpu1". */
  algorithm: string;
  /** The reason, with the time that was expected of it and of the next best. */
  because: string;
  /** Whether another algorithm ran in the frame before. */
  switched: boolean;
  /** Whether it is not the cheapest and ran to find out what it costs. */
  trial: boolean;
}
