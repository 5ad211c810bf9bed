use super::*;

fn write(folder: &Path, files: &[(&str, &str)]) {
    files.iter().for_each(|(name, text)| fs::write(folder.join(name), text).unwrap());
}

fn contents(folder: &Path) -> Vec<(String, String)> {
    let read = |name: String| {
        let text = fs::read_to_string(folder.join(&name)).unwrap_or_else(|_| "folder".to_owned());
        (name, text)
    };
    entries(folder).unwrap().into_iter().map(read).collect()
}

fn owned(files: &[(&str, &str)]) -> Vec<(String, String)> {
    files.iter().map(|(name, text)| ((*name).to_owned(), (*text).to_owned())).collect()
}

#[test]
fn a_result_replaces_all_of_an_earlier_one_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("a/b");
    let first = ResultFolder::begin(&target, |_| {}).unwrap();
    assert!(!first.has_earlier());
    write(first.path(), &[("filled.ply", "1"), ("fit.json", "1"), ("sensitivity-r.png", "1"), ("variance.json", "1")]);
    first.finish(None).unwrap();
    write(&target, &[("notes.txt", "mine")]);
    let second = ResultFolder::begin(&target, |_| {}).unwrap();
    assert!(second.has_earlier());
    write(second.path(), &[("fit.json", "2"), ("report.html", "2")]);
    let before = [
        ("filled.ply", "1"),
        ("fit.json", "1"),
        ("notes.txt", "mine"),
        ("sensitivity-r.png", "1"),
        ("variance.json", "1"),
    ];
    let seen: Vec<_> = contents(&target).into_iter().filter(|(name, _)| !name.starts_with('.')).collect();
    assert_eq!(seen, owned(&before), "until it is finished nothing changes");
    second.finish(None).unwrap();
    assert_eq!(contents(&target), owned(&[("fit.json", "2"), ("notes.txt", "mine"), ("report.html", "2")]));
}

#[test]
fn what_no_earlier_result_has_is_the_users() {
    let folder = tempfile::tempdir().unwrap();
    let mine = [("fit.json", "mine"), ("points.ply", "mine"), ("sensitivity-x.png", "mine"), (UNFINISHED, "mine")];
    write(folder.path(), &mine);
    let result = ResultFolder::begin(folder.path(), |_| {}).unwrap();
    write(result.path(), &[("variance.json", "1")]);
    result.finish(None).unwrap();
    assert_eq!(contents(folder.path()), owned(&[&mine[..], &[("variance.json", "1")]].concat()));
    // The fit of an inspection belongs to it, unless it was read.
    write(folder.path(), &[("report.html", "1")]);
    for (kept, is_there) in [(Some(FIT), true), (None, false)] {
        write(folder.path(), &[("report.html", "1")]);
        let result = ResultFolder::begin(folder.path(), |_| {}).unwrap();
        write(result.path(), &[("variance.json", "2")]);
        result.finish(kept).unwrap();
        assert_eq!(folder.path().join(FIT).exists(), is_there);
    }
}

#[test]
fn a_folder_with_the_name_of_a_result_is_an_error_before_anything_is_moved() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("report.html")).unwrap();
    write(folder.path(), &[("fit.json", "1")]);
    let result = ResultFolder::begin(folder.path(), |_| {}).unwrap();
    write(result.path(), &[("fit.json", "2"), ("report.html", "2")]);
    let error = result.finish(None).unwrap_err().to_string();
    assert!(error.contains("report.html") && error.contains("rename it"), "{error}");
    assert_eq!(contents(folder.path()), owned(&[("fit.json", "1"), ("report.html", "folder")]));
}

#[test]
fn a_list_that_gmlc_did_not_write_moves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let complete = folder.path().join(COMPLETE);
    fs::create_dir(&complete).unwrap();
    write(&complete, &[(LIST, "../victim.txt")]);
    write(folder.path(), &[("notes.txt", "mine")]);
    let error = ResultFolder::begin(folder.path(), |_| {}).unwrap_err().to_string();
    assert!(error.contains("not written by gmlc"), "{error}");
}

