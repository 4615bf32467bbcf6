//! Decodes buffer views of EXT_meshopt_compression [Kapoulkine 2021, glTF 2.0 extension, appendices A and B]: vertex
//! attributes, triangle indices and index sequences, and their filters.
//!
//! Nothing in the data is trusted: whatever they hold, the decoder ends with as many bytes as the view claims, or without.

/// Vertices of a block are a multiple of this.
const GROUP: usize = 16;
/// Bytes that a block of vertices should not exceed.
const BLOCK_BYTES: usize = 8192;
/// Most vertices of a block.
const MOST_IN_BLOCK: usize = 256;

/// What a buffer view holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    Attributes,
    Triangles,
    Indices,
}

/// What is applied to decoded attributes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Filter {
    None,
    Octahedral,
    Quaternion,
    Exponential,
}

/// Decodes `count` elements of `stride` bytes; `None` if the data are damaged or no such data.
pub(super) fn decode(data: &[u8], mode: Mode, filter: Filter, count: usize, stride: usize) -> Option<Vec<u8>> {
    match mode {
        Mode::Attributes => {
            let mut bytes = attributes(data, count, stride)?;
            apply(filter, &mut bytes, stride)?;
            Some(bytes)
        }
        Mode::Triangles => indices_to_bytes(&triangles(data, count)?, stride),
        Mode::Indices => indices_to_bytes(&sequence(data, count)?, stride),
    }
}

fn indices_to_bytes(indices: &[u32], stride: usize) -> Option<Vec<u8>> {
    match stride {
        2 => Some(indices.iter().flat_map(|index| (*index as u16).to_le_bytes()).collect()),
        4 => Some(indices.iter().flat_map(|index| index.to_le_bytes()).collect()),
        _ => None,
    }
}

/// Bytes that are read one by one.
struct Reader<'a> {
    data: &'a [u8],
    at: usize,
}

impl<'a> Reader<'a> {
    fn byte(&mut self) -> Option<u8> {
        let byte = self.data.get(self.at).copied()?;
        self.at += 1;
        Some(byte)
    }

    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let end = self.at.checked_add(count)?;
        let taken = self.data.get(self.at..end)?;
        self.at = end;
        Some(taken)
    }

    /// A number of seven bits a byte, the lowest first.
    fn variable(&mut self) -> Option<u32> {
        let mut value = 0u32;
        for shift in [0, 7, 14, 21, 28] {
            let byte = self.byte()?;
            value |= u32::from(byte & 127) << shift;
            if byte < 128 {
                return Some(value);
            }
        }
        Some(value)
    }

    /// An index as its difference from the last one.
    fn index(&mut self, last: u32) -> Option<u32> {
        let value = self.variable()?;
        Some(last.wrapping_add((value >> 1) ^ (value & 1).wrapping_neg()))
    }
}

/// Appendix A, "mode 0: attributes".
fn attributes(data: &[u8], count: usize, stride: usize) -> Option<Vec<u8>> {
    if stride == 0 || stride > 256 || !stride.is_multiple_of(4) || data.first() != Some(&0xa0) {
        return None;
    }
    let tail = data.len().checked_sub(stride.max(32))?.max(1);
    let mut last = data.get(data.len() - stride..)?.to_vec();
    let mut reader = Reader { data: data.get(..tail)?, at: 1 };
    let block = ((BLOCK_BYTES / stride) & !(GROUP - 1)).clamp(GROUP, MOST_IN_BLOCK);
    let mut out = vec![0; count.checked_mul(stride)?];
    let mut deltas = vec![0u8; block];
    for start in (0..count).step_by(block) {
        let vertices = block.min(count - start);
        for (byte, last) in last.iter_mut().enumerate() {
            bytes(&mut reader, &mut deltas[..vertices.next_multiple_of(GROUP)])?;
            for (vertex, delta) in deltas.iter().take(vertices).enumerate() {
                *last = last.wrapping_add((delta >> 1) ^ (delta & 1).wrapping_neg());
                out[(start + vertex) * stride + byte] = *last;
            }
        }
    }
    Some(out)
}

