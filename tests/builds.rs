//! Builds as a team runs them: from lists of many files, killed and run again, and by many processes.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    thread,
    time::Duration,
};

use serde_json::Value;

use crate::support::{
    binary, drumlin, drumlin_fails, drumlin_json, drumlin_ok, files, folder, root, told,
};

fn text(path: &Path) -> &str {
    path.to_str().expect("a plain name")
}

/// All files of a folder by their names in it.
fn bytes(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = Vec::new();
    files(folder, &mut found);
    found
        .into_iter()
        .map(|path| {
            let name = path.strip_prefix(folder).expect("it lies there").to_owned();
            (name, fs::read(&path).expect("it can be read"))
        })
        .collect()
}

/// Makes part of the terrain of a seed.
fn synth(file: &Path, window: &str) {
    drumlin_ok(["synth", "--seed", "5", "--window", window, "-o", text(file)]);
}

#[test]
fn a_list_of_files_is_as_good_as_their_names() {
    let out = folder("input-list");
    let mut list = String::from("# tiles of one terrain\n\n");
    let mut named = Vec::new();
    for (row, column) in (0..4).flat_map(|row| (0..5).map(move |column| (row, column))) {
        let name = format!("{row} {column}.tif");
        synth(
            &out.join(&name),
            &format!("{},{},30,40", 30 * row, 40 * column),
        );
        list += &format!("{name}\r\n");
        named.push(out.join(name));
    }
    let path = out.join("list.txt");
    fs::write(&path, list).expect("a list can be written");
    let [by_list, by_name] = ["list.zarr", "name.zarr"].map(|name| out.join(name));
    drumlin_ok(["build", "--input-list", text(&path), "-o", text(&by_list)]);
    let names = named.iter().map(|path| text(path));
    drumlin_ok(["build", "-o", text(&by_name)].into_iter().chain(names));
    assert!(bytes(&by_list) == bytes(&by_name));

    fs::write(&path, "none.tif\n").expect("a list can be written");
    let other = out.join("other.zarr");
    let arguments = ["build", "--input-list", text(&path), "-o", text(&other)];
    let line = drumlin_fails(3, arguments);
    assert!(line.contains("none.tif"), "{line}");
    fs::write(&path, "# nothing\n").expect("a list can be written");
    let line = drumlin_fails(2, arguments);
    assert!(line.contains("names no input"), "{line}");
    fs::remove_file(&path).expect("a list can be removed");
    drumlin_fails(3, arguments);
    assert!(!other.exists());
}

#[test]
fn a_build_that_is_killed_at_any_moment_goes_on_to_the_same_bytes() {
    let out = folder("killed");
    let [tif, whole, killed] = ["a.tif", "whole.zarr", "killed.zarr"].map(|name| out.join(name));
    synth(&tif, "0,0,4200,500");
    let arguments =
        |pyramid| ["build", text(&tif), "-o", text(pyramid), "--json"].map(String::from);
    drumlin_ok(arguments(&whole));
    let mut kills = 0;
    let ended = loop {
        let mut build = Command::new(binary("drumlin"))
            .args(arguments(&killed))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("drumlin starts");
        // Moments all over the build, and later ones from time to time, so that some run ends.
        thread::sleep(Duration::from_millis(
            20 + 397 * kills % (150 + 100 * kills),
        ));
        let _ = build.kill();
        let ended = build.wait_with_output().expect("drumlin ends");
        if ended.status.success() {
            break ended;
        }
        assert!(ended.status.code().is_none(), "{}", told(&ended));
        assert!(!killed.exists());
        kills += 1;
    };
    let report: Value = serde_json::from_slice(&ended.stdout).expect("JSON");
    assert!(kills > 2, "{kills} {report}");
    assert!(bytes(&whole) == bytes(&killed));
    // Nothing is left to do.
    let again = drumlin_json(arguments(&killed));
    assert_eq!(again["unchanged"], true);
    let mut finer = arguments(&killed).to_vec();
    finer.extend(["--eps", "0.5"].map(String::from));
    let line = drumlin_fails(2, &finer);
    assert!(line.contains("already"), "{line}");
}

