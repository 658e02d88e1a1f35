//! The example of embedding, run as a foreign application would be.

use std::process::Command;

use crate::support::{binary, folder, has_gpu, rainier_pyramid, told};

#[test]
fn a_foreign_application_draws_two_terrains_into_its_own_picture() {
    if !has_gpu() {
        return;
    }
    let picture = folder("embed").join("picture.png");
    let output = Command::new(binary("examples/embed"))
        .args([rainier_pyramid(), rainier_pyramid(), &picture])
        .output()
        .expect("the example starts");
    assert!(output.status.success(), "{}", told(&output));
    let told = String::from_utf8_lossy(&output.stdout);
    assert_eq!(told.matches("0 missing").count(), 2, "{told}");
    let pixels = image::open(&picture)
        .expect("it made a picture")
        .into_rgb8();
    assert_eq!(pixels.dimensions(), (1280, 360));
    // The lower half of both views is ground: no pixel there has the sky's blue over its red and green.
    let ground = |left: u32| {
        (200..360)
            .flat_map(|y| (left..left + 640).map(move |x| (x, y)))
            .filter(|&(x, y)| {
                let [r, g, b] = pixels.get_pixel(x, y).0;
                b <= r.max(g).saturating_add(12)
            })
            .count()
    };
    for left in [0, 640] {
        let share = ground(left) as f64 / (640.0 * 160.0);
        assert!(share > 0.9, "{share} of the lower half is ground");
    }
}
