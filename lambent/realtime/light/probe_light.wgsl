// Specular light of a pixel from the object's probe, by the integrator that this file is assembled with, and from the
// sun.

fn specular_light(wo: vec3f, s: Surface) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0u; i < LOBES; i++) {
        if (!lobe_adds(lobes[i].lobe)) { continue; }
        sum += integrate(i, wo, s) + sun_light(i, wo, s);
    }
    return sum;
}
