// Undeviated transmittance of clear glass; clear.py is the reference. Needs lobes.wgsl.

const LAMBENT_CLEAR_TERMS = 4u; // MOST_TERMS
const LAMBENT_CLEAR_MOST = 0.9999;

fn lambent_clear(cosine: f32, terms: array<vec4f, LAMBENT_CLEAR_TERMS>) -> vec3f {
    let c = max(cosine, LAMBENT_COS_MIN);
    var sum = vec3f(0.0);
    for (var k = 0u; k < LAMBENT_CLEAR_TERMS; k++) { sum += terms[k].rgb * pow(c, terms[k].w); }
    return min(lambent_under_fresnel(c) * sum, vec3f(LAMBENT_CLEAR_MOST));
}
