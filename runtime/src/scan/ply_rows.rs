//! Rows of a PLY file's elements, whatever the order, the types and the number of their properties.

use serde::Deserialize;
use serde::de::{Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use std::fmt;
use std::marker::PhantomData;

/// All rows of an element. An error names the row.
pub(super) struct Rows<T>(pub(super) Vec<T>);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Rows<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct RowsVisitor<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for RowsVisitor<T> {
            type Value = Vec<T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("rows")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Vec<T>, A::Error> {
                let mut rows = Vec::new();
                let named = |i: usize, error: A::Error| A::Error::custom(format!("row {i}: {error}"));
                while let Some(row) = seq.next_element().map_err(|error| named(rows.len() + 1, error))? {
                    rows.push(row);
                }
                Ok(rows)
            }
        }
        deserializer.deserialize_seq(RowsVisitor(PhantomData)).map(Rows)
    }
}

/// A vertex: position; normal and texture coordinate where there are such properties.
#[derive(Clone, Copy)]
pub(super) struct VertexRow {
    pub(super) position: [f64; 3],
    pub(super) normal: Option<[f64; 3]>,
    pub(super) texcoord: Option<[f64; 2]>,
}

/// A face: vertex indices and, for each, a texture coordinate (two numbers) where there are such.
#[derive(Default)]
pub(super) struct FaceRow {
    pub(super) indices: Vec<i64>,
    pub(super) texcoords: Vec<f64>,
}

impl FaceRow {
    pub(super) fn has_texcoords(&self) -> bool {
        !self.indices.is_empty() && self.texcoords.len() == 2 * self.indices.len()
    }
}

/// A row of an element that is of no interest.
pub(super) struct SkippedRow;

/// A property that is of interest; the library hands out names as bytes.
enum Property {
    Position(usize),
    Normal(usize),
    Texcoord(usize),
    Indices,
    CornerTexcoords,
    Other,
}

impl<'de> Deserialize<'de> for Property {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NameVisitor;
        impl Visitor<'_> for NameVisitor {
            type Value = Property;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a property's name")
            }

            fn visit_bytes<E: Error>(self, name: &[u8]) -> Result<Property, E> {
                Ok(match name {
                    b"x" => Property::Position(0),
                    b"y" => Property::Position(1),
                    b"z" => Property::Position(2),
                    b"nx" => Property::Normal(0),
                    b"ny" => Property::Normal(1),
                    b"nz" => Property::Normal(2),
                    b"s" | b"u" | b"texture_u" => Property::Texcoord(0),
                    b"t" | b"v" | b"texture_v" => Property::Texcoord(1),
                    b"vertex_indices" | b"vertex_index" => Property::Indices,
                    b"texcoord" => Property::CornerTexcoords,
                    _ => Property::Other,
                })
            }
        }
        deserializer.deserialize_identifier(NameVisitor)
    }
}

impl<'de> Deserialize<'de> for VertexRow {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct RowVisitor;
        impl<'de> Visitor<'de> for RowVisitor {
            type Value = VertexRow;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a vertex")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<VertexRow, A::Error> {
                let mut row = VertexRow { position: [f64::NAN; 3], normal: None, texcoord: None };
                while let Some(property) = map.next_key()? {
                    match property {
                        Property::Position(c) => row.position[c] = map.next_value()?,
                        Property::Normal(c) => row.normal.get_or_insert([f64::NAN; 3])[c] = map.next_value()?,
                        Property::Texcoord(c) => row.texcoord.get_or_insert_default()[c] = map.next_value()?,
                        _ => drop(map.next_value::<IgnoredAny>()?),
                    }
                }
                Ok(row)
            }
        }
        deserializer.deserialize_map(RowVisitor)
    }
}

impl<'de> Deserialize<'de> for FaceRow {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct RowVisitor;
        impl<'de> Visitor<'de> for RowVisitor {
            type Value = FaceRow;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a face")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<FaceRow, A::Error> {
                let mut row = FaceRow::default();
                while let Some(property) = map.next_key()? {
                    match property {
                        Property::Indices => row.indices = map.next_value()?,
                        Property::CornerTexcoords => row.texcoords = map.next_value()?,
                        _ => drop(map.next_value::<IgnoredAny>()?),
                    }
                }
                Ok(row)
            }
        }
        deserializer.deserialize_map(RowVisitor)
    }
}

impl<'de> Deserialize<'de> for SkippedRow {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct RowVisitor;
        impl<'de> Visitor<'de> for RowVisitor {
            type Value = SkippedRow;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a row")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<SkippedRow, A::Error> {
                while map.next_entry::<IgnoredAny, IgnoredAny>()?.is_some() {}
                Ok(SkippedRow)
            }
        }
        deserializer.deserialize_map(RowVisitor)
    }
}
