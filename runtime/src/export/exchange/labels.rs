//! The table of the places with the largest deviations.

use super::csv::{Cell, Table};
use crate::variance::Peak;

/// The head, in the order of a row's cells.
const HEAD: [&str; 10] = ["label", "part", "u", "v", "x_mm", "y_mm", "z_mm", "deviation_mm", "detection_mm", "texel"];

/// A row for every place, largest first.
pub(super) fn table(peaks: &[Peak]) -> String {
    let mut table = Table::new(HEAD.into_iter());
    for (i, Peak { part, uv, texel: [column, row], place: [x, y, z], distance, level }) in peaks.iter().enumerate() {
        let texel = format!("{column} {row}");
        let cells = [
            Cell::Count(i + 1),
            Cell::Text(part),
            Cell::number(uv.map(|[u, _]| u)),
            Cell::number(uv.map(|[_, v]| v)),
            Cell::Number(*x),
            Cell::Number(*y),
            Cell::Number(*z),
            Cell::Number(*distance),
            Cell::number(*level),
            Cell::Text(&texel),
        ];
        table.row(cells.into_iter());
    }
    table.into_text()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_a_row() {
        let peak = Peak {
            part: "=lid".to_owned(),
            uv: None,
            texel: [3, 4],
            place: [1.0, 2.0, -3.5],
            distance: -0.25,
            level: Some(0.5),
        };
        let expected =
            "label,part,u,v,x_mm,y_mm,z_mm,deviation_mm,detection_mm,texel\r\n1,'=lid,,,1,2,-3.5,-0.25,0.5,3 4\r\n";
        assert_eq!(table(&[peak]), expected);
    }
}
