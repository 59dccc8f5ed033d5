// Transport of two curves with the idle one folded in, as rows of wavelets: `lambent.editing.folding` on a GPU.
//
// A workgroup makes the rows of two neighbouring points, which share the words of a row. It reads a point's pairs in
// batches, and each thread sums those of its bands: shader languages know no atomic sums of floats.

#include "edited.wgsl"
#include "wavelet_taps.wgsl"

const LANES = 64u;
const MOST = 256u;  // bands: pairs name them by bytes

struct Fold {
    edited: u32,  // 0 or 1: which of the two curves
    bands: u32,   // of it, a power of two
    idle: array<vec4f>,  // means of the other curve over its bands
}

@group(0) @binding(0) var<storage, read> fold: Fold;
@group(1) @binding(1) var<storage, read> spans: array<vec2u>;  // of the piece's points, in `pairs` and `values`
@group(1) @binding(2) var<storage, read> pairs: array<u32>;
@group(1) @binding(3) var<storage, read> values: array<u32>;
@group(1) @binding(4) var<storage, read_write> transport: array<u32>;

var<workgroup> band: array<u32, LANES>;
var<workgroup> light: array<vec3f, LANES>;
var<workgroup> row: array<vec3f, MOST>;
var<workgroup> before: array<vec3f, MOST>;
var<workgroup> left: array<vec3f, MOST>;  // row of the first of both points

// Bands of both curves of an entry: two bytes of each.
fn bands_of(entry: u32) -> vec2u {
    let both = pairs[entry / 2u] >> (16u * (entry % 2u));
    return vec2u(both & 0xffu, (both >> 8u) & 0xffu);
}

// Transport of an entry: three half floats of each.
fn value_of(entry: u32) -> vec3f {
    let word = 3u * entry / 2u;
    let first = unpack2x16float(values[word]);
    let second = unpack2x16float(values[word + 1u]);
    return select(vec3f(first, second.x), vec3f(first.y, second), entry % 2u == 1u);
}

fn sum_of(point: u32, lane: u32) {
    for (var i = lane; i < fold.bands; i += LANES) { row[i] = vec3f(0.0); }
    let span = select(vec2u(0u), spans[min(point, piece.pixels - 1u)], point < piece.pixels);
    for (var first = span.x; first < span.y; first += LANES) {
        let entry = first + lane;
        if (entry < span.y) {
            let both = bands_of(entry);
            band[lane] = both[fold.edited];
            light[lane] = fold.idle[both[1u - fold.edited]].rgb * value_of(entry);
        }
        workgroupBarrier();
        for (var k = 0u; k < min(LANES, span.y - first); k++) {
            if (band[k] % LANES == lane) { row[band[k]] += light[k]; }  // this thread's bands alone
        }
        workgroupBarrier();
    }
}

// `lambent.core.wavelets.transformed` of `row`, in place.
fn to_wavelets(lane: u32) {
    for (var size = fold.bands; size > 1u; size /= 2u) {
        for (var i = lane; i < size; i += LANES) { before[i] = row[i]; }
        workgroupBarrier();
        let half = size / 2u;
        for (var i = lane; i < half; i += LANES) {
            let next = select(0u, 2u * i + 2u, i + 1u < half);
            let four = mat4x3f(before[2u * i], before[2u * i + 1u], before[next], before[next + 1u]);
            row[i] = four * TAPS;
            row[half + i] = four * vec4f(TAPS.w, -TAPS.z, TAPS.y, -TAPS.x);
        }
        workgroupBarrier();
    }
}

@compute @workgroup_size(LANES)
fn fold_main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    sum_of(2u * group.x, lane);
    to_wavelets(lane);
    for (var i = lane; i < fold.bands; i += LANES) { left[i] = row[i]; }
    sum_of(2u * group.x + 1u, lane);
    to_wavelets(lane);
    for (var i = lane; i < fold.bands; i += LANES) {
        for (var c = 0u; c < 3u; c++) {
            transport[(3u * i + c) * piece.words + group.x] = pack2x16float(vec2f(left[i][c], row[i][c]));
        }
    }
}
