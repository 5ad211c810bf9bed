//! The XML section of an E57 file: what its scans are called, where they stood, and how their points are laid out.

use super::FORMAT;
use super::field::{Field, Kind, Name};
use super::limits;
use crate::scan::attributes::Station;
use crate::scan::error::{ScanFault, shown};
use roxmltree::{Document, Node, ParsingOptions};

/// The most elements of an XML section. Scans have about 50 each.
const MOST_NODES: u32 = 1 << 20;

/// A scan as the XML section describes it.
#[derive(Clone, Debug, Default)]
pub(super) struct Described {
    pub(super) name: String,
    /// The pose; none where there is none.
    pub(super) pose: Option<Station>,
    /// The physical position of the points.
    pub(super) offset: u64,
    /// Their number.
    pub(super) records: u64,
    /// What each of them has, in the order of the file.
    pub(super) fields: Vec<Field>,
    /// The values of black and of full red, green and blue, as far as they are stated.
    pub(super) colours: [Option<[f64; 2]>; 3],
    /// Names of attributes of the points that are not known.
    pub(super) ignored: Vec<String>,
    /// Sentences about faults that are put up with.
    pub(super) warnings: Vec<String>,
}

/// The scans of an XML section.
pub(super) fn read(xml: &str) -> Result<Vec<Described>, ScanFault> {
    limits::check(xml)?;
    let options = ParsingOptions { allow_dtd: false, nodes_limit: MOST_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(xml, options)
        .map_err(|error| ScanFault::malformed(FORMAT, "XML section", format!("{error}; export the file again")))?;
    let root = document.root_element();
    let Some(scans) = child(root, "data3D") else { return Ok(Vec::new()) };
    let scans = scans.children().filter(Node::is_element);
    scans.enumerate().map(|(index, scan)| Xml { index }.scan(scan)).collect()
}

/// The child of a name that belongs to the format itself.
fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    let space = node.document().root_element().tag_name().namespace();
    node.children().find(|n| n.tag_name().name() == name && n.tag_name().namespace() == space)
}

/// Reads the description of a scan.
struct Xml {
    /// The scan, counted from 0.
    index: usize,
}

impl Xml {
    fn fault(&self, element: &str, message: impl Into<String>) -> ScanFault {
        ScanFault::malformed(FORMAT, format!("scan {}, element `{element}`", self.index), message)
    }

    fn scan(&self, scan: Node) -> Result<Described, ScanFault> {
        let name = child(scan, "name").and_then(|n| n.text()).unwrap_or_default().trim().to_owned();
        let Some(points) = child(scan, "points") else {
            return Ok(Described { name, ..Described::default() });
        };
        let prototype = child(points, "prototype")
            .ok_or_else(|| self.fault("points", "a `prototype` was expected in it; export the file again"))?;
        self.check_codecs(points)?;
        let mut warnings = Vec::new();
        let pose = child(scan, "pose").map(|pose| self.pose(pose, &mut warnings)).transpose()?;
        let attributes = || prototype.children().filter(Node::is_element);
        let fields: Vec<Field> = attributes().map(|n| self.field(n)).collect::<Result<_, _>>()?;
        let unknown = attributes().zip(&fields).filter(|(_, field)| field.name.is_none());
        let ignored = unknown.map(|(node, _)| node.tag_name().name().to_owned()).collect();
        Ok(Described {
            name,
            pose,
            offset: self.count(points, "fileOffset")?,
            records: self.count(points, "recordCount")?,
            fields,
            colours: self.colours(scan)?,
            ignored,
            warnings,
        })
    }

    /// An attribute of the points.
    fn count(&self, points: Node, name: &str) -> Result<u64, ScanFault> {
        let text = points.attribute(name).unwrap_or_default();
        text.trim().parse().map_err(|_| {
            let message =
                format!("its `{name}` is `{}`, not a number of bytes or points; export the file again", shown(text));
            self.fault("points", message)
        })
    }

    /// There is one codec in the standard.
    fn check_codecs(&self, points: Node) -> Result<(), ScanFault> {
        let codecs = child(points, "codecs").into_iter().flat_map(|n| n.descendants());
        let other = codecs.map(|n| n.tag_name().name()).find(|name| name.ends_with("Codec") && *name != "bitPackCodec");
        other.map_or(Ok(()), |other| {
            let message =
                format!("the points are packed by `{other}`, of which nothing is known; export them without it");
            Err(self.fault("codecs", message))
        })
    }

    /// The number of an element: 0 where that is empty.
    fn number(&self, node: Node) -> Result<f64, ScanFault> {
        self.parse(node.tag_name().name(), node.text().unwrap_or_default(), 0.0)
    }

    fn parse(&self, name: &str, text: &str, default: f64) -> Result<f64, ScanFault> {
        match text.trim() {
            "" => Ok(default),
            text => text
                .parse()
                .map_err(|_| self.fault(name, format!("`{}` is not a number; export the file again", shown(text)))),
        }
    }

