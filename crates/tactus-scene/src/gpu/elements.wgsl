// Third stage: what arrives at each element from all rows, and its answer. A_y (Z A_x^T)

struct Response {
    baseline_counts: f32,
    sensitivity_counts_per_mm: f32,
    quadratic_per_mm: f32,
    per_reference_mm2: f32,
}

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var<storage, read> views: array<View>;
@group(0) @binding(2) var<storage, read> lines_mm2: array<f32>;
// Of every cell of the lattice, the length that arrives in each row of elements.
@group(0) @binding(3) var<storage, read> shares_mm: array<f32>;
@group(0) @binding(4) var<storage, read> reaches: array<vec2<u32>>;
@group(0) @binding(5) var<storage, read> responses: array<Response>;
@group(0) @binding(6) var<storage, read_write> counts: array<f32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let elements = batch.elements.x * batch.elements.y;
    if id.x >= elements {
        return;
    }
    let view = views[id.y];
    let row = id.x / batch.elements.x;
    let col = id.x % batch.elements.x;
    let first = max(reaches[row].x, view.first.y);
    let end = min(reaches[row].y, view.first.y + view.cells.y);
    var sum = 0.0;
    for (var cell = first; cell < end; cell++) {
        let line_mm2 = lines_mm2[id.y * batch.lines + (cell - view.first.y) * batch.elements.x + col];
        sum += line_mm2 * shares_mm[cell * batch.elements.y + row];
    }
    let response = responses[id.x];
    let u = sum * response.per_reference_mm2;
    let rise = response.sensitivity_counts_per_mm * (u + response.quadratic_per_mm * u * u);
    counts[id.y * elements + id.x] = response.baseline_counts + rise;
}
