// Colours: of bare ground by height and slope, of light, of air, and of what is shown to those who look into the engine.
// All linear. Twin: core/reference/shared/colors.rs

const MEADOW = vec3f(0.150, 0.175, 0.075);
const FOREST = vec3f(0.045, 0.075, 0.035);
const HEATH = vec3f(0.160, 0.148, 0.100);
const ROCK = vec3f(0.205, 0.190, 0.175);
const SNOW = vec3f(0.740, 0.770, 0.820);
const SUNLIGHT = vec3f(1.280, 1.200, 1.060);
const SKYLIGHT = vec3f(0.170, 0.200, 0.250);

// Ground at a share of the data's range of heights. Forest climbs from the valleys to heath, rock and snow; steep
// ground is bare; slopes away from the midday sun hold trees and snow a little lower.
fn natural_color(share: f32, normal: vec3f) -> vec3f {
    let height = share + 0.05 * normal.y;
    var color = mix(MEADOW, FOREST, smoothstep(0.04, 0.16, height));
    color = mix(color, HEATH, smoothstep(0.34, 0.46, height));
    color = mix(color, ROCK, smoothstep(0.44, 0.56, height));
    color = mix(color, ROCK, 0.85 * (1.0 - smoothstep(0.70, 0.88, normal.z)));
    let snow = smoothstep(0.52, 0.66, height) * smoothstep(0.60, 0.80, normal.z);
    return mix(color, SNOW, snow);
}

// What a colour becomes under the sun and the sky's dome; light thrown back by the ground fills what faces down.
fn lit(color: vec3f, normal: vec3f, sun: vec3f) -> vec3f {
    let direct = max(dot(normal, sun), 0.0);
    let dome = 0.6 + 0.4 * normal.z;
    return color * (direct * SUNLIGHT + dome * SKYLIGHT);
}

// Imagery holds its own light; relief is drawn over it softly.
fn softly_lit(color: vec3f, normal: vec3f, sun: vec3f) -> vec3f {
    let flat_light = max(sun.z, 0.2);
    return color * clamp(0.7 + 0.3 * dot(normal, sun) / flat_light, 0.5, 1.2);
}

// Depth 0 to 2 from blue to red, levels apart in brightness.
fn depth_color(depth: u32, level: u32) -> vec3f {
    let bright = select(0.75, 1.0, level % 2u == 0u);
    switch depth {
        case 0u: { return bright * vec3f(0.10, 0.22, 0.42); }
        case 1u: { return bright * vec3f(0.40, 0.38, 0.14); }
        default: { return bright * vec3f(0.45, 0.13, 0.10); }
    }
}

fn encode_srgb(linear: vec3f) -> vec3f {
    let low = 12.92 * linear;
    let high = 1.055 * pow(max(linear, vec3f(0.0)), vec3f(1.0 / 2.4)) - 0.055;
    return select(high, low, linear <= vec3f(0.0031308));
}
