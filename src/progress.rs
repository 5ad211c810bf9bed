//! Progress on standard error: a bar on a terminal, a line from time to time elsewhere.

use crate::{interrupt, verbosity};
use gml_runtime::progress::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::fmt::Display;
use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Time between two lines where standard error is not a terminal.
const BETWEEN_LINES: Duration = Duration::from_secs(10);

/// Time between two pictures of a bar that nothing changes.
const BETWEEN_PICTURES: Duration = Duration::from_millis(250);

/// Time and share of the work from which on the time left is estimated: work of less than a second needs no estimate,
/// and the stages' shares of the work differ from model to model.
const TELLING_TIME: Duration = Duration::from_secs(1);
const TELLING_SHARE: f64 = 0.1;

/// The work as it was last reported.
#[derive(Default)]
struct Work {
    /// None before the first report.
    begun: Option<Instant>,
    stage: String,
    /// When the stage was first reported.
    stage_begun: Option<Instant>,
    detail: String,
    /// Between 0 and 1.
    done: f64,
}

impl Work {
    fn report(&mut self, stage: &str, done: f64, detail: &str) {
        let now = Instant::now();
        self.begun.get_or_insert(now);
        self.stage_begun.get_or_insert(now);
        self.stage.replace_range(.., stage);
        self.detail.replace_range(.., detail);
        if done.is_finite() {
            self.done = done.clamp(0.0, 1.0);
        }
    }

    /// Ends a stage if the next one has another name; returns the line that says how long it took.
    fn end_stage(&mut self, next: Option<&str>) -> Option<String> {
        if next == Some(self.stage.as_str()) {
            return None;
        }
        self.stage_begun.take().map(|begun| verbosity::took(&self.stage, begun.elapsed()))
    }

    /// The time left, where it can be estimated.
    fn left(&self) -> Option<Left> {
        let elapsed = self.begun?.elapsed();
        let telling = elapsed >= TELLING_TIME && self.done >= TELLING_SHARE && self.done < 1.0;
        telling.then(|| Left(elapsed.as_secs_f64() * (1.0 - self.done) / self.done))
    }

    /// Everything in a line; none before the first report.
    fn line(&self) -> Option<String> {
        self.begun?;
        let share = if self.done > 0.0 { format!(", {:.0} %", 100.0 * self.done) } else { String::new() };
        let left = self.left().map_or_else(String::new, |left| format!(", {left}"));
        let detail = if self.detail.is_empty() { String::new() } else { format!(" ({})", self.detail) };
        Some(format!("{}{share}{left}{detail}", self.stage))
    }
}

/// Seconds that are left, as they are known: roughly.
struct Left(f64);

impl Display for Left {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Left(seconds) = *self;
        match seconds {
            s if s < 10.0 => write!(f, "some seconds left"),
            s if s < 90.0 => write!(f, "about {:.0} s left", (s / 10.0).round() * 10.0),
            s if s < 5400.0 => write!(f, "about {:.0} min left", s / 60.0),
            s => write!(f, "about {:.0} h left", s / 3600.0),
        }
    }
}

/// The progress of a command.
pub(crate) struct TerminalProgress {
    work: Arc<Mutex<Work>>,
    shown: Shown,
    /// Set when the user interrupts the work.
    interrupt: Arc<AtomicBool>,
}

/// How it is shown.
enum Shown {
    Bar(ProgressBar),
    /// The user wants none.
    Nothing,
    /// Kept for its end.
    Lines {
        _lines: Lines,
    },
}

impl TerminalProgress {
    /// A bar if standard error is a terminal, otherwise lines; nothing if the user wants none.
    pub(crate) fn new() -> TerminalProgress {
        let work = Arc::new(Mutex::default());
        let shown = match (verbosity::is_quiet(), std::io::stderr().is_terminal()) {
            (true, _) => Shown::Nothing,
            (_, true) => Shown::Bar(bar()),
            _ => Shown::Lines { _lines: Lines::new(work.clone(), BETWEEN_LINES, std::io::stderr()) },
        };
        TerminalProgress { work, shown, interrupt: interrupt::flag() }
    }

    /// Removes the bar; another report is that of other work.
    pub(crate) fn finish(&self) {
        let mut work = lock(&self.work);
        self.say(work.end_stage(None));
        *work = Work::default();
        if let Shown::Bar(bar) = &self.shown {
            // Or the next report would show the last one for a moment.
            bar.set_prefix("");
            bar.set_message("");
            bar.finish_and_clear();
        }
    }

    /// Says how long a stage took, if the user wants to know.
    fn say(&self, took: Option<String>) {
        let Some(line) = took.filter(|_| verbosity::is_verbose()) else { return };
        match &self.shown {
            Shown::Bar(bar) => bar.suspend(|| eprintln!("{line}")),
            _ => eprintln!("{line}"),
        }
    }
}

