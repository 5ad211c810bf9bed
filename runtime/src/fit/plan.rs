//! The stages of a fit, for those who watch it.

use super::options::FitOptions;

/// A stage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stage {
    /// Its name in the result's times.
    pub(crate) name: &'static str,
    /// Its name for people.
    pub(crate) words: &'static str,
    /// Its time, where preparation, search, fit, end and standard deviations together take 1.
    pub(crate) share: f64,
}

/// Share of a bootstrap sample: 50 took 0.6 to 0.9 of the time of the fits of the can, the mug and the flange.
const SAMPLE: f64 = 0.015;

const fn stage(name: &'static str, words: &'static str, share: f64) -> Stage {
    Stage { name, words, share }
}

/// The stages up to a solution. The shares are means of eight of the examples; the search took 0.70 to 0.89.
pub(crate) fn to_solution(options: &FitOptions) -> Vec<Stage> {
    let mut stages = vec![
        stage("prepare", "preparing", 0.01),
        stage("screen", "finding the pose", 0.77),
        stage("fit", "fitting", 0.19),
        // Mostly it is not needed.
        stage("second search", "searching once more", 0.02),
        stage("finish", "finishing", 0.01),
    ];
    if options.coverage {
        stages.push(stage("coverage", "coverage", 0.1));
    }
    stages
}

/// The one stage of a quick fit.
pub(crate) fn quick() -> Vec<Stage> {
    vec![stage("quick", "a quick fit", 1.0)]
}

/// The stages of a fit of several scans.
pub(crate) fn several() -> Vec<Stage> {
    vec![
        stage("prepare", "preparing", 0.01),
        stage("first scan", "fitting the first scan", 0.4),
        stage("placing", "placing the other scans", 0.3),
        stage("all scans", "fitting all scans", 0.25),
        stage("uncertainty", "standard deviations", 0.04),
        stage("agreement", "comparing the scans", 0.1),
    ]
}

/// All stages of a fit.
pub(crate) fn whole(options: &FitOptions) -> Vec<Stage> {
    let mut stages = to_solution(options);
    // The fit is repeated without the values under test.
    if options.fixed.iter().any(|name| options.start.contains_key(name)) {
        stages.push(stage("test", "testing held values", 1.0));
    }
    stages.push(stage("uncertainty", "standard deviations", 0.02));
    stages.push(stage("other shapes", "looking for other shapes", 0.1));
    if options.bootstrap > 0 {
        stages.push(stage("bootstrap", "bootstrap", SAMPLE * options.bootstrap as f64));
    }
    stages
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::monitor::Monitor;
    use crate::progress::Progress;
    use std::sync::Mutex;

    /// Keeps what is reported.
    #[derive(Default)]
    struct Kept(Mutex<Vec<(String, f64)>>);

    impl Progress for Kept {
        fn report(&self, stage: &str, done: f64, _detail: &str) {
            self.0.lock().unwrap().push((stage.to_owned(), done));
        }
    }

    #[test]
    fn stages_fill_the_whole_in_their_order() {
        let kept = Kept::default();
        let options = FitOptions { coverage: true, bootstrap: 20, ..FitOptions::default() };
        let stages = whole(&options);
        let monitor = Monitor::of_stages(&kept, stages.clone());
        for stage in &stages {
            // A report from farther back does not move the bar back.
            monitor.stage(stage.name, || [0.5, 0.2, 1.0].iter().for_each(|done| monitor.reach(*done, "")));
        }
        let reports = kept.0.into_inner().unwrap();
        assert_eq!(reports[0], ("stage 1 of 9: preparing".to_owned(), 0.0));
        assert!(reports.windows(2).all(|pair| pair[0].1 <= pair[1].1), "{reports:?}");
        let last = reports.last().unwrap();
        assert!(last.0 == "stage 9 of 9: bootstrap" && (last.1 - 1.0).abs() < 1e-12, "{last:?}");
        // The bootstrap takes 0.3 of 1.52.
        let (_, begin) = reports.iter().find(|r| r.0 == last.0).unwrap();
        assert!((begin - 1.22 / 1.52).abs() < 1e-12, "{begin}");
    }
}
