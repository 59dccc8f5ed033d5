// Pixels that a masked surface covers in part, blended over the background. Appended to a shader of shade.wgsl.

const LEAST_COVERAGE = 0.01;

@fragment fn fringe_main(v: Varyings, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    let covered = coverage(v.uv);
    if (covered < LEAST_COVERAGE || covered >= SOLID) { discard; }
    return vec4f(surface_light(v, front), covered);
}
