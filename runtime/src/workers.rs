//! Threads for the compiler's work.

use gml_compiler::Workers;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// Threads at most: the compiler's other stages take longer than what more would gain.
const MOST: usize = 8;

/// As many as there are processors. Threads of their own, as [`Workers`] must not wait for a pool.
#[must_use]
pub fn workers() -> Workers {
    Workers { count: *COUNT, run }
}

/// The most threads that a variable of the environment may ask for: each takes memory, and no machine gains by more.
const MOST_THREADS: usize = 256;

/// Keeps the threads of the numeric stages to a bearable number. A sentence where the environment
/// (`RAYON_NUM_THREADS`) asks for more. To be called before any of them begins.
#[must_use]
pub fn limit_threads() -> Option<String> {
    let asked: usize = std::env::var("RAYON_NUM_THREADS").ok()?.parse().ok()?;
    if asked <= MOST_THREADS {
        return None;
    }
    let built = rayon::ThreadPoolBuilder::new().num_threads(MOST_THREADS).build_global();
    let taken = if built.is_ok() { MOST_THREADS } else { rayon::current_num_threads() };
    Some(format!("RAYON_NUM_THREADS={asked}: {taken} threads are taken, {MOST_THREADS} being the most"))
}

/// Asked once: the system reads files to answer.
static COUNT: LazyLock<usize> = LazyLock::new(|| thread::available_parallelism().map_or(1, |n| n.get().min(MOST)));

/// Does jobs on this thread and as many others as are of use. Where the system gives no more, those that there are do
/// it all.
fn run(jobs: usize, job: &(dyn Fn(usize) + Sync)) {
    let next = AtomicUsize::new(0);
    let work = || {
        loop {
            let i = next.fetch_add(1, Ordering::Relaxed);
            if i >= jobs {
                return;
            }
            job(i);
        }
    };
    thread::scope(|scope| {
        for _ in 1..(*COUNT).min(jobs) {
            if thread::Builder::new().spawn_scoped(scope, work).is_err() {
                break;
            }
        }
        work();
    });
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    #[test]
    fn each_job_is_done_once() {
        for jobs in [0, 1, 2, 1000] {
            let done = Mutex::new(vec![0; jobs]);
            (super::workers().run)(jobs, &|i| done.lock().unwrap()[i] += 1);
            assert_eq!(done.into_inner().unwrap(), vec![1; jobs]);
        }
    }
}
