// Exitance of points from the ratio of their current to their baked indirect light
// (`lambent.core.answer.Points.exitance`).

#include "answer.wgsl"

struct Exitance {
    points: u32,
    by_patch: u32,  // 1: the ratio is taken at patches; 0: at points
    least: f32,  // light below which a ratio is 1
    step: f32,  // over the change of exitance
}

@group(0) @binding(0) var<uniform> exitance: Exitance;
@group(0) @binding(1) var<storage, read> points: array<vec4u>;  // patch, material, point on the other side
@group(0) @binding(2) var<storage, read> lights: array<f32>;  // direct, then all baked light of each point
@group(0) @binding(3) var<storage, read> albedos: array<vec4f>;  // reflected by material, then transmitted
@group(0) @binding(4) var<storage, read> now: array<f32>;  // indirect light
@group(0) @binding(5) var<storage, read> baked: array<f32>;
@group(0) @binding(6) var<storage, read> seen: array<f32>;  // indirect light that points gather, as baked
@group(0) @binding(7) var<storage, read_write> sent: array<f32>;

fn light_of(point: u32) -> vec3f {
    let at = 3u * select(point, points[point].x, exitance.by_patch != 0u);
    let ratio = ratio_of(vec3f(now[at], now[at + 1u], now[at + 2u]),
                         vec3f(baked[at], baked[at + 1u], baked[at + 2u]), exitance.least);
    let k = 6u * point;
    let direct = vec3f(lights[k], lights[k + 1u], lights[k + 2u]);
    let indirect = vec3f(lights[k + 3u], lights[k + 4u], lights[k + 5u]) - direct;
    let most = MOST_EXCESS * vec3f(seen[3u * point], seen[3u * point + 1u], seen[3u * point + 2u]);
    let excess = max(indirect - most, vec3f(0.0));  // does not grow
    return direct + indirect * ratio - excess * max(ratio - 1.0, vec3f(0.0));
}

@compute @workgroup_size(256) fn exitance_main(@builtin(global_invocation_id) id: vec3u) {
    let point = id.x;
    if (point >= exitance.points) { return; }
    let about = points[point];
    var light = albedos[about.y].rgb * light_of(point);
    if (about.z != point) { light += albedos[arrayLength(&albedos) / 2u + about.y].rgb * light_of(about.z); }
    if (exitance.step != 1.0) {
        let before = vec3f(sent[3u * point], sent[3u * point + 1u], sent[3u * point + 2u]);
        light = before + exitance.step * (light - before);
    }
    sent[3u * point] = light.r;
    sent[3u * point + 1u] = light.g;
    sent[3u * point + 2u] = light.b;
}
