//! The header of a PLY file: its elements, and the properties of each.

use super::FORMAT;
use crate::scan::error::{ScanFault, shown};
use foldhash::fast::RandomState;
use std::collections::HashMap;

/// How the numbers of the body are written.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// The type of a number.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    /// The least and the greatest number of the type, if it has whole ones only.
    pub(super) fn range(self) -> Option<(f64, f64)> {
        match self {
            Self::I8 => Some((i8::MIN.into(), i8::MAX.into())),
            Self::U8 => Some((u8::MIN.into(), u8::MAX.into())),
            Self::I16 => Some((i16::MIN.into(), i16::MAX.into())),
            Self::U16 => Some((u16::MIN.into(), u16::MAX.into())),
            Self::I32 => Some((i32::MIN.into(), i32::MAX.into())),
            Self::U32 => Some((u32::MIN.into(), u32::MAX.into())),
            Self::F32 | Self::F64 => None,
        }
    }

    /// Its size in a binary file.
    pub(super) fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The number that bytes of its size begin with.
    pub(super) fn number(self, bytes: &[u8], big_endian: bool) -> f64 {
        fn first<const N: usize>(bytes: &[u8], big_endian: bool) -> [u8; N] {
            let mut number = [0; N];
            number.copy_from_slice(&bytes[..N]);
            if big_endian {
                number.reverse();
            }
            number
        }
        match self {
            Self::I8 => i8::from_le_bytes(first(bytes, big_endian)).into(),
            Self::U8 => bytes[0].into(),
            Self::I16 => i16::from_le_bytes(first(bytes, big_endian)).into(),
            Self::U16 => u16::from_le_bytes(first(bytes, big_endian)).into(),
            Self::I32 => i32::from_le_bytes(first(bytes, big_endian)).into(),
            Self::U32 => u32::from_le_bytes(first(bytes, big_endian)).into(),
            Self::F32 => f32::from_le_bytes(first(bytes, big_endian)).into(),
            Self::F64 => f64::from_le_bytes(first(bytes, big_endian)),
        }
    }
}

pub(super) struct Property<'a> {
    pub(super) name: &'a str,
    /// The type of the count that precedes the numbers of a list; none where there is one number.
    pub(super) count: Option<Scalar>,
    pub(super) scalar: Scalar,
}

pub(super) struct Element<'a> {
    pub(super) name: &'a str,
    /// The number of rows.
    pub(super) count: usize,
    pub(super) properties: Vec<Property<'a>>,
}

/// The header as text with plain line ends, and what follows it. Comments in other encodings than UTF-8 are common.
pub(super) fn split_header(bytes: &[u8]) -> Result<(String, &[u8]), ScanFault> {
    let cut_off =
        || ScanFault::malformed(FORMAT, "header", "the file ends before `end_header`; it is cut off: export it again");
    if !bytes.starts_with(b"ply") {
        return Err(ScanFault::malformed(FORMAT, "line 1", "expected `ply`"));
    }
    let marker = b"end_header";
    let mut from = 0;
    let end = loop {
        let found = bytes[from..].windows(marker.len()).position(|window| window == marker).ok_or_else(cut_off)?;
        let (start, end) = (from + found, from + found + marker.len());
        // The word may also stand in a comment: it must have a line of its own.
        if matches!(bytes[start - 1], b'\n' | b'\r') && bytes.get(end).is_none_or(u8::is_ascii_whitespace) {
            break end;
        }
        from = end;
    };
    let blanks = bytes[end..].iter().take_while(|b| matches!(b, b' ' | b'\t')).count();
    let rest = &bytes[end + blanks..];
    let body = rest.strip_prefix(b"\r\n").or(rest.strip_prefix(b"\n")).or(rest.strip_prefix(b"\r")).unwrap_or(rest);
    Ok((String::from_utf8_lossy(&bytes[..end]).replace("\r\n", "\n").replace('\r', "\n"), body))
}

