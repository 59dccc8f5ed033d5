// Split-sum, the method of common engines (Karis 2013): one look-up in a cube map prefiltered for the roughness, times
// a table of the lobe's albedo. Isotropic: an anisotropic lobe gets the roughness sqrt(mx my).
// A texture of roughness changes the level, but not the table, which is made for the material's numbers.
// The table has rows over cos_o: RGB of the albedo over k.

#include "surface.wgsl"

const LAST_LEVEL = 6.0; // LEVELS of albedo.py, less one

fn integrate(index: u32, wo: vec3f, s: Surface) -> vec3f {
    let here = lobe_here(index, s);
    let lobe = here.lobe;
    let place = clamp(wo.z, 0.0, 1.0) * f32(SAMPLES) - 0.5;
    let row = u32(clamp(floor(place), 0.0, f32(SAMPLES - 2u)));
    let at = index * SAMPLES + row;
    let f = mix(samples[at].rgb, samples[at + 1u].rgb, clamp(place - f32(row), 0.0, 1.0));
    let level = lobes[index].level * exp2(0.5 * here.half_log2_growth); // proportional to the root of sqrt(mx my)
    let mirror = vec3f(-wo.xy, wo.z);
    return lobe.k * f * incident_at_level(s, on_side(lobe, mirror), min(level, LAST_LEVEL));
}
