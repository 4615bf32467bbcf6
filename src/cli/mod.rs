//! The command line: its arguments, its progress bars, its exit codes. What the arguments ask for is done by the library.

mod arguments;
mod exit;
mod progress;
mod request;
mod surveys;

pub use arguments::{Arguments, Command, Compare, Profile};
pub use exit::{Outcome, finish, print_lines};
pub use progress::Bars;
pub use request::{
    bake_options, baked_scene, compare_options, export_options, fly_options, leaf_options, merge_options, no_command,
    profile_options, reference_options, render_options, tune_options,
};
pub use surveys::check_surveys;
