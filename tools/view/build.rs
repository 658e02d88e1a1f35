//! Tells the program which commit it is built from, for reports.

use std::process::Command;

fn main() {
    let git = |arguments: &[&str]| {
        let output = Command::new("git")
            .args(arguments)
            .output()
            .ok()
            .filter(|output| output.status.success())?;
        Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
    };
    println!("cargo:rerun-if-changed=build.rs");
    // Grows with every commit and checkout; where it is missing, cargo would run this script each time.
    if let Some(log) = git(&["rev-parse", "--git-path", "logs/HEAD"])
        .filter(|log| std::fs::exists(log).is_ok_and(|it| it))
    {
        println!("cargo:rerun-if-changed={log}");
    }
    println!(
        "cargo:rustc-env=DRUMLIN_COMMIT={}",
        git(&["rev-parse", "HEAD"]).unwrap_or_else(|| "unknown".into())
    );
}
