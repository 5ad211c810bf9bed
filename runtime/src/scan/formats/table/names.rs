//! Names of columns, and what they say.

use super::dialect::{DIALECTS, Dialect};
use crate::scan::unit::Unit;

/// What the columns of a table are, by their numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Columns {
    pub(super) position: [usize; 3],
    pub(super) normal: Option<[usize; 3]>,
    /// Red, green and blue.
    pub(super) colour: Option<[usize; 3]>,
    /// The number that is full brightness.
    pub(super) brightest: f64,
    pub(super) intensity: Option<usize>,
}

impl Columns {
    /// Whether a column is read.
    pub(super) fn read(&self, column: usize) -> bool {
        let threes = [Some(self.position), self.normal, self.colour];
        threes.iter().flatten().flatten().chain(&self.intensity).any(|c| *c == column)
    }
}

/// Names of coordinates without blanks, signs and units; the earlier ones are better.
const POSITION: [&[&str]; 3] = [
    &[
        "x",
        "xcoordinate",
        "xcoord",
        "coordx",
        "coordinatex",
        "posx",
        "positionx",
        "px",
        "points0",
        "easting",
        "east",
        "rechtswert",
        "ostwert",
    ],
    &[
        "y",
        "ycoordinate",
        "ycoord",
        "coordy",
        "coordinatey",
        "posy",
        "positiony",
        "py",
        "points1",
        "northing",
        "north",
        "hochwert",
        "nordwert",
    ],
    &[
        "z",
        "zcoordinate",
        "zcoord",
        "coordz",
        "coordinatez",
        "posz",
        "positionz",
        "pz",
        "points2",
        "elevation",
        "height",
        "altitude",
        "höhe",
        "hoehe",
    ],
];
const NORMAL: [&[&str]; 3] = [
    &["nx", "normalx", "normals0", "xnormal", "normx"],
    &["ny", "normaly", "normals1", "ynormal", "normy"],
    &["nz", "normalz", "normals2", "znormal", "normz"],
];
const COLOUR: [&[&str]; 3] = [
    &["r", "red", "rf", "colorr", "colourr", "rgb0", "diffusered"],
    &["g", "green", "gf", "colorg", "colourg", "rgb1", "diffusegreen"],
    &["b", "blue", "bf", "colorb", "colourb", "rgb2", "diffuseblue"],
];
const INTENSITY: &[&str] = &["intensity", "scalarintensity", "i", "int", "reflectance", "reflectivity", "amplitude"];

/// A line of names.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Names {
    /// Their number.
    pub(super) count: usize,
    /// As they stand there.
    pub(super) all: Vec<String>,
    pub(super) columns: Columns,
    /// The unit of the coordinates, or the text that stands in its place and is no unit that gmlc knows.
    pub(super) unit: Option<Result<Unit, String>>,
}

/// A name.
struct Name {
    /// Letters and digits, in lower case, without the unit.
    bare: String,
    /// As in [`Names::unit`].
    unit: Option<Result<Unit, String>>,
}

impl Name {
    fn of(text: &str) -> Self {
        let text = text.trim_matches(|c: char| c.is_whitespace() || c == '"' || c == '\'').to_lowercase();
        let (base, unit) = match text.find(['[', '(']) {
            Some(at) => {
                let inside = text[at + 1..].trim_end_matches([']', ')', ' ']);
                (&text[..at], Some(inside.parse().map_err(|_| inside.to_owned())))
            }
            // `x_mm` and `x mm`.
            None => match text.rsplit_once(['_', ' ']).map(|(base, word)| (base, word.parse().ok())) {
                Some((base, Some(unit))) => (base, Some(Ok(unit))),
                _ => (text.as_str(), None),
            },
        };
        Self { bare: base.chars().filter(|c| c.is_alphanumeric()).collect(), unit }
    }
}

/// The unit that a line of text before the points states, such as `Units: inches` and `# unit = m`, or the word that
/// stands there and is none.
pub(super) fn stated_unit(line: &[u8]) -> Option<Result<Unit, String>> {
    let line = String::from_utf8_lossy(line).to_lowercase();
    let behind = |word: &str| line.find(word).map(|at| &line[at + word.len()..]);
    let rest = behind("units").or_else(|| behind("unit")).or_else(|| behind("einheit"))?;
    let rest = rest.trim_start();
    let word =
        rest.strip_prefix([':', '=', ',', ';']).or_else(|| rest.strip_prefix("are ")).or(rest.strip_prefix("is "))?;
    let word = word.trim().trim_matches(|c: char| "\"'[]().;,".contains(c));
    (!word.is_empty()).then(|| word.parse().map_err(|_| word.to_owned()))
}

