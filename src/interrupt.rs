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
    ctrlc::set_handler(|| {
        let is_second = FLAG.swap(true, Ordering::SeqCst);
        if is_second || GRACES.load(Ordering::SeqCst) == 0 {
            end();
        }
    })
    .map_err(CommandError::failed)
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
