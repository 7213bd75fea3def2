// Second stage: of every row of cells, what arrives in each column of elements. Z A_x^T

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var<storage, read> views: array<View>;
@group(0) @binding(2) var<storage, read> depths_mm: array<f32>;
// Of every cell of the lattice, the length that arrives in each column.
@group(0) @binding(3) var<storage, read> shares_mm: array<f32>;
// Of every column, the first cell that reaches it and that after the last.
@group(0) @binding(4) var<storage, read> reaches: array<vec2<u32>>;
@group(0) @binding(5) var<storage, read_write> lines_mm2: array<f32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let view = views[id.y];
    let row = id.x / batch.elements.x;
    let col = id.x % batch.elements.x;
    if row >= view.cells.y {
        return;
    }
    let first = max(reaches[col].x, view.first.x);
    let end = min(reaches[col].y, view.first.x + view.cells.x);
    let start = id.y * batch.cells + row * view.cells.x;
    var sum = 0.0;
    for (var cell = first; cell < end; cell++) {
        sum += depths_mm[start + cell - view.first.x] * shares_mm[cell * batch.elements.x + col];
    }
    lines_mm2[id.y * batch.lines + id.x] = sum;
}
