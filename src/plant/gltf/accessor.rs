//! Reads accessors. Every length, offset, index and type is checked before a byte is read.
//!
//! [glTF 2.0 specification, section 3.6.2 "Accessors"]. The `gltf` crate's iterators trust the file; these do not.

use gltf::json::accessor::{ComponentType, Type};
use gltf::json::validation::Checked;

use super::container::Document;
use super::error::{EXPORT_AGAIN, Fault, WarningKind, Warnings};

/// Maximum number of elements of an accessor: 33 million, far beyond any plant, so that a forged count cannot request
/// more than a gigabyte.
pub(super) const MOST_ELEMENTS: u64 = 1 << 25;

/// The elements of an accessor, decoded.
pub(super) struct Elements {
    /// The values, element by element. Integers are converted, and normalised if the accessor says so.
    pub values: Vec<f32>,
    /// Values per element.
    pub width: usize,
}

impl Elements {
    /// Number of elements.
    pub fn len(&self) -> usize {
        self.values.len().checked_div(self.width).unwrap_or(0)
    }

    /// Element `index`, or an empty slice past the end.
    pub fn get(&self, index: usize) -> &[f32] {
        self.values.get(index * self.width..(index + 1) * self.width).unwrap_or_default()
    }
}

/// The types that an attribute may have.
pub(super) struct Expected {
    /// Name for messages, such as "POSITION".
    pub name: &'static str,
    /// Scalar or vector; never a matrix.
    pub shape: Type,
    /// Whether 8-bit and 16-bit integers are allowed without normalisation (KHR_mesh_quantization).
    pub integers: bool,
}

/// The declared layout of an accessor.
struct Layout {
    view: Option<usize>,
    offset: u64,
    count: u64,
    component: ComponentType,
    shape: Type,
    normalized: bool,
    stride: u64,
}

impl Layout {
    fn element_size(&self) -> u64 {
        self.component.size() as u64 * self.shape.multiplicity() as u64
    }
}

/// Number of elements that accessor `index` claims to have; 0 if it does not exist.
pub(super) fn claimed_count(document: &Document, index: usize) -> u64 {
    document.root.accessors.get(index).map_or(0, |accessor| accessor.count.0)
}

/// Reads a vertex attribute.
pub(super) fn read_attribute(
    document: &mut Document,
    index: usize,
    expected: &Expected,
    warnings: &mut Warnings,
) -> Result<Elements, Fault> {
    let layout = layout(document, index, warnings)?;
    let float = layout.component == ComponentType::F32;
    let small =
        matches!(layout.component, ComponentType::I8 | ComponentType::U8 | ComponentType::I16 | ComponentType::U16);
    let normalized_uv = matches!(layout.component, ComponentType::U8 | ComponentType::U16)
        && layout.normalized
        && layout.shape == Type::Vec2;
    if layout.shape != expected.shape || !(float || (small && expected.integers) || normalized_uv) {
        let what = format!("{:?} of {:?} cannot serve as {}", layout.shape, layout.component, expected.name);
        return Err(Fault::new(location(index), what, EXPORT_AGAIN));
    }
    let values = read_values(document, index, &layout)?;
    Ok(Elements { values, width: layout.shape.multiplicity() })
}

/// Reads an accessor of one of `shapes`, whatever its components are: joints, weights, matrices, colours, displacements.
pub(super) fn read_any(
    document: &mut Document,
    index: usize,
    shapes: &[Type],
    warnings: &mut Warnings,
) -> Result<Elements, Fault> {
    let layout = layout(document, index, warnings)?;
    if !shapes.contains(&layout.shape) {
        let what = format!("{:?} where {shapes:?} is expected", layout.shape);
        return Err(Fault::new(location(index), what, EXPORT_AGAIN));
    }
    let values = read_values(document, index, &layout)?;
    Ok(Elements { values, width: layout.shape.multiplicity() })
}

