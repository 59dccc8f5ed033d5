// Cleaning of interleaved light, first half: along rows, over pixels of the same reflector and material.

#include "screen.wgsl"
#include "colour.wgsl"
#include "planar_layers.wgsl"

@group(0) @binding(0) var planar_light: texture_2d_array<f32>;

struct Cleaned {
    @location(0) narrow: vec4f, // see planar_layers.wgsl
    @location(1) wide: vec4f,
    @location(2) least: vec4f,
}

@fragment fn planar_clean_main(screen: Screen) -> Cleaned {
    let at = vec2i(screen.position.xy);
    let last = vec2i(textureDimensions(planar_light)) - 1;
    let number = textureLoad(planar_light, at, PLANAR_SHARP, 0).a;
    if (number == 0.0) { return Cleaned(vec4f(0.0), vec4f(0.0), vec4f(0.0)); }
    var narrow = vec4f(0.0);
    var wide = vec4f(0.0);
    var least = HALF_MAX;
    for (var i = -4; i <= 4; i++) {
        let there = vec2i(clamp(at.x + i, 0, last.x), at.y);
        let found = textureLoad(planar_light, there, PLANAR_ROUGH, 0);
        let light = select(vec4f(0.0), vec4f(found.rgb, 1.0), textureLoad(planar_light, there, PLANAR_SHARP, 0).a == number);
        wide += light * select(1.0, 0.5, abs(i) == 4);
        narrow += light * select(select(1.0, 0.5, abs(i) == 2), 0.0, abs(i) > 2);
        least = min(least, select(HALF_MAX, found.a, light.a > 0.0));
    }
    return Cleaned(narrow, wide, vec4f(least, 0.0, 0.0, 0.0));
}
