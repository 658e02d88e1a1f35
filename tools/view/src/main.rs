//! `drumlin-view`: the viewer and the flythrough benchmark; `drumlin view` and `drumlin fly` run it.

mod arguments;
mod auto_path;
mod camera;
mod cameras;
mod depth_frames;
mod frames;
mod path;
mod report;

#[allow(dead_code, reason = "draft")]
fn main() {}