#[test]
fn what_an_earlier_run_of_something_else_left_is_thrown_away_and_said() {
    let out = folder("left");
    let [tif, pyramid] = ["a.tif", "a.zarr"].map(|name| out.join(name));
    synth(&tif, "0,0,700,500");
    drumlin_ok([
        "plan",
        text(&tif),
        "-o",
        text(&pyramid),
        "--plan",
        text(&out.join("plan")),
    ]);
    let other = ["build", text(&tif), "-o", text(&pyramid), "--eps", "0.5"];
    let ended = drumlin(other);
    let errors = String::from_utf8_lossy(&ended.stderr);
    assert!(
        ended.status.success() && errors.contains("starting over"),
        "{}",
        told(&ended)
    );
    let lines = errors.lines().filter(|line| line.contains("starting over"));
    assert_eq!(lines.count(), 1, "{errors}");
}

#[test]
fn tasks_of_many_processes_in_any_order_write_what_a_build_writes() {
    let out = folder("tasks");
    let [tif, whole, pyramid, plan] =
        ["a.tif", "whole.zarr", "tasks.zarr", "plan.jsonl"].map(|name| out.join(name));
    synth(&tif, "0,0,4200,300");
    drumlin_ok(["build", text(&tif), "-o", text(&whole)]);
    let planned = drumlin_json([
        "plan",
        text(&tif),
        "-o",
        text(&pyramid),
        "--plan",
        text(&plan),
        "--json",
    ]);
    let lines = fs::read_to_string(&plan).expect("the plan can be read");
    let lines = lines
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
    let mut tasks: Vec<Value> = lines.skip(1).collect();
    assert_eq!(planned["tasks"], tasks.len());
    let run = |task: &Value| {
        [
            "task".into(),
            text(&plan).to_owned(),
            format!("--id={task}"),
        ]
    };
    let line = drumlin_fails(2, run(&tasks[9]["task"]));
    assert!(line.contains("has to be done first"), "{line}");
    let line = drumlin_fails(2, ["finish", text(&plan)]);
    assert!(line.contains("task 0 (read 0)"), "{line}");

    // One after another those whose passes are done, the last of the list first; each twice at once, and once later.
    let mut before: Option<Value> = None;
    while !tasks.is_empty() {
        let ready = |task: &Value| {
            let needs = &task["needs"];
            needs.is_null() || !tasks.iter().any(|other| other["pass"] == *needs)
        };
        let next = tasks.iter().rposition(ready).expect("some task is ready");
        let task = tasks.remove(next)["task"].clone();
        let both: Vec<_> = [Some(task.clone()), Some(task.clone()), before.replace(task)]
            .into_iter()
            .flatten()
            .map(|task| {
                let mut command = Command::new(binary("drumlin"));
                command
                    .args(run(&task))
                    .stderr(Stdio::piped())
                    .spawn()
                    .expect("drumlin starts")
            })
            .collect();
        for task in both {
            let ended = task.wait_with_output().expect("drumlin ends");
            assert!(ended.status.success(), "{}", told(&ended));
        }
    }
    let busy = drumlin_json(
        ["finish", text(&plan)]
            .map(String::from)
            .into_iter()
            .chain(["--json".into()]),
    );
    assert_eq!(busy["unchanged"], false);
    assert!(bytes(&whole) == bytes(&pyramid));
    // A late one.
    drumlin_ok(run(&Value::from(3)));
    // Once an input is another, its plan is nothing to go by.
    synth_over(&tif);
    let line = drumlin_fails(4, run(&Value::from(3)));
    assert!(line.contains("a.tif: changed"), "{line}");
    fs::write(&plan, "{}").expect("the plan can be written");
    let line = drumlin_fails(1, ["finish", text(&plan)]);
    assert!(line.contains("not a plan"), "{line}");
}

