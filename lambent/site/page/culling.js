// What a camera sees of a scene: lambent/realtime/objects/clusters.py in JavaScript.

const SLACK = 1e-5, // of the largest term of a plane's equation: the GPU computes in single precision
  SLIVER_PX = 1.5,
  FEW_PX = 4,
  MERGED_GAP = 256; // faces; runs with a smaller gap are drawn in one call
const WORDS = 10; // of a cluster's sizes: middle, half, largest (3 each), sliver; m

/** @typedef {number[][]} Rows the rows of a matrix from world to clip space */
/** @typedef {[number, number][]} Runs begin and end of runs of faces */

/** The clusters of a scene. */
export class Clusters {
  /** @param {Uint32Array} places first face, the one after the last, object @param {Float32Array} sizes */
  constructor(places, sizes) {
    this.places = places;
    this.sizes = sizes;
    this.count = places.length / 3;
  }

  /** Which clusters a camera may see. @param {Rows} clip */
  visible([x, y, z, w]) {
    const { sizes } = this,
      found = new Uint8Array(this.count).fill(1);
    /** @param {number[]} a @param {number} s */
    const plus = (a, s) => w.map((value, i) => value + s * a[i]);
    for (const [a, b, c, d] of [plus(x, 1), plus(x, -1), plus(y, -1), plus(y, 1), z, plus(z, -1)]) {
      const p = Math.abs(a),
        q = Math.abs(b),
        r = Math.abs(c),
        s = Math.abs(d);
      for (let k = 0, i = 0; k < this.count; k++, i += WORDS) {
        const middle = sizes[i] * a + sizes[i + 1] * b + sizes[i + 2] * c + d,
          half = sizes[i + 3] * p + sizes[i + 4] * q + sizes[i + 5] * r;
        if (middle + half >= 0) continue;
        const reach = sizes[i + 6] * p + sizes[i + 7] * q + sizes[i + 8] * r + s;
        if (middle + half < -SLACK * reach) found[k] = 0; // what is not a number is drawn
      }
    }
    return found;
  }

  /** Of the visible clusters those with faces that may miss all pixel centres. @param {Rows} clip @param {number} heightPx @param {Uint8Array} visible */
  thin(clip, heightPx, visible) {
    const [, y, , w] = clip,
      { sizes } = this,
      found = new Uint8Array(this.count);
    const perM = 2 / (Math.hypot(y[0], y[1], y[2]) * heightPx);
    for (let k = 0, i = 0; k < this.count; k++, i += WORDS) {
      if (!visible[k]) continue;
      let awayM = w[3];
      for (let j = 0; j < 3; j++) awayM += sizes[i + j] * w[j] + sizes[i + 3 + j] * Math.abs(w[j]);
      const pixelM = Math.max(awayM, 0) * perM,
        side = 2 * Math.max(sizes[i + 3], sizes[i + 4], sizes[i + 5]);
      if (!(sizes[i + 9] > SLIVER_PX * pixelM) || !(side > FEW_PX * pixelM)) found[k] = 1;
    }
    return found;
  }

  /** Runs of neighbouring clusters of one object. @param {Uint8Array} among @returns {Runs} */
  runs(among) {
    const { places } = this,
      /** @type {Runs} */ found = [];
    let owner = -1;
    for (let k = 0; k < this.count; k++) {
      if (!among[k]) continue;
      const begin = places[3 * k],
        end = places[3 * k + 1],
        last = found[found.length - 1];
      if (last && last[1] === begin && owner === places[3 * k + 2]) last[1] = end;
      else found.push([begin, end]);
      owner = places[3 * k + 2];
    }
    return found;
  }
}

/** First and count of the faces to draw of a range. @param {Runs} runs @param {number} first @param {number} count @returns {[number, number][]} */
export function within(runs, first, count) {
  const last = first + count,
    /** @type {[number, number][]} */ found = [];
  let low = 0,
    high = runs.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (runs[middle][1] <= first) low = middle + 1;
    else high = middle;
  }
  for (let k = low; k < runs.length && runs[k][0] < last; k++) {
    const begin = Math.max(runs[k][0], first),
      end = Math.min(runs[k][1], last),
      before = found[found.length - 1];
    if (before && begin - before[0] - before[1] < MERGED_GAP) before[1] = end - before[0];
    else found.push([begin, end - begin]);
  }
  return found;
}
