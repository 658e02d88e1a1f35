// decode: a tile that arrived becomes heights, slopes and stride errors in its slot of the pool. Once per arrival.
// Reads: headers, staging. Writes: one slot a tile of the bound page.
// Entry points in order: `heights` (one thread a sample), `slopes` (one thread a sample), `strides` (one thread a patch);
// the y of the workgroup is the tile. Its only bind group is its own, 0.
// Source: FORMAT.md, the rule of the regular tile; cubic B-splines.
// Twin: core/reference/decode.rs

#import constants
#import upload

@group(0) @binding(0) var<storage, read_write> page: array<u32>;
@group(0) @binding(1) var<storage, read> headers: array<UploadHeader>;
@group(0) @binding(2) var<storage, read> staging: array<u32>;

// Cubic B-spline at 0, 1/4, 1/2, 3/4 of a quad; each row sums to 384.
const LIMIT_WEIGHTS = array<vec4i, 4>(
    vec4i(64, 256, 64, 0), vec4i(27, 235, 121, 1), vec4i(8, 184, 184, 8), vec4i(1, 121, 235, 27));

fn control(upload: u32, at: u32) -> i32 {
    return bitcast<i32>(staging[upload * UPLOAD_WORDS + UPLOAD_CONTROLS_WORD + at]);
}

fn code(upload: u32, row: u32, column: u32) -> i32 {
    return bitcast<i32>(staging[upload * UPLOAD_WORDS + UPLOAD_DETAIL_WORD + row * TILE_SAMPLES + column]);
}

fn slot_word(upload: u32, word: u32) -> u32 {
    return headers[upload].slot * SLOT_WORDS + word;
}

fn floor_divide(a: i32, b: i32) -> i32 {
    return a / b - select(0, 1, a % b < 0);
}

// The limit surface in units, rounded half up: (sum of w K + 73,728) / 147,456, in 32 bits by halves of K.
fn base_height(upload: u32, row: u32, column: u32) -> i32 {
    let row_weights = LIMIT_WEIGHTS[row % QUAD_SAMPLES];
    let column_weights = LIMIT_WEIGHTS[column % QUAD_SAMPLES];
    var high = 0;
    var low = 0;
    for (var i = 0u; i < 4u; i++) {
        for (var j = 0u; j < 4u; j++) {
            let weight = row_weights[i] * column_weights[j];
            if weight != 0 {
                let k = control(upload, (row / QUAD_SAMPLES + i) * CAGE_CONTROLS + column / QUAD_SAMPLES + j);
                high += weight * (k >> 12u);
                low += weight * (k & 4095);
            }
        }
    }
    let a = floor_divide(high, 36);
    let b = high - 36 * a;
    return a + (4096 * b + low + 73728) / 147456;
}

// The residual of an even column: rows between two others continue them.
fn even_column_residual(upload: u32, row: u32, column: u32) -> i32 {
    let quantum = headers[upload].quantum;
    let own = quantum * code(upload, row, column);
    if row % 2u == 0u {
        return own;
    }
    return ((quantum * (code(upload, row - 1u, column) + code(upload, row + 1u, column))) >> 1u) + own;
}

fn residual(upload: u32, row: u32, column: u32) -> i32 {
    if column % 2u == 0u {
        return even_column_residual(upload, row, column);
    }
    let left = even_column_residual(upload, row, column - 1u);
    let right = even_column_residual(upload, row, column + 1u);
    return ((left + right) >> 1u) + headers[upload].quantum * code(upload, row, column);
}

