/** Pairs by their lower index: the partners of `a` are `partners[starts[a]]` up to `partners[starts[a + 1]]`. */
function byLower(pairs, objects, rename) {
  const starts = new Uint32Array(objects + 2);
  const partners = new Uint32Array(pairs.length / 2);
  const each = (visit) => {
    for (let i = 0; i < pairs.length; i += 2) {
      const a = rename ? rename[pairs[i]] : pairs[i];
      const b = rename ? rename[pairs[i + 1]] : pairs[i + 1];
      if (a >= 0 && b >= 0) visit(Math.min(a, b), Math.max(a, b));
    }
  };
  // Counted two places on, so that placing a pair moves the start of the next object to where it belongs.
  each((a) => { starts[a + 2]++; });
  for (let a = 2; a < starts.length; a++) starts[a] += starts[a - 1];
  each((a, b) => { partners[starts[a + 1]++] = b; });
  return { starts, partners };
}

/** Compares the pairs of each frame with those of the previous one. */
export class Encounters {
  begun = 0;
  ended = 0;
  /** Pairs of each object, at most 255. */
  hits = new Uint8Array(0);
  #pairs = new Uint32Array(0);
  #objects = 0;
  #index = byLower(this.#pairs, 0);
  /** For each object its index in the previous frame, -1 for a new one; null while nobody came or left. */
  #was = null;

  /** The object at `index` left, and the last of `objects` took its place. */
  removed(index, objects) {
    this.#was ??= Array.from({ length: this.#objects }, (_, i) => i);
    while (this.#was.length < objects) this.#was.push(-1);
    this.#was[index] = this.#was[objects - 1];
    this.#was.length = objects - 1;
  }

  /** Counts what began and ended. `pairs` is kept. */
  update(pairs, objects) {
    const before = this.#was ? byLower(this.#pairs, objects, this.#renames(objects)) : this.#index;
    const index = byLower(pairs, objects);
    const seen = new Uint32Array(Math.max(objects, this.#objects));
    let stayed = 0;
    for (let a = 0; a < Math.min(objects, before.starts.length - 2); a++) {
      for (let i = before.starts[a]; i < before.starts[a + 1]; i++) seen[before.partners[i]] = a + 1;
      for (let i = index.starts[a]; i < index.starts[a + 1]; i++) stayed += seen[index.partners[i]] === a + 1;
    }
    this.begun = pairs.length / 2 - stayed;
    this.ended = this.#pairs.length / 2 - stayed;
    if (this.hits.length === objects) this.hits.fill(0);
    else this.hits = new Uint8Array(objects);
    for (const object of pairs) if (this.hits[object] < 255) this.hits[object]++;
    [this.#pairs, this.#objects, this.#index, this.#was] = [pairs, objects, index, null];
  }

  /** @returns for each object of the previous frame its index among those of this one, -1 if it left */
  #renames(objects) {
    const now = new Int32Array(this.#objects).fill(-1);
    this.#was.slice(0, objects).forEach((before, index) => { if (before >= 0) now[before] = index; });
    return now;
  }
}
