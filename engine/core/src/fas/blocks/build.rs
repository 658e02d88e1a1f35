//! Linking: what of the tables does not depend on depths.

use std::collections::HashMap;

use super::super::{
    feature::{FeatureKind, SemiSharpLines, features},
    mesh::Mesh,
    refine::is_still_feature,
};
use super::{
    Block, Blocks, SemiSharp,
    first_level::FirstLevel,
    runs::Runs,
    template::{Shape, Spoke, Template},
};
use crate::cage::{NONE, Topology};

impl Blocks {
    /// Links a cage of quads; all depths are 0.
    ///
    /// # Errors
    /// Says so when a face is no quad: refine the cage once first. And when the points around its features are too
    /// many to be numbered.
    pub fn new(topology: &Topology) -> Result<Self, &'static str> {
        if !topology.all_quads() {
            return Err("the cage has faces that are no quads: refine it once first");
        }
        let made = u64::from(topology.vertex_count())
            + u64::from(topology.edge_count())
            + u64::from(topology.face_count());
        if made + u64::from(topology.vertex_count()) >= u64::from(NONE) {
            return Err("the cage makes more points than can be numbered");
        }
        let kinds = features(topology);
        let depth = |kind: &FeatureKind| match kind {
            FeatureKind::Regular => Mesh::REGULAR,
            _ => 0,
        };
        let stays = |kind: &FeatureKind| *kind == FeatureKind::Extraordinary;
        let mesh = Mesh::of_cage(
            topology,
            kinds.iter().map(depth).collect(),
            kinds.iter().map(stays).collect(),
        );
        let first = FirstLevel::new(&mesh);
        let mut blocks = Self {
            runs: Runs::new(first.rows.end_point()),
            semi_sharp: semi_sharp(topology, &mesh),
            mesh,
            first,
            templates: Vec::new(),
            blocks: Vec::new(),
            rings: Vec::new(),
        };
        blocks.add_blocks();
        Ok(blocks)
    }

    fn add_blocks(&mut self) {
        let mut known = HashMap::new();
        let mut corners = Vec::new();
        for vertex in
            (0..self.mesh.start.len() as u32).filter(|&at| self.mesh.extraordinary[at as usize])
        {
            let is_closed = self.mesh.ring(vertex, &mut corners);
            let shape = shape(&self.mesh, vertex, &corners, is_closed);
            let template = *known.entry(shape).or_insert_with_key(|shape| {
                self.templates.push(Template::new(shape));
                self.templates.len() as u32 - 1
            });
            self.blocks.push(Block {
                vertex,
                template,
                ring: self.rings.len() as u32,
                first_point: NONE,
            });
            self.rings.extend_from_slice(&corners);
            self.first
                .inner_points(&self.mesh, &corners, is_closed, &mut self.rings);
        }
    }
}

/// What a vertex's surroundings are at level 1.
fn shape(mesh: &Mesh, vertex: u32, corners: &[u32], is_closed: bool) -> Shape {
    let spoke = |face: usize, side: usize| match mesh.child_side_sharpness(face, side) {
        f32::INFINITY => Spoke::Sharp,
        sharpness if sharpness >= 1.0 => Spoke::SemiSharp,
        _ => Spoke::Smooth,
    };
    let mut spokes: Vec<_> = corners
        .iter()
        .map(|&at| spoke(at as usize / 4, at as usize % 4))
        .collect();
    if !is_closed {
        spokes.push(Spoke::Sharp);
    }
    Shape {
        is_closed,
        is_sharp: mesh.vertex_sharpness(vertex) >= 2.0,
        spokes,
    }
}

fn semi_sharp(topology: &Topology, mesh: &Mesh) -> SemiSharp {
    let lines = SemiSharpLines::of(topology);
    if lines.is_empty() {
        return SemiSharp::default();
    }
    let mut on_line = vec![false; mesh.start.len()];
    let mut worn = on_line.clone();
    let mut ring = Vec::new();
    for vertex in lines.vertices() {
        on_line[vertex as usize] = true;
        worn[vertex as usize] = !is_still_feature(mesh, vertex, &mut ring);
    }
    SemiSharp {
        lines,
        on_line,
        worn,
        tables: None,
    }
}
