// First stage: of every cell, the mean depth of the deepest facets at its samples. See facet.rs, whose integers
// these are. A workgroup takes a tile of 8 x 8 cells and first finds the facets that may touch it.

struct Facet {
    a: vec3<i32>,
    deepest_mm: f32,
    b: vec3<i32>,
    at_origin_mm: f32,
    c: vec3<i32>,
    along_x_mm: f32,
    along_ymm: f32,
    // Column in the low half, row in the high one.
    first: u32,
    end: u32,
    unused: u32,
}

const POINTS = 1024;
const SQUARE = 256u;
const TILE = 8u;
const AT_ONCE = 64u;
const BEYOND = 1 << 24u;

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var<storage, read> views: array<View>;
@group(0) @binding(2) var<storage, read> facets: array<Facet>;
@group(0) @binding(3) var<storage, read_write> depths_mm: array<f32>;

var<workgroup> found: array<u32, AT_ONCE>;
var<workgroup> finds: atomic<u32>;

@compute @workgroup_size(TILE, TILE)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_id) place: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let view = views[group.y];
    let tiles = (view.cells + TILE - 1u) / TILE;
    if group.x >= tiles.x * tiles.y {
        return;
    }
    let tile = TILE * vec2(group.x % tiles.x, group.x / tiles.x);
    let cell = tile + place.xy;

    var depth_mm: array<vec4<f32>, 4>;
    for (var start = 0u; start < view.facets; start += AT_ONCE) {
        if lane == 0u {
            atomicStore(&finds, 0u);
        }
        workgroupBarrier();
        let facet = view.first_facet + start + lane;
        if start + lane < view.facets && maytouch(facet, tile) {
            found[atomicAdd(&finds, 1u)] = facet;
        }
        workgroupBarrier();
        let count = atomicLoad(&finds);
        for (var k = 0u; k < count; k++) {
            draw(facets[found[k]], cell, &depth_mm);
        }
        workgroupBarrier();
    }
    if all(cell < view.cells) {
        let sums = depth_mm[0] + depth_mm[1] + depth_mm[2] + depth_mm[3];
        let mean = (sums.x + sums.y + sums.z + sums.w) / 16.0;
        depths_mm[group.y * batch.cells + cell.y * view.cells.x + cell.x] = mean;
    }
}

fn maytouch(index: u32, tile: vec2<u32>) -> bool {
    let facet = facets[index];
    let at_tile = facet.a * i32(tile.x) + facet.b * i32(tile.y) + facet.c;
    let most = i32(TILE) * (max(facet.a, vec3(0)) + max(facet.b, vec3(0)));
    return all(halves(facet.first) < tile + TILE) && all(halves(facet.end) > tile) && all(at_tile + most >= vec3(0));
}

fn halves(word: u32) -> vec2<u32> {
    return vec2(word & 0xffffu, word >> 16u);
}

fn draw(facet: Facet, cell: vec2<u32>, depth_mm: ptr<function, array<vec4<f32>, 4>>) {
    let at_cell = facet.a * i32(cell.x) + facet.b * i32(cell.y) + facet.c;
    let most = max(facet.a, vec3(0)) + max(facet.b, vec3(0));
    if any(cell < halves(facet.first)) || any(cell >= halves(facet.end)) || any(at_cell + most < vec3(0)) {
        return;
    }
    let least = min(facet.a, vec3(0)) + min(facet.b, vec3(0));
    let within = all(at_cell + least >= vec3(0));
    // Integers that `f32` holds exactly, as are the sums below, wherever their sign is in doubt.
    let a = vec3<f32>(facet.a / POINTS);
    let b = vec3<f32>(facet.b / POINTS);
    let c = vec3<f32>(clamp(at_cell, vec3(-BEYOND), vec3(BEYOND)));

    let at_cell_mm = facet.at_origin_mm + facet.along_x_mm * f32(cell.x) + facet.along_ymm * f32(cell.y);
    let along_x_mm = facet.along_x_mm / f32(POINTS);
    let along_ymm = facet.along_ymm / f32(POINTS);
    let col = 4u * cell.x + vec4(0u, 1u, 2u, 3u);
    for (var line = 0u; line < 4u; line++) {
        let row = vec4(4u * cell.y + line);
        let of_x = (batch.steps.x * col + batch.steps.y * row) % SQUARE;
        let of_y = (batch.steps.z * col + batch.steps.w * row) % SQUARE;
        let x = vec4<f32>(vec4(0u, SQUARE, 2u * SQUARE, 3u * SQUARE) + of_x);
        let y = vec4<f32>(line * SQUARE + of_y);
        var here_mm = min(at_cell_mm + along_x_mm * x + along_ymm * y, vec4(facet.deepest_mm));
        if !within {
            let p = c.x + a.x * x + b.x * y;
            let q = c.y + a.y * x + b.y * y;
            let r = c.z + a.z * x + b.z * y;
            here_mm = select(vec4(0.0), here_mm, min(min(p, q), r) >= vec4(0.0));
        }
        (*depth_mm)[line] = max((*depth_mm)[line], here_mm);
    }
}
