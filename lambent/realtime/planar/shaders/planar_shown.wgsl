// Specular light of an object that has pixels on planar reflectors: what these reflect was found before; other pixels, and
// lobes of transmission and retro-reflection, have the probe's light. The sun is in neither. Interleaved light is cleaned here, along columns, as
// far as the lobe is wider than the pixels it is mixed from.

#include "colour.wgsl"
#include "lobe_width.wgsl"
#include "planar_layers.wgsl"

@group(3) @binding(6) var planar_light: texture_2d_array<f32>;

const WIDE = 3.0; // half-width in pixels of a lobe from which on 8 x 8 pixels are mixed, not 4 x 4

fn specular_light(wo: vec3f, s: Surface) -> vec3f {
    let at = vec2i(s.pixel);
    let sharp = textureLoad(planar_light, at, PLANAR_SHARP, 0);
    let reflecting = sharp.a > 0.0;
    var sum = vec3f(0.0);
    if (reflecting) { sum = sharp.rgb + cleaned(wo, s, at, sharp.a); }
    for (var i = 0u; i < LOBES; i++) {
        sum += sun_light(i, wo, s);
        if (reflecting && lobe_mirrors(lobes[i].lobe)) { continue; }
        sum += integrate(i, wo, s);
    }
    return sum;
}

fn cleaned(wo: vec3f, s: Surface, at: vec2i, number: f32) -> vec3f {
    let size = textureDimensions(planar_light);
    var narrow = vec4f(0.0);
    var wide = vec4f(0.0);
    var least = HALF_MAX;
    for (var i = -4; i <= 4; i++) {
        let there = vec2i(at.x, clamp(at.y + i, 0, i32(size.y) - 1));
        let same = select(0.0, 1.0, textureLoad(planar_light, there, PLANAR_SHARP, 0).a == number);
        wide += same * select(1.0, 0.5, abs(i) == 4) * textureLoad(planar_light, there, PLANAR_WIDE, 0);
        narrow += same * select(select(1.0, 0.5, abs(i) == 2), 0.0, abs(i) > 2) * textureLoad(planar_light, there, PLANAR_NARROW, 0);
        least = min(least, select(HALF_MAX, textureLoad(planar_light, there, PLANAR_LEAST, 0).x, same > 0.0));
    }
    let away = length(s.x + object.centre.xyz - frame.eye.xyz);
    let focal_px = 0.5 * f32(size.y) / length(frame.up.xyz);
    var width_px = 0.0;
    for (var i = 0u; i < LOBES; i++) {
        let angle = lobe_half_widths(lobe_here(i, s).lobe, wo).x;
        width_px = max(width_px, pixels_of(angle, focal_px, least, away));
    }
    // what is not cleaned at all shows its dither: at contacts, worse than the blur of two pixels
    let share = clamp(0.5 * (width_px / WIDE - 1.0), 0.0, 1.0);
    return mix(narrow.rgb / max(narrow.a, 0.5), wide.rgb / max(wide.a, 0.5), share);
}
