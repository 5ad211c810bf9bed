//! Jobs that may run at once.

use std::sync::Mutex;

/// Runs jobs that do not depend on each other: the compiler itself starts no threads. Results are the same whichever
/// thread runs a job.
///
/// `run` calls a job for each number below the first argument, once each, at once where it can, and returns when all
/// are done. It must be more than a pool whose threads take up other work while they wait: derivatives are made when
/// they are first asked for, by one thread while others wait for it.
#[derive(Clone, Copy, Debug)]
pub struct Workers {
    /// Number of jobs that can run at once; at least one.
    pub count: usize,
    /// Runs jobs.
    pub run: fn(usize, &(dyn Fn(usize) + Sync)),
}

impl Workers {
    /// One job after the other.
    pub const ONE: Workers = Workers { count: 1, run: |jobs, job| (0..jobs).for_each(job) };

    /// The results of `work`, in the order of the jobs.
    pub(crate) fn map<J: Sync, T: Send>(self, jobs: &[J], work: impl Fn(&J) -> T + Sync) -> Vec<T> {
        let made: Vec<Mutex<Option<T>>> = jobs.iter().map(|_| Mutex::new(None)).collect();
        (self.run)(jobs.len(), &|i| {
            let result = work(&jobs[i]);
            if let Ok(mut place) = made[i].lock() {
                *place = Some(result);
            }
        });
        let made = made.into_iter().map(|place| place.into_inner().ok().flatten());
        made.zip(jobs).map(|(result, job)| result.unwrap_or_else(|| work(job))).collect()
    }
}

impl Default for Workers {
    fn default() -> Workers {
        Workers::ONE
    }
}

#[cfg(test)]
mod tests {
    use super::Workers;

    impl Workers {
        /// Each job by a thread of its own, the last first.
        pub(crate) fn many(count: usize) -> Workers {
            let run = |jobs: usize, job: &(dyn Fn(usize) + Sync)| {
                std::thread::scope(|scope| (0..jobs).rev().for_each(|i| _ = scope.spawn(move || job(i))));
            };
            Workers { count, run }
        }
    }

    #[test]
    fn results_are_in_the_order_of_the_jobs() {
        let backwards = Workers { count: 3, run: |jobs, job| (0..jobs).rev().for_each(job) };
        let jobs: Vec<usize> = (0..100).collect();
        for workers in [Workers::ONE, backwards] {
            assert_eq!(workers.map(&jobs, |j| j * j), jobs.iter().map(|j| j * j).collect::<Vec<_>>());
        }
    }
}