pub(super) fn parse_header(header: &str) -> Result<(Encoding, Vec<Element<'_>>), ScanFault> {
    let (mut encoding, mut elements) = (None, Vec::<Element>::new());
    // Names of elements, and of the properties of the last one, with their lines: a name that is there twice has no
    // one meaning.
    let (mut of_elements, mut of_properties) = (Lines::default(), Lines::default());
    for (i, line) in header.lines().enumerate() {
        let fault = |expected: &str| {
            let message = format!("expected {expected}, found `{}`", shown(line));
            ScanFault::malformed(FORMAT, format!("line {}", i + 1), message)
        };
        let twice = |kind: &str, name: &str, earlier: usize| {
            let message = format!("{kind} `{}` is declared twice, first in line {earlier}; remove one", shown(name));
            ScanFault::malformed(FORMAT, format!("line {}", i + 1), message)
        };
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["format", name, version] => {
                if version != "1.0" {
                    return Err(fault("version 1.0 of the format, the only one there is"));
                }
                encoding = Some(match name {
                    "ascii" => Encoding::Ascii,
                    "binary_little_endian" => Encoding::LittleEndian,
                    "binary_big_endian" => Encoding::BigEndian,
                    _ => return Err(fault("format ascii, binary_little_endian or binary_big_endian")),
                });
            }
            ["element", name, count, ..] => {
                let count = count.parse().map_err(|_| fault("the element's number of rows"))?;
                of_properties.clear();
                if let Some(earlier) = of_elements.insert(name, i + 1) {
                    return Err(twice("element", name, earlier));
                }
                elements.push(Element { name, count, properties: Vec::new() });
            }
            ["property", ref words @ ..] => match (elements.last_mut(), Property::of(words)) {
                (Some(element), Some(property)) => {
                    if let Some(earlier) = of_properties.insert(property.name, i + 1) {
                        return Err(twice("property", property.name, earlier));
                    }
                    element.properties.push(property);
                }
                _ => return Err(fault(PROPERTY)),
            },
            [] | ["ply" | "comment" | "obj_info" | "end_header", ..] => {}
            _ => return Err(fault("`format`, `element`, `property`, `comment` or `obj_info`")),
        }
    }
    let fault = |message: String| ScanFault::malformed(FORMAT, "header", message);
    for Element { name, count, properties } in &elements {
        if *count > 0 && properties.is_empty() {
            return Err(fault(format!("element `{name}` has {count} rows but no properties")));
        }
        let lists_corners = properties.iter().any(|p| INDICES.contains(&p.name) && p.count.is_some());
        if matches!(*name, "face" | "tristrips") && *count > 0 && !lists_corners {
            return Err(fault(format!("element `{name}` has no list `{}` or `{}`", INDICES[0], INDICES[1])));
        }
        let has = |axis: &str| properties.iter().any(|p| p.name.eq_ignore_ascii_case(axis) && p.count.is_none());
        let missing = ["x", "y", "z"].into_iter().find(|axis| !has(axis));
        if let Some(axis) = missing.filter(|_| *name == "vertex") {
            return Err(fault(format!("element `vertex` has no property `{axis}`; x, y and z are needed")));
        }
    }
    let encoding = encoding.ok_or_else(|| fault("there is no line `format`".to_owned()))?;
    Ok((encoding, elements))
}

/// Lines of the header by the name that they declare.
type Lines<'a> = HashMap<&'a str, usize, RandomState>;

/// The names of the list of a face's vertices.
pub(super) const INDICES: [&str; 2] = ["vertex_indices", "vertex_index"];

/// The form of a line `property`, for messages.
const PROPERTY: &str = "`property TYPE NAME` or `property list TYPE TYPE NAME` below `element`, with the types char, uchar, short, \
                        ushort, int, uint, float and double";

impl<'a> Property<'a> {
    /// The property that the words behind `property` declare.
    fn of(words: &[&'a str]) -> Option<Self> {
        let scalar = |name: &str| match name {
            "char" | "int8" => Some(Scalar::I8),
            "uchar" | "uint8" => Some(Scalar::U8),
            "short" | "int16" => Some(Scalar::I16),
            "ushort" | "uint16" => Some(Scalar::U16),
            "int" | "int32" => Some(Scalar::I32),
            "uint" | "uint32" => Some(Scalar::U32),
            "float" | "float32" => Some(Scalar::F32),
            "double" | "float64" => Some(Scalar::F64),
            _ => None,
        };
        match *words {
            ["list", count, element, name, ..] => {
                Some(Self { name, count: Some(scalar(count)?), scalar: scalar(element)? })
            }
            [element, name, ..] => Some(Self { name, count: None, scalar: scalar(element)? }),
            _ => None,
        }
    }
}