    /// The numbers of named children: 0 where there is none.
    fn numbers<const N: usize>(
        &self,
        node: Option<Node>,
        names: [&str; N],
        default: [f64; N],
    ) -> Result<[f64; N], ScanFault> {
        let Some(node) = node else { return Ok(default) };
        let mut numbers = [0.0; N];
        for (number, name) in numbers.iter_mut().zip(names) {
            *number = child(node, name).map_or(Ok(0.0), |n| self.number(n))?;
        }
        Ok(numbers)
    }

    fn pose(&self, pose: Node, warnings: &mut Vec<String>) -> Result<Station, ScanFault> {
        let turn = self.numbers(child(pose, "rotation"), ["w", "x", "y", "z"], [1.0, 0.0, 0.0, 0.0])?;
        let place = self.numbers(child(pose, "translation"), ["x", "y", "z"], [0.0; 3])?;
        if !turn.iter().chain(&place).all(|n| n.is_finite()) {
            return Err(self.fault("pose", "its numbers are not finite; export the file again"));
        }
        let length = turn.iter().map(|q| q * q).sum::<f64>().sqrt();
        if length == 0.0 {
            let index = self.index;
            warnings.push(format!("scan {index}: the quaternion of its pose is 0; it is taken as not turned"));
            return Ok(Station::at(place));
        }
        // Six digits, as some programs write.
        if (length - 1.0).abs() > 1e-5 {
            let index = self.index;
            warnings
                .push(format!("scan {index}: the quaternion of its pose has the length {length}; it is scaled to 1"));
        }
        Ok(Station::turned(place, turn))
    }

    fn colours(&self, scan: Node) -> Result<[Option<[f64; 2]>; 3], ScanFault> {
        let Some(limits) = child(scan, "colorLimits") else { return Ok([None; 3]) };
        let mut colours = [None; 3];
        for (range, name) in colours.iter_mut().zip(["Red", "Green", "Blue"]) {
            let end = |end: &str| child(limits, &format!("color{name}{end}")).map(|n| self.limit(n)).transpose();
            *range = end("Minimum")?.zip(end("Maximum")?).map(|(low, high)| [low, high]);
        }
        Ok(colours)
    }

    /// The value of an element, which may be a scaled integer.
    fn limit(&self, node: Node) -> Result<f64, ScanFault> {
        let number = self.number(node)?;
        if node.attribute("type") != Some("ScaledInteger") {
            return Ok(number);
        }
        let part = |name, default| self.parse(name, node.attribute(name).unwrap_or_default(), default);
        Ok(number * part("scale", 1.0)? + part("offset", 0.0)?)
    }

    fn field(&self, node: Node) -> Result<Field, ScanFault> {
        let tag = node.tag_name();
        let own = tag.namespace() == node.document().root_element().tag_name().namespace();
        let name = Name::of(tag.name(), own);
        let part = |name, default| self.parse(name, node.attribute(name).unwrap_or_default(), default);
        let integer = |name, default| self.integer(tag.name(), node.attribute(name), default);
        let kind = match node.attribute("type").unwrap_or_default() {
            "Float" if node.attribute("precision") == Some("single") => Kind::Single,
            "Float" => Kind::Double,
            kind @ ("Integer" | "ScaledInteger") => {
                let (low, high) = (integer("minimum", i64::MIN)?, integer("maximum", i64::MAX)?);
                if low > high {
                    let message = format!("its minimum {low} is larger than its maximum {high}; export the file again");
                    return Err(self.fault(tag.name(), message));
                }
                let scaled = kind == "ScaledInteger";
                let (scale, offset) = if scaled { (part("scale", 1.0)?, part("offset", 0.0)?) } else { (1.0, 0.0) };
                Kind::Integer { low, high, scale, offset }
            }
            "String" | "Blob" => Kind::Other,
            other => {
                let message =
                    format!("a field of points has the type `{}`, which is not read; leave it out", shown(other));
                return Err(self.fault(tag.name(), message));
            }
        };
        let stated = node.has_attribute("minimum") && node.has_attribute("maximum");
        let range = match kind {
            Kind::Integer { low, high, scale, offset } => [low, high].map(|n| n as f64 * scale + offset),
            _ => [part("minimum", 0.0)?, part("maximum", 1.0)?],
        };
        Ok(Field { name, kind, range: Some(range).filter(|_| stated) })
    }

    fn integer(&self, name: &str, text: Option<&str>, default: i64) -> Result<i64, ScanFault> {
        text.map_or(Ok(default), |text| {
            let fault = |_| self.fault(name, format!("`{}` is not a whole number; export the file again", shown(text)));
            text.trim().parse().map_err(fault)
        })
    }
}