/// The bytes of one column of a block, in groups of 16 with 0, 2, 4 or 8 bits each.
fn bytes(reader: &mut Reader, out: &mut [u8]) -> Option<()> {
    let groups = out.len() / GROUP;
    let header = reader.take(groups.div_ceil(4))?;
    for (group, out) in out.chunks_exact_mut(GROUP).enumerate() {
        let bits = header.get(group / 4)? >> (2 * (group % 4)) & 3;
        match bits {
            0 => out.fill(0),
            3 => out.copy_from_slice(reader.take(GROUP)?),
            bits => {
                let width = 2 * usize::from(bits);
                let per_byte = 8 / width;
                let packed = reader.take(GROUP / per_byte)?;
                let largest = (1u16 << width) as u8 - 1;
                for (at, out) in out.iter_mut().enumerate() {
                    let value = packed.get(at / per_byte)? >> (8 - width * (at % per_byte + 1)) & largest;
                    // The largest number stands for a byte of its own.
                    *out = if value == largest { reader.byte()? } else { value };
                }
            }
        }
    }
    Some(())
}

/// The last vertices and edges, in rings of 16.
struct Fifos {
    vertices: [u32; 16],
    edges: [(u32, u32); 16],
    vertex: usize,
    edge: usize,
}

impl Fifos {
    fn push_vertex(&mut self, index: u32, keep: bool) {
        self.vertices[self.vertex & 15] = index;
        self.vertex += usize::from(keep);
    }

    fn push_edge(&mut self, a: u32, b: u32) {
        self.edges[self.edge & 15] = (a, b);
        self.edge += 1;
    }

    fn vertex(&self, back: usize) -> u32 {
        self.vertices[self.vertex.wrapping_sub(back) & 15]
    }

    fn edge(&self, back: usize) -> (u32, u32) {
        self.edges[self.edge.wrapping_sub(back) & 15]
    }
}

/// Appendix A, "mode 1: triangles".
fn triangles(data: &[u8], count: usize) -> Option<Vec<u32>> {
    let version = match data.first()? {
        0xe0 => 0,
        0xe1 => 1,
        _ => return None,
    };
    if !count.is_multiple_of(3) {
        return None;
    }
    let codes = data.get(1..1 + count / 3)?;
    let end = data.len().checked_sub(16).filter(|end| *end > count / 3)?;
    let table = data.get(end..)?;
    let mut reader = Reader { data: data.get(..end)?, at: 1 + count / 3 };
    let mut fifos = Fifos { vertices: [u32::MAX; 16], edges: [(u32::MAX, u32::MAX); 16], vertex: 0, edge: 0 };
    let (mut next, mut last) = (0u32, 0u32);
    let free = if version >= 1 { 13 } else { 15 };
    let mut out = Vec::with_capacity(count);
    let fresh = |next: &mut u32| {
        let index = *next;
        *next = next.wrapping_add(1);
        index
    };
    for code in codes {
        let (high, low) = (usize::from(code >> 4), usize::from(code & 15));
        let (a, b, c);
        if *code < 0xf0 {
            (a, b) = fifos.edge(1 + high);
            if low < free {
                c = if low == 0 { fresh(&mut next) } else { fifos.vertex(1 + low) };
                fifos.push_vertex(c, low == 0);
            } else {
                last = match low {
                    15 => reader.index(last)?,
                    13 => last.wrapping_sub(1),
                    _ => last.wrapping_add(1),
                };
                c = last;
                fifos.push_vertex(c, true);
            }
            fifos.push_edge(c, b);
            fifos.push_edge(a, c);
        } else {
            let explicit = *code >= 0xfe;
            let auxiliary = if explicit { reader.byte()? } else { *table.get(low)? };
            let (second, third) = (usize::from(auxiliary >> 4), usize::from(auxiliary & 15));
            if explicit && auxiliary == 0 {
                next = 0;
            }
            let by_difference = |corner: usize| explicit && corner == 15;
            let first_is_new = *code != 0xff;
            let ring = |corner: usize, next: &mut u32| match corner {
                0 => fresh(next),
                15 if explicit => 0,
                back => fifos.vertex(back),
            };
            let mut x = if first_is_new { fresh(&mut next) } else { 0 };
            let mut y = ring(second, &mut next);
            let mut z = ring(third, &mut next);
            if !first_is_new {
                last = reader.index(last)?;
                x = last;
            }
            if by_difference(second) {
                last = reader.index(last)?;
                y = last;
            }
            if by_difference(third) {
                last = reader.index(last)?;
                z = last;
            }
            (a, b, c) = (x, y, z);
            fifos.push_vertex(a, true);
            fifos.push_vertex(b, second == 0 || by_difference(second));
            fifos.push_vertex(c, third == 0 || by_difference(third));
            fifos.push_edge(b, a);
            fifos.push_edge(c, b);
            fifos.push_edge(a, c);
        }
        out.extend([a, b, c]);
    }
    Some(out)
}

