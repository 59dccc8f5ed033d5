// Irradiance of answering texels from the indirect light at points near each (`lambent.core.answer.Answer.at_texels`).

#include "answer.wgsl"
#include "answer_near.wgsl"

struct Texels {
    texels: u32,
    least: f32,  // light below which a ratio is 1
}

@group(0) @binding(0) var<uniform> about: Texels;
@group(0) @binding(1) var<storage, read> near: array<u32>;
@group(0) @binding(2) var<storage, read> indirect: array<f32>;  // of points
@group(0) @binding(3) var<storage, read> gathered: array<f32>;  // baked indirect light of texels, as gathered
@group(0) @binding(4) var<storage, read> direct: array<f32>;
@group(0) @binding(5) var<storage, read> baked: array<f32>;
@group(0) @binding(6) var<storage, read_write> irradiance: array<f32>;

@compute @workgroup_size(256) fn texels_main(@builtin(global_invocation_id) id: vec3u) {
    let texel = id.x;
    if (texel >= about.texels) { return; }
    let at = 3u * texel;
    let before = vec3f(gathered[at], gathered[at + 1u], gathered[at + 2u]);
    let arrives = vec3f(direct[at], direct[at + 1u], direct[at + 2u]);
    let ratio = ratio_of(mean_near(texel), before, about.least);
    let bounced = vec3f(baked[at], baked[at + 1u], baked[at + 2u]) - arrives;
    let excess = max(bounced - MOST_EXCESS * before, vec3f(0.0));
    let light = arrives + bounced * ratio - excess * max(ratio - vec3f(1.0), vec3f(0.0));
    irradiance[at] = light.r;
    irradiance[at + 1u] = light.g;
    irradiance[at + 2u] = light.b;
}