// What goes into the slot as it came: voids, patch codes, controls, cut bits.
fn copy_rest(upload: u32, at: u32) {
    let start = upload * UPLOAD_WORDS;
    if at < CODES_WORD - STRIDE_ERRORS_WORD {
        if at < STRIDE_ERRORS_WORD - VOIDS_WORD {
            page[slot_word(upload, VOIDS_WORD + at)] = staging[start + UPLOAD_VOIDS_WORD + at];
        }
        if at < CONTROLS_WORD - CODES_WORD {
            page[slot_word(upload, CODES_WORD + at)] = staging[start + UPLOAD_CODES_WORD + at];
        }
        if at < CAGE_CONTROL_COUNT {
            page[slot_word(upload, CONTROLS_WORD + at)] = staging[start + UPLOAD_CONTROLS_WORD + at];
        }
        if at < UPLOAD_WORDS - UPLOAD_CUT_WORD {
            page[slot_word(upload, CUT_WORD + at)] = staging[start + UPLOAD_CUT_WORD + at];
        }
    }
}

@compute @workgroup_size(64)
fn heights(@builtin(global_invocation_id) id: vec3u) {
    let sample = id.x;
    let upload = id.y;
    if sample >= TILE_SAMPLE_COUNT {
        return;
    }
    let row = sample / TILE_SAMPLES;
    let column = sample % TILE_SAMPLES;
    let height = base_height(upload, row, column) + residual(upload, row, column);
    page[slot_word(upload, HEIGHTS_WORD + sample)] = bitcast<u32>(height);
    copy_rest(upload, sample);
}

fn height(upload: u32, row: u32, column: u32) -> i32 {
    return bitcast<i32>(page[slot_word(upload, HEIGHTS_WORD + row * TILE_SAMPLES + column)]);
}

// Units a sample along a row of samples (south) or a column (east): `toward` is one of the two.
fn central_difference(upload: u32, row: u32, column: u32, toward: vec2u) -> f32 {
    let before = height(upload, row - toward.x, column - toward.y);
    let after = height(upload, row + toward.x, column + toward.y);
    return f32(after - before) * 0.5;
}

// The same across a border, where the samples beyond are not ours: from the cage's limit surface, whose controls on
// both sides of a border are the neighbour's too. Both tiles get the same number.
fn cage_difference(upload: u32, row: u32, column: u32, toward: vec2u) -> f32 {
    let at = vec2u(row, column) / QUAD_SAMPLES;
    let lateral = toward.yx;
    let weights = LIMIT_WEIGHTS[dot(vec2u(row, column), lateral) % QUAD_SAMPLES];
    var sum = 0.0;
    for (var i = 0u; i < 4u; i++) {
        if weights[i] != 0 {
            let before = at + lateral * i;
            let after = before + toward * 2u;
            let difference = control(upload, after.x * CAGE_CONTROLS + after.y)
                - control(upload, before.x * CAGE_CONTROLS + before.y);
            sum += f32(weights[i]) * f32(difference);
        }
    }
    return sum / (384.0 * 2.0 * f32(QUAD_SAMPLES));
}

@compute @workgroup_size(64)
fn slopes(@builtin(global_invocation_id) id: vec3u) {
    let sample = id.x;
    let upload = id.y;
    if sample >= TILE_SAMPLE_COUNT {
        return;
    }
    let row = sample / TILE_SAMPLES;
    let column = sample % TILE_SAMPLES;
    var east = 0.0;
    var south = 0.0;
    if column % TILE_CELLS == 0u {
        east = cage_difference(upload, row, column, vec2u(0u, 1u));
    } else {
        east = central_difference(upload, row, column, vec2u(0u, 1u));
    }
    if row % TILE_CELLS == 0u {
        south = cage_difference(upload, row, column, vec2u(1u, 0u));
    } else {
        south = central_difference(upload, row, column, vec2u(1u, 0u));
    }
    let slope = vec2f(east, south) * headers[upload].unit / headers[upload].step;
    page[slot_word(upload, SLOPES_WORD + sample)] = pack2x16float(slope);
}

fn is_void(upload: u32, row: u32, column: u32) -> bool {
    let sample = row * TILE_SAMPLES + column;
    return ((staging[upload * UPLOAD_WORDS + UPLOAD_VOIDS_WORD + sample / 32u] >> (sample % 32u)) & 1u) != 0u;
}

