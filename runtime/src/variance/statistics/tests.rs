use crate::model::Texels;
use crate::scan::ScanSource;
use crate::variance::{Agreement, Deviations, Limits, LimitsBasis, Moments, Statistics, Tolerance, VarianceReport};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Deviations with the given signed distances (NaN: no data), areas and parts.
fn deviations(texels: &[(f64, f64, u32)], names: &[&str]) -> Deviations {
    let n = texels.len();
    let side = |sign: f64| texels.iter().map(move |t| if t.0 * sign >= 0.0 { (t.0 * sign) as f32 } else { f32::NAN });
    let texels = Texels {
        width: n as u32,
        height: 1,
        index: (0..n as u32).collect(),
        part: texels.iter().map(|t| t.2).collect(),
        position: vec![[0.0; 3]; n],
        normal: vec![[0.0, 0.0, 1.0]; n],
        area: texels.iter().map(|t| t.1 as f32).collect(),
        side: texels.iter().map(|t| t.1.sqrt() as f32).collect(),
        part_names: names.iter().map(|&s| s.to_owned()).collect(),
    };
    Deviations::new(texels, 4.0, side(1.0).collect(), side(-1.0).collect())
}

fn statistics(deviations: &Deviations) -> Statistics {
    VarianceReport::new(deviations, &ScanSource::default(), "cpu", &[]).overall
}

fn close(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "{a} is not {b}");
}

/// A sphere measured everywhere too large by 0.25: texels of different areas, all of one distance.
#[test]
fn a_constant_offset() {
    let texels: Vec<_> = (0..1000).map(|i| (0.25, (f64::from(i) * 0.003).sin(), 0)).collect();
    let s = statistics(&deviations(&texels, &["ball"]));
    close(s.coverage, 1.0, 1e-15);
    close(s.area, texels.iter().map(|t| t.1).sum(), 1e-4);
    for m in [&s.weighted, &s.per_texel] {
        for value in [m.mean, m.max, m.min, m.rms, m.median, m.percentiles.p1, m.percentiles.p99] {
            close(value, 0.25, 1e-15);
        }
        for value in [m.signed.mean, m.signed.min, m.signed.max, m.signed.median, m.signed.percentiles.p5] {
            close(value, 0.25, 1e-15);
        }
        for value in [m.sd, m.mad, m.signed.sd, m.signed.mad] {
            close(value, 0.0, 1e-9);
        }
    }
    let bin = 34; // 64 bins over [-4, 4]: [0.25, 0.375).
    assert_eq!(s.histogram.texels[bin], 1000);
    close(s.histogram.area[bin], s.area, 1e-9);
    assert_eq!(s.histogram.texels.iter().sum::<usize>(), 1000);
}

/// A tilted plane: signed distances uniform on [-a, a], whatever the texels' areas.
#[test]
fn a_tilted_plane() {
    let (n, a) = (20_000, 1.5);
    let place = |i: i32| (f64::from(i) + 0.5) / f64::from(n) * 2.0 - 1.0;
    let texels: Vec<_> = (0..n).map(|i| (a * place(i), 0.1, 0)).collect();
    let s = statistics(&deviations(&texels, &["plate"]));
    for m in [&s.weighted, &s.per_texel] {
        close(m.mean, a / 2.0, 1e-6);
        close(m.sd, a / 12f64.sqrt(), 1e-6);
        close(m.rms, a / 3f64.sqrt(), 1e-6);
        close(m.max, a, 1e-4);
        close(m.median, a / 2.0, 1e-6);
        close(m.mad, a / 4.0, 1e-6);
        close(m.percentiles.p25, a / 4.0, 1e-6);
        close(m.percentiles.p95, a * 0.95, 1e-6);
        close(m.signed.mean, 0.0, 1e-9);
        close(m.signed.sd, a / 3f64.sqrt(), 1e-6);
        close(m.signed.median, 0.0, 1e-6);
        close(m.signed.mad, a / 2.0, 1e-6);
        close(m.signed.percentiles.p1, -0.98 * a, 1e-6);
        close(m.signed.percentiles.p75, 0.5 * a, 1e-6);
        close(m.signed.min, -a, 1e-4);
    }
}

