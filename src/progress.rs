//! Progress on a terminal's standard error; nothing elsewhere.

use gml_runtime::progress::Progress;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A line with the current stage.
#[derive(Debug)]
pub(crate) struct TerminalProgress {
    bar: ProgressBar,
    /// Set when the user interrupts the work.
    interrupt: Option<Arc<AtomicBool>>,
}

impl TerminalProgress {
    /// A line that is shown only if standard error is a terminal.
    pub(crate) fn new() -> TerminalProgress {
        // indicatif hides a bar whose target is not a terminal.
        let bar = ProgressBar::with_draw_target(Some(1000), ProgressDrawTarget::stderr_with_hz(10));
        let style = ProgressStyle::with_template("{prefix:<22} {bar:24} {wide_msg}")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        bar.set_style(style);
        TerminalProgress { bar, interrupt: None }
    }

    /// A line that also ends the work once the flag is set.
    pub(crate) fn until(interrupt: Arc<AtomicBool>) -> TerminalProgress {
        TerminalProgress { interrupt: Some(interrupt), ..TerminalProgress::new() }
    }

    /// Removes the line.
    pub(crate) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

impl Progress for TerminalProgress {
    fn report(&self, stage: &str, done: f64, detail: &str) {
        self.bar.set_prefix(stage.to_owned());
        self.bar.set_message(detail.to_owned());
        if done.is_finite() {
            self.bar.set_position((done.clamp(0.0, 1.0) * 1000.0) as u64);
        }
        self.bar.tick();
    }

    fn cancelled(&self) -> bool {
        self.interrupt.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}
