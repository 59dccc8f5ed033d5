// Light of a look-up in the cube map of a probe. Look-ups with their own light define the same functions.

// Points of a light field near a position of the light map; none here.
fn points_near(uv2: vec2f) -> vec4u {
    return vec4u(0u);
}

// The back face that a ray meets in refracting glass; none here.
fn exit_near(place: OnMap, r: vec3f, n: vec3f, front: bool) -> vec4f {
    return vec4f(0.0);
}

// Light from local direction w, averaged over the solid angle omega sr.
fn incident(s: Surface, w: vec3f, half_log2_omega: f32) -> vec3f {
    let along = to_world(s, w);
    let found = incident_look_up(s.x, along);
    let level = level_of_look_up(found, half_log2_omega);
    return s.niche + arriving(s, along) * textureSampleLevel(radiance_cube, linear_sampler, found.direction, level).rgb;
}

// `incident` from a cube map that is prefiltered by roughness.
fn incident_at_level(s: Surface, w: vec3f, level: f32) -> vec3f {
    let along = to_world(s, w);
    let found = incident_look_up(s.x, along);
    return s.niche + arriving(s, along) * textureSampleLevel(radiance_cube, linear_sampler, found.direction, level).rgb;
}

// Light from local direction w without a filter.
fn incident_ray(s: Surface, w: vec3f) -> vec3f {
    let along = to_world(s, w);
    let found = incident_look_up(s.x, along);
    return s.niche + arriving(s, along) * textureSampleLevel(radiance_cube, linear_sampler, found.direction, 0.0).rgb;
}