/// Makes another terrain under the same name.
fn synth_over(file: &Path) {
    let name = text(file);
    drumlin_ok([
        "synth",
        "--seed",
        "6",
        "--size",
        "100",
        "-o",
        name,
        "--overwrite",
    ]);
}

#[cfg(unix)]
#[test]
fn the_documented_recipe_for_gnu_parallel_builds() {
    let there = |program: &str| {
        let asked = Command::new(program).arg("--version").output();
        asked.is_ok_and(|output| String::from_utf8_lossy(&output.stdout).contains(program))
    };
    if !there("parallel") || !there("jq") {
        println!("skipped: GNU parallel and jq are not both here");
        return;
    }
    let out = folder("parallel");
    let [tif, whole] = ["a.tif", "whole.zarr"].map(|name| out.join(name));
    synth(&tif, "0,0,4200,300");
    drumlin_ok(["build", text(&tif), "-o", text(&whole)]);
    let page = fs::read_to_string(root().join("tools/drumlin/README.md")).expect("the page");
    let (_, recipe) = page.split_once("## GNU parallel").expect("the recipe");
    let recipe = recipe
        .split("```")
        .nth(1)
        .expect("a block")
        .trim_start_matches("sh");
    let script = format!("drumlin plan a.tif -o out.zarr --plan plan.jsonl\n{recipe}");
    let program = binary("drumlin");
    let programs = program.parent().expect("a folder").to_owned();
    let old = std::env::var_os("PATH").unwrap_or_default();
    let path = std::iter::once(programs).chain(std::env::split_paths(&old));
    let ended = Command::new("sh")
        .args(["-ec", &script])
        .current_dir(&out)
        .env("PATH", std::env::join_paths(path).expect("a path"))
        .output()
        .expect("sh starts");
    assert!(ended.status.success(), "{}", told(&ended));
    assert!(bytes(&whole) == bytes(&out.join("out.zarr")));
}

#[test]
fn dask_builds_what_a_build_builds() {
    let python = std::env::var_os("DRUMLIN_PYTHON").unwrap_or_else(|| "python3".into());
    let asked = Command::new(&python)
        .args(["-c", "import distributed"])
        .output();
    if !asked.is_ok_and(|output| output.status.success()) {
        assert!(
            std::env::var_os("CI").is_none(),
            "CI needs Dask (pip install distributed)"
        );
        println!("skipped: no Dask here");
        return;
    }
    let out = folder("dask");
    let [tif, whole, pyramid, plan] =
        ["a.tif", "whole.zarr", "dask.zarr", "plan.jsonl"].map(|name| out.join(name));
    synth(&tif, "0,0,4200,300");
    drumlin_ok(["build", text(&tif), "-o", text(&whole)]);
    drumlin_ok([
        "plan",
        text(&tif),
        "-o",
        text(&pyramid),
        "--plan",
        text(&plan),
    ]);
    let dask = |words: &[&str]| {
        Command::new(&python)
            .args([
                "-m",
                "drumlin_dask",
                text(&plan),
                "--workers",
                "2",
                "--quiet",
            ])
            .args(["--retries", "1", "--drumlin"])
            .arg(binary("drumlin"))
            .args(words)
            .env("PYTHONPATH", root().join("tools/dask"))
            .env("PYTHONDONTWRITEBYTECODE", "1")
            .current_dir(&out)
            .output()
            .expect("Python starts")
    };
    let told_of =
        |output: &std::process::Output| String::from_utf8_lossy(&output.stderr).into_owned();
    let small = dask(&["--memory", "1000000"]);
    assert!(
        !small.status.success() && told_of(&small).contains("fewer workers"),
        "{}",
        told(&small)
    );
    // Enough for two workers, each with a task at a time.
    let ended = dask(&["--memory", "2000000000"]);
    assert!(ended.status.success(), "{}", told(&ended));
    assert!(bytes(&whole) == bytes(&pyramid));
}
