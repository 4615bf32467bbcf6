//! Points in the binary geometries of a GeoPackage [OGC 12-128r18, 2.1.3]: a header and well-known binary [ISO 13249-3]. The
//! flags of EWKB (PostGIS) for heights, measures and a system are understood too.

/// What a geometry is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Geometry {
    /// A point, or the first of several: its east and its north coordinate, finite.
    Point(f64, f64),
    /// A geometry without a position.
    Empty,
    /// Another kind than points, by its name.
    Other(&'static str),
    /// No geometry: cut off or overwritten.
    Damaged,
}

impl Geometry {
    /// The geometry in a value of a geometry column.
    pub fn of(blob: &[u8]) -> Self {
        parse(blob).unwrap_or(Self::Damaged)
    }
}

/// Bytes that are not read yet, and the order of those in a number.
struct Bytes<'a> {
    rest: &'a [u8],
    little_endian: bool,
}

impl Bytes<'_> {
    fn take<const COUNT: usize>(&mut self) -> Option<[u8; COUNT]> {
        let (head, rest) = self.rest.split_first_chunk()?;
        self.rest = rest;
        Some(*head)
    }

    fn skip(&mut self, count: usize) -> Option<()> {
        self.rest = self.rest.get(count..)?;
        Some(())
    }

    fn whole(&mut self) -> Option<u32> {
        let bytes = self.take()?;
        Some(if self.little_endian { u32::from_le_bytes(bytes) } else { u32::from_be_bytes(bytes) })
    }

    fn real(&mut self) -> Option<f64> {
        let bytes = self.take()?;
        Some(if self.little_endian { f64::from_le_bytes(bytes) } else { f64::from_be_bytes(bytes) })
    }

    /// The kind of the geometry that begins here, and the number of coordinates of its points.
    fn kind(&mut self) -> Option<(u32, usize)> {
        self.little_endian = match self.take()? {
            [0] => false,
            [1] => true,
            _ => return None,
        };
        let word = self.whole()?;
        let flag = |bit: u32| word & bit != 0;
        // EWKB has flags for height, measure and the number of a system; ISO adds thousands to the kind.
        if flag(0x2000_0000) {
            self.skip(4)?;
        }
        let kind = word & 0x1FFF_FFFF;
        let (height, measure) = match kind / 1000 {
            0 => (flag(0x8000_0000), flag(0x4000_0000)),
            1 => (true, false),
            2 => (false, true),
            3 => (true, true),
            _ => return None,
        };
        Some((kind % 1000, 2 + usize::from(height) + usize::from(measure)))
    }

    /// The coordinates of a point. Those of an empty point are no numbers.
    fn point(&mut self, coordinates: usize) -> Option<Geometry> {
        let (x, y) = (self.real()?, self.real()?);
        self.skip(8 * (coordinates - 2))?;
        Some(if x.is_finite() && y.is_finite() { Geometry::Point(x, y) } else { Geometry::Empty })
    }

    /// The first of several points, all of which must be there.
    fn first_point(&mut self, coordinates: usize) -> Option<Geometry> {
        let count = usize::try_from(self.whole()?).ok()?;
        if count == 0 {
            return Some(Geometry::Empty);
        }
        // Each point has its own byte order and kind before its coordinates.
        if self.rest.len() < count.checked_mul(5 + 8 * coordinates)? {
            return None;
        }
        let mut first = None;
        for _ in 0..count {
            match self.kind()? {
                (1, coordinates) => first = first.or(Some(self.point(coordinates)?)),
                _ => return None,
            }
        }
        first
    }
}

/// The geometry of a blob; `None` for a damaged one.
fn parse(blob: &[u8]) -> Option<Geometry> {
    let mut bytes = Bytes { rest: blob.strip_prefix(b"GP")?, little_endian: false };
    let [version, flags] = bytes.take()?;
    if version != 0 {
        return None;
    }
    if flags & 0b10_0000 != 0 {
        return Some(Geometry::Other("extended geometry"));
    }
    let envelope = match (flags >> 1) & 0b111 {
        0 => 0,
        1 => 32,
        2 | 3 => 48,
        4 => 64,
        _ => return None,
    };
    // The number of the system is that of the layer.
    bytes.skip(4 + envelope)?;
    if flags & 0b1_0000 != 0 {
        return Some(Geometry::Empty);
    }
    match bytes.kind()? {
        (1, coordinates) => bytes.point(coordinates),
        (4, coordinates) => bytes.first_point(coordinates),
        (kind, _) => Some(Geometry::Other(name(kind)?)),
    }
}

