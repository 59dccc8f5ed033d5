// Maps of a light field: light on all levels, and distances, laid out by realtime/light_fields/light_field_atlas.py.

override QUARTERS: bool = false; // texels flag the quarters that show a surface
override BLOCKS: bool = false;   // distances are in blocks: baked/light_fields/blocks/distances.py

// Location of a point's map: its number in its layer, and the layer; `span` scales the codes of distances.
struct Map {
    place: u32,
    layer: u32,
    span: vec2f,
}

// A texel: inverse distance, 1/m, and flags of the quarters that show a surface.
struct Texel {
    inverse: f32,
    cover: u32,
}

// a/b rounded down, exact for a < 2^16: software adapters do not vectorise integer division.
fn whole_share(a: u32, b: u32) -> u32 {
    return u32((f32(a) + 0.5) / f32(b));
}

// The first texel of a place in a grid with `columns` of cells.
fn corner_of(place: u32, columns: u32, cell: vec2u) -> vec2u {
    let row = whole_share(place, columns);
    return vec2u(place - row * columns, row) * cell;
}

fn columns_of(tile: u32) -> u32 {
    return whole_share(u32(field.size.x), tile);
}

fn map_of(point: u32) -> Map {
    let number = u32(textureLoad(points, vec2u(point & 255u, point >> 8u), 0).w);
    let layer = whole_share(number, field.places);
    var found = Map(number - layer * field.places, layer, vec2f(0.0));
    if (BLOCKS) {
        let last = distance_corner(found) + field.cell - 1u;
        found.span = bitcast<vec2f>(textureLoad(distances, last, layer, 0).rg);
    }
    return found;
}

fn distance_corner(map: Map) -> vec2u {
    return corner_of(map.place, columns_of(field.tile), field.cell);
}

fn map_place(w: vec3f) -> vec2f {
    return 0.5 * octahedral(w) + 0.5;
}

// Weight of a sharp look-up along w, by how near a texel's centre it is: the 8th power of the sum of squared bilinear
// weights. Of several points that see the same surface, those that blur it least count most.
fn focus_along(w: vec3f) -> f32 {
    let share = fract(map_place(w) * f32(field.side) - 0.5);
    let sums = share * share + (1.0 - share) * (1.0 - share);
    let sum = sums.x * sums.y;
    let square = sum * sum;
    return square * square * square * square;
}

fn light_corner(map: Map, level: u32) -> vec2u {
    if (level == 0u) { return corner_of(map.place, columns_of(field.tile), vec2u(field.tile)); }
    let tile = field.coarse[level - 1u];
    return corner_of(map.place, columns_of(tile), vec2u(tile)) + vec2u(0u, field.coarse_row[level - 1u]);
}

fn side_of(level: u32) -> u32 {
    if (level == 0u) { return field.side; }
    return field.coarse[level - 1u] - 2u;
}

fn light_on_level(map: Map, place: vec2f, level: u32) -> vec3f {
    let texel = vec2f(light_corner(map, level)) + 1.0 + place * f32(side_of(level));
    return textureSampleLevel(atlas, linear_sampler, texel / field.size, map.layer, 0.0).rgb;
}

// Light of a point's map from direction w, averaged over a solid angle. A texel has 4 (|x| + |y| + |z|)^3/side^2 sr.
// Two levels are mixed so that the mean of their filters' solid angles equals the wanted one.
fn light_of(point: u32, w: vec3f, half_log2_omega: f32) -> vec3f {
    let spread = dot(abs(w), vec3f(1.0)) * inverseSqrt(dot(w, w));
    let texels = exp2(2.0 * half_log2_omega - 2.0 - 3.0 * log2(spread)); // of a map of 1 x 1 texels
    var finer = 0u;
    for (var k = 1u; k < field.levels; k++) {
        if (texels * f32(side_of(k) * side_of(k)) >= 1.0) { finer = k; }
    }
    let map = map_of(point);
    let place = map_place(w);
    var light = light_on_level(map, place, finer);
    let coarser = min(finer + 1u, field.levels - 1u);
    let bounds = vec2f(vec2u(side_of(finer) * side_of(finer), side_of(coarser) * side_of(coarser)));
    let share = (texels * bounds.x - 1.0) / max(bounds.x / bounds.y - 1.0, 1e-6);
    if (share > 0.0) { light = mix(light, light_on_level(map, place, coarser), min(share, 1.0)); }
    return light;
}

// Surfaces before the sky, between texels: radiance of those that show surfaces, times their share of the interpolation,
// `shows`; and the share of the sky that surfaces cover, between quarters of texels.
struct Edge {
    light: vec3f,
    shows: f32,
    share: f32,
}

