//! What follows from a fit beyond its values: correlations, tests, resampled scans, other inputs and shapes, and what
//! of scan and model it does not explain.

use super::rounding::{pair, unit_of};
use super::tables::{minus, number, row_of, short, table};
use crate::export::escape::escape;
use crate::fit::{Bootstrap, Covariance, FitResult, HypothesisTest, Search};
use std::fmt::Write;

pub(super) fn inference(fit: &FitResult, out: &mut String) {
    if !fit.tests.is_empty() {
        tests(fit, &fit.tests, out);
    }
    if let Some(bootstrap) = &fit.bootstrap {
        resampled(fit, bootstrap, out);
    }
    if let Some(covariance) = fit.covariance.as_ref().filter(|c| c.parameters.len() > 1) {
        correlations(covariance, out);
    }
    if let Some(search) = &fit.search {
        candidates(search, out);
    }
    misfits(fit, out);
}

/// A figure of a parameter in the unit in which it is shown.
fn of(fit: &FitResult, name: &str) -> (f64, &'static str) {
    fit.parameters.iter().find(|p| p.name == name).map_or((1.0, ""), unit_of)
}

fn tests(fit: &FitResult, tests: &[HypothesisTest], out: &mut String) {
    let head = "<thead><tr><th>Held</th><th>At</th><th>Released</th><th>SD</th><th>Chi-squared</th><th>Degrees</th><th>p</th>\
        <th>Verdict</th></tr></thead>\n";
    let row = |test: &HypothesisTest| {
        let shown = |values: &[f64]| {
            let each = test.parameters.iter().zip(values).map(|(name, value)| {
                let (factor, unit) = of(fit, name);
                format!("{} {unit}", number(factor * value))
            });
            each.collect::<Vec<_>>().join(", ")
        };
        let verdict = if test.p < 0.05 { "the scan contradicts it" } else { "the scan does not contradict it" };
        row_of(&[
            escape(&test.parameters.join(", ")),
            shown(&test.held),
            shown(&test.free),
            shown(&test.sd),
            number(test.statistic),
            test.degrees.to_string(),
            number(test.p),
            verdict.to_owned(),
        ])
    };
    out.push_str("<h3>Tests of held values</h3>\n");
    table(
        "Wald's test: p is the probability of such a difference, or a larger one, if the held values are true",
        head,
        tests.iter().map(row),
        out,
    );
}

fn resampled(fit: &FitResult, bootstrap: &Bootstrap, out: &mut String) {
    let drawn = bootstrap.block.map_or("single points".to_owned(), |edge| format!("blocks of {} mm", number(edge)));
    let caption = format!("{} scans resampled in {drawn}: the spread of their fits", bootstrap.samples);
    let head = "<thead><tr><th>Parameter</th><th>SD</th><th>2.5 %</th><th>97.5 %</th><th>Unit</th></tr></thead>\n";
    let row = |r: &crate::fit::Resampled| {
        let (factor, unit) = of(fit, &r.name);
        let [low, sd] = pair(factor * r.low, Some(factor * r.sd));
        let [high, _] = pair(factor * r.high, Some(factor * r.sd));
        row_of(&[escape(&r.name), sd, low, high, unit.to_owned()])
    };
    out.push_str("<h3>Bootstrap</h3>\n");
    table(&caption, head, bootstrap.parameters.iter().map(row), out);
}

fn correlations(covariance: &Covariance, out: &mut String) {
    let names: String = covariance.parameters.iter().map(|name| format!("<th>{}</th>", escape(name))).collect();
    let head = format!("<thead><tr><th>Parameter</th>{names}</tr></thead>\n");
    let row = |(name, row): (&String, &Vec<f64>)| {
        let cell = |c: &f64| {
            let strong = if c.abs() >= 0.9 && c.abs() < 0.999_999 { " class=\"mark\"" } else { "" };
            format!("<td{strong}>{}</td>", minus(&format!("{c:.2}")))
        };
        format!("<tr><td>{}</td>{}</tr>\n", escape(name), row.iter().map(cell).collect::<String>())
    };
    let caption = format!(
        "Correlations of the estimates, by {} independent points of equal weight; those of 0.9 and more are marked",
        short(covariance.effective_points.round())
    );
    out.push_str("<h3>Correlations</h3>\n");
    table(&caption, &head, covariance.parameters.iter().zip(&covariance.correlations).map(row), out);
}

fn candidates(search: &Search, out: &mut String) {
    let head = "<thead><tr><th>Inputs</th><th>BIC</th><th>Objective</th><th>Remark</th></tr></thead>\n";
    let row = |c: &crate::fit::SearchCandidate| {
        let inputs: Vec<String> = c.inputs.iter().map(|(name, value)| format!("{}={value}", escape(name))).collect();
        let remark = match &c.failed {
            Some(reason) => escape(reason),
            None if c.quick => "given up after a quick fit".to_owned(),
            None => String::new(),
        };
        let shown = |figure: Option<f64>| figure.map_or("&ndash;".to_owned(), number);
        row_of(&[inputs.join(", "), shown(c.bic), shown(c.objective), remark])
    };
    out.push_str("<h3>Search</h3>\n");
    table("Candidates, best first", head, search.candidates.iter().map(row), out);
}

/// What of the scan and of the model does not belong together.
fn misfits(fit: &FitResult, out: &mut String) {
    let at = |place: [f64; 3]| format!("({}) mm", place.map(|c| minus(&format!("{c:.1}"))).join(", "));
    let mut items: Vec<String> = fit
        .unexplained
        .iter()
        .map(|piece| {
            let area = piece.area.map_or_else(String::new, |area| format!(", {} mm&sup2;", number(area)));
            let beside = escape(&piece.beside.join(", "));
            format!(
                "{:.1} % of the scan{area}, at {}, beside {beside}: not explained",
                100.0 * piece.share,
                at(piece.place)
            )
        })
        .collect();
    items.extend(fit.contradicted.iter().flatten().map(|c| {
        let (part, area) = (escape(&c.part), number(c.area));
        format!("{area} mm&sup2; of {part} ({:.1} %), at {}: the scan shows empty space", 100.0 * c.share, at(c.place))
    }));
    items.extend(fit.passed_through.iter().map(|p| {
        let (part, through, area) = (escape(&p.part), escape(&p.through.join(", ")), number(p.area));
        format!("{area} mm&sup2; of {part}, at {}: passed through {through} by {} mm", at(p.place), number(p.depth))
    }));
    items.extend(fit.alternatives.iter().map(|other| {
        let values = other.values.iter().map(|(name, value)| {
            let (factor, unit) = of(fit, name);
            format!("{} = {} {unit}", escape(name), number(factor * value))
        });
        let values: Vec<String> = values.collect();
        format!("Another shape of {} explains the scan as well: {}", escape(&other.parts.join(", ")), values.join(", "))
    }));
    if !items.is_empty() {
        let items: String = items.iter().map(|item| format!("<li>{item}</li>\n")).collect();
        let _ = writeln!(out, "<h3>Not explained</h3>\n<ul>\n{items}</ul>");
    }
}
