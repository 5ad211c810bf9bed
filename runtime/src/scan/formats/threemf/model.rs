//! A model of a package: its objects, and the items of its build.

use super::package::quoted;
use super::{malformed, part};
use crate::scan::error::ScanFault;
use glam::DAffine3;
use quick_xml::Reader;
use quick_xml::XmlVersion;
use quick_xml::events::{BytesStart, Event};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::BufRead;
use std::sync::Arc;

/// The objects of all models, by the names of their parts and by their numbers.
pub(super) type Objects = BTreeMap<Key, Object>;
/// The name of a part without the slash at its beginning, and the number of an object there.
pub(super) type Key = (Arc<str>, u32);

#[derive(Default)]
pub(super) struct Object {
    pub(super) name: String,
    pub(super) positions: Vec<[f64; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) components: Vec<Placed>,
}

/// An object in a place.
#[derive(Clone)]
pub(super) struct Placed {
    pub(super) key: Key,
    pub(super) transform: DAffine3,
}

/// What a model has beside its objects.
pub(super) struct Model {
    /// Millimetres.
    pub(super) unit: f64,
    pub(super) items: Vec<Placed>,
    /// The other parts that it names.
    pub(super) paths: Vec<Arc<str>>,
    /// The number of its beam lattices.
    pub(super) beams: usize,
}

impl Default for Model {
    fn default() -> Self {
        Self { unit: 1.0, items: Vec::new(), paths: Vec::new(), beams: 0 }
    }
}

/// Reads a model, whose objects are added to `objects`.
pub(super) fn read<R: BufRead>(
    reader: &mut Reader<R>,
    name: &Arc<str>,
    objects: &mut Objects,
) -> Result<Model, ScanFault> {
    let mut parser = Parser { name, model: Model::default(), object: None, is_whole: false };
    let mut buffer = Vec::new();
    loop {
        buffer.clear();
        match event(reader, &mut buffer, name)? {
            Event::Start(element) => parser.start(&element, objects)?,
            Event::Empty(element) => {
                parser.start(&element, objects)?;
                parser.end(element.local_name().as_ref(), objects);
            }
            Event::End(element) => parser.end(element.local_name().as_ref(), objects),
            Event::Eof if parser.is_whole => return Ok(parser.model),
            Event::Eof => {
                return Err(malformed(part(name), "the end of its element `model` is missing; export it again"));
            }
            _ => {}
        }
    }
}

/// The next event of a part. Declarations of entities, by which a text grows without end, are refused.
pub(super) fn event<'b, R: BufRead>(
    reader: &mut Reader<R>,
    buffer: &'b mut Vec<u8>,
    name: &str,
) -> Result<Event<'b>, ScanFault> {
    let read = reader.read_event_into(buffer);
    match read {
        Ok(Event::DocType(_)) => {
            Err(malformed(part(name), "it has a document type, which the format forbids; export it again"))
        }
        Ok(event) => Ok(event),
        Err(error) => {
            let place = format!("{}, byte {}", part(name), reader.error_position());
            Err(malformed(place, format!("the XML is damaged or cut off ({error}); export it again")))
        }
    }
}

/// The attributes of an element by their names, without prefixes.
pub(super) struct Attributes<'a>(Vec<(&'a str, Cow<'a, str>)>);

impl<'a> Attributes<'a> {
    pub(super) fn of(element: &'a BytesStart, name: &str) -> Result<Self, ScanFault> {
        let damaged = |error: &dyn std::fmt::Display| {
            let message = format!("an attribute of `{}` is damaged ({error}); export it again", element_name(element));
            malformed(part(name), message)
        };
        let mut all = Vec::new();
        for attribute in element.attributes() {
            let attribute = attribute.map_err(|error| damaged(&error))?;
            let value = attribute.normalized_value(XmlVersion::Implicit1_0).map_err(|error| damaged(&error))?;
            all.push((attribute.key.local_name().into_inner(), value));
        }
        Ok(Self(all))
    }

    pub(super) fn get(&self, name: &str) -> Option<&str> {
        self.0.iter().find(|(known, _)| *known == name).map(|(_, value)| value.as_ref())
    }
}

fn element_name(element: &BytesStart) -> String {
    crate::scan::error::shown(element.local_name().as_ref())
}

struct Parser<'a> {
    /// The part.
    name: &'a Arc<str>,
    model: Model,
    /// The object that is being read.
    object: Option<(u32, Object)>,
    /// The element `model` has ended.
    is_whole: bool,
}

