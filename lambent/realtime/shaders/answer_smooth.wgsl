// Indirect light at points, averaged over the points around each (`lambent.core.answer.smoothed`).

#include "answer_near.wgsl"

struct Smooth {
    points: u32,
}

@group(0) @binding(0) var<uniform> smooth_over: Smooth;
@group(0) @binding(1) var<storage, read> near: array<u32>;
@group(0) @binding(2) var<storage, read> indirect: array<f32>;
@group(0) @binding(3) var<storage, read_write> found: array<f32>;

@compute @workgroup_size(256) fn smooth_main(@builtin(global_invocation_id) id: vec3u) {
    let point = id.x;
    if (point >= smooth_over.points) { return; }
    let light = mean_near(point);
    found[3u * point] = light.r;
    found[3u * point + 1u] = light.g;
    found[3u * point + 2u] = light.b;
}
