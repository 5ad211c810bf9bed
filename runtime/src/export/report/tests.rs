use super::{Figure, Report, Scripts, fill, write};
use crate::export::scale::Scale;
use crate::fit::{
    AllowedDeviation, FitResult, FittedInput, FittedMeasure, FittedParameter, PoseCovariance, Symmetry, WithoutSd,
};
use crate::mesh::{Group, TriangleMesh};
use crate::model::{Motion, Tessellation, Texels};
use crate::record::{Field, Record, Setting, UsedFile};
use crate::scan::ScanSource;
use crate::variance::{
    Deviations, Dimension, Outcome, OverallVerdict, Tolerance, VarianceReport, Verdict, VerdictOptions,
};
use gml_compiler::program::Quantity;
use std::collections::BTreeMap;

const HOSTILE: &str = "</script><img src=x onerror=alert(1)>'\"&{{mesh}}";

fn deviations() -> Deviations {
    let texels = Texels {
        width: 4,
        height: 2,
        index: (0..8).collect(),
        part: vec![0, 0, 0, 0, 1, 1, 1, 1],
        position: vec![[0.0; 3]; 8],
        normal: vec![[0.0, 0.0, 1.0]; 8],
        area: vec![1.0; 8],
        side: vec![1.0; 8],
        part_names: vec!["plate".to_owned(), HOSTILE.to_owned()],
    };
    let outward = vec![0.1, 0.1, 0.3, f32::NAN, 2.0, 0.1, f32::NAN, f32::NAN];
    let inward = vec![f32::NAN, f32::NAN, f32::NAN, 0.4, f32::NAN, f32::NAN, f32::NAN, 9.0];
    let contradicted = [vec![false; 6], vec![true, false]].concat();
    Deviations { contradicted, ..Deviations::new(texels, 10.0, outward, inward) }
}

fn tessellation() -> Tessellation {
    Tessellation {
        mesh: TriangleMesh {
            positions: vec![[0.0, 0.0, 5.0], [2.0, 0.0, 5.0], [2.0, 1.0, 5.0]],
            normals: vec![[0.0, 0.0, 1.0]; 3],
            texcoords: vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]],
            triangles: vec![[0, 1, 2], [0, 1, 77]],
            groups: vec![Group { name: HOSTILE.to_owned(), start: 0, end: 2 }],
        },
        ..Tessellation::default()
    }
}

fn scripts() -> Scripts {
    Scripts { texts: vec![("plate.gml".to_owned(), HOSTILE.to_owned())], declared: vec![HOSTILE.to_owned()] }
}

fn input(name: &str, value: f64, quantity: Quantity) -> FittedInput {
    FittedInput { name: name.to_owned(), value, unit: quantity.unit().to_owned(), quantity }
}

fn fit() -> FitResult {
    FitResult {
        model: HOSTILE.to_owned(),
        script: HOSTILE.to_owned(),
        inputs: vec![input("knobs", 5.0, Quantity::Int), input("tilt", 0.5, Quantity::Angle)],
        scan: ScanSource::default(),
        parameters: vec![
            FittedParameter {
                name: "alpha".to_owned(),
                value: std::f64::consts::FRAC_PI_4,
                unit: "rad".to_owned(),
                quantity: Quantity::Angle,
                fixed: false,
                at_bound: true,
                lower: None,
                upper: None,
                sd: Some(0.01),
                bias: Some(0.001),
                without_sd: Some(WithoutSd::AtBound),
            },
            FittedParameter {
                name: HOSTILE.to_owned(),
                value: 40.0,
                unit: "mm".to_owned(),
                quantity: Quantity::Length,
                fixed: true,
                at_bound: false,
                lower: None,
                upper: None,
                sd: None,
                bias: None,
                without_sd: Some(WithoutSd::Fixed),
            },
        ],
        equal: vec![vec!["alpha".to_owned(), HOSTILE.to_owned()]],
        pose_covariance: Some(PoseCovariance {
            centre: [1.0, -2.25, 3.0],
            parameters: vec!["alpha".to_owned()],
            matrix: (0..7)
                .map(|i| (0..7).map(|j| if i == j { [9.0, 0.04, 0.09][i.min(2)] } else { 0.0 }).collect())
                .collect(),
            symmetries: vec![Symmetry {
                text: "a turn about (0, 0, -1) changes nothing".to_owned(),
                ..Symmetry::default()
            }],
        }),
        pose: Some(Motion { rotation: Motion::IDENTITY.rotation, translation: [1.0, -2.0, 3.0] }),
        objective: 0.25,
        sigma: 0.5,
        noise: 0.1,
        inliers: 0.9,
        rms: 0.12,
        iterations: 30,
        evaluations: 60,
        converged: true,
        seconds: BTreeMap::from([("fit".to_owned(), 1.5)]),
        warnings: vec![HOSTILE.to_owned()],
        ..FitResult::default()
    }
}