/// Appendix A, "mode 2: indices".
fn sequence(data: &[u8], count: usize) -> Option<Vec<u32>> {
    if !matches!(data.first()?, 0xd0 | 0xd1) {
        return None;
    }
    let mut reader = Reader { data: data.get(..data.len().checked_sub(4)?)?, at: 1 };
    let mut last = [0u32; 2];
    let mut out = Vec::with_capacity(count.min(data.len()));
    for _ in 0..count {
        let value = reader.variable()?;
        let which = &mut last[(value & 1) as usize];
        let difference = value >> 1;
        *which = which.wrapping_add((difference >> 1) ^ (difference & 1).wrapping_neg());
        out.push(*which);
    }
    Some(out)
}

/// Appendix B: filters.
fn apply(filter: Filter, bytes: &mut [u8], stride: usize) -> Option<()> {
    match (filter, stride) {
        (Filter::None, _) => {}
        (Filter::Octahedral, 4) => {
            for element in bytes.chunks_exact_mut(4) {
                let [x, y, z, _] = [0, 1, 2, 3].map(|at| f32::from(element[at] as i8));
                let unit = octahedral(x, y, z, 127.0);
                for (byte, value) in element.iter_mut().zip(unit) {
                    *byte = value as i8 as u8;
                }
            }
        }
        (Filter::Octahedral, 8) => {
            for element in bytes.chunks_exact_mut(8) {
                let value = |at: usize| f32::from(i16::from_le_bytes([element[2 * at], element[2 * at + 1]]));
                let unit = octahedral(value(0), value(1), value(2), 32_767.0);
                for (bytes, value) in element.chunks_exact_mut(2).zip(unit) {
                    bytes.copy_from_slice(&(value as i16).to_le_bytes());
                }
            }
        }
        (Filter::Quaternion, 8) => {
            for element in bytes.chunks_exact_mut(8) {
                let value = |at: usize| i16::from_le_bytes([element[2 * at], element[2 * at + 1]]);
                let scale = std::f32::consts::FRAC_1_SQRT_2 / f32::from(value(3) | 3);
                let [x, y, z] = [0, 1, 2].map(|at| f32::from(value(at)) * scale);
                let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
                let largest = (value(3) & 3) as usize;
                let mut parts = [0i16; 4];
                for (step, part) in [(1, x), (2, y), (3, z), (0, w)] {
                    parts[(largest + step) & 3] = (part * 32_767.0).round() as i16;
                }
                for (bytes, part) in element.chunks_exact_mut(2).zip(parts) {
                    bytes.copy_from_slice(&part.to_le_bytes());
                }
            }
        }
        (Filter::Exponential, stride) if stride.is_multiple_of(4) => {
            for element in bytes.chunks_exact_mut(4) {
                let value = i32::from_le_bytes([element[0], element[1], element[2], element[3]]);
                let (exponent, mantissa) = (value >> 24, value << 8 >> 8);
                let number = (f64::from(mantissa) * f64::from(exponent).exp2()) as f32;
                element.copy_from_slice(&number.to_le_bytes());
            }
        }
        _ => return None,
    }
    Some(())
}

