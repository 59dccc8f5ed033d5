// Writes the irradiance of answering texels into the light map's texture.

#include "answer_constants.wgsl"

struct Show {
    texels: u32,
    width: u32,  // of the light map
    layers: u32,  // of the light map, one for each side
    per_unit: f32,  // 1 over the unit of the scene's light
}

@group(0) @binding(0) var<uniform> show: Show;
@group(0) @binding(1) var<storage, read> places: array<u32>;  // twice row * width + column, plus 1 on the other side
@group(0) @binding(2) var<storage, read> irradiance: array<f32>;
@group(0) @binding(3) var light_map: texture_storage_2d_array<rgba16float, write>;

@compute @workgroup_size(256) fn show_main(@builtin(global_invocation_id) id: vec3u) {
    let texel = id.x;
    if (texel >= show.texels || places[texel] % 2u >= show.layers) { return; }
    let at = 3u * texel;
    let light = show.per_unit * vec3f(irradiance[at], irradiance[at + 1u], irradiance[at + 2u]);
    let place = places[texel] / 2u;
    let shown = vec4f(clamp(light, vec3f(0.0), vec3f(HALF_MAX)), 1.0);
    textureStore(light_map, vec2u(place % show.width, place / show.width), places[texel] % 2u, shown);
}
