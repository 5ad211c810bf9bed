//! Numbers of accessors.

use super::buffers::{Buffers, of};
use super::document::{Accessor, Document, Sparse, SparseList};
use super::malformed;
use crate::scan::error::{ScanFault, shown};
use rayon::prelude::*;

/// Elements that one thread reads at least: a tenth of a millisecond's.
const CHUNK: usize = 1 << 14;

/// The types of components, by the format's numbers.
#[derive(Clone, Copy)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(number: u32) -> Option<Self> {
        Some(match number {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The number of its bytes. Normalised ones are from 0, or -1, to 1.
    fn number(self, bytes: &[u8], normalised: bool) -> f64 {
        let scaled = |number: f64, most: f64| if normalised { (number / most).max(-1.0) } else { number };
        match (self, bytes) {
            (Self::I8, &[a, ..]) => scaled(i8::from_le_bytes([a]).into(), 127.0),
            (Self::U8, &[a, ..]) => scaled(a.into(), 255.0),
            (Self::I16, &[a, b, ..]) => scaled(i16::from_le_bytes([a, b]).into(), 32767.0),
            (Self::U16, &[a, b, ..]) => scaled(u16::from_le_bytes([a, b]).into(), 65535.0),
            (Self::U32, &[a, b, c, d, ..]) => u32::from_le_bytes([a, b, c, d]).into(),
            (Self::F32, &[a, b, c, d, ..]) => f32::from_le_bytes([a, b, c, d]).into(),
            _ => f64::NAN,
        }
    }
}

/// The number of components of an accessor's type.
fn width(kind: &str) -> Option<usize> {
    Some(match kind {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" => 4,
        _ => return None,
    })
}

/// Reads accessors of a document. Each takes no more memory than eight times the bytes that it names, or than the file
/// has bytes where it names none.
pub(super) struct Numbers<'d, 'b> {
    pub(super) document: &'d Document,
    pub(super) buffers: &'b mut Buffers<'d>,
    /// Size of the file in bytes.
    pub(super) size: usize,
}

impl<'d> Numbers<'d, '_> {
    fn accessor(&self, index: usize) -> Result<&'d Accessor, ScanFault> {
        let count = self.document.accessors.len();
        self.document.accessors.get(index).ok_or_else(|| malformed(place(index), of(count)))
    }

    pub(super) fn count(&self, index: usize) -> Result<usize, ScanFault> {
        Ok(self.accessor(index)?.count)
    }

    /// The elements of an accessor, of which the first `N` components are taken; it has one of the numbers `widths` of
    /// them.
    pub(super) fn read<const N: usize>(&mut self, index: usize, widths: &[usize]) -> Result<Vec<[f64; N]>, ScanFault> {
        let accessor = self.accessor(index)?;
        let fault = |message: String| malformed(place(index), message);
        let Some(component) = Component::of(accessor.component_type) else {
            return Err(fault(format!("it has the unknown componentType {}", accessor.component_type)));
        };
        let Some(width) = width(&accessor.kind).filter(|width| widths.contains(width)) else {
            let expected = widths.iter().map(|w| if *w == 1 { "SCALAR".into() } else { format!("VEC{w}") });
            let expected: Vec<String> = expected.collect();
            let message = format!("its type is `{}`; expected {}", shown(&accessor.kind), expected.join(" or "));
            return Err(fault(message));
        };
        let element = Element { component, width, normalised: accessor.normalized };
        let mut values = match accessor.buffer_view {
            Some(view) => self.elements(index, view, accessor.byte_offset, accessor.count, element)?,
            // Zeros.
            None if accessor.count <= self.size => vec![[0.0; N]; accessor.count],
            None => return Err(fault(format!("it has {} elements, and no bytes", accessor.count))),
        };
        if let Some(sparse) = &accessor.sparse {
            self.replace(index, sparse, element, &mut values)?;
        }
        Ok(values)
    }

    /// Puts the values of a sparse accessor in their places.
    fn replace<const N: usize>(
        &mut self,
        index: usize,
        sparse: &Sparse,
        element: Element,
        values: &mut [[f64; N]],
    ) -> Result<(), ScanFault> {
        let fault = |message: String| malformed(format!("{}.sparse", place(index)), message);
        let SparseList { buffer_view, byte_offset, component_type } = sparse.indices;
        let component = Component::of(component_type).filter(|c| !matches!(c, Component::F32));
        let component = component.ok_or_else(|| fault(format!("its indices have componentType {component_type}")))?;
        let of_indices = Element { component, width: 1, normalised: false };
        let places: Vec<[f64; 1]> = self.elements(index, buffer_view, byte_offset, sparse.count, of_indices)?;
        let SparseList { buffer_view, byte_offset, .. } = sparse.values;
        let replacements = self.elements::<N>(index, buffer_view, byte_offset, sparse.count, element)?;
        let count = values.len();
        for ([place], replacement) in places.into_iter().zip(replacements) {
            let value = values.get_mut(place as usize).filter(|_| place >= 0.0);
            *value.ok_or_else(|| fault(format!("it replaces element {place}, but there are {count}")))? = replacement;
        }
        Ok(())
    }

    /// Elements from a place in a view on.
    fn elements<const N: usize>(
        &mut self,
        index: usize,
        view: usize,
        offset: usize,
        count: usize,
        element: Element,
    ) -> Result<Vec<[f64; N]>, ScanFault> {
        if count == 0 {
            return Ok(Vec::new());
        }
        let Element { component, width, normalised } = element;
        let size = width * component.bytes();
        let (described, bytes) = self.buffers.view(self.document, view)?;
        let stride = described.byte_stride.unwrap_or(size);
        if stride < component.bytes() {
            let message = format!("its byteStride is {stride}, which is less than a number has");
            return Err(malformed(format!("bufferViews[{view}]"), message));
        }
        let end = (count - 1).checked_mul(stride).and_then(|last| last.checked_add(offset)?.checked_add(size));
        if end.is_none_or(|end| end > bytes.len()) {
            let message = format!(
                "its {count} elements of {size} bytes, every {stride} from byte {offset} on, do not fit into bufferViews[{view}] of {} \
                 bytes; export it again",
                bytes.len()
            );
            return Err(malformed(place(index), message));
        }
        let number = |at: usize, k: usize| match k < width {
            true => component.number(&bytes[at + k * component.bytes()..], normalised),
            false => 0.0,
        };
        let read = |i: usize| std::array::from_fn(|k| number(offset + i * stride, k));
        Ok((0..count).into_par_iter().with_min_len(CHUNK).map(read).collect())
    }
}

#[derive(Clone, Copy)]
struct Element {
    component: Component,
    width: usize,
    normalised: bool,
}

fn place(index: usize) -> String {
    format!("accessors[{index}]")
}