impl Parser<'_> {
    fn fault(&self, message: impl Into<String>) -> ScanFault {
        let place = match &self.object {
            Some((id, _)) => format!("{}, object {id}", part(self.name)),
            None => part(self.name),
        };
        malformed(place, message)
    }

    fn start(&mut self, element: &BytesStart, objects: &Objects) -> Result<(), ScanFault> {
        let kind = element.local_name();
        match (kind.as_ref(), &mut self.object) {
            ("vertex", Some((_, object))) => {
                let Some(position) = numbers(element, ["x", "y", "z"]) else {
                    let number = object.positions.len() + 1;
                    let message = format!("vertex {number} (counted from 1) has no x, y and z that are numbers");
                    return Err(self.fault(message));
                };
                object.positions.push(position);
            }
            ("triangle", Some((_, object))) => {
                let (number, count) = (object.triangles.len() + 1, object.positions.len());
                let Some(corners) = numbers::<i64>(element, ["v1", "v2", "v3"]) else {
                    let message =
                        format!("triangle {number} (counted from 1) has no v1, v2 and v3 that are whole numbers");
                    return Err(self.fault(message));
                };
                if let Some(index) = corners.into_iter().find(|index| !(0..count as i64).contains(index)) {
                    let id = self.object.as_ref().map_or(0, |(id, _)| *id);
                    let place = format!("{}, object {id}: triangle {number} (counted from 1)", part(self.name));
                    return Err(ScanFault::IndexOutOfRange { place, what: "vertex", index, count });
                }
                object.triangles.push(corners.map(|index| index as u32));
            }
            ("component", Some(_)) => {
                let placed = self.placed(element)?;
                if let Some((_, object)) = &mut self.object {
                    object.components.push(placed);
                }
            }
            ("object", None) => self.start_object(element, objects)?,
            ("item", None) => {
                let placed = self.placed(element)?;
                self.model.items.push(placed);
            }
            ("model", None) => self.start_model(element)?,
            ("beamlattice", Some(_)) => self.model.beams += 1,
            _ => {}
        }
        Ok(())
    }

    fn start_model(&mut self, element: &BytesStart) -> Result<(), ScanFault> {
        let attributes = Attributes::of(element, self.name)?;
        self.model.unit = match attributes.get("unit").unwrap_or("millimeter") {
            "micron" => 1e-3,
            "millimeter" => 1.0,
            "centimeter" => 10.0,
            "inch" => 25.4,
            "foot" => 304.8,
            "meter" => 1000.0,
            unit => {
                let expected = "expected micron, millimeter, centimeter, inch, foot or meter";
                return Err(self.fault(format!("its unit is {}; {expected}", quoted(unit))));
            }
        };
        Ok(())
    }

    fn start_object(&mut self, element: &BytesStart, objects: &Objects) -> Result<(), ScanFault> {
        let attributes = Attributes::of(element, self.name)?;
        let Some(id) = attributes.get("id").and_then(|id| id.trim().parse().ok()) else {
            return Err(self.fault("an object has no `id` that is a number; export it again"));
        };
        if objects.contains_key(&(self.name.clone(), id)) {
            return Err(self.fault(format!("there are two objects {id}; export it again")));
        }
        let name = attributes.get("name").unwrap_or_default().to_owned();
        self.object = Some((id, Object { name, ..Object::default() }));
        Ok(())
    }

    fn end(&mut self, kind: &str, objects: &mut Objects) {
        self.is_whole |= kind == "model" && self.object.is_none();
        if kind == "object"
            && let Some((id, object)) = self.object.take()
        {
            objects.insert((self.name.clone(), id), object);
        }
    }

    /// The object that an item or a component places. Another part than this one is noted.
    fn placed(&mut self, element: &BytesStart) -> Result<Placed, ScanFault> {
        let attributes = Attributes::of(element, self.name)?;
        let kind = element_name(element);
        let Some(id) = attributes.get("objectid").and_then(|id| id.trim().parse().ok()) else {
            return Err(self.fault(format!("`{kind}` has no `objectid` that is a number; export it again")));
        };
        let transform = match attributes.get("transform") {
            None => DAffine3::IDENTITY,
            Some(text) => transform(text)
                .ok_or_else(|| self.fault(format!("the transform of `{kind}` is not 12 numbers: {}", quoted(text))))?,
        };
        let path = attributes.get("path").map_or_else(|| self.name.clone(), |path| path.trim_start_matches('/').into());
        if path != *self.name && !self.model.paths.contains(&path) {
            self.model.paths.push(path.clone());
        }
        Ok(Placed { key: (path, id), transform })
    }
}

/// The numbers of three attributes of an element.
fn numbers<T: std::str::FromStr + Copy>(element: &BytesStart, names: [&str; 3]) -> Option<[T; 3]> {
    let mut found = [None; 3];
    let mut attributes = element.attributes();
    // A vertex has few attributes; that none is there twice is not worth a check.
    for attribute in attributes.with_checks(false) {
        let attribute = attribute.ok()?;
        if let Some(k) = names.iter().position(|name| *name == attribute.key.as_ref()) {
            found[k] = attribute.value.trim().parse().ok();
        }
    }
    Some([found[0]?, found[1]?, found[2]?])
}

/// A transform of rows: a point (x, y, z, 1) is a row, which the matrix is multiplied to.
fn transform(text: &str) -> Option<DAffine3> {
    let numbers: Option<Vec<f64>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
    Some(DAffine3::from_cols_array(&numbers?.try_into().ok()?))
}