/// The name of a kind that is no point [OGC 12-128r18, annex G].
fn name(kind: u32) -> Option<&'static str> {
    Some(match kind {
        2 => "LineString",
        3 => "Polygon",
        5 => "MultiLineString",
        6 => "MultiPolygon",
        7 => "GeometryCollection",
        8 => "CircularString",
        9 => "CompoundCurve",
        10 => "CurvePolygon",
        11 => "MultiCurve",
        12 => "MultiSurface",
        15 => "PolyhedralSurface",
        16 => "TIN",
        17 => "Triangle",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(value: u32, little: bool) -> [u8; 4] {
        if little { value.to_le_bytes() } else { value.to_be_bytes() }
    }

    /// A point in well-known binary.
    fn point(kind: u32, system: Option<u32>, coordinates: &[f64], little: bool) -> Vec<u8> {
        let mut bytes = vec![u8::from(little)];
        bytes.extend(number(kind, little));
        bytes.extend(system.into_iter().flat_map(|system| number(system, little)));
        bytes.extend(
            coordinates.iter().flat_map(|value| if little { value.to_le_bytes() } else { value.to_be_bytes() }),
        );
        bytes
    }

    /// A geometry with the header of a GeoPackage.
    fn blob(flags: u8, envelope: usize, binary: &[u8]) -> Vec<u8> {
        [&[b'G', b'P', 0, flags, 0, 0, 0x64, 0xE8], vec![0xAA; envelope].as_slice(), binary].concat()
    }

    fn several(kind: u32, points: &[Vec<u8>], little: bool) -> Vec<u8> {
        let mut bytes = vec![u8::from(little)];
        bytes.extend(number(kind, little));
        bytes.extend(number(points.len() as u32, little));
        bytes.extend(points.concat());
        bytes
    }

    /// All ways to write a point, each of which is damaged wherever it is cut off.
    #[test]
    fn points_are_read_in_every_encoding_and_only_whole() {
        let at = [512_345.25, 5_412_345.75, 301.5, 7.0];
        let mut blobs = Vec::new();
        for little in [false, true] {
            for (kind, system, coordinates) in [
                (1, None, 2),
                (1001, None, 3),
                (2001, None, 3),
                (3001, None, 4),
                (0x8000_0001, None, 3),
                (0x4000_0001, None, 3),
                (0xC000_0001, None, 4),
                (0xA000_0001, Some(25832), 3),
            ] {
                let one = point(kind, system, &at[..coordinates], little);
                let other = point(kind, system, &[1.0; 4][..coordinates], !little);
                blobs.push(blob(0, 0, &one));
                blobs.push(blob(0, 0, &several((kind + 3) & !0x2000_0000, &[one, other], little)));
            }
        }
        for (indicator, length) in [(1, 32), (2, 48), (3, 48), (4, 64)] {
            blobs.push(blob((indicator << 1) | 1, length, &point(1, None, &at[..2], true)));
        }
        for whole in blobs {
            assert_eq!(Geometry::of(&whole), Geometry::Point(at[0], at[1]), "{whole:02x?}");
            for length in 0..whole.len() {
                assert_eq!(Geometry::of(&whole[..length]), Geometry::Damaged, "{length} bytes of {whole:02x?}");
            }
        }
    }

    #[test]
    fn geometries_without_a_position_are_told_apart() {
        let nowhere = point(1, None, &[f64::NAN; 2], true);
        for (found, expected) in [
            (blob(0, 0, &nowhere), Geometry::Empty),
            (blob(0, 0, &point(1, None, &[f64::INFINITY, 0.0], true)), Geometry::Empty),
            (blob(0b1_0000, 0, &[]), Geometry::Empty),
            (blob(0, 0, &several(4, &[], true)), Geometry::Empty),
            (blob(0, 0, &several(4, &[nowhere], true)), Geometry::Empty),
            (blob(0b10_0000, 0, b"EXT1"), Geometry::Other("extended geometry")),
            (blob(0, 0, &several(3, &[], true)), Geometry::Other("Polygon")),
            (blob(0, 0, &several(1006, &[], false)), Geometry::Other("MultiPolygon")),
            // Unknown kinds, thousands, byte orders, envelopes, versions; a point that is none.
            (blob(0, 0, &several(99, &[], true)), Geometry::Damaged),
            (blob(0, 0, &point(4001, None, &[1.0; 4], true)), Geometry::Damaged),
            (blob(0, 0, &[[2].as_slice(), &point(1, None, &[1.0; 2], true)[1..]].concat()), Geometry::Damaged),
            (blob(5 << 1, 64, &point(1, None, &[1.0; 2], true)), Geometry::Damaged),
            (blob(0, 0, &several(4, &[point(2, None, &[1.0; 2], true)], true)), Geometry::Damaged),
            ([b"GP\x01\0\0\0\0\0".as_slice(), &point(1, None, &[1.0; 2], true)].concat(), Geometry::Damaged),
            (b"GP".to_vec(), Geometry::Damaged),
            (Vec::new(), Geometry::Damaged),
        ] {
            assert_eq!(Geometry::of(&found), expected, "{found:02x?}");
        }
        // More points than there are bytes.
        let many =
            [&blob(0, 0, &[1, 4, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF])[..], &point(1, None, &[1.0; 2], true)].concat();
        assert_eq!(Geometry::of(&many), Geometry::Damaged);
    }
}