fn edge_along(map: Map, w: vec3f) -> Edge {
    let at = map_place(w) * f32(field.side) - 0.5;
    var found = Edge(vec3f(0.0), 0.0, 0.0);
    for (var k = 0u; k < 4u; k++) {
        let beside = floor(at) + vec2f(f32(k & 1u), f32(k >> 1u));
        let texel = vec2u(vec2i(beside) + 1);
        let cover = texel_of(map, texel).cover;
        let away = at - beside;
        let shows = select(0.0, (1.0 - abs(away.x)) * (1.0 - abs(away.y)), cover != 0u);
        found.light += shows * textureLoad(atlas, light_corner(map, 0u) + texel, map.layer, 0).rgb;
        found.shows += shows;
        let low = max(1.0 - 2.0 * abs(away + 0.25), vec2f(0.0)); // of quarters
        let high = max(1.0 - 2.0 * abs(away - 0.25), vec2f(0.0));
        let beyond = (texel == vec2u(0u)) | (texel == vec2u(field.side + 1u)); // the border is turned by half a turn
        let bits = select(cover, reverseBits(cover) >> 28u, beyond.x != beyond.y);
        let quarters = vec4f((vec4u(bits) >> vec4u(0u, 1u, 2u, 3u)) & vec4u(1u));
        found.share += dot(vec4f(low.x, high.x, low.x, high.x) * vec4f(low.yy, high.yy), quarters);
    }
    return found;
}

// A texel of a tile. In half floats, the flags of the quarters are the lowest bits of the distance, and its sign.
fn texel_of(map: Map, texel: vec2u) -> Texel {
    if (BLOCKS) { return texel_of_block(map, texel); }
    let bits = textureLoad(distances, distance_corner(map) + texel, map.layer, 0).r;
    if (!QUARTERS) { return Texel(unpack2x16float(bits).x, 15u); }
    return Texel(unpack2x16float(bits & 0x7ff8u).x, (bits & 7u) | ((bits >> 12u) & 8u));
}

fn texel_of_block(map: Map, texel: vec2u) -> Texel {
    let corner = distance_corner(map);
    let words = textureLoad(distances, corner + (texel >> vec2u(2u)), map.layer, 0).rg;
    let i = 4u * (texel.y & 3u) + (texel.x & 3u);
    let ends = vec2f(vec2u(words.x, words.x >> 8u) & vec2u(255u));
    let kind = (words.x >> 16u) & 3u;
    var k = (words.y >> (2u * i)) & 3u;
    var cover = 15u;
    var share = 0.5 * (f32(k) - 1.0); // interpolates between the ends; below 0 for the sky
    if (ends.x > ends.y) {
        let bit = 16u + 3u * i;
        let low = (words.x >> min(bit, 31u)) | (words.y << (32u - min(bit, 31u)));
        share = f32(select(low, words.y >> (max(bit, 32u) - 32u), bit >= 32u) & 7u) / 7.0;
    } else if (kind != 0u) {
        let number = field.cell.x * (field.tile >> 2u) + (words.x >> 18u);
        if (kind != 2u) { cover = of_entry(map, corner, number, i); }
        if (kind != 1u) { k |= of_entry(map, corner, number + kind - 2u, i) << 2u; }
        share = select(f32(k) / select(63.0, 3.0, kind == 1u), (f32(k) - 1.0) / 62.0, kind == 2u);
    }
    if (share < 0.0 || cover == 0u) { return Texel(0.0, 0u); }
    let code = mix(ends.x, ends.y, share);
    return Texel(exp2(mix(map.span.x, map.span.y, (code - 1.0) / 254.0)), cover);
}

// Four bits of the i-th texel from an entry of the pool.
fn of_entry(map: Map, corner: vec2u, number: u32, i: u32) -> u32 {
    let row = whole_share(number, field.cell.x);
    let words = textureLoad(distances, corner + vec2u(number - row * field.cell.x, row), map.layer, 0).rg;
    return (select(words.x, words.y, i >= 8u) >> (4u * (i & 7u))) & 15u;
}

// The texel that a direction falls into; its inverse distance is 0 if the direction's quarter shows the sky.
fn texel_along(map: Map, w: vec3f) -> Texel {
    let at = map_place(w) * f32(field.side);
    let texel = min(vec2u(at), vec2u(field.side - 1u));
    let found = texel_of(map, texel + 1u);
    let beyond = select(vec2u(0u), vec2u(1u), at - vec2f(texel) >= vec2f(0.5));
    let shows = ((found.cover >> (2u * beyond.y + beyond.x)) & 1u) == 1u;
    return Texel(select(0.0, found.inverse, shows), found.cover);
}