fn record() -> Record {
    let text = |text: &str| text.to_owned();
    Record {
        tool: text("gmlc 0.1.0"),
        time: text("2024-05-06T07:08:09Z"),
        command: vec![text("gmlc"), text("inspect"), text("/home/roe/plate.gml"), HOSTILE.to_owned()],
        files: vec![UsedFile { role: text("script"), name: text("plate.gml"), sha256: text("abc") }],
        settings: vec![Setting { name: text("seed"), values: vec![text("7")], given: true }],
        fields: vec![Field { name: text("Part number"), value: HOSTILE.to_owned() }],
    }
}

fn page() -> String {
    page_of(&deviations(), 0)
}

fn page_of(deviations: &Deviations, spikes: usize) -> String {
    let scan = ScanSource { path: HOSTILE.to_owned(), ..ScanSource::default() };
    page_with(deviations, &VarianceReport { spikes, ..VarianceReport::new(deviations, &scan, "cpu", &[]) })
}

fn page_with(deviations: &Deviations, variance: &VarianceReport) -> String {
    write(&Report {
        title: HOSTILE,
        record: Some(&record()),
        scripts: &scripts(),
        scan: &tessellation().mesh,
        fit: Some(&fit()),
        variance,
        deviations,
        tessellation: &tessellation(),
        turned: Motion::IDENTITY.rotation,
        colour_png: None,
        uncertainty_png: None,
        conformance_png: variance.verdict.as_ref().map(|_| &b"map"[..]),
        scale: &Scale::new(variance, Some(0.5)),
        picture: Some(Figure { caption: "front", png: b"one" }),
        pictures: &[("two", &[Figure { caption: HOSTILE, png: b"three" }])],
    })
}

#[test]
fn nothing_is_loaded_from_elsewhere() {
    let page = page();
    assert!(!page.contains("http:") && !page.contains("https:") && !page.contains("url(") && !page.contains("@import"));
    for (at, attribute) in page.match_indices(" src=").chain(page.match_indices(" href=")) {
        let value = &page[at + attribute.len()..];
        // What users wrote appears with its markup escaped, so that its `src=` is text.
        let text = page[..at].ends_with("&lt;img") || page[..at].ends_with("\\u003cimg");
        assert!(text || value.starts_with("\"data:image/png;base64,"), "{}", &value[..40]);
    }
    assert!(page.contains("default-src 'none'"));
    assert!(!page.contains("fetch(") && !page.contains("XMLHttpRequest") && !page.contains("import("));
}

#[test]
fn hostile_names_stay_text() {
    let page = page();
    assert!(!page.contains("<img src=x"));
    assert_eq!(page.matches("<script").count(), page.matches("</script>").count());
    assert_eq!(page.matches("<script").count(), 10, "only our own");
    let escaped = "&lt;/script&gt;&lt;img src=x onerror=alert(1)&gt;&#39;&quot;&amp;{{mesh}}";
    // Title twice; facts, warning, parameter, part, picture.
    assert!(page.matches(escaped).count() >= 8, "{}", page.matches(escaped).count());
}

