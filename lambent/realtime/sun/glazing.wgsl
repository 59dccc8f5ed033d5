// Clear glass over the background. Appended to a shader of shade.wgsl that leaves out transmitted light (STRAIGHT).

#include "clear.wgsl"

override MASKED: bool = false; // the glass has holes

// Transmittance of the glass for the light behind it.
@fragment fn pass_main(v: Varyings) -> @location(0) vec4f {
    let open = MASKED && is_hole(v.uv);
    let tint = painted(v.uv).specular;
    let to_eye = frame.eye.xyz - v.p_world;
    let cosine = abs(dot(v.n_world, to_eye)) * inverseSqrt(max(dot(v.n_world, v.n_world) * dot(to_eye, to_eye), 1e-20));
    var terms = array<vec4f, LAMBENT_CLEAR_TERMS>();
    var count = 0u;
    for (var i = 0u; i < LOBES; i++) {
        let lobe = lobes[i].lobe;
        if (lobe.side == LAMBENT_TRANSMISSION && max_norm(lobe.k) > 0.0 && count < LAMBENT_CLEAR_TERMS) {
            terms[count] = vec4f(lobe.k * (vec3f(1.0) - lobe.r0), 1.0 - 2.0 * lobe.alpha);
            count++;
        }
    }
    if (open) { discard; }
    return vec4f(min(lambent_clear(cosine, terms) * tint, vec3f(LAMBENT_CLEAR_MOST)), 1.0);
}

// Light that the glass adds: reflected and emitted.
@fragment fn mirror_main(v: Varyings, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let open = MASKED && is_hole(v.uv);
    let light = part_share(v.p_world) * surface_light(v, front);
    if (open) { discard; }
    return vec4f(light, 1.0);
}
