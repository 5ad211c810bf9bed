//! Running the built command.

pub(crate) mod ball;
pub(crate) mod mesh;
pub(crate) mod nist;
pub(crate) mod solid;

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// The repository's root.
pub(crate) fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Whether tests do in full what they else do in part, because it takes minutes: with GMLC_THOROUGH set.
pub(crate) fn is_thorough() -> bool {
    std::env::var_os("GMLC_THOROUGH").is_some()
}

/// A path below the root as text.
pub(crate) fn example(name: &str) -> String {
    root().join("examples").join(name).display().to_string()
}

/// Runs `gmlc` in a folder.
pub(crate) fn gmlc_in(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gmlc"));
    command.args(args).current_dir(folder).env("NO_COLOR", "1");
    command.output().unwrap_or_else(|e| panic!("gmlc cannot be run: {e}"))
}

/// Runs `gmlc` in a folder with a text as its standard input; returns its status and standard output.
pub(crate) fn gmlc_with_input(folder: &Path, args: &[&str], input: &str) -> (Option<i32>, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gmlc"));
    command.args(args).current_dir(folder).env("NO_COLOR", "1");
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
    let mut child = command.spawn().unwrap_or_else(|e| panic!("gmlc cannot be run: {e}"));
    child.stdin.take().expect("a pipe").write_all(input.as_bytes()).expect("written");
    let output = child.wait_with_output().expect("its output");
    (output.status.code(), text(&output.stdout))
}

/// Runs `gmlc` and expects success; returns standard output.
pub(crate) fn gmlc(folder: &Path, args: &[&str]) -> String {
    let output = gmlc_in(folder, args);
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "gmlc {}\n{out}\n{err}", args.join(" "));
    out
}

/// Runs `gmlc` and expects an exit status; returns standard error.
pub(crate) fn fails(folder: &Path, args: &[&str], status: i32) -> String {
    let output = gmlc_in(folder, args);
    let err = text(&output.stderr);
    assert_eq!(output.status.code(), Some(status), "gmlc {}\n{err}", args.join(" "));
    err
}

/// Bytes as text.
pub(crate) fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The files of a folder of results without the seconds that stages took, which fit.json and variance.json have under
/// `seconds` and the report in a row, and without what they were made with: the date, which the scene has, too, and the
/// folder of the results. All other bytes stay.
pub(crate) fn results(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let is_timed = |line: &&str| {
        [">Time</th>", "<dt>Inspected</dt>", "<p><code>gmlc inspect", "<MetadataString name='time'"]
            .iter()
            .any(|timed| line.contains(timed))
    };
    let read = |entry: std::io::Result<fs::DirEntry>| {
        let entry = entry.expect("an entry");
        let name = entry.file_name().to_string_lossy().into_owned();
        let bytes = if name.ends_with(".json") {
            let mut document = json(&entry.path());
            for field in ["seconds", "provenance"] {
                document.as_object_mut().expect("an object").remove(field);
            }
            document.to_string().into_bytes()
        } else if name.ends_with(".html") || name.ends_with(".x3d") {
            let page = fs::read_to_string(entry.path()).expect("read");
            assert!(page.lines().filter(is_timed).count() <= 3, "{name}");
            page.lines().filter(|line| !is_timed(line)).collect::<Vec<_>>().join("\n").into_bytes()
        } else {
            fs::read(entry.path()).expect("read")
        };
        (name, bytes)
    };
    let is_file = |entry: &std::io::Result<fs::DirEntry>| entry.as_ref().is_ok_and(|entry| entry.path().is_file());
    fs::read_dir(folder).expect("a folder").filter(is_file).map(read).collect()
}

/// A step that a page asks its reader to take.
pub(crate) enum Step {
    /// The arguments of a command: a line that begins with `gmlc` in a fenced block marked `sh`. One that ends with a
    /// backslash goes on in the next.
    Run(String),
    /// A script to save: its name and text, from a block marked `gml` whose first line is `// NAME.gml`.
    Save(String, String),
}

/// The steps of a page in order.
pub(crate) fn steps(page: &Path) -> Vec<Step> {
    let text = std::fs::read_to_string(page).unwrap_or_else(|e| panic!("{}: {e}", page.display()));
    let mut steps = Vec::new();
    for block in text.split("```").skip(1).step_by(2) {
        if let Some(lines) = block.strip_prefix("sh\n") {
            let lines = lines.replace("\\\n", " ");
            let commands = lines.lines().filter_map(|l| l.strip_prefix("gmlc "));
            steps.extend(commands.map(|l| Step::Run(l.split('#').next().unwrap_or("").trim().to_owned())));
        } else if let Some(script) = block.strip_prefix("gml\n")
            && let Some((name, _)) = script.strip_prefix("// ").and_then(|s| s.split_once('\n'))
            && name.ends_with(".gml")
        {
            steps.push(Step::Save(name.to_owned(), script.to_owned()));
        }
    }
    steps
}

/// The commands of a page.
pub(crate) fn commands(page: &Path) -> Vec<String> {
    let run = |step| if let Step::Run(command) = step { Some(command) } else { None };
    steps(page).into_iter().filter_map(run).collect()
}

/// Copies a folder with all that is in it.
pub(crate) fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder");
    for entry in std::fs::read_dir(from).expect("a folder") {
        let path = entry.expect("an entry").path();
        let target = to.join(path.file_name().expect("a name"));
        if path.is_dir() { copy(&path, &target) } else { std::fs::copy(&path, &target).map(|_| ()).expect("copied") }
    }
}

/// A JSON file.
pub(crate) fn json(path: &Path) -> serde_json::Value {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// A fitted parameter's value.
pub(crate) fn parameter(fit: &serde_json::Value, name: &str) -> f64 {
    let all = fit["parameters"].as_array().expect("parameters");
    let found = all.iter().find(|p| p["name"] == name).unwrap_or_else(|| panic!("no parameter {name}"));
    found["value"].as_f64().expect("a number")
}

/// The folder of real scans, where there is one.
pub(crate) fn test_data() -> Option<PathBuf> {
    let folder = std::env::var_os("GMLC_TEST_DATA").map(PathBuf::from);
    if folder.is_none() {
        println!("skipped: GMLC_TEST_DATA is not set");
    }
    folder
}
