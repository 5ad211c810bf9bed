//! Locks of folders, which runs that put their results into one folder take in turn.

use std::fs::{File, TryLockError};
use std::io::{Error, ErrorKind};
use std::path::Path;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// A run holds the lock while it moves files within a folder, which takes milliseconds: after this time the user hears
/// of it, and after that the run gives up, as whoever holds it was stopped or is not gmlc.
const SAID_AFTER: Duration = Duration::from_secs(1);
const MOST: Duration = Duration::from_secs(20);
const BETWEEN: Duration = Duration::from_millis(20);

/// Takes the lock of a folder; None where the system has no locks of folders. `say` is told if it takes long.
///
/// # Errors
/// If another process holds the lock for a long time.
pub(super) fn locked(folder: &Path, say: fn(&str)) -> Result<Option<File>, Error> {
    within(MOST, folder, say)
}

fn within(most: Duration, folder: &Path, say: fn(&str)) -> Result<Option<File>, Error> {
    let Ok(file) = File::open(folder) else { return Ok(None) };
    let begun = Instant::now();
    let mut is_said = false;
    loop {
        match file.try_lock() {
            Ok(()) => return Ok(Some(file)),
            Err(TryLockError::Error(_)) => return Ok(None),
            Err(TryLockError::WouldBlock) => {}
        }
        if begun.elapsed() >= most {
            let by = holder(&file);
            let message = format!("it is locked by {by}; end that, or name another folder");
            return Err(Error::new(ErrorKind::WouldBlock, message));
        }
        if begun.elapsed() >= SAID_AFTER && !is_said {
            is_said = true;
            let (folder, by, most) = (folder.display(), holder(&file), most.as_secs());
            say(&format!("waiting for up to {most} s: `{folder}` is locked by {by}"));
        }
        sleep(BETWEEN);
    }
}

/// The process that holds the lock of a file, as far as the system tells.
#[cfg(target_os = "linux")]
fn holder(file: &File) -> String {
    use std::os::unix::fs::MetadataExt;
    let known = || {
        let node = format!(":{}", file.metadata().ok()?.ino());
        let locks = std::fs::read_to_string("/proc/locks").ok()?;
        // Such as `1: FLOCK  ADVISORY  WRITE 4711 08:01:1234 0 EOF`; who waits for it has an arrow before the kind.
        let lines = locks.lines().map(|line| line.split_whitespace().collect::<Vec<_>>());
        let held = lines.filter(|words| words.get(1) == Some(&"FLOCK"));
        let mut processes = held
            .filter(|words| words.get(5).is_some_and(|place| place.ends_with(&node)))
            .map(|words| words[4].to_owned());
        let process = processes.find(|process| process.parse::<u32>().is_ok_and(|p| p > 0))?;
        let name = std::fs::read_to_string(format!("/proc/{process}/comm")).unwrap_or_default();
        Some(format!("process {process} ({})", name.trim()))
    };
    known().unwrap_or_else(|| "another process".to_owned())
}

#[cfg(not(target_os = "linux"))]
fn holder(_: &File) -> String {
    "another process".to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whoever_waits_says_for_what_and_gives_up() {
        static SAID: std::sync::Mutex<String> = std::sync::Mutex::new(String::new());
        let folder = tempfile::tempdir().unwrap();
        let held = locked(folder.path(), |_| {}).unwrap();
        let error = within(Duration::from_millis(1500), folder.path(), |text| SAID.lock().unwrap().push_str(text));
        let error = error.unwrap_err().to_string();
        let said = SAID.lock().unwrap().clone();
        assert!(error.contains("is locked by") && error.contains("name another folder"), "{error}");
        assert!(said.contains(&folder.path().display().to_string()) && said.contains("waiting"), "{said}");
        if cfg!(target_os = "linux") {
            let process = std::process::id().to_string();
            assert!(said.contains(&process) || said.contains("another process"), "{said}");
        }
        drop(held);
        assert!(locked(folder.path(), |_| {}).is_ok());
    }
}