#[test]
fn what_is_not_finished_leaves_the_earlier_result() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), &[("fit.json", "1"), ("report.html", "1")]);
    let begun = ResultFolder::begin(folder.path(), |_| {}).unwrap();
    write(begun.path(), &[("fit.json", "2")]);
    drop(begun);
    assert_eq!(contents(folder.path()), owned(&[("fit.json", "1"), ("report.html", "1")]));
    let begun = ResultFolder::begin(folder.path(), |_| {}).unwrap();
    write(begun.path(), &[("fit.json", "2")]);
    assert!(begun.keep_fit().unwrap().ends_with(UNFINISHED));
    let files = [("fit.json", "1"), ("report.html", "1"), (UNFINISHED, "2")];
    assert_eq!(contents(folder.path()), owned(&files));
    let empty = tempfile::tempdir().unwrap();
    let begun = ResultFolder::begin(empty.path(), |_| {}).unwrap();
    write(begun.path(), &[("fit.json", "2")]);
    begun.keep_fit().unwrap();
    assert_eq!(contents(empty.path()), owned(&[("fit.json", "2")]));
}

/// A run that was killed at any step after its result was complete: the next one puts it in its place.
#[test]
fn a_run_that_was_killed_while_it_moved_files_is_completed() {
    let new = ["fit.json", "report.html", "views.png"];
    for moved in 0..=new.len() {
        let folder = tempfile::tempdir().unwrap();
        write(folder.path(), &[("fit.json", "1"), ("filled.ply", "1"), ("report.html", "1")]);
        let complete = folder.path().join(COMPLETE);
        fs::create_dir(&complete).unwrap();
        write(&complete, &[(LIST, &format!("{}\n{REMOVED}filled.ply", new.join("\n")))]);
        write(folder.path(), &[(MARK, MARK_TEXT)]);
        for (k, name) in new.iter().enumerate() {
            write(if k < moved { folder.path() } else { &complete }, &[(name, "2")]);
        }
        drop(ResultFolder::begin(folder.path(), |_| {}).unwrap());
        assert_eq!(contents(folder.path()), owned(&new.map(|name| (name, "2"))), "{moved} were moved");
    }
    // After the list was removed, and after the mark was.
    for mark in [&[(MARK, MARK_TEXT)][..], &[]] {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join(COMPLETE)).unwrap();
        write(folder.path(), &[&[("fit.json", "2")], mark].concat());
        drop(ResultFolder::begin(folder.path(), |_| {}).unwrap());
        assert_eq!(contents(folder.path()), owned(&[("fit.json", "2")]));
    }
}

#[test]
fn of_two_runs_into_one_folder_one_is_there_whole() {
    let folder = tempfile::tempdir().unwrap();
    let run = |text: &'static str| {
        let target = folder.path().to_owned();
        std::thread::spawn(move || {
            for _ in 0..50 {
                let result = ResultFolder::begin(&target, |_| {}).unwrap();
                write(result.path(), &[("fit.json", text), ("report.html", text), ("views.png", text)]);
                result.finish(None).unwrap();
            }
        })
    };
    [run("a"), run("b")].into_iter().for_each(|thread| thread.join().unwrap());
    let files = contents(folder.path());
    assert!(files.len() == 3 && files.iter().all(|(_, text)| *text == files[0].1), "{files:?}");
}

#[test]
fn errors_name_the_place_that_was_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let result = ResultFolder::begin(folder.path(), |_| {}).unwrap();
    let source = io::Error::other("the disk is full");
    let error = result.place(WriteError { path: result.path().join("views.png"), source }).to_string();
    assert!(error.contains(&folder.path().join("views.png").display().to_string()) && !error.contains(NEW), "{error}");
    let file = folder.path().join("file");
    fs::write(&file, "").unwrap();
    assert!(ResultFolder::begin(&file, |_| {}).is_err());
}

/// What killed runs leave goes as soon as nobody holds its lock, however young it is; what a live run has begun stays.
#[test]
fn what_killed_runs_have_begun_is_swept_by_the_next_one() {
    let folder = tempfile::tempdir().unwrap();
    let abandon = |name: &str| {
        let path = folder.path().join(format!("{NEW}{name}"));
        fs::create_dir(&path).unwrap();
        write(&path, &[("fit.json", "1"), (".gmlc-tmp-abc", "half")]);
    };
    abandon("one");
    write(folder.path(), &[(".gmlc-tmp-abc", "half")]);
    let alive = ResultFolder::begin(folder.path(), |_| {}).unwrap();
    let begun = ResultFolder::begin(folder.path(), |_| {}).unwrap();
    write(begun.path(), &[("fit.json", "2")]);
    let names = entries(folder.path()).unwrap();
    assert!(names.len() == 2 && names.iter().all(|name| name.starts_with(NEW)), "{names:?}");
    abandon("two");
    begun.finish(None).unwrap();
    assert!(alive.path().is_dir());
    drop(alive);
    assert_eq!(contents(folder.path()), owned(&[("fit.json", "2")]));
}
