//! The stages on a device against their references on the CPU, and the pictures they make.
//!
//! Every stage's reference gets what the device's stage before it made, so a difference shows where it arises.

use drumlin::{
    Headless, Offscreen, PoolSizes, Renderer, RendererDescriptor, TargetFormats, offscreen, wgpu,
};
use drumlin_core::{
    geo::{PATCH_COUNT, TILE_SAMPLE_COUNT},
    reference::{
        balance, decode, depth, emit,
        shared::{
            CODES_WORD, DRAW_LIST_WORDS, DrawnTile, Frame, HEIGHTS_WORD, INDEX_COUNT_WORD, NONE,
            SLOPES_WORD, SLOT_WORDS, STRIDE_ERRORS_WORD, TILE_CUT, TILE_VOIDS, UPLOAD_CUT_WORD,
            UPLOAD_WORDS, UploadHeader, VOIDS_WORD,
            patch_word::{DEPTH_CUT, FINEST_DEPTH, PATCH_CUT},
            pool::unpack_2x16_float,
        },
    },
    terrain::FramePlan,
};
use drumlin_tests::scene::{self, Camera};

/// Magenta: what no ground looks like.
const BACKGROUND: [f64; 4] = [1.0, 0.0, 1.0, 1.0];
const SIZE: [u32; 2] = [640, 360];

fn renderer(gpu: &Headless) -> Renderer {
    let descriptor = RendererDescriptor {
        formats: TargetFormats::default(),
        sizes: PoolSizes {
            slots: 64,
            color_layers: 0,
            max_drawn: 64,
            index_capacity: 655_360,
        },
        unit: scene::UNIT,
    };
    Renderer::new(&gpu.device, &gpu.queue, &descriptor).expect("a renderer")
}

struct Picture {
    color: Vec<u8>,
    distance: Vec<f32>,
}

fn render(gpu: &Headless, renderer: &mut Renderer, plan: &FramePlan) -> Picture {
    let Headless { device, queue, .. } = gpu;
    let target = Offscreen::new(device, SIZE);
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    renderer.prepare(device, queue, &mut encoder, plan);
    renderer.draw(&mut target.color_pass(&mut encoder, BACKGROUND, None));
    renderer.draw_distances(&mut target.distance_pass(&mut encoder));
    queue.submit([encoder.finish()]);
    let color = target.read_color(device, queue).expect("a picture");
    let distance = target.read_distance(device, queue).expect("distances");
    gpu.finish().expect("no complaint");
    Picture { color, distance }
}

/// Keeps a picture for a look at it, where `DRUMLIN_PICTURES` names a folder.
fn save(name: &str, color: &[u8]) {
    if let Some(folder) = std::env::var_os("DRUMLIN_PICTURES") {
        let path = std::path::Path::new(&folder).join(name);
        image::save_buffer(path, color, SIZE[0], SIZE[1], image::ColorType::Rgba8).expect("a PNG");
    }
}

fn words(gpu: &Headless, buffer: &wgpu::Buffer, count: usize) -> Vec<u32> {
    let bytes =
        offscreen::read_buffer(&gpu.device, &gpu.queue, buffer, count as u64 * 4).expect("bytes");
    let (words, _) = bytes.as_chunks::<4>();
    words.iter().map(|word| u32::from_le_bytes(*word)).collect()
}

/// What the device made of a plan.
struct Made {
    page: Vec<u32>,
    depths: Vec<u32>,
    patches: Vec<u32>,
    draw_list: Vec<u32>,
    indices: Vec<u32>,
}

