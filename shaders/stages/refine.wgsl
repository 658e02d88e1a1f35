// refine: a feature's tables become its points, and its points the vertices of its mesh.
// Reads: header, task, tables. Writes: points (whose first are the cage's), vertices. Gathers only.
// Entry points: `points_of_level` (one thread a row of a task; a level's tasks run one after the other), then `vertices`
// (one thread a vertex). A vertex is evaluated once; one that only shades differently names another, whose position it has.
// Based on: M. Niessner, C. Loop, M. Meyer, T. DeRose, Feature-adaptive GPU rendering of Catmull-Clark subdivision
// surfaces (2012), section 4.
// Twin: core/reference/refine.rs

#import constants
#import feature
#import refine

@group(0) @binding(0) var<uniform> header: RefineHeader;
@group(0) @binding(1) var<uniform> task: RefineTask;
@group(0) @binding(2) var<storage, read> tables: array<u32>;
@group(0) @binding(3) var<storage, read_write> points: array<f32>;
@group(0) @binding(4) var<storage, read_write> feature_vertices: array<FeatureVertex>;

// Least square of the sine between du and dv: below it they say nothing of a plane.
const LEAST_SINE_SQUARE: f32 = 1.0e-8;

struct Sample {
    position: vec3f,
    du: vec3f,
    dv: vec3f,
}

fn point(index: u32) -> vec3f {
    return vec3f(points[3u * index], points[3u * index + 1u], points[3u * index + 2u]);
}

fn number(word: u32) -> f32 {
    return bitcast<f32>(tables[word]);
}

fn sum_of(first: u32, end: u32) -> vec3f {
    var sum = vec3f(0.0);
    for (var word = first; word < end; word++) {
        sum += point(tables[word]);
    }
    return sum;
}

// Row: the vertex; along a crease two ends, smooth as many ends as face points.
fn ring_point(first: u32, end: u32) -> vec3f {
    let vertex = point(tables[first]);
    let around = sum_of(first + 1u, end);
    switch end - first {
        case 1u: {
            return vertex;
        }
        case 3u: {
            return 0.75 * vertex + 0.125 * around;
        }
        default: {
            let n = f32((end - first) / 2u);
            return (n - 2.0) / n * vertex + around / (n * n);
        }
    }
}

fn weighted_point(first: u32, count: u32) -> vec3f {
    var sum = vec3f(0.0);
    for (var term = 0u; term < count; term++) {
        let word = first + 2u * term;
        sum += number(word + 1u) * point(tables[word]);
    }
    return sum;
}

// Threads of a dispatch of rows of workgroups.
fn thread_index(id: vec3u, groups: vec3u) -> u32 {
    return id.y * groups.x * 64u + id.x;
}

@compute @workgroup_size(64)
fn points_of_level(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let row = thread_index(id, groups);
    if row >= task.count {
        return;
    }
    var target_point = task.first_point + row;
    var position = vec3f(0.0);
    switch task.kind {
        case REFINE_MEANS: {
            let word = task.rows_word + 4u * row;
            position = 0.25 * sum_of(word, word + 4u);
        }
        case REFINE_RINGS: {
            let word = task.rows_word + row;
            position = ring_point(tables[word], tables[word + 1u]);
        }
        default: {
            let word = task.rows_word + REFINE_WEIGHTED_WORDS * row;
            target_point = tables[word];
            position = weighted_point(tables[word + 1u], tables[word + 2u]);
        }
    }
    points[3u * target_point] = position.x;
    points[3u * target_point + 1u] = position.y;
    points[3u * target_point + 2u] = position.z;
}

fn basis(t: f32) -> vec4f {
    let s = 1.0 - t;
    return vec4f(s * s * s, 4.0 - 6.0 * t * t + 3.0 * t * t * t, 4.0 - 6.0 * s * s + 3.0 * s * s * s, t * t * t) / 6.0;
}

fn basis_derivative(t: f32) -> vec4f {
    let s = 1.0 - t;
    return vec4f(-0.5 * s * s, 1.5 * t * t - 2.0 * t, 2.0 * s - 1.5 * s * s, 0.5 * t * t);
}

fn patch_sample(index: u32, uv: vec2f) -> Sample {
    let column_weights = basis(uv.x);
    let row_weights = basis(uv.y);
    let column_slopes = basis_derivative(uv.x);
    let row_slopes = basis_derivative(uv.y);
    var sample = Sample(vec3f(0.0), vec3f(0.0), vec3f(0.0));
    for (var control = 0u; control < 16u; control++) {
        let at = point(tables[header.patches_word + 16u * index + control]);
        let column = control % 4u;
        let row = control / 4u;
        sample.position += column_weights[column] * row_weights[row] * at;
        sample.du += column_slopes[column] * row_weights[row] * at;
        sample.dv += column_weights[column] * row_slopes[row] * at;
    }
    return sample;
}

fn stencil_sample(first: u32) -> Sample {
    var sample = Sample(vec3f(0.0), vec3f(0.0), vec3f(0.0));
    for (var term = 0u; term < tables[first]; term++) {
        let word = first + 1u + 4u * term;
        let at = point(tables[word]);
        sample.position += number(word + 1u) * at;
        sample.du += number(word + 2u) * at;
        sample.dv += number(word + 3u) * at;
    }
    return sample;
}

// Upward where the surface has no tangent plane.
fn unit_normal(sample: Sample) -> vec3f {
    let area = cross(sample.du, sample.dv);
    let lengths = dot(sample.du, sample.du) * dot(sample.dv, sample.dv);
    if dot(area, area) <= LEAST_SINE_SQUARE * lengths {
        return vec3f(0.0, 0.0, 1.0);
    }
    return normalize(area);
}

// The feature's tile under a position; the nearest of them where an overhang reaches past the cut.
fn tile_under(position: vec3f) -> u32 {
    let at = vec2u(clamp(position.xy / header.step, vec2f(0.0), header.size));
    let tile = min((header.first + at) / TILE_CELLS, header.tiles - 1u);
    return tile.y * header.tiles.x + tile.x;
}

@compute @workgroup_size(64)
fn vertices(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let vertex = thread_index(id, groups);
    if vertex >= header.vertex_count {
        return;
    }
    let word = header.vertices_word + REFINE_VERTEX_WORDS * vertex;
    let source = tables[word];
    let offset = tables[word + 3u];
    var sample = Sample();
    if (source & REFINE_STENCIL) != 0u {
        sample = stencil_sample(source ^ REFINE_STENCIL);
    } else {
        sample = patch_sample(source, vec2f(number(word + 1u), number(word + 2u)));
    }
    if offset != NONE {
        sample.position.z += number(offset);
        sample.du.z += number(offset + 1u);
        sample.dv.z += number(offset + 2u);
    }
    let position_of = tables[word + 4u];
    let normal = unit_normal(sample);
    feature_vertices[vertex] = FeatureVertex(sample.position, tile_under(sample.position), normal, position_of);
}