/// Two levels on unequal areas: weighted and unweighted answers differ.
#[test]
fn areas_weigh() {
    let texels = [(1.0, 3.0, 0), (-2.0, 1.0, 0)];
    let s = statistics(&deviations(&texels, &["a"]));
    close(s.weighted.mean, (3.0 + 2.0) / 4.0, 1e-12);
    close(s.per_texel.mean, 1.5, 1e-12);
    close(s.weighted.signed.mean, (3.0 - 2.0) / 4.0, 1e-12);
    close(s.per_texel.signed.mean, -0.5, 1e-12);
    close(s.weighted.rms, ((3.0 + 4.0) / 4.0f64).sqrt(), 1e-12);
}

#[test]
fn tolerances_include_their_ends_and_leave_out_what_was_not_measured() {
    let texels = [(0.1, 2.0, 0), (-0.2, 1.0, 0), (0.11, 4.0, 1), (-0.3, 8.0, 1), (f64::NAN, 16.0, 1), (0.0, 0.5, 2)];
    let d = deviations(&texels, &["a", "b", "c"]);
    let tolerance = Some(Tolerance { lower: -0.2, upper: 0.1 });
    let report = VarianceReport::new(&d, &ScanSource::default(), "cpu", &[tolerance; 3]);
    let [a, b, c] = [0, 1, 2].map(|p| report.parts[p].statistics.tolerance.expect("asked for"));
    assert!(a.within && !b.within && c.within);
    assert_eq!((b.texels_below, b.texels_within, b.texels_above), (1, 0, 1));
    let all = report.overall.tolerance.expect("asked for");
    assert_eq!((all.area_below, all.area_within, all.area_above), (8.0, 3.5, 4.0));
    close(all.share, 3.5 / 15.5, 1e-15);
    assert!(!all.within && all.tolerance == tolerance);
    // Each part by its own; one without does not count.
    let own = [tolerance, Some(Tolerance { lower: -1.0, upper: 1.0 }), None];
    let report = VarianceReport::new(&d, &ScanSource::default(), "cpu", &own);
    let all = report.overall.tolerance.expect("asked for");
    assert_eq!((all.tolerance, all.within, all.area_within, all.share), (None, true, 15.0, 1.0));
    assert!(report.parts[2].statistics.tolerance.is_none());
    assert!(VarianceReport::new(&d, &ScanSource::default(), "cpu", &[]).overall.tolerance.is_none());
}

/// A sheet at the end of its tolerance, some of whose distances single precision rounds to the other side; and one that
/// is beyond by more than that.
#[test]
fn rounding_does_not_exceed_a_tolerance() {
    let texels = [(0.1 - 3e-7, 1.0, 0), (0.1 + 3e-7, 1.0, 0), (0.1 - 3e-6, 1.0, 1), (0.3 + 3e-6, 1.0, 1)];
    let d = Deviations { precision: 1e-6, ..deviations(&texels, &["at the end", "beyond"]) };
    let tolerances = [(0.1, 0.3), (-0.3, 0.1)].map(|(lower, upper)| Tolerance { lower, upper });
    for tolerance in tolerances {
        let report = VarianceReport::new(&d, &ScanSource::default(), "cpu", &[Some(tolerance); 2]);
        assert_eq!([0, 1].map(|p| report.parts[p].statistics.tolerance.expect("asked for").within), [true, false]);
    }
    let exact = Deviations { precision: 0.0, ..d };
    let report = VarianceReport::new(&exact, &ScanSource::default(), "cpu", &[Some(tolerances[0]); 2]);
    assert!(!report.parts[0].statistics.tolerance.expect("asked for").within);
}