fn make(gpu: &Headless, renderer: &mut Renderer, plan: &FramePlan, slots: usize) -> Made {
    let mut encoder = gpu
        .device
        .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    renderer.prepare(&gpu.device, &gpu.queue, &mut encoder, plan);
    gpu.queue.submit([encoder.finish()]);
    let buffers = renderer.buffers();
    let patch_count = plan.drawn.len() * PATCH_COUNT;
    let draw_list = words(gpu, buffers.draw_list, DRAW_LIST_WORDS);
    let made = Made {
        page: words(gpu, buffers.pages[0], slots * SLOT_WORDS),
        depths: words(gpu, buffers.depths, patch_count),
        patches: words(gpu, buffers.patches, patch_count),
        indices: words(gpu, buffers.indices, draw_list[INDEX_COUNT_WORD] as usize),
        draw_list,
    };
    gpu.finish().expect("no complaint");
    made
}

/// The page as the reference decodes it.
fn decoded(plan: &FramePlan) -> Vec<u32> {
    let mut page = vec![0; plan.uploads.len() * SLOT_WORDS];
    let mut staging = vec![0; plan.uploads.len() * UPLOAD_WORDS];
    let mut headers = Vec::new();
    for (upload, words) in plan.uploads.iter().zip(staging.chunks_mut(UPLOAD_WORDS)) {
        decode::stage_tile(&upload.tile, words);
        if let Some(cut) = &upload.cut {
            words[UPLOAD_CUT_WORD..].copy_from_slice(&cut[..]);
        }
        headers.push(UploadHeader {
            slot: upload.slot,
            quantum: upload.tile.step,
            unit: scene::UNIT,
            reserved: 0,
            step: upload.step,
            reserved_2: [0.0; 2],
        });
    }
    decode::decode(&mut page, &headers, &staging);
    page
}

/// Slopes differ by at most one step of a half float: f32 arithmetic may differ in its last bits before it is rounded.
fn assert_slopes_agree(device: &[u32], reference: &[u32]) {
    for (device, reference) in device.iter().zip(reference) {
        let (device, reference) = (unpack_2x16_float(*device), unpack_2x16_float(*reference));
        for axis in 0..2 {
            let step = (reference[axis].abs() / 1024.0).max(1.0 / f32::from(1_u16 << 14) / 1024.0);
            assert!(
                (device[axis] - reference[axis]).abs() <= step,
                "{device:?} for {reference:?}"
            );
        }
    }
}

fn assert_decoded_alike(device: &[u32], reference: &[u32]) {
    assert_eq!(device.len(), reference.len());
    for (device, reference) in device.chunks(SLOT_WORDS).zip(reference.chunks(SLOT_WORDS)) {
        let heights = HEIGHTS_WORD..HEIGHTS_WORD + TILE_SAMPLE_COUNT;
        assert!(
            device[heights.clone()] == reference[heights],
            "heights are exact"
        );
        let slopes = SLOPES_WORD..VOIDS_WORD;
        assert_slopes_agree(&device[slopes.clone()], &reference[slopes]);
        let voids = VOIDS_WORD..STRIDE_ERRORS_WORD;
        assert!(
            device[voids.clone()] == reference[voids],
            "void bits are copied"
        );
        for word in STRIDE_ERRORS_WORD..CODES_WORD {
            let [device, reference] = [device[word], reference[word]].map(f32::from_bits);
            let error = (device - reference).abs();
            assert!(
                error <= reference * 2.0_f32.powi(-22),
                "{device} for {reference}: last bits of two products"
            );
        }
        assert!(
            device[CODES_WORD..] == reference[CODES_WORD..],
            "codes and controls are copied"
        );
    }
}

/// A depth is a comparison of floats: where both sides are within their last bits it may fall either way.
fn assert_depths_agree(device: &[u32], reference: &[u32]) {
    let different = device
        .iter()
        .zip(reference)
        .filter(|(device, reference)| device != reference)
        .count();
    assert!(
        different * 1000 <= reference.len(),
        "{different} of {} depths differ",
        reference.len()
    );
    assert!(
        device
            .iter()
            .all(|depth| *depth <= 2 || *depth == FINEST_DEPTH | DEPTH_CUT)
    );
}

/// Triangles in an order of their own, each as it was written.
fn sorted_triangles(indices: &[u32]) -> Vec<[u32; 3]> {
    let (triangles, rest) = indices.as_chunks::<3>();
    assert!(rest.is_empty());
    let mut triangles = triangles.to_vec();
    triangles.sort_unstable();
    triangles
}