/// The column of the best of some names; the error says that two have it.
fn column(names: &[Name], known: &[&str]) -> Result<Option<usize>, String> {
    for known in known {
        let mut with = (0..names.len()).filter(|i| names[*i].bare == *known);
        if let Some(first) = with.next() {
            return match with.next() {
                Some(_) => Err(format!("two columns are called `{known}`")),
                None => Ok(Some(first)),
            };
        }
    }
    Ok(None)
}

fn three(names: &[Name], known: [&[&str]; 3]) -> Result<Option<[usize; 3]>, String> {
    let [a, b, c] = known.map(|known| column(names, known));
    Ok(match (a?, b?, c?) {
        (Some(a), Some(b), Some(c)) => Some([a, b, c]),
        _ => None,
    })
}

impl Names {
    /// The names of a line in one dialect or another; none if the coordinates are not among them. An error says that
    /// they contradict each other.
    pub(super) fn of(line: &[u8], dialect: Dialect) -> Result<Option<Self>, String> {
        let line = line.trim_ascii();
        let line = line.strip_prefix(b"//").or_else(|| line.strip_prefix(b"#")).unwrap_or(line);
        let mut error = None;
        for dialect in std::iter::once(dialect).chain(DIALECTS) {
            match Self::of_words(&words(line, dialect)) {
                Ok(None) => {}
                Ok(names) => return Ok(names),
                Err(message) => error = error.or(Some(message)),
            }
        }
        error.map_or(Ok(None), Err)
    }

    fn of_words(words: &[String]) -> Result<Option<Self>, String> {
        let names: Vec<Name> = words.iter().map(|word| Name::of(word)).collect();
        let Some(position) = three(&names, POSITION)? else { return Ok(None) };
        let stated = || position.iter().filter_map(|i| names[*i].unit.as_ref());
        let known = || stated().filter_map(|unit| unit.as_ref().ok());
        if known().zip(known().skip(1)).any(|(one, next)| one != next) {
            return Err("the coordinates have different units".to_owned());
        }
        let unit = stated().find(|unit| unit.is_ok()).or_else(|| stated().next()).cloned();
        let columns = Columns {
            position,
            // Of what is there twice nothing is taken.
            normal: three(&names, NORMAL).unwrap_or(None),
            colour: three(&names, COLOUR).unwrap_or(None),
            brightest: 255.0,
            intensity: column(&names, INTENSITY).unwrap_or(None),
        };
        Ok(Some(Self { count: words.len(), all: words.to_vec(), columns, unit }))
    }
}

/// The words of a line of names: a unit in brackets belongs to the word before.
pub(super) fn words(line: &[u8], dialect: Dialect) -> Vec<String> {
    let mut fields = Vec::new();
    dialect.split(line, &mut fields);
    let mut words: Vec<String> = Vec::new();
    for field in fields {
        let word = String::from_utf8_lossy(&line[field]).into_owned();
        match words.last_mut() {
            Some(last) if word.starts_with(['[', '(']) => last.push_str(&word),
            _ => words.push(word),
        }
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(line: &str) -> Option<Names> {
        Names::of(line.as_bytes(), DIALECTS[5]).unwrap()
    }

    #[test]
    fn names_in_many_forms() {
        let all = [
            "x,y,z",
            "X Y Z",
            "//X;Y;Z",
            "# x y z",
            "\"X\",\"Y\",\"Z\"",
            "Points:0,Points:1,Points:2",
            "Easting,Northing,Elevation",
            "pos_x, pos_y, pos_z",
        ];
        for line in all {
            let names = names(line).unwrap();
            assert_eq!((names.columns.position, names.unit), ([0, 1, 2], None), "{line}");
        }
        let units =
            ["X [mm],Y [mm],Z [mm]", "X [mm] Y [mm] Z [mm]", "x_mm;y_mm;z_mm", "x(mm)\ty(mm)\tz(mm)", "x mm,y,z"];
        for line in units {
            let names = names(line).unwrap();
            assert_eq!((names.columns.position, names.unit, names.count), ([0, 1, 2], Some(Ok(Unit::Mm)), 3), "{line}");
        }
        assert_eq!(names("x (Inches),y,z").unwrap().unit, Some(Ok(Unit::In)));
        let all = names("id,Z,Y,X,Blue,Green,Red,Nx,Ny,Nz,Intensity").unwrap().columns;
        assert_eq!((all.position, all.normal, all.colour), ([3, 2, 1], Some([7, 8, 9]), Some([6, 5, 4])));
        assert_eq!(all.intensity, Some(10));
    }

    #[test]
    fn other_names() {
        assert_eq!(names("time,speed,height"), None);
        assert_eq!(names("Exported by a program"), None);
        let error = |line: &str| Names::of(line.as_bytes(), DIALECTS[5]).unwrap_err();
        assert_eq!(error("X,Y,X"), "two columns are called `x`");
        assert_eq!(error("X [mm],Y [m],Z [mm]"), "the coordinates have different units");
    }
}
