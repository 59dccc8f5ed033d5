// The estimates as published (thesis M, 4.24 and 4.25): uniform samples within the lobe, one filter size per pixel.
//     4.24: L = sum L_i cos^2 f / sum p cos        4.25: L = sum L_i cos^2 f^2/p / sum f cos
// f = p q with q = F/((cos_i cos_o)^alpha h_z), and p only up to a factor, which cancels.

#include "surface.wgsl"

override FORMULA: u32 = 25u;

fn reflected(wo: vec3f, slope: vec2f) -> vec3f {
    return lambent_mirrored(wo, lambent_from_slopes(slope));
}

fn tangent_of_angle(a: vec3f, b: vec3f) -> f32 {
    return tan(min(acos(clamp(dot(a, b), -1.0, 1.0)), 1.5));
}

fn integrate(index: u32, wo: vec3f, s: Surface) -> vec3f {
    let here = lobe_here(index, s);
    let lobe = here.lobe;
    let border = lobes[index].border * here.growth;
    let centre = vec3f(-wo.xy, wo.z);
    let u = tangent_of_angle(centre, reflected(wo, vec2f(border.x, 0.0)));
    let v = tangent_of_angle(centre, reflected(wo, vec2f(0.0, border.y)));
    let half_log2_omega = 0.5 * log2(max(LAMBENT_PI * u * v / f32(SAMPLES), 1e-20)); // 4.14, 4.15
    var sum = vec3f(0.0);
    var weights = vec3f(0.0);
    for (var k = 0u; k < SAMPLES; k++) {
        let sample = samples[index * SAMPLES + k];
        // angles are only nearly equal if a texture varies the roughness
        let at = sample_about(wo, lambent_from_slopes(sample.xy * here.growth));
        if (!at.seen) { continue; }
        let p = sample.w / (at.h.z * at.h.z * at.h.z * at.cos_d);
        let q = gain(lobe, at.wi, wo, at.h) / at.wi.z;
        let weight = select(q, vec3f(1.0), FORMULA == 24u) * (at.wi.z * p);
        sum += incident(s, on_side(lobe, at.wi), half_log2_omega) * weight * q * at.wi.z;
        weights += weight;
    }
    return select(vec3f(0.0), sum / max(weights, vec3f(1e-30)), weights > vec3f(1e-30));
}
