//! The report's table of how parts lie to the datum.

use super::tables::{number, table};
use crate::export::escape::escape;
use crate::variance::{DatumRelations, Relation, WithoutNoise};
use std::fmt::Write;

/// The characteristics of the other parts with respect to the datum.
pub(super) fn relations(datum: &DatumRelations, out: &mut String) {
    let _ = writeln!(
        out,
        "<h3>Datum {}</h3>\n<p class=\"convention\">Coaxiality and concentricity (twice the largest distance from the datum's axis or \
         centre), parallelism and perpendicularity (ISO 1101) of the surfaces of least squares of the points of the scan that belong to the \
         parts, whatever the fit. Beside each width stands what noise alone would give, and the width without what it adds, with its standard \
         uncertainty by the scatter of the points.</p>",
        escape(&datum.part)
    );
    if !datum.unmeasured.is_empty() {
        let parts: Vec<String> = datum.unmeasured.iter().map(|name| escape(name)).collect();
        let _ = writeln!(out, "<p>Too little was measured of {}.</p>", parts.join(", "));
    }
    let row = |r: &Relation| {
        let WithoutNoise { noise_alone, corrected, uncertainty } = r.without_noise;
        let [model, value, alone, corrected, uncertainty] =
            [r.model, r.value, noise_alone, corrected, uncertainty].map(number);
        let [x, y, z] = r.place.map(number);
        format!(
            "<tr><td>{}</td><td class=\"text\">{}</td><td>{model}</td><td>{value}</td><td>{alone}</td>\
             <td>{corrected} ± {uncertainty}</td><td>{x}</td><td>{y}</td><td>{z}</td></tr>\n",
            escape(&r.part),
            escape(&r.characteristic)
        )
    };
    let head = "<thead><tr><th>Part</th><th>Characteristic</th><th>Model, mm</th><th>By points, mm</th><th>Noise alone, mm</th>\
        <th>Without noise, mm</th><th colspan=\"3\">At, mm</th></tr></thead>\n";
    table("How the other parts lie to the datum", head, datum.relations.iter().map(row), out);
}
