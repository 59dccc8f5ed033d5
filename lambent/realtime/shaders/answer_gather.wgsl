// Indirect light at points: sums of exitance at the ends of their rays (`lambent.core.answer_rays.gathered`).

#include "answer_constants.wgsl"

struct Gather {
    points: u32,
}

@group(0) @binding(0) var<uniform> gather: Gather;
@group(0) @binding(1) var<storage, read> starts: array<u32>;  // first ray of each point; end of the last point's
@group(0) @binding(2) var<storage, read> ends: array<u32>;  // points nearest to the rays' ends, two in a word
@group(0) @binding(3) var<storage, read> weights: array<u32>;  // powers of two by WEIGHT_STEPS, four in a word; 0 for none
@group(0) @binding(4) var<storage, read> scale: array<f32>;  // one over the rays of each point
@group(0) @binding(5) var<storage, read> sent: array<f32>;
@group(0) @binding(6) var<storage, read_write> found: array<f32>;

@compute @workgroup_size(256) fn gather_main(@builtin(global_invocation_id) id: vec3u) {
    let point = id.x;
    if (point >= gather.points) { return; }
    var sum = vec3f(0.0);
    for (var ray = starts[point]; ray < starts[point + 1u]; ray++) {
        let at = 3u * extractBits(ends[ray / 2u], 16u * (ray % 2u), 16u);
        let code = extractBits(weights[ray / 4u], 8u * (ray % 4u), 8u);
        let weight = select(exp2((f32(code) - WEIGHT_ONE) / WEIGHT_STEPS), 0.0, code == 0u);
        sum += weight * vec3f(sent[at], sent[at + 1u], sent[at + 2u]);
    }
    sum *= scale[point];
    found[3u * point] = sum.r;
    found[3u * point + 1u] = sum.g;
    found[3u * point + 2u] = sum.b;
}
