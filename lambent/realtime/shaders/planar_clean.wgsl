// Cleaning of interleaved light, first half: along rows, over pixels of the same reflector and material.

#include "screen.wgsl"

@group(0) @binding(0) var planar_rough: texture_2d<f32>;
@group(0) @binding(1) var planar_sharp: texture_2d<f32>;

struct Cleaned {
    @location(0) narrow: vec4f, // weighted light of five pixels; a: weights
    @location(1) wide: vec4f,   // of nine
    @location(2) least: vec4f,  // x: least distance in the mirror direction, of nine
}

@fragment fn planar_clean_main(screen: Screen) -> Cleaned {
    let at = vec2i(screen.position.xy);
    let last = vec2i(textureDimensions(planar_rough)) - 1;
    let number = textureLoad(planar_sharp, at, 0).a;
    if (number == 0.0) { return Cleaned(vec4f(0.0), vec4f(0.0), vec4f(0.0)); }
    var narrow = vec4f(0.0);
    var wide = vec4f(0.0);
    var least = 6e4;
    for (var i = -4; i <= 4; i++) {
        let there = vec2i(clamp(at.x + i, 0, last.x), at.y);
        let found = textureLoad(planar_rough, there, 0);
        let light = select(vec4f(0.0), vec4f(found.rgb, 1.0), textureLoad(planar_sharp, there, 0).a == number);
        wide += light * select(1.0, 0.5, abs(i) == 4);
        narrow += light * select(select(1.0, 0.5, abs(i) == 2), 0.0, abs(i) > 2);
        least = min(least, select(6e4, found.a, light.a > 0.0));
    }
    return Cleaned(narrow, wide, vec4f(least, 0.0, 0.0, 0.0));
}
