// A feature's mesh, and where it is drawn.
// Twin: core/reference/shared.rs

struct FeatureVertex {
    position: vec3f,                // metres from the feature's origin
    tile: u32,                      // the feature's tile under it: its place in the feature's list
    normal: vec3f,                  // outward, unit length
    position_of: u32,               // the vertex whose position it has; itself unless it only shades differently
}

struct FeaturePlace {
    origin: vec3f,                  // camera-relative metres
    reserved: u32,
    tiles: array<u32>,              // drawn tile of each of the feature's tiles
}

// In an index: a sample of one of its tiles; the rest is the tile's place in the feature's list << 15 | the sample.
const FEATURE_BORDER: u32 = 0x80000000u;
