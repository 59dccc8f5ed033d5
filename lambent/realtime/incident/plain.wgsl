// Distant light: the probe is read in the direction itself.

fn incident_look_up(x: vec3f, w: vec3f) -> LookUp {
    return LookUp(w, 1.0);
}

fn incident_bound(x: vec3f, w: vec3f) -> f32 {
    return 0.0;
}

fn aim_maps(x: vec3f) -> bool {
    return true;
}

fn aimed_look_up(x: vec3f, w: vec3f) -> Aimed {
    return aimed_afar(w);
}

fn aim_towards(x: vec3f, q: vec3f) -> Towards {
    return towards_afar(q);
}
