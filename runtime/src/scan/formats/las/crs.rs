//! The unit of a LAS file's coordinates, from its coordinate system: keys of GeoTIFF, or well-known text (OGC 01-009,
//! ISO 19162).

use super::header::Header;
use crate::scan::unit::METRE;

/// The user of the records of coordinate systems.
const USER: &str = "LASF_Projection";
/// Feet: the international one, and that of the American survey, 1200/3937 m.
const FOOT: f64 = 304.8;
const SURVEY_FOOT: f64 = 1_200_000.0 / 3937.0;

/// What a coordinate system says.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum System {
    /// Lengths, of so many millimetres: of x and y, and of z where that is stated.
    Lengths { plane: f64, height: Option<f64> },
    /// Longitudes and latitudes.
    Angles,
    /// It says nothing of its unit; what it says.
    Unknown(String),
}

/// The coordinate system of a file; none where it has none.
pub(super) fn system(header: &Header) -> Option<System> {
    let text = || header.record(USER, 2112).map(|bytes| from_text(&String::from_utf8_lossy(bytes)));
    let keys = || {
        let doubles = header.record(USER, 34736).unwrap_or_default();
        header.record(USER, 34735).map(|keys| from_keys(keys, doubles))
    };
    let known = |system: &System| !matches!(system, System::Unknown(_));
    // Files have both at times; the header says which of them holds.
    let both = if header.says_text { [text(), keys()] } else { [keys(), text()] };
    let [first, second] = both;
    first.clone().filter(known).or(second.filter(known)).or(first)
}

/// The system of GeoTIFF keys (OGC 19-008): key, record of its value, count, and value or index.
fn from_keys(keys: &[u8], doubles: &[u8]) -> System {
    const MODEL: u16 = 1024;
    const PROJECTED: u16 = 3072;
    const UNIT: u16 = 3076;
    const UNIT_SIZE: u16 = 3077;
    const HEIGHT_UNIT: u16 = 4099;
    let words: Vec<u16> = keys.as_chunks().0.iter().map(|w| u16::from_le_bytes(*w)).collect();
    let entry = |key: u16| words.as_chunks::<4>().0.iter().skip(1).find(|entry| entry[0] == key);
    let short = |key: u16| entry(key).filter(|entry| entry[1] == 0).map(|entry| entry[3]);
    let size = entry(UNIT_SIZE).filter(|entry| entry[1] == 34736).and_then(|entry| {
        let metres = f64::from_le_bytes(*doubles.as_chunks().0.get(usize::from(entry[3]))?);
        Some(metres * METRE).filter(|size| size.is_finite() && *size > 0.0)
    });
    if short(MODEL) == Some(2) {
        return System::Angles;
    }
    let plane = short(UNIT).and_then(unit).or(size);
    match (plane, short(PROJECTED)) {
        (Some(plane), _) => System::Lengths { plane, height: short(HEIGHT_UNIT).and_then(unit) },
        // Zones of UTM (of WGS 84, WGS 72, ETRS89 and NAD83) are in metres.
        (None, Some(25828..=25838 | 26901..=26923 | 32201..=32260 | 32301..=32360 | 32601..=32660 | 32701..=32760)) => {
            System::Lengths { plane: METRE, height: short(HEIGHT_UNIT).and_then(unit) }
        }
        (None, Some(code)) => System::Unknown(format!("names its coordinate system (EPSG {code}), but not the unit")),
        (None, None) => System::Unknown("does not say the unit of its coordinates".to_owned()),
    }
}

/// The length of a unit of EPSG in millimetres.
fn unit(code: u16) -> Option<f64> {
    match code {
        9001 => Some(METRE),
        9002 => Some(FOOT),
        9003 => Some(SURVEY_FOOT),
        9033 | 1033 => Some(10.0),
        1025 => Some(1.0),
        9036 => Some(1000.0 * METRE),
        _ => None,
    }
}

/// The system of a text such as `PROJCS["...",GEOGCS[...],...,UNIT["metre",1]]`.
fn from_text(text: &str) -> System {
    const LATERAL: [&str; 7] = ["PROJCS", "PROJCRS", "PROJECTEDCRS", "LOCAL_CS", "ENGCRS", "GEOCCS", "ENGINEERINGCRS"];
    const VERTICAL: [&str; 4] = ["VERT_CS", "VERTCRS", "VERTICALCRS", "VERTICAL_CS"];
    let (mut plane, mut height) = (None, None);
    let (mut names, mut is_lateral, mut is_angular) = (Vec::<&str>::new(), false, false);
    for (word, is_open) in words(text) {
        if !is_open {
            names.pop();
            continue;
        }
        names.push(word.name);
        is_lateral |= LATERAL.contains(&word.name);
        is_angular |= matches!(word.name, "GEOGCS" | "GEOGCRS" | "GEODCRS" | "GEOGRAPHICCRS" | "GEODETICCRS");
        if !matches!(word.name, "UNIT" | "LENGTHUNIT") {
            continue;
        }
        // A unit belongs to what it stands in, or to an axis of that.
        let owner = names.iter().rev().skip(1).find(|name| **name != "AXIS").copied().unwrap_or_default();
        if LATERAL.contains(&owner) {
            plane = plane.or(word.number);
        } else if VERTICAL.contains(&owner) {
            height = height.or(word.number);
        }
    }
    let length = |metres: f64| Some(metres * METRE).filter(|size| size.is_finite() && *size > 0.0);
    match plane.and_then(length) {
        Some(plane) => System::Lengths { plane, height: height.and_then(length) },
        None if is_angular && !is_lateral => System::Angles,
        None => System::Unknown("does not say the unit of its coordinates".to_owned()),
    }
}

