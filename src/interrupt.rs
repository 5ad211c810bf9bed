//! What a signal does: Ctrl-C, SIGTERM and SIGHUP end every command.
//!
//! Most commands have nothing to keep of work that is half done: what they have begun to write is taken away, and the
//! process ends at once, wherever it is. Work that has something to keep ends by itself while a [`Grace`] lives: it
//! asks [`flag`] from time to time. A second signal ends the process in any case.

use crate::error::CommandError;
use gml_runtime::export::begun;
use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock};

/// Set by a signal.
static FLAG: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);

/// How much of the work that runs has something to keep.
static GRACES: AtomicUsize = AtomicUsize::new(0);

/// Handles signals from now on.
pub(crate) fn handle() -> Result<(), CommandError> {
    listen(|| {
        let is_second = FLAG.swap(true, Ordering::SeqCst);
        if is_second || GRACES.load(Ordering::SeqCst) == 0 {
            end();
        }
    })
}

/// Calls a function at every signal that ends processes, but for those that this one was told to ignore: under `nohup`,
/// SIGHUP.
#[cfg(unix)]
fn listen(act: impl Fn() + Send + 'static) -> Result<(), CommandError> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let ignored = ignored();
    let heard = [SIGHUP, SIGINT, SIGTERM].into_iter().filter(|signal| ignored >> (signal - 1) & 1 == 0);
    let mut signals = signal_hook::iterator::Signals::new(heard).map_err(CommandError::failed)?;
    let thread = std::thread::Builder::new().name("signals".to_owned());
    thread.spawn(move || signals.forever().for_each(|_| act())).map(drop).map_err(CommandError::failed)
}

/// The signals that the process ignores since it began, a bit each; none where the system does not tell.
#[cfg(unix)]
fn ignored() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}

#[cfg(not(unix))]
fn listen(act: impl Fn() + Send + 'static) -> Result<(), CommandError> {
    ctrlc::set_handler(act).map_err(CommandError::failed)
}

/// True once the user wants the work to end.
pub(crate) fn flag() -> Arc<AtomicBool> {
    FLAG.clone()
}

/// While it lives, the first signal leaves it to the work to end.
pub(crate) struct Grace(());

/// Work begins that has something to keep.
pub(crate) fn grace() -> Grace {
    GRACES.fetch_add(1, Ordering::SeqCst);
    Grace(())
}

impl Drop for Grace {
    fn drop(&mut self) {
        GRACES.fetch_sub(1, Ordering::SeqCst);
    }
}

fn end() -> ! {
    let kept = begun::abandon();
    if std::io::stderr().is_terminal() {
        // Over the bar of the progress, which nobody takes away any more.
        crate::print::styled("\r\x1b[K");
    }
    kept.iter().for_each(|path| eprintln!("the fit is in {}", path.display()));
    let error = CommandError::interrupted();
    error.print();
    std::process::exit(error.status().into())
}
