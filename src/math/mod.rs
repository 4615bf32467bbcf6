//! Mathematics that several rooms need. This room knows no other one.
//!
//! | module | holds |
//! |---|---|
//! | [`radical_inverse`](mod@radical_inverse) | the radical inverse in any base, in integers |
//! | [`sequence`] | Halton and Hammersley points |
//! | [`discrepancy`] | how evenly a point set fills the unit square |
//! | [`hash`] | random numbers that depend only on a seed, an index and a stream |
//! | [`quadrature`] | Gauss-Legendre nodes, directions and solid angles that integrate over the sphere |
//! | [`octahedral`] | unit vectors in two coordinates |
//! | [`byte_lists`] | lists of bytes for `serde` |
//! | [`cholesky`](mod@cholesky) | small systems of linear equations |
//! | [`color`] | sRGB, luminance, 8-bit codes |
//! | [`color_matching`](mod@color_matching) | from spectra to linear colours |
//! | [`exponential_integral`](mod@exponential_integral) | the exponential integral E₁ |
//! | [`interpolation`] | the smooth step |
//! | [`mip`] | a texture with its mip levels |
//! | [`resample`] | images at another size: filtering in linear light with colours weighted by alpha |
//! | [`compute_once`](mod@compute_once) | shared values that parallel work computes |
//! | [`digits`] | numbers formatted for people |
//! | [`names`] | the name that a misspelt one was meant to be |
//! | [`range`] | the range, steps and unit of a number that people set |

pub mod byte_lists;
pub mod cholesky;
pub mod color;
pub mod color_matching;
pub mod compute_once;
pub mod digits;
pub mod discrepancy;
mod error;
pub mod exponential_integral;
pub mod hash;
pub mod interpolation;
pub mod mip;
pub mod names;
pub mod octahedral;
pub mod quadrature;
pub mod radical_inverse;
pub mod range;
pub mod resample;
pub mod sequence;

pub use color::{LUMINANCE_WEIGHTS, linear_to_srgb, luminance, srgb_to_linear};
pub use compute_once::compute_once;
pub use discrepancy::star_discrepancy;
pub use error::MathError;
pub use exponential_integral::exponential_integral;
pub use interpolation::smoothstep;
pub use mip::{MipChain, MipView};
pub use quadrature::SphereQuadrature;
pub use radical_inverse::{RadicalInverse, radical_inverse};
pub use range::Range;
pub use sequence::{HaltonSequence, halton, hammersley};
