// Quadrature on planes, interleaved: each pixel of an 8 x 8 tile takes n other samples of the lobe, and the light is
// cleaned afterwards (planar_clean.wgsl, planar_shown.wgsl). Lobes that cover few pixels need and stand no cleaning:
// theirs are the fixed rings. The table of a lobe has SAMPLES rows of these, then 64 times SAMPLES rows.

#include "planar_fixed.wgsl"
#include "lobe_width.wgsl"

const LEAST_PX = 4.0; // mean width of a lobe

fn bayer(pixel: vec2u) -> u32 {
    let d = pixel.x ^ pixel.y;
    let y = pixel.y;
    let index = ((d & 1u) << 5u) | ((y & 1u) << 4u) | ((d & 2u) << 2u) | ((y & 2u) << 1u) | ((d & 4u) >> 1u) | ((y >> 2u) & 1u);
    return (index + u32(frame.eye.w)) & 63u;
}

fn integrate_planar(index: u32, wo: vec3f, s: Surface, place: Place) -> vec4f {
    let widths = lobe_half_widths(lobe_here(index, s).lobe, wo);
    let px = pixels_of(sqrt(widths.x * widths.y), mirrored.focal_px, place.t, length(place.q));
    let block = select(0u, 1u + bayer(s.pixel), px >= LEAST_PX);
    let light = planar_quadrature(index, (index * 65u + block) * SAMPLES, wo, s, place);
    return vec4f(light, f32(min(block, 1u)));
}
