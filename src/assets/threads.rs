//! The number of background threads.

use std::thread;

/// All cores but one, which is left for the frames; at least one.
pub fn spare_cores() -> usize {
    thread::available_parallelism().map_or(1, |cores| cores.get().saturating_sub(1).max(1))
}
