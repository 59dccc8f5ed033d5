// Specular light of an object that has pixels on planar reflectors: what these reflect was found before; other pixels, and
// lobes of transmission, have the probe's light. Interleaved light is cleaned here, along columns, as far as the lobe is wider than the pixels it is mixed
// from.

#include "lobe_width.wgsl"

@group(3) @binding(2) var planar_rough: texture_2d<f32>;
@group(3) @binding(3) var planar_sharp: texture_2d<f32>;
@group(3) @binding(4) var planar_sum: texture_2d<f32>;
@group(3) @binding(5) var planar_least: texture_2d<f32>;

const TAPS = array<f32, 5>(0.5, 1.0, 1.0, 1.0, 0.5);

fn specular_light(wo: vec3f, s: Surface) -> vec3f {
    let at = vec2i(s.pixel);
    let sharp = textureLoad(planar_sharp, at, 0);
    let mirrored = sharp.a > 0.0;
    var sum = vec3f(0.0);
    if (mirrored) { sum = sharp.rgb + cleaned(wo, s, at, sharp.a); }
    for (var i = 0u; i < LOBES; i++) {
        if (mirrored && lobes[i].lobe.side == LAMBENT_REFLECTION) { continue; }
        sum += integrate(i, wo, s);
    }
    return sum;
}

fn cleaned(wo: vec3f, s: Surface, at: vec2i, number: f32) -> vec3f {
    let size = textureDimensions(planar_rough);
    var sum = vec4f(0.0);
    var least = 6e4;
    for (var i = 0; i < 5; i++) {
        let there = vec2i(at.x, clamp(at.y + i - 2, 0, i32(size.y) - 1));
        let weight = select(0.0, TAPS[i], textureLoad(planar_sharp, there, 0).a == number);
        sum += weight * textureLoad(planar_sum, there, 0);
        least = min(least, select(6e4, textureLoad(planar_least, there, 0).x, weight > 0.0));
    }
    let here = textureLoad(planar_rough, at, 0).rgb;
    let away = length(s.x + object.centre.xyz - frame.eye.xyz);
    let focal_px = 0.5 * f32(size.y) / length(frame.up.xyz);
    var width_px = 0.0;
    for (var i = 0u; i < LOBES; i++) {
        width_px = max(width_px, pixels_of(lobe_half_widths(lobe_here(i, s).lobe, wo).x, focal_px, least, away));
    }
    return mix(here, sum.rgb / max(sum.a, 0.5), clamp(0.5 * (width_px - 1.0), 0.0, 1.0));
}
