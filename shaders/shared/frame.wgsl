// One view of one frame.

struct Frame {
    clip_from_view_world: mat4x4f,  // from camera-relative world metres; reversed depth, infinite far plane
    viewport: vec2f,                // px
    pixels_per_radian: f32,         // K = viewport height / (2 tan(fov_y / 2))
    tolerance: f32,                 // px, what the patches may err by
    unit: f32,                      // metres of a height unit
    drawn_count: u32,               // tiles in the list
    index_capacity: u32,            // indices the emitted list may hold
    uniform_depth: u32,             // every patch takes this depth; NONE: each its own
    sun: vec3f,                     // towards the sun, world, unit length
    haze: f32,                      // 1 / metres; 0 for none
    sky: vec3f,                     // linear colour of the haze
    flags: u32,                     // see FLAG_*
    height_range: vec2f,            // metres, of the whole data set
    camera_height: f32,             // metres: world z of the camera
    reserved: f32,                  // 0
    ground_min: vec2f,              // camera-relative metres: the data set's box, which tiles reach past
    ground_max: vec2f,
}

const FLAG_DRAW_VOIDS: u32 = 1u;    // void triangles are drawn with their filled heights
const FLAG_DEPTH_COLORS: u32 = 2u;  // colour by patch depth and tile level
const FLAG_SRGB_OUT: u32 = 4u;      // encode the colour: the target is not an sRGB format
const FLAG_WIREFRAME: u32 = 8u;     // draw the edges of the triangles
