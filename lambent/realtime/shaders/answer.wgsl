// Common code of all stages of `lambent.core.answer` on a GPU. Light is three tightly packed floats per patch, point or
// texel.

#include "answer_constants.wgsl"

// Ratio of current to baked light; 1 for almost no baked light.
fn ratio_of(now: vec3f, baked: vec3f, least: f32) -> vec3f {
    let known = baked > vec3f(least);
    return select(vec3f(1.0), clamp(now / select(vec3f(1.0), baked, known), vec3f(0.0), vec3f(MOST_RATIO)), known);
}
