// Folds the idle one of two curves into the transport, as rows of wavelets: `lambent.editing.folding` on a GPU.
//
// A workgroup computes the rows of two neighbouring points, which share the words of a row. It reads a point's pairs in
// batches, and each thread sums the pairs of its own bands, because WGSL has no atomic sums of floats.

#include "edited.wgsl"
#include "wavelet_taps.wgsl"

const LANES = 64u;
const MOST = 256u;  // most bands of a curve

struct Fold {
    edited: u32,  // 0 or 1: which of the two curves
    bands: u32,   // of the edited curve, a power of two
    second: u32,  // bands of the second curve, a power of two
    idle: array<vec4f>,  // means of the other curve over its bands
}

@group(0) @binding(0) var<storage, read> fold: Fold;
@group(1) @binding(1) var<storage, read> spans: array<vec2u>;  // ranges of the piece's points in `steps` and `values`
@group(1) @binding(2) var<storage, read> steps: array<u32>;
@group(1) @binding(3) var<storage, read> values: array<u32>;
@group(1) @binding(4) var<storage, read_write> transport: array<u32>;

var<workgroup> step: array<u32, LANES>;
var<workgroup> light: array<vec3f, LANES>;
var<workgroup> row: array<vec3f, MOST>;
var<workgroup> before: array<vec3f, MOST>;
var<workgroup> left: array<vec3f, MOST>;  // row of the first point

// Difference between an entry's pair of bands and the next entry's, one byte per entry.
fn step_of(entry: u32) -> u32 {
    return (steps[entry / 4u] >> (8u * (entry % 4u))) & 0xffu;
}

// Transport of an entry: RGB9E5, see `lambent.baked.shared_exponent`.
fn value_of(entry: u32) -> vec3f {
    let bits = values[entry];
    let unit = bitcast<f32>(((bits >> 27u) + 103u) << 23u);
    return unit * vec3f(vec3u(bits, bits >> 9u, bits >> 18u) & vec3u(511u));
}

fn sum_of(point: u32, lane: u32) {
    for (var i = lane; i < fold.bands; i += LANES) { row[i] = vec3f(0.0); }
    let span = select(vec2u(0u), spans[min(point, piece.pixels - 1u)], point < piece.pixels);
    let shift = firstTrailingBit(fold.second);
    var pair = 0xffffffffu;  // -1
    for (var first = span.x; first < span.y; first += LANES) {
        let entry = first + lane;
        if (entry < span.y) {
            step[lane] = step_of(entry);
            light[lane] = value_of(entry);
        }
        workgroupBarrier();
        for (var k = 0u; k < min(LANES, span.y - first); k++) {
            pair += step[k];
            var bands = vec2u(pair >> shift, pair & (fold.second - 1u));
            if (fold.edited == 1u) { bands = bands.yx; }
            if (bands.x % LANES == lane) { row[bands.x] += fold.idle[bands.y].rgb * light[k]; }  // no other thread
        }
        workgroupBarrier();
    }
}

// `lambent.baked.transport.wavelets.transformed` of `row`, in place.
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
