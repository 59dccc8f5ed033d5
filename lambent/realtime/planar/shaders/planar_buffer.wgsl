// The planar reflection buffer: light, and the plane that each pixel's surface lies in. Appended to a shader
// of shade.wgsl; `frame` is the mirrored one, the w of across, up and forward the reflector's normal.

struct BufferTexel {
    @location(0) light: vec4f, // a: 1 where the reflector may face what is seen
    @location(1) plane: vec4f, // N towards the mirrored eye e, and N.(p - e); 0 past walls, where nothing is drawn
}

@fragment fn planar_buffer_main(v: Varyings, @builtin(front_facing) front: bool) -> BufferTexel {
    let to_eye = frame.eye.xyz - v.p_world;
    let given = select(vec3f(0.0, 1.0, 0.0), v.n_world, dot(v.n_world, v.n_world) > 1e-12);
    let n = normalize(given) * select(-1.0, 1.0, dot(given, to_eye) > 0.0);
    return BufferTexel(vec4f(part_share(v.p_world) * surface_light(v, front), 1.0), vec4f(n, -dot(n, to_eye)));
}