/// A direction from its octahedral form, scaled to `most`.
fn octahedral(x: f32, y: f32, one: f32, most: f32) -> [f32; 3] {
    let z = one - x.abs() - y.abs();
    let fold = z.min(0.0);
    let x = x + if x >= 0.0 { fold } else { -fold };
    let y = y + if y >= 0.0 { fold } else { -fold };
    let length = (x * x + y * y + z * z).sqrt().max(f32::MIN_POSITIVE);
    [x, y, z].map(|part| (part * most / length).round())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_examples_of_the_reference_decoder_are_read() {
        // meshoptimizer, tests of the codecs: four vertices of 12 bytes, four triangles, a sequence.
        let mut vertices = vec![0xa0];
        let columns: [&[u8]; 12] = [
            &[0x01, 0x3f, 0, 0, 0, 0x58, 0x57, 0x58],
            &[0x01, 0x26, 0, 0, 0],
            &[0x01, 0x0c, 0, 0, 0, 0x58],
            &[0x01, 0x08, 0, 0, 0],
            &[0],
            &[0],
            &[0],
            &[0],
            &[0x01, 0x3f, 0, 0, 0, 0x17, 0x18, 0x17],
            &[0x01, 0x26, 0, 0, 0],
            &[0x01, 0x0c, 0, 0, 0, 0x17],
            &[0x01, 0x08, 0, 0, 0],
        ];
        vertices.extend(columns.concat());
        vertices.extend([0; 32]);
        let out = decode(&vertices, Mode::Attributes, Filter::None, 4, 12);
        let expected: Vec<u8> =
            [[0u16, 0, 0, 0, 0, 0], [300, 0, 0, 0, 500, 0], [0, 300, 0, 0, 0, 500], [300, 300, 0, 0, 500, 500]]
                .iter()
                .flatten()
                .flat_map(|value| value.to_le_bytes())
                .collect();
        assert_eq!(out, Some(expected));
        let triangles = [
            0xe0, 0xf0, 0x10, 0xfe, 0xff, 0xf0, 0x0c, 0xff, 0x02, 0x02, 0x02, 0x00, 0x76, 0x87, 0x56, 0x67, 0x78, 0xa9,
            0x86, 0x65, 0x89, 0x68, 0x98, 0x01, 0x69, 0x00, 0x00,
        ];
        let out = decode(&triangles, Mode::Triangles, Filter::None, 12, 4).expect("triangles");
        let indices: Vec<u32> =
            out.chunks_exact(4).map(|bytes| u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])).collect();
        assert_eq!(indices, [0, 1, 2, 2, 1, 3, 4, 6, 5, 7, 8, 9]);
        let sequence = [0xd1, 0x00, 0x04, 0xcd, 0x01, 0x04, 0x07, 0x98, 0x1f, 0x00, 0x00, 0x00, 0x00];
        let out = decode(&sequence, Mode::Indices, Filter::None, 6, 4).expect("a sequence");
        let indices: Vec<u32> =
            out.chunks_exact(4).map(|bytes| u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])).collect();
        assert_eq!(indices, [0, 1, 51, 2, 49, 1000]);
    }

    #[test]
    fn filters_give_unit_vectors() {
        let mut bytes = vec![0, 0, 127, 5, 127, 0, 127, 5, (-60i8) as u8, 60, 127, 5];
        apply(Filter::Octahedral, &mut bytes, 4).expect("a filter");
        assert_eq!(bytes[..8], [0, 0, 127, 5, 127, 0, 0, 5]);
        let mut bytes = 0x0300_0005u32.to_le_bytes().to_vec();
        apply(Filter::Exponential, &mut bytes, 4).expect("a filter");
        assert_eq!(bytes, 40.0f32.to_le_bytes());
        assert!(apply(Filter::Octahedral, &mut [0; 12], 12).is_none());
    }

    #[test]
    fn damage_is_answered() {
        for mode in [Mode::Attributes, Mode::Triangles, Mode::Indices] {
            for first in [0xa0, 0xe0, 0xe1, 0xd0, 0x00] {
                for length in [0, 1, 5, 17, 40, 90] {
                    let mut data = vec![0xff; length];
                    if let Some(byte) = data.first_mut() {
                        *byte = first;
                    }
                    let out = decode(&data, mode, Filter::None, 12, 4);
                    assert!(out.is_none_or(|out| out.len() == 48));
                }
            }
        }
    }
}