fn bar() -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(1000), ProgressDrawTarget::stderr_with_hz(10));
    let style = ProgressStyle::with_template("{prefix:<33} {bar:24} {percent:>3} % {wide_msg}");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar.enable_steady_tick(BETWEEN_PICTURES);
    bar
}

impl Progress for TerminalProgress {
    fn report(&self, stage: &str, done: f64, detail: &str) {
        let mut work = lock(&self.work);
        self.say(work.end_stage(Some(stage)));
        work.report(stage, done, detail);
        let Shown::Bar(bar) = &self.shown else { return };
        if bar.is_finished() {
            bar.reset();
            bar.enable_steady_tick(BETWEEN_PICTURES);
        }
        let left = work.left().map(|left| left.to_string());
        let message: Vec<&str> = left.iter().map(String::as_str).chain([detail]).filter(|m| !m.is_empty()).collect();
        bar.set_prefix(stage.to_owned());
        bar.set_message(message.join(", "));
        bar.set_position((work.done * 1000.0) as u64);
    }

    fn cancelled(&self) -> bool {
        self.interrupt.load(Ordering::Relaxed)
    }
}

/// Writes the state of the work at intervals until it is dropped.
struct Lines {
    ended: Arc<(Mutex<bool>, Condvar)>,
    thread: Option<JoinHandle<()>>,
}

impl Lines {
    fn new(work: Arc<Mutex<Work>>, interval: Duration, mut to: impl Write + Send + 'static) -> Lines {
        let ended = Arc::new((Mutex::new(false), Condvar::new()));
        let until = ended.clone();
        let thread = std::thread::spawn(move || {
            let (ended, wake) = &*until;
            loop {
                let waited = wake.wait_timeout_while(lock(ended), interval, |ended| !*ended);
                if *waited.unwrap_or_else(PoisonError::into_inner).0 {
                    return;
                }
                let line = lock(&work).line();
                // Who closes standard error does not want to know.
                line.into_iter().for_each(|line| _ = writeln!(to, "{line}"));
            }
        });
        Lines { ended, thread: Some(thread) }
    }
}

impl Drop for Lines {
    fn drop(&mut self) {
        *lock(&self.ended.0) = true;
        self.ended.1.notify_all();
        _ = self.thread.take().map(JoinHandle::join);
    }
}

/// A lock's value, also where a thread panicked that held it: it is whole after every statement.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What was written, for several owners.
    #[derive(Clone, Default)]
    struct Written(Arc<Mutex<Vec<u8>>>);

    impl Write for Written {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            lock(&self.0).extend_from_slice(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    /// The lines that are written while work is reported very often, for so many intervals.
    fn lines(interval: Duration, intervals: f64) -> Vec<String> {
        let (work, written) = (Arc::new(Mutex::new(Work::default())), Written::default());
        let begun = Instant::now();
        let lines = Lines::new(work.clone(), interval, written.clone());
        while begun.elapsed() < interval.mul_f64(intervals) {
            lock(&work).report("fitting", 0.5, "sigma 1 mm");
            std::thread::sleep(Duration::from_millis(1));
        }
        drop(lines);
        let text = String::from_utf8(lock(&written.0).clone()).expect("text");
        assert!(text.lines().count() as f64 <= begun.elapsed().div_duration_f64(interval), "{text}");
        text.lines().map(str::to_owned).collect()
    }

    #[test]
    fn a_line_is_written_at_every_interval_and_none_of_short_work() {
        assert_eq!(lines(Duration::from_secs(5), 0.02), [""; 0]);
        let written = lines(Duration::from_millis(100), 3.5);
        assert!((1..=4).contains(&written.len()) && written[0] == "fitting, 50 % (sigma 1 mm)", "{written:?}");
    }

    #[test]
    fn the_time_left_is_told_when_it_is_known() {
        let begun = Instant::now().checked_sub(Duration::from_secs(100));
        let work = |done| Work { begun, stage: "fitting".to_owned(), done, ..Work::default() };
        assert_eq!(work(0.25).line().as_deref(), Some("fitting, 25 %, about 5 min left"));
        assert_eq!(work(0.8).line().as_deref(), Some("fitting, 80 %, about 30 s left"));
        assert_eq!(work(0.99).line().as_deref(), Some("fitting, 99 %, some seconds left"));
        assert_eq!(work(0.05).line().as_deref(), Some("fitting, 5 %"), "so little tells nothing");
        let just = Work { begun: Some(Instant::now()), ..work(0.5) };
        assert_eq!(just.line().as_deref(), Some("fitting, 50 %"));
        assert_eq!(Work::default().line(), None);
    }
}
