//! From a file or its bytes to a table, whatever the format is.

use std::path::Path;

use super::super::ScatterError;
#[cfg(feature = "geopackage")]
use super::geopackage;
use super::place::PlaceColumns;
use super::text::Table;
use super::{InventoryOptions, geojson, shapefile, text};

/// A table before its columns are understood.
pub(super) struct Source {
    pub table: Table,
    /// Where its positions are, if the format says so.
    pub place: Option<PlaceColumns>,
    /// The coordinate system in WKT, if the format states one.
    pub wkt: Option<String>,
}

impl Source {
    /// The table in a file.
    pub fn of_file(path: &Path, options: InventoryOptions) -> Result<Self, ScatterError> {
        let bytes = std::fs::read(path).map_err(|source| ScatterError::Io { path: path.to_owned(), source })?;
        if shapefile::recognises(&bytes) {
            let (table, place, wkt) = shapefile::read(path, &bytes)?;
            return Ok(Self { table, place: Some(place), wkt }.without_layers(options));
        }
        let name = path.display().to_string();
        #[cfg(feature = "geopackage")]
        if geopackage::recognises(&bytes) {
            let mut source = Self::of_bytes(&bytes, &name, options)?;
            source.table.notes.extend(geopackage::unread_changes(path));
            return Ok(source);
        }
        Self::of_bytes(&bytes, &name, options)
    }

    /// The table in the bytes of a file called `name`, which has no files beside it.
    pub fn of_bytes(bytes: &[u8], name: &str, options: InventoryOptions) -> Result<Self, ScatterError> {
        #[cfg(feature = "geopackage")]
        if geopackage::recognises(bytes) {
            let (table, place, wkt) = geopackage::read(bytes, name, options.layer)?;
            return Ok(Self { table, place: Some(place), wkt });
        }
        let (table, place) = if geojson::recognises(bytes) {
            let (table, place) = geojson::read(bytes, name)?;
            (table, Some(place))
        } else {
            (text::read(bytes, name)?, None)
        };
        Ok(Self { table, place, wkt: None }.without_layers(options))
    }

    /// Says that a format has no layers, where one is chosen.
    fn without_layers(mut self, options: InventoryOptions) -> Self {
        if let Some(layer) = options.layer {
            self.table.notes.push(format!("the layer {layer} is not chosen: only a GeoPackage has layers"));
        }
        self
    }
}