/// Reads the indices of a primitive.
pub(super) fn read_indices(document: &mut Document, index: usize, warnings: &mut Warnings) -> Result<Vec<u32>, Fault> {
    let layout = layout(document, index, warnings)?;
    let unsigned = matches!(layout.component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32);
    if layout.shape != Type::Scalar || !unsigned {
        let what = format!("{:?} of {:?} cannot serve as indices", layout.shape, layout.component);
        return Err(Fault::new(location(index), what, EXPORT_AGAIN));
    }
    if layout.stride != layout.element_size() {
        warnings.push(WarningKind::Repaired, location(index), "indices with a byteStride; read nevertheless");
    }
    let raw = read_raw(document, index, &layout)?;
    Ok(raw.chunks_exact(layout.component.size().max(1)).map(unsigned_value).collect())
}

fn location(index: usize) -> String {
    format!("/accessors/{index}")
}

fn layout(document: &Document, index: usize, warnings: &mut Warnings) -> Result<Layout, Fault> {
    let root = &document.root;
    let Some(accessor) = root.accessors.get(index) else {
        let what = format!("does not exist, there are {}", root.accessors.len());
        return Err(Fault::new(location(index), what, EXPORT_AGAIN));
    };
    let (Checked::Valid(component), Checked::Valid(shape)) = (&accessor.component_type, &accessor.type_) else {
        return Err(Fault::new(location(index), "unknown type or componentType", EXPORT_AGAIN));
    };
    if accessor.count.0 > MOST_ELEMENTS {
        let what = format!("claims {} elements, more than the {MOST_ELEMENTS} that are read", accessor.count.0);
        return Err(Fault::new(location(index), what, "split or simplify the plant"));
    }
    let mut layout = Layout {
        view: accessor.buffer_view.map(|view| view.value()),
        offset: accessor.byte_offset.map_or(0, |offset| offset.0),
        count: accessor.count.0,
        component: component.0,
        shape: *shape,
        normalized: accessor.normalized,
        stride: 0,
    };
    let view = layout.view.and_then(|view| root.buffer_views.get(view));
    let given = view.and_then(|view| view.byte_stride).map_or(0, |stride| stride.0 as u64);
    layout.stride = if given == 0 { layout.element_size() } else { given };
    if layout.stride < layout.element_size() {
        let what = format!("elements of {} bytes overlap, byteStride is {given}", layout.element_size());
        return Err(Fault::new(location(index), what, EXPORT_AGAIN));
    }
    let aligned = |offset: u64| offset.is_multiple_of(layout.component.size() as u64);
    if !aligned(layout.offset) || !aligned(layout.stride) {
        let message = "not aligned to its component size; read nevertheless";
        warnings.push(WarningKind::Repaired, location(index), message);
    }
    Ok(layout)
}

/// The bytes of an accessor, tightly packed, with sparse substitutions applied.
fn read_raw(document: &mut Document, index: usize, layout: &Layout) -> Result<Vec<u8>, Fault> {
    let size = layout.element_size();
    let (wide, count) = (size as usize, layout.count as usize);
    let mut raw = match layout.view {
        None => vec![0; wide * count],
        Some(view) => {
            let bytes = document.view(view)?;
            let source = strided(bytes, layout.offset, layout.stride, size, layout.count).ok_or_else(|| {
                let what = format!(
                    "{count} elements of {size} bytes from byte {} leave bufferView {view} of {} bytes",
                    layout.offset,
                    bytes.len()
                );
                Fault::new(location(index), what, EXPORT_AGAIN)
            })?;
            let mut raw = Vec::with_capacity(wide * count);
            for element in 0..count {
                let at = element * layout.stride as usize;
                raw.extend_from_slice(&source[at..at + wide]);
            }
            raw
        }
    };
    let sparse = document.root.accessors[index].sparse.clone();
    if layout.view.is_none() && sparse.is_none() && count > 0 {
        let what = "has no bufferView, so all of it would be zero";
        return Err(Fault::new(location(index), what, EXPORT_AGAIN));
    }
    if let Some(sparse) = sparse {
        substitute(document, index, &sparse, layout, &mut raw)?;
    }
    Ok(raw)
}

