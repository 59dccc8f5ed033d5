// Sums of transport rows, two pixels per thread: `lambent.editing.products.add_rows` on a GPU.

#include "edited.wgsl"

struct Row {
    index: u32,
    weight: array<f32, 3>,
}
struct Sum {
    begin: u32,  // pixels of the layer
    end: u32,
    anew: u32,   // 1: the sum replaces the previous values
    count: u32,
    rows: array<Row>,
}

@group(0) @binding(0) var<storage, read> sum: Sum;
@group(1) @binding(1) var<storage, read> transport: array<u32>;  // half floats by row, channel and pixel
@group(1) @binding(2) var<storage, read_write> picture: array<vec2f>;  // by channel and pixel

@compute @workgroup_size(256) fn sum_main(@builtin(global_invocation_id) id: vec3u) {
    let begin = max(sum.begin, piece.first) - piece.first;
    let end = min(sum.end - piece.first, piece.pixels);
    let word = begin / 2u + id.x;
    if (2u * word >= end) { return; }
    let at = id.y * piece.words + word;
    let before = picture[at];
    var seen = select(before, vec2f(0.0), sum.anew != 0u);
    for (var k = 0u; k < sum.count; k++) {
        let weight = sum.rows[k].weight[id.y];
        if (weight != 0.0) {  // uniform in the workgroup: skips whole rows
            seen += weight * unpack2x16float(transport[3u * piece.words * sum.rows[k].index + at]);
        }
    }
    let pixel = 2u * word + vec2u(0u, 1u);
    picture[at] = select(before, seen, (pixel >= vec2u(begin)) & (pixel < vec2u(end)));
}