/// A word with a bracket behind it.
struct Word<'a> {
    name: &'a str,
    /// The number behind a text: `UNIT["metre",1]` has 1.
    number: Option<f64>,
}

/// The words of a well-known text: `true` where one opens, `false` where one ends.
fn words(text: &str) -> Vec<(Word<'_>, bool)> {
    let (mut words, mut start, mut in_quotes) = (Vec::new(), 0, false);
    for (at, letter) in text.char_indices() {
        match letter {
            '"' => in_quotes = !in_quotes,
            _ if in_quotes => {}
            '[' | '(' => {
                let name = text[start..at].trim();
                words.push((Word { name, number: number(&text[at + 1..]) }, true));
                start = at + 1;
            }
            ']' | ')' => {
                words.push((Word { name: "", number: None }, false));
                start = at + 1;
            }
            ',' => start = at + 1,
            _ => {}
        }
    }
    words
}

/// The number behind the text in quotes at a beginning.
fn number(rest: &str) -> Option<f64> {
    let rest = rest.trim_start().strip_prefix('"')?;
    let rest = rest[rest.find('"')? + 1..].trim_start().strip_prefix(',')?;
    rest[..rest.find([',', ']', ')'])?].trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lengths(plane: f64, height: Option<f64>) -> System {
        System::Lengths { plane, height }
    }

    #[test]
    fn texts_say_units() {
        let degrees =
            "GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,298.25]],UNIT[\"degree\",0.0174]]";
        let projected =
            format!("PROJCS[\"a, (UTM] zone\",{degrees},PROJECTION[\"x\"],UNIT[\"US survey foot\", 0.3048006096]]");
        let heights = "VERT_CS[\"NAVD88\",VERT_DATUM[\"d\",2005],UNIT[\"metre\",1],AXIS[\"Up\",UP]]";
        assert_eq!(from_text(degrees), System::Angles);
        assert_eq!(from_text(&projected), lengths(304.8006096, None));
        assert_eq!(from_text(&format!("COMPD_CS[\"both\",{projected},{heights}]")), lengths(304.8006096, Some(1000.0)));
        assert_eq!(from_text(&format!("COMPD_CS[\"both\",{degrees},{heights}]")), System::Angles);
        let new = "PROJCRS[\"n\",BASEGEOGCRS[\"b\",DATUM[\"d\",ELLIPSOID[\"e\",6378137,298,LENGTHUNIT[\"metre\",1]]]],\
                   CONVERSION[\"c\",PARAMETER[\"False easting\",5,LENGTHUNIT[\"foot\",0.3048]]],CS[Cartesian,2],\
                   AXIS[\"x\",east,LENGTHUNIT[\"foot\",0.3048]]]";
        assert_eq!(from_text(new), lengths(304.8, None));
        assert_eq!(from_text("LOCAL_CS[\"scan\",UNIT[\"metre\",1]]"), lengths(1000.0, None));
        for broken in ["", "PROJCS[", "]]]", "UNIT[\"", "PROJCS[\"ü\",UNIT[\"ß\",x]]", "PROJCS[\"a\",UNIT[\"m\",0]]"]
        {
            assert!(matches!(from_text(broken), System::Unknown(_)), "{broken}");
        }
    }

    #[test]
    fn keys_say_units() {
        let keys = |entries: &[[u16; 4]]| -> Vec<u8> {
            let head = [[1, 1, 0, entries.len() as u16]];
            head.iter().chain(entries).flatten().flat_map(|w| w.to_le_bytes()).collect()
        };
        let feet = keys(&[[1024, 0, 1, 1], [3072, 0, 1, 2992], [3076, 0, 1, 9003], [4099, 0, 1, 9001]]);
        assert_eq!(from_keys(&feet, &[]), lengths(SURVEY_FOOT, Some(1000.0)));
        assert_eq!(from_keys(&keys(&[[1024, 0, 1, 2]]), &[]), System::Angles);
        assert_eq!(from_keys(&keys(&[[3072, 0, 1, 26914]]), &[]), lengths(1000.0, None));
        assert!(matches!(from_keys(&keys(&[[3072, 0, 1, 2992]]), &[]), System::Unknown(text) if text.contains("2992")));
        let size = keys(&[[3076, 0, 1, 32767], [3077, 34736, 1, 1]]);
        let doubles: Vec<u8> = [0.0, 0.5_f64].iter().flat_map(|d| d.to_le_bytes()).collect();
        assert_eq!(from_keys(&size, &doubles), lengths(500.0, None));
        assert!(matches!(from_keys(&size, &[]), System::Unknown(_)));
        assert!(matches!(from_keys(&[1, 2, 3], &[]), System::Unknown(_)));
    }
}
