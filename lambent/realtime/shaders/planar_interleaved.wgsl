// Quadrature on planes, interleaved: each pixel of a 4 x 4 tile takes n other samples of the lobe, and the picture is
// cleaned afterwards (planar_clean.wgsl, planar_shown.wgsl). Lobes that cover few pixels need and stand no cleaning:
// theirs are the fixed rings. The table of a lobe has SAMPLES rows of these, then 16 times SAMPLES rows.

#include "planar_fixed.wgsl"
#include "lobe_width.wgsl"

const LEAST_PX = 4.0; // mean width of a lobe

fn bayer(pixel: vec2u) -> u32 {
    let p = pixel & vec2u(3u);
    let d = p.x ^ p.y;
    let index = ((d & 1u) << 3u) | ((p.y & 1u) << 2u) | (d & 2u) | (p.y >> 1u);
    return (index + u32(frame.eye.w)) & 15u;
}

fn integrate_planar(index: u32, wo: vec3f, s: Surface, place: Place) -> vec4f {
    let widths = lobe_half_widths(lobe_here(index, s).lobe, wo);
    let px = pixels_of(sqrt(widths.x * widths.y), mirror.focal_px, place.t, length(place.q));
    let block = select(0u, 1u + bayer(s.pixel), px >= LEAST_PX);
    let light = planar_quadrature(index, (index * 17u + block) * SAMPLES, wo, s, place);
    return vec4f(light, f32(min(block, 1u)));
}
