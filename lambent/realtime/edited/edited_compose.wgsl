// Adds a layer to the image: its sums times scale and the viewer's curve (`lambent.editing.canvas`).

#include "edited.wgsl"

struct Layer {
    scale: vec3f,
    viewed: u32,  // 1: times the curve of the viewer's angle
}

@group(0) @binding(0) var<storage, read> layer: Layer;
@group(1) @binding(1) var<storage, read> picture: array<f32>;
@group(1) @binding(2) var<storage, read> places: array<vec2u>;  // pixel of the image; bits of the place in the curve
@group(1) @binding(3) var<storage, read> curve: array<vec4f>;
@group(1) @binding(4) var<storage, read_write> image: array<vec4f>;

@compute @workgroup_size(256) fn compose_main(@builtin(global_invocation_id) id: vec3u) {
    let pixel = id.x;
    if (pixel >= piece.pixels) { return; }
    let row = 2u * piece.words;
    var light = layer.scale * vec3f(picture[pixel], picture[row + pixel], picture[2u * row + pixel]);
    let place = places[pixel];
    if (layer.viewed != 0u) {
        let step = bitcast<f32>(place.y);
        let knot = u32(clamp(step, 0.0, f32(arrayLength(&curve) - 2u)));
        light *= mix(curve[knot], curve[knot + 1u], clamp(step - f32(knot), 0.0, 1.0)).rgb;
    }
    image[place.x] += vec4f(light, 0.0);
}
