// Specular light of a pixel from the object's probe, each lobe by the integrator that this file is built with, and of the sun.

fn specular_light(wo: vec3f, s: Surface) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0u; i < LOBES; i++) {
        if (!lobe_adds(lobes[i].lobe)) { continue; }
        sum += integrate(i, wo, s) + sun_light(i, wo, s);
    }
    return sum;
}
