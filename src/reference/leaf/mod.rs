//! The layered leaf model [Franzke 2005, 3.2]: what the tissue of a leaf does to the light that its textures colour.
//!
//! A leaf is a plane with a thickness. Its colours come from textures: front, back, transmission. The tissue between the
//! leaf's plane and a virtual plane behind it decides how dark a texel is and where the light is looked at ([`layers`]):
//! rays to the light start inside the leaf, up to some tenths of a millimetre beside the point that is seen, so that
//! shadows have a soft edge. How the light changes with the angle follows from the same three layers as slabs that scatter
//! ([`crate::plant::tissue_light`]).
//!
//! | part | file |
//! |---|---|
//! | ways through the layers, test points | `layers.rs` |
//! | one part of a plant with its textures | `part.rs` |
//! | one point of a leaf, seen from somewhere | `view.rs` |
//!
//! # Cost
//! Two polynomials for each direction of light, where a leaf is; `docs/measurements/leaves.md` has the times. A species
//! without a tissue is traced by the standard model and pays nothing.
//!
//! # Limits
//! - Rays to the light have the direction of the light outside (the thesis allows itself that error).
//! - The gloss is that of the standard model, about the bumped normal.
//! - Between two triangles of a curved leaf the start of such a ray is raised a little, so that the leaf does not shade itself; what
//!   lies closer than some hundredths of a millimetre above it throws no shadow.

pub(crate) mod layers;
mod part;
mod surface;
mod view;

pub(crate) use part::PartLeaf;
pub(crate) use view::LeafView;

/// How leaves scatter light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum LeafModel {
    /// As their material says: by layers where it has a tissue, otherwise by the standard model. The renderer does the same.
    #[default]
    Species,
    /// By the front and the transmission alone, the same from every angle and on both sides.
    Standard,
    /// By the layers of their tissue, with all textures; where the material has no tissue, by those of a usual leaf.
    Layers,
    /// The same as the thesis prints it: light falls with the angle by its way to the test points and back, which is that
    /// through one medium (eq. 3.5), all test points have equal weights, the absorption texture is the luminance of the
    /// transmission, and colours are attenuated whatever they were measured through.
    Published,
}