// A sample's distance from a plane through three corners, in units / stride; 0 for a void one.
fn deviation(upload: u32, row: u32, column: u32, stride: u32, plane: i32) -> u32 {
    if is_void(upload, row, column) {
        return 0u;
    }
    return u32(abs(i32(stride) * height(upload, row, column) - plane));
}

// Both triangles of a plain cell: (NW, SW, SE) and (NW, SE, NE).
fn plain_deviation(upload: u32, row: u32, column: u32, stride: u32) -> u32 {
    let nw = height(upload, row, column);
    let ne = height(upload, row, column + stride);
    let sw = height(upload, row + stride, column);
    let se = height(upload, row + stride, column + stride);
    var worst = 0u;
    for (var i = 0u; i <= stride; i++) {
        for (var j = 0u; j <= stride; j++) {
            let lower = i32(i) * (sw - nw) + i32(j) * (se - sw);
            let upper = i32(j) * (ne - nw) + i32(i) * (se - ne);
            let plane = i32(stride) * nw + select(upper, lower, i >= j);
            worst = max(worst, deviation(upload, row + i, column + j, stride, plane));
        }
    }
    return worst;
}

// A quarter of a fan, towards one edge: as one triangle, and as two where the edge is split. All fans are made of these.
fn quarter_deviation(upload: u32, centre: vec2i, outward: vec2i, half: i32) -> u32 {
    let lateral = vec2i(-outward.y, outward.x);
    let c = sample_height(upload, centre);
    let a = sample_height(upload, centre + half * (outward - lateral));
    let b = sample_height(upload, centre + half * (outward + lateral));
    let m = sample_height(upload, centre + half * outward);
    var worst = 0u;
    for (var u = 1; u <= half; u++) {
        for (var v = -u; v <= u; v++) {
            let place = vec2u(centre + u * outward + v * lateral);
            let whole = 2 * half * c + u * (a + b - 2 * c) + v * (b - a);
            let corner = select(a, b, v >= 0);
            let split = 2 * half * c + 2 * u * (m - c) + 2 * abs(v) * (corner - m);
            worst = max(worst, deviation(upload, place.x, place.y, u32(2 * half), whole));
            worst = max(worst, deviation(upload, place.x, place.y, u32(2 * half), split));
        }
    }
    return worst;
}

fn sample_height(upload: u32, place: vec2i) -> i32 {
    return height(upload, u32(place.x), u32(place.y));
}

fn cell_deviation(upload: u32, row: u32, column: u32, stride: u32) -> u32 {
    let half = i32(stride / 2u);
    let centre = vec2i(i32(row), i32(column)) + half;
    var worst = plain_deviation(upload, row, column, stride);
    worst = max(worst, quarter_deviation(upload, centre, vec2i(-1, 0), half));
    worst = max(worst, quarter_deviation(upload, centre, vec2i(0, 1), half));
    worst = max(worst, quarter_deviation(upload, centre, vec2i(1, 0), half));
    return max(worst, quarter_deviation(upload, centre, vec2i(0, -1), half));
}

@compute @workgroup_size(64)
fn strides(@builtin(global_invocation_id) id: vec3u) {
    let patch_index = id.x;
    let upload = id.y;
    if patch_index >= PATCH_COUNT {
        return;
    }
    let row = patch_index / TILE_QUADS * QUAD_SAMPLES;
    let column = patch_index % TILE_QUADS * QUAD_SAMPLES;
    var worst = 0u;
    for (var cell = 0u; cell < 4u; cell++) {
        worst = max(worst, cell_deviation(upload, row + cell / 2u * 2u, column + cell % 2u * 2u, 2u));
    }
    let unit = headers[upload].unit;
    let at = slot_word(upload, STRIDE_ERRORS_WORD + patch_index * 2u);
    page[at] = bitcast<u32>(f32(cell_deviation(upload, row, column, 4u)) * 0.25 * unit);
    page[at + 1u] = bitcast<u32>(f32(worst) * 0.5 * unit);
}
