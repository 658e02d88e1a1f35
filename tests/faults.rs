//! Every call of a verb to the operating system fails in turn: what is left is whole or not there, and a second run ends
//! as if nothing had been.
//!
//! A small library (`faults/shim.c`), loaded before the C library, counts the calls that touch the output's folder and
//! lets one go wrong. In short form some calls fail; `DRUMLIN_FAULTS=all` tries each.
#![cfg(target_os = "linux")]

use std::{
    collections::BTreeMap,
    env, fs,
    path::{Path, PathBuf},
    process::{Command, Output},
    sync::OnceLock,
};

use crate::support::{binary, drumlin_ok, files, folder, root, told};

/// Ways of going wrong.
const KINDS: [&str; 6] = ["full", "io", "quota", "short", "lost", "kill"];
/// Faults of each kind in short form.
const FEW: u64 = 8;

/// Something that writes `output`, again and again the same.
struct Case<'a> {
    name: &'a str,
    arguments: Vec<&'a str>,
    output: &'a Path,
    /// What lies at the output before: not there where `None`.
    before: Option<Contents>,
    /// Whether a failure to write leaves something to go on with, and says so by its exit code.
    resumes: bool,
}

/// A file's bytes, or those of all files of a folder by name.
type Contents = BTreeMap<PathBuf, Vec<u8>>;

fn contents(path: &Path) -> Option<Contents> {
    if !path.exists() {
        return None;
    }
    let mut found = vec![path.to_owned()];
    if path.is_dir() {
        found.clear();
        files(path, &mut found);
    }
    let relative = |file: &PathBuf| file.strip_prefix(path).expect("it lies there").to_owned();
    let read = |file: &PathBuf| fs::read(file).expect("it can be read");
    Some(
        found
            .iter()
            .map(|file| (relative(file), read(file)))
            .collect(),
    )
}

fn put(path: &Path, contents: &Contents) {
    for (name, bytes) in contents {
        // A file's own name is none.
        let file = if name.as_os_str().is_empty() {
            path.to_owned()
        } else {
            path.join(name)
        };
        let folder = file.parent().expect("it lies in a folder");
        fs::create_dir_all(folder).expect("a folder can be made");
        fs::write(file, bytes).expect("a file can be written");
    }
}

/// The library that lets calls fail, compiled once.
fn shim() -> &'static Path {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    BUILT.get_or_init(|| {
        let path = folder("faults-shim").join("shim.so");
        let compiled = Command::new(env::var_os("CC").unwrap_or_else(|| "cc".into()))
            .args(["-shared", "-fPIC", "-O1", "-o"])
            .arg(&path)
            .arg(root().join("tests/faults/shim.c"))
            .arg("-ldl")
            .output()
            .expect("there is a C compiler, as for zstd");
        assert!(compiled.status.success(), "{}", told(&compiled));
        path
    })
}

impl Case<'_> {
    fn folder(&self) -> &Path {
        self.output.parent().expect("it lies in a folder")
    }

    /// Runs with one call failing; none where `at` is 0.
    fn run(&self, kind: &str, at: u64) -> Output {
        Command::new(binary("drumlin"))
            .args(&self.arguments)
            .env("LD_PRELOAD", shim())
            .env("FAULT_UNDER", self.folder())
            .env("FAULT_KIND", kind)
            .env("FAULT_AT", at.to_string())
            .env("FAULT_COUNT", self.count_file())
            .output()
            .expect("drumlin starts")
    }

    fn count_file(&self) -> PathBuf {
        self.folder().with_extension("count")
    }

    fn start(&self) {
        if self.folder().exists() {
            fs::remove_dir_all(self.folder()).expect("the folder can be removed");
        }
        fs::create_dir_all(self.folder()).expect("the folder can be made");
        if let Some(before) = &self.before {
            put(self.output, before);
        }
    }

    /// Lets calls fail, one a run.
    fn try_all(&self) {
        self.start();
        let ended = self.run("none", 0);
        assert!(ended.status.success(), "{}", told(&ended));
        let wanted = contents(self.output).expect("the output is there");
        let calls = fs::read_to_string(self.count_file()).expect("the calls were counted");
        let calls: u64 = calls.trim().parse().expect("a number");
        assert!(calls > 5, "{}: {calls} calls", self.name);
        let all = env::var_os("DRUMLIN_FAULTS").is_some();
        let step = if all { 1 } else { calls / FEW + 1 };
        let tries = (0..).zip(KINDS).flat_map(|(which, kind)| {
            // Other calls for each kind.
            (1..=calls)
                .filter(move |at| at % step == which % step)
                .map(move |at| (kind, at))
        });
        let wrong = tries.filter_map(|(kind, at)| self.try_one(kind, at, &wanted).err());
        let wrong: Vec<_> = wrong.collect();
        assert!(
            wrong.is_empty(),
            "{} of them:\n{}",
            wrong.len(),
            wrong.join("\n")
        );
        println!(
            "{}: {calls} calls, one in {step} failed in each of {} ways",
            self.name,
            KINDS.len()
        );
    }

    /// Lets one call fail; what is wrong with what comes of it.
    fn try_one(&self, kind: &str, at: u64, wanted: &Contents) -> Result<(), String> {
        self.start();
        let failed = self.run(kind, at);
        let left = contents(self.output);
        let whole = left.as_ref() == Some(wanted);
        let again = self.run("none", 0);
        let (first, second) = (told(&failed), told(&again));
        let check = |right: bool, wrong: &str| {
            let what = || {
                format!(
                    "{}, call {at}, {kind}: {wrong}: {first}\nand then {second}",
                    self.name
                )
            };
            right.then_some(()).ok_or_else(what)
        };
        check(whole || left == self.before, "something else is there")?;
        match failed.status.code() {
            // What is not needed may fail; and a thread may have got by.
            Some(0) => check(whole, "said that it is done")?,
            Some(3) => check(one_line(&failed), "not one clear line")?,
            Some(4) => check(self.resumes && one_line(&failed), "not one clear line")?,
            Some(_) => check(false, "another exit code")?,
            None => check(kind == "kill", "a signal")?,
        }
        // A build says that there is nothing left to do, others refuse to replace what is whole.
        let refused = whole && self.before.is_none() && again.status.code() == Some(2);
        check(again.status.success() || refused, "the second run fails")?;
        check(
            contents(self.output).as_ref() == Some(wanted),
            "other bytes in the end",
        )?;
        let mut all = fs::read_dir(self.folder()).expect("the folder can be read");
        check(
            all.next().is_some() && all.next().is_none(),
            "something is left beside it",
        )
    }
}