/// The part of `bytes` that `count` elements of `size` bytes occupy, `stride` bytes apart, from `offset` on.
fn strided(bytes: &[u8], offset: u64, stride: u64, size: u64, count: u64) -> Option<&[u8]> {
    if count == 0 {
        return Some(&[]);
    }
    let span = (count - 1).checked_mul(stride)?.checked_add(size)?;
    let begin = usize::try_from(offset).ok()?;
    let end = usize::try_from(offset.checked_add(span)?).ok()?;
    bytes.get(begin..end)
}

/// Overwrites the elements that a sparse accessor names.
fn substitute(
    document: &mut Document,
    index: usize,
    sparse: &gltf::json::accessor::sparse::Sparse,
    layout: &Layout,
    raw: &mut [u8],
) -> Result<(), Fault> {
    let at = format!("/accessors/{index}/sparse");
    let damaged = |what: String| Fault::new(at.clone(), what, EXPORT_AGAIN);
    let count = sparse.count.0;
    if count > layout.count {
        return Err(damaged(format!("substitutes {count} of {} elements", layout.count)));
    }
    let Checked::Valid(component) = &sparse.indices.component_type else {
        return Err(damaged("unknown componentType of the indices".into()));
    };
    let (narrow, size) = (component.0.size(), layout.element_size());
    let leaves = |view: usize| damaged(format!("{count} elements leave bufferView {view}"));
    let view = sparse.indices.buffer_view.value();
    let offset = sparse.indices.byte_offset.0;
    let indices: Vec<usize> = strided(document.view(view)?, offset, narrow as u64, narrow as u64, count)
        .ok_or_else(|| leaves(view))?
        .chunks_exact(narrow)
        .map(|bytes| unsigned_value(bytes) as usize)
        .collect();
    let view = sparse.values.buffer_view.value();
    let values =
        strided(document.view(view)?, sparse.values.byte_offset.0, size, size, count).ok_or_else(|| leaves(view))?;
    for (element, value) in indices.into_iter().zip(values.chunks_exact(size as usize)) {
        let target = element.checked_mul(size as usize).and_then(|at| raw.get_mut(at..at + size as usize));
        let Some(target) = target else {
            return Err(damaged(format!("index {element} is out of range, there are {} elements", layout.count)));
        };
        target.copy_from_slice(value);
    }
    Ok(())
}

fn read_values(document: &mut Document, index: usize, layout: &Layout) -> Result<Vec<f32>, Fault> {
    let raw = read_raw(document, index, layout)?;
    let component = layout.component;
    // Normalisation as in section 3.6.2.2 of the specification: c / 127 clamped from below, c / 255 and so on.
    let scale = match (layout.normalized, component) {
        (true, ComponentType::I8) => 127.0,
        (true, ComponentType::U8) => 255.0,
        (true, ComponentType::I16) => 32_767.0,
        (true, ComponentType::U16) => 65_535.0,
        _ => 1.0,
    };
    let decode = |bytes: &[u8]| match (component, bytes) {
        (ComponentType::F32, &[a, b, c, d]) => f32::from_le_bytes([a, b, c, d]),
        (ComponentType::I8, &[a]) => (f32::from(a as i8) / scale).max(if scale > 1.0 { -1.0 } else { f32::MIN }),
        (ComponentType::I16, &[a, b]) => {
            (f32::from(i16::from_le_bytes([a, b])) / scale).max(if scale > 1.0 { -1.0 } else { f32::MIN })
        }
        _ => unsigned_value(bytes) as f32 / scale,
    };
    Ok(raw.chunks_exact(component.size()).map(decode).collect())
}

/// A little-endian unsigned integer of 1 to 4 bytes.
fn unsigned_value(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |value, &byte| value << 8 | u32::from(byte))
}
