// How a light field lies in its textures (realtime/light_field_atlas.py) and on the light map.

struct LightFieldRecord {
    side: u32,    // texels of a map's side
    tile: u32,    // of a tile's, on level 0
    places: u32,  // maps of a layer
    levels: u32,
    coarse: vec4u,      // texels of a tile's side on levels 1 to 4
    coarse_row: vec4u,  // where their tiles begin in a layer
    size: vec2f,  // texels of a layer
    cell: vec2u,  // of a map in the texture of distances
    corner: vec2f, // column and row of the sample map's first texel in its grid
    grid: vec2f,   // columns and rows of the grid
    tint: vec3f, // of an interface of glass at normal incidence
    eta: f32,      // its index of refraction
    power: f32,    // of the cosine in what it lets pass
    sky_texels: f32, // half the log2 of the sky's texels per unit area of the cube [-1, 1]^3
}