/// One clear line after what was said of the inputs.
fn one_line(output: &Output) -> bool {
    let errors = String::from_utf8_lossy(&output.stderr);
    let lines: Vec<_> = errors
        .lines()
        .filter(|line| !line.contains("coordinate system"))
        .collect();
    lines.len() == 1 && lines[0].starts_with("drumlin: ") && !errors.contains("panicked")
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a plain name")
}

/// A raster of some kilobytes in a folder of its own.
fn raster(folder: &Path) -> PathBuf {
    let tif = folder.join("a.tif");
    drumlin_ok([
        "synth",
        "--seed",
        "5",
        "--window",
        "0,0,150,200",
        "-o",
        text(&tif),
    ]);
    tif
}

#[test]
fn builds_are_whole_or_gone_on_with_whatever_call_fails() {
    let out = folder("faults-build");
    let tif = raster(&out);
    let picture = out.join("a.png");
    let texel = |x: u32, y: u32| image::Rgb([x, y, x ^ y].map(|sum| sum.to_le_bytes()[0]));
    let saved = image::RgbImage::from_fn(300, 200, texel).save(&picture);
    saved.expect("a picture can be written");
    let output = out.join("built/a.zarr");
    let arguments = [
        "build",
        text(&tif),
        "-o",
        text(&output),
        "-j",
        "2",
        "--imagery",
    ];
    let case = Case {
        name: "build",
        arguments: arguments.into_iter().chain([text(&picture)]).collect(),
        output: &output,
        before: None,
        resumes: true,
    };
    case.try_all();
}

#[test]
fn an_old_pyramid_stays_until_the_new_one_is_whole_whatever_call_fails() {
    let out = folder("faults-overwrite");
    let tif = raster(&out);
    let (old, output) = (out.join("old.zarr"), out.join("built/a.zarr"));
    drumlin_ok(["build", text(&tif), "--eps", "1", "-o", text(&old)]);
    let mut arguments = vec!["build", text(&tif), "-o", text(&output), "--overwrite"];
    arguments.extend(["-j", "2"]);
    let case = Case {
        name: "build --overwrite",
        arguments,
        output: &output,
        before: contents(&old),
        resumes: true,
    };
    case.try_all();
}

#[test]
fn other_outputs_are_whole_or_not_there_whatever_call_fails() {
    let out = folder("faults-others");
    let tif = raster(&out);
    let pyramid = out.join("a.zarr");
    let archive = out.join("a.zip");
    drumlin_ok(["build", text(&tif), "-o", text(&pyramid)]);
    drumlin_ok(["pack", text(&pyramid), text(&archive)]);
    let [zip, folder, synth, cog, part] = [
        "zip/a.zip",
        "folder/a.zarr",
        "synth/a.tif",
        "cog/a.tif",
        "part/a.tif",
    ]
    .map(|name| out.join(name));
    let cases = [
        ("pack", &zip, vec!["pack", text(&pyramid), text(&zip)]),
        (
            "unpack",
            &folder,
            vec!["unpack", text(&archive), text(&folder)],
        ),
        (
            "synth",
            &synth,
            vec![
                "synth",
                "--seed",
                "5",
                "--window",
                "0,0,150,200",
                "-o",
                text(&synth),
            ],
        ),
        (
            "export",
            &cog,
            vec!["export", "--to", "cog", text(&pyramid), "-o", text(&cog)],
        ),
        (
            "extract",
            &part,
            vec![
                "extract",
                text(&pyramid),
                "--bbox",
                "100,-1400,1500,-100",
                "-o",
                text(&part),
            ],
        ),
    ];
    for (name, output, arguments) in cases {
        Case {
            name,
            arguments,
            output,
            before: None,
            resumes: false,
        }
        .try_all();
    }
}
