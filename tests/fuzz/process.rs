//! Running the built command under limits of time and memory.

use std::fs;
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

/// Limit of the processor time.
const TIME: Duration = Duration::from_secs(10);

/// Processor time after which a command whose options ask for much work is interrupted, as by Ctrl-C.
const PATIENCE: Duration = Duration::from_secs(4);

/// Processor time that an interrupted command has to end: a second of its two threads.
const GRACE: Duration = Duration::from_secs(2);

/// Limit of the time that passes, whatever the process does.
const ELAPSED: Duration = Duration::from_secs(90);

/// Limit of the memory in use, and where an option asks for much work.
const MEMORY: u64 = 1 << 30;
const MEMORY_ASKED: u64 = 4 << 30;

/// How a command ended.
#[derive(Debug, Default)]
pub(crate) struct Ended {
    /// The exit status, unless a signal ended it.
    pub(crate) status: Option<i32>,
    pub(crate) output: String,
    pub(crate) error: String,
    /// Processor time, as far as it was seen.
    pub(crate) time: Duration,
    /// Memory in use at most, as far as it was seen.
    pub(crate) memory: u64,
    /// It was interrupted because it was asked to do much.
    pub(crate) interrupted: bool,
    pub(crate) failure: Option<String>,
}

/// Reads a pipe to its end, or as much of it as anybody would look at.
fn drain(mut pipe: impl Read + Send + 'static) -> thread::JoinHandle<String> {
    thread::spawn(move || {
        let (mut kept, mut buffer) = (Vec::new(), [0; 1 << 16]);
        while let Ok(n @ 1..) = pipe.read(&mut buffer) {
            if kept.len() < 1 << 24 {
                kept.extend_from_slice(&buffer[..n]);
            }
        }
        String::from_utf8_lossy(&kept).into_owned()
    })
}

/// Processor time and memory of a process that runs, where the system reports them.
fn usage(child: &Child) -> Option<(Duration, u64)> {
    let folder = Path::new("/proc").join(child.id().to_string());
    let stat = fs::read_to_string(folder.join("stat")).ok()?;
    let mut fields = stat.rsplit(')').next()?.split_whitespace().skip(11);
    let mut ticks = || fields.next()?.parse::<u64>().ok();
    // There are a hundred ticks a second on every Linux that Rust supports.
    let time = Duration::from_millis(10 * (ticks()? + ticks()?));
    let status = fs::read_to_string(folder.join("status")).ok()?;
    let peak = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let kilobytes = peak.and_then(|p| p.split_whitespace().next()?.parse::<u64>().ok());
    Some((time, kilobytes.unwrap_or(0) << 10))
}

/// Waits for a process within the limits.
fn supervise(child: &mut Child, ended: &mut Ended, asks: bool) -> Option<ExitStatus> {
    let begun = Instant::now();
    let mut interrupted: Option<Duration> = None;
    let most = if asks { MEMORY_ASKED } else { MEMORY };
    loop {
        if let Ok(Some(status)) = child.try_wait() {
            return Some(status);
        }
        if let Some((time, memory)) = usage(child) {
            ended.time = ended.time.max(time);
            ended.memory = ended.memory.max(memory);
        }
        let reason = if ended.memory > most {
            Some(format!("it takes more than {} GB of memory", most >> 30))
        } else if interrupted.is_some_and(|at| ended.time > at + GRACE) {
            Some(format!("it goes on for {} s of processor time after an interrupt", GRACE.as_secs()))
        } else if !asks && ended.time > TIME {
            Some(format!("it takes more than {} s of processor time", TIME.as_secs()))
        } else if begun.elapsed() > ELAPSED {
            Some(format!("it does not end within {} s", ELAPSED.as_secs()))
        } else {
            None
        };
        if reason.is_some() {
            ended.failure = reason;
            _ = child.kill();
            _ = child.wait();
            return None;
        }
        if asks && interrupted.is_none() && ended.time > PATIENCE {
            _ = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
            (interrupted, ended.interrupted) = (Some(ended.time), true);
        }
        let pause = if begun.elapsed() < Duration::from_millis(100) { 1 } else { 10 };
        thread::sleep(Duration::from_millis(pause));
    }
}

/// Runs `gmlc` in a folder, with two threads. `asks`: its options ask for much work, which is then interrupted.
pub(crate) fn run(folder: &Path, args: &[String], input: &[u8], asks: bool) -> Ended {
    // Another build, such as one with a sanitizer.
    let built = std::env::var_os("GMLC_FUZZ_COMMAND").unwrap_or_else(|| env!("CARGO_BIN_EXE_gmlc").into());
    let mut command = Command::new(built);
    command
        .args(args)
        .current_dir(folder)
        .env("NO_COLOR", "1")
        .env("RUST_BACKTRACE", "0")
        .env("RAYON_NUM_THREADS", "2");
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = match command.spawn() {
        Ok(child) => child,
        Err(error) => panic!("gmlc {args:?} cannot be run: {error}"),
    };
    let (out, err) = (drain(child.stdout.take().expect("a pipe")), drain(child.stderr.take().expect("a pipe")));
    let (mut stdin, input) = (child.stdin.take().expect("a pipe"), input.to_owned());
    // It may end without having read all.
    let writer = thread::spawn(move || _ = stdin.write_all(&input));
    let mut ended = Ended::default();
    let status = supervise(&mut child, &mut ended, asks);
    _ = writer.join();
    ended.status = status.and_then(|s| s.code());
    (ended.output, ended.error) = (out.join().unwrap_or_default(), err.join().unwrap_or_default());
    if let (Some(status), None) = (status, ended.status) {
        ended.failure = Some(format!("a signal ends it: {status}: {}", ended.error.trim()));
    }
    ended
}