/// Runs every reference on what the device made before it.
fn assert_stages_agree(made: &Made, frame: &Frame, tiles: &[DrawnTile]) {
    let pages = [made.page.as_slice(), &[], &[], &[]];
    let mut depths = vec![0; made.depths.len()];
    depth::depth(frame, tiles, &pages, &mut depths);
    assert_depths_agree(&made.depths, &depths);

    let mut raised = vec![0; made.depths.len()];
    let mut patches = vec![0; made.depths.len()];
    balance::balance(frame, tiles, &made.depths, &mut raised, &mut patches);
    assert!(made.patches == patches, "patch words are exact");

    let mut draw_list = vec![0; DRAW_LIST_WORDS];
    emit::count(frame, tiles, &patches, &mut draw_list);
    let mut indices = vec![0; frame.index_capacity as usize];
    emit::write(frame, tiles, &pages, &patches, &mut draw_list, &mut indices);
    assert_eq!(made.draw_list, draw_list, "counts are exact");
    indices.truncate(draw_list[INDEX_COUNT_WORD] as usize);
    assert!(
        sorted_triangles(&made.indices) == sorted_triangles(&indices),
        "the same triangles in some order"
    );
}

/// The plan's frame as the renderer completes it.
fn completed(gpu_frame: &Frame, renderer: &Renderer) -> Frame {
    let capacity = renderer.buffers().indices.size() / 4;
    Frame {
        index_capacity: u32::try_from(capacity).expect("a list"),
        ..*gpu_frame
    }
}

#[test]
fn every_stage_does_what_its_reference_does() {
    let Some(gpu) = drumlin_tests::gpu() else {
        return;
    };
    let mut renderer = renderer(&gpu);
    let cut = scene::mixed_cut();
    let mut plan = scene::plan(&Camera::over_the_hill(SIZE), &cut);
    let slots = plan.uploads.len();
    let made = make(&gpu, &mut renderer, &plan, slots);
    assert_decoded_alike(&made.page, &decoded(&plan));
    assert_stages_agree(
        &made,
        &completed(&plan.frame.expect("a frame"), &renderer),
        &plan.drawn,
    );

    // The tiles stay where they are; what follows are other frames over them.
    plan.uploads.clear();
    for uniform in [0, 1, 2] {
        let frame = Frame {
            uniform_depth: uniform,
            ..plan.frame.expect("a frame")
        };
        plan.frame = Some(frame);
        let made = make(&gpu, &mut renderer, &plan, slots);
        let shift = u32::from(uniform == 2);
        assert!(made.depths.iter().all(|depth| *depth == uniform));
        assert_stages_agree(&made, &completed(&frame, &renderer), &plan.drawn);
        gpu.finish().expect("no complaint");
        assert_eq!(
            renderer.counts().expect("finished").shift,
            shift,
            "688,128 indices of 655,360"
        );
    }
    for tolerance in [0.25, 4.0, 64.0] {
        let frame = Frame {
            uniform_depth: NONE,
            tolerance,
            ..plan.frame.expect("a frame")
        };
        plan.frame = Some(frame);
        let made = make(&gpu, &mut renderer, &plan, slots);
        assert_stages_agree(&made, &completed(&frame, &renderer), &plan.drawn);
    }
}