#[test]
fn figures_are_there() {
    let page = page();
    assert!(page.contains("<th scope=\"row\">alpha</th><td>45.0</td><td>0.6</td><td class=\"text\">&deg;</td>"));
    assert!(page.contains("at its bound") && page.contains("held fixed"));
    assert!(page.contains("positive: the scan lies outside the model"));
    assert!(page.contains("<p>Inputs: knobs=5, tilt=28.647889757deg</p>"));
    assert!(page.contains("&minus;2.00000"), "the pose");
    assert!(
        page.contains("<th scope=\"row\">x</th><td>0.200 mm</td><td>17.189&deg;</td>"),
        "the roots of 0.04 mm2 and of 0.09"
    );
    assert!(
        page.contains("<th scope=\"row\">z</th><td>0.300 mm</td><td>17.189&deg;</td>")
            && page.contains("(1.0, &minus;2.2, 3.0) mm")
    );
    assert!(page.contains("<p>Held, a symmetry: a turn about (0, 0, &minus;1) changes nothing.</p>"));
    assert!(page.contains("<p>Held equal: alpha, &lt;/script&gt;"));
    assert!(page.contains("<b>87.5 %</b><span>of the surface measured"));
    let empty = "Without data, and where the scan shows empty space: 1.000 mm&sup2; (1.000 of &lt;/script&gt;";
    assert!(page.contains(empty), "{}", page.split("where the scan shows").nth(1).map_or("no", |t| &t[..80]));
    // Seven texels have data; -9 is below the scale's end, 2 above.
    assert!(page.contains("14.29 % below &minus;0.5, 14.29 % above 0.5"));
    assert!(page.contains("\"triangles\":1,"), "the triangle with a missing vertex is left out");
    assert!(page.contains("\"halfSize\":[1.0,0.5,0.0]"));
    assert!(page.contains("data:image/png;base64,dGhyZWU="));
    // The script knows the word.
    let (content, _) = page.split_once("<script>\n").expect("a script");
    assert!(!content.contains("NaN") && !page.contains("//!"));
}

/// One sentence with its threshold; the fit's inliers name their own.
#[test]
fn what_agrees_is_said_once_with_its_limits() {
    let page = page_of(&Deviations { noise: 0.05, ..deviations() }, 0);
    let sentence = "<p>42.9 % of the measured surface is within 0.15 mm (3 times the scan's noise) of the scan, 28.6 % over \
                    (the scan lies outside: too much material), 28.6 % under (the scan lies inside: too little).</p>";
    assert_eq!(page.matches(sentence).count(), 1, "{page}");
    let row = "<th scope=\"row\">plate</th><td>&minus;0.15</td><td>0.15</td><td class=\"text\">3 &times; noise</td>\
               <td>2.000</td><td>50.0 %</td><td>1.000</td><td>25.0 %</td><td>1.000</td><td>25.0 %</td></tr>";
    assert!(page.contains(row), "{page}");
    assert!(page.contains("<b>42.9 %</b><span>of it within 0.150 mm (3 times the scan's noise)</span>"), "{page}");
    assert!(!page.contains("fits the model") && !page.contains("All of the scan"));
    // 0.5 sqrt(ln 2), where the loss is 1/2.
    assert!(page.contains("<th scope=\"row\">Inliers, points within</th><td>0.416 mm</td>"), "{page}");
    let widths = "<th scope=\"row\">plate</th><td>4</td><td>1.000</td><td>1.000</td><td>1.000</td><td>1.000</td><td>1.000</td></tr>";
    assert!(page.contains(widths), "{page}");
}

#[test]
fn what_is_refused_is_said() {
    let refused = "another place of the model or to a spike of the scan: 1.000 mm&sup2; (1.000 of &lt;/script&gt;";
    let spikes = "to which no distance is taken: 17.</p>";
    let ambiguous = [vec![false; 6], vec![true, false]].concat();
    let page = page_of(&Deviations { contradicted: Vec::new(), ambiguous, ..deviations() }, 17);
    assert!(page.contains(refused) && page.contains(spikes), "{page}");
    let page = page_of(&deviations(), 0);
    assert!(!page.contains("a spike of the scan") && !page.contains("no distance is taken"));
}

