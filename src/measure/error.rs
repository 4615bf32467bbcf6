//! Errors of measures.

/// Why pictures cannot be measured.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MeasureError {
    /// A picture without pixels.
    #[error("the picture has no pixels")]
    Empty,
    /// Another number of pixels than the size says.
    #[error("a picture of {width}x{height} pixels cannot have {pixels} of them")]
    Length {
        /// Width in pixels.
        width: usize,
        /// Height in pixels.
        height: usize,
        /// Number of pixels.
        pixels: usize,
    },
    /// Two pictures of different sizes.
    #[error("the sizes differ: {}x{} and {}x{} pixels", first.0, first.1, second.0, second.1)]
    Sizes {
        /// Width and height of the first one.
        first: (usize, usize),
        /// Width and height of the second one.
        second: (usize, usize),
    },
    /// A picture of a display beside one of a scene's radiance.
    #[error("one is as a display shows it (PNG, JPEG), the other is a scene's radiance (EXR)")]
    Lights,
    /// A mask that leaves no pixel.
    #[error("the mask leaves no pixel to compare; it counts where it is white")]
    NoPixels,
    /// Not a number of pixels per degree.
    #[error("{0} is not a number of pixels per degree (expected 1 to 1000; 67 is a 4K monitor at arm's length)")]
    PixelsPerDegree(String),
}