/// Patches of rows 4 to 11 and columns 6 to 13 of a finest tile are cut: holes whose border is at stride 1, also when the
/// whole list is drawn a depth coarser.
#[test]
fn cut_patches_are_left_out_alike_on_both_sides() {
    let Some(gpu) = drumlin_tests::gpu() else {
        return;
    };
    let mut renderer = renderer(&gpu);
    let mut plan = scene::plan(&Camera::over_the_hill(SIZE), &scene::mixed_cut());
    let at = plan.drawn.len() - 1;
    let mut cut = Box::new([0; 32]);
    cut[4..12].fill(0xff << 6);
    plan.drawn[at].flags |= TILE_CUT;
    let slot = plan.drawn[at].slot;
    let upload = plan.uploads.iter_mut().find(|upload| upload.slot == slot);
    upload.expect("it is there").cut = Some(cut);
    let slots = plan.uploads.len();
    for uniform in [NONE, 0, 2] {
        let frame = Frame {
            uniform_depth: uniform,
            ..plan.frame.expect("a frame")
        };
        plan.frame = Some(frame);
        let made = make(&gpu, &mut renderer, &plan, slots);
        if !plan.uploads.is_empty() {
            assert_decoded_alike(&made.page, &decoded(&plan));
        }
        assert_stages_agree(&made, &completed(&frame, &renderer), &plan.drawn);
        let is_cut = |word: &&u32| **word & PATCH_CUT != 0;
        assert_eq!(made.patches.iter().filter(is_cut).count(), 64);
        plan.uploads.clear();
    }
}

#[test]
fn voids_are_holes_and_only_there() {
    let Some(gpu) = drumlin_tests::gpu() else {
        return;
    };
    let mut renderer = renderer(&gpu);
    let mut plan = scene::plan(&Camera::from_above(SIZE), &scene::mixed_cut());
    let first_drawn = plan.drawn[0].slot;
    plan.drawn[0].flags |= TILE_VOIDS;
    let upload = plan
        .uploads
        .iter_mut()
        .find(|upload| upload.slot == first_drawn)
        .expect("it is there");
    let mut tile = (*upload.tile).clone();
    let mut voids = vec![0_u8; TILE_SAMPLE_COUNT.div_ceil(8)];
    for sample in (85..115).flat_map(|row| (row * 129 + 85)..(row * 129 + 115)) {
        voids[sample / 8] |= 1 << (sample % 8);
    }
    tile.voids = Some(voids.into());
    upload.tile = tile.into();
    let slots = plan.uploads.len();
    let made = make(&gpu, &mut renderer, &plan, slots);
    assert_decoded_alike(&made.page, &decoded(&plan));
    assert_stages_agree(
        &made,
        &completed(&plan.frame.expect("a frame"), &renderer),
        &plan.drawn,
    );
    let picture = render(&gpu, &mut renderer, &plan);
    save("voids.png", &picture.color);
    let holes = picture
        .color
        .chunks(4)
        .filter(|pixel| *pixel == [255, 0, 255, 255])
        .count();
    // 30 × 30 samples 8 m apart, 700 m to 800 m below with K = 373 px: about 14,000 pixels.
    assert!(
        (10_000..20_000).contains(&holes),
        "{holes} pixels of background"
    );
}

#[test]
fn a_hill_of_two_levels_has_no_holes() {
    let Some(gpu) = drumlin_tests::gpu() else {
        return;
    };
    let mut renderer = renderer(&gpu);
    let plan = scene::plan(&Camera::over_the_hill(SIZE), &scene::mixed_cut());
    let picture = render(&gpu, &mut renderer, &plan);
    save("hill.png", &picture.color);
    for column in 0..SIZE[0] as usize {
        let is_background =
            |row: usize| picture.distance[row * SIZE[0] as usize + column] == f32::INFINITY;
        let horizon = (0..SIZE[1] as usize)
            .find(|&row| !is_background(row))
            .expect("ground below the sky");
        assert!(
            !(horizon..SIZE[1] as usize).any(is_background),
            "a hole below the horizon, column {column}"
        );
    }
    let plan = scene::plan(&Camera::from_above(SIZE), &scene::mixed_cut());
    let picture = render(&gpu, &mut renderer, &plan);
    save("above.png", &picture.color);
    let holes = picture
        .color
        .chunks(4)
        .filter(|pixel| *pixel == [255, 0, 255, 255])
        .count();
    assert_eq!(holes, 0, "background seen from above");
    assert!(
        picture
            .distance
            .iter()
            .all(|metres| (550.0..1150.0).contains(metres))
    );
}
