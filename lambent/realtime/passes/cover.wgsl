// The light of every pixel as the mean over its places (coverage.wgsl); unchanged if all lie on the pixel's own
// surface. The mean is taken of the light that a display emits, as in a still, so that edges against a lamp are smooth.

#include "frame.wgsl"
#include "screen.wgsl"
#include "colour.wgsl"
#include "places.wgsl"

@group(1) @binding(0) var radiance: texture_2d<f32>;
@group(1) @binding(1) var missed_light: texture_2d<f32>;
@group(1) @binding(2) var steps: texture_2d<u32>;

const MIXED = 0.0; // alpha of means over several surfaces, which smooth.wgsl skips; 1 elsewhere
const FILMIC_WHITE = 7.24; // exposed light that the curve shows as white

// Exposed light as the display emits it, without the encoding; and the inverse.
fn emitted(light: vec3f) -> vec3f {
    let seen = frame.exposure * light;
    return select(min(seen, vec3f(1.0)), filmic(min(seen, vec3f(FILMIC_WHITE))), frame.view_transform == 2u);
}

fn exposed(shown: vec3f) -> vec3f {
    let light = select(shown, filmic_inverse(shown), frame.view_transform == 2u);
    return light / frame.exposure;
}

@fragment fn cover_main(screen: Screen) -> @location(0) vec4f {
    let at = vec2i(screen.position.xy);
    let here = textureLoad(radiance, at, 0);
    let found = textureLoad(steps, at, 0).r;
    if (found == 0u) { return here; }
    var sum = emitted(here.rgb);
    for (var i = 0u; i < 4u; i++) {
        let step = step_at(found, i);
        var light = here.rgb;
        if (step == MISSED) {
            let seen = textureLoad(missed_light, at, 0);
            light = select(light, seen.rgb, seen.a > 0.0); // rarely, nothing was drawn: keep the pixel's
        } else if (step != OWN) {
            light = textureLoad(radiance, at + step_of(PLACES[i], step), 0).rgb;
        }
        sum += emitted(light);
    }
    return vec4f(exposed(0.2 * sum), MIXED);
}