/// Against the definitions, written down plainly.
#[test]
fn random_values_agree_with_the_definitions() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let texels: Vec<_> = (0..3001)
        .map(|_| {
            let d: f64 = if rng.random_bool(0.1) { f64::NAN } else { rng.random_range(-4.0..4.0f64).powi(3) / 16.0 };
            // The values as single precision holds them.
            (f64::from(d as f32), f64::from(rng.random_range(0.0..2.0f32)), 0)
        })
        .collect();
    let s = statistics(&deviations(&texels, &["a"]));
    let measured: Vec<_> = texels.iter().filter(|t| !t.0.is_nan()).copied().collect();
    assert_eq!((s.texels, s.measured_texels), (3001, measured.len()));
    let total: f64 = texels.iter().map(|t| t.1).sum();
    let weight: f64 = measured.iter().map(|t| t.1).sum();
    close(s.coverage, weight / total, 1e-12);
    let mean = |f: &dyn Fn(f64) -> f64| measured.iter().map(|t| f(t.0) * t.1).sum::<f64>() / weight;
    let m = mean(&f64::abs);
    close(s.weighted.mean, m, 1e-12);
    close(s.weighted.sd, mean(&|x| (x.abs() - m).powi(2)).sqrt(), 1e-12);
    close(s.weighted.rms, mean(&|x| x * x).sqrt(), 1e-12);
    close(s.weighted.signed.mean, mean(&|x| x), 1e-12);
    // The share of the weight below each percentile, to one texel's weight.
    let below = |limit: f64, f: &dyn Fn(f64) -> f64| {
        measured.iter().filter(|t| f(t.0) < limit).map(|t| t.1).sum::<f64>() / weight
    };
    let (p, q) = (&s.weighted.percentiles, &s.weighted.signed.percentiles);
    for (share, unsigned, signed) in
        [(0.05, p.p5, q.p5), (0.25, p.p25, q.p25), (0.5, p.p50, q.p50), (0.99, p.p99, q.p99)]
    {
        close(below(unsigned, &f64::abs), share, 2.0 / weight);
        close(below(signed, &|x| x), share, 2.0 / weight);
    }
    close(below(s.weighted.signed.mad, &|x| (x - s.weighted.signed.median).abs()), 0.5, 2.0 / weight);
    // Order statistics of equal weights.
    let mut sorted: Vec<f64> = measured.iter().map(|t| t.0).collect();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    let median = if sorted.len() % 2 == 1 { sorted[middle] } else { (sorted[middle - 1] + sorted[middle]) / 2.0 };
    close(s.per_texel.signed.median, median, 1e-12);
    close(s.per_texel.signed.max, *sorted.last().unwrap(), 0.0);
}

#[test]
fn missing_data_is_never_zero() {
    let texels = [(f64::NAN, 1.0, 0), (0.5, 1.0, 1), (f64::NAN, 2.0, 1), (-0.5, 1.0, 2)];
    let mut d = deviations(&texels, &["gone", "hole[0]", "hole[1]"]);
    d.texels.area[3] = f32::NAN;
    let report = VarianceReport::new(&d, &ScanSource::default(), "cpu", &[]);
    let gone = &report.parts[0].statistics;
    assert_eq!((gone.texels, gone.measured_texels, gone.coverage), (1, 0, 0.0));
    assert!(gone.weighted.mean.is_nan() && gone.weighted.max.is_nan() && gone.per_texel.signed.median.is_nan());
    close(report.parts[1].statistics.coverage, 1.0 / 3.0, 1e-12);
    close(report.parts[1].statistics.weighted.mean, 0.5, 0.0);
    // Without area a texel counts per texel only.
    assert!(report.parts[2].statistics.weighted.mean.is_nan());
    close(report.parts[2].statistics.per_texel.mean, 0.5, 0.0);
    assert_eq!(report.groups.len(), 1);
    assert_eq!((report.groups[0].name.as_str(), report.groups[0].statistics.texels), ("hole", 3));
    close(report.overall.coverage, 0.25, 1e-12);
    assert_eq!(report.overall.measured_texels, 2);
}

