// The environment in a mirror picture: a plane far away that faces the mirror eye.

#include "frame.wgsl"
#include "screen.wgsl"

@group(1) @binding(0) var environment: texture_cube<f32>;

const FAR = 1e4; // metres, as in store/contract.py

struct MirrorSky {
    @location(0) light: vec4f,
    @location(1) plane: vec4f,
}

@fragment fn mirror_sky_main(screen: Screen) -> MirrorSky {
    let w = frame.forward.xyz + screen.clip.x * frame.across.xyz + screen.clip.y * frame.up.xyz;
    let n = vec3f(frame.across.w, frame.up.w, frame.forward.w);
    let faced = dot(w, n) > 0.0; // other rays never leave the reflector: nothing lies there
    let light = vec4f(textureSampleLevel(environment, linear_sampler, w, 0.0).rgb, 1.0);
    return MirrorSky(select(vec4f(0.0), light, faced), vec4f(-normalize(w), -FAR));
}
