// Cleaning of interleaved light, first half: along rows, over pixels of the same reflector and material.

#include "screen.wgsl"

@group(0) @binding(0) var planar_rough: texture_2d<f32>;
@group(0) @binding(1) var planar_sharp: texture_2d<f32>;

const TAPS = array<f32, 5>(0.5, 1.0, 1.0, 1.0, 0.5);

struct Cleaned {
    @location(0) sum: vec4f,  // weighted light; a: weights
    @location(1) least: vec4f, // x: least distance in the mirror direction
}

@fragment fn planar_clean_main(screen: Screen) -> Cleaned {
    let at = vec2i(screen.position.xy);
    let last = vec2i(textureDimensions(planar_rough)) - 1;
    let number = textureLoad(planar_sharp, at, 0).a;
    if (number == 0.0) { return Cleaned(vec4f(0.0), vec4f(0.0)); }
    var sum = vec4f(0.0);
    var least = 6e4;
    for (var i = 0; i < 5; i++) {
        let there = vec2i(clamp(at.x + i - 2, 0, last.x), at.y);
        let light = textureLoad(planar_rough, there, 0);
        let weight = select(0.0, TAPS[i], textureLoad(planar_sharp, there, 0).a == number);
        sum += weight * vec4f(light.rgb, 1.0);
        if (weight > 0.0) { least = min(least, light.a); }
    }
    return Cleaned(sum, vec4f(least, 0.0, 0.0, 0.0));
}