#[test]
fn verdicts_are_said_with_their_reasons() {
    let tolerance = Tolerance { lower: -0.25, upper: 0.5 };
    let mut variance = VarianceReport::new(&deviations(), &ScanSource::default(), "cpu", &[None, Some(tolerance)]);
    variance.verdict = Some(OverallVerdict {
        outcome: Outcome::Undecided,
        decision: "p=0.99".to_owned(),
        min_coverage: 0.8,
        device_uncertainty: 0.0,
    });
    variance.parts[1].verdict = Some(Verdict {
        outcome: Outcome::Undecided,
        value: 0.48,
        again: 0.45,
        limit: 0.5,
        uncertainty: 0.02,
        noise: 0.02,
        fit: 0.0,
        device: 0.0,
        probability: 0.841,
        highest_probability: 0.994,
        footprint: 4.0,
        points: 25.0,
        footprints: 100,
        place: [0.0; 3],
        reasons: vec![HOSTILE.to_owned()],
    });
    let page = page_with(&deviations(), &variance);
    assert!(page.contains("Decision rule: p=0.99; a part conforms only if 80 % of it were measured."), "{page}");
    assert!(page.contains("All together: <b>undecided</b>") && page.contains("base64,bWFw\"><figcaption>Probability"));
    let row = "<td>&minus;0.25</td><td>0.5</td><td>0.480</td><td>0.450</td><td>0.0200</td><td>0.841 to 0.994</td>";
    assert!(page.contains(row) && page.contains("<span class=\"mark\">undecided: &lt;/script&gt;"), "{page}");
    assert!(!page.contains("<img src=x"));
    let without = page_of(&deviations(), 0);
    assert!(!without.contains("Decision rule") && !without.contains("Probability that"));
}

#[test]
fn measures_are_said_with_their_verdicts() {
    let measures = vec![
        FittedMeasure {
            name: HOSTILE.to_owned(),
            value: Some(0.5),
            unit: "rad".to_owned(),
            sd: Some(0.01),
            nominal: Some(0.4),
            tolerance: Some(AllowedDeviation { lower: -0.05, upper: 0.05 }),
            ..FittedMeasure::default()
        },
        FittedMeasure {
            name: "open".to_owned(),
            value: Some(3.0),
            unit: "mm^2".to_owned(),
            without_sd: Some("r: at its bound".to_owned()),
            ..FittedMeasure::default()
        },
    ];
    let mut variance = VarianceReport::new(&deviations(), &ScanSource::default(), "cpu", &[]);
    let tolerance = Tolerance { lower: -0.05, upper: 0.05 };
    let (name, unit) = (HOSTILE.to_owned(), "rad".to_owned());
    let dimension = Dimension { name, unit, value: 0.5, sd: Ok(0.01), nominal: 0.4, tolerance };
    variance.judge(&[dimension], VerdictOptions::default());
    let mut page = String::new();
    super::measures::measures(&measures, &variance, &mut page);
    assert!(page.contains("<td>28.6</td><td>0.6</td><td>&deg;</td><td>22.91831</td><td>5.730</td>"), "{page}");
    assert!(page.contains("<td>&minus;2.8648</td><td>2.8648</td>"), "{page}");
    assert!(page.contains("<span class=\"mark\">does not conform</span>") && !page.contains("<img src=x"), "{page}");
    assert!(page.contains("<th scope=\"row\">open</th><td>3.00000</td><td></td><td>mm^2</td>"), "{page}");
    assert!(page.contains("<span class=\"mark\">r: at its bound</span>"), "{page}");
    assert!(page.contains("together: <b>does not conform</b>"), "{page}");
    let mut nothing = String::new();
    super::measures::measures(&[], &variance, &mut nothing);
    assert!(nothing.is_empty());
}

#[test]
fn insertions_are_not_searched_again() {
    let texts = [("a", "{{b}} }} {{".to_owned()), ("b", "never".to_owned())];
    assert_eq!(fill("x {{a}} y {{unknown}}z", texts.iter()), "x {{b}} }} {{ y z");
}
