// The sky: one triangle over the whole screen, drawn where nothing else is.
//
// Reads the view; writes a colour that fades from the horizon's haze to a deeper blue overhead.

struct Sky {
    right: vec4f,    // camera axes in the world; right and up are scaled to the edges of the screen
    up: vec4f,
    forward: vec4f,
    horizon: vec4f,  // linear colours; w of the first is 1 when the target does not encode sRGB itself
    zenith: vec4f,
}

@group(0) @binding(0) var<uniform> sky: Sky;

struct Corner {
    @builtin(position) position: vec4f,
    @location(0) ray: vec3f,
}

@vertex
fn corner(@builtin(vertex_index) index: u32) -> Corner {
    let at = vec2f(f32(index & 1u), f32(index >> 1u)) * 4.0 - 1.0;
    // Depth 0 is infinitely far.
    return Corner(vec4f(at, 0.0, 1.0), sky.forward.xyz + at.x * sky.right.xyz + at.y * sky.up.xyz);
}

@fragment
fn color(in: Corner) -> @location(0) vec4f {
    let height = max(normalize(in.ray).z, 0.0);
    let linear = mix(sky.zenith.rgb, sky.horizon.rgb, exp(-5.0 * height));
    let encoded = select(1.055 * pow(linear, vec3f(1.0 / 2.4)) - 0.055, 12.92 * linear, linear <= vec3f(0.0031308));
    return vec4f(select(linear, encoded, sky.horizon.w > 0.5), 1.0);
}
