// Distant light: the probe is read in the direction itself.

fn incident_look_up(x: vec3f, w: vec3f) -> LookUp {
    return LookUp(w, 1.0);
}

fn incident_bound(x: vec3f, w: vec3f) -> f32 {
    return 0.0;
}