#[test]
fn reports_survive_json() {
    let texels = [(f64::NAN, 1.0, 0), (0.5, 1.0, 1), (-1.0, 2.0, 1)];
    let report = VarianceReport::new(&deviations(&texels, &["gone", "body"]), &ScanSource::default(), "cpu", &[]);
    let json = serde_json::to_value(&report).unwrap();
    for field in ["mean", "max", "sd", "rms", "coverage", "median", "mad"] {
        assert!(json[field].is_number(), "{field} stands at the top");
    }
    assert!(json["signed"]["percentiles"]["p95"].is_number() && json["per_texel"]["mean"].is_number());
    assert!(json["parts"][0]["mean"].is_null() && json["parts"][0]["name"] == "gone");
    assert!(json["sign_convention"].as_str().unwrap().starts_with("positive: the scan lies outside"));
    let again: VarianceReport = serde_json::from_value(json.clone()).unwrap();
    assert!(again.parts[0].statistics.weighted.mean.is_nan());
    assert_eq!(serde_json::to_value(&again).unwrap(), json);
}

#[test]
fn statistics_do_not_depend_on_the_number_of_threads() {
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    let texels: Vec<_> = (0..100_000)
        .map(|i| (f64::from(rng.random_range(-20..20i32)) / 8.0, rng.random_range(0.1..1.0), i % 3))
        .collect();
    let d = deviations(&texels, &["a", "b", "c"]);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| VarianceReport::new(&d, &ScanSource::default(), "cpu", &[]))
    };
    assert!(run(1) == run(3));
    let m: &Moments = &run(2).overall.weighted;
    assert!(m.min == 0.0 && m.max == 2.5);
}

/// Every part by its own limits: those of its tolerance, or else three times the noise; together by none.
#[test]
fn surface_is_within_limits_over_or_under_them() {
    let texels = [
        (0.05, 1.0, 0),
        (0.5, 2.0, 0),
        (-0.5, 3.0, 0),
        (f64::NAN, 4.0, 0),
        (0.15, 5.0, 1),
        (-0.4, 1.0, 1),
        (0.35, 6.0, 2),
        (-0.1, 2.0, 2),
    ];
    let d = Deviations { noise: 0.1, ..deviations(&texels, &["lid", "hole[0]", "hole[1]"]) };
    let tolerance = Tolerance { lower: -0.1, upper: 0.6 };
    let report = VarianceReport::new(&d, &ScanSource::default(), "cpu", &[Some(tolerance), None, None]);
    let of = |s: &Statistics| s.agreement.expect("parts agree or not");
    let figures = |s: &Statistics| {
        let Agreement { within, over, under, .. } = of(s);
        [within, over, under].map(|p| (p.area, p.texels))
    };
    let [lid, first, second] = [0, 1, 2].map(|k| &report.parts[k].statistics);
    assert_eq!(of(lid).limits, Some(Limits { lower: -0.1, upper: 0.6, basis: LimitsBasis::Tolerance }));
    assert_eq!(figures(lid), [(3.0, 2), (0.0, 0), (3.0, 1)]);
    let by_noise = of(first).limits.expect("limits of its own");
    assert_eq!(by_noise.basis, LimitsBasis::Noise);
    close(by_noise.upper, 0.3, 1e-12);
    close(by_noise.lower, -0.3, 1e-12);
    assert_eq!(figures(first), [(5.0, 1), (0.0, 0), (1.0, 1)]);
    assert_eq!(figures(second), [(2.0, 1), (6.0, 1), (0.0, 0)]);
    assert_eq!(of(&report.groups[0].statistics).limits, Some(by_noise));
    assert_eq!(figures(&report.groups[0].statistics), [(7.0, 2), (6.0, 1), (1.0, 1)]);
    assert!(of(&report.overall).limits.is_none());
    assert_eq!(figures(&report.overall), [(10.0, 4), (6.0, 1), (4.0, 2)]);
    close(of(&report.overall).within.share, 0.5, 1e-12);
    let said = report.agreement_sentence(|x| format!("{x:.1}")).expect("a sentence");
    let expected = "50.0 % of the measured surface is within the tolerance of its part, or else 0.3 mm (3 times the \
                    scan's noise) of the scan, 30.0 % over (the scan lies outside: too much material), 20.0 % under \
                    (the scan lies inside: too little)";
    assert_eq!(said, expected);
}
